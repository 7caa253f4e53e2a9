// Fields of bins in a box with known light. Cells see the right radiance. Forms of casters and buffer sizes
// change nothing. test_radiance_field_filter.cpp tests filter and floor.
#include "support/evaluate.hpp"
#include "support/fields.hpp"
#include "support/lit_box.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/bins/wave_rays.hpp>
#include <wfpg/guide/sample_rays.hpp>
#include <wfpg/guides/octree/field_sinks.hpp>
#include <wfpg/guides/octree/guide_view.hpp>
#include <wfpg/guides/octree/transient_fields.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::directional_field;
using wfpg::guiding_mode;

namespace {

constexpr float wall_radiance[6] = {1.0f, 2.0f, 3.0f, 16.0f, 5.0f, 0.0f};

float constant_walls(std::uint32_t face, float, float) {
  return wall_radiance[face];
}

/// Copies the cells of a field before filter and floor.
struct raw_cells {
  wfpg::field_cells cells;
  wfpg::exitance_cache_view cache;
  box_caster caster;
  wfpg::array_view<float> values;
  wfpg::array_view<wfpg::ray> cones;
  WFPG_HD void operator()(std::size_t i) const {
    cones[i] = cells.cone(wfpg::cell_at(static_cast<std::uint32_t>(i), cells.resolution));
    values[i] =
        cells.weigh(cells.find(cache, cones[i], caster(cones[i])).radiance(cache), cones[i].direction);
  }
};

struct seen_cells {
  std::vector<float> values;
  std::vector<wfpg::ray> cones;
};

template <class Exec>
seen_cells look(const lit_box<Exec>& box, const wfpg::field_origin& origin, std::uint32_t resolution,
                box_caster caster = {}) {
  const std::size_t n = std::size_t(resolution) * resolution;
  const wfpg::buffer<float, Exec> values(box.exec, n);
  const wfpg::buffer<wfpg::ray, Exec> cones(box.exec, n);
  const wfpg::field_cells cells(origin, resolution);
  box.exec.for_each(n, raw_cells{cells, box.cache.view(), caster, values.view(), cones.view()});
  return {values.to_host(box.exec), cones.to_host(box.exec)};
}

/// The face that a ray from inside hits, and the distance of the hit from the face's rim.
std::uint32_t face_hit(const wfpg::ray& r, float& from_rim) {
  const vec3 p = r.origin + box_caster()(r).distance * r.direction;
  std::uint32_t face = 0;
  float nearest = 1.0f;
  for (std::uint32_t f = 0; f < 6; ++f) {
    const float away = std::abs(p[int(f / 2)] - (f % 2 ? 1.0f : 0.0f));
    if (away >= nearest) continue;
    nearest = away;
    face = f;
  }
  from_rim = 1.0f;
  for (int axis = 0; axis < 3; ++axis)
    if (axis != int(face / 2)) from_rim = std::min({from_rim, p[axis], 1.0f - p[axis]});
  return face;
}

WFPG_TEST_CASE("radiance field: cells see the radiance of the wall that they look at", "[radiance_field]") {
  const lit_box<Exec> box(constant_walls);
  wfpg::field_origin origin;
  origin.position = {0.45f, 0.4f, 0.55f};
  const seen_cells seen = look(box, origin, 32);
  const float node = 0.1f;  // cones read nodes of about their own width, so one wall's only away from the rim
  int checked = 0, wrong = 0;
  for (std::size_t i = 0; i < seen.values.size(); ++i) {
    float from_rim;
    const std::uint32_t face = face_hit(seen.cones[i], from_rim);
    if (from_rim < 1.5f * node) continue;
    ++checked;
    wrong += std::abs(seen.values[i] - wall_radiance[face]) > 1e-4f * wall_radiance[face];
  }
  CHECK(checked > 400);
  CHECK(wrong == 0);
}

WFPG_TEST_CASE("radiance field: a furnace's field is uniform, to the rim and at any resolution",
               "[radiance_field]") {
  const lit_box<Exec> box([](std::uint32_t, float, float) { return 2.5f; });
  for (std::uint32_t resolution : {2u, 16u, 31u}) {
    wfpg::field_origin origin;
    origin.position = {0.3f, 0.4f, 0.6f};
    origin.seed = resolution;
    for (float value : look(box, origin, resolution).values) CHECK(value == Approx(2.5f).epsilon(1e-5));
    origin.cosine = origin.hemisphere = true;
    origin.normal = glm::normalize(vec3(1, 2, -3));
    const seen_cells seen = look(box, origin, resolution);
    for (std::size_t i = 0; i < seen.values.size(); ++i) {
      const float cosine = glm::dot(seen.cones[i].direction, origin.normal);
      CHECK(cosine > -1e-6f);
      CHECK(seen.values[i] == Approx(2.5f * std::max(cosine, 0.0f)).epsilon(1e-5).margin(1e-6));
    }
  }
}

struct direction_of_cone {
  wfpg::field_cells cells;
  WFPG_HD vec3 operator()(std::size_t cell) const {
    return cells.cone(wfpg::cell_at(static_cast<std::uint32_t>(cell), cells.resolution)).direction;
  }
};

WFPG_TEST_CASE("radiance field: cones are jittered inside their cells, by the seed", "[radiance_field]") {
  wfpg::field_origin origin;
  const wfpg::field_cells first(origin, 16);
  origin.seed = 1;
  const wfpg::field_cells second(origin, 16);
  const Exec exec;
  const auto directions = [&](const wfpg::field_cells& cells) {
    return evaluate(exec, 256, direction_of_cone{cells});
  };
  const std::vector<vec3> before = directions(first), after = directions(second);
  int same = 0, outside = 0;
  for (std::uint32_t cell = 0; cell < 256; ++cell) {
    const vec3 b = after[cell];
    same += before[cell] == b;
    const vec2 uv = wfpg::sphere_to_square(b) * 16.0f - vec2(float(cell % 16), float(cell / 16));
    outside += uv.x < -1e-3f || uv.x > 1.001f || uv.y < -1e-3f || uv.y > 1.001f;
  }
  CHECK(same == 0);
  CHECK(outside == 0);
}

WFPG_TEST_CASE("radiance field: cones that miss see the environment", "[radiance_field]") {
  const lit_box<Exec> box([](std::uint32_t, float, float) { return 0.0f; });
  wfpg::field_origin origin;
  origin.position = {0.5f, 0.5f, 0.5f};
  const seen_cells seen = look(box, origin, 32, box_caster{true});
  int sky = 0;
  for (std::size_t i = 0; i < seen.values.size(); ++i) {
    const bool misses = !box_caster{true}(seen.cones[i]).is_hit();
    CHECK(seen.values[i] == (misses ? 5.0f : 0.0f));
    sky += misses;
  }
  CHECK(std::abs(sky - 1024 / 6) < 20);
}

WFPG_TEST_CASE("radiance field: invalid radiance counts as 0, and large radiance is clamped",
               "[radiance_field]") {
  const lit_box<Exec> box(constant_walls);
  const wfpg::field_cells cells({}, 4);
  const wfpg::exitance_cache_view cache = box.cache.view();
  const std::vector<float> environments{2.0f, -2.0f, std::nanf(""), INFINITY, 1e38f};
  const auto values = evaluate(box.exec, environments, [=] WFPG_HD(float environment) {
    const wfpg::ray cone = cells.cone({0, 0});
    const wfpg::cone_hit hit = cells.find(cache, cone, {-1.0f, environment});
    return cells.weigh(hit.radiance(cache), cone.direction);
  });
  CHECK(values == std::vector<float>{2.0f, 0.0f, 0.0f, 0.0f, 1e30f});
  const std::vector<float> distances{INFINITY, 3e38f, 1e10f};
  const auto far = evaluate(box.exec, distances, [=] WFPG_HD(float distance) {
    const wfpg::ray cone = cells.cone({0, 0});
    return cells.find(cache, cone, {distance, 5.0f}).radiance(cache);
  });
  CHECK(far == std::vector<float>(3, 0.0f));
}

/// The resident fields of one wave as bits, and the field of each ray.
struct made_fields {
  std::vector<std::uint32_t> words, field_of_ray;
  std::vector<wfpg::resident_field> fields;
};

template <class Exec, class Caster>
made_fields make_fields(const lit_box<Exec>& box, const std::vector<test_surface>& wave, guiding_mode mode,
                        const Caster& caster, std::size_t buffer_bytes) {
  constexpr std::uint32_t resolution = 8;
  const Exec& exec = box.exec;
  const wfpg::buffer<test_surface, Exec> surfaces(exec, wave);
  const stored_surfaces stored{const_view<test_surface>(surfaces)};
  wfpg::spatial_binner<Exec> binner(exec, box.tree.view(), {1, 16}, wave.size());
  const auto bins = binner.bin(exec, wave.size(), wfpg::wave_rays<stored_surfaces>{stored, mode});
  const wfpg::bin_fields<stored_surfaces> fields{bins, stored, box.cache.view(), {}, mode, resolution, 42};
  const std::size_t n = wfpg::read_element(exec, bins.count);
  const wfpg::buffer<std::uint32_t, Exec> words(exec, n * wfpg::grid_distribution::words(resolution));
  const wfpg::buffer<wfpg::resident_field, Exec> resident(exec, n);
  const wfpg::buffer<std::uint32_t, Exec> field_of_ray(
      exec, std::vector<std::uint32_t>(wave.size(), wfpg::no_field));
  wfpg::for_each_field(
      exec, fields, caster,
      wfpg::resident_sink{
          bins, words.data(), resident.data(), field_of_ray.data(), {0.5f, 0.5f, 0}, resolution},
      buffer_bytes);
  return {words.to_host(exec), field_of_ray.to_host(exec), resident.to_host(exec)};
}

WFPG_TEST_CASE("radiance field: both forms of casters and any buffer size give the same bits",
               "[radiance_field]") {
  const lit_box<Exec> box(constant_walls);
  const auto wave = wall_surfaces(300, 1);
  for (guiding_mode mode : {guiding_mode::oriented, guiding_mode::plain}) {
    const made_fields in_place = make_fields(box, wave, mode, box_caster{}, 0);
    CHECK(in_place.fields.size() > 7);
    for (std::size_t bytes : {std::size_t(0), std::size_t(3 * 64 * 48), std::size_t(1) << 20}) {
      batch_box_caster::log log;
      const made_fields batch = make_fields(box, wave, mode, batch_box_caster{{}, &log}, bytes);
      CHECK(batch.words == in_place.words);
      CHECK(batch.field_of_ray == in_place.field_of_ray);
      CHECK(log.rays == in_place.fields.size() * 64);
      if (bytes == 0) CHECK(log.largest == 64);
      if (bytes == 0) CHECK(log.calls == in_place.fields.size());
      if (bytes > 1000000) CHECK(log.calls == 1);
    }
  }
}

WFPG_TEST_CASE("radiance field: every ray has a field, above its horizon if surfaces reflect",
               "[radiance_field]") {
  const lit_box<Exec> box(constant_walls);
  auto wave = wall_surfaces(400, 2);
  for (std::size_t i = 0; i < wave.size(); i += 4) wave[i].bsdf.kind = bsdf_kind::glass;
  for (guiding_mode mode : {guiding_mode::oriented, guiding_mode::plain}) {
    const made_fields made = make_fields(box, wave, mode, box_caster{}, 0);
    int below = 0, hemispheres = 0;
    for (std::size_t ray = 0; ray < wave.size(); ++ray) {
      REQUIRE(made.field_of_ray[ray] < made.fields.size());
      const wfpg::resident_field& f = made.fields[made.field_of_ray[ray]];
      hemispheres += f.hemisphere();
      CHECK(f.hemisphere() == (mode == guiding_mode::oriented && !wave[ray].bsdf.transmits()));
      const wfpg::grid_distribution grid(
          made.words.data() + made.field_of_ray[ray] * wfpg::grid_distribution::words(8), 8);
      if (!f.hemisphere()) continue;
      const directional_field field(grid, f.normal);
      for (std::uint32_t i = 0; i < 20; ++i) {
        const vec3 d = field.sample(hashed_numbers{ray}(i, 0));
        below +=
            glm::dot(d, wave[ray].normal) < -1e-6f;  // walls are flat, so a bin's rays share their normal
      }
    }
    CHECK(below == 0);
    CHECK(hemispheres == (mode == guiding_mode::oriented ? 300 : 0));
  }
}

float equal_walls(std::uint32_t, float, float) {
  return 2.0f;
}

WFPG_TEST_CASE("radiance field: under uniform light hemispheres have the cosine, spheres not",
               "[radiance_field]") {
  const lit_box<Exec> box(equal_walls);
  auto wave = wall_surfaces(400, 2);
  for (std::size_t i = 0; i < wave.size(); i += 4) wave[i].bsdf.kind = bsdf_kind::glass;
  const made_fields made = make_fields(box, wave, guiding_mode::oriented, box_caster{}, 0);
  for (std::size_t i = 0; i < made.fields.size(); ++i) {
    const wfpg::grid_distribution grid(made.words.data() + i * wfpg::grid_distribution::words(8), 8);
    const bool hemisphere = made.fields[i].hemisphere();
    double high = 0.0, expected = 0.0, all = 0.0;  // above 30 degrees; of all above the horizon
    for (std::uint32_t cell = 0; cell < 64; ++cell) {
      const double z = wfpg::square_to_hemisphere_z((vec2(float(cell % 8), float(cell / 8)) + 0.5f) / 8.0f);
      const double light = hemisphere ? z : 1.0;
      all += light;
      if (z <= 0.5) continue;
      expected += light;
      high += double(grid.weight(cell % 8, cell / 8)) / double(grid.total());
    }
    INFO("hemisphere " << hemisphere);
    CHECK(high ==
          Approx(expected / all).margin(0.1));  // the filter blurs; without the cosine it would be 0.2 away
  }
}

}  // namespace
