// Implementation of surface_collector.hpp.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/math.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/octree/surface_collector.hpp>
#include <wfpg/octree/voxelizer.hpp>

#include <thrust/copy.h>
#include <thrust/count.h>
#include <thrust/sort.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace wfpg {
namespace detail {

/// Whether a slot holds a hit.
struct holds_hit {
  WFPG_HD bool operator()(const surface_fragment& slot) const { return slot.area > 0.0f; }
};

/// One coordinate of each sample. Invalid positions sort to the end.
struct read_coordinates {
  array_view<const surface_fragment> samples;
  int axis;
  array_view<float> coordinates;

  WFPG_HD void operator()(std::size_t i) const {
    const vec3 p = samples[i].position;
    coordinates[i] = is_valid_position(p) ? p[axis] : 3.0e38f;
  }
};

/// Whether a sample has a valid position.
struct has_valid_position {
  WFPG_HD bool operator()(const surface_fragment& sample) const { return is_valid_position(sample.position); }
};

/// The box of a sample, as sample_bounds has it; an empty one where it lies outside of `limits`.
struct bounds_within {
  sample_bounds bounds;
  bounds3 limits;

  WFPG_HD bounds3 operator()(std::size_t i) const {
    const bounds3 box = bounds(i);
    for (int axis = 0; axis < 3; ++axis)
      if (box.lower[axis] < limits.lower[axis] || box.upper[axis] > limits.upper[axis]) return {};
    return box;
  }
};

/// The box around the valid samples, without a number `aside` of them at each end of each axis.
template <class Exec>
bounds3 bounds_of_middle(const Exec& exec, array_view<const surface_fragment> samples, std::size_t valid,
                         std::size_t aside) {
  const buffer<float, Exec> coordinates(exec, samples.size());
  bounds3 box;
  for (int axis = 0; axis < 3; ++axis) {
    exec.for_each(samples.size(), read_coordinates{samples, axis, coordinates.view()});
    ::thrust::sort(exec.thrust(), coordinates.data(), coordinates.data() + samples.size());
    box.lower[axis] = read_element(exec, coordinates.data() + aside);
    box.upper[axis] = read_element(exec, coordinates.data() + (valid - 1 - aside));
  }
  return box;
}

}  // namespace detail

template <class Exec>
surface_collector<Exec>::surface_collector(const Exec& exec, std::size_t capacity)
    : slots_(exec, capacity), dropped_(exec, std::vector<std::uint32_t>(1, 0)) {
  // Zero bytes are an area of 0.
  if (capacity > 0) exec.fill_bytes(slots_.data(), 0, slots_.bytes());
}

template <class Exec>
buffer<surface_fragment, Exec> surface_collector<Exec>::samples(const Exec& exec) const {
  const surface_fragment *const first = slots_.data(), *const last = first + slots_.size();
  const auto count = ::thrust::count_if(exec.thrust(), first, last, detail::holds_hit());
  buffer<surface_fragment, Exec> hits(exec, static_cast<std::size_t>(count));
  ::thrust::copy_if(exec.thrust(), first, last, hits.data(), detail::holds_hit());
  return hits;
}

template <class Exec>
bounds3 bounds_of_samples(const Exec& exec, array_view<const surface_fragment> samples, float outliers) {
  require(outliers >= 0.0f && outliers < 0.5f, "outliers", outliers, "in [0, 0.5)");
  const auto valid = static_cast<std::size_t>(::thrust::count_if(
      exec.thrust(), samples.data(), samples.data() + samples.size(), detail::has_valid_position()));
  if (valid == 0) return {};
  const auto aside = static_cast<std::size_t>(static_cast<double>(outliers) * static_cast<double>(valid));
  bounds3 limits = detail::bounds_of_middle(exec, samples, valid, aside);
  if (aside > 0) {
    const vec3 e = limits.extent();
    const float longest = max(e.x, max(e.y, e.z));
    limits = {limits.lower - longest, limits.upper + longest};
  }
  return detail::union_of_boxes(exec, samples.size(), detail::bounds_within{{samples}, limits});
}

}  // namespace wfpg
