// What a wave of paths keeps between its kernels: the paths, their hits, the queue of those still going on.
#pragma once

#include "lights.hpp"
#include "rng.hpp"

#include <wfpg/partitioner.hpp>

namespace render {

/// A path between two vertices.
struct path_state {
  wfpg::ray ray;             ///< of the next segment
  vec3 throughput{1.0f};     ///< of the path so far, roulette included
  float pdf = 0.0f;          ///< of the ray's direction, per steradian; 0 from the camera and delta lobes
  float reflectance = 1.0f;  ///< what roulette goes by: see survive_roulette
  bool active = true;
};

/// A path's last hit.
struct path_vertex {
  wfpg::surface<bsdf> surface;
  float offset = 0.0f;  ///< as in surface_point
};

/// A sample of next-event estimation that waits for its weight.
struct light_query {
  vec3 direction{0.0f};  ///< toward the light, unit length; zero where there is nothing to add
  float pdf = 0.0f;      ///< of the direction by light sampling, per steradian
  vec3 value{0.0f};      ///< BSDF, cosine and radiance over that pdf
};

/// The paths that go on, in the order of their materials: slot -> path.
struct path_queue {
  wfpg::partition_view by_material;

  WFPG_HD bool holds(std::size_t slot) const { return slot < by_material.offsets[*by_material.count]; }
  WFPG_HD std::uint32_t operator[](std::size_t slot) const { return by_material.permutation[slot]; }
};

/// The surfaces functor of a wave whose rays are the slots of a queue.
struct queued_surfaces {
  path_queue queue;
  wfpg::array_view<const path_vertex> vertices;

  WFPG_HD wfpg::surface<bsdf> operator()(std::uint32_t slot) const {
    if (queue.holds(slot)) return vertices[queue[slot]].surface;
    wfpg::surface<bsdf> unused;
    unused.active = false;
    return unused;
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
  wfpg::array_view<const light_query> queries;

  WFPG_HD vec3 operator()(std::uint32_t slot) const { return queries[slot].direction; }
};

}  // namespace render
