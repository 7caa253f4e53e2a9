// Ranks as threads that share a picture of wfpg-render.
#include "app/rank_threads.hpp"
#include "scene/builtin_scenes.hpp"
#include "support/catch.hpp"
#include "support/command_lines.hpp"
#include "support/temporary_folder.hpp"
#include "tracer/exact_sum.hpp"
#include "tracer/wave_share.hpp"

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <optional>
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

TEST_CASE("Exact sums do not depend on the order, nor on the ranks", "[renderer][ranks]") {
  const std::vector<double> values = {3.0e11, 1.0e-9, 255.999, 0.1, 3.0e11, 1.0 / 3.0, 256.0, 7.0e-17};
  double sum = 0.0;
  for (const double value : values) sum += value;
  std::uint64_t forwards[4], backwards[4];
  exact_sum first, last, reversed;
  for (std::size_t i = 0; i < values.size(); ++i) {
    (i < 3 ? first : last).add(values[i]);
    reversed.add(values[values.size() - 1 - i]);
  }
  first.split(forwards);
  last.split(backwards);
  for (int part = 0; part < 4; ++part) forwards[part] += backwards[part];
  reversed.split(backwards);
  CHECK(exact_sum::joined(forwards) == exact_sum::joined(backwards));
  CHECK(exact_sum::joined(forwards) == Approx(sum).epsilon(1.0e-15));

  exact_sum odd;
  for (const double value : {-1.0, std::nan(""), 0.0, std::numeric_limits<double>::infinity()})
    odd.add(value);
  odd.split(forwards);
  CHECK(exact_sum::joined(forwards) == 0x1p40);

  exact_sum small;
  for (const double value : {0x1p-56, 0x1.8p-56, 0x1p-57}) small.add(value);
  small.split(forwards);
  CHECK(exact_sum::joined(forwards) == 0x1p-55);
}

TEST_CASE("Ranks' parts make up a wave, and have its random numbers", "[renderer][ranks]") {
  constexpr std::size_t pixels = 7, samples = 3;
  for (std::size_t ranks = 1; ranks <= 21; ++ranks) {
    std::size_t path = 0;
    for (std::size_t rank = 0; rank < ranks; ++rank) {
      const wave_share part = wave_share::part_of(pixels, samples, rank, ranks);
      CHECK(part.first == path);
      CHECK(part.count >= 1);
      const random_stream random = part.random(5, 10);
      for (std::uint32_t i = 0; i < part.count; ++i, ++path) {
        const auto pixel = static_cast<std::uint32_t>(path % pixels);
        const auto sample = static_cast<std::uint32_t>(10 + path / pixels);
        CHECK(random.pixel_of(i) == pixel);
        CHECK(random.sample_of(i) == sample);
        CHECK((random(i, 3) == random_stream{5, sample}(pixel, 3)));
      }
    }
    CHECK(path == pixels * samples);
  }
}

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
      // After 1, 2, 4 and 8 samples, or after 3, 6 and 8, which are waves of three.
      REQUIRE(shared.checkpoints.size() == (split == rank_split::tiles ? 4u : 3u));
      CHECK(shared.checkpoints[1].samples == (split == rank_split::tiles ? 2 : 6));
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

TEST_CASE("Threads as ranks learn one guide that probes and then rests", "[renderer][ranks]") {
  const rank_split split = GENERATE(rank_split::tiles, rank_split::samples);
  const fields lifetime = GENERATE(fields::kept, fields::transient);
  const scene world = make_builtin_scene("cornell-wall");
  render_options options = options_of(sampling_method::wfpg, split);
  // A wave has enough paths that a part of those that are recorded is compared.
  options.width = options.height = split == rank_split::tiles ? 104 : 60;
  options.lifetime = lifetime;
  options.keep_guide = true;
  options.kept.budget_bytes = std::size_t(1) << 18;
  options.least_gain = 1e6f;
  options.spp = split == rank_split::tiles ? 9 : 27;
  const render_result one = by_threads(world, options, 1);
  CHECK(one.report.rest.rested > 0);
  CHECK(one.report.rest.gain.paths > wfpg::guiding_gain::least_paths);
  for (const std::size_t ranks : {std::size_t(2), std::size_t(3)}) {
    const render_result shared = by_threads(world, options, ranks);
    INFO(ranks << " ranks");
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
                    WFPG_TEST_CONTAINS("and another rank have different scenes, options, kinds of device"));
  CHECK_THROWS_WITH(by_threads(world, options_of(sampling_method::bpt, rank_split::tiles), 2),
                    WFPG_TEST_CONTAINS("method is bpt, expected pt"));
  CHECK_THROWS_WITH(by_threads(world, options_of(sampling_method::pt, std::nullopt), 2),
                    WFPG_TEST_CONTAINS("split is unset, expected tiles or samples"));
  render_options large = options_of(sampling_method::pt, rank_split::samples);
  large.width = large.height = 16384;
  large.samples_a_wave = 16;
  CHECK_THROWS_WITH(by_threads(world, large, 1), WFPG_TEST_CONTAINS("less than 2^32 - 1"));
}

