// Octrees from ray casters, compared with those of the triangles that the casters hit. Rooms inside closed
// boxes, casters of both forms, seeds, bad hits, bad input, and large scenes.
#include "support/policies.hpp"
#include "support/random_meshes.hpp"

#include <wfpg/octree/fragments_from_caster.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::bounds3;
using wfpg::caster_fragments_options;
using wfpg::ray;
using wfpg::ray_hit;
using wfpg::vec3;

/// Types in kernels need names, for CUDA compilers.
namespace caster_test {

/// Tries all triangles. Ignores t_max, as a caster may.
struct mesh_caster {
  wfpg::triangle_mesh_view mesh;

  WFPG_HD ray_hit operator()(const ray& r) const {
    float nearest = 3.0e38f;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const wfpg::uvec3 corners = mesh.triangles[t];
      const vec3 a = mesh.positions[corners.x];
      const vec3 ab = mesh.positions[corners.y] - a, ac = mesh.positions[corners.z] - a;
      const vec3 p = glm::cross(r.direction, ac), from = r.origin - a, q = glm::cross(from, ab);
      const float determinant = glm::dot(ab, p);
      if (determinant == 0.0f) continue;
      const float u = glm::dot(from, p) / determinant, v = glm::dot(r.direction, q) / determinant;
      const float distance = glm::dot(ac, q) / determinant;
      if (u >= 0.0f && v >= 0.0f && u + v <= 1.0f && distance > 0.0f && distance < nearest)
        nearest = distance;
    }
    return {nearest < 3.0e38f ? nearest : -1.0f, 0.0f};
  }
};

/// The same hits in batches.
struct batch_mesh_caster {
  mesh_caster one;

  template <class Exec>
  void cast(const Exec& exec, wfpg::array_view<const ray> rays, wfpg::array_view<ray_hit> hits) const {
    exec.for_each(rays.size(), wfpg::detail::cast_each<mesh_caster>{one, rays, hits});
  }
};

/// Gives each ray one distance.
struct same_distance {
  float distance;
  WFPG_HD ray_hit operator()(const ray&) const { return {distance, 0.0f}; }
};

}  // namespace caster_test

namespace {

using caster_test::batch_mesh_caster;
using caster_test::mesh_caster;
using caster_test::same_distance;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

/// Adds a box that is turned about two axes, so that its faces lie along none.
void add_box(test_mesh& mesh, vec3 centre, float half, float turn) {
  const float c = std::cos(turn), s = std::sin(turn);
  const vec3 x = half * vec3(c, s, 0.0f), y = half * vec3(-s * c, c * c, s),
             z = half * vec3(s * s, -c * s, c);
  for (const float side : {-1.0f, 1.0f}) {
    mesh.add_quad(centre + side * x - y - z, 2.0f * y, 2.0f * z);
    mesh.add_quad(centre + side * y - x - z, 2.0f * x, 2.0f * z);
    mesh.add_quad(centre + side * z - x - y, 2.0f * x, 2.0f * y);
  }
}

/// A closed room of half side 1, a closed box in it, and another box in that one.
test_mesh rooms_in_rooms() {
  test_mesh mesh;
  add_box(mesh, vec3(0.0f), 1.0f, 0.0f);
  add_box(mesh, {0.1f, -0.05f, 0.0f}, 0.5f, 0.4f);
  add_box(mesh, {0.1f, 0.0f, 0.05f}, 0.2f, 0.9f);
  return mesh;
}

bounds3 bounds_of(const test_mesh& mesh) {
  bounds3 box;
  for (const vec3 p : mesh.positions) box = wfpg::bounds_union()(box, {p, p});
  return box;
}

template <class Exec>
struct mesh_scene {
  Exec exec;
  device_mesh<Exec> mesh;
  bounds3 bounds;

