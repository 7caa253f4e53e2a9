// Choices of lights: the alias table's probabilities, and the sampling of a scene's lights.
#include "app/render.hpp"
#include "lights/lights.hpp"
#include "scene/alias_table.hpp"
#include "scene/builtin_scenes.hpp"
#include "support/catch.hpp"
#include "support/policies.hpp"
#include "tracer/path_kernels.hpp"
#include "tracer/rng.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace render;
using wfpg_test::one_policy;

/// The probability of each element in pick().
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

TEST_CASE("an alias table's probabilities are proportional to the weights", "[renderer][lights]") {
  // Sums and fractions of these weights are exact.
  for (const std::vector<double>& weights : {std::vector<double>{1},
                                             {1, 1},
                                             {3, 1},
                                             {1, 2, 3, 2},
                                             {0, 4, 0, 0},
                                             {5, 1, 1, 1, 0, 0, 0, 0},
                                             {1, 1, 1, 13}})
    for (std::size_t i = 0; i < weights.size(); ++i)
      CHECK(probabilities(make_alias_table(weights))[i] == weights[i] / total(weights));
  // Others round to a float's fraction of a column.
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

TEST_CASE("picks have the frequencies of their weights", "[renderer][lights]") {
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

TEST_CASE("emitters are sampled by power, and the density by area matches their radiance",
          "[renderer][lights]") {
  scene s;
  s.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {3, 0, 0}, {0, 3, 0}};
  s.triangles = {{0, 1, 2}, {0, 3, 4}, {0, 1, 4}};
  s.triangle_materials = {0, 1, 2};
  s.materials.resize(3);
  s.materials[0].emission = vec3(2.0f);
  s.materials[1].emission = vec3(0.5f);
  const one_policy exec;
  const device_scene<one_policy> geometry(exec, s);
  const light_distribution<one_policy> lights(exec, s);
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
  const one_policy exec;
  const device_scene<one_policy> geometry(exec, s);
  const environment_view sky = geometry.view().environment;
  // The mean density of uniform directions is 1 over the sphere's area. The mean inverse density of samples
  // is that area.
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
  // The centre is -z, its right +x, the upper edge +y.
  s.sky = {4, 2, std::vector<vec3>(8, vec3(0.0f))};
  s.sky.texels[2] = vec3(1.0f);
  const device_scene<one_policy> corner(exec, s);
  CHECK(corner.view().environment.radiance(glm::normalize(vec3(1.0f, 1.414f, -1.0f))).x ==
        Approx(1.0).epsilon(0.01));
}

namespace {

/// Squares of side 0.1 in a row along x, a unit apart. Every other one faces +z, the others -z. The floor
/// does not emit; its radius is about half the row's length.
scene row_of_lamps(int count) {
  scene s;
  s.materials.resize(2);
  s.materials[1].emission = vec3(1.0f);
  const auto square = [&](vec3 corner, vec2 size, bool flipped, std::uint32_t material) {
    const auto first = static_cast<std::uint32_t>(s.positions.size());
    const vec3 u(size.x, 0.0f, 0.0f), v(0.0f, size.y, 0.0f);
    for (const vec3& p : {corner, corner + u, corner + u + v, corner + v}) s.positions.push_back(p);
    for (const uvec3& t : {uvec3(0, 1, 2), uvec3(0, 2, 3)}) {
      s.triangles.push_back(flipped ? uvec3(first) + uvec3(t.x, t.z, t.y) : uvec3(first) + t);
      s.triangle_materials.push_back(material);
    }
  };
  square({0.0f, 0.0f, -1.0f}, {static_cast<float>(count), 1.0f}, false, 0);
  for (int i = 0; i < count; ++i) square({static_cast<float>(i), 0.0f, 0.0f}, vec2(0.1f), i % 2 == 1, 1);
  return s;
}

double sum_of_shares(const grouped_lights& grouped) {
  double sum = 0.0;
  for (const light_group& group : grouped.groups) sum += static_cast<double>(group.share);
  return sum;
}

}  // namespace

TEST_CASE("every light is in one group, which has the sum of their power", "[renderer][lights]") {
  scene s = row_of_lamps(6);
  punctual_light bulb;
  bulb.position = {0.5f, 0.5f, 3.0f};
  s.punctual_lights = {bulb};
  s.sky = {2, 1, {vec3(0.5f), vec3(0.5f)}};
  for (const std::uint32_t most : {1u, 2u, 3u, 5u, 8u, 255u}) {
    const grouped_lights grouped = group_lights(s, most);
    INFO("at most " << most);
    CHECK(grouped.groups.size() == (most == 1 ? 1u : std::min(most, 7u) + 1u));  // the sky has its own group
    CHECK(grouped.lights.size() == 6 * 2 + 2);
    CHECK(sum_of_shares(grouped) == Approx(1.0));
    std::vector<std::uint32_t> seen = grouped.lights;
    std::sort(seen.begin(), seen.end());
    CHECK(std::adjacent_find(seen.begin(), seen.end()) == seen.end());
    std::uint32_t next = 0;
    for (std::size_t g = 0; g < grouped.groups.size(); ++g) {
      const light_group group = grouped.groups[g];
      CHECK(group.first == next);
      next += group.count;
      double power = 0.0;
      for (std::uint32_t i = group.first; i < next; ++i) {
        power += grouped.powers[i];
        if (grouped.groups.size() > 1 && !(grouped.lights[i] & grouped_lights::beyond_triangles))
          CHECK(grouped.triangle_groups[grouped.lights[i]] == g);
      }
      CHECK(static_cast<double>(group.share) == Approx(power / grouped.total_power));
    }
    CHECK(next == grouped.lights.size());
    // The environment is the last light.
    CHECK(grouped.lights.back() == (grouped_lights::beyond_triangles | 1u));
  }
}

TEST_CASE("a flat emitter is one light, and lights near each other share a group", "[renderer][lights]") {
  CHECK(group_lights(row_of_lamps(1), 32).groups.size() == 1);
  CHECK(group_lights(row_of_lamps(1), 32).triangle_groups.empty());
  // Two lamps of a thousand, a unit apart in a scene of width a thousand.
  CHECK(group_lights(row_of_lamps(1000), 255).groups.size() < 100);
  CHECK(group_lights(row_of_lamps(6), 32).groups.size() == 6);
  CHECK(group_lights(scene(), 32).groups.empty());
  // Front and back of a thin lamp are two lights.
  scene both = row_of_lamps(2);
  for (std::size_t i = 8; i < 12; ++i) both.positions[i].x -= 1.0f;
  CHECK(group_lights(both, 32).groups.size() == 2);
}

TEST_CASE("choices of groups change the lights' densities, not their radiance", "[renderer][lights]") {
  scene s = row_of_lamps(5);
  for (std::uint32_t lamp = 0; lamp < 5; ++lamp) {  // of radiance 1, 4, 16, 64, 256
    s.materials.push_back(s.materials[1]);
    s.materials.back().emission = vec3(std::pow(4.0f, static_cast<float>(lamp)));
    for (const std::size_t half : {2, 3}) s.triangle_materials[2 * lamp + half] = 2 + lamp;
  }
  const one_policy exec;
  const device_scene<one_policy> geometry(exec, s);
  const light_distribution<one_policy> whole(exec, s), parts(exec, s, 32);
  REQUIRE(parts.shares().size() == 5);
  const vec3 from(2.0f, 0.3f, 1.0f);
  const auto irradiance = [&](const light_distribution<one_policy>& lights, const auto& choose) {
    double sum = 0.0;
    constexpr std::uint32_t draws = 200000;
    for (std::uint32_t i = 0; i < draws; ++i) {
      const auto draw = [&](std::uint32_t use) { return numbers(i, use); };
      const path_lights::chosen_light chosen = choose(i, draw);
      const light_sample light = lights.view().sample(geometry.view(), from, chosen.light, draw);
      if (light.pdf > 0.0f) sum += static_cast<double>(light.radiance.x / (light.pdf * chosen.preference));
    }
    return sum / draws;
  };
  const auto by_power = [&](const light_distribution<one_policy>& lights) {
    const path_lights without_guide{geometry.view(), lights.view()};
    return irradiance(
        lights, [&](std::uint32_t, const auto& draw) { return without_guide.choose(path_vertex{}, draw); });
  };
  const double expected = by_power(whole);
  // Probabilities unlike the groups' brightness.
  const float probabilities[] = {0.4f, 0.3f, 0.05f, 0.05f, 0.2f};
  const double found = irradiance(parts, [&](std::uint32_t i, const auto& draw) {
    float u = numbers(i, 20).x;
    std::uint32_t group = 0;
    while (u >= probabilities[group] && group < 4) u -= probabilities[group++];
    return path_lights::chosen_light{parts.view().pick_in(group, draw(dimension::light_choice)),
                                     probabilities[group] / parts.shares()[group]};
  });
  CHECK(found == Approx(expected).epsilon(0.02));
  // In a sample without a guide, lights are chosen by power, whatever their groups.
  CHECK(by_power(parts) == Approx(expected).epsilon(0.02));
}

namespace {

/// The renderer's error for a scene.
std::string error_of(const scene& s) {
  try {
    render_options options;
    options.method = sampling_method::pt;
    options.spp = 1;
    render::render(s, options, {});
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing was thrown";
}

/// A lamp, an open side with a sky, and a point light.
scene scene_of_lights(float radiance) {
  scene s = make_builtin_scene("cornell-box");
  for (material& m : s.materials)
    if (m.emission != vec3(0.0f)) m.emission = vec3(radiance);
  punctual_light bulb;
  bulb.position = {0.3f, 1.2f, 0.5f};
  bulb.intensity = vec3(radiance);
  s.punctual_lights = {bulb};
  s.sky = {4, 2, std::vector<vec3>(8, vec3(radiance))};
  s.width = s.height = 16;
  return s;
}

}  // namespace

TEST_CASE("lights too bright for sums of floats are refused by name", "[renderer][lights]") {
  scene s = row_of_lamps(1);
  s.materials[1].emission.y = 3e38f;
  CHECK(error_of(s) == "wfpg: the emission of scene.materials, element 1 is 3e+38, expected in [0, 1e+15]");
  s = row_of_lamps(1);
  s.sky = {2, 1, {vec3(1.0f), vec3(0.0f, 0.0f, 3e38f)}};
  CHECK(error_of(s) == "wfpg: scene.sky, texel 1 is 3e+38, expected in [0, 1e+15]");
  s = row_of_lamps(1);
  s.environment.x = std::numeric_limits<float>::quiet_NaN();
  CHECK(error_of(s) == "wfpg: scene.environment is nan, expected in [0, 1e+15]");
  s.environment.x = -1.0f;
  CHECK(error_of(s) == "wfpg: scene.environment is -1, expected in [0, 1e+15]");
  s = row_of_lamps(1);
  s.punctual_lights.resize(3);
  s.punctual_lights[2].intensity.z = 1e16f;
  CHECK(error_of(s) ==
        "wfpg: the intensity of scene.punctual_lights, element 2 is 1e+16, expected in [0, 1e+15]");
  // Each light is valid, but their sum is not: the area is 1e16.
  s = row_of_lamps(1);
  s.materials[1].emission = vec3(largest_radiance);
  for (vec3& p : s.positions) p *= 1e9f;
  CHECK(error_of(s) ==
        "wfpg: the sum of radiance times area over all lights is 1e+31, expected at most 1e+30");
}

TEST_CASE("the brightest accepted lights give finite pictures", "[renderer][lights]") {
  const scene bright = scene_of_lights(largest_radiance), plain = scene_of_lights(1.0f);
  for (const sampling_method method : {sampling_method::pt, sampling_method::wfpg}) {
    render_options options;
    options.method = method;
    options.spp = 8;
    options.octree_resolution = 16;
    const image found = render::render(bright, options, {}).picture;
    const image expected = render::render(plain, options, {}).picture;
    double sum = 0.0, expected_sum = 0.0;
    std::size_t not_finite = 0;
    for (std::size_t i = 0; i < found.pixels.size(); ++i) {
      sum += static_cast<double>(wfpg::luminance(found.pixels[i]));
      expected_sum += static_cast<double>(wfpg::luminance(expected.pixels[i]));
      not_finite += !wfpg::is_finite(found.pixels[i]);
    }
    CHECK(not_finite == 0);
    CHECK(sum / static_cast<double>(largest_radiance) == Approx(expected_sum).epsilon(0.3));
  }
}
