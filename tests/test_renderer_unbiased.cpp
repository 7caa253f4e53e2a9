// Guiding changes the noise of a picture and not its mean: tile means of pt and wfpg agree within their
// standard errors. Pictures are bit-identical on all policies (test_renderer.cpp), so one policy speaks for
// all.
#include "builtin_scenes.hpp"
#include "render.hpp"
#include "support/catch.hpp"
#include "support/statistics.hpp"

#include <wfpg/types.hpp>

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace {

constexpr int tiles = 8;        // along a side
constexpr int tile_pixels = 4;  // along a tile's side
constexpr int renderings = 24;  // independent, of each method

/// What a rendering is of, and how.
struct rendering {
  std::string scene;
  bool nee = true;
  render::sampling_method method = render::sampling_method::wfpg;
  render::fields lifetime = render::fields::kept;
  render::guiding mode = render::guiding::oriented;

  render::render_options options() const {
    render::render_options options;
    options.nee = nee;
    options.method = method;
    options.lifetime = lifetime;
    options.mode = mode;
    options.width = options.height = tiles * tile_pixels;
    options.max_depth = 6;
    options.spp = 12;
    options.octree_resolution = 32;
    options.field_resolution = 8;
    options.slot_resolution = 8;
    options.product_resolution = 4;
    options.recast = 4;
    options.rays_per_bin = 128;
    options.min_bin_level = 2;
    return options;
  }
  std::string name() const {
    return scene + ", next-event estimation " + (nee ? "on" : "off") + ", " +
           (mode == render::guiding::plain ? "plain" : "oriented") + ", " +
           (lifetime == render::fields::kept ? "kept" : "transient") + " fields" +
           (method == render::sampling_method::wfpg_product ? ", products" : "");
  }
};

std::vector<double> tiles_of(const render::image& picture) {
  std::vector<double> result(tiles * tiles, 0.0);
  for (int i = 0; i < picture.width * picture.height; ++i) {
    const int x = i % picture.width / tile_pixels, y = i / picture.width / tile_pixels;
    result[static_cast<std::size_t>(y * tiles + x)] +=
        static_cast<double>(wfpg::luminance(picture.pixels[static_cast<std::size_t>(i)])) /
        (tile_pixels * tile_pixels);
  }
  return result;
}

wfpg_test::tile_means render_tiles(const rendering& what) {
  wfpg_test::tile_means result(tiles * tiles);
  const render::scene world = render::make_builtin_scene(what.scene);
  render::render_options options = what.options();
  for (int i = 0; i < renderings; ++i) {
    options.seed = static_cast<std::uint64_t>(i) + (options.method == render::sampling_method::pt ? 1000 : 0);
    result.add(tiles_of(render::render(world, options, {}).picture));
  }
  return result;
}

/// Of path tracing, made once.
const wfpg_test::tile_means& unguided_tiles(const std::string& scene, bool nee) {
  static std::map<std::pair<std::string, bool>, wfpg_test::tile_means> made;
  const auto found = made.find({scene, nee});
  if (found != made.end()) return found->second;
  const rendering unguided{scene, nee, render::sampling_method::pt};
  return made.emplace(std::make_pair(scene, nee), render_tiles(unguided)).first->second;
}

void check_unbiased(const rendering& what) {
  const auto report = wfpg_test::check_unbiased(unguided_tiles(what.scene, what.nee), render_tiles(what));
  INFO(what.name() << ": " << report.message);
  CHECK(report);
}

using render::fields;
using render::guiding;
constexpr auto wfpg_method = render::sampling_method::wfpg;
constexpr auto product_method = render::sampling_method::wfpg_product;

}  // namespace

TEST_CASE("pictures guided by kept fields have the mean of unguided ones", "[renderer][unbiased]") {
  for (const char* scene : {"cornell-box", "cornell-enclosed", "ajar", "thin-wall", "furnace"})
    for (const bool nee : {false, true}) check_unbiased({scene, nee});
  check_unbiased({"cornell-enclosed", false, wfpg_method, fields::kept, guiding::plain});
  check_unbiased({"thin-wall", true, wfpg_method, fields::kept, guiding::plain});
}

TEST_CASE("pictures guided by transient fields have the mean of unguided ones", "[renderer][unbiased]") {
  for (const bool nee : {false, true}) {
    check_unbiased({"cornell-enclosed", nee, wfpg_method, fields::transient, guiding::oriented});
    check_unbiased({"thin-wall", nee, wfpg_method, fields::transient, guiding::plain});
  }
}

TEST_CASE("pictures guided by products have the mean of unguided ones", "[renderer][unbiased]") {
  for (const char* scene : {"cornell-box", "cornell-enclosed", "ajar", "thin-wall", "glossy-room"})
    for (const bool nee : {false, true}) check_unbiased({scene, nee, product_method});
  for (const bool nee : {false, true}) {
    check_unbiased({"cornell-enclosed", nee, product_method, fields::transient, guiding::oriented});
    check_unbiased({"thin-wall", nee, product_method, fields::transient, guiding::plain});
  }
}

TEST_CASE("a furnace guided by products has its radiance within 0.5%", "[renderer][unbiased]") {
  for (const bool nee : {false, true}) {
    rendering furnace{"furnace", nee, product_method};
    render::render_options options = furnace.options();
    const render::image picture = render::render(render::make_builtin_scene("furnace"), options, {}).picture;
    double mean = 0.0;
    for (const double tile : tiles_of(picture)) mean += tile / (tiles * tiles);
    CHECK(mean == Approx(render::furnace_radiance(options.max_depth)).epsilon(0.005));
  }
}
