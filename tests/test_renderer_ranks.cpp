// Ranks as threads that share a picture of wfpg-render.
#include "app/rank_threads.hpp"
#include "scene/builtin_scenes.hpp"
#include "support/catch.hpp"
#include "support/command_lines.hpp"

#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace render;

bool same_bits(const image& a, const image& b) {
  return a.pixels.size() == b.pixels.size() &&
         std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(vec3)) == 0;
}

render_options options_of(sampling_method method, std::optional<rank_split> split) {
  render_options options;
  options.method = method;
  options.split = split;
  options.samples_a_wave = 3;
  options.where = device::seq;
  options.width = 24;
  options.height = 16;
  options.spp = 8;
  options.checkpoints = checkpoint_times::powers_of_two;
  return options;
}

render_result by_threads(const scene& world, const render_options& options, std::size_t ranks) {
  return render_by_threads(world, std::vector<render_options>(ranks, options), {});
}

}  // namespace

TEST_CASE("Threads as ranks give the picture of one", "[renderer][ranks]") {
  const scene world = make_builtin_scene("ajar");
  const render_result alone = render::render(world, options_of(sampling_method::pt, std::nullopt), {});
  for (const rank_split split : {rank_split::tiles, rank_split::samples}) {
    for (const std::size_t ranks : {std::size_t(1), std::size_t(3)}) {
      const render_result shared = by_threads(world, options_of(sampling_method::pt, split), ranks);
      CHECK(same_bits(shared.picture, alone.picture));
      CHECK(shared.report.spp == 8);
      CHECK(shared.report.segments == alone.report.segments);
      CHECK(shared.report.light_hits_per_path == alone.report.light_hits_per_path);
      // After 1, 2, 4 and 8 samples, or after waves of three.
      REQUIRE(shared.checkpoints.size() == (split == rank_split::tiles ? 4u : 1u));
      if (split == rank_split::tiles)
        CHECK(same_bits(shared.checkpoints[1].picture, alone.checkpoints[1].picture));
    }
  }
}

TEST_CASE("Threads as ranks learn one guide", "[renderer][ranks]") {
  const rank_split split = GENERATE(rank_split::tiles, rank_split::samples);
  const auto [name, method, lifetime] = GENERATE(table<const char*, sampling_method, fields>(
      {{"many-lamps", sampling_method::wfpg, fields::kept},
       {"glossy-room", sampling_method::wfpg_product, fields::kept},
       {"ajar", sampling_method::wfpg, fields::transient},
       {"ajar", sampling_method::sarsa, fields::kept}}));
  const scene world = make_builtin_scene(name);
  render_options options = options_of(method, split);
  options.lifetime = lifetime;
  options.keep_guide = is_wfpg(method);
  options.kept.budget_bytes = std::size_t(1) << 18;
  options.spp = lifetime == fields::kept ? 20 : 8;
  const render_result one = by_threads(world, options, 1);
  REQUIRE((one.guide.size() > 1000 || !options.keep_guide));
  for (const std::size_t ranks : {std::size_t(2), std::size_t(3)}) {
    const render_result shared = by_threads(world, options, ranks);
    INFO(name << ", " << ranks << " ranks");
    CHECK((shared.guide == one.guide));
    CHECK(same_bits(shared.picture, one.picture));
  }
}

TEST_CASE("The first wave is discarded where the first sample is", "[renderer][ranks]") {
  const scene world = make_builtin_scene("ajar");
  render_options options = options_of(sampling_method::pt, rank_split::samples);
  options.combine = wfpg::sample_combination::discard_first;
  CHECK(same_bits(by_threads(world, options, 1).picture, by_threads(world, options, 2).picture));
  options.spp = 3;
  CHECK_THROWS_WITH(by_threads(world, options, 2), WFPG_TEST_CONTAINS("spp is 3, expected at least 4"));
}

TEST_CASE("One rank that stops ends all of them", "[renderer][ranks]") {
  const scene world = make_builtin_scene("ajar");
  std::vector<render_options> all(2, options_of(sampling_method::pt, rank_split::tiles));
  int asked = 0;
  all[1].is_stopped = [&asked] { return ++asked == 3; };
  const render_result stopped = render_by_threads(world, all, {});
  CHECK(stopped.is_stopped);
  CHECK(stopped.report.spp == 3);
}

TEST_CASE("Ranks that differ, or cannot share, are refused", "[renderer][ranks]") {
  const scene world = make_builtin_scene("ajar");
  std::vector<render_options> all(2, options_of(sampling_method::pt, rank_split::tiles));
  all[1].seed = 7;
  CHECK_THROWS_WITH(render_by_threads(world, all, {}),
                    WFPG_TEST_CONTAINS("and another rank have different scenes, options or versions"));
  CHECK_THROWS_WITH(by_threads(world, options_of(sampling_method::bpt, rank_split::tiles), 2),
                    WFPG_TEST_CONTAINS("method is bpt, expected pt"));
  CHECK_THROWS_WITH(by_threads(world, options_of(sampling_method::pt, std::nullopt), 2),
                    WFPG_TEST_CONTAINS("split is unset, expected tiles or samples"));
  render_options large = options_of(sampling_method::pt, rank_split::samples);
  large.width = large.height = 16384;
  large.samples_a_wave = 16;
  CHECK_THROWS_WITH(by_threads(world, large, 1), WFPG_TEST_CONTAINS("less than 2^32 - 1"));
}

TEST_CASE("Several GPUs are named by their numbers", "[renderer][ranks]") {
  const auto error_of = [](const std::string& device) {
    return render_test::run_render({"ajar", "--device", device, "-o", "a.exr", "--method", "pt"}).log;
  };
  for (const std::string device : {"cuda:", "cuda:1,", "cuda:,1", "cuda:a", "cuda:1000", "cpu:0", "abacus"})
    CHECK_THAT(error_of(device), WFPG_TEST_CONTAINS("such as cuda:0,1, not " + device));
  CHECK_THAT(error_of("cuda:0,1"), WFPG_TEST_CONTAINS("--split tiles or samples, for several GPUs"));
}
