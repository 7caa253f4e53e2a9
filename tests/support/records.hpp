// Lamps for irradiance_records, and a box with a dividing wall.
#pragma once

#include "support/evaluate.hpp"
#include "support/guiding.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"
#include "support/unset.hpp"

#include <wfpg/guides/records/irradiance_records.hpp>
#include <wfpg/path_guider.hpp>

#include <cstdint>
#include <vector>

namespace wfpg_test {

template <class Exec, class Smooth = wfpg::no_smooth_surfaces>
using records_guider = wfpg::path_guider<Exec, wfpg::irradiance_records<Exec, Smooth>>;

/// A rectangle of the unit box's ceiling that emits downward.
inline std::vector<wfpg::emitting_triangle> ceiling_lamp(float x0, float x1, float z0, float z1,
                                                         float radiance) {
  const vec3 a(x0, 1.0f, z0), b(x1, 1.0f, z0), c(x1, 1.0f, z1), d(x0, 1.0f, z1);
  return {{a, b, c, radiance}, {a, c, d, radiance}};
}
/// The patch of guiding.hpp.
inline std::vector<wfpg::emitting_triangle> patch_lamp() {
  return ceiling_lamp(patch_low, patch_high, patch_low, patch_high, patch_radiance);
}

inline wfpg::irradiance_records_options records_options(std::size_t rays = 1024) {
  wfpg::irradiance_records_options options;
  options.max_rays = unless_zero(rays);
  options.octree_resolution = 16;
  options.record_level = 3;
  options.emitter_rays = 1u << 14;
  return options;
}

/// A wall across the unit box, from floor to ceiling.
constexpr float wall_x = 0.55f;

/// The box with that wall. A ray that begins inside the wall leaves it.
struct walled_box_caster {
  WFPG_HD wfpg::ray_hit operator()(const wfpg::ray& r) const {
    wfpg::ray_hit hit = box_caster()(r);
    const float t = (wall_x - r.origin.x) / r.direction.x;
    if (r.direction.x != 0.0f && t > 1.0e-5f && t < hit.distance) hit.distance = t;
    return hit;
  }
};

/// Triangles and emitters in a policy's memory.
template <class Exec>
struct lit_mesh {
  wfpg::buffer<vec3, Exec> positions;
  wfpg::buffer<wfpg::uvec3, Exec> triangles;
  wfpg::buffer<wfpg::emitting_triangle, Exec> emitters;

  /// The unit box, with the wall if `walled`.
  lit_mesh(const Exec& exec, const std::vector<wfpg::emitting_triangle>& lamps, bool walled = false)
      : emitters(exec, lamps) {
    std::vector<vec3> points = box_positions();
    std::vector<wfpg::uvec3> corners = box_triangles();
    if (walled) {
      for (const vec3 p : {vec3(wall_x, 0, 0), vec3(wall_x, 1, 0), vec3(wall_x, 1, 1), vec3(wall_x, 0, 1)})
        points.push_back(p);
      corners.push_back({8, 9, 10});
      corners.push_back({8, 10, 11});
    }
    positions = wfpg::buffer<vec3, Exec>(exec, points);
    triangles = wfpg::buffer<wfpg::uvec3, Exec>(exec, corners);
  }
  template <class Smooth = wfpg::no_smooth_surfaces>
  wfpg::lit_scene<Smooth> scene(const Smooth& smooth = {}) const {
    return {{const_view<vec3>(positions), const_view<wfpg::uvec3>(triangles)},
            const_view<wfpg::emitting_triangle>(emitters),
            smooth};
  }
};

/// Begins a sample, and gives the guider a wave in it.
template <class Guider, class Exec, class Caster>
void begin_with_wave(const Exec& exec, Guider& guider, const Caster& caster) {
  guider.begin_sample();
  const wave_of_surfaces<Exec> wave(exec, wall_surfaces(8, 1));
  guider.prepare(wave.get(), caster);
}

struct tag_at {
  wfpg::irradiance_records_view view;
  WFPG_HD wfpg::voxel_tag operator()(vec3 p) const { return view.tag(p); }
};
struct record_at {
  wfpg::irradiance_records_view view;
  WFPG_HD wfpg::irradiance_record operator()(vec3 p) const {
    const wfpg::irradiance_record* const record = view.record(p);
    return record ? *record : wfpg::irradiance_record{};
  }
};

/// The record at a place.
template <class Exec>
wfpg::irradiance_record record_of(const Exec& exec, const wfpg::irradiance_records_view& view, vec3 place) {
  return evaluate(exec, std::vector<vec3>{place}, record_at{view})[0];
}

/// All counters of all voxels' records, and all tags, over a grid of n³ voxels of the unit box's octree.
template <class Exec>
std::vector<std::uint64_t> everything(const Exec& exec, const wfpg::irradiance_records_view& view,
                                      const std::vector<vec3>& places) {
  std::vector<std::uint64_t> result;
  for (const wfpg::irradiance_record& record : evaluate(exec, places, record_at{view}))
    result.insert(result.end(), record.words, record.words + wfpg::irradiance_record::rows);
  for (const wfpg::voxel_tag tag : evaluate(exec, places, tag_at{view}))
    result.push_back(static_cast<std::uint64_t>(tag));
  return result;
}

/// The centres of the octree's voxels, empty ones too.
inline std::vector<vec3> voxel_centres(const wfpg::voxel_grid& grid) {
  const std::uint32_t n = grid.resolution;
  std::vector<vec3> places;
  for (std::uint32_t i = 0; i < n * n * n; ++i)
    places.push_back(grid.origin + (vec3(i % n, i / n % n, i / n / n) + 0.5f) * grid.voxel_size());
  return places;
}

}  // namespace wfpg_test
