// Ranks as threads of one process: for tests, and for ranks that share one GPU. Each thread owns a
// thread_communicator; all of them refer to one thread_ranks.
//
//   wfpg::thread_ranks ranks(4);
//   wfpg::thread_communicator<Exec> here(exec, ranks, r);  // in thread r; options.ranks points to it
//
// Values are added in the order in which ranks come, which does not matter for integers. The last rank that
// comes to a call completes it. Ranks that wait throw rank_error where one is late, has
// destroyed its communicator, or makes another call.
//
// Source: wfpg's own.
// Cost: a call copies the values to the host and back, and adds them under one lock. It waits for the
// policy's work. Memory: a host copy of the values of the two last calls, and one more a rank,
// page-locked where the policy has such.
#pragma once

#include <wfpg/ranks/communicator.hpp>
#include <wfpg/ranks/detail/staging.hpp>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <vector>

namespace wfpg {

/// The meeting point of n ranks in one process. It must outlive their communicators. Any thread may use it.
/// Neither movable nor copyable.
class thread_ranks {
 public:
  /// A meeting point of ranks 0 to n - 1; n is at least 1. Each of them has to have a communicator. A rank
  /// waits for others up to `limit`, at most a day. Then all ranks throw rank_error.
  explicit thread_ranks(std::uint32_t n, std::chrono::milliseconds limit = std::chrono::seconds(30))
      : size_(n > 0 ? n : 1),
        came_(size_, false),
        limit_(limit < std::chrono::hours(24) ? limit : std::chrono::hours(24)) {}
  // Communicators refer to it.
  thread_ranks(const thread_ranks&) = delete;
  thread_ranks& operator=(const thread_ranks&) = delete;

  /// Number of ranks.
  std::uint32_t size() const { return size_; }

 private:
  template <class Exec>
  friend class thread_communicator;

  // What a call does with the values of all ranks.
  enum class operation { sum32, sum64, max32, max64, broadcast };
  // What the ranks do together in one turn.
  struct call {
    operation what;
    std::size_t bytes;   // of each rank's values
    std::uint32_t root;  // of a broadcast

    // All ranks of a turn must make equal calls.
    bool operator==(const call& other) const {
      return what == other.what && bytes == other.bytes && root == other.root;
    }
    // As messages say it.
    std::string text() const;
  };

  // Waits until all ranks made the call. Then writes its result over `data`. Spins for a millisecond at
  // first, since ranks that are equally fast come in less.
  void meet(std::uint32_t rank, const call& now, unsigned char* data);
  // Adds one rank's values to the turn's result.
  static void combine(std::uint32_t rank, const call& now, const unsigned char* data,
                      std::vector<unsigned char>& result);
  // Waits until `turn` is completed, a rank is lost, or the limit has passed. The lock is free meanwhile.
  void wait_for_turn(std::unique_lock<std::mutex>& lock, std::uint64_t turn);
  // Ends all calls that wait, and all that follow. The first reason stays.
  void lose(const std::string& reason);
  // Whether a rank was lost. No call is made then.
  bool is_lost() const { return !lost_.empty(); }
  // A rank's communicator is destroyed.
  void leave(std::uint32_t rank);
  // Names the ranks that have not made this turn's call.
  std::string missing() const;

  // Number of ranks.
  const std::uint32_t size_;
  // Guards all that follows.
  std::mutex mutex_;
  // A turn was completed, or a rank was lost.
  std::condition_variable changed_;
  std::vector<bool> came_;  // ranks that made this turn's call
  // How long a rank waits for others.
  std::chrono::milliseconds limit_;
  // Why no further call is made. Empty: calls are made.
  std::string lost_;
  // Turns are counted, so that a rank that waits knows its own.
  std::atomic<std::uint64_t> turn_{0};  // calls that were completed; written with the lock held
  std::uint32_t arrived_ = 0;           // ranks that made the call of this turn
  // The call of the turn, and the rank that made it first.
  call first_{};
  std::uint32_t first_rank_ = 0;
  // Of this turn and of the one before, which ranks may still copy.
  std::vector<unsigned char> results_[2];
};

/// One rank's communicator, for arrays in the memory of `Exec`. Its thread makes it, uses it and destroys it.
/// The policy's stream must outlive it.
/// Neither movable nor copyable.
template <class Exec>
class thread_communicator final : public communicator {
 public:
  /// Rank `rank` of `ranks`, each of which is made once. `exec`: the policy of the guider. Throws
  /// std::invalid_argument where there is no such rank.
  thread_communicator(const Exec& exec, thread_ranks& ranks, std::uint32_t rank)
      : exec_(exec), ranks_(ranks), rank_(rank), host_(exec) {
    if (rank >= ranks.size())
      throw std::invalid_argument("wfpg: rank is " + std::to_string(rank) + ", but must be less than " +
                                  std::to_string(ranks.size()));
  }
  thread_communicator(const thread_communicator&) = delete;
  thread_communicator& operator=(const thread_communicator&) = delete;
  /// Ranks that wait for this one, or will, throw rank_error.
  ~thread_communicator() override { ranks_.leave(rank_); }

  /// Number of this rank, as the constructor got it.
  std::uint32_t rank() const override { return rank_; }
  /// Number of ranks.
  std::uint32_t size() const override { return ranks_.size(); }
  /// Replaces each value by its sum over the ranks; waits for all of them. Each of these calls throws
  /// rank_error where the ranks do not meet within the limit.
  void all_reduce_sum(array_view<std::uint32_t> values) override { meet(operation::sum32, values); }
  /// As above, of 64 bits.
  void all_reduce_sum(array_view<std::uint64_t> values) override { meet(operation::sum64, values); }
  /// Replaces each value by the largest.
  void all_reduce_max(array_view<std::uint32_t> values) override { meet(operation::max32, values); }
  /// As above, of 64 bits.
  void all_reduce_max(array_view<std::uint64_t> values) override { meet(operation::max64, values); }
  /// Replaces the bytes by those of the rank `root`.
  void broadcast(array_view<unsigned char> bytes, std::uint32_t root) override {
    meet(operation::broadcast, bytes, root);
  }

 private:
  // As thread_ranks names them.
  using operation = thread_ranks::operation;

  // Takes the values to the host, where the ranks meet, and the result back.
  template <class T>
  void meet(operation what, array_view<T> values, std::uint32_t root = 0) {
    const std::size_t bytes = values.size() * sizeof(T);
    auto* const host = static_cast<unsigned char*>(host_.fit(bytes));
    if (bytes > 0) exec_.copy_to_host(host, values.data(), bytes);
    ranks_.meet(rank_, {what, bytes, root}, host);
    if (bytes > 0) exec_.copy_from_host(values.data(), host, bytes);
  }

  // As the constructor got it.
  Exec exec_;  // copies between the policy's memory and the host's
  thread_ranks& ranks_;
  std::uint32_t rank_;
  detail::staging<Exec> host_;  // values of the last call
};

}  // namespace wfpg

#include <wfpg/ranks/detail/threads_impl.hpp>
