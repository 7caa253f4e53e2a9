// A path, its vertex, and the arrays in which kernels leave them for each other.
#pragma once

#include "bsdfs.hpp"
#include "geometry.hpp"
#include "lights/lights.hpp"
#include "scene/camera.hpp"

namespace kernels {

/// Queues of vertices: one for each kind of material, one for the fog. `no_queue` is no vertex.
enum queue : std::uint32_t { fog_queue = 100, no_queue = 101 };

struct path {
  ray next;                   ///< where it goes on
  spectrum throughput{1.0f};  ///< of its direction, linear radiance at four wavelengths
  spectrum radiance{0.0f};    ///< brought to the pixel so far
  wavelengths waves;
  float pdf = 0.0f;    ///< of its direction, per steradian; 0: a delta lobe's, or the camera's
  float scale = 1.0f;  ///< times throughput: what roulette looks at
  bool active = true;
  bool has_met_surface = false;
  float unrecorded = 0.0f;  ///< radiance from before it met a surface
};

/// A point where a path goes on.
struct vertex {
  vec3 position{0.0f};
  vec3 normal{0.0f}, geometric_normal{0.0f};  ///< as in render::bsdf
  vec3 wo{0.0f};                              ///< toward the previous vertex, world space
  lobe_inputs in;
  float offset = 0.0f;  ///< how far off the surface a ray must begin
};

/// Random numbers of one vertex of a path. Those below `of_fog` are render::dimension's.
struct path_numbers {
  render::random_stream stream;
  std::uint32_t id = 0, next = 0;

  static constexpr std::uint32_t per_vertex = 128, of_fog = 6, of_wavelengths = 7, of_walks = 8;

  KERNELS_BOTH path_numbers(const render::random_stream& of_sample, std::uint32_t path_id,
                            std::uint32_t depth)
      : stream(of_sample), id(path_id), next(depth * per_vertex + of_walks) {}
  /// The next two numbers of a random walk.
  KERNELS_BOTH vec2 operator()() { return stream(id, next++); }
};

/// State that all kernels of one depth share. Arrays have an element for each path.
struct wave {
  render::scene_view scene;
  render::light_view lights;
  render::random_stream random;
  std::uint32_t depth = 0, max_depth = 1;
  float fog = 0.0f;  ///< scattering events per unit of length
  path* paths = nullptr;
  vertex* vertices = nullptr;
  std::uint32_t* queues = nullptr;  ///< of the paths' vertices
  ray* rays = nullptr;              ///< of paths, then of shadow queries
  triangle_hit* hits = nullptr;
  spectrum* shadows = nullptr;  ///< light that reaches the pixel where nothing hides it
  std::uint32_t* hidden = nullptr;

  KERNELS_BOTH bool is_last() const { return depth + 1 >= max_depth; }
  /// Two numbers for one of the uses of render::dimension, at this depth.
  KERNELS_BOTH vec2 draw(std::uint32_t id, std::uint32_t use) const {
    return random(id, depth * path_numbers::per_vertex + use);
  }
};

/// Weight of a direction that one technique drew with density `pdf` and another could have drawn with
/// `other`: the power heuristic, as Veach has it. One of them is positive.
KERNELS_BOTH inline float mis_weight(float pdf, float other) {
  const float ratio = other / pdf;
  return 1.0f / (1.0f + ratio * ratio);
}

KERNELS_BOTH inline ray no_ray() {
  ray none;
  none.t_max = 0.0f;
  return none;
}

}  // namespace kernels
