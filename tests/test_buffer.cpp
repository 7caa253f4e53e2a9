// Owning storage: moves, transfers, failing allocations, and the retaining resource.
#define WFPG_TEST_EACH_WIDTH

#include "support/catch.hpp"
#include "support/failing_resource.hpp"
#include "support/policies.hpp"

#include <wfpg/base/error.hpp>
#include <wfpg/exec/buffer.hpp>

#include <thrust/reduce.h>
#include <thrust/sort.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory_resource>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace {

using namespace wfpg_test;

/// Counts allocations, fails above a limit, and detects calls from other threads.
class counting_resource : public wfpg::memory_resource {
 public:
  explicit counting_resource(wfpg::memory_resource* upstream, std::size_t limit = ~std::size_t(0))
      : upstream_(upstream), limit_(limit) {}

  std::size_t live = 0;
  std::size_t allocations = 0;
  bool foreign_thread = false;
  void set_limit(std::size_t limit) { limit_ = limit; }

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    foreign_thread |= std::this_thread::get_id() != owner_;
    if (live + bytes > limit_) throw std::bad_alloc();
    live += bytes;
    ++allocations;
    return upstream_->allocate(bytes, alignment);
  }
  void do_deallocate(void* block, std::size_t bytes, std::size_t alignment) override {
    foreign_thread |= std::this_thread::get_id() != owner_;
    live -= bytes;
    upstream_->deallocate(block, bytes, alignment);
  }
  bool do_is_equal(const wfpg::memory_resource& other) const noexcept override { return this == &other; }

  wfpg::memory_resource* upstream_;
  std::size_t limit_;
  std::thread::id owner_ = std::this_thread::get_id();
};

WFPG_TEST_CASE("a buffer that is fit to a size grows with what is spare, and stays where it is large enough",
               "[buffer]") {
  const Exec exec;
  wfpg::buffer<std::uint32_t, Exec> values;
  CHECK(values.fit(exec, 10, 5).size() == 10);
  CHECK(values.size() == 15);
  const std::uint32_t* const before = values.data();
  CHECK(values.fit(exec, 15, 100).data() == before);
  CHECK(values.size() == 15);
  CHECK(values.fit(exec, 16, 0).size() == 16);
  CHECK(values.size() == 16);
}

WFPG_TEST_CASE("a buffer owns its elements", "[buffer]") {
  counting_resource resource(default_resource());
  const Exec exec = Exec().with_resource(&resource);
  {
    wfpg::buffer<int, Exec> empty;
    CHECK(empty.size() == 0);
    CHECK(empty.data() == nullptr);
    CHECK(empty.to_host(exec).empty());
    wfpg::buffer<int, Exec> zero(exec, 0);
    CHECK(zero.bytes() == 0);
    CHECK(resource.allocations == 0);

    wfpg::buffer<int, Exec> a(exec, std::vector<int>{1, 2, 3});
    CHECK(a.bytes() == 3 * sizeof(int));
    CHECK(reinterpret_cast<std::uintptr_t>(a.data()) % 64 == 0);
    CHECK((a.to_host(exec, 2) == std::vector<int>{1, 2}));
    CHECK(wfpg::read_element(exec, a.data() + 2) == 3);
    CHECK(a.view().size() == 3);

    wfpg::buffer<int, Exec> b(std::move(a));
    CHECK(a.size() == 0);
    CHECK(a.data() == nullptr);
    CHECK((b.to_host(exec) == std::vector<int>{1, 2, 3}));
    wfpg::buffer<int, Exec> c(exec, 100);
    c = std::move(b);
    CHECK((c.to_host(exec) == std::vector<int>{1, 2, 3}));
    wfpg::buffer<int, Exec>& alias = c;
    c = std::move(alias);
    CHECK((c.to_host(exec) == std::vector<int>{1, 2, 3}));
    CHECK(resource.live == 3 * sizeof(int));
  }
  CHECK(resource.live == 0);
}

