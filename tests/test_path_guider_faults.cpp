// Faulty hosts: casters that throw or return invalid hits, BSDFs and surfaces that are not finite. Also
// random numbers at the ends of their range. No density is NaN, infinite or negative, and the guider stays
// usable.
#include "support/catch.hpp"
#include "support/evaluate.hpp"
#include "support/guiding.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"
#include "support/stepwise_samples.hpp"

#include <wfpg/octree/svo_ray_caster.hpp>

#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <vector>

namespace {

using namespace wfpg_test;
using wfpg::guiding_mode;
using wfpg::sampled_direction;
using wfpg::sampling_technique;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

/// Calls f(options) for both lifetimes and modes, with and without products.
template <class F>
void for_each_kind(const F& f) {
  for (const field_lifetime lifetime : lifetimes)
    for (const guiding_mode mode : {guiding_mode::oriented, guiding_mode::plain})
      for (const std::uint32_t products : {0u, 4u}) {
        INFO(name_of(lifetime) << ", plain " << (mode == guiding_mode::plain) << ", products " << products);
        guider_options options = box_options(mode, lifetime);
        options.product_resolution = unless_zero(products);
        f(options);
      }
}

WFPG_HD bool is_density(float density) {
  return density >= 0.0f && wfpg::is_finite(density);
}

/// Whether a direction is valid: finite and with a density, or none.
bool is_sound(const sampled_direction& d) {
  if (d.technique == sampling_technique::none) return d.pdf == 0.0f;
  return d.pdf > 0.0f && is_density(d.pdf) && wfpg::is_finite(d.direction);
}

std::size_t count_unsound(const std::vector<sampled_direction>& drawn) {
  std::size_t count = 0;
  for (const sampled_direction& d : drawn) count += is_sound(d) ? 0 : 1;
  return count;
}

#if !defined(__CUDACC__)
/// Inline caster that throws from one of its calls on.
struct throwing_caster {
  std::atomic<int>* left;

  wfpg::ray_hit operator()(const wfpg::ray& r) const {
    if (left->fetch_sub(1) <= 1) throw std::runtime_error("the caster fails on request");
    return box_caster()(r);
  }
};

WFPG_TEST_CASE("path guider: an exception in an inline caster leaves the guider usable",
               "[path_guider][faults][bits]") {
  for_each_kind([](const guider_options& options) {
    guided_box<Exec> box(options), other(options);
    box.learn();
    other.learn();
    const auto surfaces = mixed_surfaces(500, 3);
    const wave_of_surfaces<Exec> wave(box.exec, surfaces);
    for (const int call : {1, 2, 300, 1000}) {
      std::atomic<int> left = call;
      CHECK_THROWS_AS(box.sample(surfaces, throwing_caster{&left}), std::runtime_error);
      left = call;
      CHECK_THROWS_AS(box.guider.prepare(wave.get(), throwing_caster{&left}), std::runtime_error);
    }
    CHECK(same_bits(box.sample_again(surfaces), other.sample_again(surfaces)));
    box.guider.end_sample();
    check_guides(box.guider);
  });
}
#endif

/// Every other hit is invalid.
struct nonsense_caster {
  WFPG_HD wfpg::ray_hit operator()(const wfpg::ray& r) const {
    const float answers[] = {nan, -nan, infinity, -infinity, 3.0e38f, -3.0e38f, -1.0f};
    const auto i = wfpg::hash32(1, wfpg::float_bits(r.direction.x));
    if (i % 2 == 0) return box_caster()(r);
    return {answers[i / 2 % 7], answers[i / 14 % 7]};
  }
};

struct batch_nonsense_caster {
  template <class Exec>
  void cast(const Exec& exec, wfpg::array_view<const wfpg::ray> rays,
            wfpg::array_view<wfpg::ray_hit> hits) const {
    exec.for_each(rays.size(), [=] WFPG_HD(std::size_t i) { hits[i] = nonsense_caster()(rays[i]); });
  }
};

WFPG_TEST_CASE("path guider: invalid distances and radiance count as darkness", "[path_guider][faults]") {
  for_each_kind([](const guider_options& options) {
    guided_box<Exec> box(options);
    box.learn();
    const auto surfaces = mixed_surfaces(500, 3);
    CHECK(count_unsound(box.sample_again(surfaces, nonsense_caster{})) == 0);
    CHECK(count_unsound(box.sample_again(surfaces, batch_nonsense_caster{})) == 0);
    box.guider.end_sample();
    check_guides(box.guider);
  });
}

/// A Lambertian. One of its functions returns invalid values on request.
struct faulty_bsdf {
  static constexpr std::uint32_t kinds = 5 * 5;

