// The renderer's own BVH, compared with all triangles in double precision. No leaks at edges and corners,
// triangles that cannot be hit, and equal answers on every policy.
#include "casters/bvh_scene.hpp"
#include "support/policies.hpp"
#include "support/random_meshes.hpp"

#include <wfpg/testing/check_ray_caster.hpp>

#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

using namespace wfpg_test;
using render::bvh_caster;
using render::bvh_scene;
using render::triangle_hit;
using wfpg::ray;
using wfpg::ray_hit;
using wfpg::vec3;

/// Types in kernels need names, for CUDA compilers.
namespace bvh_test {

struct answers {
  ray_hit hit;
  triangle_hit triangle;
  std::uint32_t occluded = 0;
};

struct ask {
  bvh_caster caster;
  wfpg::array_view<const ray> rays;
  wfpg::array_view<answers> found;
  WFPG_HD void operator()(std::size_t i) const {
    found[i].hit = caster(rays[i]);
    found[i].triangle = caster.intersect(rays[i]);
    found[i].occluded = caster.occluded(rays[i]) ? 1u : 0u;
  }
};

}  // namespace bvh_test

namespace {

using bvh_test::answers;
using bvh_test::ask;

constexpr float environment = 0.25f;

template <class Exec>
std::vector<answers> cast(const test_mesh& mesh, const std::vector<ray>& rays,
                          std::uint32_t leaf_triangles = 1) {
  const Exec exec;
  const device_mesh<Exec> triangles(exec, mesh);
  const bvh_scene<Exec> scene(exec, triangles.view(), environment, leaf_triangles);
  const wfpg::buffer<ray, Exec> asked(exec, rays);
  const wfpg::buffer<answers, Exec> found(exec, rays.size());
  exec.for_each(rays.size(), ask{scene.caster(), asked.view(), found.view()});
  return found.to_host(exec);
}

/// Where a ray crosses a triangle, and how far inside its edges. Negative: it misses.
struct crossing {
  double distance = -1.0;
  double inside = -1.0;  ///< the smallest barycentric weight
};

crossing cross_triangle(const ray& r, const test_mesh& mesh, std::size_t t) {
  const glm::dvec3 a(mesh.vertex(t, 0)), ab = glm::dvec3(mesh.vertex(t, 1)) - a;
  const glm::dvec3 ac = glm::dvec3(mesh.vertex(t, 2)) - a, d(r.direction), from = glm::dvec3(r.origin) - a;
  const glm::dvec3 p = glm::cross(d, ac), q = glm::cross(from, ab);
  const double determinant = glm::dot(ab, p);
  if (std::fabs(determinant) < 1e-14) return {};
  const double u = glm::dot(from, p) / determinant, v = glm::dot(d, q) / determinant;
  return {glm::dot(ac, q) / determinant, std::min(u, std::min(v, 1.0 - u - v))};
}

ray make_ray(vec3 origin, vec3 direction, float t_min = 0.0f, float t_max = 3.0e38f) {
  ray r;
  r.origin = origin;
  r.direction = glm::normalize(direction);
  r.t_min = t_min;
  r.t_max = t_max;
  return r;
}

std::vector<ray> random_rays(std::size_t n, std::uint64_t seed) {
  random_numbers random(seed);
  std::vector<ray> rays;
  for (std::size_t i = 0; i < n; ++i) {
    ray r = make_ray(random.point(-0.5f, 1.5f), random.direction());
    if (i % 5 == 1) r.t_max = random.between(0.1f, 1.0f);
    if (i % 5 == 2) r.t_min = random.between(0.1f, 0.5f);
    if (i % 7 == 3) r.direction = vec3(i % 2 ? 1.0f : -1.0f, 0.0f, 0.0f);
    rays.push_back(r);
  }
  return rays;
}

/// What is wrong with an answer. Empty if nothing is. Hits on a triangle's edge, or at an end of the ray, may
/// be missed.
std::string fault(const ray& r, const answers& found, const test_mesh& mesh) {
  constexpr double margin = 1e-4;
  double nearest = 1e30, nearest_perhaps = 1e30;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const crossing c = cross_triangle(r, mesh, t);
    const double slack = margin * std::max(1.0, c.distance);
    if (c.inside > -margin && c.distance > r.t_min - slack && c.distance < r.t_max + slack)
      nearest_perhaps = std::min(nearest_perhaps, c.distance);
    if (c.inside > margin && c.distance > r.t_min + slack && c.distance < r.t_max - slack)
      nearest = std::min(nearest, c.distance);
  }
  const bool hit = found.hit.is_hit();
  if (hit != found.triangle.is_hit() || hit != (found.occluded != 0)) return "the three forms disagree";
  if (!hit && found.hit.radiance != environment) return "a miss without the environment";
  if (!hit) return nearest < 1e30 ? "missed a triangle" : "";
  const double distance = found.hit.distance, slack = margin * std::max(1.0, distance);
  if (distance > nearest + slack) return "not the nearest";
  if (distance < nearest_perhaps - slack) return "hit nothing";
  if (!(distance > r.t_min && distance < r.t_max)) return "outside the ray's limits";
  const crossing own = cross_triangle(r, mesh, found.triangle.triangle);
  if (std::fabs(own.distance - distance) > slack && own.inside > margin) return "another triangle's distance";
  const double w = 1.0 - found.triangle.u - found.triangle.v;
  const glm::dvec3 point = w * glm::dvec3(mesh.vertex(found.triangle.triangle, 0)) +
                           double(found.triangle.u) * glm::dvec3(mesh.vertex(found.triangle.triangle, 1)) +
                           double(found.triangle.v) * glm::dvec3(mesh.vertex(found.triangle.triangle, 2));
  const glm::dvec3 expected = glm::dvec3(r.origin) + distance * glm::dvec3(r.direction);
  return glm::length(point - expected) > 10.0 * slack ? "barycentric weights of another point" : "";
}

