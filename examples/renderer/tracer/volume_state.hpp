// Data of a wave of paths through media between its kernels. path_state.hpp has that of the vertices on
// surfaces, and of queues.
#pragma once

#include "tracer/media_ways.hpp"
#include "tracer/path_kernels.hpp"

namespace render {

/// A path between two vertices, or at a vertex in a medium.
struct volume_path {
  vec3 origin{0.0f};  ///< of the next segment; at a vertex in a medium, its position
  float pdf = 0.0f;   ///< of the direction, per steradian; 0 from the camera and delta lobes
  vec3 direction{0.0f, 0.0f, 1.0f};
  std::uint32_t active = 1;    ///< 0: it has ended
  vec3 throughput{1.0f};       ///< of the path so far, with roulette
  std::uint32_t material = 0;  ///< at a vertex on a surface, its material
  solid_stack solids;          ///< around the segment's end, or around the vertex

  volume_path() = default;
  WFPG_HD volume_path(const wfpg::ray& camera_ray, const solid_stack& around_camera)
      : origin(camera_ray.origin), direction(camera_ray.direction), solids(around_camera) {}

  WFPG_HD wfpg::ray ray() const { return ray_along(origin, direction); }
};

static_assert(sizeof(volume_path) == 64, "every kernel of a wave reads it");

/// The key of vertices in a medium. Those on surfaces have their material's kind.
inline constexpr std::uint32_t medium_key = (1u << material_key_bits) - 2;

/// The sample and depth of a wave through media. A segment draws a distance for each piece between the
/// boundaries that it passes.
struct volume_position : wave_position {
  static constexpr std::uint32_t distance = dimension::per_vertex;
  static constexpr std::uint32_t per_vertex = distance + most_passed + 1;

  WFPG_HD vec2 draw(std::uint32_t path, std::uint32_t use) const {
    return random(path, depth * per_vertex + use);
  }
};

}  // namespace render
