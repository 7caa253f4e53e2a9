// Kernels of light_guide.hpp: they turn recorded values into means, and means into probabilities.
#pragma once

#include <wfpg/exec/support/running_mean.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>

namespace wfpg::detail {

/// Layout of rows: an octree node has one for each dominant_axis of a normal. A row has one element a group
/// of lights.
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

  /// Probability of a group in a row. `sums`: inclusive sums of the probabilities of each row's groups.
  WFPG_HD float probability(const float* sums, std::size_t row, std::uint32_t group) const {
    const float* const prefix = sums + row * groups;
    return group > 0 ? prefix[group] - prefix[group - 1] : prefix[0];
  }
};

/// Kernel: adds a sample's values to the means of the deepest rows.
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

/// Kernel: sets a level's means from those of its children, of the same face. One element a thread.
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

/// Kernel: sets the probabilities of a row's groups. A fraction `floor` follows `defensive`; the rest is
/// proportional to the estimates of the groups. The parent's row is the prior, which counts as
/// `parent_weight` values.
struct choose_light_groups {
  static constexpr float parent_weight = 8.0f;

  sparse_voxel_octree_view tree;
  light_rows rows;
  std::size_t first;  // row
  const learnt_mean* means;
  // A group's weight before anything is learnt; they sum to 1.
  const float* weights;
  // Probabilities that ignore what is learnt; they sum to 1.
  const float* defensive;
  float floor;  // fraction of choices that follow `defensive`, in (0, 1)
  float* sums;  // inclusive sums of probabilities, row by row

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
    // Scales the prior, which has no unit, to the row's values. It is 0 where every value was 0.
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
  // The row above the root's.
  static constexpr std::size_t none = ~std::size_t(0);

  // Mean of a group in a row, mixed with the scaled prior. The prior alone where nothing was found.
  WFPG_HD float estimate(std::size_t row, std::size_t above, std::uint32_t g, float scale) const {
    if (!(scale > 0.0f)) return prior(above, g);
    return mixed_with(means[row * rows.groups + g], scale * prior(above, g), parent_weight);
  }
  /// What the parent's row has learnt of a group; `above`: that row. The root's prior is the weight.
  WFPG_HD float prior(std::size_t above, std::uint32_t g) const {
    if (above == none) return weights[g];
    return max((rows.probability(sums, above, g) - floor * defensive[g]) / (1.0f - floor), 0.0f);
  }
};

}  // namespace wfpg::detail
