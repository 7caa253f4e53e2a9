// Cones through the exitance cache, compared with known answers. test_cone_caster_fields.cpp tests fields
// made of cones.
#include "support/cached_scene.hpp"
#include "support/catch.hpp"
#include "support/octree_nodes.hpp"

#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/host/ray_caster.hpp>
#include <wfpg/octree/svo_cone_caster.hpp>
#include <wfpg/octree/svo_ray_caster.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

namespace {

using namespace wfpg_test;
using wfpg::node_id;
using wfpg::ray;
using wfpg::ray_hit;
using wfpg::svo_cone_caster;
using wfpg::vec2;
using wfpg::vec3;

static_assert(wfpg::is_cone_caster_v<svo_cone_caster>);
static_assert(wfpg::is_inline_caster_v<svo_cone_caster>);
static_assert(!wfpg::is_cone_caster_v<wfpg::svo_ray_caster>);
static_assert(std::is_trivially_copyable_v<svo_cone_caster>);

/// Solid angles of cells: from 64² on a sphere to 8² on a hemisphere. The first is thinner than a voxel.
constexpr float widths[] = {0.0f, 12.57f / 4096, 12.57f / 1024, 12.57f / 256, 6.28f / 64};

ray make_ray(vec3 origin, vec3 direction) {
  ray r;
  r.origin = origin;
  r.direction = glm::normalize(direction);
  return r;
}

std::vector<ray> rays_from(float low, float high, int n, std::uint64_t seed) {
  random_numbers random(seed);
  std::vector<ray> rays;
  for (int i = 0; i < n; ++i) rays.push_back(make_ray(random.point(low, high), random.direction()));
  return rays;
}

/// The unit box. Its walls emit `radiance(place)`.
template <class Exec>
struct shining_box : cached_scene<Exec> {
  wfpg::voxel_opacity<Exec> opacity;

  template <class Radiance>
  explicit shining_box(const Radiance& radiance)
      : cached_scene<Exec>(cuboid_mesh(), 32, 6 * 64 * 64), opacity(this->exec, this->tree) {
    constexpr int n = 64;
    std::vector<deposit> light;
    for (int i = 0; i < 6 * n * n; ++i) {
      const int axis = i % 3;
      vec3 normal(0.0f), p;
      normal[axis] = i % 6 < 3 ? 1.0f : -1.0f;
      p[axis] = i % 6 < 3 ? 0.0f : 1.0f;
      p[(axis + 1) % 3] = (float(i / 6 % n) + 0.5f) / n;
      p[(axis + 2) % 3] = (float(i / 6 / n) + 0.5f) / n;
      light.push_back({p, normal, radiance(p)});
    }
    deposit_all(*this, light);
    this->cache.update(this->exec);
  }
};

struct cast_cone {
  svo_cone_caster caster;
  float solid_angle;
  WFPG_HD ray_hit operator()(const ray& r) const { return caster(r, solid_angle); }
};
/// Radiance of cones of one width. Checks that no cone returns a distance.
template <class Exec>
std::vector<float> cast(const Exec& exec, const svo_cone_caster& caster, const std::vector<ray>& rays,
                        float solid_angle) {
  std::vector<float> radiance;
  for (const ray_hit& hit : evaluate(exec, rays, cast_cone{caster, solid_angle})) {
    REQUIRE(!hit.is_hit());
    radiance.push_back(hit.radiance);
  }
  return radiance;
}

double mean_of(const std::vector<float>& values) {
  double sum = 0.0;
  for (const float value : values) sum += double(value);
  return sum / double(values.size());
}

WFPG_TEST_CASE("cone caster: in a furnace all cones see its radiance", "[cone_caster][furnace]") {
  const shining_box<Exec> box([](vec3) { return 3.0f; });
  const svo_cone_caster caster(box.view(), box.opacity.view());
  for (const float solid_angle : widths) {
    INFO(solid_angle << " sr");
    const auto seen = cast(box.exec, caster, rays_from(0.1f, 0.9f, 4000, 1), solid_angle);
    CHECK(mean_of(seen) == Approx(3.0).epsilon(0.006));
    // Cones that graze a wall near an edge see past it. At most a quarter do.
    const auto leaks = std::count_if(seen.begin(), seen.end(), [](float r) { return r < 3.0f * 0.99f; });
    CHECK(leaks < (solid_angle < 0.01f ? 4 : 300));
    CHECK(*std::min_element(seen.begin(), seen.end()) > 3.0f * (solid_angle < 0.01f ? 0.9f : 0.7f));
    CHECK(*std::max_element(seen.begin(), seen.end()) < 3.0f * 1.001f);
  }
}

/// Two squares that face `toward`. The rear one is bright and hidden by the front one.
struct two_walls {
  vec3 ahead, u, v;

