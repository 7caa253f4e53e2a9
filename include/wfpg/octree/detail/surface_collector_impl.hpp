// Implementation of surface_collector.hpp.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/math.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/octree/surface_collector.hpp>
#include <wfpg/octree/voxelizer.hpp>

#include <thrust/functional.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/sort.h>
#include <thrust/transform_reduce.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace wfpg {
namespace detail {

/// Flags the slots that hold a hit.
struct flag_hits {
  array_view<const surface_fragment> slots;
  array_view<std::uint64_t> used;
  WFPG_HD void operator()(std::size_t i) const { used[i] = slots[i].area > 0.0f ? 1 : 0; }
};

/// Writes the hits one after the other.
struct gather_hits {
  array_view<const surface_fragment> slots;
  array_view<const std::uint64_t> used_prefix;
  array_view<surface_fragment> hits;

  WFPG_HD void operator()(std::size_t i) const {
    const std::uint64_t at = i > 0 ? used_prefix[i - 1] : 0;
    if (used_prefix[i] != at) hits[at] = slots[i];
  }
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

/// 1 for a valid position.
struct count_valid {
  array_view<const surface_fragment> samples;
  WFPG_HD std::uint64_t operator()(std::size_t i) const { return is_valid_position(samples[i].position); }
};

/// The position of a sample as a box; an empty one where it lies outside of `limits`.
struct bounds_within {
  array_view<const surface_fragment> samples;
  bounds3 limits;

  WFPG_HD bounds3 operator()(std::size_t i) const {
    const vec3 p = samples[i].position;
    if (!is_valid_position(p)) return {};
    for (int axis = 0; axis < 3; ++axis)
      if (p[axis] < limits.lower[axis] || p[axis] > limits.upper[axis]) return {};
    return {p, p};
  }
};

/// Sum or union of f(i) over [0, n).
template <class Exec, class F, class T, class Add>
T reduce(const Exec& exec, std::size_t n, const F& f, const T& zero, const Add& add) {
  const ::thrust::counting_iterator<std::size_t> first(0);
  return ::thrust::transform_reduce(exec.thrust(), first, first + static_cast<std::ptrdiff_t>(n), f, zero,
                                    add);
}

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
  buffer<std::uint64_t, Exec> used(exec, slots_.size());
  exec.for_each(slots_.size(), detail::flag_hits{slots_.view(), used.view()});
  buffer<surface_fragment, Exec> hits(exec, static_cast<std::size_t>(detail::sum_prefix(exec, used)));
  exec.for_each(slots_.size(), detail::gather_hits{slots_.view(), used.view(), hits.view()});
  return hits;
}

template <class Exec>
bounds3 bounds_of_samples(const Exec& exec, array_view<const surface_fragment> samples, float outliers) {
  require(outliers >= 0.0f && outliers < 0.5f, "outliers", outliers, "in [0, 0.5)");
  const auto valid = static_cast<std::size_t>(detail::reduce(
      exec, samples.size(), detail::count_valid{samples}, std::uint64_t(0), ::thrust::plus<std::uint64_t>()));
  if (valid == 0) return {};
  const auto aside = static_cast<std::size_t>(static_cast<double>(outliers) * static_cast<double>(valid));
  bounds3 limits = detail::bounds_of_middle(exec, samples, valid, aside);
  if (aside > 0) {
    const vec3 e = limits.extent();
    const float longest = max(e.x, max(e.y, e.z));
    limits = {limits.lower - longest, limits.upper + longest};
  }
  return detail::reduce(exec, samples.size(), detail::bounds_within{samples, limits}, bounds3{},
                        bounds_union());
}

}  // namespace wfpg
