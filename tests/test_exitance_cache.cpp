// The exitance cache: deposits, averages bottom-up, reads, dropped deposits, determinism.
#include "support/cached_scene.hpp"
#include "support/catch.hpp"
#include "support/octree_nodes.hpp"
#include "support/policies.hpp"
#include "support/random_meshes.hpp"
#include "support/section_bytes.hpp"

#include <wfpg/detail/guide_sections.hpp>
#include <wfpg/octree/exitance_cache.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace wfpg_test;
using wfpg::exitance_cache_view;
using wfpg::invalid_node;
using wfpg::morton_code;
using wfpg::node_id;
using wfpg::uvec3;
using wfpg::vec3;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

template <class Exec>
void deposit_colour(const cached_scene<Exec>& scene, vec3 position, vec3 direction, vec3 rgb) {
  const exitance_cache_view cache = scene.view();
  scene.exec.for_each(1, [=] WFPG_HD(std::size_t) { cache.deposit(position, direction, rgb); });
}

WFPG_TEST_CASE("a deposit on one side is read from that side", "[exitance_cache]") {
  const vec3 z(0, 0, 1), slanted = glm::normalize(vec3(0.9f, 0, 0.1f));
  cached_scene<Exec> scene(fragments_in_grid<Exec>({{{1, 1, 1}, z, 1.0f}}), 100);
  const vec3 p(1.5f);
  const node_id leaf = scene.leaf_at(p);
  CHECK(scene.read(leaf, z) == 0.0f);
  CHECK(scene.radiance(leaf, 0) < 0.0f);

  deposit_all(scene, {{p, z, 1.0f}, {p, slanted, 2.0f}, {p, z, 6.0f}, {p, -z, 8.0f}});
  CHECK(scene.read(leaf, z) == 0.0f);  // not before update()
  scene.cache.update(scene.exec);
  CHECK(scene.read(leaf, z) == 3.0f);
  CHECK(scene.read(leaf, slanted) == 3.0f);  // the cosine does not count
  CHECK(scene.read(leaf, -slanted) == 8.0f);
  CHECK(scene.radiance(leaf, 0) == 3.0f);
  CHECK(scene.radiance(leaf, 1) == 8.0f);

  deposit_all(scene, {{p, z, 7.0f}, {p, -z, 0.0f}, {p, -z, -0.0f}, {{1.5f, 1.5f, 2.4f}, -z, 0.0f}});
  scene.cache.update(scene.exec);
  CHECK(scene.read(leaf, z) == 4.0f);
  CHECK(scene.read(leaf, -z) == 2.0f);  // four deposits, one of them from the next voxel
  scene.cache.update(scene.exec);
  CHECK(scene.read(leaf, z) == 4.0f);
  CHECK(scene.cache.dropped(scene.exec).total() == 0);

  deposit_colour(scene, p, z, vec3(1.0f));
  CHECK(scene.radiance(0, 0) > 0.0f);
  scene.cache.clear(scene.exec);
  CHECK(scene.radiance(0, 0) < 0.0f);  // inner nodes forget before update() averages them anew
  scene.cache.update(scene.exec);
  CHECK(scene.read(leaf, z) == 0.0f);
  CHECK(scene.radiance(0, 0) < 0.0f);
  deposit_colour(scene, p, z, vec3(1.0f, 2.0f, 3.0f));
  scene.cache.update(scene.exec);
  CHECK(scene.read(leaf, z) == Approx(0.2126 + 2.0 * 0.7152 + 3.0 * 0.0722));
}

std::vector<deposit> random_deposits(const test_mesh& mesh, std::size_t n, std::uint64_t seed) {
  random_numbers random(seed);
  std::vector<deposit> deposits;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t t = random.below(static_cast<std::uint32_t>(mesh.triangles.size()));
    const float u = random.unit(), v = random.unit() * (1.0f - u);
    const vec3 a = mesh.vertex(t, 0), b = mesh.vertex(t, 1), c = mesh.vertex(t, 2);
    const float radiance = std::pow(10.0f, random.between(-4.0f, 4.0f));
    deposits.push_back({a + u * (b - a) + v * (c - a), random.direction(), radiance});
  }
  return deposits;
}