  std::uint32_t kind = 0;
  test_bsdf sound;

  WFPG_HD float eval(vec3 wo, vec3 wi) const { return kind % 5 == 1 ? bad() : sound.eval(wo, wi); }
  WFPG_HD float pdf(vec3 wo, vec3 wi) const { return kind % 5 == 2 ? bad() : sound.pdf(wo, wi); }
  WFPG_HD wfpg::bsdf_sample sample(vec3 wo, vec2 u) const {
    wfpg::bsdf_sample drawn = sound.sample(wo, u);
    if (kind % 5 == 3) drawn.pdf = bad();
    if (kind % 5 == 4) drawn.direction = vec3(kind / 5 % 2 == 0 ? nan : infinity);
    return drawn;
  }
  WFPG_HD bool is_delta() const { return sound.is_delta(); }
  WFPG_HD bool transmits() const { return false; }

 private:
  WFPG_HD float bad() const {
    const float answers[] = {nan, -nan, infinity, -infinity, -1.0f};
    return answers[kind / 5];
  }
};

/// A faulty BSDF in parts, half of it glossy.
struct faulty_parts : faulty_bsdf {
  WFPG_HD wfpg::glossy_part glossy(vec3) const { return {0.5f, 0.3f}; }
  WFPG_HD wfpg::bsdf_sample sample_part(bool, vec3 wo, vec2 u) const { return sample(wo, u); }
  WFPG_HD float pdf_part(bool, vec3 wo, vec3 wi) const { return pdf(wo, wi); }
};

template <class Bsdf>
struct faulty_surfaces {
  wfpg::array_view<const test_surface> surfaces;
  WFPG_HD wfpg::surface<Bsdf> operator()(std::uint32_t ray) const {
    const test_surface& s = surfaces[ray];
    Bsdf bsdf;
    bsdf.kind = ray % faulty_bsdf::kinds;
    bsdf.sound = s.bsdf;
    return {s.position, s.geometric_normal, s.normal, s.outgoing, bsdf, true};
  }
};

/// Queries of directions of all kinds.
struct faulty_queries {
  WFPG_HD vec3 operator()(std::uint32_t ray) const {
    if (ray % 7 == 0) return vec3(nan);
    if (ray % 7 == 1) return vec3(infinity, 0.0f, 0.0f);
    if (ray % 7 == 2) return vec3(3.0e38f);
    return {0.0f, 1.0f, 0.0f};
  }
};

/// Whether a view's answer to a query is an invalid density.
template <class Bsdf>
struct ask_densities {
  wfpg::guide_view view;
  wfpg::array_view<const test_surface> surfaces;
  WFPG_HD bool operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    const vec3 direction = faulty_queries()(ray);
    const float whole = view.pdf(ray, faulty_surfaces<Bsdf>{surfaces}(ray), direction);
    const float field = view.guides(ray) ? view.pdf(ray, direction) : 0.0f;
    return !is_density(whole) || !is_density(field);
  }
};

template <class Bsdf, class Exec>
void check_faulty_bsdfs(guided_box<Exec>& box, bsdf_kind kind) {
  const auto host = wall_surfaces(500, 3, kind);
  const wfpg::buffer<test_surface, Exec> surfaces(box.exec, host);
  const wfpg::buffer<sampled_direction, Exec> directions(box.exec, host.size());
  const wfpg::buffer<float, Exec> densities(box.exec, host.size());
  const wfpg::wave wave{0, host.size(), faulty_surfaces<Bsdf>{const_view<test_surface>(surfaces)},
                        hashed_numbers{7}};
  for (int again = 0; again < 3; ++again) {
    box.guider.sample_directions(wave, box_caster{}, directions.view(),
                                 wfpg::density_queries{faulty_queries{}, densities.view()});
    CHECK(count_unsound(directions.to_host(box.exec)) == 0);
    int unsound = 0;
    for (const float density : densities.to_host(box.exec)) unsound += !is_density(density);
    CHECK(unsound == 0);
  }
  const wfpg::guide_view view = box.guider.prepare(wave, box_caster{});
  const ask_densities<Bsdf> asks_unsound{view, const_view<test_surface>(surfaces)};
  CHECK(count_where(box.exec, host.size(), asks_unsound) == 0);
}

WFPG_TEST_CASE("path guider: invalid densities of a BSDF count as none", "[path_guider][faults]") {
  for_each_kind([](const guider_options& options) {
    guided_box<Exec> box(options);
    check_faulty_bsdfs<faulty_bsdf>(box, bsdf_kind::lambert);  // of an unguided sample too
    box.learn();
    for (const bsdf_kind kind : {bsdf_kind::lambert, bsdf_kind::mirror}) {
      check_faulty_bsdfs<faulty_bsdf>(box, kind);
      check_faulty_bsdfs<faulty_parts>(box, kind);
    }
    box.guider.end_sample();
    check_guides(box.guider);
  });
}

