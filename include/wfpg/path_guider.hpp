// The facade: what a wavefront path tracer needs to guide its paths, and with an exec/ header all it
// includes. Paper, Algorithm 1. What directions come from is a guide, the paper's (octree_guide.hpp) unless
// told otherwise (guide.hpp). A sample, from the renderer's side:
//
//   guider.begin_sample();
//   for (std::uint32_t depth = 0; depth < max_depth; ++depth) {
//     trace(...);              // the renderer's; records vertices in guider.recorder()
//     guider.sample_directions(wfpg::wave{depth, n, surfaces, random}, caster, directions);
//     shade(...);              // the renderer's; records radiance
//   }
//   guider.end_sample();
#pragma once

#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/policy.hpp>
#include <wfpg/guide/guide.hpp>
#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guide/sample_rays.hpp>
#include <wfpg/guide/statistics.hpp>
#include <wfpg/guides/octree/octree_guide.hpp>
#include <wfpg/host/ray_caster.hpp>
#include <wfpg/host/wave.hpp>

#include <memory>
#include <utility>
#include <vector>

namespace wfpg {

/// Guides the paths of a wavefront path tracer over one scene. Movable, not copyable; calls come from one
/// thread at a time. A throw leaves it usable. After the first sample of the largest wave nothing is
/// allocated from the policy.
template <class Exec, class Guide = octree_guide<Exec>>
class path_guider {
 public:
  static_assert(exec::is_execution_policy_v<Exec>,
                "Exec needs resource, with_resource, thrust, warp_width and warps_per_block");
  static_assert(detail::require_guide<Guide, Exec>());

  /// What it can be told: guider_options for the octree.
  using options_type = typename Guide::options_type;
  /// What the renderer's kernels draw from: guide_view for the octree.
  using view_type = typename Guide::view_type;

  /// A guider over triangles, read only here. Throws std::invalid_argument for options out of range,
  /// out_of_memory.
  path_guider(const Exec& exec, triangle_mesh_view mesh, const options_type& options = {})
      : path_guider(in_scene{}, exec, mesh, options) {}

  /// A guider over another scene that the guide takes, such as voxel_fragments<Exec> for the octree: of
  /// geometry that is not triangles, or of hit points (fragments_from_samples).
  template <class Scene, class = std::enable_if_t<std::is_constructible_v<Guide, const Exec&, const Exec&,
                                                                          Scene, const options_type&>>>
  path_guider(const Exec& exec, Scene&& scene, const options_type& options = {})
      : path_guider(in_scene{}, exec, std::forward<Scene>(scene), options) {}

  /// Takes all of another, which is not used again but to be assigned to.
  path_guider(path_guider&& other) = default;
  /// The same; what it had goes first.
  path_guider& operator=(path_guider&& other);

  /// Begins a sample: one wave of paths, or several. Forgets recorded paths that were not deposited.
  void begin_sample();

  /// Draws the next directions of a wave's rays, fields and all, in one call: directions[ray] for each ray.
  /// `caster` is the host's ray caster, inline or batch. `queries`: directions whose densities the same
  /// fields answer. Throws std::invalid_argument where the wave exceeds max_rays or an output is smaller than
  /// the wave; what a caster throws.
  template <class Surfaces, class Random, class Caster, class Queries = no_queries>
  void sample_directions(const wave<Surfaces, Random>& w, const Caster& caster,
                         array_view<sampled_direction> directions, const Queries& queries = {});

  /// The same in two steps: what the renderer's kernels sample from. `w.random` is not read. Holds until the
  /// next call. Kept fields are only refreshed for it. Transient ones are made resident, in 4 (F² + F) bytes
  /// a bin of the wave with most bins, and half more; it waits for the number of bins.
  template <class Surfaces, class Random, class Caster>
  view_type prepare(const wave<Surfaces, Random>& w, const Caster& caster);

  /// Deposits what was recorded and updates the guide.
  void end_sample();

  /// Geometry moved inside `bounds` (world space, old and new place): kept fields that may see it are cast
  /// anew when they are next used. Until the octree is built anew the cache knows the old geometry only.
  void invalidate(const bounds3& bounds) { guide_.invalidate(exec_, bounds); }
  /// The same of all fields.
  void invalidate_all() { guide_.invalidate_all(exec_); }
  /// Forgets all cached light, and what kept fields and choices of lights learnt: for lights that moved.
  /// Fields follow without being cast anew.
  void forget_light() {
    guide_.forget_light(exec_);
    settled_after_ = samples_ + recording_needs::settling_samples;
  }

