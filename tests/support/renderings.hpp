// Small renderings of the built-in scenes, and the means of their tiles over independent seeds.
#pragma once

#include "app/option_names.hpp"
#include "app/render.hpp"
#include "support/bright_room.hpp"
#include "support/catch.hpp"
#include "support/statistics.hpp"

#include <wfpg/base/types.hpp>

#include <cstddef>
#include <cstdint>
#include <future>
#include <map>
#include <string>
#include <tuple>
#include <vector>

namespace wfpg_test {

inline constexpr int tiles = 8;        // along a side
inline constexpr int tile_pixels = 4;  // along a tile's side
inline constexpr int renderings = 24;  // independent ones, by default for each method

/// A rendering's scene and options.
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
  bool warmed_up = false;  ///< after warm-up: fewer waves make fields and fewer samples are recorded
  bool precise = false;    ///< more samples, see check_precisely()
  render::technique_set techniques = {};  ///< of bpt

  /// The number of independent renderings. Long ones have little noise and need fewer.
  int count() const { return precise && warmed_up ? renderings * 2 / 3 : renderings; }
  /// Samples a pixel of one rendering. Precise ones have as many as a method's noise takes.
  int samples() const {
    using render::sampling_method;
    if (method == sampling_method::pt) {  // rendered once for all checks
      // Few paths find light in cornell-enclosed, so means of few samples are not nearly normal.
      if (!precise) return scene == "cornell-enclosed" ? 96 : 12;
      return nee ? 128 : 192;
    }
    if (warmed_up) return 64;
    if (!precise) return 12;
    if (method == sampling_method::bpt) return 48;
    if (method == sampling_method::records) return nee ? 64 : 48;
    const bool noisy = !nee || method == sampling_method::sarsa, kept = lifetime == render::fields::kept;
    const int oriented = noisy ? 32 : kept ? 16 : 24;
    return mode == render::guiding::plain ? 2 * oriented : oriented;
  }

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
    options.spp = samples();
    options.octree_resolution = 32;
    if (warmed_up) {  // so few leaves and values need only a fraction of the paths
      options.octree_resolution = 16;
      options.deposits_per_leaf = 1;
      options.sarsa.values_per_direction = 1;
    }
    options.field_resolution = 8;
    options.kept.resolution = 8;
    options.product_resolution = 4;
    options.kept.recast = 4;
    options.binning.rays_per_bin = 128;
    options.binning.min_level = 2;
    options.samples_per_leaf = 500;
    options.least_gain = 0.0f;  // guided samples are what is tested
    options.sarsa.update = update;
    options.sarsa.sampler = sampler;
    options.sarsa.resolution = 4;
    options.sarsa.direction_resolution = 8;
    options.sarsa.step = 2;
    options.records.octree_resolution = 32;
    options.records.record_level = 3;
    options.records.emitter_rays = 1 << 14;
    options.techniques = techniques;
    // Quadtrees with so little data have tails of noise that break a t-test.
    if (method == render::sampling_method::openpgl_dqt) options.guide_fraction = 0.3f;
    return options;
  }
  std::string name() const {
    const std::string view = scene + (where == render::device::cuda ? " on cuda" : "") + ", " +
                             (warmed_up ? "warmed up, " : "") + "next-event estimation " +
                             (nee ? "on" : "off") + ", ";
    if (method == render::sampling_method::sarsa)
      return view + "SARSA grid, update " + render::name_of(render::sarsa_update_names(), update) +
             ", sampler " + render::name_of(render::sarsa_sampler_names(), sampler);
    if (method == render::sampling_method::records) return view + "irradiance records";
    if (method == render::sampling_method::vcm) return view + "merging";
    if (method == render::sampling_method::lt) return view + "light tracing";
    if (method == render::sampling_method::bpt) return view + "techniques " + render::names_of(techniques);
    return view + (mode == render::guiding::plain ? "plain" : "oriented") + ", " +
           (lifetime == render::fields::kept ? "kept" : "transient") + " fields" +
           (through == render::cones::scene ? ""
                                            : ", cones " + render::name_of(render::cones_names(), through)) +
           (method == render::sampling_method::wfpg_product ? ", products" : "") +
           (method == render::sampling_method::openpgl_vmm ? ", Open PGL's mixtures" : "") +
           (method == render::sampling_method::openpgl_dqt ? ", Open PGL's quadtrees" : "");
  }
};