/// Surfaces of which a third have a value that is not finite.
std::vector<test_surface> faulty_surfaces_of(std::size_t n) {
  auto surfaces = wall_surfaces(n, 3);
  const float bad[] = {nan, infinity, -infinity, 3.0e38f};
  for (std::size_t i = 0; i < n; i += 3) {
    test_surface& s = surfaces[i];
    vec3* const parts[] = {&s.position, &s.geometric_normal, &s.normal};
    *parts[i / 3 % 3] = vec3(bad[i / 9 % 4]);
  }
  return surfaces;
}

WFPG_TEST_CASE("path guider: surfaces that are not finite get no direction without a density",
               "[path_guider][faults]") {
  const auto surfaces = faulty_surfaces_of(360);
  for_each_kind([&](const guider_options& options) {
    guided_box<Exec> box(options);
    box.learn();
    const wfpg::svo_ray_caster marcher(box.guider.guide().octree().view(), 1.0f);
    CHECK(count_unsound(box.sample_again(surfaces)) == 0);
    CHECK(count_unsound(box.sample_again(surfaces, marcher)) == 0);
    const auto depth = box.guider.statistics().depths[0];
    CHECK(depth.unbinned >= 8 * 80);  // because of their position or shading normal
    CHECK(depth.rays >= 6 * 240);
    box.guider.end_sample();
    check_guides(box.guider);
  });
}

/// All pairs of the ends of [0, 1).
struct end_numbers {
  WFPG_HD vec2 operator()(std::uint32_t ray, std::uint32_t dimension) const {
    constexpr float last = 1.0f - 0x1p-24f;
    if (dimension == 0) return vec2(ray & 4u ? last : 0.0f);
    return {ray & 1u ? last : 0.0f, ray & 2u ? last : 0.0f};
  }
};

WFPG_TEST_CASE("path guider: random numbers at the ends of their range give valid directions",
               "[path_guider][faults]") {
  for_each_kind([](const guider_options& options) {
    guided_box<Exec> box(options);
    box.learn();
    const auto host = wall_surfaces(400, 5);
    const wfpg::buffer<test_surface, Exec> surfaces(box.exec, host);
    const wfpg::buffer<sampled_direction, Exec> drawn(box.exec, host.size());
    const wfpg::wave wave{0, host.size(), stored_surfaces{const_view<test_surface>(surfaces)}, end_numbers{}};
    for (int warm_up = 0; warm_up < 4; ++warm_up) box.guider.prepare(wave, box_caster{});
    box.guider.sample_directions(wave, box_caster{}, drawn.view());
    CHECK(count_unsound(drawn.to_host(box.exec)) == 0);
    const wfpg::guide_view view = box.guider.prepare(wave, box_caster{});
    std::size_t guided = 0, dead = 0;
    for (const sampled_direction& d : drawn.to_host(box.exec)) {
      guided += d.technique == sampling_technique::guide;
      dead += d.technique == sampling_technique::none;  // of the BSDF at its horizon
    }
    CHECK(guided > 100);
    CHECK(dead <= 100);
    const density_of_view agrees{view, const_view<test_surface>(surfaces),
                                 const_view<sampled_direction>(drawn)};
    CHECK(count_where(box.exec, host.size(), agrees) == host.size() - dead);
  });
}

/// Records one path with directions that are invalid.
struct record_nowhere {
  wfpg::path_recorder_view recorder;
  WFPG_HD void operator()(std::size_t path) const {
    const float bad[] = {0.0f, nan, infinity};
    const vec3 floor(0.5f, 0.0f, 0.5f), one(1.0f);
    recorder.vertex(path, 0, floor, vec3(bad[path]), one);
    recorder.vertex(path, 0, floor, {0.0f, 1.0f, 0.0f}, one);
    sampled_direction nowhere;
    nowhere.direction = vec3(bad[path]);
    nowhere.technique = sampling_technique::guide;
    nowhere.field = 0;
    recorder.scatter(path, 0, nowhere);
  }
};

WFPG_TEST_CASE("path guider: invalid vertices and directions are dropped and counted",
               "[path_guider][faults]") {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  octree_guider<Exec> guider(exec, mesh.view(), tracing_options(3));
  guider.begin_sample();
  exec.for_each(3, record_nowhere{guider.recorder()});
  CHECK(guider.statistics().dropped_vertices == 6);
  guider.end_sample();
  CHECK(guider.statistics().deposits.total() == 0);
}

}  // namespace
