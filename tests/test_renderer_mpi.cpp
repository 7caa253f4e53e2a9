// wfpg-render by several processes, which share a picture: files have the same bytes for any number of them.
#include "support/catch.hpp"
#include "support/mpirun.hpp"
#include "support/temporary_folder.hpp"
#include "tracer/exact_sum.hpp"
#include "tracer/wave_share.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace {

using namespace wfpg_test;

const std::string program = WFPG_TEST_RENDER;

// What renderings of the same command line wrote, by one process without --split first.
struct written {
  std::string name;
  std::string bytes;
};

// Renders by some processes. Returns the bytes of the file that `option` names.
written rendered(int ranks, const std::string& arguments, const std::string& option) {
  const temporary_folder folder;
  const std::string file = folder.file(option == "-o" ? "out.exr" : "out");
  const printed all = mpirun(ranks, program + " " + arguments + " " + option + " " + file);
  INFO(all.text);
  REQUIRE(all.code == 0);
  return {std::to_string(ranks) + " ranks: " + arguments, content_of(file)};
}

void check_same(const std::vector<written>& files) {
  REQUIRE(files.front().bytes.size() > 1000);
  for (const written& file : files) {
    INFO(file.name);
    CHECK((file.bytes == files.front().bytes));
  }
}

}  // namespace

TEST_CASE("Exact sums do not depend on the order, nor on the ranks", "[renderer][mpi]") {
  const std::vector<double> values = {3.0e11, 1.0e-9, 255.999, 0.1, 3.0e11, 1.0 / 3.0, 256.0, 7.0e-17};
  double sum = 0.0;
  for (const double value : values) sum += value;
  std::uint64_t forwards[4], backwards[4];
  render::exact_sum first, last, reversed;
  for (std::size_t i = 0; i < values.size(); ++i) {
    (i < 3 ? first : last).add(values[i]);
    reversed.add(values[values.size() - 1 - i]);
  }
  first.split(forwards);
  last.split(backwards);
  for (int part = 0; part < 4; ++part) forwards[part] += backwards[part];
  reversed.split(backwards);
  CHECK(render::exact_sum::joined(forwards) == render::exact_sum::joined(backwards));
  CHECK(render::exact_sum::joined(forwards) == Approx(sum).epsilon(1.0e-15));

  render::exact_sum odd;
  for (const double value : {-1.0, std::nan(""), 0.0, std::numeric_limits<double>::infinity()})
    odd.add(value);
  odd.split(forwards);
  CHECK(render::exact_sum::joined(forwards) == 0x1p40);
}

TEST_CASE("Ranks' parts make up a wave, and have its random numbers", "[renderer][mpi]") {
  constexpr std::size_t pixels = 7, samples = 3;
  for (std::size_t ranks = 1; ranks <= 21; ++ranks) {
    std::size_t path = 0;
    for (std::size_t rank = 0; rank < ranks; ++rank) {
      const render::wave_share part = render::wave_share::part_of(pixels, samples, rank, ranks);
      CHECK(part.first == path);
      CHECK(part.count >= 1);
      const render::random_stream random = part.random(5, 10);
      for (std::uint32_t i = 0; i < part.count; ++i, ++path) {
        const auto pixel = static_cast<std::uint32_t>(path % pixels);
        const auto sample = static_cast<std::uint32_t>(10 + path / pixels);
        CHECK(random.pixel_of(i) == pixel);
        CHECK(random.sample_of(i) == sample);
        CHECK((random(i, 3) == render::random_stream{5, sample}(pixel, 3)));
      }
    }
    CHECK(path == pixels * samples);
  }
}

TEST_CASE("A picture has the same bytes for any number of processes", "[renderer][mpi]") {
  const std::string what = GENERATE("ajar --method pt --size 33x17 --spp 7",
                                    "glossy-room --method vpt --fog 0.05 --size 17x11 --spp 5");
  std::vector<written> files = {rendered(1, what, "-o")};
  for (const int ranks : {1, 2, 3}) {
    if (ranks > 1) files.push_back(rendered(ranks, what + " --split tiles", "-o"));
    files.push_back(rendered(ranks, what + " --split samples --samples-a-wave 3", "-o"));
  }
  check_same(files);
}

TEST_CASE("Guides have the same bytes for any number of processes", "[renderer][mpi]") {
  const std::string split = GENERATE("--split tiles", "--split samples --samples-a-wave 3");
  const temporary_folder folder;
  std::vector<written> guides, pictures;
  for (const int ranks : {1, 2, 3}) {
    const std::string guide = folder.file("guide" + std::to_string(ranks));
    pictures.push_back(rendered(ranks,
                                "many-lamps --method wfpg --size 33x17 --spp 20 --least-gain 0 " + split +
                                    " --field-budget 1MiB --save-guide " + guide,
                                "-o"));
    guides.push_back({pictures.back().name, content_of(guide)});
  }
  check_same(guides);
  check_same(pictures);
}

TEST_CASE("A state is that of one process, and other numbers of them go on from it", "[renderer][mpi]") {
  const std::string what = "ajar --method pt --size 33x17 --seed 5";
  const written state = rendered(3, what + " --spp 4 --split tiles", "--save-state");
  check_same({rendered(1, what + " --spp 4", "--save-state"), state});
  const temporary_folder folder;
  const std::string resumed = what + " --spp 7 --split tiles --resume " + folder.write("state", state.bytes);
  check_same({rendered(1, what + " --spp 7", "-o"), rendered(2, resumed, "-o")});
}

TEST_CASE("Processes that disagree are told so", "[renderer][mpi]") {
  const temporary_folder folder;
  const std::string same = " --size 8x8 --spp 2 --split tiles --stats " + folder.file("stats");
  const std::string other =
      GENERATE("ajar --method pt --seed 4", "ajar --method wfpg", "cornell-box --method pt");
  const printed all =
      mpirun(1, program + " ajar --method pt" + same + " : -n 1 " + program + " " + other + same);
  INFO(all.text);
  CHECK_THAT(all.text, WFPG_TEST_CONTAINS("and another rank have different scenes, options or versions"));
}

TEST_CASE("What cannot be shared is refused before any work", "[renderer][mpi]") {
  const printed method = mpirun(1, program + " ajar --method bpt --split tiles -o a.exr");
  CHECK_THAT(method.text, WFPG_TEST_CONTAINS("--split requires --method pt"));
  const printed state =
      mpirun(1, program + " ajar --method pt --split samples --save-state a.state -o a.exr");
  CHECK_THAT(state.text, WFPG_TEST_CONTAINS("--save-state requires --split tiles, or none"));
  const printed wave = mpirun(1, program + " ajar --method pt --split tiles --samples-a-wave 3 -o a.exr");
  CHECK_THAT(wave.text, WFPG_TEST_CONTAINS("--samples-a-wave requires --split samples"));
}

TEST_CASE("A process that is killed ends the others within the time limit", "[renderer][mpi]") {
  const temporary_folder folder;
  const std::string line = program +
                           " ajar --method pt --size 64x36 --seconds 30 --split tiles --rank-seconds 2 -o " +
                           folder.file("out.exr");
  const printed all = mpirun(1, line + " : -n 1 timeout -s KILL 1 " + line);
  INFO(all.text);
  CHECK_THAT(all.text,
             WFPG_TEST_CONTAINS("wfpg-render: rank 0 waited 2 s in all_reduce_max for another rank"));
}