  /// Where the renderer's kernels record their paths in the sample that has begun: a path_recorder_view, or a
  /// no_path_recorder where the guide has no use for them.
  auto recorder() const {
    if constexpr (Guide::records_paths)
      return recorder_.view();
    else
      return no_path_recorder{};
  }
  /// Which lights next-event estimation is to ask, in this sample; empty without options.lights.weights.
  light_guide_view lights() const { return guide_.lights(); }
  /// Where kernels deposit, and what they read, without the recorder. Of the octree, as those that follow. A
  /// host that deposits by itself makes room for it by `deposit_capacity`.
  exitance_cache_view cache() const { return guide_.cache(); }
  /// Where they tell kept fields what their directions found, without it; empty where fields do not learn.
  learnt_radiance_view learnt() const { return guide_.learnt(); }
  /// The octree; its view goes to an svo_ray_caster.
  const sparse_voxel_octree<Exec>& octree() const { return guide_.octree(); }
  /// Cells along a side of transient fields at a depth.
  std::uint32_t field_resolution(std::uint32_t depth) const { return guide_.field_resolution(depth); }
  /// A kept field, by the number that mixtures and directions have of it: node · orientations + orientation,
  /// or 0xffffffff where the number is not in use. Empty where fields are transient. Waits for the work
  /// before it.
  std::vector<std::uint32_t> field_keys() const { return guide_.field_keys(exec_); }

  /// Where directions come from.
  const Guide& guide() const { return guide_; }
  /// What it was told, with max_rays completed.
  const options_type& options() const { return options_; }
  /// Whether the sample that has begun is guided.
  bool guided() const { return is_guided(samples_); }

  /// What it has done so far. Waits for the work before it.
  guider_statistics statistics() const;
  /// What it holds, by part. Does not wait.
  memory_report memory() const;

 private:
  friend struct detail::state_access;
  struct in_scene {};

  template <class Scene>
  path_guider(in_scene, const Exec& exec, Scene&& scene, const options_type& options)
      : options_(completed(options)),
        working_memory_(std::make_unique<retaining_resource>(exec.resource())),
        exec_(exec.with_resource(working_memory_.get())),
        guide_(exec, exec_, std::forward<Scene>(scene), options_),
        needs_(guide_.recording()),
        recorder_(exec_, Guide::records_paths ? options_.max_paths : 0, options_.max_depth,
                  options_.include_emission, needs_.share_shift, needs_.directions) {
    require(needs_.settled_turns >= 1, "settled_turns", needs_.settled_turns, "at least 1");
  }

  static options_type completed(options_type options) {
    detail::require_valid(static_cast<const sampling_options&>(options));
    if (options.max_rays == 0) options.max_rays = options.max_paths;
    return options;
  }
  template <class Surfaces, class Random, class Caster>
  void check(const wave<Surfaces, Random>& w, const Caster& caster) const;
  std::uint64_t seed_of(std::uint32_t sample) const { return hash(options_.seed, sample); }
  bool is_guided(std::uint32_t sample) const { return sample > options_.unguided_samples && !guide_.empty(); }
  /// Of `settled_turns` samples one at random: a host may have turns of its own, such as tiles.
  bool is_recorded(std::uint32_t sample) const {
    const std::uint32_t turns = needs_.settled_turns, round = (sample - 1) / turns;
    return sample <= settled_after_ || (sample - 1) % turns == hash(~options_.seed, round) % turns;
  }
  guide_sample<Exec> at(std::uint32_t sample) {
    return {exec_, sample, seed_of(sample), is_guided(sample), recorded_, clock_};
  }
  guide_sample<Exec> now() { return at(samples_); }
  guide_sample<Exec> now(std::uint32_t depth) {
    guide_sample<Exec> result = now();
    result.guided = result.guided && depth < options_.guided_depths;
    return result;
  }

