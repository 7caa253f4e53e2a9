// A memory resource that fails at one allocation of many, and the loop over all of them.
#pragma once

#include "support/policies.hpp"

#include <wfpg/base/error.hpp>

#include <cstddef>
#include <cstdio>
#include <new>

namespace wfpg_test {

/// Counts allocations and deallocations, and fails at one of the next allocations.
class failing_resource : public wfpg::memory_resource {
 public:
  explicit failing_resource(wfpg::memory_resource* upstream = default_resource()) : upstream_(upstream) {}

  /// Allocations that are not freed yet.
  std::size_t live() const { return live_; }
  /// Allocations since fail_at().
  std::size_t asked() const { return asked_; }
  /// Whether one has failed since fail_at().
  bool failed() const { return asked_ >= fails_at_ && fails_at_ > 0; }

  /// The k-th allocation from now on fails, counted from 1. 0: none fails.
  void fail_at(std::size_t k) {
    fails_at_ = k;
    asked_ = 0;
  }

 protected:
  /// Throws the failure.
  [[noreturn]] virtual void refuse() const { throw std::bad_alloc(); }

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    if (++asked_ == fails_at_) refuse();
    void* const block = upstream_->allocate(bytes, alignment);
    ++live_;
    return block;
  }
  void do_deallocate(void* block, std::size_t bytes, std::size_t alignment) override {
    --live_;
    upstream_->deallocate(block, bytes, alignment);
  }
  bool do_is_equal(const wfpg::memory_resource& other) const noexcept override { return this == &other; }

  wfpg::memory_resource* upstream_;
  std::size_t live_ = 0, asked_ = 0, fails_at_ = 0;
};

/// Whether a call throws out_of_memory. It may do so only if the resource has failed.
template <class F>
bool runs_out(const failing_resource& resource, const F& call) {
  try {
    call();
  } catch (const wfpg::out_of_memory&) {
    CHECK(resource.failed());
    return true;
  }
  return false;
}

/// Calls f() repeatedly, with the k-th allocation failing in the k-th call, until none fails. Returns the
/// number of failures. f must free all memory that it allocates.
template <class F>
std::size_t fail_at_each(failing_resource& resource, const F& f) {
  const std::size_t before = resource.live();
  for (std::size_t k = 1;; ++k) {
    resource.fail_at(k);
    INFO("allocation " << k);
    const bool failed = runs_out(resource, f);
    CHECK(resource.live() == before);
    CHECK(failed == resource.failed());
    if (!failed) return resource.asked();
  }
}

/// Prints how many allocations failed in a test. .ci/run adds them up.
inline void print_failed(std::size_t allocations) {
  std::printf("allocations failed: %zu\n", allocations);
}

}  // namespace wfpg_test
