// Which node of the octree a ray's kept field belongs to: Algorithm 2 of the paper over running counts. Rays
// of all depths and samples are counted at their leaves; from time to time counts are summed upward, and each
// leaf learns its deepest ancestor with enough rays a sample. Kept fields need bins that stay, and these do.
//
// Memory: 8 bytes a leaf, 4 an inner node. Count: O(1). Mark: O(nodes).
#pragma once

#include <wfpg/bins/spatial_binner.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/octree/bottom_up.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>

#include <thrust/fill.h>

namespace wfpg::detail {

/// A leaf's rays, and its deepest marked ancestor or itself; together, since a ray reads both.
struct leaf_mark {
  std::uint32_t rays = 0;
  node_id bin = 0;
};

/// What a kernel sees of the marks.
struct bin_marks_view {
  // Counts stop about here, so that 32 bits do not overflow; no threshold is higher.
  static constexpr std::uint32_t most = 0x80000000u;

  node_id first_leaf = 0;
  leaf_mark* leaves = nullptr;
  std::uint32_t* inner = nullptr;  // an inner node: rays, as of the last marking

  WFPG_HD node_id bin(node_id leaf) const { return leaves[leaf - first_leaf].bin; }
  WFPG_HD std::uint32_t rays(node_id node) const {
    return node < first_leaf ? inner[node] : leaves[node - first_leaf].rays;
  }
  WFPG_HD void count(node_id leaf, std::uint32_t n) const {
    std::uint32_t* const rays = &leaves[leaf - first_leaf].rays;
    if (atomic_load(rays) < most) atomic_add(rays, n);
  }
};

/// Which rays of a wave are counted: all, or one in a stride for as many; none where it is 0. Each costs an
/// atomic.
struct counted_rays {
  std::uint32_t stride = 1;
  std::uint32_t first = 0;  // below the stride

  WFPG_HD bool includes(std::size_t ray) const { return stride > 0 && ray % stride == first; }
};

struct sum_counts {
  sparse_voxel_octree_view tree;
  bin_marks_view marks;
  WFPG_HD void operator()(node_id node) const {
    const node_id first = tree.first_child(node);
    std::uint64_t sum = 0;
    for (std::uint32_t c = 0; c < tree.child_count(node); ++c) sum += marks.rays(first + c);
    marks.inner[node] = static_cast<std::uint32_t>(min<std::uint64_t>(sum, 0xffffffffull));
  }
};

/// How many rays mark a node: so many that bins hold about c_ray a sample; or as many more as it takes for
/// the marked nodes' fields to fit the room that there is. A surface has four times the rays one level up, so
/// that nodes marked by half of c_ray and more hold, in ratio, about c_ray.
struct mark_threshold {
  static constexpr std::uint32_t pressure_unit = 64;

  std::uint32_t rays_per_bin;
  std::uint32_t samples;
  std::uint64_t room;  // bins
  // How many times as many rays a bin is to have as fit the room; on the device.
  const std::uint32_t* pressure;

  WFPG_HD std::uint64_t operator()(std::uint32_t rays) const {
    const std::uint64_t wanted = (std::uint64_t(rays_per_bin) * samples + 1) / 2;
    const std::uint64_t affordable =
        room > 0 ? std::uint64_t(rays) * *pressure / (room * pressure_unit) : wanted;
    return min<std::uint64_t>(max(wanted, affordable), bin_marks_view::most);
  }
};

struct mark_leaves {
  sparse_voxel_octree_view tree;
  bin_marks_view marks;
  std::uint32_t min_level;
  mark_threshold threshold;
  WFPG_HD void operator()(std::size_t i) const {
    const std::uint64_t enough = threshold(marks.rays(0));
    const node_id least_end = tree.level_begin(min_level + 1);
    node_id node = marks.first_leaf + static_cast<node_id>(i);
    while (marks.rays(node) < enough && node >= least_end) node = tree.parent(node);
    marks.leaves[i].bin = node;
  }
};

/// Owns the counts and marks of an octree. Before the first marking every leaf's bin is its ancestor of the
/// least level.
template <class Exec>
class bin_marks {
 public:
  bin_marks() = default;
  bin_marks(const Exec& exec, const sparse_voxel_octree_view& tree, const binning_options& options)
      : tree_(tree), options_(options), leaves_(exec, tree.leaf_count()), inner_(exec, tree.first_leaf()) {
    options_.min_level = min(options_.min_level, tree.depth());
    ::thrust::fill_n(exec.thrust(), leaves_.data(), leaves_.size(), leaf_mark{});
    ::thrust::fill_n(exec.thrust(), inner_.data(), inner_.size(), 0u);
    mark_bins(exec, {1, 1, 0, nullptr});
  }

  bin_marks_view view() const { return {tree_.first_leaf(), leaves_.data(), inner_.data()}; }
  std::size_t bytes() const { return leaves_.bytes() + inner_.bytes(); }

  /// Marks anew after `samples` samples. `room`: bins that can have fields; `pressure`: on the device.
  void mark(const Exec& exec, std::uint32_t samples, std::size_t room, const std::uint32_t* pressure) {
    for_each_bottom_up(exec, tree_, 0, sum_counts{tree_, view()});
    mark_bins(exec, {options_.rays_per_bin, samples, room, pressure});
  }

 private:
  friend struct store_state;

  void mark_bins(const Exec& exec, const mark_threshold& threshold) {
    exec.for_each(leaves_.size(), mark_leaves{tree_, view(), options_.min_level, threshold});
  }

  sparse_voxel_octree_view tree_;
  binning_options options_;
  buffer<leaf_mark, Exec> leaves_;
  buffer<std::uint32_t, Exec> inner_;
};

}  // namespace wfpg::detail
