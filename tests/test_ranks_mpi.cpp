// Ranks as processes, started by mpirun: tests/ranks/mpi_rank.cpp. A rank that is lost is an error on all
// others.
#include "support/catch.hpp"
#include "support/mpirun.hpp"

#include <chrono>
#include <string>

namespace {

using wfpg_test::mpirun;
using wfpg_test::printed;

// Runs a case of mpi_rank by some ranks.
printed run_ranks(int ranks, const std::string& name) {
  return mpirun(ranks, WFPG_TEST_MPI_RANK " " + name);
}

int times(const std::string& text, const std::string& part) {
  int count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

}  // namespace

TEST_CASE("Sums, maxima and broadcasts of any size are those of all ranks", "[ranks][mpi]") {
  const int ranks = GENERATE(1, 2, 3, 4);
  const printed all = run_ranks(ranks, "functions");
  INFO(all.text);
  CHECK(all.code == 0);
  CHECK(times(all.text, ": done") == ranks);
}

TEST_CASE("Without MPI_Init the error says what to call", "[ranks][mpi]") {
  const printed one = run_ranks(1, "uninitialised");
  CHECK(one.code == 0);
  CHECK_THAT(one.text, WFPG_TEST_CONTAINS("MPI is not initialised: call MPI_Init before"));
}

TEST_CASE("A lost rank is an error on all others within the time limit", "[ranks][mpi]") {
  const std::string how = GENERATE("killed", "late");
  const auto begin = std::chrono::steady_clock::now();
  const printed all = run_ranks(3, how);
  INFO(all.text);
  CHECK(all.code != wfpg_test::too_late);
  for (const std::string rank : {"0", "1"}) {
    CHECK_THAT(all.text, WFPG_TEST_CONTAINS("rank " + rank + ": time 0: wfpg: rank " + rank +
                                            " waited 1 s in all_reduce_sum for another rank"));
    CHECK_THAT(all.text,
               WFPG_TEST_CONTAINS("rank " + rank + ": time 1: wfpg: the communicator is of no more use"));
  }
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(30));
}

TEST_CASE("A rank that makes no communicator is an error on the others", "[ranks][mpi]") {
  const printed all = run_ranks(3, "absent");
  INFO(all.text);
  CHECK(all.code != wfpg_test::too_late);
  CHECK(times(all.text, ": done") == 3);
  CHECK_THAT(all.text, WFPG_TEST_CONTAINS("rank 0: wfpg: rank 0 waited 1 s in the constructor"));
}

TEST_CASE("Ranks that disagree are told so, all of them", "[ranks][mpi]") {
  const printed count = run_ranks(3, "other_count");
  INFO(count.text);
  CHECK(count.code == 0);
  CHECK(times(count.text, ": done") == 3);
  CHECK(times(count.text, "calls all_reduce_sum with 5 values, ranks have 5 to 6; give all ranks") == 2);
  CHECK(times(count.text, "calls all_reduce_sum with 6 values, ranks have 5 to 6; give all ranks") == 1);
  const printed function = run_ranks(2, "other_function");
  INFO(function.text);
  CHECK(function.code == 0);
  CHECK(times(function.text, ": done") == 2);
  CHECK(times(function.text, "another rank calls another function") == 2);
  const printed arrays = run_ranks(2, "other_arrays");
  INFO(arrays.text);
  CHECK(arrays.code == 0);
  CHECK(times(arrays.text, "calls all_reduce with 5 values, another rank") == 2);
}
