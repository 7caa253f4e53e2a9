// Kept fields: sampling a wave from slots that are up to date.
#include "floors.hpp"
#include "guide.hpp"

#include <wfpg/path_guider.hpp>

namespace bench {
namespace {

/// Finds the slots of a wave's rays, and samples a direction with its density for each. The wave may build
/// fields, but none is due. The floor reads the surfaces and writes the directions.
template <class Exec>
void serving_kept(benchmark::State& state) {
  const Exec exec;
  const room_mesh<Exec> mesh(exec, sizes::room_triangles);
  wfpg::kept_guide_options options;
  options.max_rays = pixels;
  options.deposit_capacity = pixels;
  options.unguided_samples = 0;
  if (state.range(0) > 0) options.product_resolution = static_cast<std::uint32_t>(state.range(0));
  wfpg::path_guider<Exec> guider(exec, mesh.view(), options);
  const auto points = points_after(exec, 1);
  const wfpg::array_view<const room_point> given(points.view());
  const wfpg::buffer<wfpg::sampled_direction, Exec> directions(exec, pixels);
  const auto kind = static_cast<render::material_kind>(state.range(1));
  const wfpg::wave wave{0u, pixels, stored_surfaces{given, kind}, hashed_numbers{}};
  const auto draw = [&] { guider.sample_directions(wave, room_caster{}, directions.view()); };
  for (int sample = 0; sample < sizes::kept_samples; ++sample) {
    if (sample > 0) guider.end_sample();
    guider.begin_sample();
    exec.for_each(pixels, light_room{guider.guide().cache(), given});
    draw();
  }
  compare(state, exec, draw, copy_of(exec, points.bytes() + directions.bytes()));
  state.counters["slots"] = guider.statistics().kept.live;
}

/// P, the material.
constexpr argument sampled_with[][2] = {{0, static_cast<int>(render::material_kind::lambert)},
                                        {8, static_cast<int>(render::material_kind::plastic)}};

WFPG_BENCH_STAGE(serving_kept, {"P", "material"}, sampled_with);

}  // namespace
}  // namespace bench
