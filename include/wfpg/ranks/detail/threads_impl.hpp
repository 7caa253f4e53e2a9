// Implementation of threads.hpp.
#pragma once

#include <wfpg/ranks/threads.hpp>

#include <cstring>
#include <thread>

namespace wfpg {

namespace detail {

/// Replaces each value of `result` by combine(value, other value). Copies, since bytes may lie anywhere.
template <class T, class Combine>
void combine_values(const unsigned char* data, std::vector<unsigned char>& result, const Combine& combine) {
  for (std::size_t i = 0; i < result.size(); i += sizeof(T)) {
    T a, b;
    std::memcpy(&a, result.data() + i, sizeof a);
    std::memcpy(&b, data + i, sizeof b);
    a = combine(a, b);
    std::memcpy(result.data() + i, &a, sizeof a);
  }
}
template <class T>
void add_values(const unsigned char* data, std::vector<unsigned char>& result) {
  combine_values<T>(data, result, [](T a, T b) { return static_cast<T>(a + b); });
}
template <class T>
void raise_values(const unsigned char* data, std::vector<unsigned char>& result) {
  combine_values<T>(data, result, [](T a, T b) { return a < b ? b : a; });
}

}  // namespace detail

inline std::string thread_ranks::call::text() const {
  static constexpr const char* names[] = {"sum of 32 bits", "sum of 64 bits", "maximum of 32 bits",
                                          "maximum of 64 bits", "broadcast"};
  return std::string(names[static_cast<int>(what)]) + " of " + std::to_string(bytes) + " bytes";
}

inline void thread_ranks::meet(std::uint32_t rank, const call& now, unsigned char* data) {
  std::unique_lock<std::mutex> lock(mutex_);
  if (is_lost()) throw rank_error(lost_);
  const std::uint64_t turn = turn_;
  std::vector<unsigned char>& result = results_[turn % 2];
  if (arrived_ == 0) {
    first_ = now;
    first_rank_ = rank;
    result.assign(now.bytes, 0);
  }
  if (!(now == first_)) {
    lose("rank " + std::to_string(rank) + " calls a " + now.text() + " where rank " +
         std::to_string(first_rank_) + " calls a " + first_.text() +
         ": all ranks must have the same options, samples and waves");
    throw rank_error(lost_);
  }
  if (came_[rank]) {
    lose("rank " + std::to_string(rank) + " has two communicators: make one a rank");
    throw rank_error(lost_);
  }
  combine(rank, now, data, result);
  came_[rank] = true;
  if (++arrived_ == size()) {
    came_.assign(came_.size(), false);
    arrived_ = 0;
    ++turn_;
    changed_.notify_all();
  } else {
    wait_for_turn(lock, turn);
  }
  // A completed turn has a result, even if a rank was lost since.
  if (turn_ == turn) throw rank_error(lost_);
  if (now.bytes > 0) std::memcpy(data, result.data(), now.bytes);
}

inline void thread_ranks::wait_for_turn(std::unique_lock<std::mutex>& lock, std::uint64_t turn) {
  using clock = std::chrono::steady_clock;
  const clock::time_point begin = clock::now();
  lock.unlock();
  while (turn_.load() == turn && clock::now() - begin < std::chrono::milliseconds(1))
    std::this_thread::yield();
  lock.lock();
  if (!changed_.wait_until(lock, begin + limit_, [&] { return turn_ != turn || is_lost(); }))
    lose(missing() + " did not come within " + std::to_string(limit_.count()) + " ms");
}

inline void thread_ranks::combine(std::uint32_t rank, const call& now, const unsigned char* data,
                                  std::vector<unsigned char>& result) {
  switch (now.what) {
    case operation::sum32:
      return detail::add_values<std::uint32_t>(data, result);
    case operation::sum64:
      return detail::add_values<std::uint64_t>(data, result);
    case operation::max32:
      return detail::raise_values<std::uint32_t>(data, result);
    case operation::max64:
      return detail::raise_values<std::uint64_t>(data, result);
    case operation::broadcast:
      if (rank == now.root && now.bytes > 0) std::memcpy(result.data(), data, now.bytes);
  }
}

inline void thread_ranks::lose(const std::string& reason) {
  if (!is_lost()) lost_ = reason;
  changed_.notify_all();
}

inline void thread_ranks::leave(std::uint32_t rank) {
  const std::lock_guard<std::mutex> lock(mutex_);
  lose("rank " + std::to_string(rank) + " has ended");
}

inline std::string thread_ranks::missing() const {
  std::string names;
  for (std::size_t r = 0; r < came_.size(); ++r)
    if (!came_[r]) names += (names.empty() ? "rank " : ", rank ") + std::to_string(r);
  return names;
}

}  // namespace wfpg
