// Bright nodes: which nodes are listed, and what aimed cones do to fields: toward lamps that a field sees,
// and not toward those that it does not.
#include "support/evaluate.hpp"
#include "support/kept_fields.hpp"
#include "support/lit_box.hpp"
#include "support/policies.hpp"
#include "support/random_meshes.hpp"
#include "support/scenes.hpp"
#include "support/statistics.hpp"
#include "support/threads.hpp"

#include <wfpg/guides/octree/field_store.hpp>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::detail::bright_side;

namespace {

constexpr std::uint32_t ceiling = 3;

/// A lamp of 1 / 32 of the ceiling's side in walls of radiance 1.
template <int Radiance>
float lamp_light(std::uint32_t face, float u, float v) {
  return face == ceiling && u > 0.5f && u < 0.53125f && v > 0.25f && v < 0.28125f ? float(Radiance) : 1.0f;
}
constexpr float lamp_x = 0.265625f, lamp_z = 0.515625f;

template <class Exec>
std::vector<bright_side> listed(const Exec& exec, const wfpg::exitance_cache_view& cache) {
  wfpg::detail::bright_nodes<Exec> bright(exec);
  bright.find(exec, cache);
  const wfpg::detail::bright_nodes_view view = bright.view();
  std::vector<bright_side> result;
  const std::uint32_t n = wfpg::read_element(exec, view.count);
  for (std::uint32_t i = 0; i < n; ++i) result.push_back(wfpg::read_element(exec, view.sides + i));
  return result;
}

WFPG_TEST_CASE("bright nodes: a small lamp is listed, and nothing else", "[bright_nodes]") {
  lit_box<Exec> box(lamp_light<100>);  // 4 deposits a leaf, of 64 that it needs
  for (int more = 0; more < 12; ++more) box.shine(lamp_light<100>);
  CHECK(listed(box.exec, box.cache.view()).empty());
  for (int more = 0; more < 8; ++more) box.shine(lamp_light<100>);
  const std::vector<bright_side> sides = listed(box.exec, box.cache.view());
  REQUIRE(sides.size() == 1);
  const wfpg::exitance_cache_view cache = box.cache.view();
  const wfpg::sparse_voxel_octree_view tree = box.tree.view();
  const std::uint32_t id = sides[0].id;
  CHECK(evaluate(box.exec, [=] WFPG_HD() { return cache.radiance(id / 2, id % 2); }) > 50.0f);
  const vec3 lamp(lamp_x, 1.0f, lamp_z);
  CHECK(evaluate(box.exec, [=] WFPG_HD() { return tree.nearest_leaf(lamp); }) == id / 2);
  CHECK(sides[0].position == evaluate(box.exec, [=] WFPG_HD() { return tree.centre(id / 2); }));
  CHECK(glm::dot(sides[0].normal, vec3(0, -1, 0)) > 0.99f);
}

WFPG_TEST_CASE("bright nodes: lamps that are dim or broad are not listed", "[bright_nodes]") {
  const auto broad = [](std::uint32_t face, float u, float v) {
    return face == ceiling && u > 0.25f && u < 0.5f && v > 0.25f && v < 0.5f ? 300.0f : 1.0f;
  };
  lit_box<Exec> dim(lamp_light<30>), wide(broad);
  for (int more = 0; more < 20; ++more) {
    dim.shine(lamp_light<30>);
    wide.shine(broad);
  }
  CHECK(listed(dim.exec, dim.cache.view()).empty());
  CHECK(listed(wide.exec, wide.cache.view()).empty());
  wide.cache.clear(wide.exec);
  CHECK(listed(wide.exec, wide.cache.view()).empty());
  lit_box<Exec> shallow(lamp_light<1000>, 4);
  for (int more = 0; more < 20; ++more) shallow.shine(lamp_light<1000>);
  CHECK(listed(shallow.exec, shallow.cache.view()).empty());
}

/// A floor of radiance 1, and a cube of light that hangs above it, `side` leaves wide.
template <class Exec>
std::vector<bright_side> listed_above_floor(float radiance, int side) {
  constexpr int leaves = 64;
  const float width = float(side) / float(leaves);
  const vec3 corner(0.7f, 0.8f, 0.7f);
  test_mesh mesh{{{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}}, {{0, 1, 2}, {0, 2, 3}}};
  for (const vec3 p : box_positions()) mesh.positions.push_back(corner + width * p);
  for (const wfpg::uvec3 t : box_triangles()) mesh.triangles.push_back(t + 4u);
  const Exec exec;
  auto fragments = voxelized(exec, mesh, leaves);
  wfpg::sparse_voxel_octree<Exec> tree(exec, fragments);
  std::vector<deposit> light;
  constexpr int n = 4 * leaves;  // points a side of the floor and of each face
  for (std::uint32_t face = 0; face < 7; ++face)
    for (int i = 0; i < n * n; ++i) {
      const float u = (float(i % n) + 0.5f) / float(n), v = (float(i / n) + 0.5f) / float(n);
      if (face == 6)
        light.push_back({{u, 0.0f, v}, {0, 1, 0}, 1.0f});
      else
        light.push_back({corner + width * face_point(face, u, v), -face_normal(face), radiance});
    }
  wfpg::exitance_cache<Exec> cache(exec, tree, fragments, light.size());
  for (int times = 0; times < 8; ++times) {
    deposit_all(exec, cache.view(), light);
    cache.update(exec);
  }
  return listed(exec, cache.view());
}

WFPG_TEST_CASE("bright nodes: a lamp that hangs alone is listed", "[bright_nodes]") {
  const std::vector<bright_side> sides = listed_above_floor<Exec>(150.0f, 3);
  CHECK(sides.size() >= 6);
  for (const bright_side& s : sides) CHECK(s.position.y > 0.75f);
  CHECK(listed_above_floor<Exec>(25.0f, 3).empty());    // not 32 times the mean
  CHECK(listed_above_floor<Exec>(150.0f, 12).empty());  // cones find it
}

/// 48 lamps of a leaf each, all of another radiance.
float many_lamps(std::uint32_t face, float u, float v) {
  const int x = int(u * 32.0f), y = int(v * 32.0f);
  return x % 8 == 3 && y % 16 == 3 ? 1000.0f + float(face) * 100.0f + float(x) + 0.1f * float(y) : 1.0f;
}

WFPG_TEST_CASE("bright nodes: of too many the list has the brightest of each bucket", "[bright_nodes]") {
  lit_box<Exec> box(many_lamps);
  for (int more = 0; more < 20; ++more) box.shine(many_lamps);
  const wfpg::exitance_cache_view cache = box.cache.view();
  const std::vector<bright_side> sides = listed(box.exec, cache);
  CHECK(sides.size() > 20);
  CHECK(sides.size() < 48);  // some share a bucket
  std::vector<float> radiance;
  for (const bright_side& s : sides) {
    const std::uint32_t id = s.id;
    radiance.push_back(evaluate(box.exec, [=] WFPG_HD() { return cache.radiance(id / 2, id % 2); }));
  }
  CHECK(std::is_sorted(radiance.rbegin(), radiance.rend()));
  const wfpg::node_id first = box.tree.view().first_leaf();
  const std::vector<float> all = evaluate(box.exec, 2 * box.tree.leaf_count(), [=] WFPG_HD(std::size_t i) {
    return cache.radiance(first + static_cast<wfpg::node_id>(i / 2), i % 2);
  });
  CHECK(radiance.front() == *std::max_element(all.begin(), all.end()));
  double sum = 0.0;
  for (std::size_t i = 0; i < all.size(); i += 2) sum += double(std::max(all[i], all[i + 1]));
  CHECK(radiance.back() > 32.0 * sum / double(all.size() / 2));
  with_threads([&](const std::string& threads) {
    INFO(threads);
    std::vector<std::uint32_t> first, again;
    for (const bright_side& s : sides) first.push_back(s.id);
    for (const bright_side& s : listed(box.exec, cache)) again.push_back(s.id);
    CHECK(first == again);
  });
}

/// Casts into the box. A board may hide the lamp from the field's place: it is outside every voxel, and dark.
struct board_caster {
  bool hidden = false;
  WFPG_HD wfpg::ray_hit operator()(const wfpg::ray& r) const {
    const float distance = (0.5f - r.origin.y) / r.direction.y;
    const vec3 at = r.origin + distance * r.direction;
    const bool hits = fabsf(at.x - 0.433f) < 0.2f && fabsf(at.z - 0.458f) < 0.2f;
    return hidden && r.direction.y > 0.0f && hits ? wfpg::ray_hit{distance, 0.0f} : box_caster()(r);
  }
};

/// What a store's samples are like.
struct lamp_case {
  bool hidden = false, aims = true, learns = true;
  bool batches = false;  // of one field's cones
};

/// A store with a field on the floor, whose first cones were cast in the dark.
template <class Exec>
struct lamp_box : kept_box<Exec> {
  std::vector<test_surface> wave = rays_at({0.6f, 0.0f, 0.4f}, {0, 1, 0}, 20);
  lamp_case of;
  wfpg::guide_view view;

