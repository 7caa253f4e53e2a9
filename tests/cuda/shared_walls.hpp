// A small guide that ranks learn from the walls of walls.hpp: each rank has a part of the rays.
#pragma once

#include "cuda/walls.hpp"
#include "support/guiding.hpp"
#include "support/scenes.hpp"

#include <wfpg/guide_file.hpp>
#include <wfpg/ranks/communicator.hpp>

#include <cstddef>
#include <cstdint>
#include <sstream>
#include <string>

namespace wfpg_test {

/// Surfaces and random numbers of a rank's rays, which have those of all ranks from `first` on.
struct part_of_walls {
  std::uint32_t first;
  WFPG_HD test_surface operator()(std::uint32_t ray) const {
    test_surface surface = walls()(first + ray);
    surface.path = ray;
    return surface;
  }
};
struct part_of_numbers {
  std::uint64_t seed;
  std::uint32_t first;
  WFPG_HD vec2 operator()(std::uint32_t ray, std::uint32_t dimension) const {
    return hashed_numbers{seed}(first + ray, dimension);
  }
};

struct record_vertices {
  wfpg::path_recorder_view recorder;
  part_of_walls surfaces;
  WFPG_HD void operator()(std::size_t i) const {
    const test_surface surface = surfaces(static_cast<std::uint32_t>(i));
    recorder.vertex(i, 0, surface.position, surface.outgoing, vec3(1.0f));
  }
};
/// Paths end where their first direction leads, and find there what the patch emits, and some light.
struct record_light {
  wfpg::path_recorder_view recorder;
  part_of_walls surfaces;
  wfpg::array_view<const wfpg::sampled_direction> directions;
  WFPG_HD void operator()(std::size_t i) const {
    const wfpg::sampled_direction& d = directions[i];
    recorder.scatter(i, 0, d);
    if (!(d.pdf > 0.0f)) return;
    wfpg::ray ray;
    ray.origin = surfaces(static_cast<std::uint32_t>(i)).position;
    ray.direction = d.direction;
    const vec3 p = glm::clamp(ray.origin + box_caster()(ray).distance * d.direction, vec3(0.0f), vec3(1.0f));
    recorder.vertex(i, 1, p, -d.direction, vec3(1.0f));
    recorder.emission(i, 1, vec3(0.05f + emitted(p)));
  }
};

/// What ranks have learnt from `all` rays in each of six samples: the file's bytes. `ranks`: of the policy's
/// memory.
template <class Exec>
std::string learnt_by_ranks(const Exec& exec, wfpg::communicator& ranks, std::uint32_t all) {
  const std::uint32_t first = all * ranks.rank() / ranks.size();
  const std::uint32_t count = all * (ranks.rank() + 1) / ranks.size() - first;
  wfpg::kept_guide_options options = tracing_options(count);
  options.octree_resolution = 16;
  options.kept.resolution = 8;
  options.binning.rays_per_bin = 16;
  options.ranks = &ranks;
  options.first_path = first;
  options.all_paths = all;
  wfpg::path_guider<Exec> guider(exec, box_mesh<Exec>(exec).view(), options);
  const wfpg::buffer<wfpg::sampled_direction, Exec> directions(exec, count);
  for (std::uint32_t sample = 0; sample < 6; ++sample) {
    guider.begin_sample();
    exec.for_each(count, record_vertices{guider.recorder(), {first}});
    guider.sample_directions(wfpg::wave{0u, count, part_of_walls{first}, part_of_numbers{sample, first}},
                             box_caster(), directions.view());
    exec.for_each(count,
                  record_light{guider.recorder(), {first}, const_view<wfpg::sampled_direction>(directions)});
    guider.end_sample();
  }
  std::ostringstream out;
  wfpg::save_guide(guider, out);
  return out.str();
}

}  // namespace wfpg_test
