// check_ray_caster and check_surface: correct ones pass, and each of many faults is found and named.
#include "support/policies.hpp"
#include "support/reports.hpp"
#include "support/scenes.hpp"

#include <wfpg/host/ray_caster.hpp>
#include <wfpg/octree/svo_ray_caster.hpp>
#include <wfpg/testing/check_ray_caster.hpp>
#include <wfpg/testing/check_surfaces.hpp>

#include <cmath>
#include <limits>
#include <vector>

using namespace wfpg_test;
using wfpg::ray;
using wfpg::ray_hit;
using wfpg::testing::caster_check_options;
using wfpg::testing::check_ray_caster;
using wfpg::testing::check_surface;
using wfpg::testing::check_surfaces;

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();

enum class caster_fault { none, doubled, nan, infinite, negative, ignores_t_max, dark, zero };

/// The box's caster with one fault.
struct faulty_caster {
  caster_fault fault = caster_fault::none;
  bool open_top = false;

  WFPG_HD ray_hit operator()(ray r) const {
    if (fault == caster_fault::ignores_t_max) r.t_max = 3.0e38f;
    ray_hit hit = box_caster{open_top}(r);
    const bool rare = r.direction.x > 0.9f;
    if (fault == caster_fault::doubled && hit.is_hit()) hit.distance *= 2.0f;
    if (fault == caster_fault::nan && rare) hit.distance = nan_value;
    if (fault == caster_fault::infinite && rare) hit.distance = infinity;
    if (fault == caster_fault::zero && rare) hit.distance = 0.0f;
    if (fault == caster_fault::negative) hit.distance = -std::fabs(hit.distance);
    if (fault == caster_fault::dark && !hit.is_hit()) hit.radiance = -1.0f;
    return hit;
  }
};

/// Returns the hit of the ray `shift` places later, and leaves the last `unwritten` hits unwritten.
struct shifted_caster {
  std::size_t shift = 0, unwritten = 0;
  template <class Exec>
  void cast(const Exec& exec, wfpg::array_view<const ray> rays, wfpg::array_view<ray_hit> hits) const {
    const std::size_t further = shift;
    exec.for_each(rays.size() - unwritten,
                  [=] WFPG_HD(std::size_t i) { hits[i] = box_caster{}(rays[(i + further) % rays.size()]); });
  }
};

const wfpg::bounds3 unit_box{vec3(0.0f), vec3(1.0f)};

/// The octree of the walls of [0, side]³.
template <class Exec>
wfpg::sparse_voxel_octree<Exec> box_octree(const Exec& exec, std::uint32_t resolution, float side = 1.0f) {
  std::vector<vec3> corners = box_positions();
  for (vec3& corner : corners) corner *= side;
  const wfpg::buffer<vec3, Exec> positions(exec, corners);
  const wfpg::buffer<wfpg::uvec3, Exec> triangles(exec, box_triangles());
  auto fragments =
      wfpg::voxelize(exec, {const_view<vec3>(positions), const_view<wfpg::uvec3>(triangles)}, resolution);
  return wfpg::sparse_voxel_octree<Exec>(exec, fragments);
}

WFPG_TEST_CASE("check_ray_caster: correct casters pass", "[testing]") {
  const Exec exec;
  const auto tree = box_octree(exec, 32);
  batch_box_caster::log log;
  caster_check_options closed;
  closed.least_hits = 1.0;
  closed.exceptions = 0.0;
  check_passes(check_ray_caster(exec, box_caster{}, unit_box, closed));
  check_passes(check_ray_caster(exec, batch_box_caster{{}, &log}, unit_box, closed));
  check_passes(check_ray_caster(exec, box_caster{}, tree.view(), closed));
  check_passes(check_ray_caster(exec, batch_box_caster{{}, &log}, tree.view(), closed));
  check_passes(check_ray_caster(exec, box_caster{true}, tree.view()));
  CHECK(log.calls == 6);

  caster_check_options marching;
  marching.least_distance = 5.0f * tree.view().grid().voxel_size();
  marching.tolerance = 1.0e-3f;
  check_passes(check_ray_caster(exec, wfpg::svo_ray_caster(tree.view()), tree.view(), marching));
}

WFPG_TEST_CASE("check_surfaces: correct surfaces of a wave pass, and the first wrong one is named",
               "[testing]") {
  const Exec exec;
  const auto tree = box_octree(exec, 32);
  std::vector<test_surface> host = wall_surfaces(200, 4);
  const auto on_host = box_octree(host_policy(), 32);
  for (const test_surface& s : host) check_passes(check_surface(s, on_host.view()));
  const auto report = [&] {
    const wfpg::buffer<test_surface, Exec> device(exec, host);
    return check_surfaces(exec, stored_surfaces{const_view<test_surface>(device)}, host.size(), tree.view());
  };
  check_passes(report());
  host[37].normal = vec3(nan_value);
  host[90].outgoing = vec3(2.0f);
  check_names(report(), {"ray 37", "normal is (nan"});
  host[37].active = false;
  check_names(report(), {"ray 90", "outgoing is (2, 2, 2)", "length 3.464"});
}

/// Surfaces whose path() is right for all rays but one.
struct surfaces_with_paths {
  stored_surfaces stored;
  std::uint32_t wrong;
  WFPG_HD test_surface operator()(std::uint32_t ray) const {
    test_surface s = stored(ray);
    s.path = 2 * ray;
    return s;
  }
  WFPG_HD std::uint32_t path(std::uint32_t ray) const { return 2 * ray + (ray == wrong ? 1u : 0u); }
};