  explicit lamp_box(const lamp_case& which)
      : kept_box<Exec>(slots_of(16, 100, 32, which.learns), wfpg::guiding_mode::oriented, 0, 1000),
        of(which) {
    this->box.cache.clear(this->exec());
    this->field.filter_alpha = 0.0f;
    refresh(1);
    for (int times = 0; times < 16; ++times) this->box.shine(lamp_light<100>);
    if (of.aims) this->store.aim(this->exec(), this->box.cache.view());
    refresh(4);
  }
  void refresh(int times) {
    batch_box_caster::log log;
    for (; times > 0; --times) {
      this->begin();
      view = of.batches ? this->prepare(wave, batch_box_caster{{}, &log}, 0)
                        : this->prepare(wave, board_caster{of.hidden});
      this->end();
    }
  }
  double toward_lamp() const {
    const wfpg::guide_view fields = view;
    const vec3 to = glm::normalize(vec3(lamp_x - 0.6f, 1.0f, lamp_z - 0.4f));
    return double(evaluate(this->exec(), [=] WFPG_HD() {
      const wfpg::directional_field field = fields.mixture(0).field;
      return field.pdf(to) * field.cell_solid_angle();
    }));
  }
  std::uint64_t bits() const { return field_bits(this->exec(), view, 1)[0]; }
};

WFPG_TEST_CASE("bright nodes: fields turn to a lamp that they see, and not to a hidden one",
               "[bright_nodes]") {
  lamp_case unaimed, hidden;
  unaimed.aims = false;
  hidden.hidden = true;
  lamp_box<Exec> box({});
  CHECK(box.toward_lamp() > 0.05);
  CHECK(box.toward_lamp() > 5.0 * lamp_box<Exec>(unaimed).toward_lamp());
  CHECK(lamp_box<Exec>(hidden).toward_lamp() < 0.5 / 256.0);
  // The board comes later: a field that is cast anew knows no lamp.
  box.of.hidden = true;
  box.store.invalidate_all(box.exec());
  box.refresh(6);
  CHECK(box.toward_lamp() < 0.5 / 256.0);
  // Fields that do not learn have the hit alone.
  lamp_case aimed;
  aimed.learns = unaimed.learns = false;
  CHECK(lamp_box<Exec>(aimed).toward_lamp() > 3.0 * lamp_box<Exec>(unaimed).toward_lamp());
}

WFPG_TEST_CASE("bright nodes: densities of fields with aimed cones integrate to one", "[bright_nodes]") {
  const lamp_box<Exec> box({});
  const wfpg::directional_field field = box.field_of(box.view, 0);
  constexpr std::uint32_t n = 64;  // points a side, four a cell
  const std::vector<double> pdfs = evaluate(box.exec(), std::size_t(n) * n, [=] WFPG_HD(std::size_t i) {
    const vec2 uv = (vec2(float(i % n), float(i / n)) + 0.5f) / float(n);
    return double(field.pdf(field.direction(uv)));
  });
  const double sum = std::accumulate(pdfs.begin(), pdfs.end(), 0.0);
  CHECK(sum * 2.0 * double(wfpg::pi) / (n * n) == Approx(1.0).epsilon(1e-4));
}

WFPG_TEST_CASE("bright nodes: threads and forms of casters do not change a bit", "[bright_nodes]") {
  lamp_case batches;
  batches.batches = true;
  const std::uint64_t first = lamp_box<Exec>({}).bits();
  CHECK(lamp_box<Exec>(batches).bits() == first);
  with_threads([&](const std::string& threads) {
    INFO(threads);
    CHECK(lamp_box<Exec>({}).bits() == first);
  });
}
}  // namespace

#if defined(WFPG_TEST_SEVERAL_POLICIES)
TEST_CASE("bright nodes: policies of one warp width give the same bits", "[bright_nodes]") {
  check_equal_on_backends([] { return lamp_box<one_policy>({}).bits(); });
}
#endif
