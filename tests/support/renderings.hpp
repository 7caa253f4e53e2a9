// Small renderings of the built-in scenes, and the means of their tiles over independent seeds.
#pragma once

#include "builtin_scenes.hpp"
#include "option_names.hpp"
#include "render.hpp"
#include "support/catch.hpp"
#include "support/statistics.hpp"

#include <wfpg/types.hpp>

#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

namespace wfpg_test {

inline constexpr int tiles = 8;        // along a side
inline constexpr int tile_pixels = 4;  // along a tile's side
inline constexpr int renderings = 24;  // independent, of each method

/// What a rendering is of, and how.
struct rendering {
  std::string scene;
  bool nee = true;
  render::sampling_method method = render::sampling_method::wfpg;
  render::fields lifetime = render::fields::kept;
  render::guiding mode = render::guiding::oriented;
  render::device where = render::device::cpu;
  wfpg::sarsa_update update = wfpg::sarsa_update::sarsa;
  wfpg::sarsa_sampler sampler = wfpg::sarsa_sampler::mixed_rejection;
  render::cones through = render::cones::scene;
  bool settled = false;  ///< so long that in its second half fewer waves make fields and fewer samples teach

  render::render_options options() const {
    render::render_options options;
    options.nee = nee;
    options.method = method;
    options.lifetime = lifetime;
    options.mode = mode;
    options.through = through;
    options.where = where;
    options.width = options.height = tiles * tile_pixels;
    options.max_depth = 6;
    options.spp = settled ? 64 : 12;
    options.octree_resolution = 32;
    if (settled) {  // leaves, and values, that want no more than a part of the paths
      options.octree_resolution = 16;
      options.deposits_per_leaf = 1;
      options.sarsa.values_per_direction = 1;
    }
    options.field_resolution = 8;
    options.slot_resolution = 8;
    options.product_resolution = 4;
    options.recast = 4;
    options.rays_per_bin = 128;
    options.min_bin_level = 2;
    options.samples_per_leaf = 500;
    options.sarsa.update = update;
    options.sarsa.sampler = sampler;
    options.sarsa.resolution = 4;
    options.sarsa.direction_resolution = 8;
    options.sarsa.step = 2;
    options.records.octree_resolution = 32;
    options.records.record_level = 3;
    options.records.emitter_rays = 1 << 14;
    // What quadtrees have learnt of so little leaves tails of noise that a t-test does not expect.
    if (method == render::sampling_method::openpgl_dqt) options.guide_fraction = 0.3f;
    return options;
  }
  std::string name() const {
    const std::string view = scene + (where == render::device::cuda ? " on cuda" : "") + ", " +
                             (settled ? "settled, " : "") + "next-event estimation " + (nee ? "on" : "off") +
                             ", ";
    if (method == render::sampling_method::sarsa)
      return view + "SARSA grid, update " + render::name_of(render::sarsa_update_names(), update) +
             ", sampler " + render::name_of(render::sarsa_sampler_names(), sampler);
    if (method == render::sampling_method::records) return view + "irradiance records";
    return view + (mode == render::guiding::plain ? "plain" : "oriented") + ", " +
           (lifetime == render::fields::kept ? "kept" : "transient") + " fields" +
           (through == render::cones::scene ? ""
                                            : ", cones " + render::name_of(render::cones_names(), through)) +
           (method == render::sampling_method::wfpg_product ? ", products" : "") +
           (method == render::sampling_method::openpgl_vmm ? ", Open PGL's mixtures" : "") +
           (method == render::sampling_method::openpgl_dqt ? ", Open PGL's quadtrees" : "");
  }
};

inline std::vector<double> tiles_of(const render::image& picture) {
  std::vector<double> result(tiles * tiles, 0.0);
  for (int i = 0; i < picture.width * picture.height; ++i) {
    const int x = i % picture.width / tile_pixels, y = i / picture.width / tile_pixels;
    result[static_cast<std::size_t>(y * tiles + x)] +=
        static_cast<double>(wfpg::luminance(picture.pixels[static_cast<std::size_t>(i)])) /
        (tile_pixels * tile_pixels);
  }
  return result;
}

/// The first `factor` * `renderings` seeds from `first_seed` on: those of other seeds are independent.
inline tile_means render_tiles(const rendering& what, std::uint64_t first_seed, int factor) {
  tile_means result(tiles * tiles);
  const render::scene world = render::make_builtin_scene(what.scene);
  render::render_options options = what.options();
  for (int i = 0; i < factor * renderings; ++i) {
    options.seed = first_seed + static_cast<std::uint64_t>(i);
    result.add(tiles_of(render::render(world, options, {}).picture));
  }
  return result;
}

/// Of path tracing on the CPU, made once.
inline const tile_means& unguided_tiles(const std::string& scene, bool nee, int factor) {
  static std::map<std::tuple<std::string, bool, int>, tile_means> made;
  const auto found = made.find({scene, nee, factor});
  if (found != made.end()) return found->second;
  const rendering unguided{scene, nee, render::sampling_method::pt};
  const auto first_seed = static_cast<std::uint64_t>(1000 * factor);
  return made.emplace(std::make_tuple(scene, nee, factor), render_tiles(unguided, first_seed, factor))
      .first->second;
}

/// Checks that the mean of what is rendered is path tracing's on the CPU.
inline void check_rendering(const rendering& what) {
  const wfpg::testing::check_report report = check_renderers_unbiased(
      [&](int factor) { return unguided_tiles(what.scene, what.nee, factor); },
      [&](int factor) { return render_tiles(what, static_cast<std::uint64_t>(500 * (factor - 1)), factor); });
  INFO(what.name() << ": " << report.message);
  CHECK(report);
}

}  // namespace wfpg_test
