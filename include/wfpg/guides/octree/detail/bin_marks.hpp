// Finds the octree node that a ray's kept field belongs to: Algorithm 2 of Yalciner and Akyuz (2024), over
// running counts. Rays of all depths and samples are counted at their leaves. From time to time counts are
// summed upward. Each leaf then gets its deepest ancestor with enough rays a sample. Kept fields need bins
// that do not change with each wave.
//
// Cost: counting O(1) a ray; marking O(nodes). Memory: 8 bytes a leaf, 4 an inner node.
#pragma once

#include <wfpg/bins/binning_options.hpp>
#include <wfpg/bins/marking.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/exec/support/rank_counters.hpp>
#include <wfpg/guides/octree/build_schedule.hpp>
#include <wfpg/octree/bottom_up.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>

namespace wfpg::detail {

/// Ray count of a leaf, and its bin: the deepest marked ancestor, or the leaf itself. Both lie together,
/// since a ray reads both.
struct leaf_mark {
  std::uint32_t rays = 0;
  node_id bin = 0;
};

/// Counts and bins as kernels see them. Trivially copyable.
struct bin_marks_view {
  // Counts stop near this value, so that 32 bits do not overflow. No threshold is higher.
  static constexpr std::uint32_t most = 0x80000000u;

  node_id first_leaf = 0;
  leaf_mark* leaves = nullptr;
  // Rays of each inner node, as of the last marking.
  std::uint32_t* inner = nullptr;

  // The node whose field a leaf's rays sample.
  WFPG_HD node_id bin(node_id leaf) const { return leaves[leaf - first_leaf].bin; }
  // Rays counted at a node: of inner nodes, up to the last marking.
  WFPG_HD std::uint32_t rays(node_id node) const {
    return node < first_leaf ? inner[node] : leaves[node - first_leaf].rays;
  }
  // Counts `n` rays at a leaf. Any number of threads may call it.
  WFPG_HD void count(node_id leaf, std::uint32_t n) const {
    std::uint32_t* const rays = &leaves[leaf - first_leaf].rays;
    if (atomic_load(rays) < most) atomic_add(rays, n);
  }
};

/// The ray count of leaf i, for rank_counters.
struct leaf_ray_count {
  leaf_mark* leaves;
  WFPG_HD std::uint32_t& operator()(std::size_t i) const { return leaves[i].rays; }
};

/// Kernel: sets an inner node's count to the sum of its children's.
struct sum_running_counts {
  sparse_voxel_octree_view tree;
  bin_marks_view marks;
  WFPG_HD void operator()(node_id node) const {
    marks.inner[node] = sum_of_children(tree, node, [&](node_id child) { return marks.rays(child); });
  }
};

/// Number of counted rays that make a node a bin. A bin then holds about c_ray rays a sample, or more where
/// the fields of all bins would not fit `room`.
///
/// A surface has four times the rays one level up. So nodes marked at half of c_ray and above hold, in ratio,
/// about c_ray.
struct mark_threshold {
  static constexpr std::uint32_t pressure_unit = build_schedule_constants::pressure_unit;

  // c_ray, and the samples whose rays were counted.
  std::uint64_t rays_per_bin;
  std::uint32_t samples;
  std::uint64_t room;  // slots
  // On the device: how many times as many rays a bin should have as make all bins fit, in units of 1 /
  // pressure_unit.
  const std::uint32_t* pressure;

  WFPG_HD std::uint64_t operator()(std::uint32_t rays) const {
    const std::uint64_t wanted = (rays_per_bin * samples + 1) / 2;
    const std::uint64_t affordable =
        room > 0 ? std::uint64_t(rays) * *pressure / (room * pressure_unit) : wanted;
    return min<std::uint64_t>(max(wanted, affordable), bin_marks_view::most);
  }
};

/// Kernel: sets each leaf's bin.
struct mark_leaves {
  sparse_voxel_octree_view tree;
  bin_marks_view marks;
  std::uint32_t min_level;
  mark_threshold threshold;
  WFPG_HD void operator()(std::size_t i) const {
    const node_id leaf = marks.first_leaf + static_cast<node_id>(i);
    marks.leaves[i].bin = marked_ancestor(tree, leaf, min_level, threshold(marks.rays(0)),
                                          [&](node_id node) { return marks.rays(node); });
  }
};

/// Owns the counts and bins of an octree. Before the first marking, each leaf's bin is its ancestor at the
/// least level.
template <class Exec>
class bin_marks {
 public:
  bin_marks() = default;
  /// `has_ranks`: share() will be called.
  bin_marks(const Exec& exec, const sparse_voxel_octree_view& tree, const binning_options& options,
            bool has_ranks = false)
      : tree_(tree),
        options_(options),
        leaves_(exec, tree.leaf_count()),
        inner_(exec, tree.first_leaf()),
        shared_(exec, has_ranks ? tree.leaf_count() : 0) {
    options_.min_level = min(options_.min_level, tree.depth());
    exec.fill_bytes(leaves_.data(), 0, leaves_.bytes());
    exec.fill_bytes(inner_.data(), 0, inner_.bytes());
    mark_bins(exec, {1, 1, 0, nullptr}, options_.min_level);
  }

  bin_marks_view view() const { return {tree_.first_leaf(), leaves_.data(), inner_.data()}; }
  std::size_t bytes() const { return leaves_.bytes() + inner_.bytes() + shared_.bytes(); }

  /// Adds the rays that all ranks counted to an exchange: 4 bytes a leaf.
  void share(const Exec& exec, rank_exchange<Exec>& all) {
    shared_.add_to(exec, all, leaf_ray_count{leaves_.data()}, bin_marks_view::most);
  }
  /// Takes counts of a file as those of all ranks.
  void restart_ranks(const Exec& exec) { shared_.restart(exec, leaf_ray_count{leaves_.data()}); }

  /// Chooses bins anew from the counts of `samples` samples. `room`: slots for bins' fields. `pressure`: on
  /// the device. `log2_divisor`: of the rays that are counted, one in 2^log2_divisor is guided. O(nodes).
  void mark(const Exec& exec, std::uint32_t samples, std::size_t room, const std::uint32_t* pressure,
            std::uint32_t log2_divisor = 0) {
    for_each_bottom_up(exec, tree_, 0, sum_running_counts{tree_, view()});
    const bool is_part = log2_divisor > 0;
    const std::uint32_t larger = log2_divisor + (is_part ? build_schedule_constants::larger_probing_bins : 0),
                        min_level = options_.min_level - (is_part && options_.min_level > 0 ? 1 : 0);
    mark_bins(exec, {std::uint64_t(options_.rays_per_bin) << larger, samples, room, pressure}, min_level);
  }

 private:
  friend struct kept_state;

  void mark_bins(const Exec& exec, const mark_threshold& threshold, std::uint32_t min_level) {
    exec.for_each(leaves_.size(), mark_leaves{tree_, view(), min_level, threshold});
  }

  sparse_voxel_octree_view tree_;
  binning_options options_;
  buffer<leaf_mark, Exec> leaves_;
  buffer<std::uint32_t, Exec> inner_;
  rank_counters<Exec, std::uint32_t> shared_;  // a leaf, with ranks
};

}  // namespace wfpg::detail
