// Sort-based N-way partition (thesis, section 3.4.3): groups indices by a 32-bit key. The groups, their
// offsets and their number stay on the device. The spatial binner and a renderer's material sort use it.
//
// Cost: one stable sort of (key, index) pairs and one scan. Memory: 16 bytes an index of capacity, and about
// 8 more while it sorts.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/thrust.hpp>

#include <thrust/functional.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/sequence.h>
#include <thrust/transform_scan.h>

namespace wfpg {

/// A partition as kernels see it. Group g < *count holds permutation[offsets[g]] to permutation[offsets[g +
/// 1] - 1]. Groups are in ascending order of key; inside a group, indices ascend.
struct partition_view {
  array_view<const std::uint32_t> permutation;  ///< the indices, group by group
  /// Where groups begin in the permutation. Entry *count is the end of the last group; later entries are not
  /// set.
  array_view<const std::uint32_t> offsets;
  /// Key of each of the permutation's elements, ascending; excluded ones come last.
  array_view<const std::uint32_t> sorted_keys;
  /// Group of each of the permutation's elements, counted from 1. Excluded elements have the last group's
  /// number.
  array_view<const std::uint32_t> group_prefix;
  const std::uint32_t* count = nullptr;  ///< number of groups, in the policy's memory

  /// Position in the permutation of a group's first index. Precondition: group < *count.
  WFPG_HD std::uint32_t begin(std::size_t group) const { return offsets[group]; }
  /// Number of indices in a group, at least 1.
  WFPG_HD std::uint32_t size(std::size_t group) const { return offsets[group + 1] - offsets[group]; }
  /// The key that all indices of a group have in common.
  WFPG_HD std::uint32_t key(std::size_t group) const { return sorted_keys[offsets[group]]; }
};

namespace detail {

/// Returns 1 for the first element of a group, and 0 for all others and for excluded ones.
struct starts_key_group {
  array_view<const std::uint32_t> keys;  ///< sorted
  std::uint32_t excluded;                ///< key of the elements in no group
  WFPG_HD std::uint32_t operator()(std::size_t i) const {
    return keys[i] != excluded && (i == 0 || keys[i] != keys[i - 1]) ? 1u : 0u;
  }
};

/// Writes the offsets of each group, and the number of groups. The thread of a group's first element writes
/// where it begins. The thread of the very last one writes its end and the number of groups.
struct write_group_offsets {
  array_view<const std::uint32_t> keys;
  array_view<const std::uint32_t> group_prefix;
  std::uint32_t excluded;  ///< key of the elements in no group, which come last
  std::uint32_t* offsets;
  std::uint32_t* count;
  WFPG_HD void operator()(std::size_t i) const {
    if (keys[i] == excluded) return;
    const auto at = static_cast<std::uint32_t>(i);
    // Groups are numbered from 1 in `group_prefix`, and from 0 in `offsets`.
    if (i == 0 || keys[i] != keys[i - 1]) offsets[group_prefix[i] - 1] = at;
    // Only the last element that is not excluded goes on.
    if (i + 1 < keys.size() && keys[i + 1] != excluded) return;
    offsets[group_prefix[i]] = at + 1;
    *count = group_prefix[i];
  }
};

}  // namespace detail

/// Partitions up to `capacity` indices by key. It allocates once, so it can be used for each wave. A
/// default-constructed one has capacity 0.
template <class Exec>
class partitioner {
 public:
  /// Key of indices that belong to no group. They come last in the permutation.
  static constexpr std::uint32_t excluded = 0xffffffffu;

  /// Owns no memory; partition() is not to be called.
  partitioner() = default;
  /// Allocates for `capacity` indices. Throws out_of_memory, and std::invalid_argument where the capacity is
  /// 2³² - 1 or more.
  partitioner(const Exec& exec, std::size_t capacity)
      : keys_(exec, checked(capacity)),
        permutation_(exec, capacity),
        group_prefix_(exec, capacity),
        offsets_(exec, capacity + 1),
        count_(exec, 1) {}

  /// Groups the indices [0, keys.size()) by their keys. Keys are below 2^key_bits - 1, or `excluded`. Fewer
  /// bits are sorted sooner. `keys` is not changed. The view is valid until the next call. Throws
  /// std::invalid_argument where there are more keys than the capacity. O(keys).
  partition_view partition(const Exec& exec, array_view<const std::uint32_t> keys, int key_bits = 32) {
    const std::size_t n = keys.size();
    require(n <= permutation_.size(), "number of keys", n, "at most the partitioner's capacity");
    // One array holds the unsorted indices first and the groups' numbers later.
    const array_view<std::uint32_t> prefix(group_prefix_.data(), n);
    ::thrust::sequence(exec.thrust(), prefix.begin(), prefix.end());
    // Stable, so that indices ascend inside a group.
    exec.sort_pairs(n, key_bits, keys.data(), prefix.data(), keys_.data(), permutation_.data());
    const array_view<const std::uint32_t> sorted(keys_.data(), n);
    const ::thrust::counting_iterator<std::size_t> first(0);
    // Running sums of the groups' beginnings number the groups from 1.
    ::thrust::transform_inclusive_scan(exec.thrust(), first, first + static_cast<std::ptrdiff_t>(n),
                                       prefix.begin(), detail::starts_key_group{sorted, excluded},
                                       ::thrust::plus<std::uint32_t>());
    // Without keys, or with excluded ones alone, no thread writes these.
    exec.fill_bytes(count_.data(), 0, count_.bytes());
    exec.fill_bytes(offsets_.data(), 0, sizeof(std::uint32_t));
    exec.for_each(n, detail::write_group_offsets{sorted, prefix, excluded, offsets_.data(), count_.data()});
    return {{permutation_.data(), n}, {offsets_.data(), n + 1}, sorted, prefix, count_.data()};
  }

  /// Bytes of all that it has allocated, without the sort's temporaries.
  std::size_t bytes() const {
    return keys_.bytes() + permutation_.bytes() + group_prefix_.bytes() + offsets_.bytes() + count_.bytes();
  }

 private:
  // Checks the capacity before memory is asked for.
  static std::size_t checked(std::size_t capacity) {
    require(capacity < 0xffffffffull, "partitioner capacity", capacity, "less than 2^32 - 1");
    return capacity;
  }

  buffer<std::uint32_t, Exec> keys_;          ///< sorted keys
  buffer<std::uint32_t, Exec> permutation_;   ///< indices in the order of their keys
  buffer<std::uint32_t, Exec> group_prefix_;  ///< indices, then the groups' numbers
  buffer<std::uint32_t, Exec> offsets_;       ///< capacity + 1 beginnings of groups
  buffer<std::uint32_t, Exec> count_;         ///< one number of groups
};

}  // namespace wfpg