WFPG_TEST_CASE("check_surfaces: path() has to agree with the surface's path", "[testing]") {
  const Exec exec;
  const auto tree = box_octree(exec, 32);
  const std::vector<test_surface> host = wall_surfaces(200, 4);
  const wfpg::buffer<test_surface, Exec> device(exec, host);
  const stored_surfaces stored{const_view<test_surface>(device)};
  check_passes(check_surfaces(exec, surfaces_with_paths{stored, 200}, host.size(), tree.view()));
  check_names(check_surfaces(exec, surfaces_with_paths{stored, 20}, host.size(), tree.view()),
              {"ray 20", "path() is 41, expected surface::path, 40"});
}

}  // namespace

TEST_CASE("check_ray_caster: each fault is found and named", "[testing]") {
  const one_policy exec;
  const auto tree = box_octree(exec, 32);
  const auto check = [&](caster_fault fault, bool open_top = false) {
    return check_ray_caster(exec, faulty_caster{fault, open_top}, unit_box);
  };
  check_passes(check(caster_fault::none));
  check_names(check(caster_fault::doubled), {"the ray from (", "hits at distance", "cast anew from halfway"});
  check_names(check(caster_fault::nan), {"has distance nan, expected finite and positive"});
  check_names(check(caster_fault::infinite), {"has distance inf, expected finite and positive"});
  check_names(check(caster_fault::zero), {"has distance 0, expected finite and positive"});
  check_names(check(caster_fault::negative), {"too few rays hit: 0 of", "misses with distance -"});
  check_names(check(caster_fault::dark, true), {"misses with environment radiance -1"});

  caster_check_options with_limits;
  with_limits.limits = true;
  check_passes(check(caster_fault::ignores_t_max));
  check_passes(check_ray_caster(exec, box_caster{}, unit_box, with_limits));
  check_names(check_ray_caster(exec, faulty_caster{caster_fault::ignores_t_max}, unit_box, with_limits),
              {"t_max is not respected", "expected a miss"});
  CHECK_THROWS_AS(check_ray_caster(exec, box_caster{}, wfpg::bounds3{}), std::invalid_argument);
  const auto refuses = [&](auto change) {
    caster_check_options options;
    change(options);
    CHECK_THROWS_AS(check_ray_caster(exec, box_caster{}, unit_box, options), std::invalid_argument);
  };
  refuses([](caster_check_options& o) { o.rays = 0; });
  refuses([](caster_check_options& o) { o.tolerance = 1.0f; });
  refuses([](caster_check_options& o) { o.tolerance = nan_value; });
  refuses([](caster_check_options& o) { o.least_distance = -1.0f; });
  refuses([](caster_check_options& o) { o.least_hits = 1.5; });
  refuses([](caster_check_options& o) { o.least_hits = std::nan(""); });
  refuses([](caster_check_options& o) { o.exceptions = -0.5; });

  check_passes(check_ray_caster(exec, shifted_caster{}, unit_box));
  check_names(check_ray_caster(exec, shifted_caster{1}, unit_box),
              {"batches answer for other rays", "as ray", "expected the same"});
  check_names(check_ray_caster(exec, shifted_caster{0, 3}, unit_box), {"distance nan, or none was written"});

  // A correct caster of another scene.
  const auto half = box_octree(exec, 32, 0.5f);
  check_names(check_ray_caster(exec, box_caster{}, half.view()),
              {"in no leaf of the octree", "voxel of side"});
}

TEST_CASE("check_surface: each fault is found and named", "[testing]") {
  const vec3 up(0.0f, 0.0f, 1.0f), aside = glm::normalize(vec3(0.6f, 0.0f, 0.8f));
  const test_surface right = make_surface(vec3(0.5f, 0.5f, 0.0f), up, aside);
  const auto check = [&](const auto& change) {
    test_surface s = right;
    change(s);
    return check_surface(s);
  };
  check_passes(check_surface(right));
  check_names(check([](auto& s) { s.position.y = nan_value; }),
              {"position is (0.5, nan, 0), expected finite"});
  check_names(check([](auto& s) { s.geometric_normal.x = nan_value; }), {"geometric_normal is (nan"});
  check_names(check([](auto& s) { s.normal.x = nan_value; }), {"normal is (nan"});
  check_names(check([](auto& s) { s.outgoing.x = infinity; }), {"outgoing is (inf"});
  check_names(check([](auto& s) { s.geometric_normal *= 2.0f; }), {"geometric_normal", "of length 2"});
  check_names(check([](auto& s) { s.normal *= 0.5f; }), {"normal is (0, 0, 0.5) of length 0.5"});
  check_names(check([](auto& s) { s.outgoing = vec3(0.0f); }), {"outgoing is (0, 0, 0) of length 0"});
  check_names(check([](auto& s) { s.outgoing = vec3(1.0f, 0.0f, 0.0f); }), {"lies in the surface"});
  check_names(check([](auto& s) { s.normal = -s.normal; }), {"dot product -1, expected on the same side"});
  check_passes(check([](auto& s) { s.active = false, s.normal = vec3(nan_value); }));

  const host_policy exec;
  const auto tree = box_octree(exec, 32);
  check_passes(check_surface(right, tree.view()));
  test_surface floating = right;
  floating.position.z = 0.3f;
  check_names(check_surface(floating, tree.view()), {"position (0.5, 0.5, 0.3) lies in no leaf"});
}