/// A node's sides in the cache, and the sides of its children that face the same way.
struct sides_record {
  float radiance[2];
  std::uint32_t matching[2][8];
};

struct describe_sides {
  exitance_cache_view cache;
  WFPG_HD sides_record operator()(std::size_t i) const {
    const auto node = static_cast<node_id>(i);
    sides_record r{};
    for (std::uint32_t side = 0; side < 2; ++side) {
      r.radiance[side] = cache.radiance(node, side);
      if (cache.octree().is_leaf(node)) continue;
      const vec3 facing = side == 0 ? cache.normal(node) : -cache.normal(node);
      for (std::uint32_t octant = 0; octant < 8; ++octant) {
        const node_id child = cache.octree().child(node, octant);
        if (child == invalid_node) continue;
        r.matching[side][octant] = glm::dot(cache.normal(child), facing) >= 0.0f ? 0 : 1;
      }
    }
    return r;
  }
};

/// The sides of all nodes.
template <class Exec>
std::vector<sides_record> all_sides(const cached_scene<Exec>& scene) {
  return evaluate(scene.exec, scene.octree().node_count(), describe_sides{scene.view()});
}
template <class Exec>
std::vector<float> all_radiance(const cached_scene<Exec>& scene) {
  std::vector<float> values;
  for (const sides_record& r : all_sides(scene)) values.insert(values.end(), r.radiance, r.radiance + 2);
  return values;
}

/// Mean of a node's side, by recursion from its leaves. Negative without data.
float averaged(const std::vector<node_record>& nodes, const std::vector<sides_record>& sides, node_id node,
               std::uint32_t side) {
  if (nodes[node].is_leaf) return sides[node].radiance[side];
  float sum = 0.0f, n = 0.0f;
  for (std::uint32_t octant = 0; octant < 8; ++octant) {
    const node_id child = nodes[node].child[octant];
    if (child == invalid_node) continue;
    const float value = averaged(nodes, sides, child, sides[node].matching[side][octant]);
    if (value < 0.0f) continue;
    sum += value;
    n += 1.0f;
  }
  return n > 0.0f ? sum / n : -1.0f;
}

WFPG_TEST_CASE("averages equal a naive recursion's", "[exitance_cache]") {
  const test_mesh mesh = sphere_mesh(10);
  cached_scene<Exec> scene(mesh, 16, 1000);
  const std::vector<node_record> nodes = nodes_of(scene.exec, scene.octree());
  for (int round = 0; round < 3; ++round) {
    deposit_all(scene, random_deposits(mesh, 400, round));
    scene.cache.update(scene.exec);
    const std::vector<sides_record> sides = all_sides(scene);
    std::size_t wrong = 0, without = 0;
    for (node_id node = 0; node < scene.octree().node_count(); ++node)
      for (std::uint32_t side = 0; side < 2; ++side) {
        const float radiance = sides[node].radiance[side];
        wrong += alike(radiance, averaged(nodes, sides, node, side)) ? 0 : 1;
        without += radiance < 0.0f ? 1 : 0;
      }
    CHECK(wrong == 0);
    CHECK(without > 10);
    CHECK(without < 2 * scene.octree().node_count() - 200);
  }
}

/// The leaf and side of a deposit, as one number.
struct slot_of_deposit {
  exitance_cache_view cache;
  WFPG_HD std::uint32_t operator()(const deposit& d) const {
    const node_id leaf = cache.octree().nearest_leaf(d.position);
    return 2 * leaf + (glm::dot(cache.normal(leaf), d.direction) >= 0.0f ? 0 : 1);
  }
};

