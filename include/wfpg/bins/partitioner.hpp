// Sort-based N-way partition (thesis, section 3.4.3): indices grouped by a 32-bit key, the groups' offsets
// and their number, all left on the device. The spatial binner and a renderer's material sort use it.
//
// Cost: one stable sort of (key, index) pairs and one scan; 16 bytes an index of capacity, and about 8
// more while it sorts.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/thrust.hpp>

#include <thrust/fill.h>
#include <thrust/functional.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/sequence.h>
#include <thrust/transform_scan.h>

namespace wfpg {

/// A partition as kernels see it. Group g < *count holds permutation[offsets[g]] to permutation[offsets[g +
/// 1] - 1], in ascending order of key, and inside a group of index.
struct partition_view {
  array_view<const std::uint32_t> permutation;  ///< indices, group by group
  array_view<const std::uint32_t> offsets;      ///< one more than groups
  array_view<const std::uint32_t> sorted_keys;  ///< of the permutation's elements
  array_view<const std::uint32_t>
      group_through;                     ///< of the permutation's elements: the group, counted from 1
  const std::uint32_t* count = nullptr;  ///< number of groups, in the policy's memory

  /// Where a group begins in the permutation.
  WFPG_HD std::uint32_t begin(std::size_t group) const { return offsets[group]; }
  /// Indices in a group, at least 1.
  WFPG_HD std::uint32_t size(std::size_t group) const { return offsets[group + 1] - offsets[group]; }
  /// What its indices have in common.
  WFPG_HD std::uint32_t key(std::size_t group) const { return sorted_keys[offsets[group]]; }
};

namespace detail {

/// 1 for the first element of a group, 0 for the others.
struct starts_key_group {
  array_view<const std::uint32_t> keys;
  std::uint32_t excluded;
  WFPG_HD std::uint32_t operator()(std::size_t i) const {
    return keys[i] != excluded && (i == 0 || keys[i] != keys[i - 1]) ? 1u : 0u;
  }
};

struct write_group_offsets {
  array_view<const std::uint32_t> keys;
  array_view<const std::uint32_t> group_through;
  std::uint32_t excluded;
  std::uint32_t* offsets;
  std::uint32_t* count;
  WFPG_HD void operator()(std::size_t i) const {
    if (keys[i] == excluded) return;
    const auto at = static_cast<std::uint32_t>(i);
    if (i == 0 || keys[i] != keys[i - 1]) offsets[group_through[i] - 1] = at;
    if (i + 1 < keys.size() && keys[i + 1] != excluded) return;
    offsets[group_through[i]] = at + 1;
    *count = group_through[i];
  }
};

}  // namespace detail

/// Partitions up to `capacity` indices by key, as often as asked, in memory taken once.
template <class Exec>
class partitioner {
 public:
  /// Indices with this key are in no group.
  static constexpr std::uint32_t excluded = 0xffffffffu;

  partitioner() = default;
  /// Throws out_of_memory, std::invalid_argument where capacity is 2³² - 1 or more.
  partitioner(const Exec& exec, std::size_t capacity)
      : keys_(exec, checked(capacity)),
        permutation_(exec, capacity),
        group_through_(exec, capacity),
        offsets_(exec, capacity + 1),
        count_(exec, 1) {}

  /// Groups the indices [0, keys.size()) by their keys: below 2^key_bits - 1, or `excluded`; fewer bits are
  /// sorted sooner. Throws std::invalid_argument beyond the capacity. The view holds until the next call.
  partition_view partition(const Exec& exec, array_view<const std::uint32_t> keys, int key_bits = 32) {
    const std::size_t n = keys.size();
    require(n <= permutation_.size(), "number of keys", n, "at most the partitioner's capacity");
    const array_view<std::uint32_t> through(group_through_.data(), n);
    ::thrust::sequence(exec.thrust(), through.begin(), through.end());
    exec.sort_pairs(n, key_bits, keys.data(), through.data(), keys_.data(), permutation_.data());
    const array_view<const std::uint32_t> sorted(keys_.data(), n);
    const ::thrust::counting_iterator<std::size_t> first(0);
    ::thrust::transform_inclusive_scan(exec.thrust(), first, first + static_cast<std::ptrdiff_t>(n),
                                       through.begin(), detail::starts_key_group{sorted, excluded},
                                       ::thrust::plus<std::uint32_t>());
    ::thrust::fill_n(exec.thrust(), count_.data(), 1, 0u);
    ::thrust::fill_n(exec.thrust(), offsets_.data(), 1, 0u);
    exec.for_each(n, detail::write_group_offsets{sorted, through, excluded, offsets_.data(), count_.data()});
    return {{permutation_.data(), n}, {offsets_.data(), n + 1}, sorted, through, count_.data()};
  }

  /// Of all that it allocated.
  std::size_t bytes() const {
    return keys_.bytes() + permutation_.bytes() + group_through_.bytes() + offsets_.bytes() + count_.bytes();
  }

 private:
  // Before memory is asked for.
  static std::size_t checked(std::size_t capacity) {
    require(capacity < 0xffffffffull, "partitioner capacity", capacity, "less than 2^32 - 1");
    return capacity;
  }

  buffer<std::uint32_t, Exec> keys_;
  buffer<std::uint32_t, Exec> permutation_;
  buffer<std::uint32_t, Exec> group_through_;
  buffer<std::uint32_t, Exec> offsets_;
  buffer<std::uint32_t, Exec> count_;
};

}  // namespace wfpg
