// How lights are chosen: the alias table's probabilities, and what the lights of a scene are drawn with.
#include "alias_table.hpp"
#include "lights.hpp"
#include "rng.hpp"
#include "support/catch.hpp"

#include <wfpg/exec/seq.hpp>

#include <cmath>
#include <numeric>
#include <vector>

namespace {

using namespace render;

/// What pick() gives each element.
std::vector<double> probabilities(const std::vector<alias_column>& table) {
  std::vector<double> result(table.size(), 0.0);
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double own = static_cast<double>(table[i].probability);
    result[i] += own / static_cast<double>(table.size());
    result.at(table[i].other) += (1.0 - own) / static_cast<double>(table.size());
  }
  return result;
}

double total(const std::vector<double>& weights) {
  return std::accumulate(weights.begin(), weights.end(), 0.0);
}

vec2 numbers(std::uint32_t i, std::uint32_t use) {
  return random_stream{11, 0}(i, use);
}

}  // namespace

TEST_CASE("an alias table's probabilities are the weights", "[renderer][lights]") {
  // Sums and shares of these are exact.
  for (const std::vector<double>& weights : {std::vector<double>{1},
                                             {1, 1},
                                             {3, 1},
                                             {1, 2, 3, 2},
                                             {0, 4, 0, 0},
                                             {5, 1, 1, 1, 0, 0, 0, 0},
                                             {1, 1, 1, 13}})
    for (std::size_t i = 0; i < weights.size(); ++i)
      CHECK(probabilities(make_alias_table(weights))[i] == weights[i] / total(weights));
  // Others round to a float's share of a column.
  for (const std::size_t count : {3u, 1000u, 100000u}) {
    std::vector<double> weights;
    for (std::uint32_t i = 0; i < count; ++i)
      weights.push_back(std::pow(static_cast<double>(numbers(i, 0).x), 8.0));
    const std::vector<double> found = probabilities(make_alias_table(weights));
    double worst = 0.0;
    for (std::size_t i = 0; i < count; ++i)
      worst = std::max(worst, std::abs(found[i] - weights[i] / total(weights)));
    CHECK(worst * static_cast<double>(count) < 1e-3);
    CHECK(total(found) == Approx(1.0).epsilon(1e-12));
  }
}

TEST_CASE("picks are as frequent as the weights say", "[renderer][lights]") {
  const std::vector<double> weights{1, 0, 7, 2, 0.5};
  const std::vector<alias_column> table = make_alias_table(weights);
  std::vector<double> counts(weights.size(), 0.0);
  constexpr std::uint32_t draws = 200000;
  for (std::uint32_t i = 0; i < draws; ++i) counts[pick({table.data(), table.size()}, numbers(i, 1))] += 1.0;
  for (std::size_t i = 0; i < weights.size(); ++i)
    CHECK(counts[i] / draws == Approx(weights[i] / total(weights)).margin(0.005));
  CHECK(counts[1] == 0.0);
  CHECK(pick({table.data(), table.size()}, {0x1.fffffep-1f, 0x1.fffffep-1f}) < weights.size());
}

TEST_CASE("emitters are drawn by power, and their density by area is their radiance's",
          "[renderer][lights]") {
  scene s;
  s.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {3, 0, 0}, {0, 3, 0}};
  s.triangles = {{0, 1, 2}, {0, 3, 4}, {0, 1, 4}};
  s.triangle_materials = {0, 1, 2};
  s.materials.resize(3);
  s.materials[0].emission = vec3(2.0f);
  s.materials[1].emission = vec3(0.5f);
  const wfpg::exec::seq exec;
  const device_scene<wfpg::exec::seq> geometry(exec, s);
  const light_distribution<wfpg::exec::seq> lights(exec, s);
  const double power = 2.0 * 0.5 + 0.5 * 4.5;
  constexpr std::uint32_t draws = 100000;
  double bright = 0.0;
  for (std::uint32_t i = 0; i < draws; ++i) {
    const std::uint32_t light = pick(lights.view().table, numbers(i, 2));
    const emitter_point drawn = lights.view().sample_emitter(geometry.view(), light, numbers(i, 3));
    REQUIRE(drawn.pdf == Approx(static_cast<double>(drawn.radiance.x) / power));
    bright += drawn.radiance == vec3(2.0f) ? 1.0 : 0.0;
  }
  CHECK(bright / draws == Approx(1.0 / power).margin(0.006));
}

TEST_CASE("an environment map is sampled by luminance", "[renderer][lights]") {
  scene s;
  s.sky = {8, 4, std::vector<vec3>(32, vec3(0.0f))};
  for (std::uint32_t i = 0; i < 32; ++i) s.sky.texels[i] = vec3(0.05f + numbers(i, 4).x * numbers(i, 4).x);
  const wfpg::exec::seq exec;
  const device_scene<wfpg::exec::seq> geometry(exec, s);
  const environment_view sky = geometry.view().environment;
  // The density of a uniform direction averages to 1 over the sphere; a sample's inverse to the sphere's
  // area.
  double integral = 0.0, area = 0.0;
  constexpr std::uint32_t draws = 200000;
  for (std::uint32_t i = 0; i < draws; ++i) {
    const vec2 u = numbers(i, 5);
    const float y = 1.0f - 2.0f * u.x, r = std::sqrt(std::max(0.0f, 1.0f - y * y));
    integral +=
        static_cast<double>(sky.pdf({r * std::cos(2.0f * pi * u.y), y, r * std::sin(2.0f * pi * u.y)}));
    const vec3 drawn = sky.sample(numbers(i, 6), numbers(i, 7));
    REQUIRE(glm::length(drawn) == Approx(1.0f).epsilon(1e-4));
    REQUIRE(sky.pdf(drawn) > 0.0f);
    area += 1.0 / static_cast<double>(sky.pdf(drawn));
  }
  CHECK(integral / draws * 4.0 * static_cast<double>(pi) == Approx(1.0).epsilon(0.02));
  CHECK(area / draws == Approx(4.0 * static_cast<double>(pi)).epsilon(0.05));
  // The middle is -z, its right +x, the upper edge +y.
  s.sky = {4, 2, std::vector<vec3>(8, vec3(0.0f))};
  s.sky.texels[2] = vec3(1.0f);
  const device_scene<wfpg::exec::seq> corner(exec, s);
  CHECK(corner.view().environment.radiance(glm::normalize(vec3(1.0f, 1.414f, -1.0f))).x ==
        Approx(1.0).epsilon(0.01));
}
