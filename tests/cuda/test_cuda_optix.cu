// OptiX's caster, compared with a test of every triangle in double precision. Also meshes and rays that are
// invalid.
#include "casters/optix_caster.hpp"
#include "support/random_meshes.hpp"

#include <wfpg/host/ray_caster.hpp>

#include <cmath>
#include <limits>
#include <optional>
#include <vector>

using namespace wfpg_test;
using cuda_policy = wfpg::exec::cuda;
using glm::dvec3;
using wfpg::vec3;

static_assert(wfpg::is_batch_caster_v<render::optix_caster, cuda_policy>, "it is a caster of batches");
static_assert(std::is_trivially_copyable_v<render::optix_caster>, "it is a handle");

namespace {

constexpr float environment = 0.25f;
constexpr float quiet_nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();
// Within this distance of a triangle's edge, or of a ray's end, OptiX may hit or miss.
constexpr double slack = 1.0e-4;

struct answers {
  std::vector<render::triangle_hit> hits;
  std::vector<std::uint32_t> hidden;
  std::vector<wfpg::ray_hit> distances;
};

/// Builds OptiX's scene of a mesh, and frees the mesh's device memory.
render::optix_scene build(const cuda_policy& exec, const test_mesh& mesh) {
  const device_mesh<cuda_policy> on_device(exec, mesh);
  return {exec, on_device.view().positions, on_device.view().triangles, environment};
}

answers ask(const cuda_policy& exec, const render::optix_caster& caster, const std::vector<wfpg::ray>& host) {
  const wfpg::buffer<wfpg::ray, cuda_policy> rays(exec, host);
  const wfpg::buffer<render::triangle_hit, cuda_policy> hits(exec, host.size());
  const wfpg::buffer<std::uint32_t, cuda_policy> hidden(exec, host.size());
  const wfpg::buffer<wfpg::ray_hit, cuda_policy> distances(exec, host.size());
  caster.intersect(exec, rays.view(), hits.view());
  caster.occluded(exec, rays.view(), hidden.view());
  caster.cast(exec, rays.view(), distances.view());
  return {hits.to_host(exec), hidden.to_host(exec), distances.to_host(exec)};
}

struct crossing {
  double distance, u, v;

  double to_edge() const { return std::fmin(1.0 - u - v, std::fmin(u, v)); }
  double to_end(const wfpg::ray& r) const { return std::fmin(distance - r.t_min, r.t_max - distance); }
};

/// Where a ray's line crosses a triangle's plane (Möller and Trumbore 1997). Empty if they are parallel.
std::optional<crossing> cross(const wfpg::ray& ray, const test_mesh& mesh, std::size_t triangle) {
  const dvec3 a(mesh.vertex(triangle, 0)), direction(ray.direction), from_a = dvec3(ray.origin) - a;
  const dvec3 ab = dvec3(mesh.vertex(triangle, 1)) - a, ac = dvec3(mesh.vertex(triangle, 2)) - a;
  const dvec3 p = glm::cross(direction, ac), q = glm::cross(from_a, ab);
  const double determinant = glm::dot(ab, p);
  if (!(std::fabs(determinant) > 1.0e-12)) return {};
  return crossing{glm::dot(ac, q) / determinant, glm::dot(from_a, p) / determinant,
                  glm::dot(direction, q) / determinant};
}

/// The distance of the nearest triangle that OptiX must hit despite rounding.
std::optional<double> nearest(const wfpg::ray& ray, const test_mesh& mesh) {
  std::optional<double> result;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto at = cross(ray, mesh, t);
    if (at && at->to_edge() > slack && at->to_end(ray) > slack && !(result && *result < at->distance))
      result = at->distance;
  }
  return result;
}

/// What is wrong with the answers to a ray. Null if nothing is.
const char* mistake(const wfpg::ray& ray, const test_mesh& mesh, render::triangle_hit hit,
                    std::uint32_t hidden, wfpg::ray_hit at) {
  const auto expected = nearest(ray, mesh);
  if (at.is_hit() != hit.is_hit() || (hidden == 1) != hit.is_hit() || hidden > 1)
    return "the queries disagree";
  if (!hit.is_hit()) {
    if (at.distance != -1.0f || at.radiance != environment) return "a miss is not what the guider reads";
    return expected ? "a triangle was missed" : nullptr;
  }
  if (hit.triangle >= mesh.triangles.size() || at.radiance != 0.0f) return "a hit makes no sense";
  const auto found = cross(ray, mesh, hit.triangle);
  if (!found || found->to_edge() < -slack || found->to_end(ray) < -slack)
    return "the triangle is not on the ray";
  if (!(at.distance > ray.t_min && at.distance < ray.t_max)) return "the distance is outside the ray";
  if (std::fabs(found->u - hit.u) > slack || std::fabs(found->v - hit.v) > slack)
    return "the barycentric weights are others";
  if (std::fabs(found->distance - at.distance) > slack) return "the distance is another";
  return expected && *expected < found->distance - slack ? "a nearer triangle was missed" : nullptr;
}

