// Fields made by cones through the exitance cache. Tests cone widths, densities of directions, and what kept
// fields store.
#include "support/catch.hpp"
#include "support/guiding.hpp"
#include "support/statistics.hpp"

#include <wfpg/octree/svo_cone_caster.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace cone_caster_fields_test {

/// Counts cones that do not have the expected width.
struct width_caster {
  float expected;
  std::uint32_t* wrong;
  WFPG_HD wfpg::ray_hit operator()(const wfpg::ray&) const { return (*this)(wfpg::ray(), -1.0f); }
  WFPG_HD wfpg::ray_hit operator()(const wfpg::ray&, float solid_angle) const {
    const bool right = std::fabs(solid_angle - expected) < 1.0e-4f * expected;
    wfpg::atomic_add(right ? wrong + 1 : wrong, 1u);
    return {-1.0f, 1.0f};
  }
};

}  // namespace cone_caster_fields_test

namespace {

using namespace wfpg_test;
using cone_caster_fields_test::width_caster;
using wfpg::guiding_mode;
using wfpg::svo_cone_caster;

static_assert(!wfpg::is_cone_caster_v<box_caster>);
static_assert(!wfpg::is_cone_caster_v<batch_box_caster>);

WFPG_TEST_CASE("cone caster: fields pass the widths of their cones", "[cone_caster]") {
  for (const guiding_mode mode : {guiding_mode::plain, guiding_mode::oriented})
    for (const field_lifetime lifetime : lifetimes)
      for (const std::uint32_t depth : {0u, 1u}) {
        guided_box<Exec> box(box_options(mode, lifetime));
        box.learn();
        const float cells = lifetime == field_lifetime::kept || depth == 0 ? 256.0f : 64.0f;
        const float covered = (mode == guiding_mode::plain ? 4.0f : 2.0f) * wfpg::pi;
        const wfpg::buffer<std::uint32_t, Exec> counts(box.exec, std::vector<std::uint32_t>(2, 0));
        box.sample(wall_surfaces(500, 1), width_caster{covered / cells, counts.data()}, 1, depth);
        CHECK(counts.to_host(box.exec)[0] == 0);
        CHECK(counts.to_host(box.exec)[1] > 1000);
      }
}

/// Samples a direction for each ray of a wave; all rays start at one place.
struct draw_of_view {
  wfpg::guide_view view;
  test_surface surface;
  WFPG_HD drawn_direction operator()(std::size_t i) const {
    const hashed_numbers random{11};
    const auto ray = static_cast<std::uint32_t>(i);
    const auto drawn = view.sample(0, surface, random(ray, 0).x, random(ray, 1));
    return {drawn.direction, drawn.pdf};
  }
};
struct density_of_view {
  wfpg::guide_view view;
  test_surface surface;
  WFPG_HD float operator()(vec3 d) const { return view.pdf(0, surface, d); }
};

WFPG_TEST_CASE("cone caster: directions of cone fields have their density and find the light",
               "[cone_caster]") {
  chi_square_family family;
  for (const guiding_mode mode : {guiding_mode::plain, guiding_mode::oriented})
    for (const field_lifetime lifetime : lifetimes) {
      guided_box<Exec> box(box_options(mode, lifetime));
      box.learn();
      const wfpg::voxel_opacity<Exec> opacity(box.exec, box.guider.guide().octree());
      const svo_cone_caster caster(box.guider.guide().cache(), opacity.view());
      const test_surface at = make_surface({0.4f, 0, 0.3f}, {0, 1, 0}, {0, 1, 0});
      const std::vector<test_surface> surfaces(400, at);
      const wave_of_surfaces<Exec> wave(box.exec, surfaces);
      for (int warm_up = 0; warm_up < 3; ++warm_up) box.guider.prepare(wave.get(), caster);
      const wfpg::guide_view view = box.guider.prepare(wave.get(), caster);
      REQUIRE(guides(box.exec, view, 0));
      const auto drawn = evaluate(box.exec, 40000, draw_of_view{view, at});
      const sampler_report report =
          check_sampler(drawn, densities_by{box.exec, density_of_view{view, at}}, {});
      INFO(name_of(lifetime) << ": " << report.message);
      CHECK(report);
      family.add(report.frequencies, name_of(lifetime));
      const auto meets_patch = [&](const drawn_direction& d) {
        return d.direction.y > 0.0f && emitted(at.position + d.direction / d.direction.y) > 0.0f;
      };
      // Uniform directions hit it with 0.3%, cosine-distributed ones with 0.7%.
      CHECK(std::count_if(drawn.begin(), drawn.end(), meets_patch) > 0.012 * 40000);
    }
  INFO(family.message());
  CHECK(family.accepted());
}

WFPG_TEST_CASE("cone caster: kept fields keep the cones' radiance until they are cast again",
               "[cone_caster]") {
  guided_box<Exec> box(field_lifetime::kept);
  box.learn();
  const wfpg::voxel_opacity<Exec> opacity(box.exec, box.guider.guide().octree());
  const svo_cone_caster caster(box.guider.guide().cache(), opacity.view());
  const test_surface at = make_surface({0.4f, 0, 0.3f}, {0, 1, 0}, {0, 1, 0});
  const wave_of_surfaces<Exec> wave(box.exec, std::vector<test_surface>(400, at));
  const vec3 to_patch = glm::normalize(vec3(0.8f, 1.0f, 0.8f) - at.position);
  const auto next_sample = [&] {
    box.guider.end_sample();
    box.guider.begin_sample();
  };
  const auto density = [&] {
    const wfpg::guide_view view = box.guider.prepare(wave.get(), caster);
    return evaluate(box.exec, [=] WFPG_HD() { return view.pdf(0, to_patch); });
  };
  for (int warm_up = 0; warm_up < 4; ++warm_up, next_sample()) density();
  const float known = density();
  box.guider.forget_light();
  next_sample();
  CHECK(density() > 0.5f * known);
  box.guider.invalidate_all();
  CHECK(density() < 0.1f * known);
}

}  // namespace
