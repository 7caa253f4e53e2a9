// Samples of a small guider in all forms of calls, step by step, so that a test can make any step fail.
#pragma once

#include "support/evaluate.hpp"
#include "support/guiding.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/path_guider.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

namespace wfpg_test {

/// The number of paths in the largest sample.
constexpr std::size_t most_paths = 1500;

/// Small options, since a test samples again for each failure.
inline guider_options stepwise_options(field_lifetime lifetime, std::uint32_t products) {
  guider_options options = tracing_options(most_paths, wfpg::guiding_mode::oriented, lifetime);
  options.octree_resolution = 8;
  options.kept.resolution = options.field_resolution = options.min_field_resolution = 4;
  options.kept.budget_bytes = 400 * wfpg::field_store<one_policy>::bytes_a_slot(4);
  options.binning.rays_per_bin = 8;
  if (products > 0) options.product_resolution = products;
  options.lights.weights = {1.0f, 0.0f, 3.0f};
  options.lights.resolution = 4;
  options.caster_buffer_bytes = 16 << 10;
  return options;
}

/// Calls f(options) for both lifetimes, with and without products.
template <class F>
void for_each_stepwise_options(const F& f) {
  for (const field_lifetime lifetime : lifetimes)
    for (const std::uint32_t products : {0u, 4u}) {
      INFO(name_of(lifetime) << ", products " << products);
      f(stepwise_options(lifetime, products));
    }
}

struct ask_straight_up {
  WFPG_HD vec3 operator()(std::uint32_t) const { return {0.0f, 1.0f, 0.0f}; }
};

struct record_first_vertex {
  wfpg::path_recorder_view recorder;
  wfpg::array_view<const test_surface> surfaces;
  WFPG_HD void operator()(std::size_t i) const {
    recorder.vertex(i, 0, surfaces[i].position, surfaces[i].outgoing, vec3(1.0f));
  }
};

struct choose_lights {
  wfpg::light_guide_view lights;
  wfpg::array_view<const test_surface> surfaces;
  WFPG_HD void operator()(std::size_t i) const {
    const float u = hashed_numbers()(static_cast<std::uint32_t>(i), 5).x;
    const auto chosen = lights.choose(lights.find(surfaces[i].position, surfaces[i].normal), u);
    lights.deposit(i, chosen.key, chosen.group == 2 ? 1.0f : 0.0f);
  }
};

/// Samples in all forms of calls, step by step. Each sample has more paths than the one before, so that it
/// allocates. Allocations of the host do not use the guider's resource.
template <class Exec, class Guide = either_guide<Exec>>
class stepwise_samples {
 public:
  static constexpr int steps = 7, begin = 0, end = steps - 1;

  explicit stepwise_samples(wfpg::path_guider<Exec, Guide>& guider) : guider_(guider) {}

  /// The directions sampled so far.
  const std::vector<wfpg::sampled_direction>& drawn() const { return drawn_; }

  void start(std::uint32_t sample) {
    sample_ = sample;
    paths_ = most_paths >> (3 - sample);
    surfaces_ = wfpg::buffer<test_surface, Exec>(host_, wall_surfaces(paths_, sample));
    paths_in_flight_ = wfpg::buffer<path_step, Exec>(host_, std::vector<path_step>(paths_));
    directions_ = wfpg::buffer<wfpg::sampled_direction, Exec>(host_, paths_);
    densities_ = wfpg::buffer<float, Exec>(host_, paths_);
  }

  void step(int i) {
    if (i == begin) guider_.begin_sample();
    if (i == 1) record_first();
    if (i == 2)
      guider_.sample_directions(wave(0), box_caster{}, directions_.view(),
                                wfpg::density_queries{ask_straight_up{}, densities_.view()});
    if (i == 3) follow(0);
    if (i == 4) {
      batch_box_caster::log log;
      guider_.sample_directions(wave(1), batch_box_caster{{}, &log}, directions_.view());
      follow(1);
    }
    if (i == 5) guider_.prepare(wave(2), box_caster{});
    if (i == end) guider_.end_sample();
  }

 private:
  auto wave(std::uint32_t depth) const {
    return wfpg::wave{depth, paths_, stored_surfaces{const_view<test_surface>(surfaces_)},
                      hashed_numbers{100 * sample_ + depth}};
  }
  void record_first() {
    host_.for_each(paths_, record_first_vertex{guider_.recorder(), const_view<test_surface>(surfaces_)});
    host_.for_each(paths_, choose_lights{guider_.lights(), const_view<test_surface>(surfaces_)});
  }
  void follow(std::uint32_t depth) {
    for (const wfpg::sampled_direction& d : directions_.to_host(host_)) drawn_.push_back(d);
    host_.for_each(paths_,
                   follow_path<patch_box>{patch_box(), paths_in_flight_.view(),
                                          const_view<wfpg::sampled_direction>(directions_), surfaces_.view(),
                                          guider_.recorder(), depth, 100 * std::uint64_t(sample_) + depth});
  }

  wfpg::path_guider<Exec, Guide>& guider_;
  Exec host_;
  std::uint32_t sample_ = 0;
  std::size_t paths_ = 0;
  wfpg::buffer<test_surface, Exec> surfaces_;
  wfpg::buffer<path_step, Exec> paths_in_flight_;
  wfpg::buffer<wfpg::sampled_direction, Exec> directions_;
  wfpg::buffer<float, Exec> densities_;
  std::vector<wfpg::sampled_direction> drawn_;
};

struct density_of_view {
  wfpg::guide_view view;
  wfpg::array_view<const test_surface> surfaces;
  wfpg::array_view<const wfpg::sampled_direction> drawn;
  WFPG_HD bool operator()(std::size_t i) const {
    const wfpg::sampled_direction& d = drawn[i];
    const float again = view.pdf(static_cast<std::uint32_t>(i), surfaces[i], d.direction);
    return d.pdf > 0.0f && std::fabs(again - d.pdf) <= 1.0e-5f * d.pdf;
  }
};

/// Runs a whole sample. Some rays must be guided, and each direction must have its field's density.
template <class Exec, class Guide>
void check_guides(wfpg::path_guider<Exec, Guide>& guider) {
  const Exec exec;
  const auto surfaces = wall_surfaces(400, 77);
  const wave_of_surfaces<Exec> wave(exec, surfaces);
  const wfpg::buffer<wfpg::sampled_direction, Exec> drawn(exec, surfaces.size());
  guider.begin_sample();
  for (int warm_up = 0; warm_up < 4; ++warm_up) guider.prepare(wave.get(), box_caster{});
  guider.sample_directions(wave.get(), box_caster{}, drawn.view());
  const wfpg::guide_view view = guider.prepare(wave.get(), box_caster{});
  CHECK(count_guided(exec, view, surfaces.size()) > 100);
  const density_of_view agrees{view, wave.get().surfaces.surfaces,
                               const_view<wfpg::sampled_direction>(drawn)};
  CHECK(count_where(exec, surfaces.size(), agrees) == surfaces.size());
  guider.end_sample();
}

}  // namespace wfpg_test
