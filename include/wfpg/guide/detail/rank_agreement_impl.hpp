// Implementation of rank_agreement.hpp.
#pragma once

#include <wfpg/exec/buffer.hpp>
#include <wfpg/guide/rank_agreement.hpp>

#include <algorithm>
#include <string>

namespace wfpg {

template <class Exec>
void agreed_items::check(const Exec& exec, communicator& ranks) const {
  // The largest of each value, and of its complement: all are equal where these are complements, too.
  std::vector<std::uint64_t> values;
  for (const auto& [name, value] : items_) {
    values.push_back(value);
    values.push_back(~value);
  }
  const buffer<std::uint64_t, Exec> shared(exec, values);
  ranks.all_reduce_max(shared.view());
  values = shared.to_host(exec);
  for (std::size_t i = 0; i < items_.size(); ++i)
    if (values[2 * i] != ~values[2 * i + 1])
      throw rank_error(std::string("ranks differ in ") + items_[i].first +
                       ": all ranks need the same scene, options and version");
}

namespace detail {

template <class Exec>
void require_all_paths(const Exec& exec, const sampling_options& options) {
  communicator& ranks = *options.ranks;
  const std::size_t n = ranks.size();
  std::vector<std::uint64_t> ends(2 * n, 0);
  ends[2 * ranks.rank()] = options.first_path;
  ends[2 * ranks.rank() + 1] = options.first_path + options.max_paths;
  const buffer<std::uint64_t, Exec> shared(exec, ends);
  ranks.all_reduce_sum(shared.view());
  ends = shared.to_host(exec);
  std::vector<std::pair<std::uint64_t, std::uint64_t>> parts;
  for (std::size_t r = 0; r < n; ++r) parts.emplace_back(ends[2 * r], ends[2 * r + 1]);
  std::sort(parts.begin(), parts.end());
  std::uint64_t next = 0;
  for (const auto& [first, end] : parts) {
    if (first != next)
      throw rank_error("parts of ranks " + std::string(first < next ? "overlap" : "leave out paths") +
                       " at path " + std::to_string(min(first, next)) +
                       ": set first_path and max_paths to parts in a row");
    next = end;
  }
  if (next != all_paths_of(options))
    throw rank_error("parts of ranks leave out paths from " + std::to_string(next) +
                     " on: set max_paths so that they add up to all_paths");
}

WFPG_COLD inline void add_options(agreed_items& items, const sampling_options& o) {
  items.add("all_paths", std::uint64_t(all_paths_of(o)));
  items.add("max_depth", std::uint64_t(o.max_depth));
  items.add("guide_fraction", o.guide_fraction.value_or(-1.0f));
  items.add("guided_depths", std::uint64_t(o.guided_depths));
  items.add("include_emission", std::uint64_t(o.include_emission));
  items.add("unguided_samples", std::uint64_t(o.unguided_samples));
  items.add("seed", o.seed);
  items.add("silent_escapes", std::uint64_t(o.silent_escapes));
}

}  // namespace detail
}  // namespace wfpg