  options_type options_;
  stage_clock clock_;
  std::unique_ptr<retaining_resource> working_memory_;  // of what follows, in part
  Exec exec_;                                           // allocates there
  Guide guide_;
  recording_needs needs_;
  path_recorder<Exec> recorder_;
  std::uint32_t samples_ = 0;
  std::uint32_t settled_after_ = recording_needs::settling_samples;
  bool recorded_ = true;  // the sample that has begun
};

/// What memory lies in is to outlive it: the old guider is gone as a whole, at the end.
template <class Exec, class Guide>
path_guider<Exec, Guide>& path_guider<Exec, Guide>::operator=(path_guider&& other) {
  if (this == &other) return *this;
  const path_guider old(std::move(*this));
  options_ = std::move(other.options_);
  clock_ = other.clock_;
  working_memory_ = std::move(other.working_memory_);
  exec_ = other.exec_;
  guide_ = std::move(other.guide_);
  needs_ = other.needs_;
  recorder_ = std::move(other.recorder_);
  samples_ = other.samples_;
  settled_after_ = other.settled_after_;
  recorded_ = other.recorded_;
  return *this;
}

template <class Exec, class Guide>
void path_guider<Exec, Guide>::begin_sample() {
  const std::uint32_t sample = samples_ + 1;
  recorded_ = is_recorded(sample);
  recorder_.begin_sample(exec_, static_cast<std::uint32_t>(seed_of(sample)), recorded_);
  guide_.begin_sample(at(sample));
  samples_ = sample;  // last: a call that threw is made again for the same sample
}

template <class Exec, class Guide>
void path_guider<Exec, Guide>::end_sample() {
  if (recorded_) {
    const auto timed = clock_.time(stage::record);
    guide_.learn(now(), recorder_);
  }
  const auto timed = clock_.time(stage::cache);
  guide_.update(now());
}

template <class Exec, class Guide>
template <class Surfaces, class Random, class Caster>
void path_guider<Exec, Guide>::check(const wave<Surfaces, Random>& w, const Caster&) const {
  static_assert(is_surfaces_v<Surfaces>,
                "surfaces: needs wfpg::surface<Bsdf> operator()(std::uint32_t) const");
  static_assert(is_ray_caster_v<Caster, Exec>,
                "caster: needs ray_hit operator()(const ray&) const, or cast(exec, rays, hits) const");
  require(w.ray_count <= options_.max_rays, "ray_count", w.ray_count, "at most max_rays");
}

template <class Exec, class Guide>
template <class Surfaces, class Random, class Caster, class Queries>
void path_guider<Exec, Guide>::sample_directions(const wave<Surfaces, Random>& w, const Caster& caster,
                                                 array_view<sampled_direction> directions,
                                                 const Queries& queries) {
  check(w, caster);
  static_assert(is_bsdf_v<bsdf_of_t<Surfaces>>,
                "the BSDF needs eval, pdf, sample, is_delta and transmits, all const");
  static_assert(is_random_v<Random>, "random: needs vec2 operator()(std::uint32_t, std::uint32_t) const");
  require(directions.size() >= w.ray_count, "size of directions", directions.size(), "ray_count or more");
  if constexpr (!std::is_same_v<Queries, no_queries>)
    require(queries.densities.size() >= w.ray_count, "size of densities", queries.densities.size(),
            "ray_count or more");

  const serve_ray<Surfaces, Random, Queries> serve{w.surfaces, w.random, queries, directions};
  if constexpr (Guide::serves_waves)
    guide_.serve(now(w.depth), w, caster, serve);
  else {
    const view_type view = prepare(w, caster);
    const auto timed = clock_.time(stage::serve);
    if (now(w.depth).guided)
      exec_.for_each(w.ray_count, serve_guide_view<decltype(serve), view_type>{serve, view});
    else
      exec_.for_each(w.ray_count, serve_unbinned<decltype(serve)>{serve, {}});
  }
}

template <class Exec, class Guide>
template <class Surfaces, class Random, class Caster>
typename path_guider<Exec, Guide>::view_type path_guider<Exec, Guide>::prepare(
    const wave<Surfaces, Random>& w, const Caster& caster) {
  check(w, caster);
  const auto timed = clock_.time(stage::fields);
  return guide_.prepare(now(w.depth), w, caster);
}

template <class Exec, class Guide>
guider_statistics path_guider<Exec, Guide>::statistics() const {
  guider_statistics result;
  result.samples = samples_;
  result.guided_samples = guided() ? samples_ - options_.unguided_samples : 0;
  result.dropped_vertices = recorder_.dropped(exec_);
  result.seconds = clock_.report();
  guide_.report(exec_, result);
  return result;
}

template <class Exec, class Guide>
memory_report path_guider<Exec, Guide>::memory() const {
  memory_report report{guide_.memory()};
  report.parts.push_back({"paths", recorder_.bytes(), false});
  report.parts.push_back({"scratch", working_memory_->bytes() - working_memory_->used_bytes(), false});
  return report;
}

}  // namespace wfpg