void check_against_all(const test_mesh& mesh, const std::vector<ray>& rays,
                       const std::vector<answers>& found) {
  std::size_t faults = 0;
  std::string first;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const std::string what = fault(rays[i], found[i], mesh);
    if (!what.empty() && faults++ == 0) first = "ray " + std::to_string(i) + ": " + what;
  }
  INFO(first);
  CHECK(faults == 0);
}

/// A box whose faces are n x n squares each. The squares share their corners.
test_mesh fine_box(int n) {
  test_mesh mesh;
  for (int face = 0; face < 6; ++face)
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        const auto corner = [&](int x, int y) {
          vec3 p;
          p[face / 2] = face % 2 ? 0.73f : -0.41f;
          p[(face / 2 + 1) % 3] = -0.41f + 1.14f * static_cast<float>(x) / static_cast<float>(n);
          p[(face / 2 + 2) % 3] = -0.41f + 1.14f * static_cast<float>(y) / static_cast<float>(n);
          return p;
        };
        mesh.add(corner(i, j), corner(i + 1, j), corner(i + 1, j + 1));
        mesh.add(corner(i, j), corner(i + 1, j + 1), corner(i, j + 1));
      }
  return mesh;
}

/// Rays from inside to points on the mesh's edges and to its corners.
std::vector<ray> rays_through_edges(const test_mesh& mesh, std::size_t n) {
  random_numbers random(17);
  std::vector<ray> rays;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t t = random.below(static_cast<std::uint32_t>(mesh.triangles.size()));
    const vec3 a = mesh.vertex(t, static_cast<int>(i % 3)), b = mesh.vertex(t, static_cast<int>((i + 1) % 3));
    const vec3 origin = i % 4 == 0 ? vec3(0.16f) : random.point(-0.4f, 0.7f);
    rays.push_back(make_ray(origin, (i % 2 ? a : glm::mix(a, b, random.unit())) - origin));
  }
  return rays;
}

WFPG_TEST_CASE("a BVH agrees with a test of each triangle", "[renderer][bvh]") {
  const std::vector<ray> rays = random_rays(3000, 5);
  for (const test_mesh& mesh : {mixed_triangles(700, 0.001f, 0.7f, 3), long_slivers(60, 4), sphere_mesh(12),
                                mixed_triangles(1, 0.4f, 0.8f, 3), mixed_triangles(4, 0.4f, 0.8f, 3)})
    check_against_all(mesh, rays, cast<Exec>(mesh, rays));
}

WFPG_TEST_CASE("leaves of any size give the same hits", "[renderer][bvh]") {
  const test_mesh mesh = mixed_triangles(500, 0.01f, 0.3f, 8);
  const std::vector<ray> rays = random_rays(1000, 6);
  for (const std::uint32_t size : {1u, 2u, 5u, 7u})
    check_against_all(mesh, rays, cast<Exec>(mesh, rays, size));
}

WFPG_TEST_CASE("no ray leaks out of a closed box through edges and corners", "[renderer][bvh]") {
  for (const int n : {1, 9}) {
    const test_mesh box = fine_box(n);
    const std::vector<ray> rays = rays_through_edges(box, 100000);
    std::size_t leaks = 0;
    for (const answers& found : cast<Exec>(box, rays))
      leaks += !found.hit.is_hit() || !found.triangle.is_hit() || found.occluded == 0;
    CHECK(leaks == 0);
  }
}

WFPG_TEST_CASE("rays along axes and inside planes agree with brute force", "[renderer][bvh]") {
  const test_mesh box = fine_box(4);
  std::vector<ray> rays;
  for (int axis = 0; axis < 3; ++axis)
    for (const float sign : {-1.0f, 1.0f})
      for (const float where : {-0.41f, 0.16f, 0.445f, 0.73f}) {
        vec3 origin(where), direction(0.0f);
        origin[axis] = 0.1f;
        direction[axis] = sign;
        rays.push_back(make_ray(origin, direction));
      }
  const std::vector<answers> found = cast<Exec>(box, rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const int axis = static_cast<int>(i / 8);
    const float expected = rays[i].direction[axis] < 0.0f ? 0.51f : 0.63f;
    INFO("ray " << i);
    // Rays in a face lie on the outermost edges.
    CHECK(found[i].hit.is_hit());
    CHECK(found[i].hit.distance == Approx(expected).epsilon(1e-5));
  }
}

