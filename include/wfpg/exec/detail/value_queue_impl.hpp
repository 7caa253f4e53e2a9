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
void value_queue<Exec>::sum_of_ranks(const Exec& exec, communicator& ranks,
                                     const std::vector<value_queue*>& queues, std::vector<reduction> arrays) {
  for (value_queue* const one : queues) {
    std::uint64_t* const count = one->all_queued_.data();
    exec.for_each(one->all_queued_.size(), count_queued{one->queued_.data(), one->view_.capacity_, count});
    arrays.push_back(reduction::sum(one->all_queued_.view()));
  }
  ranks.all_reduce({arrays.data(), arrays.size()});

  // Of queues with values.
  arrays.clear();
  std::vector<value_queue*> with_values;
  std::vector<std::uint32_t> counts;
  for (value_queue* const one : queues) {
    const std::uint64_t all = read_element(exec, one->all_queued_.data());
    require(all <= most_queued, "values that all ranks record in a sample", all, "at most 2^31");
    if (all == 0) continue;
    with_values.push_back(one);
    counts.push_back(static_cast<std::uint32_t>(all));
    arrays.push_back(reduction::max(one->largest_.view()));
  }
  if (!arrays.empty()) ranks.all_reduce({arrays.data(), arrays.size()});
  std::vector<sums_to_pack<Exec>> sums;
  for (std::size_t i = 0; i < with_values.size(); ++i) {
    value_queue* const one = with_values[i];
    exec.for_each(one->units_.size(), set_unit_of_ranks{one->view_, counts[i]});
    exec.for_each(exec::device_count{one->queued_.data(), one->queue_.size()}, add_queued_values{one->view_});
    sums.push_back({&one->packed_, one->pending_.view(), {}});
  }
  if (ranks.size() > 1) packed_sums<Exec>::reduce(exec, ranks, sums);
  for (value_queue* const one : queues) {
    one->empty(exec);
    one->is_summed_ = true;
  }
}

}  // namespace wfpg::detail
