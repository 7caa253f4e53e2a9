// The kernels of light_guide.hpp: what rows have received becomes means, and means become probabilities.
#pragma once

#include <wfpg/exec/support/running_mean.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>

namespace wfpg::detail {

/// Rows of an octree's nodes, one for each dominant_axis of a normal, and in each row one element a group of
/// lights.
struct light_rows {
  static constexpr std::uint32_t faces = 6;

  std::uint32_t groups = 0;

  WFPG_HD std::size_t row(node_id node, std::size_t face) const { return faces * std::size_t(node) + face; }
  WFPG_HD node_id node_of(std::size_t row) const { return static_cast<node_id>(row / faces); }
  WFPG_HD std::size_t face_of(std::size_t row) const { return row % faces; }
  /// The first row of a level of the octree.
  WFPG_HD std::size_t first(const sparse_voxel_octree_view& tree, std::uint32_t level) const {
    return row(tree.level_begin(level), 0);
  }

  /// The probability of a group; `sums` are of the probabilities of each row's groups and those before them.
  WFPG_HD float probability(const float* sums, std::size_t row, std::uint32_t group) const {
    const float* const through = sums + row * groups;
    return group > 0 ? through[group] - through[group - 1] : through[0];
  }
};

/// Adds what the elements of the deepest rows have received to their means.
struct fold_light_values {
  value_queue_view queue;
  std::size_t first;  // element
  learnt_mean* means;

  WFPG_HD void operator()(std::size_t i) const {
    double sum;
    const std::uint32_t n = queue.take(i, sum);
    if (n > 0) means[first + i].add(sum, n);
  }
};

/// The means of a level's rows from those of their children, of the same face; an element each.
struct gather_light_means {
  sparse_voxel_octree_view tree;
  light_rows rows;
  std::size_t first;  // element
  learnt_mean* means;

  WFPG_HD void operator()(std::size_t i) const {
    const std::size_t row = (first + i) / rows.groups, group = (first + i) % rows.groups;
    const node_id node = rows.node_of(row), child = tree.first_child(node);
    double sum = 0.0;
    std::uint32_t n = 0;
    for (std::uint32_t c = 0; c < tree.child_count(node); ++c) {
      const learnt_mean& from = means[rows.row(child + c, rows.face_of(row)) * rows.groups + group];
      sum += static_cast<double>(from.mean()) * from.count();
      n += from.count();
    }
    learnt_mean all;
    if (n > 0) all.add(sum, n);
    means[first + i] = all;
  }
};

/// The share of a row's choices that each group has: of `defensive` a part that is always the same, and the
/// rest in proportion to what is known of the groups. What is not yet known is taken from the parent's row,
/// and counts as some values.
struct choose_light_groups {
  static constexpr float parent_weight = 8.0f;

  sparse_voxel_octree_view tree;
  light_rows rows;
  std::size_t first;  // row
  const learnt_mean* means;
  const float* weights;    // what a group is worth before anything is known; they sum to 1
  const float* defensive;  // sum to 1
  float floor;             // of choices that are made by those, in (0, 1)
  float* sums;             // of the probabilities of an element and those before it in its row

  WFPG_HD void operator()(std::size_t i) const {
    const std::size_t row = first + i;
    const node_id up = tree.parent(rows.node_of(row));
    const std::size_t above = up == invalid_node ? none : rows.row(up, rows.face_of(row));
    float found = 0.0f, expected = 0.0f;
    for (std::uint32_t g = 0; g < rows.groups; ++g) {
      const learnt_mean& mean = means[row * rows.groups + g];
      const auto n = static_cast<float>(mean.count());
      found += n * mean.mean();
      expected += n * prior(above, g);
    }
    // What a prior of 1 amounts to here. Nothing is known where nothing has been found.
    const float scale = found / max(expected, 1e-6f);
    float total = 0.0f;
    for (std::uint32_t g = 0; g < rows.groups; ++g) total += estimate(row, above, g, scale);
    float sum = 0.0f;
    for (std::uint32_t g = 0; g < rows.groups; ++g) {
      sum = min(sum + floor * defensive[g] + (1.0f - floor) * estimate(row, above, g, scale) / total, 1.0f);
      sums[row * rows.groups + g] = sum;
    }
    // What rounding leaves is the last group's that can be chosen.
    for (std::uint32_t g = rows.groups; g-- > 0;) {
      sums[row * rows.groups + g] = 1.0f;
      if (defensive[g] > 0.0f) break;
    }
  }

 private:
  static constexpr std::size_t none = ~std::size_t(0);  // what is above the root

  WFPG_HD float estimate(std::size_t row, std::size_t above, std::uint32_t g, float scale) const {
    if (!(scale > 0.0f)) return prior(above, g);
    return mixed_with(means[row * rows.groups + g], scale * prior(above, g), parent_weight);
  }
  /// `above`: the parent's row.
  WFPG_HD float prior(std::size_t above, std::uint32_t g) const {
    if (above == none) return weights[g];
    return max((rows.probability(sums, above, g) - floor * defensive[g]) / (1.0f - floor), 0.0f);
  }
};

}  // namespace wfpg::detail
