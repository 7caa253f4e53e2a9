// What light leaves each node of the octree: mean outgoing radiance (exitance / pi, luminance, W/(m² sr)) for
// either side of a voxel (paper, section 3.2). Two normals a voxel by k-means; deposits through a queue that
// update() sums exactly and folds into running means, so that any order of arrival gives the same bits;
// averages bottom-up.
//
// Memory: 26 bytes a leaf, 11 an inner node; with a queue 32 more a leaf, and 8 a deposit of its capacity.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/exec/support/value_queue.hpp>
#include <wfpg/octree/bottom_up.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>
#include <wfpg/octree/statistics.hpp>
#include <wfpg/octree/voxel_normals.hpp>

#include <thrust/fill.h>

namespace wfpg {

namespace detail {

/// What a leaf has received, by side; together, since they are read together.
struct leaf_exitance {
  double means[2] = {0.0, 0.0};
  std::uint32_t counts[2] = {0, 0};
};

}  // namespace detail

/// What a kernel sees of the cache.
class exitance_cache_view {
 public:
  /// The octree whose nodes it describes.
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
    return max(value, 0.0f);
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
  /// The same of linear RGB.
  WFPG_HD void deposit(vec3 position, vec3 direction, vec3 rgb) const {
    deposit(position, direction, luminance(rgb));
  }

  /// The same for several deposits of one thread: reserve() gives the first of n entries in a row; all are
  /// written, then all are counted. Writing first lets a processor overlap look-ups, which the atomics of
  /// counting would put in order.
  WFPG_HD std::uint32_t reserve(std::uint32_t n) const { return queue_.reserve(n); }
  /// Writes an entry of reserve(), as deposit() does.
  WFPG_HD void write(std::uint32_t entry, vec3 position, vec3 direction, float radiance) const {
    const bool valid = is_finite(radiance) && radiance >= 0.0f && is_finite(position) && is_finite(direction);
    const node_id leaf = valid ? tree_.nearest_leaf(position) : invalid_node;
    const bool fits = queue_.fits(entry);
    if (leaf != invalid_node && fits)
      return queue_.write(entry, 2 * (leaf - tree_.first_leaf()) + side_facing(leaf, direction), radiance);
    const auto reason = !valid ? counter_invalid : leaf == invalid_node ? counter_outside : counter_overflow;
    atomic_add(counters_ + reason, 1);
    if (fits) queue_.drop(entry);
  }
  /// Counts an entry that is written.
  WFPG_HD void count(std::uint32_t entry) const { queue_.count(entry); }

 private:
  template <class Exec>
  friend class exitance_cache;
  friend struct detail::state_access;
  enum : std::uint32_t { counter_invalid, counter_outside, counter_overflow, counters };

  sparse_voxel_octree_view tree_;
  const std::uint16_t* normals_ = nullptr;       // a node
  const std::uint8_t* swapped_sides_ = nullptr;  // an inner node: a bit a child
  const detail::leaf_exitance* leaves_ = nullptr;
  const float* inner_radiance_ = nullptr;  // an inner node and side; negative: no data
  detail::value_queue_view queue_;         // a leaf and side
  std::uint32_t* counters_ = nullptr;
};

namespace detail {

/// Adds the sums of a leaf's sides to its means.
struct fold_deposits {
  value_queue_view queue;
  leaf_exitance* leaves;

  WFPG_HD void operator()(std::size_t leaf) const {
    for (std::uint32_t side = 0; side < 2; ++side) {
      double sum;
      const std::uint32_t n = queue.take(2 * leaf + side, sum);
      if (n > 0) add_to_mean(leaves[leaf].means[side], leaves[leaf].counts[side], sum, n);
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
        queue_(exec, checked(queue_capacity), 2 * std::size_t(tree.leaf_count())),
        counters_(exec, exitance_cache_view::counters) {
    view_.tree_ = tree.view();
    view_.normals_ = normals_.data();
    view_.leaves_ = leaves_.data();
    view_.inner_radiance_ = inner_radiance_.data();
    view_.swapped_sides_ = swapped_sides_.data();
    view_.queue_ = queue_.view();
    view_.counters_ = counters_.data();
    detail::build_voxel_normals(exec, tree, fragments, normals_.view(), swapped_sides_.view());
    ::thrust::fill_n(exec.thrust(), counters_.data(), counters_.size(), 0u);
    clear(exec);
  }

  /// What kernels see; valid while the cache lives.
  exitance_cache_view view() const { return view_; }
  /// Of what is kept for guiding.
  std::size_t persistent_bytes() const {
    return normals_.bytes() + swapped_sides_.bytes() + leaves_.bytes() + inner_radiance_.bytes();
  }
  /// Of the queue, needed while a sample is in flight.
  std::size_t transient_bytes() const { return queue_.bytes() + counters_.bytes(); }

  /// Forgets all light, and what is queued.
  void clear(const Exec& exec) {
    exec.fill_bytes(leaves_.data(), 0, leaves_.bytes());  // means and counts of zero
    ::thrust::fill_n(exec.thrust(), inner_radiance_.data(), inner_radiance_.size(), -1.0f);
    queue_.clear(exec);
  }

  /// Folds queued deposits into the leaves and averages bottom-up. O(deposits + nodes), however many deposits
  /// one leaf has. Nothing to do without a queue.
  void update(const Exec& exec) {
    if (queue_.capacity() == 0) return;
    queue_.sum(exec);
    exec.for_each(leaves_.size(), detail::fold_deposits{queue_.view(), leaves_.data()});
    detail::for_each_bottom_up(exec, view_.tree_, 0, detail::average_children{view_, inner_radiance_.data()});
  }

  /// Deposits dropped since the cache was built; waits for the work before it.
  dropped_deposits dropped(const Exec& exec) const {
    const auto host = counters_.to_host(exec);
    return {host[exitance_cache_view::counter_invalid], host[exitance_cache_view::counter_outside],
            host[exitance_cache_view::counter_overflow]};
  }

 private:
  friend struct detail::state_access;

  // Before memory is asked for.
  static std::size_t checked(std::size_t queue_capacity) {
    require(queue_capacity <= detail::most_queued, "deposit queue capacity", queue_capacity, "at most 2^31");
    return queue_capacity;
  }
  static std::uint32_t checked_leaves(std::uint32_t leaves) {
    require(leaves < (1u << 30), "number of leaves", leaves, "less than 2^30");
    return leaves;
  }

  buffer<std::uint16_t, Exec> normals_;
  buffer<std::uint8_t, Exec> swapped_sides_;
  buffer<detail::leaf_exitance, Exec> leaves_;
  buffer<float, Exec> inner_radiance_;
  detail::value_queue<Exec> queue_;  // a leaf and side
  buffer<std::uint32_t, Exec> counters_;
  exitance_cache_view view_;
};

}  // namespace wfpg
