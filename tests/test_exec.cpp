// The execution policies: loops, blocks, scratch memory and warps, compared with plain loops.
#define WFPG_TEST_EACH_WIDTH

#include "support/catch.hpp"
#include "support/policies.hpp"

#include <wfpg/exec/policy.hpp>
#include <wfpg/exec/support/atomic.hpp>

#include <thrust/scan.h>
#include <thrust/sort.h>

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

namespace {

using namespace wfpg_test;
using words = std::vector<std::uint32_t>;

template <class Exec>
using warp_of = typename Exec::block::warp;

struct count_visits {
  std::uint32_t* visits;
  WFPG_HD void operator()(std::size_t i) const { wfpg::atomic_add(visits + i, 1u); }
};
/// Counts one visit of each block.
struct count_blocks {
  count_visits visit;
  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    block.for_each(1, [&](int) { visit(i); });
  }
};
struct no_work {
  template <class Block>
  WFPG_HD void operator()(Block&, std::size_t) const {}
};

/// A policy that lacks one member, because the derived class hides it.
template <class Exec>
struct complete : Exec {};
template <class Exec>
struct without_fill : Exec {
  void fill_bytes() = delete;
};
template <class Exec>
struct without_copy : Exec {
  void copy_from_host() = delete;
};
template <class Exec>
struct without_sort : Exec {
  void sort_pairs() = delete;
};
template <class Exec>
struct without_loop : Exec {
  void for_each() = delete;
};
template <class Exec>
struct without_runs : Exec {
  void for_each_run() = delete;
};
template <class Exec>
struct without_blocks : Exec {
  void for_each_block() = delete;
};

WFPG_TEST_CASE("a policy without a required member is not a policy", "[exec]") {
  CHECK(wfpg::exec::is_execution_policy_v<complete<Exec>>);
  CHECK_FALSE(wfpg::exec::is_execution_policy_v<without_fill<Exec>>);
  CHECK_FALSE(wfpg::exec::is_execution_policy_v<without_copy<Exec>>);
  CHECK_FALSE(wfpg::exec::is_execution_policy_v<without_sort<Exec>>);
  CHECK_FALSE(wfpg::exec::is_execution_policy_v<without_loop<Exec>>);
  CHECK_FALSE(wfpg::exec::is_execution_policy_v<without_runs<Exec>>);
  CHECK_FALSE(wfpg::exec::is_execution_policy_v<without_blocks<Exec>>);
}

WFPG_TEST_CASE("every tested policy satisfies is_execution_policy_v", "[exec]") {
  const Exec exec;
  CHECK(wfpg::exec::is_execution_policy_v<Exec>);
  CHECK_FALSE(wfpg::exec::is_execution_policy_v<int>);
  CHECK(Exec::warp_width == warp_of<Exec>::width);
  // A device's policy makes its own pool.
  CHECK((exec.resource() == default_resource()) == loops_on_host);
  if constexpr (loops_on_host) CHECK(exec.concurrency() >= 1);
  wfpg::retaining_resource arena(nullptr);
  CHECK(exec.with_resource(&arena).resource() == &arena);
  CHECK((exec.with_resource(nullptr).resource() == exec.resource()) == loops_on_host);
}

WFPG_TEST_CASE("for_each visits each index once", "[exec]") {
  const Exec exec;
  for (const std::size_t n : {0, 1, 255, 256, 257, 10000}) {
    const wfpg::buffer<std::uint32_t, Exec> visits(exec, words(n + 1, 0));
    exec.for_each(n, count_visits{visits.data()});
    words expected(n + 1, 1);
    expected[n] = 0;
    CHECK((visits.to_host(exec) == expected));
  }
}

/// Two steps. The second needs the first's result for its index. Adds up the first step's return values.
struct take_steps {
  count_visits visit;
  std::uint64_t* sum;
  std::uint32_t* begun;
  template <class Run>
  WFPG_HD void operator()(const Run& run) const {
    typename Run::template varying<std::uint32_t> squares;
    const std::uint32_t returned = run.sum([&](std::size_t index, int i) {
      squares[i] = static_cast<std::uint32_t>(index * index);
      return static_cast<std::uint32_t>(index % 5);
    });
    run.once([&] {
      wfpg::atomic_add(sum, std::uint64_t(returned));
      if (run.first() == 0) wfpg::atomic_add(begun, 1u);
    });
    run.for_each([&](std::size_t index, int i) {
      if (squares[i] == static_cast<std::uint32_t>(index * index)) visit(index);
    });
  }
};

