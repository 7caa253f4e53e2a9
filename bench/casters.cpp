// Rays a second of the renderer's own BVH. The rays are cones of bins, a whole sphere of directions from each
// point. They are in the order of fields, or shuffled. The scene is small triangles that fill the unit cube,
// or an empty box. The floor is OptiX's caster of the same rays in the same run if it was built, otherwise a
// copy of rays and hits.
#include "casters/bvh_scene.hpp"
#include "floors.hpp"
#include "triangles.hpp"
#if defined(WFPG_BENCH_OPTIX)
#include "casters/optix_caster.hpp"
#endif

#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/guides/octree/transient_fields.hpp>

namespace bench {
namespace {

constexpr std::uint32_t resolution = sizes::cast_size, cells = resolution * resolution;
constexpr std::uint32_t ray_count = sizes::cast_points * cells;  // a power of two, for `shuffled`

/// A permutation of the rays' indices.
WFPG_HD std::uint32_t shuffled(std::uint32_t i) {
  for (int round = 0; round < 3; ++round) {
    i = i * 0x9e3779b1u % ray_count;
    i ^= i >> 13;
  }
  return i;
}

struct make_ray {
  wfpg::ray* rays;
  bool in_order;
  WFPG_HD void operator()(std::size_t thread) const {
    const auto written = static_cast<std::uint32_t>(thread);
    const std::uint32_t i = in_order ? written : shuffled(written);
    const wfpg::field_cell cell = wfpg::cell_in_order(i % cells, resolution);
    const vec2 square = vec2(static_cast<float>(cell.x), static_cast<float>(cell.y)) + unit_vec2(hash(3, i));
    rays[written] = {0.05f + 0.9f * random_point(4, i / cells), 0.0f,
                     wfpg::square_to_sphere(square / static_cast<float>(resolution)), 3.0e38f};
  }
};

struct cast_inline {
  render::bvh_caster caster;
  wfpg::array_view<const wfpg::ray> rays;
  wfpg::array_view<wfpg::ray_hit> hits;
  WFPG_HD void operator()(std::size_t i) const { hits[i] = caster(rays[i]); }
};

/// Casts one ray after the other. The floor is OptiX's caster or a copy.
template <class Exec>
void casting(benchmark::State& state) {
  const Exec exec;
  const triangles_of<Exec> mesh(exec, static_cast<std::size_t>(state.range(0)));
  const wfpg::buffer<wfpg::ray, Exec> rays(exec, ray_count);
  const wfpg::buffer<wfpg::ray_hit, Exec> hits(exec, ray_count);
  exec.for_each(ray_count, make_ray{rays.data(), state.range(1) != 0});
  const wfpg::array_view<const wfpg::ray> given(rays.view());
  const render::bvh_scene<Exec> hierarchy(exec, mesh.view(), 0.0f);
#if defined(WFPG_BENCH_OPTIX)
  const render::optix_scene optix(exec, mesh.view().positions, mesh.view().triangles, 0.0f);
  const auto floor = [&] { optix.caster().cast(exec, given, hits.view()); };
#else
  const copy_of floor(exec, rays.bytes() + hits.bytes());
  state.SetLabel("a copy of rays and hits, without OptiX");
#endif
  compare(
      state, exec,
      [&] {
        exec.for_each(ray_count, cast_inline{hierarchy.caster(), given, hits.view()});
      },
      floor);
  state.counters["Mrays_a_second"] = 1.0e-3 * ray_count / state.counters["median_ms"];
}

WFPG_BENCH_STAGE(casting, {"thousands", "in_order"}, sizes::casting);

}  // namespace
}  // namespace bench
