// Octrees from few hits: no holes between hits, none added where hits are dense, normals of the hits, bad
// hits, and the same bits on all policies.
#include "support/fragments.hpp"
#include "support/policies.hpp"

#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/octree/fragments_from_hits.hpp>
#include <wfpg/octree/surface_collector.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <vector>

using namespace wfpg_test;
using wfpg::bounds3;
using wfpg::surface_fragment;
using wfpg::vec3;

namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr std::uint32_t resolution = 64;

/// Axes of a box that is turned, so that its faces lie along none of the grid's.
std::vector<vec3> turned_axes() {
  const float c = std::cos(0.4f), s = std::sin(0.4f);
  return {{c, s, 0.0f}, {-s * c, c * c, s}, {s * s, -c * s, c}};
}

/// Random hits on the faces of the turned box of half side 1. `sparse`: of those where x > 0 so many fewer.
std::vector<surface_fragment> hits_on_box(std::size_t n, std::uint64_t seed, std::uint32_t sparse = 1) {
  const std::vector<vec3> axes = turned_axes();
  random_numbers random(seed);
  std::vector<surface_fragment> hits;
  while (hits.size() < n) {
    const std::uint32_t face = random.below(6), axis = face % 3;
    const float side = face < 3 ? -1.0f : 1.0f;
    const float u = random.between(-1.0f, 1.0f), v = random.between(-1.0f, 1.0f);
    surface_fragment hit;
    hit.position = side * axes[axis] + u * axes[(axis + 1) % 3] + v * axes[(axis + 2) % 3];
    hit.normal = (random.below(2) == 0 ? 1.0f : -1.0f) * axes[axis];
    if (hit.position.x <= 0.0f || random.below(sparse) == 0) hits.push_back(hit);
  }
  return hits;
}

constexpr bounds3 box{vec3(-1.8f), vec3(1.8f)};

/// Number of hits that is `a_voxel` for each voxel side squared of the box's surface.
std::size_t hits_for(double a_voxel) {
  const double voxel = 3.6 / resolution;
  return std::size_t(a_voxel * 24.0 / (voxel * voxel));
}

template <class Exec>
wfpg::voxel_fragments<Exec> from_hits(const Exec& exec, const std::vector<surface_fragment>& hits,
                                      const bounds3& bounds = box) {
  const wfpg::buffer<surface_fragment, Exec> device(exec, hits);
  return wfpg::fragments_from_hits(exec, const_view(device), resolution, bounds);
}
template <class Exec>
wfpg::voxel_fragments<Exec> from_samples(const Exec& exec, const std::vector<surface_fragment>& hits) {
  const wfpg::buffer<surface_fragment, Exec> device(exec, hits);
  return wfpg::fragments_from_samples(exec, const_view(device), resolution, box);
}

/// Part of other hits, on one side of x = 0, that lie in the fragments' voxels.
template <class Exec>
double found_part(const Exec& exec, const wfpg::voxel_fragments<Exec>& fragments, float side) {
  const std::vector<wfpg::morton_code> voxels = voxels_of(exec, fragments);
  std::size_t all = 0, found = 0;
  for (const surface_fragment& hit : hits_on_box(50000, 99)) {
    wfpg::uvec3 voxel;
    if (side * hit.position.x < 0.0f || !fragments.grid.voxel_of(hit.position, voxel)) continue;
    ++all;
    found += std::binary_search(voxels.begin(), voxels.end(), wfpg::morton_encode(voxel));
  }
  REQUIRE(all > 20000);
  return double(found) / double(all);
}

template <class Exec, class Other>
bool same(const Exec& exec, const wfpg::voxel_fragments<Exec>& a, const Other& other,
          const wfpg::voxel_fragments<Other>& b) {
  if (a.size() != b.size() || a.codes.to_host(exec) != b.codes.to_host(other)) return false;
  const auto left = a.surfaces.to_host(exec), right = b.surfaces.to_host(other);
  return std::memcmp(left.data(), right.data(), left.size() * sizeof left[0]) == 0;
}

WFPG_TEST_CASE("few hits leave no holes, and add little beyond the surface", "[fragments_from_hits]") {
  const Exec exec;
  const std::size_t exact = voxels_of(exec, from_samples(exec, hits_on_box(hits_for(20.0), 1))).size();
  for (const double a_voxel : {0.1, 0.3, 1.0, 3.0}) {
    INFO(a_voxel << " hits a voxel");
    const std::vector<surface_fragment> hits = hits_on_box(hits_for(a_voxel), 2);
    const auto fragments = from_hits(exec, hits);
    CHECK(found_part(exec, fragments, 1.0f) > 0.98);
    CHECK(found_part(exec, fragments, -1.0f) > 0.98);
    CHECK(double(voxels_of(exec, fragments).size()) < (a_voxel < 0.5 ? 1.4 : 1.2) * double(exact));
    CHECK(double(fragments.size()) < 40.0 * double(exact));
    if (a_voxel < 0.5) CHECK(found_part(exec, from_samples(exec, hits), 1.0f) < 0.35);
  }
}

