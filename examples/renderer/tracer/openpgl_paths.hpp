// The paths of a sample as Open PGL's segments, and the radiance samples that train its field.
//
// Open PGL's own PathSegmentStorage turns segments into samples, since it knows what its fields can learn. It
// follows distances through mirrors and glass, for parallax. It leaves delta lobes out, and bounds weights
// that would spoil a fit.
//
// A vertex learns the light that a direction sampled there brings to the picture. This is light that is hit
// next, with its MIS weight if next-event estimation finds it too. It is also next-event estimation at later
// vertices, and all that follows. Next-event estimation at the vertex itself does not count, since no sampled
// direction replaces it.
//
// Memory: 136 bytes a vertex, paths × depths of them, and 16 a path.
#pragma once

#include "tracer/path_state.hpp"

#include <wfpg/exec/tbb.hpp>
#include <wfpg/sampling/mixture.hpp>

#include <openpgl/cpp/OpenPGL.h>
#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace render {

inline pgl_vec3f to_pgl(vec3 v) {
  return {v.x, v.y, v.z};
}
inline vec3 from_pgl(pgl_vec3f v) {
  return {v.x, v.y, v.z};
}

/// The kernels' view of openpgl_paths: a recorder as path_kernels.hpp needs it. Calls for one path come from
/// one thread at a time, in order of depth.
class openpgl_recorder {
 public:
  using segment = openpgl::cpp::PathSegment;

  void vertex(std::uint32_t path, std::uint32_t depth, vec3 position, vec3 outgoing, vec3 throughput) const {
    if (depth > 0) {
      // Factors besides the BSDF: roulette, and absorption along the segment.
      segment& before = at(path, depth - 1);
      before.transmittanceWeight = to_pgl(divided(throughput, scattered(path, before)));
    }
    append(path, depth, position, outgoing);
    throughputs_[path] = throughput;
  }

  void radiance(std::uint32_t path, std::uint32_t depth, vec3 contribution) const {
    openpgl::cpp::AddScatteredContribution(&at(path, depth),
                                           to_pgl(divided(contribution, throughputs_[path])));
  }

  /// Records emission with its MIS weight, of a vertex or of the environment. For the environment `depth` has
  /// no vertex.
  void emission(std::uint32_t path, std::uint32_t depth, vec3 contribution) const {
    if (depth < lengths_[path]) {
      openpgl::cpp::AddDirectContribution(&at(path, depth),
                                          to_pgl(divided(contribution, throughputs_[path])));
    } else if (depth > 0) {
      const segment& before = at(path, depth - 1);
      const vec3 direction = from_pgl(before.directionIn);
      const vec3 arriving = divided(contribution, scattered(path, before));
      append(path, depth, from_pgl(before.position) + far * direction, -direction);
      openpgl::cpp::SetDirectContribution(&at(path, depth), to_pgl(arriving));
    }
  }

  // drawn() and emission() record the data of these.
  void scatter(std::uint32_t, std::uint32_t, const wfpg::sampled_direction&) const {}
  void escape(std::uint32_t, std::uint32_t, vec3) const {}

  /// Records the direction from vertex `depth`, a point on surface s.
  void drawn(std::uint32_t path, std::uint32_t depth, const wfpg::surface<bsdf>& s,
             const wfpg::sampled_direction& next) const {
    if (!(next.pdf > 0.0f)) return;  // the path ends here
    const bool delta = next.technique == wfpg::sampling_technique::delta;
    const wfpg::glossy_part glossy = s.bsdf.glossy(s.outgoing);
    segment& here = at(path, depth);
    here.normal = to_pgl(s.normal);
    here.directionIn = to_pgl(next.direction);
    here.pdfDirectionIn = next.pdf;
    here.isDelta = delta;
    here.scatteringWeight = to_pgl(delta ? s.bsdf.delta_weight_rgb(s.outgoing, next.direction, next.pdf)
                                         : s.bsdf.eval_rgb(s.outgoing, next.direction) / next.pdf);
    here.eta = s.bsdf.ior_beyond(s.outgoing, next.direction);
    here.roughness = 1.0f + glossy.fraction * (glossy.alpha - 1.0f);
  }

