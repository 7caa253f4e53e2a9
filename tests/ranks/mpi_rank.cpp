// One rank of tests/test_ranks_mpi.cpp, which starts it by mpirun: mpi_rank CASE. Prints what it finds, then
// "rank R: done". It ends without MPI_Finalize where a rank is lost on purpose.
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/seq.hpp>
#include <wfpg/ranks/mpi.hpp>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#include <sanitizer/lsan_interface.h>
#define WFPG_TEST_FINDS_LEAKS
#endif
#endif

namespace {

// Looks for leaks, but for those of MPI_Init, which loads modules and unloads some of them.
struct leaks {
#if defined(WFPG_TEST_FINDS_LEAKS)
  static void ignore() {
    __lsan_disable();
  }
  static void notice() {
    __lsan_enable();
  }
  static void check() {
    __lsan_do_leak_check();
  }
#else
  static void ignore() {}
  static void notice() {}
  static void check() {}
#endif
};

using exec = wfpg::exec::seq;
using ranks = wfpg::mpi_communicator<exec>;

constexpr double short_limit = 1.0, long_limit = 30.0;  // seconds

int world_rank() {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  return rank;
}

void expect(bool holds, const std::string& what) {
  if (!holds) throw std::runtime_error(what);
}

template <class T, class Value>
std::vector<T> values_of(std::size_t count, const Value& value) {
  std::vector<T> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = value(i);
  return values;
}

// A value of each rank, whose sum wraps around.
template <class T>
T value_of(std::uint32_t rank, std::size_t i) {
  return static_cast<T>(0x9e3779b97f4a7c15ull * (i + 1) * (rank + 1));
}

template <class T>
void check_sums(ranks& joined, std::size_t count) {
  const wfpg::buffer<T, exec> values(
      exec(), values_of<T>(count, [&](std::size_t i) { return value_of<T>(joined.rank(), i); }));
  joined.all_reduce_sum(values.view());
  for (std::size_t i = 0; i < count; ++i) {
    T sum = 0;
    for (std::uint32_t rank = 0; rank < joined.size(); ++rank)
      sum = static_cast<T>(sum + value_of<T>(rank, i));
    expect(values.view()[i] == sum, "sum " + std::to_string(i) + " of " + std::to_string(count));
  }
}

template <class T>
void check_maxima(ranks& joined, std::size_t count) {
  const wfpg::buffer<T, exec> values(
      exec(), values_of<T>(count, [&](std::size_t i) { return value_of<T>(joined.rank(), i); }));
  joined.all_reduce_max(values.view());
  for (std::size_t i = 0; i < count; ++i) {
    T most = 0;
    for (std::uint32_t rank = 0; rank < joined.size(); ++rank) most = std::max(most, value_of<T>(rank, i));
    expect(values.view()[i] == most, "maximum " + std::to_string(i));
  }
}

// Arrays of all kinds in one call.
void check_several(ranks& joined, std::size_t count) {
  const std::uint32_t all = joined.size() * (joined.size() - 1) / 2, most = joined.size() - 1;
  const wfpg::buffer<std::uint32_t, exec> sum32(exec(), std::vector<std::uint32_t>(count, joined.rank())),
      max32(exec(), std::vector<std::uint32_t>(count, joined.rank()));
  const wfpg::buffer<std::uint64_t, exec> sum64(exec(), std::vector<std::uint64_t>(1, joined.rank())),
      max64(exec(), std::vector<std::uint64_t>(1, joined.rank()));
  const wfpg::reduction arrays[] = {wfpg::reduction::sum(sum32.view()), wfpg::reduction::max(max32.view()),
                                    wfpg::reduction::sum(sum64.view()), wfpg::reduction::max(max64.view())};
  joined.all_reduce({arrays, 4});
  for (std::size_t i = 0; i < count; ++i)
    expect(sum32.view()[i] == all && max32.view()[i] == most, "several arrays, 32 bits");
  expect(sum64.view()[0] == all && max64.view()[0] == most, "several arrays, 64 bits");
}

void check_broadcast(ranks& joined, std::size_t count) {
  using T = unsigned char;
  for (std::uint32_t root = 0; root < joined.size(); ++root) {
    const wfpg::buffer<T, exec> bytes(
        exec(), values_of<T>(count, [&](std::size_t i) { return value_of<T>(joined.rank(), i); }));
    joined.broadcast(bytes.view(), root);
    for (std::size_t i = 0; i < count; ++i)
      expect(bytes.view()[i] == value_of<T>(root, i), "byte " + std::to_string(i));
  }
}

// All functions, with pieces that sizes fill, exceed and leave partly empty.
void check_functions() {
  int size = 0;
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  for (std::size_t piece : {std::size_t(100), std::size_t(4) << 20}) {
    ranks joined(exec(), MPI_COMM_WORLD, {long_limit, piece});
    expect(joined.rank() == std::uint32_t(world_rank()) && joined.size() == std::uint32_t(size), "the rank");
    for (std::size_t count : {std::size_t(0), std::size_t(1), std::size_t(24), std::size_t(1000)}) {
      check_sums<std::uint32_t>(joined, count);
      check_sums<std::uint64_t>(joined, count);
      check_maxima<std::uint32_t>(joined, count);
      check_maxima<std::uint64_t>(joined, count);
      check_several(joined, count);
      check_broadcast(joined, count);
    }
  }
  ranks joined(exec(), MPI_COMM_WORLD, {long_limit});
  check_sums<std::uint64_t>(joined, 1500000);  // three pieces
  try {
    joined.broadcast({}, joined.size());
    expect(false, "a root that is no rank was taken");
  } catch (const std::invalid_argument&) {
  }
}

void expect_rank_error(ranks& joined, std::size_t count) {
  const wfpg::buffer<std::uint32_t, exec> values(exec(), std::vector<std::uint32_t>(count, 1));
  for (int time = 0; time < 2; ++time) {
    try {
      joined.all_reduce_sum(values.view());
      std::printf("rank %d: nothing was thrown\n", world_rank());
    } catch (const wfpg::rank_error& error) {
      std::printf("rank %d: time %d: %s\n", world_rank(), time, error.what());
    }
  }
}

// Sums two arrays of 5 values in all, or says what it finds.
void sum_two(ranks& joined, std::size_t first) {
  const wfpg::buffer<std::uint32_t, exec> values(exec(), std::vector<std::uint32_t>(5, 1));
  const wfpg::reduction two[] = {wfpg::reduction::sum(values.view().subview(0, first)),
                                 wfpg::reduction::sum(values.view().subview(first, 5 - first))};
  try {
    joined.all_reduce({two, 2});
  } catch (const wfpg::rank_error& error) {
    std::printf("rank %d: %s\n", world_rank(), error.what());
  }
}

// The last rank ends by a signal, comes too late, or disagrees; the others say what they find.
void lose_rank(const std::string& how) {
  ranks joined(exec(), MPI_COMM_WORLD, {short_limit});
  check_sums<std::uint32_t>(joined, 3);
  const bool is_last = joined.rank() + 1 == joined.size();
  if (is_last && how == "killed") std::raise(SIGKILL);
  if (is_last && how == "late") std::this_thread::sleep_for(std::chrono::milliseconds(2500));
  if (is_last && how == "late") return;
  if (is_last && how == "other_function") {
    const wfpg::buffer<std::uint32_t, exec> values(exec(), std::vector<std::uint32_t>(5, 1));
    try {
      joined.all_reduce_max(values.view());
    } catch (const wfpg::rank_error& error) {
      std::printf("rank %d: %s\n", world_rank(), error.what());
    }
    return;
  }
  if (how == "other_arrays") return sum_two(joined, is_last ? 2 : 3);
  expect_rank_error(joined, is_last && how == "other_count" ? 6 : 5);
}

// The last rank makes no communicator.
void lose_rank_at_first() {
  if (world_rank() == 0) try {
      ranks joined(exec(), MPI_COMM_WORLD, {short_limit});
    } catch (const wfpg::rank_error& error) {
      std::printf("rank 0: %s\n", error.what());
    }
  else
    std::this_thread::sleep_for(std::chrono::milliseconds(2500));
}

// Seconds a call of one value, and of a MiB.
void measure() {
  ranks joined(exec(), MPI_COMM_WORLD, {long_limit});
  for (std::size_t count : {std::size_t(0), std::size_t(1), std::size_t(1) << 17, std::size_t(1) << 20}) {
    const wfpg::buffer<std::uint64_t, exec> values(exec(), std::vector<std::uint64_t>(count, 1));
    const auto begin = std::chrono::steady_clock::now();
    const int calls = count < 2 ? 2000 : 50;
    for (int i = 0; i < calls; ++i) joined.all_reduce_sum(values.view());
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
    if (joined.rank() == 0) std::printf("%zu values: %.1f us a call\n", count, 1e6 * taken.count() / calls);
  }
}

int run(const std::string& name) {
  if (name == "functions")
    check_functions();
  else if (name == "measure")
    measure();
  else if (name == "absent")
    lose_rank_at_first();
  else
    lose_rank(name);
  return 0;
}

}  // namespace

int main(int, char** argv) {
  const std::string name = argv[1];
  try {
    ranks(exec(), MPI_COMM_WORLD);
    return 1;
  } catch (const wfpg::rank_error& error) {
    if (name == "uninitialised") return std::puts(error.what()), 0;
  }
  leaks::ignore();
  MPI_Init(nullptr, nullptr);
  leaks::notice();
  int result = 0;
  try {
    run(name);
    std::printf("rank %d: done\n", world_rank());
  } catch (const std::exception& error) {
    std::printf("rank %d: failed: %s\n", world_rank(), error.what());
    result = 1;
  }
  std::fflush(stdout);
  // MPI's end may wait for a rank that is lost.
  if (name != "functions" && name != "measure") std::_Exit(result);
  leaks::check();
  MPI_Finalize();
  return result;
}
