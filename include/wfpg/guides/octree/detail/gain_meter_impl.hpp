// Implementation of gain_meter.hpp.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/exec/support/fill.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/guides/octree/gain_meter.hpp>

#include <thrust/functional.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/transform_reduce.h>

#include <cmath>

namespace wfpg {

template <class Exec>
gain_meter<Exec>::gain_meter(const Exec& exec, std::size_t paths, communicator* ranks)
    : ranks_(ranks),
      kept_(exec, paths),
      words_(exec, ranks ? 3 * paths : 0),
      sums_(exec, ranks ? sizeof(detail::path_sums) / sizeof(std::uint64_t) : 0) {
  forget(exec);
  // Samples allocate nothing: the reduction's memory is allocated now, and retained.
  if (kept_.size() > 0) sum(exec, kept_.size(), detail::measure_nothing{});
}

template <class Exec>
template <class Measure>
detail::path_sums gain_meter<Exec>::sum(const Exec& exec, std::size_t n, const Measure& measure) {
  const ::thrust::counting_iterator<std::size_t> first(0);
  return ::thrust::transform_reduce(exec.thrust(), first, first + static_cast<std::ptrdiff_t>(n), measure,
                                    detail::path_sums{}, ::thrust::plus<detail::path_sums>());
}

template <class Exec>
guiding_gain gain_meter<Exec>::keep_unguided(const Exec& exec, const path_recorder<Exec>& recorder,
                                             const recorded_runs& compared, const exitance_cache_view& cache,
                                             std::uint32_t number) {
  const detail::measured_paths paths{recorder.view(), cache, compared};
  keep(exec, paths, number);
  if (number != 1) return {};
  return gain_of(sum_of_ranks(exec, sum(exec, count(paths), detail::measure_unguided{paths, kept_.view()})));
}

template <class Exec>
guiding_gain gain_meter<Exec>::gain(const Exec& exec, const path_recorder<Exec>& recorder,
                                    const recorded_runs& compared, const exitance_cache_view& cache) {
  const detail::measured_paths paths{recorder.view(), cache, compared};
  const detail::path_sums sums =
      sum_of_ranks(exec, sum(exec, count(paths), detail::measure_path{paths, kept_.view()}));
  keep(exec, paths, detail::earlier_paths::of_guided);
  return gain_of(sums);
}

template <class Exec>
detail::path_sums gain_meter<Exec>::sum_of_ranks(const Exec& exec, detail::path_sums own) {
  if (!ranks_) return own;
  exec.copy_from_host(sums_.data(), &own, sizeof own);
  ranks_->all_reduce_sum(sums_.view());
  exec.copy_to_host(&own, sums_.data(), sizeof own);
  return own;
}

// By the delta method: log(u / g) is linear in small changes of the sums u and g of losses. Paths are
// independent, since each has its own random numbers. Both losses of one path are not.
template <class Exec>
double gain_meter<Exec>::error_of(const detail::path_sums& sums) {
  const auto u = 0x1p-36 * static_cast<double>(sums.unguided_losses.typical),
             g = 0x1p-36 * static_cast<double>(sums.guided_losses.typical);
  if (!(u > 0.0) || !(g > 0.0)) return 0.0;
  const auto of = [](std::uint64_t products) { return 0x1p-32 * static_cast<double>(products); };
  const double square = of(sums.products.unguided) / (u * u) + of(sums.products.guided) / (g * g) -
                        2.0 * of(sums.products.both) / (u * g);
  return std::sqrt(max(square, 0.0));
}

// The mean loss of differences of two paths of a kind is about twice the kind's variance.
template <class Exec>
guiding_gain gain_meter<Exec>::gain_of(const detail::path_sums& sums) {
  guiding_gain result;
  result.paths = sums.paths;
  if (sums.paths == 0) return result;
  const auto n = static_cast<double>(sums.paths);
  const auto mean = [n](std::uint64_t units) { return 0x1p-30 / n * static_cast<double>(units); };
  const auto variance = [n](std::uint64_t losses) { return 0x1p-37 / n * static_cast<double>(losses); };
  result.unguided_mean = mean(sums.unguided);
  result.guided_mean = mean(sums.guided);
  result.unguided_variance = variance(sums.unguided_losses.all);
  result.guided_variance = variance(sums.guided_losses.all);
  result.typical_unguided = variance(sums.unguided_losses.typical);
  result.typical_guided = variance(sums.guided_losses.typical);
  result.unguided_vertices = static_cast<double>(sums.unguided_vertices) / n;
  result.guided_vertices = static_cast<double>(sums.guided_vertices) / n;
  result.typical_error = error_of(sums);
  return result;
}

template <class Exec>
void gain_meter<Exec>::forget(const Exec& exec) {
  fill(exec, kept_, detail::earlier_paths{});
}

template <class Exec>
void gain_meter<Exec>::keep(const Exec& exec, const detail::measured_paths& paths, std::uint32_t number) {
  if (ranks_) return keep_of_ranks(exec, paths, number);
  exec.for_each(count(paths), detail::keep_paths{paths, kept_.view(), number});
}

template <class Exec>
void gain_meter<Exec>::keep_of_ranks(const Exec& exec, const detail::measured_paths& paths,
                                     std::uint32_t number) {
  const array_view<std::uint32_t> words = words_.view().subview(0, (number == 0 ? 3 : 1) * kept_.size());
  exec.fill_bytes(words.data(), 0, words.size() * sizeof(std::uint32_t));
  exec.for_each(count(paths), detail::write_path_words{paths, kept_.view(), number, words.data()});
  ranks_->all_reduce_sum(words);
  exec.for_each(kept_.size(), detail::keep_path_words{words.data(), number, kept_.view()});
}

}  // namespace wfpg
