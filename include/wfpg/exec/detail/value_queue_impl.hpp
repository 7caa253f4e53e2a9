// Sums over ranks, of value_queue.hpp.
#pragma once

#include <wfpg/exec/support/value_queue.hpp>

namespace wfpg::detail {

/// Functor that writes how many values wait in a queue.
struct count_queued {
  const std::uint32_t* queued;
  std::uint32_t capacity;
  std::uint64_t* count;
  WFPG_HD void operator()(std::size_t) const { *count = min(*queued, capacity); }
};

/// Functor that chooses the unit of group i, for n values of all ranks.
struct set_unit_of_ranks {
  value_queue_view queue;
  std::uint32_t n;
  WFPG_HD void operator()(std::size_t i) const { queue.set_unit(i, n); }
};

/// Units follow from the values of all ranks, so that their sums can be added up.
template <class Exec>
void value_queue<Exec>::sum_of_ranks(const Exec& exec) {
  exec.for_each(all_queued_.size(), count_queued{queued_.data(), view_.capacity_, all_queued_.data()});
  ranks_->all_reduce_sum(all_queued_.view());
  const std::uint64_t all = read_element(exec, all_queued_.data());
  require(all <= most_queued, "values that all ranks record in a sample", all, "at most 2^31");
  if (all > 0) {
    ranks_->all_reduce_max(largest_.view());
    exec.for_each(units_.size(), set_unit_of_ranks{view_, static_cast<std::uint32_t>(all)});
    exec.for_each(exec::device_count{queued_.data(), queue_.size()}, add_queued_values{view_});
    if (ranks_->size() > 1) packed_.reduce(exec, *ranks_, pending_.view());
  }
  empty(exec);
}

}  // namespace wfpg::detail