  explicit two_walls(vec3 toward)
      : ahead(glm::normalize(toward)),
        u(glm::normalize(glm::cross(ahead, {0, 1, 0}))),
        v(glm::cross(ahead, u)) {}

  vec3 at(float distance, float x, float y) const { return distance * ahead + x * u + y * v; }
  test_mesh mesh() const {
    test_mesh walls;
    for (const float distance : {0.4f, 0.8f}) walls.add_quad(at(distance, -0.5f, -0.5f), u, v);
    return walls;
  }
  std::vector<deposit> light() const {
    std::vector<deposit> result;
    constexpr int n = 96;
    for (int i = 0; i < n * n; ++i) {
      const float x = (float(i % n) + 0.5f) / n - 0.5f, y = (float(i / n) + 0.5f) / n - 0.5f;
      result.push_back({at(0.8f, x, y), -ahead, 1.0f});
      result.push_back({at(0.4f, x, y), -ahead, 0.0f});
      result.push_back({at(0.4f, x, y), ahead, 1.0f});  // lit by the bright square
    }
    return result;
  }
};

WFPG_TEST_CASE("cone caster: a wall hides light from cones of any width", "[cone_caster]") {
  for (const vec3 toward : {vec3(0, 0, 1), vec3(1, 0, 1), vec3(0.3f, -0.2f, 1.0f), vec3(1, 1, 1)}) {
    const two_walls walls(toward);
    cached_scene<Exec> scene(walls.mesh(), 64, 3 * 96 * 96);
    deposit_all(scene, walls.light());
    scene.cache.update(scene.exec);
    const wfpg::voxel_opacity<Exec> opacity(scene.exec, scene.tree);
    const svo_cone_caster caster(scene.view(), opacity.view());
    random_numbers random(2);
    std::vector<ray> before, between;
    for (int i = 0; i < 2000; ++i) {
      const vec3 from = walls.at(random.between(-0.1f, 0.1f), random.between(-0.1f, 0.1f), 0.0f);
      const vec3 hidden = walls.at(0.4f, random.between(-0.25f, 0.25f), random.between(-0.25f, 0.25f));
      before.push_back(make_ray(from, hidden - from));
      between.push_back(make_ray(walls.at(0.6f, 0.0f, 0.0f), hidden - from));
    }
    const bool along_axis = toward.x == 0.0f;
    for (const float solid_angle : widths) {
      INFO("wall toward " << toward.x << ' ' << toward.y << ", " << solid_angle << " sr");
      const double hidden = mean_of(cast(scene.exec, caster, before, solid_angle));
      CHECK(mean_of(cast(scene.exec, caster, between, solid_angle)) > 0.95);
      // A wall along no axis covers nodes partly, so light leaks at their corners.
      CHECK(hidden < (along_axis ? 0.001 : 0.03));
      // Thin cones read leaves only. The next widths read a few larger nodes, 25 voxels away.
      if (solid_angle < 0.001f) CHECK(hidden == 0.0);
      if (solid_angle < 0.004f) CHECK(hidden < 1.0e-4);
    }
  }
}

/// The unit box without the wall y = 1.
test_mesh open_box() {
  test_mesh mesh = cuboid_mesh();
  mesh.triangles.resize(10);
  return mesh;
}

/// Rays through all cells of a field over the sphere.
std::vector<ray> cells_of_sphere(vec3 from, int resolution) {
  std::vector<ray> rays;
  for (int i = 0; i < resolution * resolution; ++i) {
    const vec2 cell(float(i % resolution), float(i / resolution));
    rays.push_back(make_ray(from, wfpg::square_to_sphere((cell + 0.5f) / float(resolution))));
  }
  return rays;
}

WFPG_TEST_CASE("cone caster: an opening shows its fraction of the environment", "[cone_caster]") {
  const cached_scene<Exec> scene(open_box(), 64, 0);
  const wfpg::voxel_opacity<Exec> opacity(scene.exec, scene.tree);
  const svo_cone_caster caster(scene.view(), opacity.view(), 6.0f);
  // One face of six, less a rim of wall voxels. Wide cones lose a wider rim of larger nodes.
  const struct {
    int resolution;
    double least;
  } fields[] = {{8, 0.65}, {16, 0.75}, {32, 0.8}, {64, 0.9}};
  for (const auto& field : fields) {
    const int cells = field.resolution * field.resolution;
    INFO(field.resolution << " cells a side");
    const double seen = mean_of(
        cast(scene.exec, caster, cells_of_sphere(vec3(0.5f), field.resolution), 12.566f / float(cells)));
    CHECK(seen > field.least);
    CHECK(seen < 1.0);
  }
}

WFPG_TEST_CASE("cone caster: infinite environment radiance is clamped to 1e30 and hidden by walls",
               "[cone_caster]") {
  const cached_scene<Exec> scene(open_box(), 32, 0);
  const wfpg::voxel_opacity<Exec> opacity(scene.exec, scene.tree);
  const svo_cone_caster caster(scene.view(), opacity.view(), std::numeric_limits<float>::infinity());
  int lit = 0, dark = 0;
  for (const float radiance : cast(scene.exec, caster, cells_of_sphere(vec3(0.5f), 16), 0.0f)) {
    REQUIRE(radiance >= 0.0f);
    REQUIRE(radiance <= 1.0e30f);
    lit += radiance > 1.0e29f;
    dark += radiance < 2.0f;
  }
  CHECK(lit > 20);
  CHECK(dark > 100);
}

/// Difference between a thin cone's radiance and that of the voxel that a ray hits.
struct thin_cone {
  svo_cone_caster cones;
  wfpg::svo_ray_caster rays;
  wfpg::exitance_cache_view cache;
  WFPG_HD float operator()(const ray& r) const {
    const ray_hit hit = rays(r);
    const vec3 p = r.origin + (hit.distance + 1.0e-4f) * r.direction;
    const node_id leaf = hit.is_hit() ? cache.octree().leaf_at(p) : wfpg::invalid_node;
    if (leaf == wfpg::invalid_node) return 1.0f;
    return std::fabs(cones(r).radiance - cache.read(leaf, -r.direction));
  }
};

/// Radiance that differs from voxel to voxel.
float speckles(vec3 p) {
  const float x = 37.3f * p.x + 53.7f * p.y + 71.1f * p.z;
  return 0.1f + x - std::floor(x);
}

WFPG_TEST_CASE("cone caster: a cone of a voxel's width sees the voxel that a ray hits", "[cone_caster]") {
  const shining_box<Exec> box(speckles);
  for (const float clearance : {0.0f, 2.0f}) {
    const svo_cone_caster cones(box.view(), box.opacity.view(), 0.0f, clearance);
    const wfpg::svo_ray_caster rays(box.octree(), 0.0f, clearance);
    int wrong = 0;
    for (const float error :
         evaluate(box.exec, rays_from(0.1f, 0.9f, 4000, 3), thin_cone{cones, rays, box.view()}))
      wrong += error > 1.0e-5f ? 1 : 0;
    CHECK(wrong < 20);  // cones split by a voxel's edge
  }
}

WFPG_TEST_CASE("cone caster: a wide cone sees about the mean of the rays inside it", "[cone_caster]") {
  const shining_box<Exec> box([](vec3 p) { return 0.2f + p.x * p.y + 0.5f * p.z * p.z; });
  const svo_cone_caster caster(box.view(), box.opacity.view());
  random_numbers random(4);
  double error = 0.0, bias = 0.0, known = 0.0;
  for (int place = 0; place < 10; ++place) {
    const vec3 from = random.point(0.25f, 0.75f);
    const auto wide = cast(box.exec, caster, cells_of_sphere(from, 8), 12.566f / 64.0f);
    const auto thin = cast(box.exec, caster, cells_of_sphere(from, 64), 0.0f);
    for (std::size_t cell = 0; cell < 64; ++cell) {
      double mean = 0.0;
      for (std::size_t i = 0; i < 64; ++i)
        mean += double(thin[(cell / 8 * 8 + i / 8) * 64 + cell % 8 * 8 + i % 8]) / 64.0;
      error += std::fabs(double(wide[cell]) - mean);
      bias += double(wide[cell]) - mean;
      known += mean;
    }
  }
  CHECK(error < 0.1 * known);
  CHECK(std::fabs(bias) < 0.03 * known);
}

WFPG_TEST_CASE("cone caster: t_min, t_max and the clearance bound what a cone hits", "[cone_caster]") {
  const shining_box<Exec> box([](vec3) { return 3.0f; });
  const auto gathered = [&](float t_min, float t_max, float clearance) {
    ray r = make_ray(vec3(0.5f), {1, 0, 0});
    r.t_min = t_min;
    r.t_max = t_max;
    const svo_cone_caster caster(box.view(), box.opacity.view(), 7.0f, clearance);
    return cast(box.exec, caster, {r}, 0.01f)[0];
  };
  CHECK(gathered(0.0f, 3.0e38f, 0.0f) == Approx(3.0f));
  CHECK(gathered(0.0f, 0.4f, 0.0f) == 7.0f);
  CHECK(gathered(0.6f, 3.0e38f, 0.0f) == 7.0f);
  CHECK(gathered(0.0f, 3.0e38f, 20.0f) == 7.0f);  // in voxels
}

WFPG_TEST_CASE("cone caster: degenerate rays and an empty octree end the loop at once", "[cone_caster]") {
  const shining_box<Exec> box([](vec3) { return 3.0f; });
  const float nan = std::nanf(""), far = 3.0e38f;
  const vec3 centre(0.5f);
  const vec3 bad[][2] = {{centre, vec3(0.0f)},           {centre, vec3(nan)},
                         {vec3(nan), {0, 0, 1}},         {vec3(2.0f * far), {0, 0, 1}},
                         {{0.5f, 0.5f, nan}, {0, 1, 0}}, {centre, {0, 2.0f * far, 0}}};
  std::vector<ray> rays;
  for (const auto& pair : bad) {
    rays.emplace_back();
    rays.back().origin = pair[0];
    rays.back().direction = pair[1];
  }
  const svo_cone_caster caster(box.view(), box.opacity.view(), 4.0f);
  for (const float solid_angle : widths)
    for (const float radiance : cast(box.exec, caster, rays, solid_angle)) CHECK(radiance == 4.0f);
  // Invalid widths: the call only has to return.
  for (const float solid_angle : {nan, -1.0f, far, 2.0f * far})
    for (const float radiance : cast(box.exec, caster, rays_from(0.2f, 0.8f, 50, 5), solid_angle))
      CHECK(std::isfinite(radiance));

  const cached_scene<Exec> nothing(test_mesh(), 64, 0);
  const wfpg::voxel_opacity<Exec> none(nothing.exec, nothing.tree);
  CHECK(none.bytes() == 0);
  const svo_cone_caster through(nothing.view(), none.view(), 4.0f);
  for (const float radiance : cast(nothing.exec, through, rays_from(0.2f, 0.8f, 50, 5), 0.01f))
    CHECK(radiance == 4.0f);
}

WFPG_TEST_CASE("cone caster: opacities are the occupied fractions of columns", "[cone_caster]") {
  const cached_scene<Exec> scene(mixed_triangles(60, 0.02f, 0.3f, 6), 32, 0);
  const wfpg::voxel_opacity<Exec> opacity(scene.exec, scene.tree);
  CHECK(opacity.bytes() == 3u * (scene.octree().node_count() - scene.octree().leaf_count()));
  const wfpg::voxel_opacity_view of = opacity.view();
  const auto opacities = evaluate(scene.exec, scene.octree().node_count(),
                                  [=] WFPG_HD(std::size_t i) { return of(static_cast<node_id>(i)); });
  const auto nodes = nodes_of(scene.exec, scene.octree());
  std::size_t partly = 0;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (int axis = 0; axis < 3; ++axis) {
      const float found = opacities[i][axis];
      if (nodes[i].is_leaf) REQUIRE(found == 1.0f);
      REQUIRE((found > 0.0f && found <= 1.0f));
      if (nodes[i].is_leaf || !nodes[nodes[i].first_child].is_leaf) continue;
      bool occupied[4] = {};
      for (std::uint32_t octant = 0; octant < 8; ++octant) {
        const std::uint32_t a = octant >> ((axis + 1) % 3) & 1u, b = octant >> ((axis + 2) % 3) & 1u;
        if (nodes[i].child[octant] != wfpg::invalid_node) occupied[2 * a + b] = true;
      }
      const auto columns = float(std::count(std::begin(occupied), std::end(occupied), true));
      REQUIRE(std::fabs(found - 0.25f * columns) <= 0.51f / 255.0f);
      partly += columns < 4.0f ? 1 : 0;
    }
  CHECK(partly > 100);
}

}  // namespace
