// A guider with a sarsa_grid in the unit box, and light that it is taught at one place.
#pragma once

#include "support/evaluate.hpp"
#include "support/guiding.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/path_guider.hpp>
#include <wfpg/sarsa_grid.hpp>

#include <cstdint>

namespace wfpg_test {

template <class Exec>
using sarsa_guider = wfpg::path_guider<Exec, wfpg::sarsa_grid<Exec>>;

constexpr wfpg::sarsa_sampler sarsa_samplers[] = {
    wfpg::sarsa_sampler::sphere_inversion, wfpg::sarsa_sampler::hemisphere_inversion,
    wfpg::sarsa_sampler::rejection, wfpg::sarsa_sampler::mixed_rejection};
constexpr const char* sarsa_sampler_names[] = {"sphere inversion", "hemisphere inversion", "rejection",
                                               "mixed rejection"};
constexpr wfpg::sarsa_update sarsa_updates[] = {wfpg::sarsa_update::sarsa, wfpg::sarsa_update::expected_sarsa,
                                                wfpg::sarsa_update::monte_carlo};
constexpr const char* sarsa_update_names[] = {"SARSA", "expected SARSA", "Monte Carlo"};

inline const char* name_of(wfpg::sarsa_sampler sampler) {
  return sarsa_sampler_names[static_cast<int>(sampler)];
}
inline const char* name_of(wfpg::sarsa_update update) {
  return sarsa_update_names[static_cast<int>(update)];
}

/// Learns as it goes, from all paths.
inline wfpg::sarsa_grid_options sarsa_options(std::size_t paths) {
  wfpg::sarsa_grid_options options;
  options.max_paths = paths;
  options.max_depth = 3;
  options.resolution = 4;
  options.direction_resolution = 8;
  options.normal_resolution = 8;
  options.step = 1;
  options.unguided_samples = 0;
  options.values_per_direction = 0;
  return options;
}

/// Paths from one point along random directions, which find the radiance that `light` says.
template <class Light>
struct find_light {
  wfpg::path_recorder_view recorder;
  vec3 from;
  Light light;
  std::uint64_t seed;

  WFPG_HD void operator()(std::size_t path) const {
    const vec2 u = hashed_numbers{seed}(static_cast<std::uint32_t>(path), 0);
    const vec3 d = wfpg::square_to_sphere(u);
    recorder.vertex(path, 0, from, vec3(0.0f, 1.0f, 0.0f), vec3(1.0f));
    recorder.vertex(path, 1, from + 0.1f * d, -d, vec3(1.0f));
    recorder.emission(path, 1, vec3(light(d)));
  }
};

/// A sample in which the guider learns the light at a point.
template <class Exec, class Light>
void teach(const Exec& exec, sarsa_guider<Exec>& guider, vec3 from, const Light& light) {
  guider.begin_sample();
  exec.for_each(guider.options().max_paths,
                find_light<Light>{guider.recorder(), from, light, guider.statistics().samples});
  guider.end_sample();
}

/// Light from everywhere, and much of it from about a direction.
struct bright_spot {
  vec3 toward;
  float width = 0.9f;  // cosine of the spot's
  WFPG_HD float operator()(vec3 d) const {
    return 0.3f + 0.2f * d.x * d.y + (glm::dot(d, toward) > width ? 20.0f : 0.0f);
  }
};

/// The unit box as a furnace: walls that emit 1 and reflect 0.8, so that 5 arrives everywhere.
constexpr float furnace_radiance = 1.0f / (1.0f - 0.8f);

/// Follows a direction to a wall. Of the paths a share of 0.8 goes on.
struct follow_in_furnace {
  wfpg::array_view<path_step> paths;
  wfpg::array_view<const wfpg::sampled_direction> directions;
  wfpg::array_view<test_surface> surfaces;
  wfpg::path_recorder_view recorder;
  std::uint32_t depth;
  std::uint64_t seed;

  WFPG_HD void operator()(std::size_t i) const {
    const auto path = static_cast<std::uint32_t>(i);
    path_step& step = paths[path];
    test_surface& surface = surfaces[path];
    const wfpg::sampled_direction& d = directions[path];
    if (!surface.active) return;
    recorder.scatter(path, depth, d);
    surface.active = d.pdf > 0.0f && hashed_numbers{seed}(path, 2).x < 0.8f;
    if (!surface.active) return;
    step.throughput *= surface.bsdf.eval(surface.outgoing, d.direction) / (0.8f * d.pdf);
    wfpg::ray ray;
    ray.origin = surface.position;
    ray.direction = d.direction;
    const float distance = box_caster()(ray).distance;
    const vec3 p = glm::clamp(ray.origin + distance * d.direction, vec3(0.0f), vec3(1.0f));
    surface = make_surface(p, inward_normal(p), -d.direction);
    surface.active = step.throughput > 0.0f;
    recorder.vertex(path, depth + 1, p, -d.direction, vec3(step.throughput));
    recorder.emission(path, depth + 1, vec3(step.throughput));
  }
};

/// Samples of paths in the furnace, as long as they get.
template <class Exec>
void trace_in_furnace(const Exec& exec, sarsa_guider<Exec>& guider, std::uint32_t samples) {
  const std::size_t paths = guider.options().max_paths;
  for (std::uint32_t i = 0; i < samples; ++i) {
    const std::uint32_t sample = guider.statistics().samples;
    const wfpg::buffer<test_surface, Exec> surfaces(exec, wall_surfaces(paths, sample));
    const wfpg::buffer<path_step, Exec> steps(exec, std::vector<path_step>(paths));
    const wfpg::buffer<wfpg::sampled_direction, Exec> directions(exec, paths);
    guider.begin_sample();
    const wfpg::path_recorder_view recorder = guider.recorder();
    const wfpg::array_view<test_surface> at = surfaces.view();
    exec.for_each(paths, [=] WFPG_HD(std::size_t path) {
      recorder.vertex(path, 0, at[path].position, at[path].outgoing, vec3(1.0f));
    });
    for (std::uint32_t depth = 0; depth + 1 < guider.options().max_depth; ++depth) {
      const std::uint64_t seed = 1000 * std::uint64_t(sample) + depth;
      const stored_surfaces stored{const_view<test_surface>(surfaces)};
      guider.sample_directions(wfpg::wave{depth, paths, stored, hashed_numbers{seed}}, box_caster(),
                               directions.view());
      exec.for_each(paths, follow_in_furnace{steps.view(), const_view<wfpg::sampled_direction>(directions),
                                             surfaces.view(), recorder, depth, seed});
    }
    guider.end_sample();
  }
}

struct radiance_toward {
  wfpg::sarsa_grid_view view;
  wfpg::array_view<const test_surface> surfaces;
  WFPG_HD float operator()(std::size_t i) const {
    return view.radiance(surfaces[i].position, surfaces[i].outgoing);
  }
};

/// Mean radiance that a grid knows to arrive at points of the walls from all around.
template <class Exec>
double mean_radiance(const Exec& exec, const sarsa_guider<Exec>& guider) {
  constexpr std::size_t n = 20000;
  const wfpg::buffer<test_surface, Exec> surfaces(exec, wall_surfaces(n, 77));
  double sum = 0.0;
  for (const float radiance :
       evaluate(exec, n, radiance_toward{guider.guide().view(), const_view<test_surface>(surfaces)}))
    sum += double(radiance);
  return sum / n;
}

}  // namespace wfpg_test