struct no_work {
  template <class Block>
  WFPG_HD void operator()(Block&, std::size_t) const {}
};

WFPG_TEST_CASE("a failing resource throws out_of_memory", "[buffer]") {
  counting_resource resource(default_resource(), 1000);
  const Exec exec = Exec().with_resource(&resource);
  const wfpg::buffer<char, Exec> kept(exec, 900);
  try {
    const wfpg::buffer<int, Exec> refused(exec, 500);
    FAIL("2000 bytes were given");
  } catch (const wfpg::out_of_memory& error) {
    CHECK(error.bytes() == 2000);
    CHECK(std::string(error.what()).find("2000 bytes") != std::string::npos);
  }
  CHECK(resource.live == 900);
  const wfpg::buffer<char, Exec> fits(exec, 100);
  CHECK(fits.size() == 100);
  if constexpr (loops_on_host) CHECK_THROWS_AS(exec.for_each_block(4, 4096, no_work{}), wfpg::out_of_memory);
}

/// Allocates temporaries where the policy uses any. OpenMP sorts allocate from the heap; serial reductions
/// need no memory.
template <class Exec>
std::uint32_t sort_and_reduce(const Exec& exec, const wfpg::buffer<std::uint32_t, Exec>& keys,
                              const wfpg::buffer<std::uint32_t, Exec>& values) {
  thrust::stable_sort_by_key(exec.thrust(), keys.data(), keys.data() + keys.size(), values.data());
  return thrust::reduce(exec.thrust(), values.data(), values.data() + values.size());
}

WFPG_TEST_CASE("Thrust allocates temporaries in the calling thread and throws out_of_memory", "[buffer]") {
  counting_resource resource(default_resource());
  const Exec exec = Exec().with_resource(&resource);
  const std::size_t n = 100000;
  random_numbers random(7);
  std::vector<std::uint32_t> host(n);
  for (std::uint32_t& x : host) x = static_cast<std::uint32_t>(random.bits());
  const wfpg::buffer<std::uint32_t, Exec> keys(exec, host), values(exec, host);
  const std::size_t held = resource.live;

  const std::uint32_t sum = sort_and_reduce(exec, keys, values);
  CHECK(resource.allocations > 2);
  CHECK_FALSE(resource.foreign_thread);
  CHECK(resource.live == held);
  std::sort(host.begin(), host.end());
  CHECK((keys.to_host(exec) == host));
  CHECK((values.to_host(exec) == host));

  resource.set_limit(held);
  CHECK_THROWS_AS(sort_and_reduce(exec, keys, values), wfpg::out_of_memory);
  CHECK(resource.live == held);
  resource.set_limit(~std::size_t(0));
  CHECK(sort_and_reduce(exec, keys, values) == sum);
}

template <class Exec>
void fill(const Exec& exec, const wfpg::buffer<int, Exec>& buffer, int value) {
  const wfpg::array_view<int> view = buffer.view();
  exec.for_each(buffer.size(), [=] WFPG_HD(std::size_t i) { view[i] = value; });
}

WFPG_TEST_CASE("a retaining resource allocates once for repeated work", "[buffer]") {
  counting_resource upstream(default_resource());
  {
    wfpg::retaining_resource arena(&upstream);
    const Exec exec = Exec().with_resource(&arena);
    std::size_t after_first = 0;
    for (int round = 0; round < 4; ++round) {
      const wfpg::buffer<int, Exec> a(exec, 5000), b(exec, 5000), c(exec, 3);
      fill(exec, a, 1);
      fill(exec, b, 2);
      CHECK(a.data() != b.data());
      CHECK(a.to_host(exec) == std::vector<int>(5000, 1));
      if (round == 0) after_first = upstream.allocations;
    }
    CHECK(after_first == 3);
    CHECK(upstream.allocations == after_first);
    CHECK(arena.bytes() == upstream.live);
    CHECK(upstream.live >= 2 * 5000 * sizeof(int));

    CHECK(arena.used_bytes() == 0);
    const wfpg::buffer<int, Exec> in_use(exec, 5000);
    CHECK(arena.used_bytes() == in_use.bytes());
    arena.release();
    CHECK(arena.used_bytes() == in_use.bytes());
    CHECK(arena.bytes() == upstream.live);
    CHECK(upstream.live >= in_use.bytes());
    CHECK(upstream.live < 2 * in_use.bytes());
    upstream.set_limit(0);
    CHECK_THROWS_AS((wfpg::buffer<int, Exec>(exec, 5000)), wfpg::out_of_memory);
  }
  CHECK(upstream.live == 0);
}