WFPG_TEST_CASE("runs take every index through all steps once", "[exec]") {
  const Exec exec;
  for (const std::size_t n : {0, 1, 31, 32, 33, 127, 128, 129, 256, 257, 100000}) {
    INFO(n);
    const wfpg::buffer<std::uint32_t, Exec> visits(exec, words(n + 1, 0)), begun(exec, words{0});
    const wfpg::buffer<std::uint64_t, Exec> sum(exec, std::vector<std::uint64_t>{0});
    exec.for_each_run(n, take_steps{{visits.data()}, sum.data(), begun.data()});
    words expected(n + 1, 1);
    expected[n] = 0;
    CHECK((visits.to_host(exec) == expected));
    const std::size_t rest = n % 5;
    CHECK(sum.to_host(exec)[0] == n / 5 * 10 + (rest > 0 ? rest * (rest - 1) / 2 : 0));
    CHECK(begun.to_host(exec)[0] == 1);
  }
}

WFPG_TEST_CASE("loops read their count from device memory", "[exec]") {
  const Exec exec;
  const auto visited = [&](std::uint32_t value, std::size_t capacity, bool blocks) {
    const wfpg::buffer<std::uint32_t, Exec> count(exec, words{value});
    const wfpg::buffer<std::uint32_t, Exec> visits(exec, words(100, 0));
    const wfpg::exec::device_count n{count.data(), capacity};
    const count_visits visit{visits.data()};
    if (blocks)
      exec.for_each_block(n, 16, count_blocks{visit});
    else
      exec.for_each(n, visit);
    const words seen = visits.to_host(exec);
    CHECK(std::count(seen.begin(), seen.end(), 1u) + std::count(seen.begin(), seen.end(), 0u) == 100);
    CHECK(std::is_sorted(seen.rbegin(), seen.rend()));
    return std::count(seen.begin(), seen.end(), 1u);
  };
  for (const bool blocks : {false, true}) {
    CHECK(visited(40, 100, blocks) == 40);
    CHECK(visited(0, 100, blocks) == 0);
    CHECK(visited(100, 100, blocks) == 100);
    CHECK(visited(4000000000u, 70, blocks) == 70);
  }
}

/// A block's work. Checks that its scratch memory is its own, aligned, and of the requested size.
struct use_scratch {
  std::uint32_t* results;
  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    constexpr int n = 37;
    char* const odd = block.template scratch<char>(3);
    std::uint64_t* const data = block.template scratch<std::uint64_t>(n);
    double* const other = block.template scratch<double>(1);
    block.for_each(3, [&](int k) { odd[k] = 'x'; });
    block.for_each(1, [&](int) { *other = -1.0; });
    block.for_each(n, [&](int k) { data[k] = i * 1000 + static_cast<std::uint64_t>(k); });
    block.sync();
    const std::uint64_t sum = block.sum(n, [&](int k) { return data[k]; });
    const bool aligned = reinterpret_cast<std::uintptr_t>(data) % alignof(std::uint64_t) == 0;
    const bool right = aligned && *other == -1.0 && sum == n * i * 1000 + n * (n - 1) / 2;
    block.for_each(1, [&](int) { results[i] = right ? 1u : 0u; });
  }
};

WFPG_TEST_CASE("blocks have their own scratch memory", "[exec]") {
  const Exec exec;
  const std::size_t n = 500;
  const wfpg::buffer<std::uint32_t, Exec> results(exec, words(n, 0));
  exec.for_each_block(n, 16 + 37 * 8 + 8 + 16, use_scratch{results.data()});
  CHECK((results.to_host(exec) == words(n, 1)));
  exec.for_each_block(0, 16, use_scratch{nullptr});
  exec.for_each_block(3, 0, no_work{});
}

/// Sums of n numbers over a block; each thread adds one.
struct block_sums {
  int n;
  int* integers;
  float* halves;
  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t) const {
    const int of_squares = block.sum(n, [](int i) { return i * i; });
    const float of_halves = block.sum(n, [](int) { return 0.5f; });
    block.for_each(1000, [&](int i) {
      integers[i] = of_squares;
      halves[i] = of_halves;
    });
  }
};

