// A guider with a sarsa_grid in the unit box, and light that it learns at one place.
#pragma once

#include "support/evaluate.hpp"
#include "support/guiding.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"
#include "support/unset.hpp"

#include <wfpg/guides/sarsa/sarsa_grid.hpp>
#include <wfpg/path_guider.hpp>

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

/// Options to learn from all paths.
inline wfpg::sarsa_grid_options sarsa_options(std::size_t paths) {
  wfpg::sarsa_grid_options options;
  options.max_paths = paths;
  options.max_depth = 3;
  options.resolution = 4;
  options.direction_resolution = 8;
  options.normal_resolution = 8;
  options.step = 1;
  options.unguided_samples = 0;
  options.values_per_direction.reset();
  return options;
}

/// Paths from one point along random directions. `light` gives the radiance that they find.
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

/// Runs a sample in which the guider learns the light at a point.
template <class Exec, class Light>
void teach(const Exec& exec, sarsa_guider<Exec>& guider, vec3 from, const Light& light) {
  guider.begin_sample();
  exec.for_each(guider.options().max_paths,
                find_light<Light>{guider.recorder(), from, light, guider.statistics().samples});
  guider.end_sample();
}

/// Light from everywhere, and most of it from around one direction.
struct bright_spot {
  vec3 toward;
  float width = 0.9f;  // cosine of the spot's angle
  WFPG_HD float operator()(vec3 d) const {
    return 0.3f + 0.2f * d.x * d.y + (glm::dot(d, toward) > width ? 20.0f : 0.0f);
  }
};

/// The unit box as a furnace: walls emit 1 and reflect 0.8, so the radiance is 5 everywhere.
constexpr float furnace_radiance = 1.0f / (1.0f - 0.8f);

/// The fraction of paths that continue equals the albedo.
struct furnace {
  static constexpr float survival = 0.8f;
  WFPG_HD float operator()(vec3) const { return 1.0f; }
};

/// Traces samples of paths in the furnace, up to the maximal depth.
template <class Exec>
void trace_in_furnace(const Exec& exec, sarsa_guider<Exec>& guider, std::uint32_t samples) {
  const paths_to_trace what{samples, guider.options().max_paths, guider.options().max_depth - 1,
                            guider.statistics().samples};
  trace_paths(exec, guider, what, box_caster(), furnace());
}

struct radiance_toward {
  wfpg::sarsa_grid_view view;
  wfpg::array_view<const test_surface> surfaces;
  WFPG_HD float operator()(std::size_t i) const {
    return view.radiance(surfaces[i].position, surfaces[i].outgoing);
  }
};

/// The grid's mean incident radiance at points on the walls, over all directions.
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