 private:
  friend class openpgl_paths;

  static constexpr float far = 1e6f;  // distance of the environment, Open PGL's largest

  segment& at(std::uint32_t path, std::uint32_t depth) const { return segments_[path * max_depth_ + depth]; }

  void append(std::uint32_t path, std::uint32_t depth, vec3 position, vec3 outgoing) const {
    segment& here = at(path, depth);
    here = {};
    here.position = to_pgl(position);
    here.directionOut = to_pgl(outgoing);
    lengths_[path] = depth + 1;
  }

  /// The throughput after the path's last vertex.
  vec3 scattered(std::uint32_t path, const segment& last) const {
    return throughputs_[path] * from_pgl(last.scatteringWeight);
  }

  // Zero where the throughput is zero.
  static vec3 divided(vec3 a, vec3 b) {
    const auto channel = [](float x, float y) { return y > 0.0f ? x / y : 0.0f; };
    return {channel(a.x, b.x), channel(a.y, b.y), channel(a.z, b.z)};
  }

  std::size_t max_depth_ = 0;
  segment* segments_ = nullptr;  // contiguous per path
  std::uint32_t* lengths_ = nullptr;
  vec3* throughputs_ = nullptr;  // at the path's last vertex, before its BSDF
};

/// Owns the segments of `paths` paths of at most `max_depth` vertices, and the samples made from them.
class openpgl_paths {
 public:
  openpgl_paths(std::size_t paths, std::size_t max_depth)
      : segments_(paths * max_depth), lengths_(paths), throughputs_(paths) {
    recorder_.max_depth_ = max_depth;
    recorder_.segments_ = segments_.data();
    recorder_.lengths_ = lengths_.data();
    recorder_.throughputs_ = throughputs_.data();
  }

  const openpgl_recorder& recorder() const { return recorder_; }
  const openpgl::cpp::SampleStorage& samples() const { return samples_; }

  std::size_t segment_bytes() const {
    return segments_.size() * sizeof(segments_[0]) + lengths_.size() * sizeof(lengths_[0]) +
           throughputs_.size() * sizeof(throughputs_[0]);
  }
  /// Bytes of the largest number of samples so far.
  std::size_t sample_bytes() const { return most_samples_ * sizeof(openpgl::cpp::SampleData); }

  /// Drops paths and samples.
  void clear() {
    std::fill(lengths_.begin(), lengths_.end(), 0u);
    samples_.Clear();
  }

  /// Makes the samples of all paths, in any order.
  void make_samples(const wfpg::exec::tbb& exec) {
    exec.for_each(lengths_.size(), [this](std::size_t path) { make_samples(path); });
    most_samples_ = std::max(most_samples_, samples_.GetSizeSurface());
  }

 private:
  void make_samples(std::size_t path) {
    if (lengths_[path] < 2) return;
    openpgl::cpp::PathSegmentStorage& storage = storages_.local();
    storage.Reserve(recorder_.max_depth_);
    storage.Clear();
    for (std::size_t i = 0; i < lengths_[path]; ++i)
      storage.AddSegment(segments_[path * recorder_.max_depth_ + i]);
    // Direct light is in the segments, with its MIS weight and roulette.
    storage.PrepareSamples(true, true, true);
    std::size_t count = 0;
    const openpgl::cpp::SampleData* const made = storage.GetSamples(count);
    samples_.AddSamples(made, count);
  }

  std::vector<openpgl::cpp::PathSegment> segments_;
  std::vector<std::uint32_t> lengths_;
  std::vector<vec3> throughputs_;
  openpgl_recorder recorder_;
  ::tbb::enumerable_thread_specific<openpgl::cpp::PathSegmentStorage> storages_;
  openpgl::cpp::SampleStorage samples_;
  std::size_t most_samples_ = 0;
};

}  // namespace render