WFPG_TEST_CASE("blocks sum over their threads", "[exec]") {
  const Exec exec;
  for (const int n : {0, 1, 7, 8, 9, 31, 32, 33, 100, 511, 512, 513, 1000}) {
    const wfpg::buffer<int, Exec> integers(exec, 1000);
    const wfpg::buffer<float, Exec> halves(exec, 1000);
    exec.for_each_block(1, 0, block_sums{n, integers.data(), halves.data()});
    CHECK((integers.to_host(exec) == std::vector<int>(1000, (n - 1) * n * (2 * n - 1) / 6)));
    CHECK((halves.to_host(exec) == std::vector<float>(1000, 0.5f * static_cast<float>(n))));
  }
}

struct visit_by_lanes {
  count_visits visit;
  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t) const {
    block.for_each_warp(10, [&](const auto& warp, int i) {
      warp.for_lanes_below(warp.width, [&](int) { visit(static_cast<std::size_t>(i)); });
    });
  }
};

WFPG_TEST_CASE("for_each_warp gives every index a whole warp", "[exec]") {
  const Exec exec;
  const wfpg::buffer<std::uint32_t, Exec> visits(exec, words(11, 0));
  exec.for_each_block(1, 0, visit_by_lanes{{visits.data()}});
  words expected(11, Exec::warp_width);
  expected[10] = 0;
  CHECK((visits.to_host(exec) == expected));
}

/// Results of warp operations on the bits of one number, a bit per lane.
struct lane_flags {
  wfpg::array_view<const std::uint32_t> bits;
  wfpg::array_view<std::uint32_t> ballots;
  wfpg::array_view<int> firsts, squares;
  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t) const {
    block.for_each_warp(static_cast<int>(bits.size()), [&](const auto& warp, int round) {
      const auto flags = warp.map([&](int lane) { return (bits[round] >> lane & 1u) != 0; });
      const std::uint32_t ballot = warp.ballot(flags);
      const int first = warp.find_first(flags);
      const auto of_lanes = warp.map([](int lane) { return lane * lane; });
      warp.for_lanes_below(warp.width,
                           [&](int lane) { squares[round * warp.width + lane] = of_lanes[lane]; });
      warp.for_each(1, [&](int) {
        ballots[round] = ballot;
        firsts[round] = first;
      });
    });
  }
};

WFPG_TEST_CASE("lanes: map, ballot and find_first agree with plain loops", "[exec]") {
  constexpr int width = Exec::warp_width;
  const Exec exec;
  random_numbers random(1);
  words rounds{0u, 0xffffffffu, 1u << (width - 1)};
  while (rounds.size() < 200)
    rounds.push_back(static_cast<std::uint32_t>(random.bits()) & static_cast<std::uint32_t>(random.bits()));
  const wfpg::buffer<std::uint32_t, Exec> bits(exec, rounds), ballots(exec, rounds.size());
  const wfpg::buffer<int, Exec> firsts(exec, rounds.size()), squares(exec, width * rounds.size());
  exec.for_each_block(1, 0, lane_flags{bits.view(), ballots.view(), firsts.view(), squares.view()});
  const words balloted = ballots.to_host(exec);
  const std::vector<int> found = firsts.to_host(exec), mapped = squares.to_host(exec);
  for (std::size_t round = 0; round < rounds.size(); ++round) {
    int first = 0;
    while (first < width && !(rounds[round] >> first & 1u)) ++first;
    const std::uint32_t mask = static_cast<std::uint32_t>((1ull << width) - 1);
    REQUIRE(balloted[round] == (rounds[round] & mask));
    REQUIRE(found[round] == first);
    for (int lane = 0; lane < width; ++lane)
      REQUIRE(mapped[round * width + std::size_t(lane)] == lane * lane);
  }
}

/// Results of warp operations on a number and another lane's index, from each lane.
struct lane_exchange {
  std::int64_t value = 0;
  int source = 0;
  std::int64_t shuffled = 0, broadcast = 0, sum = 0, largest = 0;
};

struct exchange_lanes {
  wfpg::array_view<lane_exchange> lanes;
  int rounds;
  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t) const {
    block.for_each_warp(rounds, [&](const auto& warp, int round) {
      lane_exchange* const own = lanes.data() + round * warp.width;
      const auto value = warp.map([&](int lane) { return own[lane].value; });
      const auto source = warp.map([&](int lane) { return own[lane].source; });
      const auto shuffled = warp.shuffle(value, source);
      const std::int64_t sum = warp.reduce(value, [](std::int64_t a, std::int64_t b) { return a + b; });
      const std::int64_t largest =
          warp.reduce(value, [](std::int64_t a, std::int64_t b) { return a > b ? a : b; });
      for (int from = 0; from < warp.width; ++from) {
        const std::int64_t broadcast = warp.shuffle(value, from);
        warp.for_lanes_below(warp.width, [&](int lane) {
          if (lane == (from + round) % warp.width) own[lane].broadcast = broadcast;
        });
      }
      warp.for_lanes_below(warp.width, [&](int lane) {
        own[lane].shuffled = shuffled[lane];
        own[lane].sum = sum;
        own[lane].largest = largest;
      });
    });
  }
};

