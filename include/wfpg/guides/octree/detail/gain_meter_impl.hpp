// Implementation of gain_meter.hpp.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/guides/octree/gain_meter.hpp>

#include <thrust/fill.h>
#include <thrust/functional.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/transform_reduce.h>

namespace wfpg {

template <class Exec>
gain_meter<Exec>::gain_meter(const Exec& exec, std::size_t paths) : kept_(exec, min(paths, most_paths)) {
  forget(exec);
}

template <class Exec>
void gain_meter<Exec>::keep_unguided(const Exec& exec, const path_recorder<Exec>& recorder,
                                     const exitance_cache_view& cache) {
  forget(exec);
  keep(exec, measured(recorder, cache), measured_count(recorder), true);
}

template <class Exec>
guiding_gain gain_meter<Exec>::gain(const Exec& exec, const path_recorder<Exec>& recorder,
                                    const exitance_cache_view& cache) {
  const std::size_t n = measured_count(recorder);
  const detail::measured_paths paths = measured(recorder, cache);
  const ::thrust::counting_iterator<std::size_t> first(0);
  const detail::path_sums sums = ::thrust::transform_reduce(
      exec.thrust(), first, first + static_cast<std::ptrdiff_t>(n), detail::measure_path{paths, kept_.view()},
      detail::path_sums{}, ::thrust::plus<detail::path_sums>());
  keep(exec, paths, n, false);
  return gain_of(sums);
}

// A guided path's difference from an unguided one has both variances, that from a guided one has its own
// twice.
template <class Exec>
guiding_gain gain_meter<Exec>::gain_of(const detail::path_sums& sums) {
  guiding_gain result;
  result.paths = sums.paths;
  if (sums.paths == 0) return result;
  const double scale = 0x1p-20 / static_cast<double>(sums.paths);
  result.unguided_mean = scale * static_cast<double>(sums.unguided);
  result.guided_mean = scale * static_cast<double>(sums.guided);
  result.guided_variance = 0.5 * scale * static_cast<double>(sums.between_guided);
  const double both = scale * static_cast<double>(sums.from_unguided);
  result.unguided_variance = max(both - result.guided_variance, 0.0);
  return result;
}

template <class Exec>
void gain_meter<Exec>::forget(const Exec& exec) {
  ::thrust::fill_n(exec.thrust(), kept_.data(), kept_.size(), detail::earlier_paths{});
}

template <class Exec>
void gain_meter<Exec>::keep(const Exec& exec, const detail::measured_paths& paths, std::size_t n,
                            bool unguided) {
  exec.for_each(n, detail::keep_paths{paths, kept_.view(), unguided});
}

template <class Exec>
std::size_t gain_meter<Exec>::stride(const path_recorder<Exec>& recorder) const {
  const std::size_t room = max<std::size_t>(kept_.size(), 1);
  return max<std::size_t>((recorder.recorded() + room - 1) / room, 1);
}

}  // namespace wfpg