WFPG_TEST_CASE("leaf means equal the means of the deposits", "[exitance_cache]") {
  const test_mesh mesh = cuboid_mesh();
  cached_scene<Exec> scene(mesh, 8, 20000);
  std::vector<double> sums(2 * scene.octree().node_count(), 0.0), counts = sums;
  for (int round = 0; round < 3; ++round) {
    const std::vector<deposit> deposits = random_deposits(mesh, 20000, 10 + round);
    deposit_all(scene, deposits);
    scene.cache.update(scene.exec);
    const auto slots = evaluate(scene.exec, deposits, slot_of_deposit{scene.view()});
    for (std::size_t i = 0; i < deposits.size(); ++i) {
      sums[slots[i]] += deposits[i].radiance;
      counts[slots[i]] += 1.0;
    }
  }
  CHECK(scene.cache.dropped(scene.exec).total() == 0);
  double worst = 0.0;
  const std::vector<float> radiance = all_radiance(scene);
  for (node_id leaf = scene.octree().first_leaf(); leaf < scene.octree().node_count(); ++leaf)
    for (std::uint32_t side = 0; side < 2; ++side) {
      const std::size_t slot = 2 * leaf + side;
      const double expected = counts[slot] > 0.0 ? sums[slot] / counts[slot] : -1.0;
      worst = std::max(worst, std::abs(radiance[slot] / expected - 1.0));
    }
  CHECK(worst < 1.0e-6);
}

WFPG_TEST_CASE("all deposits of a leaf have equal weight, in any number", "[exitance_cache]") {
  const vec3 z(0, 0, 1), p(1.5f);
  cached_scene<Exec> scene(fragments_in_grid<Exec>({{{1, 1, 1}, z, 1.0f}}), 70000);
  const node_id leaf = scene.leaf_at(p);
  double sum = 0.0, count = 0.0;
  for (const std::size_t deposits : {5000, 300, 70000, 5000, 1}) {
    const double value = 1.0 + count;  // values grow, so a wrong weight changes the mean
    deposit_all(scene, std::vector<deposit>(deposits, {p, z, static_cast<float>(value)}));
    scene.cache.update(scene.exec);
    sum += static_cast<double>(deposits) * value;
    count += static_cast<double>(deposits);
    INFO(count << " deposits");
    CHECK(static_cast<double>(scene.read(leaf, z)) == Approx(sum / count).epsilon(1.0e-6));
  }
  CHECK(scene.cache.dropped(scene.exec).total() == 0);
}

WFPG_TEST_CASE("sides of parent and child match by direction", "[exitance_cache]") {
  const vec3 z(0, 0, 1);
  cached_scene<Exec> scene(fragments_in_grid<Exec>({{{0, 0, 0}, z, 10.0f}, {{1, 0, 0}, -z, 1.0f}}), 10);
  const node_id up = scene.leaf_at(uvec3(0, 0, 0)), down = scene.leaf_at(uvec3(1, 0, 0));
  deposit_all(scene, {{{0.5f, 0.5f, 0.5f}, z, 2.0f}, {{1.5f, 0.5f, 0.5f}, z, 4.0f}});
  scene.cache.update(scene.exec);
  CHECK(scene.side_facing(up, z) == 0);
  CHECK(scene.side_facing(down, z) == 1);
  CHECK(scene.radiance(down, 1) == 4.0f);
  const node_id parent = scene.parent(up);
  CHECK(scene.radiance(parent, scene.side_facing(parent, z)) == 3.0f);
  CHECK(scene.radiance(parent, scene.side_facing(parent, -z)) < 0.0f);
  CHECK(scene.read(0, z) == 3.0f);
  CHECK(scene.read(0, -z) == 0.0f);
}