/// The number of hits. Fails at the first mistake.
std::size_t count_hits(const test_mesh& mesh, const std::vector<wfpg::ray>& rays, const answers& found) {
  std::size_t hits = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const char* const wrong = mistake(rays[i], mesh, found.hits[i], found.hidden[i], found.distances[i]);
    INFO("ray " << i << ": " << (wrong ? wrong : ""));
    REQUIRE(wrong == nullptr);
    hits += found.hits[i].is_hit();
  }
  return hits;
}

std::vector<wfpg::ray> random_rays(std::size_t n, std::uint64_t seed) {
  random_numbers random(seed);
  std::vector<wfpg::ray> rays(n);
  for (wfpg::ray& r : rays) {
    r.origin = random.point(-0.2f, 1.2f);
    r.direction = random.direction();
  }
  return rays;
}

/// Triangles in the unit cube with edges of about length `size`.
test_mesh even_triangles(std::size_t n, float size, std::uint64_t seed) {
  random_numbers random(seed);
  test_mesh mesh;
  for (std::size_t i = 0; i < n; ++i) {
    const vec3 a = random.point(0.0f, 1.0f), along = random.direction(),
               aside = glm::normalize(glm::cross(along, random.direction()));
    mesh.add(a, a + size * along, a + size * (0.5f * along + aside));
  }
  return mesh;
}

bool all_miss(const answers& found) {
  for (std::size_t i = 0; i < found.hits.size(); ++i)
    if (found.hits[i].is_hit() || found.hidden[i] != 0 || found.distances[i].distance != -1.0f ||
        found.distances[i].radiance != environment)
      return false;
  return true;
}

}  // namespace

TEST_CASE("OptiX finds the same triangles as a test of each of them", "[optix]") {
  const cuda_policy exec;
  const test_mesh mesh = even_triangles(2000, 0.1f, 1);
  const std::vector<wfpg::ray> rays = random_rays(20000, 2);
  const render::optix_scene scene = build(exec, mesh);
  CHECK(scene.bytes() > 0);
  const std::size_t hits = count_hits(mesh, rays, ask(exec, scene.caster(), rays));
  CHECK(hits > 5000);
  CHECK(hits < 15000);
}

TEST_CASE("OptiX respects a ray's ends", "[optix]") {
  const cuda_policy exec;
  const test_mesh mesh = even_triangles(2000, 0.1f, 3);
  std::vector<wfpg::ray> rays = random_rays(20000, 4);
  random_numbers random(5);
  for (wfpg::ray& r : rays) {
    r.t_min = random.between(0.0f, 0.3f);
    r.t_max = r.t_min + random.between(0.0f, 0.3f);
  }
  const render::optix_scene scene = build(exec, mesh);
  CHECK(count_hits(mesh, rays, ask(exec, scene.caster(), rays)) > 2000);

  const vec3 inside(0.5f), up(0.0f, 0.0f, 1.0f);
  const test_mesh box = cuboid_mesh();
  const render::optix_scene boxed = build(exec, box);
  const std::vector<wfpg::ray> sound{{inside, 0.0f, up, infinity},
                                     {inside, -1.0f, up, 1.0f},
                                     {inside, -infinity, up, 0.6f},
                                     {inside, 0.4f, up, 0.6f}};
  const answers hit = ask(exec, boxed.caster(), sound);
  for (const wfpg::ray_hit& at : hit.distances) CHECK(at.distance == Approx(0.5f));
  const std::vector<wfpg::ray> none{
      {inside, 1.0f, up, 0.0f},          {inside, 1.0f, up, 1.0f},        {inside, 0.0f, up, 0.4f},
      {inside, 0.6f, up, 3.0e38f},       {inside, quiet_nan, up, 1.0f},   {inside, 0.0f, up, quiet_nan},
      {vec3(quiet_nan), 0.0f, up, 1.0f}, {inside, 0.0f, vec3(quiet_nan)}, {vec3(infinity), 0.0f, up, 1.0f},
      {inside, 0.0f, vec3(infinity)},    {inside, -2.0f, up, -1.0f}};
  CHECK(all_miss(ask(exec, boxed.caster(), none)));
}

