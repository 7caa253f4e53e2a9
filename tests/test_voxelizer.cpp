// The voxelizer, compared with brute-force overlap of triangles and voxels in double precision. Areas, bad
// input, and fragments from surface samples.
#include "support/brute_force_voxels.hpp"
#include "support/catch.hpp"
#include "support/policies.hpp"
#include "support/random_meshes.hpp"

#include <wfpg/octree/voxelizer.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace wfpg_test;
using glm::dvec3;
using wfpg::morton_code;
using wfpg::surface_fragment;
using wfpg::uvec3;
using wfpg::vec3;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

/// Fragments on the host.
struct fragments {
  std::vector<morton_code> codes;
  std::vector<std::uint32_t> normals;
  std::vector<float> areas;
  wfpg::voxel_grid grid;
  wfpg::build_report report;

  template <class Exec>
  fragments(const Exec& exec, const wfpg::voxel_fragments<Exec>& device)
      : codes(device.codes.to_host(exec)), grid(device.grid), report(device.report) {
    for (const wfpg::fragment_surface& s : device.surfaces.to_host(exec)) {
      normals.push_back(s.normal);
      areas.push_back(s.area);
    }
  }
  double area() const {
    double sum = 0.0;
    for (const float a : areas) sum += a;
    return sum;
  }
  bool operator==(const fragments& other) const {
    return codes == other.codes && normals == other.normals && areas == other.areas &&
           grid.origin == other.grid.origin && grid.side == other.grid.side;
  }
};

template <class Exec>
fragments fragments_of(const Exec& exec, const test_mesh& mesh, std::uint32_t resolution) {
  return fragments(exec, voxelized(exec, mesh, resolution));
}

/// A mesh and its brute-force voxels, computed once for all policies.
struct scenario {
  std::string name;
  test_mesh mesh;
  std::uint32_t resolution;
  bool area_once = true;  ///< false if a triangle lies between voxels, where its area counts twice
  std::unique_ptr<const fragments> first{};
  touched_voxels truth{};
};

/// Triangles with corners at voxels' corners, or in a plane between voxels.
test_mesh snapped_triangles() {
  // The box makes voxels of 17/256 from -8/256. Whole steps are their faces, half steps their centres.
  random_numbers random(21);
  test_mesh mesh = cuboid_mesh();
  const auto coordinate = [&] { return (8.5f * static_cast<float>(1 + random.below(31)) - 8.0f) / 256.0f; };
  while (mesh.triangles.size() < 150) {
    vec3 p[3];
    const int flat = static_cast<int>(random.below(4));  // 3: along no axis
    const float level = coordinate();
    for (vec3& v : p) {
      v = {coordinate(), coordinate(), coordinate()};
      if (flat < 3) v[flat] = level;
    }
    if (glm::length(glm::cross(p[1] - p[0], p[2] - p[0])) > 1.0e-4f) mesh.add(p[0], p[1], p[2]);
  }
  return mesh;
}

test_mesh walls() {
  test_mesh mesh = cuboid_mesh();
  mesh.add_quad({0, 0, 0.3f}, {1, 0, 0}, {0, 1, 0});
  mesh.add_quad({0, 0, 0}, {1, 0, 1}, {0, 1, 0});
  mesh.add({0, 0, 1}, {1, 0, 0}, {0, 1, 0});
  mesh.add({0.001f, 0, 0}, {0, 1, 0}, {1, 1, 0.999f});
  const test_mesh dust = mixed_triangles(300, 1.0e-5f, 1.0e-3f, 22);
  for (std::size_t t = 0; t < dust.triangles.size(); ++t)
    mesh.add(dust.vertex(t, 0), dust.vertex(t, 1), dust.vertex(t, 2));
  return mesh;
}

test_mesh flat_mesh() {
  test_mesh mesh = mixed_triangles(60, 0.01f, 0.7f, 23);
  for (vec3& p : mesh.positions) p.y = 0.25f;
  test_mesh kept;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const vec3 a = mesh.vertex(t, 0), b = mesh.vertex(t, 1), c = mesh.vertex(t, 2);
    if (glm::length(glm::cross(b - a, c - a)) > 1.0e-4f) kept.add(a, b, c);
  }
  return kept;
}

