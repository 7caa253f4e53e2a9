// The host of examples/kernels: guided pictures have the mean of unguided ones, in fog and with estimated
// densities. They are less noisy. Bad input is refused before the first sample.
#include "program.hpp"
#include "support/command_lines.hpp"
#include "support/kernel_pictures.hpp"
#include "support/pictures.hpp"
#include "support/temporary_folder.hpp"

#include <algorithm>
#include <cstdio>
#include <future>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace {

using wfpg_test::check_unbiased;
using wfpg_test::host_of;
using wfpg_test::kernel_picture;
using wfpg_test::tile_means;
using wfpg_test::tiles_of;

/// The tiles of unguided and of guided pictures, rendered at once.
std::pair<tile_means, tile_means> both_tiles_of(const kernel_picture& what) {
  auto guided = std::async(std::launch::async, [&] { return tiles_of(what, true); });
  tile_means unguided = tiles_of(what, false);
  return {std::move(unguided), guided.get()};
}

/// Checks that guiding leaves a picture's mean. Where it is `precise`, a bias of 1% is found.
void check_kernels(const kernel_picture& what, bool precise = false) {
  const auto both = both_tiles_of(what);
  const tile_means &truth = both.first, &tested = both.second;
  const auto report =
      wfpg_test::check_renderers_unbiased([&](int n) { return n == 1 ? truth : tiles_of(what, false, n); },
                                          [&](int n) { return n == 1 ? tested : tiles_of(what, true, n); });
  INFO(what.scene << ", fog " << what.fog << ": " << report.message);
  CHECK(report);
  if (!precise) return;
  INFO("standard errors of the whole " << wfpg_test::error_of_picture(truth) << " and "
                                       << wfpg_test::error_of_picture(tested));
  CHECK(wfpg_test::found_bias(truth, tested) <= 0.01 * truth.picture_mean());
  const std::vector<double> dark(truth.size(), 0.0);
  CHECK_FALSE(check_unbiased(truth, tested.scaled_beyond(dark, 1.01)));
}

/// What the check says of the host in eight scenes and in fog, by its first four samples of 128x128 pixels.
std::string said_of_host(std::uint64_t seeds) {
  std::string said;
  const auto check = [&](const char* scene, float fog, std::uint64_t seed) {
    kernels::settings wanted;
    wanted.width = wanted.height = 128;
    wanted.max_depth = 6;
    wanted.fog = fog;
    wanted.seed = seed;
    wanted.check = true;
    const auto host = kernels::make_renderer(kernels::device::tbb, wfpg_test::make_test_scene(scene), wanted);
    for (int sample = 0; sample < 4; ++sample) host->sample();
    if (!host->faults().empty()) said += scene + std::string(": ") + host->faults() + '\n';
  };
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    for (const char* scene : {"cornell-box", "cornell-enclosed", "ajar", "glossy-room", "caustic-pool",
                              "many-lamps", "materials", "outdoor"})
      check(scene, 0.0f, seed);
    check("cornell-enclosed", 0.2f, seed);
  }
  return said;
}

}  // namespace

TEST_CASE("kernels: the check of a host finds nothing wrong", "[kernels][check_host]") {
  CHECK(said_of_host(1) == "");
}

// Takes minutes, so that it runs by name alone.
TEST_CASE("kernels: the check of a host finds nothing wrong, with 20 seeds", "[.seeds]") {
  CHECK(said_of_host(20) == "");
}

TEST_CASE("kernels: guided pictures have the mean of unguided ones", "[kernels][unbiased][thorough]") {
  for (const char* scene : {"cornell-box", "cornell-enclosed", "materials", "outdoor"})
    check_kernels({scene});
  check_kernels({"ajar", 0.0f, 4, 64, 64});
  check_kernels({"cornell-enclosed", 0.2f});
}

TEST_CASE("kernels: a bias of 1% shows, with fog and without", "[kernels][unbiased][thorough]") {
  check_kernels({"bright-room", 0.0f, 12, 12, 48}, true);
  check_kernels({"bright-room", 0.2f, 12, 12, 48}, true);
}

// Takes long, so that it runs by name alone.
TEST_CASE("kernels: guided pictures have the mean of unguided ones to 0.2%", "[.long]") {
  const kernel_picture what = GENERATE(
      kernel_picture{"materials", 0.0f, 24, 24, 64}, kernel_picture{"cornell-enclosed", 0.0f, 180, 400, 64},
      kernel_picture{"cornell-enclosed", 0.1f, 300, 600, 64}, kernel_picture{"ajar", 0.0f, 400, 3000, 64});
  const auto [truth, tested] = both_tiles_of(what);
  std::printf("%s, fog %g: unguided %.5f +- %.3f%%, guided %.5f +- %.3f%%; tiles +- %.2f%% and %.2f%%\n",
              what.scene.c_str(), static_cast<double>(what.fog), truth.picture_mean(),
              100.0 * wfpg_test::error_of_picture(truth), tested.picture_mean(),
              100.0 * wfpg_test::error_of_picture(tested), 100.0 * wfpg_test::median_error(truth),
              100.0 * wfpg_test::median_error(tested));
  for (const tile_means* of : {&truth, &tested}) {
    CHECK(wfpg_test::error_of_picture(*of) <= 0.002);
    CHECK(wfpg_test::median_error(*of) <= 0.02);
  }
  const auto report = check_unbiased(truth, tested);
  INFO(report.message);
  CHECK(report);
  const std::vector<double> dark(truth.size(), 0.0);
  CHECK_FALSE(check_unbiased(truth, tested.scaled_beyond(dark, 1.01)));
}

