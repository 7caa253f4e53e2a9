// The exitance cache: what light leaves each node of the octree (paper, section 3.2). For either side of a
// voxel it stores mean outgoing radiance: exitance / pi, luminance, W/(m² sr).
//
// Each voxel has two normals, found by k-means. Deposits wait in a queue. update() sums them in integers and
// folds the sums into running means, so any order of arrival gives the same bits. Deposits that are 2⁴³ times
// darker than others of the sample nearby count as 0. Inner nodes get averages,
// bottom-up.
//
// Cost: a deposit is one look-up of a leaf, O(depth); update() is O(deposits + nodes). Memory: 26 bytes a
// leaf, 11 an inner node. A queue takes 32 more a leaf, and 8 a deposit of its capacity.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/exec/support/fill.hpp>
#include <wfpg/exec/support/rank_counters.hpp>
#include <wfpg/exec/support/rank_exchange.hpp>
#include <wfpg/octree/bottom_up.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>
#include <wfpg/octree/statistics.hpp>
#include <wfpg/octree/voxel_normals.hpp>

namespace wfpg {

namespace detail {

/// Running means of a leaf's two sides. They lie together since they are read together: 24 bytes.
struct leaf_exitance {
  double means[2] = {0.0, 0.0};      ///< a side: mean radiance, W/(m² sr)
  std::uint32_t counts[2] = {0, 0};  ///< a side: deposits in the mean
};

}  // namespace detail

/// The cache as kernels see it: reads of radiance, and deposits. Trivially copyable; valid while its owner
/// lives.
class exitance_cache_view {
 public:
  /// The octree whose nodes the cache describes.
  WFPG_HD const sparse_voxel_octree_view& octree() const { return tree_; }

  /// Unit normal N of a node's side 0. Its side 1 faces -N. At most 1 degree from the k-means result.
  WFPG_HD vec3 normal(node_id node) const { return detail::unpack_voxel_normal(normals_[node]); }

  /// Side of a node that faces a direction: 0 where N does, 1 where -N does. Directions across N give 0.
  WFPG_HD std::uint32_t side_facing(node_id node, vec3 direction) const {
    // Only the sign matters, so the direction need not have unit length.
    return glm::dot(detail::unpack_voxel_direction(normals_[node]), direction) >= 0.0f ? 0u : 1u;
  }

  /// Side of an inner node's c-th child that faces as `side` of the node does. It works in reverse too: given
  /// the child's side, it returns the node's.
  WFPG_HD std::uint32_t matching_side(node_id node, std::uint32_t c, std::uint32_t side) const {
    // Swapping is its own inverse, which is why both directions work.
    return side ^ (static_cast<std::uint32_t>(swapped_sides_[node]) >> c & 1u);
  }

  /// Mean outgoing radiance of a node's side, W/(m² sr); negative where it has no data.
  WFPG_HD float radiance(node_id node, std::uint32_t side) const {
    if (!tree_.is_leaf(node)) return inner_radiance_[2 * std::size_t(node) + side];
    // Leaves count their deposits; inner nodes mark missing data by a negative value.
    const detail::leaf_exitance& leaf = leaves_[node - tree_.first_leaf()];
    return leaf.counts[side] ? static_cast<float>(leaf.means[side]) : -1.0f;
  }

  /// Number of deposits that a leaf has received, on both sides. Precondition: the node is a leaf.
  WFPG_HD std::uint64_t deposits(node_id leaf) const {
    const detail::leaf_exitance& of_leaf = leaves_[leaf - tree_.first_leaf()];
    return std::uint64_t(of_leaf.counts[0]) + of_leaf.counts[1];
  }

  /// Outgoing radiance of a node's side, W/(m² sr). Where the side has no data, it is that of the first
  /// ancestor with data, on the side that matches; 0 where none has. There is no cosine: stored radiance does
  /// not depend on the view. Precondition: a node of the octree. O(depth), and one read where the side has
  /// data.
  WFPG_HD float read(node_id node, std::uint32_t side) const {
    float value = radiance(node, side);
    for (node_id up = tree_.parent(node); value < 0.0f && up != invalid_node; up = tree_.parent(up)) {
      // On the way up, the side becomes the one of the parent that faces alike.
      side = matching_side(up, node - tree_.first_child(up), side);
      node = up;
      value = radiance(node, side);
    }
    // The root may have no data either, before the first update().
    return max(value, 0.0f);
  }
  /// Outgoing radiance of a node's side that faces `toward`, as read() of that side; 0 for invalid_node.
  WFPG_HD float read(node_id node, vec3 toward) const {
    return node == invalid_node ? 0.0f : read(node, side_facing(node, toward));
  }