/// Needles of which the short edge is shorter than the spacing of floats at the tip. They begin with one of
/// its ends: a triangle that begins with its tip has no area in floats.
test_mesh needles() {
  test_mesh mesh;
  for (const float height : {0.25f, 0.55f}) {
    const vec3 tip(1.0f, 0.625f, height), ends[2] = {{0.0f, 0.0f, 0.25f}, {0.0f, 3.0e-8f, 0.25f}};
    for (const int i : {0, 1}) {
      mesh.add(ends[i], tip, ends[1 - i]);
      mesh.add(ends[i], ends[1 - i], tip);
    }
  }
  return mesh;
}

test_mesh huge_with_details() {
  test_mesh mesh;
  mesh.add({-5.0e5f, -4.0e5f, -3.0e5f}, {5.0e5f, 1.0e5f, 0}, {0, 5.0e5f, 3.0e5f});
  mesh.add({5.0e5f, 5.0e5f, 5.0e5f}, {5.0e5f, 5.0e5f, 4.0e5f}, {5.0e5f, 4.0e5f, 5.0e5f});
  random_numbers random(24);
  for (int i = 0; i < 100; ++i) {
    const vec3 a = random.point(-1.0e-3f, 1.0e-3f);
    mesh.add(a, a + 1.0e-6f * random.direction(), a + 1.0e-6f * random.direction());
  }
  return mesh;
}

std::vector<scenario> all_scenarios() {
  std::vector<scenario> all;
  const auto add = [&](const char* name, test_mesh mesh, std::uint32_t resolution, bool area_once = true) {
    scenario s{name, std::move(mesh), resolution, area_once};
    const one_policy exec;
    s.first = std::make_unique<const fragments>(fragments_of(exec, s.mesh, resolution));
    s.truth = brute_force(s.mesh, s.first->grid);
    all.push_back(std::move(s));
  };
  for (const std::uint32_t resolution : {1u, 2u, 16u, 64u})
    add("mixed", mixed_triangles(200, 1.0e-4f, 1.0f, resolution), resolution);
  add("mixed, fine", mixed_triangles(100, 1.0e-4f, 0.02f, 31), 1024);
  add("far below a voxel", mixed_triangles(2000, 1.0e-6f, 1.0e-4f, 32), 64);
  add("slivers", long_slivers(60, 33), 64);
  add("slivers, fine", long_slivers(1, 15), 1024);
  add("needles", needles(), 64, false);
  test_mesh sliver;  // three voxels wide, and it begins with its tip, where rounding tilts its normal most
  sliver.add({0.0116f, 0.0244f, 0.1466f}, {0.7656f, 0.9090f, 0.6714f}, {0.76503f, 0.90937f, 0.67161f});
  add("sliver, finest", std::move(sliver), 4096);
  add("snapped", snapped_triangles(), 16, false);
  add("walls", walls(), 32, false);
  add("flat", flat_mesh(), 32, false);
  add("sphere", sphere_mesh(12, {100, -50, 3}, 0.1f), 64);
  add("huge with details", huge_with_details(), 128);
  return all;
}

const std::vector<scenario>& scenarios() {
  static const std::vector<scenario> all = all_scenarios();
  return all;
}

WFPG_TEST_CASE("no touched voxel is missed, and none is extra", "[voxelizer]") {
  const Exec exec;
  for (const scenario& s : scenarios()) {
    const fragments f = fragments_of(exec, s.mesh, s.resolution);
    std::map<morton_code, std::uint32_t> count;
    for (const morton_code code : f.codes) ++count[code];
    std::size_t missed = 0, extra = 0, outside = 0;
    for (const auto& [code, expected] : s.truth) {
      const auto found = count.find(code);
      const std::uint32_t n = found == count.end() ? 0 : found->second;
      missed += n < expected.certainly ? 1 : 0;
      extra += n > expected.perhaps ? 1 : 0;
    }
    for (const auto& [code, n] : count) outside += s.truth.count(code) ? 0 : 1;
    INFO(s.name << ", resolution " << s.resolution << ", " << f.codes.size() << " fragments");
    CHECK(f.codes.size() > 0);
    CHECK(missed == 0);
    CHECK(extra == 0);
    CHECK(outside == 0);
    CHECK(f.report.skipped() == 0);
    CHECK((f == *s.first));  // the same bits on every policy
  }
}

