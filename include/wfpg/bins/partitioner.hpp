// Sort-based N-way partition (thesis, section 3.4.3): groups indices by a 32-bit key. The groups, their
// offsets and their number stay on the device. The spatial binner and a renderer's material sort use it.
//
// Cost: one stable sort of (key, index) pairs and one scan. Memory: 16 bytes an index of capacity, and about
// 8 more while it sorts.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/scan_places.hpp>
#include <wfpg/exec/support/thrust.hpp>

#include <thrust/iterator/counting_iterator.h>
#include <thrust/iterator/transform_iterator.h>
#include <thrust/sequence.h>

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

/// Numbers groups, and writes where each begins. The very last element of one writes its end and the number
/// of groups.
struct number_groups {
  starts_key_group starts;
  array_view<std::uint32_t> group_prefix;  ///< receives the groups' numbers, from 1
  std::uint32_t* offsets;
  std::uint32_t* count;
  WFPG_HD void operator()(std::size_t i, std::uint32_t before) const {
    const array_view<const std::uint32_t>& keys = starts.keys;
    const bool is_first = starts(i) != 0;
    const std::uint32_t group = is_first ? before + 1 : before;
    group_prefix[i] = group;
    if (keys[i] == starts.excluded) return;
    const auto at = static_cast<std::uint32_t>(i);
    if (is_first) offsets[before] = at;
    // Only the last element that is not excluded goes on.
    if (i + 1 < keys.size() && keys[i + 1] != starts.excluded) return;
    offsets[group] = at + 1;
    *count = group;
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
    // Without keys, or with excluded ones alone, nobody writes these.
    exec.fill_bytes(count_.data(), 0, count_.bytes());
    exec.fill_bytes(offsets_.data(), 0, sizeof(std::uint32_t));
    const detail::starts_key_group starts{sorted, excluded};
    const auto begins =
        ::thrust::make_transform_iterator(::thrust::counting_iterator<std::size_t>(0), starts);
    scan_places(exec, n, begins, detail::number_groups{starts, prefix, offsets_.data(), count_.data()});
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
