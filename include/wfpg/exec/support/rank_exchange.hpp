// Collects what ranks exchange at a sample's end, so that it takes few reductions.
// A reduction waits for all ranks, which takes longer than its bytes.
// Parts of a guide add arrays, queues of values, and what is to be done with the results.
//
// Source: wfpg's own.
// Cost: one reduction of all arrays, and four more where queues have values.
// Memory: on the host, a few words for each array.
#pragma once

#include <wfpg/exec/support/value_queue.hpp>
#include <wfpg/ranks/communicator.hpp>

#include <functional>
#include <utility>
#include <vector>

namespace wfpg::detail {

/// One exchange of all ranks, made anew for each sample's end.
/// All ranks must add as many arrays of equal kinds and sizes, in one order.
template <class Exec>
class rank_exchange {
 public:
  /// Of nothing. `ranks` outlive it.
  explicit rank_exchange(communicator& ranks) : ranks_(ranks) {}

  /// Returns the ranks that exchange, whose numbers decide who gives what all of them have.
  communicator& ranks() const { return ranks_; }
  /// Adds an array. `take`: reads the result; it is called by run().
  void add(const reduction& array, std::function<void()> take) {
    arrays_.push_back(array);
    takes_.push_back(std::move(take));
  }
  /// Adds a queue, whose next sum() then has nothing to do. It must have ranks, and stay where it is.
  void add(value_queue<Exec>& queue) { queues_.push_back(&queue); }
  /// Exchanges all that was added. Waits for the work before it. Throws rank_error and out_of_memory, and
  /// std::invalid_argument where a queue has more than 2³¹ values.
  void run(const Exec& exec) {
    value_queue<Exec>::sum_of_ranks(exec, ranks_, queues_, arrays_);
    for (const std::function<void()>& take : takes_) take();
  }

 private:
  // As given.
  communicator& ranks_;
  // In the order in which they were added, which all ranks share.
  std::vector<reduction> arrays_;
  std::vector<std::function<void()>> takes_;  // an array each
  std::vector<value_queue<Exec>*> queues_;
};

}  // namespace wfpg::detail
