// Chooses the group of lights that next-event estimation samples at a shading point. A host's lights come in
// groups. Each node of the octree, down to a level, learns what the groups contribute there, for six
// orientations of a surface. BSDF, shadow, distance and MIS weight are included. A node with few samples
// relies on its parent.
//
// Source: wfpg's own. Learning the choice of lights by place is as in Vevoda, Kondapaneni and Krivanek,
// "Bayesian online regression for adaptive direct illumination sampling" (2018).
//
// Cost: a choice takes O(depth + log groups); a sample's end O(choices + nodes * groups). Memory: 48 bytes a
// node and group; in a sample 96 more of the deepest nodes, and 8 a value.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/prefix_search.hpp>
#include <wfpg/bins/spatial_binner.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/rank_exchange.hpp>
#include <wfpg/guides/octree/detail/learn_lights.hpp>
#include <wfpg/guides/octree/options.hpp>
#include <wfpg/host/recorded_runs.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>

#include <vector>

namespace wfpg {

namespace detail {
struct light_state;
}

/// Key of a choice that cannot be learnt from; deposits with it are dropped.
inline constexpr std::uint32_t no_light_choice = 0xffffffffu;

/// A sampled group of lights.
struct light_choice {
  std::uint32_t group = 0;              ///< index into light_guide_options::weights
  float probability = 1.0f;             ///< with which the group was chosen, in (0, 1]
  std::uint32_t key = no_light_choice;  ///< for light_guide_view::deposit(); no_light_choice: not learnt
};

/// Chooses groups of lights in kernels. Constant during a sample, but for deposits. Trivially copyable. Any
/// number of threads may call it at once.
class light_guide_view {
 public:
  /// True: there are no groups to choose from, and the host samples its lights as it would without.
  WFPG_HD bool empty() const { return rows_.groups == 0; }
  /// True: nothing is learnt in this sample, and choose() follows the weights alone. A host with a table of
  /// all its lights may choose by that, which takes less time. Also true where it is empty. O(1).
  WFPG_HD bool rests() const { return tree_.empty(); }
  /// Number of groups, at most 256.
  WFPG_HD std::uint32_t groups() const { return rows_.groups; }

  /// Returns the row of probabilities for a surface. `position`: world space. `normal`: unit length, on the
  /// side that is lit; its dominant axis decides.
  ///
  /// A point that the octree does not know gets the root's row. O(depth), and O(1) where choices rest.
  /// Precondition: not empty.
  WFPG_HD std::uint32_t find(vec3 position, vec3 normal) const {
    if (tree_.empty()) return 0;
    const node_id node = tree_.nearest_node(position, level_);
    return static_cast<std::uint32_t>(rows_.row(node == invalid_node ? 0 : node, dominant_axis(normal)));
  }

  /// Returns the row of a choice by its key. O(1), so that a host need not call find() again where a ray hits
  /// an emitter. Precondition: the key is not no_light_choice.
  WFPG_HD std::uint32_t row_of(std::uint32_t key) const { return first_row_ + key / rows_.groups; }

  /// Samples a group of lights for a row from u in [0, 1). O(log groups). Precondition: the row is from
  /// find().
  WFPG_HD light_choice choose(std::uint32_t row, float u) const {
    const float* const sums = sums_ + std::size_t(row) * rows_.groups;
    const std::uint32_t group =
        search_prefix([&](std::uint32_t i) { return sums[i]; }, rows_.groups, 0.0f, 1.0f, u).index;
    // Rows above the deepest level have no key: they learn from their children alone.
    const std::uint32_t key = row < first_row_ ? no_light_choice : (row - first_row_) * rows_.groups + group;
    return {group, probability(row, group), key};
  }
  /// Probability with which choose() samples a group. The MIS weight of an emitter that a BSDF ray hits needs
  /// it. O(1).
  WFPG_HD float probability(std::uint32_t row, std::uint32_t group) const {
    return rows_.probability(sums_, row, group);
  }

  /// Records the result of a choice: its estimate of the luminance that the point scatters toward the viewer.
  /// `estimate` includes the BSDF, the MIS weight, and the light sample's whole density, the choice's
  /// included. It is 0 where the light is hidden or faces away.
  ///
  /// `path`: number from 0, below 2^32; only a fraction of many paths is recorded. Drops estimates that are
  /// negative or not finite, and what exceeds the queue. Choices use it after end_sample(). O(1).
  WFPG_HD void deposit(std::size_t path, std::uint32_t key, float estimate) const {
    std::uint32_t place;
    if (key == no_light_choice || !runs_.find(path, place)) return;
    const std::uint32_t entry = queue_.reserve(1);
    if (!queue_.fits(entry)) return;
    // Without the probability, so that means do not depend on how often a group is chosen.
    const float scattered = estimate * probability(row_of(key), key % rows_.groups);
    if (!(scattered >= 0.0f) || !is_finite(scattered)) return queue_.drop(entry);
    queue_.write(entry, key, min(scattered, most));
  }

