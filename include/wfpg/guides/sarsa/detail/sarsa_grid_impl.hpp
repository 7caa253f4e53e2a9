// Implementation of sarsa_grid.hpp.
#pragma once

#include <wfpg/guides/sarsa/sarsa_grid.hpp>

#include <cmath>

namespace wfpg {
namespace detail {

inline sarsa_cells cells_over(const bounds3& bounds, std::uint32_t resolution) {
  sarsa_cells cells;
  cells.resolution = resolution;
  if (bounds.empty()) return cells;
  cells.lower = bounds.lower;
  for (int axis = 0; axis < 3; ++axis) {
    const float extent = bounds.extent()[axis];
    cells.per_unit[axis] = extent > 0.0f ? static_cast<float>(resolution) / extent : 0.0f;
  }
  return cells;
}

}  // namespace detail

template <class Exec>
const sarsa_grid_options& sarsa_grid<Exec>::checked(const sarsa_grid_options& o) {
  const auto require_even = [](const char* name, std::uint32_t value) {
    require(value >= 2 && value <= 64 && value % 2 == 0, name, value, "even, in [2, 64]");
  };
  require(o.resolution >= 1 && o.resolution <= 64, "resolution", o.resolution, "in [1, 64]");
  require_even("direction_resolution", o.direction_resolution);
  require_even("normal_resolution", o.normal_resolution);
  require(o.step >= 1, "step", o.step, "at least 1");
  require(o.values_per_direction.value_or(1) >= 1, "values_per_direction", o.values_per_direction.value_or(1),
          "at least 1, or unset to record all paths");
  require(o.learning_rate >= 0.0f && o.learning_rate <= 1.0f, "learning_rate", o.learning_rate, "in [0, 1]");
  require(o.floor >= 0.0f, "floor", o.floor, "finite, at least 0");
  require(!o.ranks || o.update != sarsa_update::expected_sarsa, "update", "expected_sarsa",
          "sarsa or monte_carlo with ranks");
  return o;
}

template <class Exec>
sarsa_grid<Exec>::sarsa_grid(const Exec& exec, const Exec& working, const bounds3& bounds,
                             const sarsa_grid_options& options)
    : options_(checked(options)) {
  view_.cells_ = detail::cells_over(bounds, options_.resolution);
  view_.normals_ = {options_.normal_resolution};
  view_.resolution_ = options_.direction_resolution;
  view_.sampler_ = options_.sampler;
  const std::uint32_t n = view_.resolution_ * view_.resolution_, normals = view_.normals_.size();
  means_ = buffer<detail::direction_mean, Exec>(exec, directions());
  radiance_ = buffer<float, Exec>(exec, directions());
  weights_ = buffer<std::uint32_t, Exec>(exec, directions());
  sums_ = buffer<std::uint32_t, Exec>(
      exec, std::size_t(view_.cells_.size()) * grid_distribution::words(view_.resolution_));
  cosines_ = buffer<std::uint8_t, Exec>(exec, std::size_t(normals) * n);
  opposites_ = buffer<std::uint32_t, Exec>(exec, n);
  if (options_.sampler != sarsa_sampler::sphere_inversion)
    normalisers_ = buffer<detail::sarsa_normaliser, Exec>(exec, std::size_t(view_.cells_.size()) * normals);
  queue_ = detail::value_queue<Exec>(working, recorded().vertices("values_per_direction"), directions(),
                                     options_.ranks);
  if (expects()) expected_ = buffer<float, Exec>(working, options_.max_paths * options_.max_depth);
  view_.radiance_ = radiance_.data();
  view_.weights_ = weights_.data();
  view_.sums_ = sums_.data();
  view_.cosines_ = cosines_.data();
  view_.normalisers_ = normalisers_.data();
  exec.for_each(n, detail::find_opposites{view_.resolution_, opposites_.data()});
  exec.for_each(cosines_.size(),
                detail::tabulate_cosines{view_.normals_, view_.resolution_, cosines_.data()});
  forget_light(working);
}

template <class Exec>
void sarsa_grid<Exec>::agree(const Exec&, agreed_items& items) const {
  const sarsa_grid_options& o = options_;
  const detail::sarsa_cells& c = view_.cells_;
  items.add("the scene's bounds",
            std::vector<float>{c.lower.x, c.lower.y, c.lower.z, c.per_unit.x, c.per_unit.y, c.per_unit.z});
  items.add("resolution", std::uint64_t(o.resolution));
  items.add("direction_resolution", std::uint64_t(o.direction_resolution));
  items.add("normal_resolution", std::uint64_t(o.normal_resolution));
  items.add("update", std::uint64_t(o.update));
  items.add("sampler", std::uint64_t(o.sampler));
  items.add("step", std::uint64_t(o.step));
  items.add("learning_rate", o.learning_rate);
  items.add("floor", o.floor);
  items.add("values_per_direction", std::uint64_t(o.values_per_direction.value_or(0)));
}

template <class Exec>
void sarsa_grid<Exec>::forget_light(const Exec& exec) {
  exec.fill_bytes(means_.data(), 0, means_.bytes());
  publish(exec);
  view_.fraction_ = 0.0f;
}

template <class Exec>
template <class Surfaces, class Random, class Caster>
sarsa_grid_view sarsa_grid<Exec>::prepare(const sample_context<Exec>& at, const wave<Surfaces, Random>& w,
                                          const Caster&) {
  sarsa_grid_view view = view_;
  if (!at.guided) view.fraction_ = 0.0f;
  const bool asked = expects() && at.recorded && view.fraction_ > 0.0f;
  if (!asked || numbered_ + w.ray_count > expected_.size()) return view;
  at.exec.for_each(w.ray_count,
                   detail::expect_scattering<Surfaces>{w.surfaces, table(), expected_.data() + numbered_,
                                                       static_cast<std::uint32_t>(hash(at.seed, numbered_))});
  view.first_number_ = static_cast<std::uint32_t>(numbered_);
  numbered_ += w.ray_count;
  return view;
}

template <class Exec>
void sarsa_grid<Exec>::learn(const sample_context<Exec>& at, path_recorder<Exec>& paths) {
  if (queue_.capacity() == 0) return;
  at.exec.for_each(paths.recorded(),
                   detail::learn_path{
                       paths.view(), table(), queue_.view(), options_.update, {expected_.data(), numbered_}});
  paths.clear(at.exec);
  queue_.sum(at.exec);
  at.exec.for_each(directions(), detail::fold_values{queue_.view(), means_.data(), options_.learning_rate});
  queue_.end_takes(at.exec);
}

/// Ends a step.
template <class Exec>
void sarsa_grid<Exec>::publish(const Exec& exec) {
  exec.for_each_block(view_.cells_.size(), 0,
                      detail::publish_cell{means_.data(), radiance_.data(), weights_.data(), sums_.data(),
                                           view_.resolution_, options_.floor});
  exec.for_each(
      normalisers_.size(),
      detail::normalise_products{weights_.data(), cosines_.data(), opposites_.data(), normalisers_.data(),
                                 view_.resolution_ * view_.resolution_, view_.normals_.size()});
  view_.fraction_ = options_.guide_fraction.value_or(0.5f);
}

template <class Exec>
std::vector<memory_part> sarsa_grid<Exec>::memory() const {
  return {{"radiance", means_.bytes() + radiance_.bytes() + weights_.bytes() + sums_.bytes(), true},
          {"normalisers", normalisers_.bytes() + cosines_.bytes() + opposites_.bytes(), true},
          {"values", queue_.bytes() + expected_.bytes(), false}};
}

}  // namespace wfpg