WFPG_TEST_CASE("lanes: shuffle and reduce agree with plain loops", "[exec]") {
  constexpr int width = Exec::warp_width, rounds = 50;
  const Exec exec;
  random_numbers random(2);
  std::vector<lane_exchange> before(rounds * width);
  for (lane_exchange& lane : before) {
    lane.value = static_cast<std::int64_t>(random.below(1000)) - 500;
    lane.source = static_cast<int>(random.below(width));
  }
  const wfpg::buffer<lane_exchange, Exec> device(exec, before);
  exec.for_each_block(1, 0, exchange_lanes{device.view(), rounds});
  const std::vector<lane_exchange> after = device.to_host(exec);
  for (int round = 0; round < rounds; ++round) {
    const lane_exchange* const own = after.data() + round * width;
    std::int64_t sum = 0, largest = -1000;
    for (int lane = 0; lane < width; ++lane) {
      sum += own[lane].value;
      largest = std::max(largest, own[lane].value);
    }
    for (int lane = 0; lane < width; ++lane) {
      REQUIRE(own[lane].shuffled == own[own[lane].source].value);
      REQUIRE(own[lane].broadcast == own[(lane - round % width + width) % width].value);
      REQUIRE(own[lane].sum == sum);
      REQUIRE(own[lane].largest == largest);
    }
  }
}

struct visit_and_scan {
  int n;
  std::uint32_t *visits, *sums;
  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t) const {
    block.for_each_warp(1, [&](const auto& warp, int) {
      warp.for_each(n, [&](int i) { ++visits[i]; });
      warp.inclusive_scan(n, sums, [&](int i) { return sums[i]; });
    });
  }
};

WFPG_TEST_CASE("a warp visits and scans any number of elements", "[exec]") {
  const Exec exec;
  for (const int n : {0, 1, 7, 8, 9, 31, 32, 33, 100}) {
    const std::size_t size = static_cast<std::size_t>(n) + 1;
    const wfpg::buffer<std::uint32_t, Exec> device_visits(exec, words(size, 0)),
        device_sums(exec, words(size, 3));
    exec.for_each_block(1, 0, visit_and_scan{n, device_visits.data(), device_sums.data()});
    const words visits = device_visits.to_host(exec), sums = device_sums.to_host(exec);
    for (std::size_t i = 0; i + 1 < size; ++i) {
      REQUIRE(visits[i] == 1);
      REQUIRE(sums[i] == 3 * (i + 1));
    }
    CHECK(visits.back() == 0);
    CHECK(sums.back() == 3);
  }
}

// Kernels cannot throw.
#if !defined(__CUDACC__)
WFPG_TEST_CASE("an exception in a loop reaches the caller", "[exec]") {
  const Exec exec;
  const auto failing = [](std::size_t i) {
    if (i % 1000 == 999) throw std::runtime_error("from the loop");
  };
  CHECK_THROWS_AS(exec.for_each(20000, failing), std::runtime_error);
  const auto failing_block = [&](typename Exec::block&, std::size_t i) { failing(i); };
  CHECK_THROWS_AS(exec.for_each_block(5000, 64, failing_block), std::runtime_error);

  const wfpg::buffer<std::uint32_t, Exec> visits(exec, words(1000, 0));
  exec.for_each(1000, count_visits{visits.data()});
  CHECK((visits.to_host(exec) == words(1000, 1)));
}
#endif

