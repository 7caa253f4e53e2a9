// Implementation of light_guide.hpp.
#pragma once

#include <wfpg/guides/octree/light_guide.hpp>

namespace wfpg {

namespace detail {

/// Throws std::invalid_argument for options out of range.
WFPG_COLD inline void require_valid(const light_guide_options& options) {
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
                               const light_guide_options& options, std::size_t paths, std::uint32_t depth,
                               communicator* ranks, std::size_t own_paths, std::uint32_t first_path)
    : floor_(options.floor) {
  detail::require_valid(options);
  if (options.weights.empty() || tree.empty()) return;
  set_weights(exec, options.weights);
  view_.tree_ = tree;
  view_.rows_.groups = static_cast<std::uint32_t>(options.weights.size());
  // The level whose nodes have `resolution` along the octree's side, or the leaves' level.
  while (options.resolution >> (view_.level_ + 1) > 0 && view_.level_ < tree.depth()) ++view_.level_;
  const std::size_t groups = view_.groups(), rows = first_row(view_.level_ + 1);
  require(rows * groups < 0xffffffffull, "nodes at lights.resolution times groups", rows * groups,
          "less than 2^32 - 1");
  view_.first_row_ = static_cast<std::uint32_t>(first_row(view_.level_));
  // Recorded choices of a sample, at most: 64 for each of the deepest rows.
  const std::size_t wanted = 64 * (rows - view_.first_row_);
  while (paths * depth >> view_.runs_.shift > wanted) ++view_.runs_.shift;
  sums_ = buffer<float, Exec>(exec, rows * groups);
  means_ = buffer<learnt_mean, Exec>(exec, rows * groups);
  view_.runs_.first = first_path;
  const std::size_t recorded = view_.runs_.size(ranks ? own_paths : paths);
  queue_ = detail::value_queue<Exec>(exec, min(recorded * depth, detail::most_queued),
                                     rows_of(view_.level_) * groups, ranks);
  view_.sums_ = sums_.data();
  view_.queue_ = queue_.view();
  forget(exec);
}

/// Half of the defensive part follows the weights, and half is equal for all groups. So no group of small
/// weight is lost to rounding.
template <class Exec>
void light_guide<Exec>::set_weights(const Exec& exec, const std::vector<float>& weights) {
  double total = 0.0, count = 0.0;
  for (const float w : weights) {
    total += static_cast<double>(w);
    count += w > 0.0f ? 1.0 : 0.0;
  }
  double sum = 0.0;
  std::vector<float> shares, defensive, sums;
  for (const float w : weights) {
    const double share = static_cast<double>(w) / total;
    sum += static_cast<double>(w);
    shares.push_back(static_cast<float>(share));
    sums.push_back(static_cast<float>(sum / total));
    defensive.push_back(static_cast<float>(w > 0.0f ? 0.5 * (share + 1.0 / count) : 0.0));
  }
  weights_ = buffer<float, Exec>(exec, shares);
  defensive_ = buffer<float, Exec>(exec, defensive);
  resting_sums_ = buffer<float, Exec>(exec, sums);
}

template <class Exec>
void light_guide<Exec>::end_sample(const Exec& exec) {
  if (view_.empty() || queue_.capacity() == 0) return;
  const std::size_t groups = view_.groups();
  queue_.sum(exec);
  exec.for_each(rows_of(view_.level_) * groups,
                detail::fold_light_values{queue_.view(), first_row(view_.level_) * groups, means_.data()});
  queue_.end_takes(exec);
  follow_means(exec);
}

/// Goes up first: inner rows get the means of their children. Then choose() goes down, since a row relies on
/// its parent.
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

/// One launch a level: a level reads the probabilities of the level above.
template <class Exec>
void light_guide<Exec>::choose(const Exec& exec) {
  for (std::uint32_t level = 0; level <= view_.level_; ++level)
    exec.for_each(rows_of(level),
                  detail::choose_light_groups{view_.tree_, view_.rows_, first_row(level), means_.data(),
                                              weights_.data(), defensive_.data(), floor_, sums_.data()});
}

}  // namespace wfpg