// The test above has found these fragments on every policy.
TEST_CASE("areas inside the voxels add up to the triangles'", "[voxelizer]") {
  for (const scenario& s : scenarios()) {
    if (!s.area_once) continue;
    const fragments& f = *s.first;
    const float voxel = f.grid.voxel_size();
    INFO(s.name << ", resolution " << s.resolution);
    CHECK(f.area() == Approx(s.mesh.area()).epsilon(1.0e-3));
    CHECK(*std::min_element(f.areas.begin(), f.areas.end()) >= 0.0f);
    CHECK(*std::max_element(f.areas.begin(), f.areas.end()) <= 1.42f * voxel * voxel);  // sqrt(2) for a cube
  }
}

WFPG_TEST_CASE("a wall's fragments have its normal and their part of its area", "[voxelizer]") {
  const Exec exec;
  test_mesh mesh;
  mesh.add_quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  mesh.add_quad({0, 0, 1}, {0, 1, 0}, {1, 0, 0});
  const fragments f = fragments_of(exec, mesh, 4);  // the walls begin 0.4 voxels inside
  std::map<morton_code, double> areas;
  for (std::size_t i = 0; i < f.codes.size(); ++i) {
    areas[f.codes[i]] += f.areas[i];
    const bool lower = wfpg::morton_decode(f.codes[i]).z == 0;
    CHECK(glm::length(wfpg::unpack_direction(f.normals[i]) - vec3(0, 0, lower ? 1 : -1)) < 2.0e-4f);
  }
  CHECK(areas.size() == 32);
  const double voxel = f.grid.voxel_size();
  for (const auto& [code, area] : areas) {
    const uvec3 p = wfpg::morton_decode(code);
    const double x = p.x == 0 || p.x == 3 ? 0.6 : 1.0, y = p.y == 0 || p.y == 3 ? 0.6 : 1.0;
    CHECK((p.z == 0 || p.z == 3));
    CHECK(area == Approx(x * y * voxel * voxel).epsilon(1.0e-4));
  }
}

TEST_CASE("the grid is a cube around the mesh with half a voxel to spare", "[voxelizer]") {
  for (const scenario& s : scenarios()) {
    const wfpg::voxel_grid grid = s.first->grid;
    INFO(s.name << ", resolution " << s.resolution);
    CHECK(grid.resolution == s.resolution);
    float least = infinity, largest = 0.0f;
    bool inside = true;
    for (const vec3 p : s.mesh.positions) {
      uvec3 voxel(0u);
      inside &= grid.voxel_of(p, voxel);
      const vec3 g = grid.to_grid(p);
      for (int axis = 0; axis < 3; ++axis) {
        least = std::min({least, g[axis], static_cast<float>(s.resolution) - g[axis]});
        largest = std::max(largest, g[axis]);
      }
    }
    CHECK(inside);
    const float resolution = static_cast<float>(s.resolution);
    CHECK(least > 0.49f * resolution / (resolution + 1.0f));
    if (s.name != "sphere") CHECK(least < 0.51f);
    if (s.name != "sphere") CHECK(largest > 0.49f * resolution);
  }
}

test_mesh good_triangles() {
  return mixed_triangles(20, 0.1f, 0.5f, 41);
}

WFPG_TEST_CASE("bad triangles are skipped and counted", "[voxelizer]") {
  const Exec exec;
  const test_mesh good = good_triangles();
  test_mesh mesh = good;
  const auto add_bad = [&](vec3 p) { mesh.add({0.5f, 0.5f, 0.5f}, {0.6f, 0.5f, 0.5f}, p); };
  for (const float bad : {nan, infinity, -infinity, 2.0e15f, -3.0e38f})
    for (int axis = 0; axis < 3; ++axis) {
      vec3 p(0.5f);
      p[axis] = bad;
      add_bad(p);
    }
  mesh.triangles.push_back({3, 3, 3});
  mesh.triangles.push_back({3, 4, 3});
  mesh.add({0.5f, 0.5f, 0.5f}, {0.75f, 0.5f, 0.5f}, {1.0f, 0.5f, 0.5f});
  mesh.add({0, 0, 0}, {0, 0, 0}, {0, 0, 0});
  const auto n = static_cast<std::uint32_t>(mesh.positions.size());
  for (const uvec3 indices : {uvec3(n, 0, 1), uvec3(0, n + 5, 1), uvec3(0, 1, 0xffffffffu)})
    mesh.triangles.push_back(indices);

  const fragments all = fragments_of(exec, mesh, 32), clean = fragments_of(exec, good, 32);
  CHECK(all.report.non_finite == 15);
  CHECK(all.report.out_of_range == 3);
  CHECK(all.report.degenerate == 4);
  CHECK(all.report.skipped() == 22);
  CHECK(clean.report.skipped() == 0);
  CHECK((all == clean));
}