  /// Queues radiance, in W/(m² sr), that leaves `position` toward `direction` (unit length). Any number of
  /// threads may call it at once. Reads see it after exitance_cache::update(). A deposit is dropped and
  /// counted where it is not finite or is negative, lies outside every voxel, or does not fit the queue.
  WFPG_HD void deposit(vec3 position, vec3 direction, float radiance) const {
    write(reserve(1), position, direction, radiance);
  }
  /// Queues the luminance of linear RGB radiance.
  WFPG_HD void deposit(vec3 position, vec3 direction, vec3 rgb) const {
    deposit(position, direction, luminance(rgb));
  }

  /// Reserves n entries in a row for one thread and returns the first. The thread then writes each one with
  /// write(). One reservation for several deposits saves atomics.
  WFPG_HD std::uint32_t reserve(std::uint32_t n) const { return queue_.reserve(n); }
  /// Writes one reserved entry. Parameters and drops are those of deposit().
  WFPG_HD void write(std::uint32_t entry, vec3 position, vec3 direction, float radiance) const {
    const bool valid = is_finite(radiance) && radiance >= 0.0f && is_finite(position) && is_finite(direction);
    const node_id leaf = valid ? tree_.nearest_leaf(position) : invalid_node;
    const bool fits = queue_.fits(entry);
    // The leaf is looked up before the queue is asked, so that a deposit outside counts as such.
    if (leaf != invalid_node && fits)
      return queue_.write(entry, 2 * (leaf - tree_.first_leaf()) + side_facing(leaf, direction), radiance);
    // The first reason counts alone: a deposit is dropped once.
    const auto reason = !valid ? counter_invalid : leaf == invalid_node ? counter_outside : counter_overflow;
    atomic_add(counters_ + reason, 1);
    // A reserved entry must be marked, since update() reads it.
    if (fits) queue_.drop(entry);
  }

 private:
  template <class Exec>
  friend class exitance_cache;
  friend struct detail::guide_sections;
  // Indices of counters_, in the order of dropped_deposits.
  enum : std::uint32_t { counter_invalid, counter_outside, counter_overflow, counters };

  sparse_voxel_octree_view tree_;                  ///< not owned
  const std::uint16_t* normals_ = nullptr;         ///< a node: packed N
  const std::uint8_t* swapped_sides_ = nullptr;    ///< an inner node: a bit a child
  const detail::leaf_exitance* leaves_ = nullptr;  ///< a leaf
  const float* inner_radiance_ = nullptr;          ///< an inner node and side; negative: no data
  detail::value_queue_view queue_;                 ///< keys: 2 leaf + side
  std::uint32_t* counters_ = nullptr;              ///< deposits that were dropped
};

namespace detail {

/// Adds the sums of a leaf's sides to its means, one call a leaf.
struct fold_deposits {
  value_queue_view queue;  ///< whose values are summed
  leaf_exitance* leaves;   ///< a leaf

