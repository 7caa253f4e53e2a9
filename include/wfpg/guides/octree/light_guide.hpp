// Which light a shading point asks, for next-event estimation. A host's lights come in groups; each node of
// the octree learns, down to a level and for each of six orientations of a surface, what the groups bring
// there: BSDF, shadow, distance and MIS weight included. Nodes that know little ask their parents. wfpg's
// own; that the choice of lights is learnt by place is as in Vevoda, Kondapaneni & Krivanek, "Bayesian online
// regression for adaptive direct illumination sampling" (2018).
//
// Memory: 48 bytes a node and group; in a sample 96 more of the deepest nodes, and 8 a value.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/bins/spatial_binner.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/value_queue.hpp>
#include <wfpg/guide/recorded_runs.hpp>
#include <wfpg/guides/octree/detail/learn_lights.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>

#include <vector>

namespace wfpg {

namespace detail {
struct light_state;
}

/// How groups of lights are chosen. Ranges are checked when a guide is made.
struct light_guide_options {
  /// What each group is worth before anything is known, such as its power: finite, at least 0, one of them
  /// more; 256 groups at most. Those worth 0 are never chosen. Empty: the host does not ask.
  std::vector<float> weights;
  std::uint32_t resolution = 32;  ///< nodes along the octree's side that learn; a power of two in [1, 4096]
  float floor = 0.2f;             ///< of choices that learning has no say in, in (0, 1)
};

/// No choice that can be learnt from.
inline constexpr std::uint32_t no_light_choice = 0xffffffffu;

/// A group of lights.
struct light_choice {
  std::uint32_t group = 0;              ///< its index among the weights
  float probability = 1.0f;             ///< that it was chosen with
  std::uint32_t key = no_light_choice;  ///< by which light_guide_view::deposit knows it
};

/// What a kernel sees of the guide: the same for a whole sample. Trivially copyable.
class light_guide_view {
 public:
  /// Whether there are no groups to choose from: the host draws its lights as it would without.
  WFPG_HD bool empty() const { return rows_.groups == 0; }
  /// How many there are.
  WFPG_HD std::uint32_t groups() const { return rows_.groups; }

  /// The row of a surface's point with a unit normal, on the side that is lit; of the root where the octree
  /// knows of no surface there. O(depth). Precondition: not empty.
  WFPG_HD std::uint32_t find(vec3 position, vec3 normal) const {
    const node_id leaf = tree_.nearest_leaf(position);
    const node_id node = leaf == invalid_node ? 0 : tree_.ancestor(leaf, level_);
    return static_cast<std::uint32_t>(rows_.row(node, dominant_axis(normal)));
  }

  /// A group of lights for a row from u in [0, 1). O(log groups).
  WFPG_HD light_choice choose(std::uint32_t row, float u) const {
    const float* const sums = sums_ + std::size_t(row) * rows_.groups;
    std::uint32_t group = 0, last = rows_.groups - 1;
    while (group < last) {
      const std::uint32_t middle = (group + last) / 2;
      if (u < sums[middle])
        last = middle;
      else
        group = middle + 1;
    }
    const std::uint32_t key = row < first_row_ ? no_light_choice : (row - first_row_) * rows_.groups + group;
    return {group, probability(row, group), key};
  }
  /// The probability with which choose() gives a group: what the MIS weight of an emitter hit by chance
  /// needs.
  WFPG_HD float probability(std::uint32_t row, std::uint32_t group) const {
    return rows_.probability(sums_, row, group);
  }

  /// What came of a choice: the estimate of the luminance that the point scatters toward the viewer, BSDF,
  /// MIS weight and all of the light sample's density included; 0 where the light is hidden or faces away. Of
  /// many paths, numbered from 0, a part is listened to. What is negative or not finite, or does not fit the
  /// queue, is dropped. Seen after the sample.
  WFPG_HD void deposit(std::size_t path, std::uint32_t key, float estimate) const {
    std::uint32_t place;
    if (key == no_light_choice || !runs_.find(path, place)) return;
    const std::uint32_t entry = queue_.reserve(1);
    if (!queue_.fits(entry)) return;
    const float scattered = estimate * probability(first_row_ + key / rows_.groups, key % rows_.groups);
    if (!(scattered >= 0.0f) || !is_finite(scattered)) return queue_.drop(entry);
    queue_.write(entry, key, min(scattered, most));
    queue_.count(entry);
  }

 private:
  template <class Exec>
  friend class light_guide;
  friend struct detail::light_state;

  static constexpr float most = 1.0e15f;  // that is learnt of one choice

  sparse_voxel_octree_view tree_;
  detail::light_rows rows_;
  std::uint32_t level_ = 0;      // the deepest that learns
  std::uint32_t first_row_ = 0;  // of that level
  const float* sums_ = nullptr;
  detail::recorded_runs runs_;
  detail::value_queue_view queue_;
};

/// Owns what rows have learnt.
template <class Exec>
class light_guide {
 public:
  light_guide() = default;
  /// Over an octree that outlives it; for samples of `paths` paths with up to `depth` choices each, of which
  /// it listens to about 64 a row. Without weights or octree it is empty. Throws std::invalid_argument,
  /// out_of_memory.
  light_guide(const Exec& exec, const sparse_voxel_octree_view& tree, const light_guide_options& options,
              std::size_t paths, std::uint32_t depth);

  /// What kernels of the sample that has begun see.
  light_guide_view view() const { return view_; }

  /// Begins a sample, whose seed decides which paths are listened to.
  void begin_sample(std::uint32_t seed) { view_.runs_.seed = seed; }
  /// Learns what was deposited. O(choices + nodes · groups).
  void end_sample(const Exec& exec);
  /// Forgets what was learnt, and what was deposited since.
  void forget(const Exec& exec);

