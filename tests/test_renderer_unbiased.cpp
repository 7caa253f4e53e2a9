// Guiding changes the noise of a picture and not its mean: tile means of pt and wfpg agree within their
// standard errors. Pictures are bit-identical on all policies (test_renderer.cpp), so one policy speaks for
// all.
#include "builtin_scenes.hpp"
#include "render.hpp"
#include "support/catch.hpp"

#include <wfpg/types.hpp>

#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace {

constexpr int tiles = 8;        // along a side
constexpr int tile_pixels = 4;  // along a tile's side
constexpr int renderings = 24;  // independent, of each method

struct tile_estimate {
  double sum = 0.0, sum_of_squares = 0.0;

  void add(double value) {
    sum += value;
    sum_of_squares += value * value;
  }
  double mean() const { return sum / renderings; }
  double variance_of_mean() const {
    return (sum_of_squares / renderings - mean() * mean()) / (renderings - 1);
  }
};

std::vector<tile_estimate> estimate_tiles(const std::string& scene, render::render_options options) {
  options.width = options.height = tiles * tile_pixels;
  options.max_depth = 6;
  options.spp = 12;
  options.octree_resolution = 32;
  options.field_resolution = 8;
  options.slot_resolution = 8;
  options.recast = 4;
  options.rays_per_bin = 128;
  options.min_bin_level = 2;
  std::vector<tile_estimate> result(tiles * tiles);
  const render::scene world = render::make_builtin_scene(scene);
  for (int i = 0; i < renderings; ++i) {
    options.seed = static_cast<std::uint64_t>(i) + (options.method == render::sampling_method::pt ? 1000 : 0);
    const render::image picture = render::render(world, options, {}).picture;
    for (int tile = 0; tile < tiles * tiles; ++tile) {
      double sum = 0.0;
      for (int p = 0; p < tile_pixels * tile_pixels; ++p) {
        const int x = tile % tiles * tile_pixels + p % tile_pixels;
        const int y = tile / tiles * tile_pixels + p / tile_pixels;
        sum += static_cast<double>(
            wfpg::luminance(picture.pixels[static_cast<std::size_t>(y * picture.width + x)]));
      }
      result[static_cast<std::size_t>(tile)].add(sum / (tile_pixels * tile_pixels));
    }
  }
  return result;
}

/// Of path tracing, made once.
const std::vector<tile_estimate>& unguided_tiles(const std::string& scene, bool nee) {
  static std::map<std::pair<std::string, bool>, std::vector<tile_estimate>> made;
  std::vector<tile_estimate>& tiles_of_scene = made[{scene, nee}];
  if (!tiles_of_scene.empty()) return tiles_of_scene;
  render::render_options options;
  options.nee = nee;
  options.method = render::sampling_method::pt;
  return tiles_of_scene = estimate_tiles(scene, options);
}

// Student's t of 24 + 24 renderings exceeds 4 in 0.02% of tiles; 99.9% of them must stay below.
void check_unbiased(const std::string& scene, bool nee, render::fields lifetime, render::guiding mode) {
  INFO(scene << ", next-event estimation " << (nee ? "on" : "off") << ", "
             << (mode == render::guiding::plain ? "plain" : "oriented") << ", "
             << (lifetime == render::fields::kept ? "kept" : "transient") << " fields");
  render::render_options options;
  options.nee = nee;
  options.mode = mode;
  options.lifetime = lifetime;
  options.method = render::sampling_method::wfpg;
  const auto& unguided = unguided_tiles(scene, nee);
  const auto guided = estimate_tiles(scene, options);
  int beyond = 0;
  double sum_of_squares = 0.0, count = 0.0;
  for (std::size_t tile = 0; tile < unguided.size(); ++tile) {
    const double variance = unguided[tile].variance_of_mean() + guided[tile].variance_of_mean();
    const double difference = guided[tile].mean() - unguided[tile].mean();
    if (variance == 0.0) {
      CHECK(difference == 0.0);
      continue;
    }
    const double z = difference / std::sqrt(variance);
    INFO("tile " << tile << ": pt " << unguided[tile].mean() << ", wfpg " << guided[tile].mean() << ", z "
                 << z);
    CHECK(std::fabs(z) < 6.0);
    sum_of_squares += z * z;
    beyond += std::fabs(z) >= 4.0 ? 1 : 0;
    count += 1.0;
  }
  CHECK(beyond <= 0.001 * count);
  // A bias too small for one tile shows in all of them together: the mean of z² is 1 within four standard
  // errors.
  CHECK(sum_of_squares / count < 1.0 + 4.0 * std::sqrt(2.0 / count));
}

}  // namespace

TEST_CASE("pictures guided by kept fields have the mean of unguided ones", "[renderer][unbiased]") {
  using render::fields;
  using render::guiding;
  for (const char* scene : {"cornell-box", "cornell-enclosed", "ajar", "thin-wall", "furnace"})
    for (const bool nee : {false, true}) check_unbiased(scene, nee, fields::kept, guiding::oriented);
  check_unbiased("cornell-enclosed", false, fields::kept, guiding::plain);
  check_unbiased("thin-wall", true, fields::kept, guiding::plain);
}

TEST_CASE("pictures guided by transient fields have the mean of unguided ones", "[renderer][unbiased]") {
  using render::fields;
  using render::guiding;
  for (const bool nee : {false, true}) {
    check_unbiased("cornell-enclosed", nee, fields::transient, guiding::oriented);
    check_unbiased("thin-wall", nee, fields::transient, guiding::plain);
  }
}