TEST_CASE("kernels: unguided pictures are the renderer's", "[kernels]") {
  const kernel_picture what{"cornell-enclosed"};
  wfpg_test::rendering like{what.scene, true};
  const auto report = wfpg_test::check_renderers_unbiased([&](int n) { return unguided_tiles(like, n); },
                                                          [&](int n) { return tiles_of(what, false, n); });
  INFO(report.message);
  CHECK(report);
}

TEST_CASE("kernels: one thread and TBB give one picture", "[kernels]") {
  const render::scene world = wfpg_test::make_test_scene("materials");
  const auto one = host_of(world, 16, 0.1f, true, 1, kernels::device::serial),
             several = host_of(world, 16, 0.1f, true, 1, kernels::device::tbb);
  for (int sample = 0; sample < 4; ++sample) CHECK(render_test::same_bits(one->sample(), several->sample()));
}

TEST_CASE("kernels: guiding reduces noise where light is hard to find", "[kernels]") {
  const kernel_picture what{"ajar", 0.0f, 4, 4, 64};
  const auto [plain, guided] = both_tiles_of(what);
  CHECK(wfpg_test::median_error(guided) < 0.5 * wfpg_test::median_error(plain));
}

TEST_CASE("kernels: settings out of range and foreign materials throw", "[kernels]") {
  const render::scene box = wfpg_test::make_test_scene("cornell-box");
  const auto make = [&](const kernels::settings& wanted) {
    return kernels::make_renderer(kernels::device::serial, box, wanted);
  };
  kernels::settings small;
  small.width = small.height = 4;
  CHECK(make(small)->sample().size() == 16);
  kernels::settings wrong = small;
  wrong.width = 0;
  CHECK_THROWS_AS(make(wrong), std::invalid_argument);
  wrong = small;
  wrong.max_depth = 0;
  CHECK_THROWS_AS(make(wrong), std::invalid_argument);
  for (const float fog :
       {-1.0f, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    wrong = small;
    wrong.fog = fog;
    CHECK_THROWS_AS(make(wrong), std::invalid_argument);
  }
  render::scene foreign = box;
  foreign.materials[0].kind = render::material_kind::metallic_roughness;
  CHECK_THROWS_AS(kernels::make_renderer(kernels::device::serial, foreign, small), std::invalid_argument);
  foreign = box;
  foreign.textures.resize(1);
  CHECK_THROWS_AS(kernels::make_renderer(kernels::device::serial, foreign, small), std::invalid_argument);
}

TEST_CASE("wfpg-kernels writes what is asked for, and refuses the rest in one line", "[kernels]") {
  const wfpg_test::temporary_folder folder;
  const std::string picture = folder.file("a.exr");
  const auto run = [](const std::vector<std::string>& arguments) {
    return render_test::run_command(kernels::run_program, "wfpg-kernels", arguments);
  };
  CHECK(run({"cornell-box", "--size", "8x8", "--spp", "2", "--device", "serial", "-o", picture}).code == 0);
  const auto compared =
      run({"cornell-box", "--size", "8x8", "--spp", "2", "--device", "serial", "--reference", picture});
  CHECK(compared.code == 0);
  CHECK(compared.out.rfind("mse 0.0", 0) == 0);
  const auto checked = run({"materials", "--size", "32x32", "--spp", "4", "--device", "serial", "--check"});
  CHECK(checked.code == 0);
  CHECK(checked.out.rfind("the guide is used as it should be\n", 0) == 0);  // a note may follow
  for (const std::vector<std::string>& wrong : std::vector<std::vector<std::string>>{
           {"cornell-box"},
           {"cornell-box", "-o", "a.jpg"},
           {"cornell-box", "--check", "--unguided"},
           {"cornell-box", "--check", "--spp", "3"},
           {"cornell-box", "--check", "--seconds", "1"},
           {"cornell-box", "-o", picture, "--fog", "-1"},
           {"cornell-box", "-o", picture, "--device", "abacus"},
           {"nowhere", "-o", picture},
           {"cornell-box", "--size", "9x8", "--spp", "1", "--reference", picture}}) {
    const auto refused = run(wrong);
    INFO(refused.log);
    CHECK(refused.code == 2);
    CHECK(std::count(refused.log.begin(), refused.log.end(), '\n') == 1);
  }
}