/// The tiles of a square picture, whose side is a multiple of `tiles`.
inline std::vector<double> tiles_of(const render::image& picture) {
  std::vector<double> result(tiles * tiles, 0.0);
  const int side = picture.width / tiles;
  for (int i = 0; i < picture.width * picture.height; ++i) {
    const int x = i % picture.width / side, y = i / picture.width / side;
    result[static_cast<std::size_t>(y * tiles + x)] +=
        static_cast<double>(wfpg::luminance(picture.pixels[static_cast<std::size_t>(i)])) / (side * side);
  }
  return result;
}

/// Tiles of renderings with `count` seeds from `first_seed` on. Other seeds are independent. Such small waves
/// keep one core busy, so two pictures are rendered at once, each by one thread.
inline tile_means render_tiles(const render::render_options& options, const std::string& scene,
                               std::uint64_t first_seed, int count) {
  const render::scene world = make_test_scene(scene);
  std::vector<std::vector<double>> pictures(static_cast<std::size_t>(count));
  const bool alone = options.where != render::device::cpu || render::is_openpgl(options.method);
  const std::size_t at_once = alone ? 1 : 2;
  const auto render_from = [&](std::size_t first) {
    render::render_options own = options;
    if (!alone) own.where = render::device::seq;
    for (std::size_t i = first; i < pictures.size(); i += at_once) {
      own.seed = first_seed + i;
      pictures[i] = tiles_of(render::render(world, own, {}).picture);
    }
  };
  std::vector<std::future<void>> others;
  for (std::size_t i = 1; i < at_once; ++i) others.push_back(std::async(std::launch::async, render_from, i));
  render_from(0);
  for (std::future<void>& other : others) other.get();
  tile_means result(tiles * tiles);
  for (const std::vector<double>& picture : pictures) result.add(picture);
  return result;
}

/// Tiles of path tracing on the CPU, rendered once. `max_depth` 2: only direct light; 0: all light.
inline const tile_means& unguided_tiles(const rendering& like, int factor, int max_depth = 0) {
  static std::map<std::tuple<std::string, bool, bool, int, int>, tile_means> made;
  const auto key = std::make_tuple(like.scene, like.nee, like.precise, factor, max_depth);
  const auto found = made.find(key);
  if (found != made.end()) return found->second;
  rendering unguided{like.scene, like.nee, render::sampling_method::pt};
  unguided.precise = like.precise;
  render::render_options options = unguided.options();
  if (max_depth > 0) {
    options.max_depth = max_depth;
    options.spp /= 8;  // such light has little noise
  }
  const auto first_seed = static_cast<std::uint64_t>(1000 * factor);
  return made.emplace(key, render_tiles(options, like.scene, first_seed, factor * renderings)).first->second;
}

/// Checks that a rendering has the mean of path tracing on the CPU. Returns its tiles.
inline tile_means check_rendering(const rendering& what) {
  const auto render = [&](int factor) {
    const auto first_seed = static_cast<std::uint64_t>(500 * (factor - 1));
    return render_tiles(what.options(), what.scene, first_seed, factor * what.count());
  };
  const tile_means once = render(1);
  const wfpg::testing::check_report report =
      check_renderers_unbiased([&](int factor) { return unguided_tiles(what, factor); },
                               [&](int factor) { return factor == 1 ? once : render(factor); });
  INFO(what.name() << ": " << report.message);
  CHECK(report);
  return once;
}

/// Checks a rendering of the bright room that would show a bias of 1% in indirect light with probability
/// 0.99. The standard error must be that small, and the check must reject a planted bias.
inline void check_precisely(rendering what) {
  what.scene = "bright-room";
  what.precise = true;
  const tile_means tested = check_rendering(what);
  const tile_means& truth = unguided_tiles(what, 1);
  const tile_means& direct = unguided_tiles(what, 1, 2);
  std::vector<double> direct_light;
  for (std::size_t i = 0; i < direct.size(); ++i) direct_light.push_back(direct.mean(i));
  INFO(what.name());
  CHECK(found_bias(truth, tested) <= 0.01 * (truth.picture_mean() - direct.picture_mean()));
  CHECK_FALSE(check_unbiased(truth, tested.scaled_beyond(direct_light, 1.01)));
}

}  // namespace wfpg_test
