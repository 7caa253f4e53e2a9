// The execution policies: loops, blocks, scratch memory and the emulated warp, against plain loops.
#include "support/catch.hpp"
#include "support/policies.hpp"

#include <wfpg/exec/policy.hpp>

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
  void operator()(std::size_t i) const { __atomic_fetch_add(visits + i, 1u, __ATOMIC_RELAXED); }
};

WFPG_TEST_CASE("a policy is one", "[exec]") {
  const Exec exec;
  CHECK(wfpg::exec::is_execution_policy_v<Exec>);
  CHECK_FALSE(wfpg::exec::is_execution_policy_v<int>);
  CHECK(Exec::warp_width == warp_of<Exec>::width);
  CHECK(exec.resource() == std::pmr::get_default_resource());
  CHECK(exec.concurrency() >= 1);
  wfpg::retaining_resource arena(nullptr);
  CHECK(exec.with_resource(&arena).resource() == &arena);
  CHECK(exec.with_resource(nullptr).resource() == std::pmr::get_default_resource());
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

WFPG_TEST_CASE("loops take a count from the device", "[exec]") {
  const Exec exec;
  const auto visited = [&](std::uint32_t value, std::size_t capacity, bool blocks) {
    const wfpg::buffer<std::uint32_t, Exec> count(exec, words{value});
    const wfpg::buffer<std::uint32_t, Exec> visits(exec, words(100, 0));
    const wfpg::exec::device_count n{count.data(), capacity};
    const count_visits visit{visits.data()};
    if (blocks)
      exec.for_each_block(n, 16, [=](typename Exec::block&, std::size_t i) { visit(i); });
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

/// A block's work: each has to see its own scratch memory only, aligned, and as much as it asked for.
template <class Block>
struct use_scratch {
  std::uint32_t* results;
  void operator()(Block& block, std::size_t i) const {
    constexpr int n = 37;
    char* const odd = block.template scratch<char>(3);
    std::uint64_t* const data = block.template scratch<std::uint64_t>(n);
    double* const other = block.template scratch<double>(1);
    for (int k = 0; k < 3; ++k) odd[k] = 'x';
    *other = -1.0;
    block.for_each(n, [&](int k) { data[k] = i * 1000 + static_cast<std::uint64_t>(k); });
    block.sync();
    const std::uint64_t sum = block.sum(n, [&](int k) { return data[k]; });
    const bool aligned = reinterpret_cast<std::uintptr_t>(data) % alignof(std::uint64_t) == 0;
    results[i] = aligned && *other == -1.0 && sum == n * i * 1000 + n * (n - 1) / 2 ? 1u : 0u;
  }
};

WFPG_TEST_CASE("blocks have scratch memory of their own", "[exec]") {
  const Exec exec;
  const std::size_t n = 500;
  const wfpg::buffer<std::uint32_t, Exec> results(exec, words(n, 0));
  exec.for_each_block(n, 16 + 37 * 8 + 8 + 16, use_scratch<typename Exec::block>{results.data()});
  CHECK((results.to_host(exec) == words(n, 1)));
  exec.for_each_block(0, 16, use_scratch<typename Exec::block>{nullptr});
  exec.for_each_block(3, 0, [](typename Exec::block&, std::size_t) {});
}

/// Runs f(block) in one block and returns what it gives.
template <class Exec, class F>
auto in_block(const Exec& exec, F f) {
  std::decay_t<decltype(f(std::declval<typename Exec::block&>()))> result{};
  exec.for_each_block(1, 4096, [&](typename Exec::block& block, std::size_t) { result = f(block); });
  return result;
}

WFPG_TEST_CASE("sums of a block", "[exec]") {
  const Exec exec;
  for (const int n : {0, 1, 7, 8, 9, 31, 32, 33, 100}) {
    const auto integers = in_block(exec, [&](auto& b) { return b.sum(n, [](int i) { return i * i; }); });
    CHECK(integers == (n - 1) * n * (2 * n - 1) / 6);
    const auto halves = in_block(exec, [&](auto& b) { return b.sum(n, [](int) { return 0.5f; }); });
    CHECK(halves == 0.5f * static_cast<float>(n));
  }
}

WFPG_TEST_CASE("for_each_warp gives every index a whole warp", "[exec]") {
  const Exec exec;
  const words visits = in_block(exec, [](auto& block) {
    words seen(11, 0);
    block.for_each_warp(10, [&](const auto& warp, int i) {
      warp.for_each_lane([&](int) { ++seen[static_cast<std::size_t>(i)]; });
    });
    return seen;
  });
  words expected(11, Exec::warp_width);
  expected[10] = 0;
  CHECK((visits == expected));
}

WFPG_TEST_CASE("lanes: map, ballot and find_first", "[exec]") {
  constexpr int width = Exec::warp_width;
  const warp_of<Exec> warp;
  const auto squares = warp.map([](int lane) { return lane * lane; });
  for (int lane = 0; lane < width; ++lane) CHECK(squares[lane] == lane * lane);

  random_numbers random(1);
  for (int round = 0; round < 200; ++round) {
    std::uint32_t bits =
        static_cast<std::uint32_t>(random.bits()) & static_cast<std::uint32_t>(random.bits());
    if (round == 0) bits = 0;
    if (round == 1) bits = 0xffffffffu;
    if (round == 2) bits = 1u << (width - 1);
    const auto flags = warp.map([&](int lane) { return (bits >> lane & 1u) != 0; });
    int first = 0;
    while (first < width && !(bits >> first & 1u)) ++first;
    const std::uint32_t mask = static_cast<std::uint32_t>((1ull << width) - 1);
    REQUIRE(warp.ballot(flags) == (bits & mask));
    REQUIRE(warp.find_first(flags) == first);
  }
}

WFPG_TEST_CASE("lanes: shuffle and reduce", "[exec]") {
  constexpr int width = Exec::warp_width;
  const warp_of<Exec> warp;
  random_numbers random(2);
  for (int round = 0; round < 50; ++round) {
    const auto value = warp.map([&](int) { return static_cast<std::int64_t>(random.below(1000)) - 500; });
    const auto source = warp.map([&](int) { return static_cast<int>(random.below(width)); });
    const auto shuffled = warp.shuffle(value, source);
    std::int64_t sum = 0, largest = -1000;
    for (int lane = 0; lane < width; ++lane) {
      sum += value[lane];
      largest = std::max(largest, value[lane]);
      REQUIRE(shuffled[lane] == value[source[lane]]);
      REQUIRE(warp.shuffle(value, lane) == value[lane]);
    }
    REQUIRE(warp.reduce(value, [](std::int64_t a, std::int64_t b) { return a + b; }) == sum);
    REQUIRE(warp.reduce(value, [](std::int64_t a, std::int64_t b) { return std::max(a, b); }) == largest);
  }
}

WFPG_TEST_CASE("a warp visits and scans any number of elements", "[exec]") {
  const warp_of<Exec> warp;
  for (const int n : {0, 1, 7, 8, 9, 31, 32, 33, 100}) {
    words visits(static_cast<std::size_t>(n) + 1, 0), sums(visits.size(), 3);
    warp.for_each(n, [&](int i) { ++visits[static_cast<std::size_t>(i)]; });
    warp.inclusive_scan(n, sums.data(), [&](int i) { return sums[static_cast<std::size_t>(i)]; });
    for (std::size_t i = 0; i < static_cast<std::size_t>(n); ++i) {
      REQUIRE(visits[i] == 1);
      REQUIRE(sums[i] == 3 * (i + 1));
    }
    CHECK(visits.back() == 0);
    CHECK(sums.back() == 3);
  }
}

WFPG_TEST_CASE("what a loop throws arrives at the caller", "[exec]") {
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

WFPG_TEST_CASE("Thrust runs on the policy", "[exec]") {
  wfpg::retaining_resource arena(nullptr);
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

#if !defined(WFPG_TEST_ONLY_TBB)
template <class Exec>
std::vector<std::uint32_t> squares_sorted_down(const Exec& exec) {
  const wfpg::buffer<std::uint32_t, Exec> data(exec, 3000);
  const auto view = data.view();
  exec.for_each(view.size(), [=](std::size_t i) { view[i] = static_cast<std::uint32_t>(i * i); });
  thrust::sort(exec.thrust(), view.begin(), view.end(),
               [](std::uint32_t a, std::uint32_t b) { return a > b; });
  return data.to_host(exec);
}

TEST_CASE("three policies in one program", "[exec]") {
  const words serial = squares_sorted_down(wfpg::exec::seq());
  CHECK(serial.front() == 2999u * 2999u);
  CHECK((squares_sorted_down(wfpg::exec::omp()) == serial));
  CHECK((squares_sorted_down(wfpg::exec::tbb()) == serial));
  CHECK(std::is_same_v<wfpg::exec::seq, wfpg::exec::basic_seq<32>>);
  CHECK_FALSE(std::is_same_v<wfpg::exec::omp, wfpg::exec::tbb>);
}
#endif

}  // namespace
