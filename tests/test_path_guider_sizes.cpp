// Sizes near the end of 32 bits. Too large samples are refused by name before any allocation. Other
// allocations have the right size.
#include "support/catch.hpp"
#include "support/evaluate.hpp"
#include "support/guiding.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/exec/support/value_queue.hpp>

#include <cstddef>
#include <cstdint>
#include <new>
#include <string>
#include <vector>

namespace {

using namespace wfpg_test;

constexpr std::size_t billions = std::size_t(1) << 31;

/// A memory resource of at most 1 MiB.
class small_resource : public wfpg::memory_resource {
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    if (bytes > std::size_t(1) << 20) throw std::bad_alloc();
    return default_resource()->allocate(bytes, alignment);
  }
  void do_deallocate(void* block, std::size_t bytes, std::size_t alignment) override {
    default_resource()->deallocate(block, bytes, alignment);
  }
  bool do_is_equal(const wfpg::memory_resource& other) const noexcept override { return this == &other; }
};

/// How a guider fails with so little memory: the missing bytes, or the message of a refusal.
struct outcome {
  std::size_t missing = 0;
  std::string refused;
};

template <class Exec>
outcome make_guider(const guider_options& options) {
  const box_mesh<Exec> mesh{Exec()};
  small_resource little;
  outcome result;
  try {
    result.refused = refusal(
        [&] { const octree_guider<Exec> guider(Exec().with_resource(&little), mesh.view(), options); });
  } catch (const wfpg::out_of_memory& error) {
    result.missing = error.bytes();
  }
  return result;
}

guider_options options_of(field_lifetime lifetime) {
  guider_options options;
  options.octree_resolution = 8;
  options.fields = lifetime;
  options.kept.budget_bytes = 1 << 16;
  options.deposits_per_leaf.reset();
  return options;
}

WFPG_TEST_CASE("path guider: deposits and vertices beyond 2^31 are refused by name", "[path_guider][sizes]") {
  for (const field_lifetime lifetime : lifetimes) {
    guider_options options = options_of(lifetime);
    options.deposit_capacity = billions + 1;
    CHECK(make_guider<Exec>(options).refused.find("deposit_capacity is 2147483649") != std::string::npos);

    options.deposit_capacity.reset();
    options.max_depth = 4;
    options.max_paths = billions / 4 + 1;
    const outcome vertices = make_guider<Exec>(options);
    CHECK(vertices.refused.find("max_paths times max_depth") != std::string::npos);
    CHECK(vertices.refused.find("deposit_capacity") != std::string::npos);

    options.max_paths = 2 * billions - 1;
    CHECK(make_guider<Exec>(options).refused.find("max_paths is 4294967295") != std::string::npos);
    options.max_paths = 100;
    options.max_rays = 2 * billions - 1;
    CHECK(make_guider<Exec>(options).refused.find("max_rays is 4294967295") != std::string::npos);
  }
}

WFPG_TEST_CASE("path guider: accepted sizes are allocated as a whole", "[path_guider][sizes]") {
  for (const field_lifetime lifetime : lifetimes) {
    guider_options options = options_of(lifetime);
    options.deposit_capacity = billions;
    CHECK(make_guider<Exec>(options).missing >= 8 * billions);

    options.deposit_capacity = 100;
    options.max_depth = 1;
    options.max_paths = 2 * billions - 2;
    CHECK(make_guider<Exec>(options).missing >= 4 * (2 * billions - 2));

    options.max_paths = 10;
    options.max_rays = 2 * billions - 2;
    CHECK(make_guider<Exec>(options).missing >= 4 * (2 * billions - 2));
  }
}

struct reserve_beyond {
  wfpg::detail::value_queue_view queue;
  WFPG_HD bool operator()(std::size_t) const {
    const bool fits_first = queue.fits(queue.reserve(1u << 31));
    queue.reserve(1u << 31);
    return fits_first && !queue.fits(queue.reserve(1));
  }
};

WFPG_TEST_CASE("a full queue stays full after any number of further values", "[path_guider][sizes]") {
  const Exec exec;
  wfpg::detail::value_queue<Exec> queue(exec, 4, 4);
  CHECK(evaluate(exec, 1, reserve_beyond{queue.view()})[0] != 0);
}

}  // namespace
