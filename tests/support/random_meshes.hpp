// Meshes for tests: random triangles of mixed sizes, walls, slivers, spheres and boxes, and their upload.
#pragma once

#include "support/policies.hpp"

#include <wfpg/octree/voxelizer.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

namespace wfpg_test {

struct test_mesh {
  std::vector<wfpg::vec3> positions;
  std::vector<wfpg::uvec3> triangles;

  void add(wfpg::vec3 a, wfpg::vec3 b, wfpg::vec3 c) {
    const auto first = static_cast<std::uint32_t>(positions.size());
    for (const wfpg::vec3 corner : {a, b, c}) positions.push_back(corner);
    triangles.push_back({first, first + 1, first + 2});
  }
  /// Adds two triangles. The corners are a, a + u, a + u + v, a + v, and the normal is along u x v.
  void add_quad(wfpg::vec3 a, wfpg::vec3 u, wfpg::vec3 v) {
    add(a, a + u, a + u + v);
    add(a, a + u + v, a + v);
  }
  wfpg::vec3 vertex(std::size_t triangle, int i) const { return positions[triangles[triangle][i]]; }
  double area() const {
    double sum = 0.0;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      const glm::dvec3 a(vertex(t, 0)), b(vertex(t, 1)), c(vertex(t, 2));
      sum += 0.5 * glm::length(glm::cross(b - a, c - a));
    }
    return sum;
  }
};

/// A mesh in a policy's memory.
template <class Exec>
struct device_mesh {
  wfpg::buffer<wfpg::vec3, Exec> positions;
  wfpg::buffer<wfpg::uvec3, Exec> triangles;

  device_mesh(const Exec& exec, const test_mesh& mesh)
      : positions(exec, mesh.positions), triangles(exec, mesh.triangles) {}
  wfpg::triangle_mesh_view view() const { return {positions.view(), triangles.view()}; }
};

template <class Exec>
wfpg::voxel_fragments<Exec> voxelized(const Exec& exec, const test_mesh& mesh, std::uint32_t resolution) {
  return wfpg::voxelize(exec, device_mesh<Exec>(exec, mesh).view(), resolution);
}

/// Triangles in the unit cube. Sizes are log-uniform between two lengths. Every third is a sliver of at most
/// a hundredth of its length.
inline test_mesh mixed_triangles(std::size_t n, float smallest, float largest, std::uint64_t seed) {
  random_numbers random(seed);
  test_mesh mesh;
  while (mesh.triangles.size() < n) {
    const float size = smallest * std::pow(largest / smallest, random.unit());
    const bool sliver = mesh.triangles.size() % 3 == 0;
    const float width = sliver ? size * std::pow(10.0f, random.between(-4.0f, -2.0f)) : size;
    const wfpg::vec3 a = random.point(0.0f, 1.0f);
    const wfpg::vec3 along = random.direction();
    const wfpg::vec3 aside = glm::cross(along, random.direction());
    const auto inside = [](wfpg::vec3 p) { return glm::clamp(p, 0.0f, 1.0f); };
    const wfpg::vec3 b = inside(a + size * along), c = inside(a + 0.5f * size * along + width * aside);
    if (glm::length(glm::cross(b - a, c - a)) > 1.0e-5f * glm::dot(b - a, b - a)) mesh.add(a, b, c);
  }
  return mesh;
}

/// Slivers from one side of the unit cube to the other, in all directions.
inline test_mesh long_slivers(std::size_t n, std::uint64_t seed) {
  random_numbers random(seed);
  test_mesh mesh;
  for (std::size_t i = 0; i < n; ++i) {
    const wfpg::vec3 a = random.point(0.0f, 1.0f), b = random.point(0.0f, 1.0f);
    const wfpg::vec3 aside = glm::normalize(glm::cross(b - a, random.direction()));
    mesh.add(a, b, 0.5f * (a + b) + std::pow(10.0f, random.between(-5.0f, -1.0f)) * aside);
  }
  return mesh;
}

/// A closed sphere of 2 * rings² triangles, normals outward.
inline test_mesh sphere_mesh(int rings, wfpg::vec3 centre = wfpg::vec3(0.0f), float radius = 1.0f) {
  const auto at = [&](int ring, int sector) {
    const float theta = 3.14159265f * static_cast<float>(ring) / static_cast<float>(rings);
    const float phi = 6.2831853f * static_cast<float>(sector % (2 * rings)) / static_cast<float>(2 * rings);
    return centre + radius * wfpg::vec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                                        std::cos(theta));
  };
  test_mesh mesh;
  for (int ring = 0; ring < rings; ++ring)
    for (int sector = 0; sector < 2 * rings; ++sector) {
      const wfpg::vec3 a = at(ring, sector), b = at(ring + 1, sector), c = at(ring + 1, sector + 1),
                       d = at(ring, sector + 1);
      if (ring + 1 < rings) mesh.add(a, b, c);
      if (ring > 0) mesh.add(a, c, d);
    }
  return mesh;
}

/// The six faces of a box, normals outward.
inline test_mesh cuboid_mesh(wfpg::vec3 lower = wfpg::vec3(0.0f), wfpg::vec3 upper = wfpg::vec3(1.0f)) {
  const wfpg::vec3 e = upper - lower, x(e.x, 0, 0), y(0, e.y, 0), z(0, 0, e.z);
  test_mesh mesh;
  mesh.add_quad(lower, y, x);
  mesh.add_quad(lower, z, y);
  mesh.add_quad(lower, x, z);
  mesh.add_quad(upper, -x, -y);
  mesh.add_quad(upper, -y, -z);
  mesh.add_quad(upper, -z, -x);
  return mesh;
}

}  // namespace wfpg_test