  WFPG_HD void operator()(std::size_t leaf) const {
    for (std::uint32_t side = 0; side < 2; ++side) {
      double sum;
      // take() leaves `sum` unset where the side received nothing.
      const std::uint32_t n = queue.take(2 * leaf + side, sum);
      if (n > 0) add_to_mean(leaves[leaf].means[side], leaves[leaf].counts[side], sum, n);
    }
  }
};

/// Gives each side of an inner node the mean of its children's matching sides, of those that have data.
struct average_children {
  exitance_cache_view cache;  ///< whose deeper levels are averaged
  float* inner_radiance;      ///< an inner node and side
  WFPG_HD void operator()(node_id node) const {
    const node_id first = cache.octree().first_child(node);
    const node_id end = first + cache.octree().child_count(node);
    for (std::uint32_t side = 0; side < 2; ++side) {
      // A child without data is unknown, not dark, so it does not count.
      float sum = 0.0f, n = 0.0f;
      // Children count alike, whatever their number of deposits (the paper's bottom-up averaging).
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
  /// A cache over no octree; only its sizes may be asked for.
  exitance_cache() = default;

  /// Makes an empty cache over an octree that was just built from `fragments`, which the octree sorted.
  /// `queue_capacity` is the largest number of deposits between two updates. With 0 the cache takes no
  /// deposits, only reads. `ranks`: update() folds the deposits of all ranks, which have equal caches. Throws
  /// std::invalid_argument where the capacity is above 2³¹, or the octree has 2³⁰ leaves or more. Throws
  /// out_of_memory. Precondition: the octree still has its leaf_fragment_begin().
  exitance_cache(const Exec& exec, const sparse_voxel_octree<Exec>& tree,
                 const voxel_fragments<Exec>& fragments, std::size_t queue_capacity,
                 communicator* ranks = nullptr)
      : normals_(exec, tree.node_count()),
        swapped_sides_(exec, tree.node_count() - checked_leaves(tree.leaf_count())),
        leaves_(exec, tree.leaf_count()),
        inner_radiance_(exec, 2 * std::size_t(tree.node_count() - tree.leaf_count())),
        queue_(exec, checked(queue_capacity), 2 * std::size_t(tree.leaf_count()), ranks),
        counters_(exec, exitance_cache_view::counters),
        shared_counters_(exec, ranks ? counters_.size() : 0) {
    view_.tree_ = tree.view();
    view_.normals_ = normals_.data();
    view_.leaves_ = leaves_.data();
    view_.inner_radiance_ = inner_radiance_.data();
    view_.swapped_sides_ = swapped_sides_.data();
    view_.queue_ = queue_.view();
    view_.counters_ = counters_.data();
    // Normals do not change afterwards, whatever the light does.
    detail::build_voxel_normals(exec, tree, fragments, normals_.view(), swapped_sides_.view());
    // Counted for the life of the cache: clear() does not reset them.
    exec.fill_bytes(counters_.data(), 0, counters_.bytes());
    clear(exec);
  }

  /// The cache for kernels; valid while this object lives.
  exitance_cache_view view() const { return view_; }
  /// Bytes of what stays for guiding: normals, sides and radiance.
  std::size_t persistent_bytes() const {
    return normals_.bytes() + swapped_sides_.bytes() + leaves_.bytes() + inner_radiance_.bytes();
  }
  /// Bytes of the queue and its counters, which are needed while a sample is in flight.
  std::size_t transient_bytes() const {
    return queue_.bytes() + counters_.bytes() + shared_counters_.bytes();
  }

  /// Forgets all radiance, and the deposits in the queue. Normals stay, and so do the counts of dropped
  /// deposits. O(nodes).
  void clear(const Exec& exec) {
    // Zero bytes are means and counts of zero.
    exec.fill_bytes(leaves_.data(), 0, leaves_.bytes());
    fill(exec, inner_radiance_, -1.0f);
    queue_.clear(exec);
  }

  /// Folds queued deposits into the leaves and averages bottom-up. O(deposits + nodes), however many deposits
  /// one leaf has. Call it after each sample, when no kernel deposits. Without a queue it does nothing.
  void update(const Exec& exec) {
    if (queue_.capacity() == 0) return;
    // Values become exact sums by key, then means by leaf, and then averages by inner node.
    queue_.sum(exec);
    exec.for_each(leaves_.size(), detail::fold_deposits{queue_.view(), leaves_.data()});
    queue_.end_takes(exec);
    detail::for_each_bottom_up(exec, view_.tree_, 0, detail::average_children{view_, inner_radiance_.data()});
  }

  /// Packed normal of each node, as the cache stores it, for ranks to compare. Equal scenes have equal ones.
  /// Waits for the work before it.
  std::vector<std::uint16_t> normals(const Exec& exec) const { return normals_.to_host(exec); }
  /// Adds the deposits of all ranks to an exchange, for update(), and how many were dropped. Then dropped()
  /// has the sum on each rank. `deposits`: whether update() follows.
  void share(const Exec& exec, detail::rank_exchange<Exec>& all, bool deposits) {
    if (deposits && queue_.capacity() > 0) all.add(queue_);
    shared_counters_.add_to(exec, all, detail::counters_in_a_row<std::uint32_t>{counters_.data()});
  }
  /// Number of deposits dropped since the cache was built, by reason. It waits for the work before it.
  dropped_deposits dropped(const Exec& exec) const {
    // Three counters, read back in the order of the enumeration.
    const auto host = counters_.to_host(exec);
    return {host[exitance_cache_view::counter_invalid], host[exitance_cache_view::counter_outside],
            host[exitance_cache_view::counter_overflow]};
  }

 private:
  friend struct detail::guide_sections;

  // Both check before memory is asked for.
  static std::size_t checked(std::size_t queue_capacity) {
    require(queue_capacity <= detail::most_queued, "deposit queue capacity", queue_capacity, "at most 2^31");
    return queue_capacity;
  }
  /// A key of the queue is 2 leaf + side, which must fit 32 bits.
  static std::uint32_t checked_leaves(std::uint32_t leaves) {
    require(leaves < (1u << 30), "number of leaves", leaves, "less than 2^30");
    return leaves;
  }

  buffer<std::uint16_t, Exec> normals_;         ///< a node: packed N
  buffer<std::uint8_t, Exec> swapped_sides_;    ///< an inner node: a bit a child, see voxel_normals.hpp
  buffer<detail::leaf_exitance, Exec> leaves_;  ///< a leaf
  buffer<float, Exec> inner_radiance_;          ///< an inner node and side
  detail::value_queue<Exec> queue_;             ///< a leaf and side
  buffer<std::uint32_t, Exec> counters_;        ///< by reason
  detail::rank_counters<Exec, std::uint32_t> shared_counters_;  ///< of all ranks
  exitance_cache_view view_;                                    ///< of the buffers above
};

}  // namespace wfpg
