// Lists of marked indices, compared with lists that are filled in order.
#include "support/catch.hpp"
#include "support/evaluate.hpp"
#include "support/failing_resource.hpp"
#include "support/policies.hpp"

#include <wfpg/base/math.hpp>
#include <wfpg/exec/index_list.hpp>

#include <cstdint>
#include <stdexcept>
#include <vector>

namespace {

using namespace wfpg_test;

/// Marks one of `period` elements at random.
struct mark_some {
  std::uint32_t seed, period;
  wfpg::array_view<std::uint32_t> marks;
  WFPG_HD std::uint32_t operator[](std::size_t i) const {
    return wfpg::hash(seed, i) % period == 0 ? 1u : 0u;
  }
  WFPG_HD void operator()(std::size_t i) const { marks[i] = (*this)[i]; }
};

struct count_calls {
  wfpg::array_view<std::uint32_t> calls;
  WFPG_HD void operator()(std::size_t i) const { ++calls[i]; }
};

}  // namespace

WFPG_TEST_CASE("index lists have the marked elements in ascending order", "[index_list]") {
  const Exec exec;
  constexpr std::size_t capacity = 5000;
  wfpg::index_list<Exec> list(exec, capacity);
  CHECK(list.capacity() == capacity);
  CHECK(list.bytes() == 2 * capacity * sizeof(std::uint32_t) + sizeof(std::uint32_t));
  // Lists forget the ones before. A period of 1 marks all elements.
  for (const std::size_t n : {capacity, std::size_t(0), std::size_t(1), std::size_t(777)}) {
    for (const std::uint32_t period : {1u, 2u, 50u, 1000000u}) {
      const mark_some marks{9, period, list.marks()};
      exec.for_each(n, marks);
      list.collect(exec, n);
      std::vector<std::uint32_t> expected, calls(capacity, 0);
      for (std::size_t i = 0; i < n; ++i) {
        if (marks[i] == 0) continue;
        expected.push_back(static_cast<std::uint32_t>(i));
        calls[i] = 1;
      }
      const std::uint32_t count = wfpg::read_element(exec, list.count().value);
      REQUIRE(count == expected.size());
      const wfpg::buffer<std::uint32_t, Exec> called(exec, std::vector<std::uint32_t>(capacity, 0));
      list.for_each(exec, count_calls{called.view()});
      CHECK(called.to_host(exec) == calls);
      std::vector<std::uint32_t> listed(count);
      exec.copy_to_host(listed.data(), list.indices().data(), count * sizeof(std::uint32_t));
      CHECK(listed == expected);
    }
  }
}

namespace {

struct kernel_that_waits : mark_some {
  static constexpr bool waits_for_memory = true;
};
struct kernel_that_computes : mark_some {
  static constexpr bool waits_for_memory = false;
};

}  // namespace

TEST_CASE("index lists tell a policy which kernels wait for memory", "[index_list]") {
  using wfpg::detail::call_at_index;
  using wfpg::detail::waits_for_memory;
  CHECK(bool(waits_for_memory<call_at_index<kernel_that_waits>>::value));
  CHECK_FALSE(bool(waits_for_memory<call_at_index<kernel_that_computes>>::value));
  CHECK_FALSE(bool(waits_for_memory<call_at_index<mark_some>>::value));
}

WFPG_TEST_CASE("index lists are empty before marks are collected", "[index_list]") {
  const Exec exec;
  const wfpg::index_list<Exec> list(exec, 40);
  CHECK(wfpg::read_element(exec, list.count().value) == 0);
}

TEST_CASE("index lists have fewer than 2^32 elements", "[index_list]") {
  CHECK_THROWS_AS(wfpg::index_list<host_policy>(host_policy(), std::size_t(1) << 32), std::invalid_argument);
}

WFPG_TEST_CASE("index lists free what they have where memory runs out", "[index_list]") {
  failing_resource resource;
  const Exec exec = Exec().with_resource(&resource);
  const std::size_t failures = fail_at_each(resource, [&] {
    wfpg::index_list<Exec> list(exec, 100);
    exec.for_each(100, mark_some{1, 2, list.marks()});
    list.collect(exec, 100);
  });
  CHECK(failures >= 3);
  CHECK(resource.live() == 0);
}