  /// Bytes that are kept across samples.
  std::size_t persistent_bytes() const {
    return sums_.bytes() + means_.bytes() + weights_.bytes() + defensive_.bytes();
  }
  /// Bytes of what a sample deposits.
  std::size_t transient_bytes() const { return queue_.bytes(); }

 private:
  friend struct detail::light_state;

  std::size_t first_row(std::uint32_t level) const { return view_.rows_.first(view_.tree_, level); }
  std::size_t rows_of(std::uint32_t level) const { return first_row(level + 1) - first_row(level); }
  void set_weights(const Exec& exec, const std::vector<float>& weights);
  void follow_means(const Exec& exec);
  void choose(const Exec& exec);

  float floor_ = 0.0f;
  light_guide_view view_;
  buffer<float, Exec> weights_, defensive_;  // a group
  buffer<float, Exec> sums_;                 // a row's group
  buffer<learnt_mean, Exec> means_;
  detail::value_queue<Exec> queue_;
};

namespace detail {

inline void require_valid(const light_guide_options& options) {
  const std::vector<float>& weights = options.weights;
  require(weights.size() <= 256, "lights.weights.size()", weights.size(), "at most 256");
  float largest = 0.0f;
  for (const float w : weights) {
    require(w >= 0.0f, "an element of lights.weights", w, "finite, at least 0");
    largest = max(largest, w);
  }
  require(weights.empty() || largest > 0.0f, "the largest of lights.weights", largest, "more than 0");
  const std::uint32_t n = options.resolution;
  require(n >= 1 && n <= 4096 && (n & (n - 1)) == 0, "lights.resolution", n, "a power of two in [1, 4096]");
  require(options.floor > 0.0f && options.floor < 1.0f, "lights.floor", options.floor, "in (0, 1)");
}

}  // namespace detail

template <class Exec>
light_guide<Exec>::light_guide(const Exec& exec, const sparse_voxel_octree_view& tree,
                               const light_guide_options& options, std::size_t paths, std::uint32_t depth)
    : floor_(options.floor) {
  detail::require_valid(options);
  if (options.weights.empty() || tree.empty()) return;
  set_weights(exec, options.weights);
  view_.tree_ = tree;
  view_.rows_.groups = static_cast<std::uint32_t>(options.weights.size());
  while (options.resolution >> (view_.level_ + 1) > 0 && view_.level_ < tree.depth()) ++view_.level_;
  const std::size_t groups = view_.groups(), rows = first_row(view_.level_ + 1);
  require(rows * groups < 0xffffffffull, "nodes at lights.resolution times groups", rows * groups,
          "less than 2^32 - 1");
  view_.first_row_ = static_cast<std::uint32_t>(first_row(view_.level_));
  const std::size_t wanted = 64 * (rows - view_.first_row_);
  while (paths * depth >> view_.runs_.shift > wanted) ++view_.runs_.shift;
  sums_ = buffer<float, Exec>(exec, rows * groups);
  means_ = buffer<learnt_mean, Exec>(exec, rows * groups);
  const std::size_t capacity = min(view_.runs_.size(paths) * depth, detail::most_queued);
  queue_ = detail::value_queue<Exec>(exec, capacity, rows_of(view_.level_) * groups);
  view_.sums_ = sums_.data();
  view_.queue_ = queue_.view();
  forget(exec);
}

/// The defensive part is half by weight and half alike, so that no group of little worth is lost to rounding.
template <class Exec>
void light_guide<Exec>::set_weights(const Exec& exec, const std::vector<float>& weights) {
  double total = 0.0, count = 0.0;
  for (const float w : weights) {
    total += static_cast<double>(w);
    count += w > 0.0f ? 1.0 : 0.0;
  }
  std::vector<float> shares, defensive;
  for (const float w : weights) {
    const double share = static_cast<double>(w) / total;
    shares.push_back(static_cast<float>(share));
    defensive.push_back(static_cast<float>(w > 0.0f ? 0.5 * (share + 1.0 / count) : 0.0));
  }
  weights_ = buffer<float, Exec>(exec, shares);
  defensive_ = buffer<float, Exec>(exec, defensive);
}

template <class Exec>
void light_guide<Exec>::end_sample(const Exec& exec) {
  if (view_.empty() || queue_.capacity() == 0) return;
  const std::size_t groups = view_.groups();
  queue_.sum(exec);
  exec.for_each(rows_of(view_.level_) * groups,
                detail::fold_light_values{queue_.view(), first_row(view_.level_) * groups, means_.data()});
  follow_means(exec);
}

/// All that follows from the means of the deepest rows.
template <class Exec>
void light_guide<Exec>::follow_means(const Exec& exec) {
  for (std::uint32_t level = view_.level_; level-- > 0;)
    exec.for_each(rows_of(level) * view_.groups(),
                  detail::gather_light_means{view_.tree_, view_.rows_, first_row(level) * view_.groups(),
                                             means_.data()});
  choose(exec);
}

template <class Exec>
void light_guide<Exec>::forget(const Exec& exec) {
  if (view_.empty()) return;
  exec.fill_bytes(means_.data(), 0, means_.bytes());
  queue_.clear(exec);
  choose(exec);
}

template <class Exec>
void light_guide<Exec>::choose(const Exec& exec) {
  for (std::uint32_t level = 0; level <= view_.level_; ++level)
    exec.for_each(rows_of(level),
                  detail::choose_light_groups{view_.tree_, view_.rows_, first_row(level), means_.data(),
                                              weights_.data(), defensive_.data(), floor_, sums_.data()});
}

}  // namespace wfpg