TEST_CASE("a retaining resource returns blocks that are large enough", "[buffer]") {
  counting_resource upstream(std::pmr::get_default_resource());
  wfpg::retaining_resource arena(&upstream);
  for (std::size_t bytes = 1; bytes < 3000; ++bytes) {
    const std::size_t before = upstream.live;
    void* const block = arena.allocate(bytes, 64);
    std::memset(block, 0x5a, bytes);
    arena.deallocate(block, bytes, 64);
    REQUIRE((upstream.live == before || upstream.live - before >= bytes));
  }
  CHECK(upstream.live < 20000);
}

/// Sets the default resource while it lives.
class default_resource_scope {
 public:
  explicit default_resource_scope(wfpg::memory_resource* resource)
      : before_(std::pmr::set_default_resource(resource)) {}
  default_resource_scope(const default_resource_scope&) = delete;
  default_resource_scope& operator=(const default_resource_scope&) = delete;
  ~default_resource_scope() { std::pmr::set_default_resource(before_); }

 private:
  wfpg::memory_resource* before_;
};

/// Allocates blocks of several sizes, frees them in another order, repeats this, and releases all.
template <class Exec>
void use_blocks(const Exec& exec) {
  for (int round = 0; round < 2; ++round) {
    wfpg::buffer<char, Exec> first(exec, 1000);
    const wfpg::buffer<char, Exec> second(exec, 1000), third(exec, 9), fourth(exec, 50000);
    first = wfpg::buffer<char, Exec>(exec, 300);
  }
}

WFPG_TEST_CASE("a retaining resource throws from allocate, never from deallocate", "[buffer]") {
  failing_resource upstream, entries(std::pmr::new_delete_resource());
  const default_resource_scope scope(&entries);
  const auto use = [&] {
    wfpg::retaining_resource arena(&upstream);
    use_blocks(Exec().with_resource(&arena));
    CHECK(arena.bytes() > 50000);
  };
  CHECK(fail_at_each(upstream, use) == 5);
  upstream.fail_at(0);
  CHECK(fail_at_each(entries, use) == 5);
  CHECK((upstream.live() == 0 && entries.live() == 0));

  entries.fail_at(0);
  wfpg::retaining_resource arena(&upstream);
  void* const block = arena.allocate(1000, 64);
  entries.fail_at(1);
  arena.deallocate(block, 1000, 64);
  CHECK(entries.asked() == 0);
  CHECK(arena.allocate(999, 64) == block);
  arena.deallocate(block, 999, 64);
  CHECK(entries.asked() == 0);
}

TEST_CASE("errors name what was wrong", "[error]") {
  const auto message = [](auto call) {
    try {
      call();
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string("nothing thrown");
  };
  CHECK(message([] { wfpg::require(true, "size", 3, "4"); }) == "nothing thrown");
  CHECK(message([] { wfpg::require(false, "size", 3, "4"); }) == "wfpg: size is 3, expected 4");
  CHECK(message([] { throw wfpg::device_error(7, "too hot", "launch"); }) ==
        "wfpg: launch: too hot (code 7)");
  CHECK(wfpg::device_error(7, "too hot", "launch").code() == 7);
  CHECK_THROWS_AS(wfpg::require(false, "size", 3, "4"), std::invalid_argument);
}

}  // namespace