WFPG_TEST_CASE("a side without data reads its nearest ancestor with data", "[exitance_cache]") {
  const vec3 z(0, 0, 1);
  cached_scene<Exec> scene(fragments_in_grid<Exec>({{{0, 0, 0}, z, 10.0f},
                                                    {{1, 0, 0}, -z, 1.0f},    // a sibling, turned over
                                                    {{2, 0, 0}, z, 1.0f},     // a cousin
                                                    {{7, 7, 7}, -z, 0.5f}}),  // shares only the root
                           10);
  deposit_all(scene, {{{0.5f, 0.5f, 0.5f}, z, 2.0f}, {{2.5f, 0.5f, 0.5f}, z, 6.0f}});
  scene.cache.update(scene.exec);
  const auto read = [&](uvec3 voxel, vec3 toward) { return scene.read(scene.leaf_at(voxel), toward); };
  CHECK(read({0, 0, 0}, z) == 2.0f);
  CHECK(read({1, 0, 0}, z) == 2.0f);
  CHECK(read({2, 0, 0}, z) == 6.0f);
  CHECK(read({7, 7, 7}, z) == 4.0f);
  for (const uvec3 voxel : {uvec3(0, 0, 0), uvec3(1, 0, 0), uvec3(2, 0, 0), uvec3(7, 7, 7)})
    CHECK(read(voxel, -z) == 0.0f);
}

WFPG_TEST_CASE("an ancestor is read on the node's side, not on the reader's", "[exitance_cache]") {
  const vec3 z(0, 0, 1), mostly_x = glm::normalize(vec3(1.0f, 0.0f, 0.1f));
  cached_scene<Exec> scene(fragments_in_grid<Exec>({{{0, 0, 0}, z, 1.0f}, {{1, 0, 0}, mostly_x, 10.0f}}), 10);
  deposit_all(scene, {{{1.5f, 0.5f, 0.5f}, mostly_x, 5.0f}, {{1.5f, 0.5f, 0.5f}, -mostly_x, 7.0f}});
  scene.cache.update(scene.exec);
  const node_id leaf = scene.leaf_at(uvec3(0, 0, 0));
  const vec3 grazing = glm::normalize(vec3(-0.9f, 0.0f, 0.3f));  // in front of the leaf, behind its parent
  CHECK(glm::dot(scene.normal(scene.parent(leaf)), grazing) < 0.0f);
  CHECK(scene.read(leaf, grazing) == 5.0f);
  CHECK(scene.read(leaf, -grazing) == 7.0f);
}

WFPG_TEST_CASE("invalid deposits are dropped and counted", "[exitance_cache]") {
  const vec3 z(0, 0, 1), p(1.5f);
  cached_scene<Exec> scene(fragments_in_grid<Exec>({{{1, 1, 1}, z, 1.0f}}), 100);
  deposit_all(scene, {
                         {p, z, nan},
                         {p, z, infinity},
                         {p, z, -infinity},
                         {p, z, -1.0e-30f},
                         {{nan, 0, 0}, z, 1.0f},
                         {{0, infinity, 0}, z, 1.0f},
                         {p, {0, 0, nan}, 1.0f},
                         {p, {infinity, 0, 0}, 1.0f},
                         {{5.5f, 5.5f, 5.5f}, z, 1.0f},
                         {{-100, 0, 0}, z, 1.0f},
                         {{3.0e38f, 0, 0}, z, 1.0f},
                         {p, z, 0.25f},
                     });
  deposit_colour(scene, p, z, vec3(nan, 1.0f, 1.0f));
  deposit_colour(scene, p, z, vec3(1.0f, -100.0f, 1.0f));
  scene.cache.update(scene.exec);
  const wfpg::dropped_deposits dropped = scene.cache.dropped(scene.exec);
  CHECK(dropped.invalid == 10);
  CHECK(dropped.outside == 3);
  CHECK(dropped.overflow == 0);
  CHECK(dropped.total() == 13);
  CHECK(scene.read(scene.leaf_at(p), z) == 0.25f);

  deposit_all(scene, std::vector<deposit>(3, {p, z, 3.0e38f}));
  scene.cache.update(scene.exec);
  CHECK(std::isfinite(scene.read(scene.leaf_at(p), z)));
  CHECK(scene.cache.dropped(scene.exec).total() == 13);
}

