// What light leaves each node of the octree: mean outgoing radiance (exitance / pi, luminance, W/(m² sr)) for
// either side of a voxel (paper, section 3.2). Two normals a voxel by k-means; deposits through a queue that
// update() sums exactly and folds into running means, so that any order of arrival gives the same bits;
// averages bottom-up.
//
// Memory: 26 bytes a leaf, 11 an inner node; with a queue 32 more a leaf, and 8 a deposit of its capacity.
#pragma once

#include <wfpg/buffer.hpp>
#include <wfpg/detail/atomic.hpp>
#include <wfpg/detail/bottom_up.hpp>
#include <wfpg/detail/thrust.hpp>
#include <wfpg/detail/voxel_normals.hpp>
#include <wfpg/sparse_voxel_octree.hpp>
#include <wfpg/types.hpp>

#include <thrust/fill.h>

namespace wfpg {

/// Deposits that were not stored, since the cache was built.
struct dropped_deposits {
  std::uint32_t invalid = 0;   ///< NaN, infinite or negative radiance, or a non-finite position or direction
  std::uint32_t outside = 0;   ///< no voxel at or next to the position
  std::uint32_t overflow = 0;  ///< the queue was full

  std::uint64_t total() const { return std::uint64_t(invalid) + outside + overflow; }
};

namespace detail {

/// An entry of the queue that is nobody's.
inline constexpr std::uint64_t dropped_deposit = 0xffffffffull;

/// What a leaf's side has received since the last update.
struct pending_deposits {
  std::uint64_t sum = 0;  ///< in units of exact_sum, while an update is made
  std::uint32_t count = 0;
  std::uint32_t largest = 0;  ///< bits of the largest radiance
};

/// What a leaf has received, by side; together, since they are read together.
struct leaf_exitance {
  double means[2] = {0.0, 0.0};
  std::uint32_t counts[2] = {0, 0};
};

}  // namespace detail

/// What a kernel sees of the cache.
class exitance_cache_view {
 public:
  WFPG_HD const sparse_voxel_octree_view& octree() const { return tree_; }

  /// N of a node; its other side faces -N.
  WFPG_HD vec3 normal(node_id node) const { return detail::unpack_voxel_normal(normals_[node]); }

  /// The side of a node that faces a direction: 0 where N does, 1 where -N does.
  WFPG_HD std::uint32_t side_facing(node_id node, vec3 direction) const {
    return glm::dot(detail::unpack_voxel_direction(normals_[node]), direction) >= 0.0f ? 0u : 1u;
  }

  /// The side of an inner node's c-th child that faces as the node's own does; and the reverse.
  WFPG_HD std::uint32_t matching_side(node_id node, std::uint32_t c, std::uint32_t side) const {
    return side ^ (static_cast<std::uint32_t>(swapped_sides_[node]) >> c & 1u);
  }

  /// Mean outgoing radiance of a node's side; negative where it has no data.
  WFPG_HD float radiance(node_id node, std::uint32_t side) const {
    if (!tree_.is_leaf(node)) return inner_radiance_[2 * std::size_t(node) + side];
    const detail::leaf_exitance& leaf = leaves_[node - tree_.first_leaf()];
    return leaf.counts[side] ? static_cast<float>(leaf.means[side]) : -1.0f;
  }

  /// Outgoing radiance of a node's side, or else of the same side of its first ancestor with data; 0 where
  /// none has. No cosine: radiance is stored as independent of the view. Precondition: a node of the octree.
  WFPG_HD float read(node_id node, std::uint32_t side) const {
    float value = radiance(node, side);
    for (node_id up = tree_.parent(node); value < 0.0f && up != invalid_node; up = tree_.parent(up)) {
      side = matching_side(up, node - tree_.first_child(up), side);
      node = up;
      value = radiance(node, side);
    }
    return detail::max(value, 0.0f);
  }
  /// The same of the side that faces `toward`; 0 of invalid_node.
  WFPG_HD float read(node_id node, vec3 toward) const {
    return node == invalid_node ? 0.0f : read(node, side_facing(node, toward));
  }