WFPG_TEST_CASE("a BVH passes the checks of a ray caster", "[renderer][bvh]") {
  const Exec exec;
  const device_mesh<Exec> box(exec, fine_box(5));
  const bvh_scene<Exec> scene(exec, box.view(), environment);
  wfpg::testing::caster_check_options options;
  options.limits = true;
  options.least_hits = 1.0;
  const auto report =
      wfpg::testing::check_ray_caster(exec, scene.caster(), wfpg::bounds3{vec3(-0.4f), vec3(0.7f)}, options);
  INFO(report.message);
  CHECK(report);
}

WFPG_TEST_CASE("degenerate and not finite triangles are never hit", "[renderer][bvh]") {
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              infinity = std::numeric_limits<float>::infinity();
  const vec3 a(0.0f), b(1.0f, 0.0f, 0.0f), c(0.0f, 1.0f, 0.0f);
  test_mesh bad;
  bad.add({nan, 0.0f, 0.0f}, b, c);
  bad.add(a, {1.0f, infinity, 0.0f}, c);
  bad.add(a, b, {0.0f, 1.0e30f, 0.0f});
  bad.add(a, a, a);
  bad.add(a, b, b);
  bad.add(a, b, 2.0f * b);
  bad.add(a, {0.1f, 0.7f, 0.3f}, 4.0f * vec3(0.1f, 0.7f, 0.3f));
  bad.triangles.push_back({0, 1, 1000000});
  const std::vector<ray> rays = random_rays(200, 9);
  std::size_t hits = 0;
  for (const test_mesh& mesh : {test_mesh{}, bad})
    for (const answers& found : cast<Exec>(mesh, rays)) hits += found.hit.is_hit() + found.occluded;
  CHECK(hits == 0);

  bad.add({0.0f, 0.0f, 0.5f}, {1.0f, 0.0f, 0.5f}, {0.0f, 1.0f, 0.5f});
  std::vector<ray> odd{make_ray({0.2f, 0.2f, 0.0f}, {0.0f, 0.0f, 1.0f})};
  odd.resize(5, odd[0]);
  odd[1].direction = vec3(nan);
  odd[2].direction = vec3(0.0f);
  odd[3].origin = vec3(infinity);
  odd[4].t_max = 0.0f;
  const std::vector<answers> found = cast<Exec>(bad, odd);
  CHECK(found[0].hit.distance == Approx(0.5f));
  CHECK(found[0].triangle.triangle == 8);
  for (std::size_t i = 1; i < odd.size(); ++i) CHECK_FALSE(found[i].hit.is_hit());
}

WFPG_TEST_CASE("triangles in one place, and many sizes at each scale, are found", "[renderer][bvh]") {
  test_mesh stacked, nested;
  for (int i = 0; i < 3000; ++i) stacked.add({0.0f, 0.0f, 0.5f}, {1.0f, 0.0f, 0.5f}, {0.0f, 1.0f, 0.5f});
  // Centres approach a corner, so each level of the tree splits off few triangles.
  for (int i = 0; i < 300; ++i) {
    const float scale = std::pow(0.8f, static_cast<float>(i));
    for (int k = 0; k < 7; ++k)
      nested.add(scale * vec3(1.0f, 0.1f * static_cast<float>(k), 0.0f), scale * vec3(1.0f, 0.0f, 1.0f),
                 scale * vec3(1.0f, 1.0f, 1.0f));
  }
  const std::vector<ray> rays = random_rays(300, 11);
  check_against_all(stacked, rays, cast<Exec>(stacked, rays));
  check_against_all(nested, rays, cast<Exec>(nested, rays));
}

WFPG_TEST_CASE("BVHs and hits are equal on all policies", "[renderer][bvh]") {
  const test_mesh mesh = mixed_triangles(2000, 0.005f, 0.2f, 12);
  const std::vector<ray> rays = random_rays(5000, 13);
  const std::vector<answers> first = cast<one_policy>(mesh, rays);
  const std::vector<answers> found = cast<Exec>(mesh, rays);
  CHECK(std::memcmp(found.data(), first.data(), found.size() * sizeof(answers)) == 0);
}

TEST_CASE("numbers of a leaf's triangles out of range are refused", "[renderer][bvh]") {
  const one_policy exec;
  const device_mesh<one_policy> box(exec, cuboid_mesh());
  CHECK_THROWS_AS(bvh_scene<one_policy>(exec, box.view(), 0.0f, 0), std::invalid_argument);
  CHECK_THROWS_AS(bvh_scene<one_policy>(exec, box.view(), 0.0f, 8), std::invalid_argument);
}

}  // namespace
