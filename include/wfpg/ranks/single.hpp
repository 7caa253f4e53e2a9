// The communicator of one rank: it exchanges nothing. A guider with it learns the guide that n ranks learn.
// Without any communicator a guider costs less, and learns an equal guide where rays are numbered as paths.
//
// Source: wfpg's own.
// Cost: none. Memory: none.
#pragma once

#include <wfpg/ranks/communicator.hpp>

namespace wfpg {

/// Rank 0 of 1. All values are already those of all ranks.
class single_rank final : public communicator {
 public:
  /// Returns 0.
  std::uint32_t rank() const override { return 0; }
  /// Returns 1.
  std::uint32_t size() const override { return 1; }
  /// Leaves the values as they are: they are those of all ranks. The calls below do, too. None of them
  /// throws, or waits.
  void all_reduce_sum(array_view<std::uint32_t>) override {}
  /// As above, of 64 bits.
  void all_reduce_sum(array_view<std::uint64_t>) override {}
  void all_reduce_max(array_view<std::uint32_t>) override {}
  /// As above, of 64 bits.
  void all_reduce_max(array_view<std::uint64_t>) override {}
  void broadcast(array_view<unsigned char>, std::uint32_t) override {}
};

}  // namespace wfpg