  /// Queues the radiance that leaves `position` toward `direction` (unit length). Any number of threads at
  /// once. Seen by reads after exitance_cache::update(). What is not finite or negative, lies outside every
  /// voxel, or does not fit the queue is dropped and counted.
  WFPG_HD void deposit(vec3 position, vec3 direction, float radiance) const {
    const std::uint32_t entry = reserve(1);
    write(entry, position, direction, radiance);
    count(entry);
  }
  WFPG_HD void deposit(vec3 position, vec3 direction, vec3 rgb) const {
    deposit(position, direction, luminance(rgb));
  }

  /// The same for several deposits of one thread: reserve() gives the first of n entries in a row; all are
  /// written, then all are counted. Writing first lets a processor overlap look-ups, which the atomics of
  /// counting would put in order.
  WFPG_HD std::uint32_t reserve(std::uint32_t n) const {
    return detail::atomic_add(counters_ + counter_queued, n);
  }
  WFPG_HD void write(std::uint32_t entry, vec3 position, vec3 direction, float radiance) const {
    const bool valid = detail::is_finite(radiance) && radiance >= 0.0f && detail::is_finite(position) &&
                       detail::is_finite(direction);
    const node_id leaf = valid ? tree_.nearest_leaf(position) : invalid_node;
    const bool fits = entry < capacity_;
    std::uint64_t word = detail::dropped_deposit;
    if (leaf != invalid_node && fits) {
      const std::uint32_t key = 2 * (leaf - tree_.first_leaf()) + side_facing(leaf, direction);
      word = std::uint64_t(detail::float_bits(radiance + 0.0f)) << 32 | key;  // + 0: no negative zero
    } else {
      const auto reason = !valid                 ? counter_invalid
                          : leaf == invalid_node ? counter_outside
                                                 : counter_overflow;
      detail::atomic_add(counters_ + reason, 1);
    }
    if (fits) queue_[entry] = word;
  }
  WFPG_HD void count(std::uint32_t entry) const {
    if (entry >= capacity_ || queue_[entry] == detail::dropped_deposit) return;
    detail::pending_deposits& pending = pending_[static_cast<std::uint32_t>(queue_[entry])];
    const auto bits = static_cast<std::uint32_t>(queue_[entry] >> 32);
    detail::atomic_add(&pending.count, 1);
    if (detail::atomic_load(&pending.largest) < bits) detail::atomic_max(&pending.largest, bits);
  }

 private:
  template <class Exec>
  friend class exitance_cache;
  enum : std::uint32_t { counter_invalid, counter_outside, counter_overflow, counter_queued, counters };

  sparse_voxel_octree_view tree_;
  const std::uint16_t* normals_ = nullptr;       // a node
  const std::uint8_t* swapped_sides_ = nullptr;  // an inner node: a bit a child
  const detail::leaf_exitance* leaves_ = nullptr;
  const float* inner_radiance_ = nullptr;        // an inner node and side; negative: no data
  std::uint64_t* queue_ = nullptr;               // bits of the radiance above, the leaf and side below
  detail::pending_deposits* pending_ = nullptr;  // a leaf and side
  std::uint32_t* counters_ = nullptr;
  std::uint32_t capacity_ = 0;
};

namespace detail {

/// Adds `n` values that sum to `sum` to a mean of `count` values. The count stays at its largest value when
/// it is reached: from then on old values fade, and nothing overflows.
WFPG_HD inline void add_to_mean(double& mean, std::uint32_t& count, double sum, std::uint64_t n) {
  const std::uint64_t total = count + n;
  mean += (sum - static_cast<double>(n) * mean) / static_cast<double>(total);
  count = static_cast<std::uint32_t>(min<std::uint64_t>(total, 0xffffffffull));
}

/// The exact sum of non-negative finite floats in any order: integers in units of the largest one's last
/// bits, of which 39 lie below its own and make room for n to carry.
class exact_sum {
 public:
  /// `largest`: the bits of the largest value; n > 0 values follow.
  WFPG_HD exact_sum(std::uint32_t largest, std::uint32_t n)
      : exponent_(exponent(largest)), shift_(39 - bits_of(n - 1)) {}
  /// A value in these units.
  WFPG_HD std::uint64_t term(std::uint32_t bits) const {
    const std::uint64_t mantissa = bits >> 23 ? (bits & 0x7fffffu) | 0x800000u : bits;
    const int left = shift_ + exponent(bits) - exponent_;
    return left >= 0 ? mantissa << left : (left > -32 ? mantissa >> -left : 0);
  }
  WFPG_HD double value(std::uint64_t sum) const {
    const std::uint64_t unit = static_cast<std::uint64_t>(1023 + exponent_ - 150 - shift_)
                               << 52;  // a power of 2
    double scale;
    memcpy(&scale, &unit, sizeof scale);
    return static_cast<double>(sum) * scale;
  }