  explicit mesh_scene(const test_mesh& host) : mesh(exec, host), bounds(bounds_of(host)) {}
  mesh_caster caster() const { return {mesh.view()}; }
  wfpg::voxel_fragments<Exec> fragments(const caster_fragments_options& options) const {
    return wfpg::fragments_from_caster(exec, caster(), bounds, options);
  }
};

caster_fragments_options options_for(std::uint32_t resolution) {
  caster_fragments_options options;
  options.octree_resolution = resolution;
  return options;
}

/// Part of a mesh's area that lies in voxels of fragments. Points are half a voxel apart.
template <class Exec>
double found_part(const Exec& exec, const wfpg::voxel_fragments<Exec>& found, const test_mesh& of) {
  std::vector<wfpg::morton_code> codes = found.codes.to_host(exec);
  std::sort(codes.begin(), codes.end());
  std::size_t points = 0, both = 0;
  for (std::size_t t = 0; t < of.triangles.size(); ++t) {
    const vec3 a = of.vertex(t, 0), ab = of.vertex(t, 1) - a, ac = of.vertex(t, 2) - a;
    const int n = 2 + int(2.0f * std::max(glm::length(ab), glm::length(ac)) / found.grid.voxel_size());
    for (int i = 0; i < n; ++i)
      for (int j = 0; i + j + 1 < n; ++j) {
        const float u = (float(i) + 0.3f) / float(n), v = (float(j) + 0.3f) / float(n);
        wfpg::uvec3 voxel;
        const bool inside = found.grid.voxel_of(a + u * ab + v * ac, voxel);
        ++points;
        both += inside && std::binary_search(codes.begin(), codes.end(), wfpg::morton_encode(voxel));
      }
  }
  return double(both) / double(points);
}

template <class Exec>
bool same(const Exec& exec, const wfpg::voxel_fragments<Exec>& a, const wfpg::voxel_fragments<Exec>& b) {
  if (a.size() != b.size() || a.codes.to_host(exec) != b.codes.to_host(exec)) return false;
  const auto left = a.surfaces.to_host(exec), right = b.surfaces.to_host(exec);
  return std::memcmp(left.data(), right.data(), left.size() * sizeof left[0]) == 0;
}

WFPG_TEST_CASE("a caster's octree has the leaves of the triangles", "[fragments_from_caster]") {
  const test_mesh mesh = rooms_in_rooms();
  const mesh_scene<Exec> scene(mesh);
  auto fragments = scene.fragments(options_for(32));
  CHECK(found_part(scene.exec, fragments, mesh) > 0.98);
  CHECK(fragments.report.skipped() == 0);
  auto exact = wfpg::voxelize(scene.exec, scene.mesh.view(), 32);
  CHECK(fragments.grid.origin == exact.grid.origin);
  CHECK(fragments.grid.side == exact.grid.side);
  // And no others, beside rounding at voxels' faces.
  std::vector<wfpg::morton_code> voxels = exact.codes.to_host(scene.exec);
  std::sort(voxels.begin(), voxels.end());
  std::size_t others = 0;
  for (const wfpg::morton_code code : fragments.codes.to_host(scene.exec))
    others += !std::binary_search(voxels.begin(), voxels.end(), code);
  CHECK(others <= fragments.size() / 1000);
}

WFPG_TEST_CASE("lines find a room inside a closed box, and do so behind hits", "[fragments_from_caster]") {
  const mesh_scene<Exec> scene(rooms_in_rooms());
  test_mesh inner;
  add_box(inner, {0.1f, 0.0f, 0.05f}, 0.2f, 0.9f);
  caster_fragments_options options = options_for(32);
  CHECK(found_part(scene.exec, scene.fragments(options), inner) > 0.95);
  options.rounds = 1;
  CHECK(found_part(scene.exec, scene.fragments(options), inner) > 0.8);
  options.crossings = 2;  // the room's wall and the outer box
  CHECK(found_part(scene.exec, scene.fragments(options), inner) < 0.1);
}

WFPG_TEST_CASE("lines from hits find what lines from the faces miss", "[fragments_from_caster]") {
  const test_mesh mesh = rooms_in_rooms();
  const mesh_scene<Exec> scene(mesh);
  caster_fragments_options options = options_for(32);
  options.rays = 6 * 8 * 8;  // one line for 16 voxels
  options.rounds = 1;
  const double once = found_part(scene.exec, scene.fragments(options), mesh);
  options.rounds = 2;
  const double twice = found_part(scene.exec, scene.fragments(options), mesh);
  options.rounds = 40;
  const double often = found_part(scene.exec, scene.fragments(options), mesh);
  CHECK(once < 0.3);
  CHECK(twice > 1.3 * once);
  CHECK(often > 0.9);
}

WFPG_TEST_CASE("hits get the normals of their surfaces", "[fragments_from_caster]") {
  test_mesh mesh;
  add_box(mesh, vec3(0.0f), 1.0f, 0.5f);
  const mesh_scene<Exec> scene(mesh);
  const auto fragments = scene.fragments(options_for(32));
  const float c = std::cos(0.5f), s = std::sin(0.5f);
  const vec3 axes[3] = {{c, s, 0.0f}, {-s * c, c * c, s}, {s * s, -c * s, c}};
  std::size_t known = 0, right = 0;
  for (const wfpg::fragment_surface& f : fragments.surfaces.to_host(scene.exec)) {
    if (f.area < 1.0f) continue;
    ++known;
    const vec3 n = wfpg::unpack_direction(f.normal);
    bool along_one = false;
    for (const vec3& axis : axes) along_one = along_one || std::fabs(glm::dot(n, axis)) > 0.999f;
    right += along_one;
  }
  CHECK(double(known) > 0.9 * double(fragments.size()));
  CHECK(double(right) > 0.98 * double(known));  // the others are at edges
}

WFPG_TEST_CASE("equal seeds give equal fragments, from both forms of caster", "[fragments_from_caster]") {
  const mesh_scene<Exec> scene(rooms_in_rooms());
  caster_fragments_options options = options_for(16);
  options.seed = 7;
  const auto first = scene.fragments(options), again = scene.fragments(options);
  CHECK(first.size() > 1000);
  CHECK(same(scene.exec, first, again));
  CHECK(same(
      scene.exec, first,
      wfpg::fragments_from_caster(scene.exec, batch_mesh_caster{scene.caster()}, scene.bounds, options)));
  options.seed = 8;
  CHECK_FALSE(same(scene.exec, first, scene.fragments(options)));
}

WFPG_TEST_CASE("hits that are not finite or beyond the cube are counted", "[fragments_from_caster]") {
  const Exec exec;
  const bounds3 box{vec3(-1.0f), vec3(1.0f)};
  caster_fragments_options options = options_for(16);
  options.rays = 1000;
  for (const float bad : {nan, infinity, -infinity}) {
    const auto none = wfpg::fragments_from_caster(exec, same_distance{bad}, box, options);
    CHECK(none.size() == 0);
    CHECK(none.report.non_finite == 3000);
  }
  const auto beyond = wfpg::fragments_from_caster(exec, same_distance{100.0f}, box, options);
  CHECK(beyond.size() == 0);
  CHECK(beyond.report.out_of_range == 3000);
  const auto misses = wfpg::fragments_from_caster(exec, same_distance{-1.0f}, box, options);
  CHECK(misses.size() == 0);
  CHECK(misses.report.skipped() == 0);
}

WFPG_TEST_CASE("a caster that hits where rays begin ends each line", "[fragments_from_caster]") {
  const Exec exec;
  caster_fragments_options options = options_for(16);
  options.rays = 600;
  options.crossings = 5;
  const bounds3 box{vec3(-1.0f), vec3(1.0f)};
  const auto found = wfpg::fragments_from_caster(exec, same_distance{0.0f}, box, options);
  CHECK(found.size() > 0);
  CHECK(found.size() + found.report.out_of_range <= 3 * 600 * 5);
}

/// The message of the exception that a call throws.
template <class Call>
std::string message_of(const Call& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing";
}

bool names(const std::string& message, const char* what) {
  return message.find(what) != std::string::npos;
}

WFPG_TEST_CASE("bounds and options out of range are refused by name", "[fragments_from_caster]") {
  const Exec exec;
  const auto refused = [&](const bounds3& bounds, const caster_fragments_options& options) {
    return message_of([&] { wfpg::fragments_from_caster(exec, same_distance{-1.0f}, bounds, options); });
  };
  const bounds3 good{vec3(0.0f), vec3(1.0f)};
  const caster_fragments_options small = options_for(4);
  CHECK(refused(good, small) == "nothing");
  CHECK(refused({vec3(2.0f), vec3(2.0f)}, small) == "nothing");
  CHECK(names(refused({}, small), "bounds"));
  CHECK(names(refused({vec3(0.0f), vec3(1.0f, nan, 1.0f)}, small), "bounds"));
  CHECK(names(refused({vec3(0.0f), vec3(infinity)}, small), "bounds"));
  CHECK(names(refused({vec3(0.0f), vec3(2.0e15f)}, small), "bounds"));
  CHECK(names(refused(good, options_for(12)), "resolution"));
  const auto with = [&](auto set) {
    caster_fragments_options options = small;
    set(options);
    return refused(good, options);
  };
  CHECK(names(with([](auto& o) { o.rays = 0; }), "rays"));
  CHECK(names(with([](auto& o) { o.rays = (1u << 28) + 1; }), "rays"));
  CHECK(names(with([](auto& o) { o.rounds = 0; }), "rounds"));
  CHECK(names(with([](auto& o) { o.rounds = 65; }), "rounds"));
  CHECK(names(with([](auto& o) { o.crossings = 0; }), "crossings"));
  CHECK(names(with([](auto& o) { o.crossings = 65537; }), "crossings"));
}

WFPG_TEST_CASE("scenes of all scales are found, far from the origin too", "[fragments_from_caster]") {
  for (const float scale : {1.0e-6f, 1.0f, 1.0e6f, 1.0e12f})
    for (const float away : {0.0f, 100.0f}) {
      test_mesh mesh = rooms_in_rooms();
      for (vec3& p : mesh.positions) p = scale * (p + away);
      const mesh_scene<Exec> scene(mesh);
      INFO("scale " << scale << ", away " << away);
      CHECK(found_part(scene.exec, scene.fragments(options_for(16)), mesh) > 0.98);
    }
}

WFPG_TEST_CASE("an instance far away does not hide a room", "[fragments_from_caster]") {
  const test_mesh room = rooms_in_rooms();
  test_mesh mesh = room;
  mesh.add_quad({-2.0e6f, 1.0e6f, -2.0e6f}, {0, 0, 4.0e6f}, {4.0e6f, 0, 0});
  mesh_scene<Exec> scene(mesh);
  // Bounds of the room: the instance is out of range.
  scene.bounds = bounds_of(room);
  const auto near = scene.fragments(options_for(32));
  CHECK(found_part(scene.exec, near, room) > 0.98);
  CHECK(near.report.out_of_range > 100);
  // Bounds of all: the room is a voxel.
  scene.bounds = bounds_of(mesh);
  const auto all = scene.fragments(options_for(32));
  CHECK(found_part(scene.exec, all, mesh) > 0.98);
  CHECK(all.report.skipped() == 0);
}

}  // namespace