TEST_CASE("OptiX hits both sides of a triangle", "[optix]") {
  const cuda_policy exec;
  test_mesh mesh;
  mesh.add({-1, -1, 0}, {1, -1, 0}, {0, 1, 0});
  const render::optix_scene scene = build(exec, mesh);
  const answers found =
      ask(exec, scene.caster(), {{{0, 0, 1}, 0.0f, {0, 0, -1}}, {{0, 0, -1}, 0.0f, {0, 0, 1}}});
  for (const render::triangle_hit& hit : found.hits) {
    CHECK(hit.triangle == 0);
    CHECK(hit.u == Approx(0.25f));
    CHECK(hit.v == Approx(0.5f));
  }
}

TEST_CASE("all rays miss in a scene without triangles", "[optix]") {
  const cuda_policy exec;
  const std::vector<wfpg::ray> rays = random_rays(1000, 6);
  test_mesh without_triangles, without_positions;
  without_triangles.positions = {vec3(0.0f), vec3(1.0f)};
  without_positions.triangles = {{0, 1, 2}};
  for (const test_mesh& mesh : {test_mesh(), without_triangles, without_positions})
    CHECK(all_miss(ask(exec, build(exec, mesh).caster(), rays)));
  const answers nothing = ask(exec, build(exec, cuboid_mesh()).caster(), {});
  CHECK(nothing.hits.empty());
}

TEST_CASE("OptiX skips triangles that are degenerate, not finite or missing", "[optix]") {
  const cuda_policy exec;
  const test_mesh sound = even_triangles(500, 0.1f, 7);
  const std::vector<wfpg::ray> rays = random_rays(20000, 8);
  test_mesh mesh = sound;
  random_numbers random(9);
  for (int i = 0; i < 100; ++i) {
    const vec3 a = random.point(0.0f, 1.0f), b = random.point(0.0f, 1.0f);
    mesh.add(a, a, a);
    mesh.add(a, b, b);
    mesh.add(a, b, vec3(quiet_nan));
    mesh.add(vec3(0.0f, quiet_nan, 0.0f), vec3(quiet_nan), vec3(quiet_nan));
    mesh.add(a, vec3(infinity, 0.0f, 0.0f), b);
    mesh.add(vec3(-infinity), vec3(infinity), vec3(quiet_nan, infinity, -infinity));
  }
  const auto count = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.triangles.push_back({0, 1, count});
  mesh.triangles.push_back({0xffffffffu, 0xffffffffu, 0xffffffffu});
  const render::optix_scene scene = build(exec, mesh);
  CHECK(count_hits(sound, rays, ask(exec, scene.caster(), rays)) > 2000);

  mesh.triangles.erase(mesh.triangles.begin(), mesh.triangles.begin() + 500);
  CHECK(all_miss(ask(exec, build(exec, mesh).caster(), rays)));
}

TEST_CASE("several OptiX launches may be in flight at once", "[optix]") {
  cudaStream_t streams[2];
  for (cudaStream_t& stream : streams)
    REQUIRE(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking) == cudaSuccess);
  {
    const cuda_policy exec(streams[0]);
    const test_mesh mesh = even_triangles(500, 0.1f, 10);
    render::optix_scene built = build(exec, mesh);
    const render::optix_caster caster = built.caster();
    const render::optix_scene scene = std::move(built);  // casters stay valid
    constexpr std::size_t launches = 200, size = 1000;
    const std::vector<wfpg::ray> host = random_rays(launches * size, 11);
    const answers expected = ask(exec, caster, host);

    const wfpg::buffer<wfpg::ray, cuda_policy> rays(exec, host);
    const wfpg::buffer<render::triangle_hit, cuda_policy> hits(exec, host.size());
    const wfpg::buffer<std::uint32_t, cuda_policy> hidden(exec, host.size());
    const wfpg::buffer<wfpg::ray_hit, cuda_policy> distances(exec, host.size());
    REQUIRE(cudaStreamSynchronize(streams[0]) == cudaSuccess);
    for (std::size_t i = 0; i < launches; ++i) {
      const cuda_policy on(streams[i % 2]);
      const wfpg::array_view<const wfpg::ray> part = rays.view().subview(i * size, size);
      caster.intersect(on, part, hits.view().subview(i * size, size));
      caster.occluded(on, part, hidden.view().subview(i * size, size));
      caster.cast(on, part, distances.view().subview(i * size, size));
    }
    REQUIRE(cudaStreamSynchronize(streams[1]) == cudaSuccess);
    const answers found{hits.to_host(exec), hidden.to_host(exec), distances.to_host(exec)};
    std::size_t different = 0;
    for (std::size_t i = 0; i < host.size(); ++i)
      different += found.hits[i].triangle != expected.hits[i].triangle ||
                   found.hidden[i] != expected.hidden[i] ||
                   found.distances[i].distance != expected.distances[i].distance;
    CHECK(different == 0);
  }
  for (const cudaStream_t stream : streams) CHECK(cudaStreamDestroy(stream) == cudaSuccess);
}