 private:
  template <class Exec>
  friend class light_guide;
  friend struct detail::light_state;

  // The largest value that one choice records.
  static constexpr float most = 1.0e15f;

  // Finds nodes by position.
  sparse_voxel_octree_view tree_;
  detail::light_rows rows_;
  // The deepest level that learns, and its first row.
  std::uint32_t level_ = 0;
  std::uint32_t first_row_ = 0;
  // Inclusive sums of probabilities, row by row.
  const float* sums_ = nullptr;
  // Which paths are recorded in this sample.
  recorded_runs runs_;
  detail::value_queue_view queue_;
};

/// Owns the probabilities and means of all rows, in the memory of `Exec`.
template <class Exec>
class light_guide {
 public:
  /// An empty guide: view() has no groups.
  light_guide() = default;
  /// Makes a guide over an octree, which must outlive it. A sample has `paths` paths with up to `depth`
  /// choices each. It records at most about 64 of them for each of the deepest rows.
  ///
  /// `ranks`: each has `own_paths` of these paths, the first of which is `first_path`, and all learn from
  /// all.
  ///
  /// Without weights or octree the guide is empty. Throws std::invalid_argument for options out of range, or
  /// too many rows times groups. Throws out_of_memory.
  light_guide(const Exec& exec, const sparse_voxel_octree_view& tree, const light_guide_options& options,
              std::size_t paths, std::uint32_t depth, communicator* ranks = nullptr,
              std::size_t own_paths = 0, std::uint32_t first_path = 0);

  /// What the kernels of the current sample use.
  light_guide_view view() const { return view_; }
  /// A view for samples in which nothing is learnt: it chooses by weight alone, and its keys are
  /// no_light_choice.
  light_guide_view resting_view() const {
    light_guide_view result;
    result.rows_ = view_.rows_;
    result.first_row_ = 1;
    result.sums_ = resting_sums_.data();
    return result;
  }

  /// Begins a sample. `seed` decides which paths it records.
  void begin_sample(std::uint32_t seed) { view_.runs_.seed = seed; }
  /// Adds the deposits of all ranks to an exchange, for end_sample(). Only with ranks.
  void share(detail::rank_exchange<Exec>& all) {
    if (!view_.empty() && queue_.capacity() > 0) all.add(queue_);
  }
  /// Learns from the sample's deposits, and updates all probabilities. O(choices + nodes * groups).
  void end_sample(const Exec& exec);
  /// Forgets all means, and deposits since the last end_sample(). Probabilities follow the weights again.
  void forget(const Exec& exec);

  /// Bytes kept across samples: 48 a node and group, and 12 a group.
  std::size_t persistent_bytes() const {
    return sums_.bytes() + means_.bytes() + weights_.bytes() + defensive_.bytes() + resting_sums_.bytes();
  }
  /// Bytes of the queue that holds a sample's deposits.
  std::size_t transient_bytes() const { return queue_.bytes(); }

 private:
  friend struct detail::light_state;

  // Rows of a level lie together, level by level from the root.
  std::size_t first_row(std::uint32_t level) const { return view_.rows_.first(view_.tree_, level); }
  std::size_t rows_of(std::uint32_t level) const { return first_row(level + 1) - first_row(level); }
  // Copies weights and the defensive part to the policy's memory.
  void set_weights(const Exec& exec, const std::vector<float>& weights);
  // Updates all that depends on the means of the deepest rows.
  void follow_means(const Exec& exec);
  // Turns means into probabilities, from the root down.
  void choose(const Exec& exec);

  // light_guide_options::floor.
  float floor_ = 0.0f;
  light_guide_view view_;
  // One element a group; each sums to 1.
  buffer<float, Exec> weights_, defensive_;
  // Inclusive sums of the weights: the one row of resting_view().
  buffer<float, Exec> resting_sums_;
  // One element a row and group: probabilities as inclusive sums, and means.
  buffer<float, Exec> sums_;
  buffer<learnt_mean, Exec> means_;
  detail::value_queue<Exec> queue_;
};

}  // namespace wfpg

#include <wfpg/guides/octree/detail/light_guide_impl.hpp>