WFPG_TEST_CASE("meshes without triangles give no fragments", "[voxelizer]") {
  const Exec exec;
  test_mesh mesh;
  CHECK(voxelized(exec, mesh, 64).size() == 0);
  mesh.positions = {vec3(0.0f), vec3(1.0f)};
  CHECK(voxelized(exec, mesh, 64).size() == 0);
  CHECK(voxelized(exec, mesh, 64).grid.resolution == 64);
  mesh.triangles = {uvec3(0, 1, 2), uvec3(0, 0, 1)};
  const auto bad = voxelized(exec, mesh, 64);
  CHECK(bad.size() == 0);
  CHECK(bad.report.out_of_range == 1);
  CHECK(bad.report.degenerate == 1);
  CHECK(std::isfinite(bad.grid.side));
  mesh.positions.assign(3, vec3(7.0f, 8.0f, 9.0f));
  mesh.triangles.assign(1, uvec3(0, 1, 2));
  CHECK(voxelized(exec, mesh, 64).report.degenerate == 1);
}

WFPG_TEST_CASE("meshes of extreme scales voxelize", "[voxelizer]") {
  const Exec exec;
  for (const float scale : {1.0e-9f, 1.0e-4f, 1.0e4f, 9.0e14f}) {
    test_mesh mesh = sphere_mesh(6);
    for (vec3& p : mesh.positions) p *= scale;
    const fragments f = fragments_of(exec, mesh, 32);
    INFO("scale " << scale);
    CHECK(f.report.skipped() == 0);
    CHECK(f.codes.size() > 500);
    CHECK(f.area() == Approx(mesh.area()).epsilon(1.0e-3));
  }
}

WFPG_TEST_CASE("resolutions that are not powers of two are refused", "[voxelizer]") {
  const Exec exec;
  const test_mesh mesh = good_triangles();
  const wfpg::buffer<surface_fragment, Exec> samples(exec, std::vector<surface_fragment>(1));
  for (const std::uint32_t bad : {0u, 3u, 100u, 8192u, 1u << 20, 0xffffffffu}) {
    INFO(bad);
    CHECK_THROWS_AS(voxelized(exec, mesh, bad), std::invalid_argument);
    CHECK_THROWS_AS(wfpg::fragments_from_samples(exec, const_view(samples), bad), std::invalid_argument);
  }
  test_mesh thin;
  thin.add({0, 0, 0}, {1, 0, 0}, {0, 1.0e-4f, 0});
  for (const std::uint32_t good : {1u, 2u, 1024u, 4096u})
    CHECK(voxelized(exec, thin, good).size() >= good / 2);
}

template <class Exec>
fragments from_samples(const Exec& exec, const std::vector<surface_fragment>& samples,
                       std::uint32_t resolution, const wfpg::bounds3& bounds = {}) {
  const wfpg::buffer<surface_fragment, Exec> device(exec, samples);
  return fragments(exec, wfpg::fragments_from_samples(exec, const_view(device), resolution, bounds));
}

/// Whether directions packed on a policy and on the host agree. They agree bit for bit, or to one step of the
/// packing if a GPU rounds differently.
bool same_packed(std::uint32_t a, std::uint32_t b) {
  if (same_operations_same_bits) return a == b;
  return glm::distance(wfpg::unpack_direction(a), wfpg::unpack_direction(b)) < 2.0e-4f;
}

