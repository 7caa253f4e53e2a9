// wfpg-render by several processes, which share a picture: files have the same bytes for any number of them.
#include "support/catch.hpp"
#include "support/mpirun.hpp"
#include "support/temporary_folder.hpp"

#include <filesystem>
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

// Whether mpirun says that a process has failed, and has not taken too long.
bool has_failed(const printed& all) {
  return all.code != 0 && all.code != too_late;
}

void check_same(const std::vector<written>& files) {
  REQUIRE(files.front().bytes.size() > 1000);
  for (const written& file : files) {
    INFO(file.name);
    CHECK((file.bytes == files.front().bytes));
  }
}

}  // namespace

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
  const printed all = mpirun(
      1, program + " ajar --method pt" + same + " : -n 1 " + program + " " + other + same, failing::ends_all);
  INFO(all.text);
  CHECK(has_failed(all));
  CHECK_THAT(all.text, WFPG_TEST_CONTAINS("and another rank have different scenes, options"));
}

TEST_CASE("Without --split, or where it cannot be, several processes write nothing", "[renderer][mpi]") {
  const auto [arguments, reason] = GENERATE(table<const char*, const char*>(
      {{"--method pt", "2 processes were started"},
       {"--method pt --split tiles --device cuda:0,1", "would render on several GPUs"},
       {"--method bpt --split tiles", "--split requires --method pt"},
       {"--method pt --split samples --save-state a.state", "--save-state requires --split tiles, or none"},
       {"--method pt --split tiles --samples-a-wave 3", "--samples-a-wave requires --split samples"}}));
  const temporary_folder folder;
  const printed all =
      mpirun(2, program + " ajar --size 8x8 --spp 1 " + arguments + " -o " + folder.file("a.exr"),
             failing::ends_all);
  INFO(all.text);
  CHECK(has_failed(all));
  CHECK_THAT(all.text, WFPG_TEST_CONTAINS(reason));
  CHECK(files_in(folder) == 0);
}

TEST_CASE("A process that does not join ends the others", "[renderer][mpi]") {
  const temporary_folder folder;
  const printed all = mpirun(1,
                             program + " ajar --method pt --split tiles --rank-seconds 1 -o " +
                                 folder.file("out.exr") + " : -n 1 " WFPG_TEST_MPI_RANK " absent",
                             failing::ends_all);
  INFO(all.text);
  CHECK(has_failed(all));
  CHECK_THAT(all.text, WFPG_TEST_CONTAINS("wfpg-render: rank 0 waited 1 s in the constructor"));
  CHECK(files_in(folder) == 0);
}

TEST_CASE("A process that is killed ends the others within the time limit", "[renderer][mpi]") {
  const temporary_folder folder;
  const std::string log = folder.file("log");
  const std::string line = program +
                           " ajar --method pt --size 64x36 --seconds 300 --split tiles --rank-seconds 2 -o " +
                           folder.file("out.exr");
  const std::string first = folder.write("first.sh", "exec " + line + " 2> " + log + "\n");
  // It is killed once both have joined, which the first one's log says.
  const std::string second = folder.write("second.sh", line + " &\nuntil grep -q 'share the picture' " + log +
                                                           "; do sleep 0.1; done\nkill -KILL $!\nwait $!\n");
  const printed all = mpirun(1, "sh " + first + " : -n 1 sh " + second);
  const std::string text = content_of(log);
  INFO(all.text << text);
  CHECK(all.code != too_late);
  CHECK(!std::filesystem::exists(folder.file("out.exr")));
  CHECK_THAT(text, WFPG_TEST_CONTAINS("rank 0 waited 2 s in all_reduce_max for another rank"));
}
