// Records a pixel's camera path in one sample, and the photons in its reach.
#pragma once

#include "tracer/bidirectional_state.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace inspect {

using render::vec3;

/// What a camera path's segment ends at.
enum class arrival { nothing, surface, smooth, medium };

/// A segment of a camera path.
struct path_step {
  vec3 begin{0.0f}, direction{0.0f};
  vec3 end{0.0f};  ///< the path's vertex; of arrival::nothing a point at distance 1
  arrival at = arrival::nothing;
  vec3 normal{0.0f};      ///< geometric, of a surface
  vec3 throughput{0.0f};  ///< of the path that arrives
};

/// A part of a segment in one medium, which is merged with photons along it.
struct merged_part {
  std::uint32_t segments;  ///< number of the segment, from 1
  wfpg::path_beam along;
};

/// A photon in reach, and what it brings.
struct near_photon {
  render::photon_in_reach where;
  bool merges = false;
  vec3 value{0.0f};  ///< radiance at the pixel, before its weight
  float weight = 0.0f;
};

/// A camera path of one sample.
struct recorded_path {
  std::vector<path_step> steps;
  std::vector<merged_part> parts;
  std::vector<near_photon> near;  ///< in the order of kernels
};

/// An observer of bidirectional kernels on the CPU. Without a record, it looks at nothing.
class merge_recorder {
 public:
  struct record {
    std::size_t pixel = 0;
    bool is_on = false;
    recorded_path path;
  };

  merge_recorder() = default;
  /// `to` must outlive the kernels.
  explicit merge_recorder(record& to) : to_(&to) {}

  void follow(std::size_t pixel, const render::subpath& path, std::uint32_t,
              const render::subpath_vertex* vertex) const {
    if (!records(pixel)) return;
    path_step step;
    step.begin = path.origin;
    step.direction = path.direction;
    step.end = path.origin + path.direction;
    step.throughput = path.throughput;
    if (vertex) {
      step.end = vertex->at.position;
      step.throughput = vertex->throughput;
      step.normal = vertex->at.geometric_normal;
      step.at = vertex->in_medium()                                 ? arrival::medium
                : vertex->seen_from(vertex->at.outgoing).is_delta() ? arrival::smooth
                                                                    : arrival::surface;
    }
    to_->path.steps.push_back(step);
  }
  void cross(std::size_t pixel, std::uint32_t segments, const wfpg::path_beam& along) const {
    if (records(pixel)) to_->path.parts.push_back({segments, along});
  }
  void reach(std::size_t pixel, const render::photon_in_reach& where) const {
    if (!records(pixel)) return;
    near_photon found;
    found.where = where;
    to_->path.near.push_back(found);
  }
  void merge(std::size_t pixel, vec3 value, float weight) const {
    if (!records(pixel)) return;
    near_photon& found = to_->path.near.back();
    found.merges = true;
    found.value = value;
    found.weight = weight;
  }

 private:
  bool records(std::size_t pixel) const { return to_ && to_->is_on && pixel == to_->pixel; }

  record* to_ = nullptr;
};

}  // namespace inspect