 private:
  WFPG_HD static int exponent(std::uint32_t bits) { return max(static_cast<int>(bits >> 23), 1); }

  int exponent_;
  int shift_;
};

/// Adds each deposit to its side's sum.
struct sum_deposits {
  array_view<const std::uint64_t> queue;
  pending_deposits* pending;

  WFPG_HD void operator()(std::size_t i) const {
    if (queue[i] == dropped_deposit) return;
    pending_deposits& to = pending[static_cast<std::uint32_t>(queue[i])];
    atomic_add(&to.sum, exact_sum(to.largest, to.count).term(static_cast<std::uint32_t>(queue[i] >> 32)));
  }
};

/// Adds the sums of a leaf's sides to its means.
struct fold_deposits {
  pending_deposits* pending;
  leaf_exitance* leaves;

  WFPG_HD void operator()(std::size_t leaf) const {
    for (std::uint32_t side = 0; side < 2; ++side) {
      pending_deposits& from = pending[2 * leaf + side];
      if (from.count == 0) continue;
      const double sum = exact_sum(from.largest, from.count).value(from.sum);
      add_to_mean(leaves[leaf].means[side], leaves[leaf].counts[side], sum, from.count);
      from = {};
    }
  }
};

/// A node receives the mean of its children's matching sides, of those that have data.
struct average_children {
  exitance_cache_view cache;
  float* inner_radiance;
  WFPG_HD void operator()(node_id node) const {
    const node_id first = cache.octree().first_child(node);
    const node_id end = first + cache.octree().child_count(node);
    for (std::uint32_t side = 0; side < 2; ++side) {
      float sum = 0.0f, n = 0.0f;
      for (node_id child = first; child < end; ++child) {
        const float value = cache.radiance(child, cache.matching_side(node, child - first, side));
        sum += max(value, 0.0f);
        n += value < 0.0f ? 0.0f : 1.0f;
      }
      inner_radiance[2 * std::size_t(node) + side] = n > 0.0f ? sum / n : -1.0f;
    }
  }
};

}  // namespace detail

/// Owns the cache of an octree, in the memory of `Exec`. The octree must outlive it.
template <class Exec>
class exitance_cache {
 public:
  exitance_cache() = default;