WFPG_TEST_CASE("Thrust runs on the policy", "[exec]") {
  wfpg::retaining_resource arena(default_resource());
  const Exec exec = Exec().with_resource(&arena);
  const std::size_t n = 300000;  // more than Thrust sorts in one task
  random_numbers random(3);
  words keys(n), values(n);
  for (std::size_t i = 0; i < n; ++i) {
    keys[i] = random.below(500);
    values[i] = static_cast<std::uint32_t>(i);
  }
  const wfpg::buffer<std::uint32_t, Exec> device_keys(exec, keys), device_values(exec, values);
  thrust::stable_sort_by_key(exec.thrust(), device_keys.data(), device_keys.data() + n, device_values.data());

  std::stable_sort(values.begin(), values.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
  CHECK((device_values.to_host(exec) == values));
  thrust::inclusive_scan(exec.thrust(), device_values.data(), device_values.data() + n, device_values.data());
  std::uint32_t sum = 0;
  for (std::uint32_t& value : values) value = sum += value;
  CHECK((device_values.to_host(exec) == values));
}

/// n pairs with keys of that many bits.
template <class Key, class Exec>
void check_sort(const Exec& exec, std::size_t n, int bits) {
  random_numbers random(n);
  std::vector<Key> keys(n);
  words values(n);
  for (std::size_t i = 0; i < n; ++i) {
    keys[i] = static_cast<Key>(random.bits() >> (64 - bits));
    if (i % 3 == 0) keys[i] = keys[i / 2];  // many equal keys
    values[i] = static_cast<std::uint32_t>(i);
  }
  const wfpg::buffer<Key, Exec> device_keys(exec, keys), sorted_keys(exec, n);
  const wfpg::buffer<std::uint32_t, Exec> device_values(exec, values), sorted_values(exec, n);
  exec.sort_pairs(n, bits, device_keys.data(), device_values.data(), sorted_keys.data(),
                  sorted_values.data());
  CHECK((device_keys.to_host(exec) == keys));
  CHECK((device_values.to_host(exec) == values));
  std::stable_sort(values.begin(), values.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
  CHECK((sorted_values.to_host(exec) == values));
  std::sort(keys.begin(), keys.end());
  CHECK((sorted_keys.to_host(exec) == keys));
}

WFPG_TEST_CASE("pairs are sorted stably by the bits of their keys", "[exec]") {
  wfpg::retaining_resource arena(default_resource());
  const Exec exec = Exec().with_resource(&arena);
  for (const std::size_t n : {0, 1, 2, 1000, 300000}) {
    INFO(n << " pairs");
    for (const int bits : {1, 9, 32}) check_sort<std::uint32_t>(exec, n, bits);
    for (const int bits : {5, 40, 63}) check_sort<std::uint64_t>(exec, n, bits);
  }
}

#if defined(WFPG_TEST_SEVERAL_POLICIES)
template <class Exec>
std::vector<std::uint32_t> squares_sorted_down(const Exec& exec) {
  const wfpg::buffer<std::uint32_t, Exec> data(exec, 3000);
  const auto view = data.view();
  exec.for_each(view.size(), [=](std::size_t i) { view[i] = static_cast<std::uint32_t>(i * i); });
  thrust::sort(exec.thrust(), view.begin(), view.end(),
               [](std::uint32_t a, std::uint32_t b) { return a > b; });
  return data.to_host(exec);
}

TEST_CASE("three policies work in one program", "[exec]") {
  const words serial = squares_sorted_down(wfpg::exec::seq());
  CHECK(serial.front() == 2999u * 2999u);
  CHECK((squares_sorted_down(wfpg::exec::omp()) == serial));
  CHECK((squares_sorted_down(wfpg::exec::tbb()) == serial));
  CHECK(std::is_same_v<wfpg::exec::seq, wfpg::exec::basic_seq<32>>);
  CHECK_FALSE(std::is_same_v<wfpg::exec::omp, wfpg::exec::tbb>);
}

TEST_CASE("the policy that other tests share has the loops and threads of the backend they choose",
          "[exec]") {
  const int before = omp_get_max_threads();
  omp_set_num_threads(5);
  tbb::task_arena(3).execute([&] {
    const words serial = squares_sorted_down(wfpg::exec::seq());
    for (const auto& [chosen, threads] :
         {std::pair(backend::seq, 1), std::pair(backend::omp, 5), std::pair(backend::tbb, 3)}) {
      const backend_choice choice(chosen);
      const basic_chosen<32> exec;
      CHECK(exec.concurrency() == threads);
      std::uint32_t in_regions = 0;
      exec.for_each(1000, [&](std::size_t) {
        if (omp_in_parallel()) wfpg::atomic_add(&in_regions, 1u);
      });
      CHECK(in_regions == (chosen == backend::omp ? 1000u : 0u));
      CHECK((squares_sorted_down(exec) == serial));
    }
  });
  omp_set_num_threads(before);
}
#endif

}  // namespace
