// host_checker: a correct host passes in rooms of all kinds, and each planted fault has its own sentence.
#include "support/guiding.hpp"
#include "support/kernel_host.hpp"
#include "support/policies.hpp"
#include "support/reports.hpp"

#include <wfpg/path_guider.hpp>
#include <wfpg/testing/check_host.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::testing::host_check_options;
using wfpg::testing::host_checker;
using wfpg::testing::host_checker_view;
using wfpg::testing::host_step;

namespace {

/// Samples of a host that is checked.
struct host_run {
  host_sample what;
  std::uint32_t samples = 4;
  std::uint32_t unguided = 1;
  std::uint32_t deposits_per_leaf = 16;  ///< sets which part of the paths is recorded
};

/// Runs a host, and returns its checker.
template <class Exec, class Caster>
host_checker<Exec> check(const Exec& exec, const host_run& run, const Caster& caster) {
  const host_sample& what = run.what;
  wfpg::kept_guide_options options = kernel_host_options(what.paths);
  options.unguided_samples = run.unguided;
  options.least_gain = 0.0f;  // guided samples are checked
  options.deposits_per_leaf = run.deposits_per_leaf;
  options.octree_resolution = 16;
  options.kept.budget_bytes = std::size_t(4) << 20;
  options.seed = what.seed;
  options.silent_escapes = what.in.silent;
  const box_mesh<Exec> mesh(exec);
  wfpg::path_guider<Exec> guider(exec, mesh.view(), options);
  host_check_options checks;
  checks.media = what.in.fog > 0.0f;
  host_checker<Exec> checker(exec, what.paths, host_depth, checks);
  for (std::uint32_t sample = 0; sample < run.samples; ++sample) {
    host_sample next = what;
    next.seed = 100 * what.seed + sample;
    trace_sample(exec, guider, next, checker.view());
    checker.end_sample(guider.recorder(), caster);
    guider.end_sample();
  }
  return checker;
}
template <class Exec>
host_checker<Exec> check(const Exec& exec, const host_run& run) {
  return check(exec, run, caster_of(run.what.in));
}

std::vector<room> rooms() {
  std::vector<room> result(12);
  result[1].coats = true;
  result[2].coats = true;
  result[2].fog = 0.2f;
  result[3].fog = 1.0f;
  result[4].alpha = 0.1f;
  result[5].alpha = 0.1f;
  result[5].knows_alpha = false;
  result[6].alpha = 0.55f;  // just wide enough for the full fraction
  result[7].open = true;
  result[7].coats = true;
  result[8].open = true;
  result[8].fog = 0.3f;
  result[9].roulette = host_roulette::late;
  result[10].roulette = host_roulette::by_radiance;
  result[10].alpha = 0.3f;
  result[11].floor = false;
  result[11].silent = true;
  return result;
}

/// A correct host passes with seeds from `first` to `last`. Each has a third of the rooms.
template <class Exec>
void check_in_rooms(const Exec& exec, std::uint64_t first, std::uint64_t last) {
  const std::vector<room> all = rooms();
  for (std::uint64_t seed = first; seed <= last; ++seed)
    for (std::size_t i = seed % 3; i < all.size(); i += 3) {
      INFO("room " << i << ", seed " << seed);
      check_passes(check(exec, {{all[i], host_fault::none, 1024, seed}}).report());
    }
}

WFPG_TEST_CASE("check_host: a correct host passes in rooms of all kinds", "[check_host]") {
  check_in_rooms(Exec(), 1, 3);
}

WFPG_TEST_CASE("check_host: a correct host passes with other seeds", "[check_host][thorough]") {
  check_in_rooms(Exec(), 4, 20);
}

WFPG_TEST_CASE("check_host: a part of the paths is enough, which the recorder has", "[check_host]") {
  const Exec exec;
  host_run run{{{}, host_fault::none, 128 * 128, 1}};
  run.deposits_per_leaf = 1;
  check_passes(check(exec, run).report());
  run.what.fault = host_fault::lost_light;
  check_names(check(exec, run).report(), {"recorded radiance is not the picture's"});
}

/// A fault, a room where it shows, and words of its sentence.
struct planted_fault {
  host_fault fault;
  room in;
  std::vector<std::string> words;
};

std::vector<planted_fault> planted_faults() {
  room coated, foggy, glossy, open, bottomless;
  coated.coats = true;
  foggy.fog = 0.2f;
  foggy.coats = true;
  glossy.alpha = 0.1f;
  open.open = true;
  bottomless.floor = false;
  bottomless.silent = true;
  return {
      {host_fault::guided_roulette, {}, {"roulette ends guided paths", "wfpg::roulette_scale()"}},
      {host_fault::guided_roulette, foggy, {"roulette ends guided paths"}},
      {host_fault::narrow_in_full, glossy, {"narrow lobes", "wfpg::glossy_part::unknown()"}},
      {host_fault::narrow_in_full, coated, {"delta lobes", "glossy_part{probability, 0}"}},
      {host_fault::silent_escapes, open, {"escapes are not told", "recorder.escape()"}},
      {host_fault::early_scatter, bottomless, {"directions that ended paths did not take", "silent_escapes"}},
      {host_fault::lost_light, {}, {"recorded radiance", "recorder.total()"}},
      {host_fault::lost_light, foggy, {"recorded radiance"}},
      {host_fault::local_scatter, {}, {"recorder.scatter() has other directions", "world space"}},
      {host_fault::no_scatter, {}, {"directions are not told", "recorder.scatter()"}},
      {host_fault::normal_as_outgoing, {}, {"recorder.vertex() has an outgoing", "-ray.direction"}},
      {host_fault::local_step, coated, {"host_step::wi", "world space"}},
      {host_fault::local_pdf, {}, {"densities of directions", "mixture.pdf()"}},
      {host_fault::forgets_guide, coated, {"densities of directions", "mixture.pdf()"}},
      {host_fault::local_query, glossy, {"densities of next-event estimation", "mixture.pdf()"}},
  };
}

WFPG_TEST_CASE("check_host: each planted fault has its own sentence, and no other", "[check_host]") {
  const Exec exec;
  for (const planted_fault& planted : planted_faults()) {
    const auto report = check(exec, {{planted.in, planted.fault, 4096, 1}}).report();
    check_names(report, planted.words);
    INFO(report.message);
    CHECK(std::count(report.message.begin(), report.message.end(), '\n') == 0);
  }
}

TEST_CASE("check_host: faults of several checks have a line each, and stay", "[check_host]") {
  const one_policy exec;
  room glossy;
  glossy.alpha = 0.1f;
  glossy.coats = true;
  host_checker<one_policy> checker = check(exec, {{glossy, host_fault::narrow_in_full, 4096, 1}});
  checker.end_sample(wfpg::path_recorder_view(), box_caster());
  const std::string message = checker.report().message;
  check_names(checker.report(), {"narrow lobes", "\ndelta lobes"});
  CHECK(std::count(message.begin(), message.end(), '\n') == 1);
}

TEST_CASE("check_host: a batch caster finds escapes as an inline one does", "[check_host]") {
  const one_policy exec;
  batch_box_caster::log calls;
  room open;
  open.open = true;
  const host_run silent{{open, host_fault::silent_escapes, 1024, 1}};
  const auto batches = check(exec, silent, batch_box_caster{{true}, &calls}).report();
  check_names(batches, {"escapes are not told"});
  CHECK(batches.message == check(exec, silent).report().message);
  CHECK(calls.calls == 4);
}

TEST_CASE("check_host: a note says where guiding does not pay", "[check_host]") {
  const one_policy exec;
  room coated_under_sky;
  coated_under_sky.open = true;
  coated_under_sky.coats = true;
  const auto note = [&](const room& in, host_fault fault, std::uint32_t samples, std::uint32_t unguided) {
    return check(exec, {{in, fault, 4096, 1}, samples, unguided}).note();
  };
  CHECK(note({}, host_fault::none, 8, 4).empty());
  // A guide that draws more than half of what a coat would find by itself.
  const std::string text = note(coated_under_sky, host_fault::narrow_in_full, 8, 4);
  INFO(text);
  CHECK(text.find("guiding does not pay here") == 0);
  CHECK(note(coated_under_sky, host_fault::narrow_in_full, 8, 1).empty());  // one sample has no variance
  CHECK(note(coated_under_sky, host_fault::narrow_in_full, 5, 4).empty());
}

/// Kernel: logs one direction and one query of a BSDF of density 1/4, without a guide.
struct log_density {
  host_checker_view checker;
  float pdf, queried;
  WFPG_HD void operator()(std::size_t path) const {
    host_step step;
    step.wi = {0.0f, 0.0f, 1.0f};
    step.bsdf_pdf = 0.25f;
    step.pdf = pdf;
    checker.scatter(path, 0, wfpg::guide_view(), wfpg::kernel_mixture(), step);
    checker.query(path, 0, wfpg::kernel_mixture(), step.wi, 0.25f, 0.25f);
    checker.query(path, 0, wfpg::kernel_mixture(), step.wi, 0.25f, queried);
    checker.query(path, 0, wfpg::kernel_mixture(), step.wi, 0.25f, 0.25f);
    checker.scatter(path, 7, wfpg::guide_view(), wfpg::kernel_mixture(), step);
    checker.query(path, 7, wfpg::kernel_mixture(), step.wi, 0.25f, queried);
    checker.radiance(path, 1.0f);
  }
};

WFPG_TEST_CASE("check_host: any other density is found, and what is not logged is not", "[check_host]") {
  const Exec exec;
  const auto report = [&](float pdf, float queried, bool cleared = false) {
    host_checker<Exec> checker(exec, 64, 2);
    exec.for_each(128, log_density{checker.view(), pdf, queried});  // the last 64 paths are ignored
    if (cleared) checker.clear();
    checker.end_sample(wfpg::no_path_recorder(), box_caster());
    return checker.report();
  };
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  check_passes(report(0.25f, 0.25f));
  check_passes(report(0.2502f, 0.2498f));
  for (const float bad : {nan, inf, -0.25f, 0.0f, 0.251f, 0.249f}) {
    INFO(bad);
    check_names(report(bad, 0.25f), {"densities of directions", "64 of 64"});
    check_names(report(0.25f, bad), {"densities of next-event estimation", "64 of 64"});
    check_passes(report(bad, bad, true));
  }
  // A line each.
  const auto both = report(nan, nan);
  CHECK(std::count(both.message.begin(), both.message.end(), '\n') == 1);
}

WFPG_TEST_CASE("check_host: a default view ignores all calls", "[check_host]") {
  const Exec exec;
  exec.for_each(64, log_density{host_checker_view(), 1.0f, 1.0f});
  host_checker<Exec> checker(exec, 64, 2);
  checker.end_sample(wfpg::path_recorder_view(), box_caster());
  check_passes(checker.report());
  CHECK(checker.note().empty());
}

TEST_CASE("check_host: arguments out of range are refused by name", "[check_host]") {
  const one_policy exec;
  const auto refused = [&](std::size_t paths, std::uint32_t depth, float tolerance, double exceptions) {
    host_check_options options;
    options.tolerance = tolerance;
    options.exceptions = exceptions;
    return refusal([&] { host_checker<one_policy>(exec, paths, depth, options); });
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  CHECK(refused(1, 1, 0.5f, 0.0).empty());
  CHECK(refused(0, 1, 0.5f, 0.0) == "wfpg: max_paths is 0, expected in [1, 2^32 - 1)");
  CHECK(refused(0xffffffffu, 1, 0.5f, 0.0) == "wfpg: max_paths is 4294967295, expected in [1, 2^32 - 1)");
  CHECK(refused(1, 0, 0.5f, 0.0) == "wfpg: max_depth is 0, expected in [1, 1024]");
  CHECK(refused(1, 1025, 0.5f, 0.0) == "wfpg: max_depth is 1025, expected in [1, 1024]");
  for (const float bad : {0.0f, 1.0f, -0.5f, nan})
    CHECK(refused(1, 1, bad, 0.0).find("wfpg: tolerance is ") == 0);
  for (const double bad : {-0.1, 1.0, double(nan)})
    CHECK(refused(1, 1, 0.5f, bad).find("wfpg: exceptions is ") == 0);

  const wfpg::path_recorder<one_policy> recorder(exec, {65, 2});
  host_checker<one_policy> checker(exec, 64, 2);
  CHECK(refusal([&] { checker.end_sample(recorder.view(), box_caster()); }) ==
        "wfpg: paths of the recorder is 65, expected at most max_paths");
}

}  // namespace
