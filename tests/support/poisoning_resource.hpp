// A memory resource that fills new memory with a value, so that reads before writes show.
#pragma once

#include "support/policies.hpp"

#include <cstddef>

namespace wfpg_test {

/// Allocates memory of a policy's default resource, with one value in every byte.
template <class Exec>
class poisoning_resource : public wfpg::memory_resource {
 public:
  explicit poisoning_resource(unsigned char byte) : byte_(byte) {}

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    void* const block = upstream_->allocate(bytes, alignment);
    Exec().fill_bytes(block, byte_, bytes);
    return block;
  }
  void do_deallocate(void* block, std::size_t bytes, std::size_t alignment) override {
    upstream_->deallocate(block, bytes, alignment);
  }
  bool do_is_equal(const wfpg::memory_resource& other) const noexcept override { return this == &other; }

  wfpg::memory_resource* upstream_ = default_resource();
  unsigned char byte_;
};

}  // namespace wfpg_test