TEST_CASE("Ranks are of one kind of device", "[renderer][ranks]") {
  const scene world = make_builtin_scene("ajar");
  std::vector<render_options> all(2, options_of(sampling_method::pt, rank_split::tiles));
  all[1].where = device::omp;
  CHECK(render_by_threads(world, all, {}).report.spp == 8);
  all[1].where = device::cuda;
  CHECK_THROWS_WITH(render_by_threads(world, all, {}), WFPG_TEST_CONTAINS("kinds of device"));
}

TEST_CASE("Ranks that resume or load other bytes are refused", "[renderer][ranks]") {
  const scene world = make_builtin_scene("ajar");
  const wfpg_test::temporary_folder folder;
  render_options options = options_of(sampling_method::wfpg, std::nullopt);
  options.kept.budget_bytes = std::size_t(1) << 18;
  options.keep_guide = options.keep_state = true;
  std::vector<std::string> states, guides;
  for (const int spp : {1, 2}) {
    options.spp = spp;
    const render_result result = render::render(world, options, {});
    states.push_back(folder.write("state" + std::to_string(spp), result.state));
    guides.push_back(folder.write("guide" + std::to_string(spp), result.guide));
  }
  options.keep_guide = options.keep_state = false;
  options.split = rank_split::tiles;
  options.spp = 3;
  std::vector<render_options> all(2, options);
  const auto resumed = [&](const std::string& first, const std::string& second) {
    all[0].resume = first;
    all[1].resume = second;
    return render_by_threads(world, all, {});
  };
  const auto loaded = [&](const std::string& first, const std::string& second) {
    all[0].load_guide = first;
    all[1].load_guide = second;
    return render_by_threads(world, all, {});
  };
  const auto other_bytes = WFPG_TEST_CONTAINS("different bytes of the file of --resume or --load-guide");
  CHECK_THROWS_WITH(resumed(states[0], states[1]), other_bytes);
  CHECK_THROWS_WITH(resumed(states[0], ""), other_bytes);
  CHECK(resumed(states[0], states[0]).report.spp == 3);
  all.assign(2, options);
  CHECK_THROWS_WITH(loaded(guides[0], guides[1]), other_bytes);
  CHECK(loaded(guides[1], guides[1]).report.spp == 3);
}

TEST_CASE("Processes that would all render the whole picture are refused", "[renderer][ranks]") {
  const wfpg_test::temporary_folder folder;
  const std::string size = GENERATE("OMPI_COMM_WORLD_SIZE", "PMI_SIZE");
  const auto error_of = [&](std::vector<std::string> more) {
    std::vector<std::string> words = {
        "ajar", "--size", "8x8", "--spp", "1", "--method", "pt", "-o", folder.file("a.exr")};
    words.insert(words.end(), more.begin(), more.end());
    return render_test::run_render(words).log;
  };
  setenv(size.c_str(), "2", 1);
  const std::string alone = error_of({}), gpus = error_of({"--split", "tiles", "--device", "cuda:0,1"});
  setenv(size.c_str(), "1", 1);
  const std::string one = error_of({});
  unsetenv(size.c_str());
  CHECK_THAT(alone, WFPG_TEST_CONTAINS("2 processes were started") &&
                        WFPG_TEST_CONTAINS("add --split tiles or --split samples"));
  CHECK_THAT(gpus, WFPG_TEST_CONTAINS("would render on several GPUs; start one process"));
  CHECK_THAT(one, !WFPG_TEST_CONTAINS("processes"));
}

TEST_CASE("Several GPUs are named by their numbers", "[renderer][ranks]") {
  const auto error_of = [](const std::string& device) {
    return render_test::run_render({"ajar", "--device", device, "-o", "a.exr", "--method", "pt"}).log;
  };
  for (const std::string device : {"cuda:", "cuda:1,", "cuda:,1", "cuda:a", "cuda:1000", "cpu:0", "abacus"})
    CHECK_THAT(error_of(device), WFPG_TEST_CONTAINS("such as cuda:0,1, not " + device));
  CHECK_THAT(error_of("cuda:0,1"), WFPG_TEST_CONTAINS("--split tiles or samples, for several GPUs"));
}