WFPG_TEST_CASE("hits reach as far as they are sparse around them", "[fragments_from_hits]") {
  const Exec exec;
  const std::vector<surface_fragment> hits = hits_on_box(hits_for(10.0), 3, 50);
  const auto fragments = from_hits(exec, hits);
  CHECK(found_part(exec, fragments, 1.0f) > 0.98);
  CHECK(found_part(exec, from_samples(exec, hits), 1.0f) < 0.6);
  std::size_t around_dense = 0;
  const std::vector<wfpg::morton_code> codes = fragments.codes.to_host(exec);
  for (std::size_t i = hits.size(); i < codes.size(); ++i)
    around_dense += wfpg::morton_decode(codes[i]).x + 4 < resolution / 2;
  CHECK(2 * codes.size() > 3 * hits.size());
  CHECK(around_dense < hits.size() / 20);
}

WFPG_TEST_CASE("dense hits get nothing around them", "[fragments_from_hits]") {
  const Exec exec;
  const std::vector<surface_fragment> hits = hits_on_box(hits_for(40.0), 4);
  const auto fragments = from_hits(exec, hits);
  CHECK(fragments.size() >= hits.size());
  // Where a surface enters a corner of a voxel there are few hits in it.
  CHECK(double(fragments.size()) < 1.02 * double(hits.size()));
}

WFPG_TEST_CASE("fragments around hits have their normals, and count little", "[fragments_from_hits]") {
  const Exec exec;
  const std::vector<surface_fragment> hits = hits_on_box(hits_for(0.3), 5);
  const auto fragments = from_hits(exec, hits), own = from_samples(exec, hits);
  const auto surfaces = fragments.surfaces.to_host(exec), first = own.surfaces.to_host(exec);
  REQUIRE(surfaces.size() > 5 * first.size());
  CHECK(std::memcmp(surfaces.data(), first.data(), first.size() * sizeof first[0]) == 0);
  const std::vector<vec3> axes = turned_axes();
  std::size_t right = 0;
  for (std::size_t i = first.size(); i < surfaces.size(); ++i) {
    const vec3 n = wfpg::unpack_direction(surfaces[i].normal);
    bool along_one = false;
    for (const vec3& axis : axes) along_one = along_one || std::fabs(glm::dot(n, axis)) > 0.9999f;
    right += along_one && surfaces[i].area < 0.1f && surfaces[i].area > 0.0f;
  }
  CHECK(right == surfaces.size() - first.size());
}

WFPG_TEST_CASE("bad hits are skipped and counted as those of samples", "[fragments_from_hits]") {
  const Exec exec;
  std::vector<surface_fragment> hits = hits_on_box(300, 6);
  const std::size_t good = hits.size();
  hits.push_back({vec3(0.5f, nan, 0.5f)});
  hits.push_back({vec3(5.0f)});
  hits.push_back({vec3(0.5f), vec3(0.0f)});
  hits.push_back({vec3(0.5f), vec3(nan)});
  hits.push_back({vec3(0.5f), vec3(0.0f, 0.0f, 1.0f), 0.0f});
  const auto all = from_hits(exec, hits);
  CHECK(all.report.non_finite == 1);
  CHECK(all.report.out_of_range == 1);
  CHECK(all.report.degenerate == 3);
  hits.resize(good);
  CHECK(same(exec, all, exec, from_hits(exec, hits)));
}

WFPG_TEST_CASE("one hit fills a square, and none nothing", "[fragments_from_hits]") {
  const Exec exec;
  CHECK(from_hits(exec, {}).size() == 0);
  // At the cube's corner: a part of the square lies outside.
  const auto corner = from_hits(exec, {{vec3(-1.7f), vec3(0.0f, 0.0f, 1.0f)}});
  const std::vector<wfpg::morton_code> voxels = voxels_of(exec, corner);
  CHECK(voxels.size() > 200);
  CHECK(voxels.size() < 40 * 40);
  wfpg::uvec3 hit;
  REQUIRE(corner.grid.voxel_of(vec3(-1.7f), hit));
  for (const wfpg::morton_code code : voxels) {
    const wfpg::uvec3 voxel = wfpg::morton_decode(code);
    CHECK(voxel.z == hit.z);
    CHECK(std::max(voxel.x, voxel.y) < 20);
  }
  const wfpg::buffer<surface_fragment, Exec> some(exec, hits_on_box(10, 7));
  for (const std::uint32_t bad : {0u, 48u, 8192u})
    CHECK_THROWS_AS(wfpg::fragments_from_hits(exec, const_view(some), bad, box), std::invalid_argument);
  for (const std::uint32_t side : {1u, 2u, 4096u})
    CHECK(wfpg::fragments_from_hits(exec, const_view(some), side, box).size() >= 10);
}

WFPG_TEST_CASE("hits give the same fragments on all policies", "[fragments_from_hits]") {
  const Exec exec;
  const host_policy here;
  const std::vector<surface_fragment> hits = hits_on_box(hits_for(0.5), 8, 10);
  CHECK(same(exec, from_hits(exec, hits), here, from_hits(here, hits)));
}

}  // namespace
