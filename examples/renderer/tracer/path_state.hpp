// Data of a wave of paths between its kernels: the paths, their hits, and the queue of active ones.
#pragma once

#include "lights/lights.hpp"
#include "tracer/rng.hpp"

#include <wfpg/bins/partitioner.hpp>
#include <wfpg/exec/tiled_array.hpp>
#include <wfpg/guides/octree/light_guide.hpp>

namespace render {

using wfpg::tiled_array;
using wfpg::tiled_view;

/// A path between two vertices.
struct path_state {
  vec3 origin{0.0f};  ///< of the next segment
  float pdf = 0.0f;   ///< of the direction, per steradian; 0 from the camera and delta lobes
  vec3 direction{0.0f, 0.0f, 1.0f};
  float reflectance = 1.0f;  ///< for roulette, see survive_roulette
  vec3 throughput{1.0f};     ///< of the path so far, with roulette
  std::uint32_t active = 1;  ///< 0: it has ended

  path_state() = default;
  WFPG_HD explicit path_state(const wfpg::ray& camera_ray)
      : origin(camera_ray.origin), direction(camera_ray.direction) {}

  WFPG_HD wfpg::ray ray() const { return ray_along(origin, direction); }
};

/// Roulette by a path's throughput, which it divides. It spares paths with more than a tenth of `begun`, the
/// luminance with which they began. False where the path ends.
WFPG_HD inline bool survives_by_throughput(vec3& throughput, float begun, float u) {
  constexpr float spared_part = 0.1f;
  const float probability = glm::min(1.0f, wfpg::luminance(throughput) / (spared_part * begun));
  if (!(u < probability)) return false;
  throughput /= probability;
  return true;
}

/// A path's last hit: its surface without redundant members. Nothing is initialised, since vertices are made
/// from a hit or copied.
struct path_vertex {
  vec3 position;
  float offset;  ///< as in surface_point
  vec3 geometric_normal;
  float alpha;
  vec3 normal;
  float ior;
  vec3 outgoing;
  material_kind kind;
  unorm8x3 transmitted_colour;
  vec3 colour;
  lobe_factors factors;

  path_vertex() = default;
  WFPG_HD explicit path_vertex(const hit_surface& hit)
      : position(hit.surface.position),
        offset(hit.offset),
        geometric_normal(hit.surface.geometric_normal),
        alpha(hit.surface.bsdf.alpha),
        normal(hit.surface.normal),
        ior(hit.surface.bsdf.ior),
        outgoing(hit.surface.outgoing),
        kind(hit.surface.bsdf.kind),
        transmitted_colour(hit.surface.bsdf.transmitted_colour),
        colour(hit.surface.bsdf.colour),
        factors(hit.surface.bsdf.factors) {}

  WFPG_HD render::bsdf bsdf() const {
    render::bsdf f;
    f.kind = kind;
    f.normal = normal;
    f.geometric_normal = geometric_normal;
    f.colour = colour;
    f.alpha = alpha;
    f.ior = ior;
    f.transmitted_colour = transmitted_colour;
    f.factors = factors;
    return f;
  }
  WFPG_HD wfpg::surface<render::bsdf> surface(std::uint32_t path) const {
    return {position, geometric_normal, normal, outgoing, bsdf(), true, path};
  }
};

static_assert(sizeof(path_vertex) == 80, "every kernel of a wave reads it");

/// A sample of next-event estimation without its weight.
struct light_query {
  vec3 direction{0.0f};  ///< toward the light, unit length; zero: nothing to add
  float pdf =
      0.0f;  ///< of the direction by light sampling, per steradian; huge if no other technique finds it
  vec3 value{0.0f};                              ///< BSDF, cosine and radiance over that pdf
  std::uint32_t choice = wfpg::no_light_choice;  ///< of its group

  light_query() = default;
  /// A choice that found no light.
  WFPG_HD explicit light_query(std::uint32_t of) : choice(of) {}
};

/// The active paths, in the order in which a wave's kernels take them: slot -> path.
struct path_queue {
  wfpg::partition_view active;
  bool all = false;  ///< every path in its own slot

  WFPG_HD bool holds(std::size_t slot) const { return all || slot < active.offsets[*active.count]; }
  WFPG_HD std::uint32_t operator[](std::size_t slot) const {
    return all ? static_cast<std::uint32_t>(slot) : active.permutation[slot];
  }
};

/// The surfaces functor of a wave whose rays are the slots of a queue.
struct queued_surfaces {
  path_queue queue;
  tiled_view<path_vertex> vertices;

  WFPG_HD wfpg::surface<bsdf> operator()(std::uint32_t slot) const {
    // Each result is made in place: a copy on the stack takes longer than all else here.
    if (!queue.holds(slot)) return inactive();
    const std::uint32_t id = queue[slot];
    return vertices[id].surface(id);
  }
  /// Slots beyond the queue belong to no path.
  WFPG_HD std::uint32_t path(std::uint32_t slot) const {
    return queue.holds(slot) ? static_cast<std::uint32_t>(queue[slot]) : wfpg::no_path;
  }

 private:
  WFPG_HD static wfpg::surface<bsdf> inactive() {
    wfpg::surface<bsdf> result;
    result.active = false;
    return result;
  }
};

/// The random functor of a wave.
struct queued_random {
  path_queue queue;
  random_stream stream;
  std::uint32_t first_dimension = 0;

  WFPG_HD vec2 operator()(std::uint32_t slot, std::uint32_t dimension) const {
    return queue.holds(slot) ? stream(queue[slot], first_dimension + dimension) : vec2(0.0f);
  }
};

/// The query functor of a wave: the direction of each slot's light.
struct queued_light_directions {
  tiled_view<light_query> queries;

  WFPG_HD vec3 operator()(std::uint32_t slot) const { return queries[slot].direction; }
};

}  // namespace render
