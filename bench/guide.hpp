// An octree and a cache of the room with light, and a wave of surfaces.
#pragma once

#include "materials/materials.hpp"
#include "room.hpp"

#include <wfpg/host/wave.hpp>
#include <wfpg/octree/exitance_cache.hpp>

namespace bench {

/// Light on the room's surfaces: bright in a corner of the ceiling, dim elsewhere.
struct light_room {
  wfpg::exitance_cache_view cache;
  wfpg::array_view<const room_point> points;
  WFPG_HD void operator()(std::size_t i) const {
    const room_point& p = points[i];
    const bool bright = p.position.y > 0.999f && p.position.x > 0.7f;
    cache.deposit(p.position, p.normal, bright ? 10.0f : 0.2f);
  }
};

/// The guide of the room: an octree and a cache with its light.
template <class Exec>
struct guide_of_room {
  wfpg::sparse_voxel_octree<Exec> octree;
  wfpg::exitance_cache<Exec> cache;

  guide_of_room(const Exec& exec, std::uint32_t resolution, std::size_t queue_capacity = pixels) {
    const room_mesh<Exec> mesh(exec, sizes::room_triangles);
    auto fragments = wfpg::voxelize(exec, mesh.view(), resolution);
    octree = wfpg::sparse_voxel_octree<Exec>(exec, fragments);
    cache = wfpg::exitance_cache<Exec>(exec, octree, fragments, queue_capacity);
    for (int bounces = 0; bounces < 4; ++bounces) {
      const auto points = points_after(exec, bounces);
      exec.for_each(pixels, light_room{cache.view(), wfpg::array_view<const room_point>(points.view())});
      cache.update(exec);
    }
  }
};

/// A wave's surfaces with one of the renderer's materials.
struct stored_surfaces {
  wfpg::array_view<const room_point> points;
  render::material_kind kind = render::material_kind::lambert;
  WFPG_HD wfpg::surface<render::bsdf> operator()(std::uint32_t ray) const {
    const room_point& p = points[ray];
    const render::bsdf f{p.normal, p.normal, vec3(0.6f, 0.4f, 0.3f), 0.2f, 1.5f, kind};
    return {p.position, p.normal, p.normal, p.outgoing, f, true};
  }
};

struct hashed_numbers {
  std::uint64_t seed = 1;
  WFPG_HD vec2 operator()(std::uint32_t ray, std::uint32_t dimension) const {
    return wfpg::unit_vec2(wfpg::hash(wfpg::hash(seed, ray), dimension));
  }
};

}  // namespace bench