  /// An empty cache over an octree just built from `fragments` (which the octree sorted). `queue_capacity`
  /// bounds the deposits between two updates. Throws out_of_memory, std::invalid_argument where the capacity
  /// is more than 2³¹, or the octree has 2³⁰ leaves or more.
  exitance_cache(const Exec& exec, const sparse_voxel_octree<Exec>& tree,
                 const voxel_fragments<Exec>& fragments, std::size_t queue_capacity)
      : normals_(exec, tree.node_count()),
        swapped_sides_(exec, tree.node_count() - checked_leaves(tree.leaf_count())),
        leaves_(exec, tree.leaf_count()),
        inner_radiance_(exec, 2 * std::size_t(tree.node_count() - tree.leaf_count())),
        queue_(exec, checked(queue_capacity)),
        pending_(exec, queue_capacity > 0 ? 2 * std::size_t(tree.leaf_count()) : 0),
        counters_(exec, exitance_cache_view::counters) {
    view_.tree_ = tree.view();
    view_.normals_ = normals_.data();
    view_.leaves_ = leaves_.data();
    view_.inner_radiance_ = inner_radiance_.data();
    view_.swapped_sides_ = swapped_sides_.data();
    view_.queue_ = queue_.data();
    view_.pending_ = pending_.data();
    view_.counters_ = counters_.data();
    view_.capacity_ = static_cast<std::uint32_t>(queue_capacity);
    detail::build_voxel_normals(exec, tree, fragments, normals_.view(), swapped_sides_.view());
    ::thrust::fill_n(exec.thrust(), counters_.data(), counters_.size(), 0u);
    clear(exec);
  }

  exitance_cache_view view() const { return view_; }
  std::size_t persistent_bytes() const {
    return normals_.bytes() + swapped_sides_.bytes() + leaves_.bytes() + inner_radiance_.bytes();
  }
  std::size_t transient_bytes() const { return queue_.bytes() + pending_.bytes() + counters_.bytes(); }

  /// Forgets all light, and what is queued.
  void clear(const Exec& exec) {
    exec.fill_bytes(leaves_.data(), 0, leaves_.bytes());  // means and counts of zero
    ::thrust::fill_n(exec.thrust(), inner_radiance_.data(), inner_radiance_.size(), -1.0f);
    exec.fill_bytes(pending_.data(), 0, pending_.bytes());
    ::thrust::fill_n(exec.thrust(), counters_.data() + exitance_cache_view::counter_queued, 1, 0u);
  }

  /// Folds queued deposits into the leaves and averages bottom-up. O(deposits + nodes), however many deposits
  /// one leaf has. Nothing to do without a queue.
  void update(const Exec& exec) {
    if (queue_.size() == 0) return;
    const std::uint32_t* const queued = counters_.data() + exitance_cache_view::counter_queued;
    exec.for_each(exec::device_count{queued, queue_.size()},
                  detail::sum_deposits{queue_.view(), pending_.data()});
    exec.for_each(leaves_.size(), detail::fold_deposits{pending_.data(), leaves_.data()});
    detail::for_each_bottom_up(exec, view_.tree_, 0, detail::average_children{view_, inner_radiance_.data()});
    ::thrust::fill_n(exec.thrust(), counters_.data() + exitance_cache_view::counter_queued, 1, 0u);
  }

  /// Deposits dropped since the cache was built; waits for the work before it.
  dropped_deposits dropped(const Exec& exec) const {
    const auto host = counters_.to_host(exec);
    return {host[exitance_cache_view::counter_invalid], host[exitance_cache_view::counter_outside],
            host[exitance_cache_view::counter_overflow]};
  }

 private:
  // Before memory is asked for.
  static std::size_t checked(std::size_t queue_capacity) {
    detail::require(queue_capacity <= (1u << 31), "deposit queue capacity", queue_capacity, "at most 2^31");
    return queue_capacity;
  }
  static std::uint32_t checked_leaves(std::uint32_t leaves) {
    detail::require(leaves < (1u << 30), "number of leaves", leaves, "less than 2^30");
    return leaves;
  }

  buffer<std::uint16_t, Exec> normals_;
  buffer<std::uint8_t, Exec> swapped_sides_;
  buffer<detail::leaf_exitance, Exec> leaves_;
  buffer<float, Exec> inner_radiance_;
  buffer<std::uint64_t, Exec> queue_;
  buffer<detail::pending_deposits, Exec> pending_;
  buffer<std::uint32_t, Exec> counters_;
  exitance_cache_view view_;
};

}  // namespace wfpg