WFPG_TEST_CASE("samples become fragments of the voxels that hold them", "[voxelizer]") {
  const Exec exec;
  random_numbers random(51);
  std::vector<surface_fragment> samples;
  for (int i = 0; i < 3000; ++i) {
    const vec3 p = random.point(-2.0f, 3.0f);
    samples.push_back({p, random.direction(), random.between(0.1f, 2.0f)});
  }
  for (const bool with_bounds : {false, true}) {
    const wfpg::bounds3 bounds{vec3(-1.0f), vec3(2.0f)};
    const fragments f =
        with_bounds ? from_samples(exec, samples, 16, bounds) : from_samples(exec, samples, 16);
    std::size_t used = 0, wrong = 0;
    for (const surface_fragment& s : samples) {
      const dvec3 g = (dvec3(s.position) - dvec3(f.grid.origin)) * (16.0 / f.grid.side);
      const dvec3 nearest_face = glm::abs(g - glm::round(g));
      if (glm::any(glm::lessThan(g, dvec3(0))) || glm::any(glm::greaterThanEqual(g, dvec3(16)))) continue;
      const bool on_face = glm::any(glm::lessThan(nearest_face, dvec3(1.0e-5)));
      wrong += used >= f.codes.size() || (!on_face && f.codes[used] != wfpg::morton_encode(uvec3(g))) ||
               f.areas[used] != s.area ||
               !same_packed(f.normals[used], wfpg::pack_direction(glm::normalize(s.normal)));
      ++used;
    }
    CHECK(wrong == 0);
    CHECK(f.codes.size() == used);
    CHECK((with_bounds ? used < 3000 && used > 300 : used == 3000));
    CHECK(f.report.out_of_range == 3000 - used);
    CHECK(f.report.skipped() == f.report.out_of_range);
    if (with_bounds) CHECK(f.grid.side == Approx(3.0 * 17 / 16));
  }
}

WFPG_TEST_CASE("bad samples are skipped and counted", "[voxelizer]") {
  const Exec exec;
  const vec3 up(0, 0, 1), inside(0.5f);
  const std::vector<surface_fragment> samples = {
      {inside, up, 1.0f},
      {{nan, 0, 0}, up, 1.0f},
      {{0, infinity, 0}, up, 1.0f},
      {{0, 0, 1.0e30f}, up, 1.0f},
      {{2, 0, 0}, up, 1.0f},
      {{0, -7, 0}, up, 1.0f},
      {inside, vec3(0.0f), 1.0f},
      {inside, {nan, 0, 0}, 1.0f},
      {inside, {0, 0, 2}, 1.0f},
      {inside, {0, 0, infinity}, 1.0f},
      {inside, up, 0.0f},
      {inside, up, -1.0f},
      {inside, up, nan},
      {inside, up, infinity},
      {inside, -up, 2.0f},
  };
  const fragments f = from_samples(exec, samples, 8, {vec3(0.0f), vec3(1.0f)});
  CHECK(f.report.non_finite == 3);
  CHECK(f.report.out_of_range == 2);
  CHECK(f.report.degenerate == 8);
  CHECK((f.areas == std::vector<float>{1.0f, 2.0f}));
  CHECK(from_samples(exec, {}, 8).codes.empty());
  CHECK(from_samples(exec, {samples[1], samples[6]}, 8).codes.empty());
}

WFPG_TEST_CASE("a single point gives a single voxel", "[voxelizer]") {
  const Exec exec;
  for (const vec3 p : {vec3(0.0f), vec3(3, 4, 5), vec3(-1.0e10f, 2, 0), vec3(1.0e-20f), vec3(1.0e15f)})
    for (const std::uint32_t resolution : {1u, 64u, 1024u}) {
      const fragments f = from_samples(exec, {{p, {0, 1, 0}, 1.0f}}, resolution);
      INFO(p.x << ", resolution " << resolution);
      REQUIRE(f.codes.size() == 1);
      uvec3 voxel(0u);
      REQUIRE(f.grid.voxel_of(p, voxel));
      const glm::ivec3 away = glm::abs(glm::ivec3(wfpg::morton_decode(f.codes[0])) - glm::ivec3(voxel));
      // A point between two voxels, such as the centre of the grid, may round to either.
      CHECK(glm::max(away.x, glm::max(away.y, away.z)) <= (same_operations_same_bits ? 0 : 1));
    }
}

}  // namespace