WFPG_TEST_CASE("a full queue drops and counts, and works again after an update", "[exitance_cache]") {
  const vec3 z(0, 0, 1), p(1.5f);
  cached_scene<Exec> scene(fragments_in_grid<Exec>({{{1, 1, 1}, z, 1.0f}}), 1000);
  const node_id leaf = scene.leaf_at(p);
  deposit_all(scene, std::vector<deposit>(1500, {p, z, 2.0f}));
  CHECK(scene.cache.dropped(scene.exec).overflow == 500);
  scene.cache.update(scene.exec);
  CHECK(scene.read(leaf, z) == 2.0f);
  deposit_all(scene, std::vector<deposit>(1000, {p, z, 4.0f}));
  scene.cache.update(scene.exec);
  CHECK(scene.cache.dropped(scene.exec).overflow == 500);
  CHECK(scene.read(leaf, z) == 3.0f);

  cached_scene<Exec> without_queue(fragments_in_grid<Exec>({{{1, 1, 1}, z, 1.0f}}), 0);
  deposit_all(without_queue, {{p, z, 1.0f}});
  without_queue.cache.update(without_queue.exec);
  CHECK(without_queue.cache.dropped(without_queue.exec).overflow == 1);
  using cache = wfpg::exitance_cache<Exec>;
  CHECK_THROWS_AS(cache(scene.exec, scene.tree, scene.fragments, std::size_t(1) << 32),
                  std::invalid_argument);
}

WFPG_TEST_CASE("an empty scene's cache accepts deposits and returns zero", "[exitance_cache]") {
  cached_scene<Exec> scene(test_mesh(), 64, 10);
  deposit_all(scene, std::vector<deposit>(5));
  scene.cache.update(scene.exec);
  CHECK(scene.cache.dropped(scene.exec).outside == 5);
  CHECK(scene.cache.persistent_bytes() == 0);
  CHECK(scene.read(invalid_node, vec3(0, 0, 1)) == 0.0f);
}

/// Returns the values that the first policy of this program got.
const std::vector<float>& of_first_policy(const std::vector<float>& values) {
  static const std::vector<float> first = values;
  return first;
}

WFPG_TEST_CASE("the order of deposits does not change a bit", "[exitance_cache]") {
  const test_mesh mesh = sphere_mesh(12);
  std::vector<deposit> deposits = random_deposits(mesh, 20000, 77);
  random_numbers random(78);
  std::vector<float> first;
  for (int round = 0; round < 3; ++round) {
    cached_scene<Exec> scene(mesh, 8, std::size_t(30000) << 2 * round);  // room changes nothing, either
    deposit_all(scene, deposits);
    scene.cache.update(scene.exec);
    const std::vector<float> values = all_radiance(scene);
    if (round == 0) first = values;
    CHECK((values == first));
    shuffle(deposits, random);
  }
  CHECK((first == of_first_policy(first)));
}

/// A voxel whose upper side has `count` deposits of mean `mean`. Writes the cache's bytes as in a guide file.
template <class Exec>
class busy_voxel {
 public:
  busy_voxel(double mean, std::uint32_t count)
      : scene_(fragments_in_grid<Exec>({{{1, 1, 1}, z, 1.0f}}), 1000) {
    std::string bytes = state();
    std::uint64_t mean_bits;
    std::memcpy(&mean_bits, &mean, sizeof mean);
    set_number(bytes, leaf(), 8, mean_bits);
    set_number(bytes, leaf() + 8, 4, count);
    wfpg::detail::guide_sections::restore(scene_.exec, {"a cache", "cache", bytes}, scene_.cache);
  }

  void add(const std::vector<float>& values) {
    std::vector<deposit> deposits;
    for (const float value : values) deposits.push_back({vec3(1.5f), z, value});
    deposit_all(scene_, deposits);
    scene_.cache.update(scene_.exec);
  }
  double mean() const { return double(scene_.read(scene_.leaf_at(vec3(1.5f)), z)); }
  std::uint64_t count() const { return number_in(state(), leaf() + 8, 4); }
  std::uint64_t dropped() const { return scene_.cache.dropped(scene_.exec).total(); }

 private:
  const vec3 z{0.0f, 0.0f, 1.0f};

