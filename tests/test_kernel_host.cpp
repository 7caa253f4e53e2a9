// A host with kernels of its own: guided and unguided pictures agree, and guiding gains.
#include "support/guiding.hpp"
#include "support/kernel_host.hpp"
#include "support/policies.hpp"
#include "support/statistics.hpp"

#include <wfpg/guide_file.hpp>
#include <wfpg/path_guider.hpp>
#include <wfpg/testing/statistics.hpp>

#include <cmath>
#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::testing::sample_mean;

namespace {

constexpr std::uint32_t path_count = 4096;

/// Mean radiance of the picture, of each sample.
template <class Exec>
sample_mean render(const room& in, std::uint32_t samples, bool guided, host_fault fault = host_fault::none) {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  wfpg::kept_guide_options options = kernel_host_options(path_count);
  options.unguided_samples = guided ? 1 : samples;
  wfpg::path_guider<Exec> guider(exec, mesh.view(), options);
  sample_mean means;
  for (std::uint32_t sample = 0; sample < samples; ++sample) {
    const auto paths = trace_sample(exec, guider, {in, fault, path_count, 7 + sample});
    guider.end_sample();
    double sum = 0.0;
    for (const host_path& path : paths.to_host(exec)) sum += double(path.radiance);
    means.add(sum / path_count);
  }
  if (guided) {
    const wfpg::guider_statistics counted = guider.statistics();
    CHECK(counted.dropped_vertices == 0);
    CHECK((counted.path_gaps > 0) == (in.fog > 0.0f));
    CHECK(counted.deposits.total() == 0);
  }
  return means;
}

double distance_in_errors(const sample_mean& a, const sample_mean& b, double factor = 1.0) {
  return std::fabs(a.mean() - factor * b.mean()) / std::hypot(a.error(), factor * b.error());
}

WFPG_TEST_CASE("kernel host: fog and coats leave no bias, and no call is dropped",
               "[kernel_host][thorough]") {
  const room in{0.2f, true};
  const sample_mean plain = render<Exec>(in, 400, false), guided = render<Exec>(in, 200, true),
                    faulty = render<Exec>(in, 200, true, host_fault::forgets_guide);
  INFO("unguided " << plain.mean() << " +- " << plain.error() << ", guided " << guided.mean() << " +- "
                   << guided.error() << ", faulty " << faulty.mean() << " +- " << faulty.error());
  CHECK(distance_in_errors(guided, plain) < 4.0);
  CHECK(distance_in_errors(guided, plain, 1.05) > 4.0);
  CHECK(distance_in_errors(faulty, plain) > 4.0);
}

WFPG_TEST_CASE("kernel host: guiding gains where fields know all light", "[kernel_host]") {
  const sample_mean plain = render<Exec>({}, 200, false), guided = render<Exec>({}, 100, true);
  INFO("unguided " << plain.mean() << " +- " << plain.error() << ", guided " << guided.mean() << " +- "
                   << guided.error());
  CHECK(distance_in_errors(guided, plain) < 4.0);
  // At equal samples the variance is a third, or less.
  CHECK(guided.error() * guided.error() / 2.0 < plain.error() * plain.error() / 3.0);
}

/// How a guider comes to the samples that are compared.
enum class before_samples { is_new, is_told, is_not_told };

constexpr std::uint32_t paths_of_picture = 1024;

/// Means of 16 samples of each path, after a guider learnt from 48 with the lamp elsewhere, or from none.
std::vector<double> means_of_paths(std::uint64_t seed, before_samples before) {
  constexpr std::uint32_t learnt = 48, samples = 16;
  const one_policy exec;
  const box_mesh<one_policy> mesh(exec);
  wfpg::kept_guide_options options = kernel_host_options(paths_of_picture);
  options.seed = seed;
  wfpg::path_guider<one_policy> guider(exec, mesh.view(), options);
  const auto paths_of = [&](const room& in, std::uint64_t sample) {
    const auto paths =
        trace_sample(exec, guider, {in, host_fault::none, paths_of_picture, 1000 * seed + sample});
    guider.end_sample();
    return paths.to_host(exec);
  };
  if (before != before_samples::is_new)
    for (std::uint32_t sample = 0; sample < learnt; ++sample) paths_of({}, 500 + sample);
  if (before == before_samples::is_told) guider.forget_light();
  room turned;
  turned.turned = true;
  std::vector<double> means(paths_of_picture);
  for (std::uint32_t sample = 0; sample < samples; ++sample) {
    const auto paths = paths_of(turned, sample);
    for (std::size_t i = 0; i < paths.size(); ++i) means[i] += double(paths[i].radiance) / samples;
  }
  return means;
}

/// The mean variance of those means, over seeds.
double variance_of_means(before_samples before) {
  constexpr std::uint64_t seeds = 7;
  tile_means paths(paths_of_picture);
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) paths.add(means_of_paths(seed, before));
  double sum = 0.0;
  for (std::size_t i = 0; i < paths.size(); ++i) sum += seeds * paths.variance_of_mean(i);
  return sum / paths_of_picture;
}

TEST_CASE("kernel host: after a lamp moves, a guide is as good as a new one", "[kernel_host][slow]") {
  const double anew = variance_of_means(before_samples::is_new),
               told = variance_of_means(before_samples::is_told),
               untold = variance_of_means(before_samples::is_not_told);
  INFO("variance of a new guide " << anew << ", of one that is told " << told << ", of another " << untold);
  CHECK(told < 1.1 * anew);
  CHECK(untold > 1.1 * anew);
}

/// What a guide has learnt in some samples of a room whose floor is a hole to the dark, as a guide file.
template <class Exec>
std::string learnt_over_a_hole(bool tells, bool silent_escapes) {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  room in;
  in.floor = false;
  in.silent = !tells;
  wfpg::kept_guide_options options = kernel_host_options(path_count);
  options.silent_escapes = silent_escapes;
  wfpg::path_guider<Exec> guider(exec, mesh.view(), options);
  for (std::uint32_t sample = 0; sample < 6; ++sample) {
    trace_sample(exec, guider, {in, host_fault::none, path_count, 7 + sample});
    guider.end_sample();
  }
  CHECK(guider.statistics().dropped_vertices == 0);
  std::ostringstream file;
  wfpg::save_guide(guider, file);
  return file.str();
}

WFPG_TEST_CASE("kernel host: fields learn silent escapes as they learn those that are told",
               "[kernel_host][silent]") {
  const std::string told = learnt_over_a_hole<Exec>(true, false);
  CHECK(learnt_over_a_hole<Exec>(false, true) == told);
  CHECK(learnt_over_a_hole<Exec>(false, false) != told);
  // Roulette ends paths after scatter() here. The option then takes them for dark.
  CHECK(learnt_over_a_hole<Exec>(true, true) != told);
}

}  // namespace
