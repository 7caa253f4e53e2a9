// Sums over ranks, of value_queue.hpp.
#pragma once

#include <wfpg/exec/support/value_queue.hpp>

namespace wfpg::detail {

/// Functor that chooses the unit of group i, for n values of all ranks.
struct set_unit_of_ranks {
  value_queue_view queue;
  std::uint32_t n;
  WFPG_HD void operator()(std::size_t i) const { queue.set_unit(i, n); }
};

/// Functor that writes entry i of n to those of all ranks. Entries of other ranks are 0.
struct place_queued_values {
  const std::uint64_t* queue;
  std::uint64_t* entries;
  std::uint32_t first, n;  // this rank's
  WFPG_HD void operator()(std::size_t i) const { entries[i] = i - first < n ? queue[i - first] : 0; }
};

/// Functor that adds entry i of those of all ranks to its key's sum.
struct add_values_of_ranks {
  value_queue_view queue;
  const std::uint64_t* entries;
  std::uint32_t n;
  WFPG_HD void operator()(std::size_t i) const { queue.add(entries, n, static_cast<std::uint32_t>(i)); }
};

template <class Exec>
void value_queue<Exec>::sum_of_ranks(const Exec& exec) {
  const std::uint32_t rank = ranks_->rank();
  std::uint32_t n = min(read_element(exec, queued_.data()), view_.capacity_);
  exec.fill_bytes(counts_.data(), 0, counts_.bytes());
  exec.copy_from_host(counts_.data() + rank, &n, sizeof n);
  ranks_->all_reduce_sum(counts_.view());
  std::uint64_t first = 0, all = 0;
  const std::vector<std::uint32_t> counts = counts_.to_host(exec);
  for (std::uint32_t r = 0; r < counts.size(); ++r) {
    first += r < rank ? counts[r] : 0;
    all += counts[r];
  }
  require(all <= most_queued, "values that all ranks record in a sample", all, "at most 2^31");
  if (all > 0) {
    ranks_->all_reduce_max(largest_.view());
    exec.for_each(units_.size(), set_unit_of_ranks{view_, static_cast<std::uint32_t>(all)});
    if (all <= 2 * pending_.size())
      gather(exec, static_cast<std::uint32_t>(first), n, static_cast<std::uint32_t>(all));
    else
      add_sums(exec);
  }
  empty(exec);
}

template <class Exec>
void value_queue<Exec>::add_sums(const Exec& exec) {
  exec.for_each(exec::device_count{queued_.data(), queue_.size()}, add_queued_values{view_});
  static_assert(sizeof(pending_values) == 2 * sizeof(std::uint64_t), "the count is a word's lower half");
  ranks_->all_reduce_sum({reinterpret_cast<std::uint64_t*>(pending_.data()), 2 * pending_.size()});
}

template <class Exec>
void value_queue<Exec>::gather(const Exec& exec, std::uint32_t first, std::uint32_t n, std::uint32_t all) {
  const array_view<std::uint64_t> entries = entries_.fit(exec, all, all / 4);
  exec.for_each(all, place_queued_values{queue_.data(), entries.data(), first, n});
  ranks_->all_reduce_sum(entries);
  exec.for_each(all, add_values_of_ranks{view_, entries.data(), all});
}

}  // namespace wfpg::detail