  std::string state() const {
    return wfpg::detail::guide_sections::to_bytes(scene_.exec, scene_.cache).bytes();
  }
  /// Offset of the leaf's first side: after two bytes a node and one an inner node.
  std::size_t leaf() const { return 3 * std::size_t(scene_.tree.node_count()) - scene_.tree.leaf_count(); }

  cached_scene<Exec> scene_;
};

WFPG_TEST_CASE("2^32 deposits in one voxel lose nothing", "[exitance_cache]") {
  constexpr std::uint64_t most = 0xffffffffu;
  for (const std::uint32_t before : {0x7ffffffcu, 0xfffffff0u, 0xfffffffbu, 0xfffffffeu, 0xffffffffu}) {
    busy_voxel<Exec> voxel(2.0, before);
    CHECK(voxel.mean() == 2.0);
    CHECK(voxel.count() == before);
    long double sum = 2.0L * before, count = before;
    for (int round = 0; round < 4; ++round) {
      std::vector<float> values(5, 0x1p31f);  // each moves the mean by about half
      values.resize(5 + 300 * (round % 2), 0.0f);
      voxel.add(values);
      for (const float value : values) sum += static_cast<long double>(value);
      count += static_cast<long double>(values.size());
      INFO(before << " deposits before, round " << round);
      CHECK(voxel.mean() == Approx(static_cast<double>(sum / count)).epsilon(1.0e-6));
      CHECK(voxel.count() == std::min(most, static_cast<std::uint64_t>(count)));
    }
    CHECK(voxel.dropped() == 0);
  }
}

TEST_CASE("a mean counts up to 2^32 - 1 values, in batches of any size", "[exitance_cache]") {
  double mean = 0.0;
  std::uint32_t count = 0;
  const std::uint64_t half = 1ull << 31;
  wfpg::detail::add_to_mean(mean, count, static_cast<double>(half), half);
  CHECK(count == half);
  CHECK(mean == 1.0);
  wfpg::detail::add_to_mean(mean, count, 3.0 * static_cast<double>(half), half);
  CHECK(mean == 2.0);
  CHECK(count == 0xffffffffu);
  wfpg::detail::add_to_mean(mean, count, 2.0 * static_cast<double>(half), half);
  CHECK(mean == Approx(2.0).epsilon(1.0e-15));
  CHECK(count == 0xffffffffu);
  wfpg::detail::add_to_mean(mean, count, 2.0 + 0x1p32, 1);
  CHECK(mean == Approx(3.0).epsilon(1.0e-9));
  CHECK(count == 0xffffffffu);

  mean = 0.0;
  count = 0;
  random_numbers random(5);
  double sum = 0.0;
  const std::uint64_t batch = 1ull << 20;
  for (int i = 0; i < 4096; ++i) {
    const double value = random.unit();
    wfpg::detail::add_to_mean(mean, count, value * static_cast<double>(batch), batch);
    sum += value;
  }
  CHECK(count == 0xffffffffu);
  CHECK(mean == Approx(sum / 4096.0).epsilon(1.0e-12));
}

WFPG_TEST_CASE("an octree and its cache use at most 29 bytes a node", "[exitance_cache]") {
  for (const test_mesh& mesh : {sphere_mesh(24), cuboid_mesh(), cuboid_mesh({0, 0, 0}, {4, 3, 2.2f})})
    for (const std::uint32_t resolution : {32u, 128u}) {
      const cached_scene<Exec> scene(mesh, resolution, 100);
      const std::size_t nodes = scene.tree.node_count(), leaves = scene.tree.leaf_count();
      const std::size_t bytes = scene.tree.bytes() + scene.cache.persistent_bytes();
      INFO(double(bytes) / double(nodes) << " bytes a node at resolution " << resolution);
      CHECK(bytes <= 29 * nodes);
      CHECK(scene.cache.persistent_bytes() == 26 * leaves + 11 * (nodes - leaves));
      CHECK(scene.cache.transient_bytes() < 8 * 100 + 32 * leaves + leaves / 32 + 64);
    }
}

}  // namespace
