// Agreement of means by tiles: a bias is found, and none is reported without one.
#include "support/catch.hpp"
#include "tiles.hpp"

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace {

using seeds_of_tiles = std::vector<std::vector<double>>;

/// Tiles around 1. Both methods of a seed share one noise, and each has its own.
seeds_of_tiles noisy_tiles(std::uint32_t method, std::size_t seeds, std::size_t tiles, double bias) {
  seeds_of_tiles result;
  for (std::size_t seed = 0; seed < seeds; ++seed) {
    std::mt19937 shared(static_cast<std::uint32_t>(seed)),
        own(static_cast<std::uint32_t>(seed) + 1000u * method);
    std::normal_distribution<double> wide(0.0, 0.5), narrow(0.0, 0.1);
    result.emplace_back();
    for (std::size_t tile = 0; tile < tiles; ++tile)
      result.back().push_back(1.0 + bias + wide(shared) + narrow(own));
  }
  return result;
}

}  // namespace

TEST_CASE("tiles at the edges of a picture are smaller", "[quality]") {
  render::image picture = render::make_image(6, 5);
  for (int i = 0; i < 30; ++i)
    picture.pixels[static_cast<std::size_t>(i)] =
        wfpg::vec3(i % 6 < 4 ? 1.0f : 3.0f) * (i / 6 < 4 ? 1.0f : 5.0f);
  const std::vector<double> tiles = quality::tiles_of(picture);
  REQUIRE(tiles.size() == 4);
  const double expected[] = {1.0, 3.0, 5.0, 15.0};
  for (std::size_t i = 0; i < 4; ++i) CHECK(std::fabs(tiles[i] - expected[i]) < 1e-5);
}

TEST_CASE("tiles of one mean have a normally distributed z", "[quality]") {
  const quality::tile_agreement found =
      quality::agreement_of(noisy_tiles(1, 32, 20000, 0.0), noisy_tiles(2, 32, 20000, 0.0));
  CHECK(found.tiles == 20000);
  CHECK(found.beyond_4 <= 6);  // 1.3 are expected
  CHECK(std::fabs(found.mean_square - 1.0) < 4.0 * std::sqrt(2.0 / 20000.0));
}

TEST_CASE("tiles: a bias below the shared noise is found, in one tile and in all", "[quality]") {
  // A standard error is 0.1 sqrt(2 / 32) = 0.025.
  seeds_of_tiles one = noisy_tiles(1, 32, 1000, 0.0);
  for (std::vector<double>& tiles : one) tiles[7] -= 0.25;
  const quality::tile_agreement in_one = quality::agreement_of(one, noisy_tiles(2, 32, 1000, 0.0));
  CHECK(in_one.beyond_4 >= 1);
  CHECK(in_one.worst < -4.0);
  const quality::tile_agreement in_all =
      quality::agreement_of(noisy_tiles(1, 32, 1000, 0.02), noisy_tiles(2, 32, 1000, 0.0));
  CHECK(in_all.mean_square > 1.0 + 4.0 * std::sqrt(2.0 / 1000.0));
}

TEST_CASE("tiles without noise: rounding is ignored, a difference is certain", "[quality]") {
  const seeds_of_tiles truth(20, {1.0, 2.0, 0.0, 4.0}), rounded(20, {1.000001, 2.0, 0.0, 4.1});
  const quality::tile_agreement found = quality::agreement_of(rounded, truth);
  CHECK(found.tiles == 1);
  CHECK(found.beyond_4 == 1);
  CHECK(found.worst > 100.0);
}
