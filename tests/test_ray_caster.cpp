// The requirements on ray casters, and the caster that needs no host. It marches through the octree and is
// compared with brute force over the voxels.
#include "support/octree_nodes.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/host/ray_caster.hpp>
#include <wfpg/octree/svo_ray_caster.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

using namespace wfpg_test;
using wfpg::ray;
using wfpg::ray_hit;
using wfpg::sparse_voxel_octree_view;
using wfpg::svo_ray_caster;

namespace not_casters {

struct answers_nothing {
  void operator()(const ray&) const {}
};
struct not_const {
  ray_hit operator()(const ray&) { return {}; }
};
struct takes_wrong_views {
  void cast(const one_policy&, wfpg::array_view<const ray>, std::vector<ray_hit>&) const {}
};

}  // namespace not_casters

namespace {

using namespace not_casters;

static_assert(wfpg::is_inline_caster_v<svo_ray_caster>);
static_assert(wfpg::is_inline_caster_v<box_caster>);
static_assert(!wfpg::is_inline_caster_v<batch_box_caster>);
static_assert(!wfpg::is_inline_caster_v<answers_nothing>);
static_assert(!wfpg::is_inline_caster_v<not_const>);
static_assert(!wfpg::is_inline_caster_v<int>);
static_assert(wfpg::is_batch_caster_v<batch_box_caster, one_policy>);
static_assert(!wfpg::is_batch_caster_v<box_caster, one_policy>);
static_assert(!wfpg::is_batch_caster_v<takes_wrong_views, one_policy>);
static_assert(wfpg::is_ray_caster_v<box_caster, one_policy>);
static_assert(wfpg::is_ray_caster_v<batch_box_caster, one_policy>);
static_assert(!wfpg::is_ray_caster_v<answers_nothing, one_policy>);
static_assert(std::is_trivially_copyable_v<svo_ray_caster>);

/// An octree over scattered samples in the unit cube.
template <class Exec>
wfpg::sparse_voxel_octree<Exec> scattered(const Exec& exec, int samples, std::uint32_t resolution,
                                          std::uint64_t seed) {
  random_numbers random(seed);
  std::vector<wfpg::surface_fragment> host;
  for (int i = 0; i < samples; ++i) host.push_back({random.point(0.0f, 1.0f), random.direction(), 1.0f});
  const wfpg::buffer<wfpg::surface_fragment, Exec> device(exec, host);
  auto fragments = wfpg::fragments_from_samples(exec, const_view<wfpg::surface_fragment>(device), resolution,
                                                {vec3(0.0f), vec3(1.0f)});
  return wfpg::sparse_voxel_octree<Exec>(exec, fragments);
}

/// The part of a ray inside a box. Empty if enter > leave.
struct interval {
  double enter, leave;
};

interval inside(const ray& r, const wfpg::bounds3& box) {
  interval result{0.0, 1e300};
  for (int axis = 0; axis < 3; ++axis) {
    const double o = r.origin[axis], d = r.direction[axis];
    if (d == 0.0) {
      if (o < box.lower[axis] || o > box.upper[axis]) return {1.0, 0.0};
      continue;
    }
    const double a = (box.lower[axis] - o) / d, b = (box.upper[axis] - o) / d;
    result.enter = std::max(result.enter, std::min(a, b));
    result.leave = std::min(result.leave, std::max(a, b));
  }
  return result;
}

/// The distance of the first voxel beyond `start` that the ray crosses by at least `chord`, or 1e300.
double first_voxel(const std::vector<wfpg::bounds3>& leaves, const ray& r, double start, double chord) {
  double nearest = 1e300;
  for (const wfpg::bounds3& leaf : leaves) {
    const interval crossed = inside(r, leaf);
    const double enter = std::max(crossed.enter, start);
    if (crossed.leave - enter >= chord) nearest = std::min(nearest, enter);
  }
  return nearest;
}

template <class Exec>
std::vector<wfpg::bounds3> leaf_boxes(const Exec& exec, const sparse_voxel_octree_view& tree) {
  std::vector<wfpg::bounds3> boxes;
  for (const node_record& node : nodes_of(exec, tree))
    if (node.is_leaf) boxes.push_back(node.bounds);
  return boxes;
}

struct cast_all {
  svo_ray_caster caster;
  wfpg::array_view<const ray> rays;
  wfpg::array_view<ray_hit> hits;
  WFPG_HD void operator()(std::size_t i) const { hits[i] = caster(rays[i]); }
};

template <class Exec>
std::vector<ray_hit> cast(const Exec& exec, const svo_ray_caster& caster, const std::vector<ray>& rays) {
  const wfpg::buffer<ray, Exec> device(exec, rays);
  const wfpg::buffer<ray_hit, Exec> hits(exec, rays.size());
  exec.for_each(rays.size(), cast_all{caster, const_view<ray>(device), hits.view()});
  return hits.to_host(exec);
}

struct comparison {
  int hits = 0, misses = 0, wrong = 0;
};

/// The caster may miss voxels that it only grazes. It must hit all others, and nothing where none is.
template <class Exec>
comparison compare(const Exec& exec, const sparse_voxel_octree_view& tree, const std::vector<ray>& rays,
                   float clearance) {
  const auto leaves = leaf_boxes(exec, tree);
  const auto hits = cast(exec, svo_ray_caster(tree, 0.25f, clearance), rays);
  std::vector<vec3> points;
  for (std::size_t i = 0; i < rays.size(); ++i)
    points.push_back(rays[i].origin + hits[i].distance * rays[i].direction);
  const auto leaf_of_hit = evaluate(exec, points, [=] WFPG_HD(vec3 p) { return tree.nearest_leaf(p); });
  const double voxel = tree.grid().voxel_size();
  comparison result;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const double start = std::max(double(rays[i].t_min), clearance * voxel);
    const double at_most = first_voxel(leaves, rays[i], start, 0.005 * voxel);
    const double at_least = first_voxel(leaves, rays[i], start, -0.005 * voxel);
    const double limit = rays[i].t_max;
    if (hits[i].is_hit()) {
      ++result.hits;
      const double t = hits[i].distance;
      result.wrong += t > at_most + 0.01 * voxel || t < at_least - 0.01 * voxel || t > limit * 1.0001;
      result.wrong += leaf_of_hit[i] == wfpg::invalid_node;
    } else {
      ++result.misses;
      result.wrong += at_most < limit * 0.9999 - 0.01 * voxel || hits[i].radiance != 0.25f;
    }
  }
  return result;
}

ray make_ray(vec3 origin, vec3 direction) {
  ray r;
  r.origin = origin;
  r.direction = glm::normalize(direction);
  return r;
}

WFPG_TEST_CASE("SVO ray caster: random rays from inside agree with brute force", "[ray_caster]") {
  const Exec exec;
  random_numbers random(1);
  std::vector<ray> rays;
  for (int i = 0; i < 400; ++i) rays.push_back(make_ray(random.point(0.0f, 1.0f), random.direction()));
  const auto sparse = scattered(exec, 300, 32, 2);
  for (float clearance : {0.0f, 2.0f}) {
    const comparison c = compare(exec, sparse.view(), rays, clearance);
    CHECK(c.wrong == 0);
    CHECK(c.hits > 20);
    CHECK(c.misses > 20);
  }
  const auto dense = scattered(exec, 2000, 16, 3);
  const comparison c = compare(exec, dense.view(), rays, 2.0f);
  CHECK(c.wrong == 0);
  CHECK(c.hits > 300);
}

WFPG_TEST_CASE("SVO ray caster: rays along axes, through centres and along faces agree", "[ray_caster]") {
  const Exec exec;
  const auto tree = scattered(exec, 150, 16, 4);
  const auto boxes = leaf_boxes(exec, tree.view());
  std::vector<ray> rays;
  for (std::size_t i = 0; i < boxes.size(); i += 3)
    for (int axis = 0; axis < 3; ++axis)
      for (float sign : {-1.0f, 1.0f}) {
        vec3 direction(0.0f);
        direction[axis] = sign;
        vec3 origin = boxes[i].centre();
        origin[axis] = 0.5f;
        rays.push_back(make_ray(origin, direction));
        origin[axis] = sign > 0.0f ? -1.0f : 2.0f;
        rays.push_back(make_ray(origin, direction));
        vec3 diagonal = direction;
        diagonal[(axis + 1) % 3] = 1.0f;
        rays.push_back(make_ray(origin, diagonal));
      }
  const comparison c = compare(exec, tree.view(), rays, 0.0f);
  CHECK(c.wrong == 0);
  CHECK(c.hits > 100);

  // On a face either voxel may be hit. The call only has to return.
  std::vector<ray> on_faces;
  for (const wfpg::bounds3& box : boxes) {
    on_faces.push_back(make_ray({box.lower.x, box.lower.y, -1.0f}, {0, 0, 1}));
    on_faces.push_back(make_ray({box.lower.x, box.upper.y, 2.0f}, {0, 0, -1}));
  }
  for (const ray_hit& hit : cast(exec, svo_ray_caster(tree.view()), on_faces))
    CHECK(std::isfinite(hit.distance));
}

WFPG_TEST_CASE("SVO ray caster: rays from outside, near and very far, agree", "[ray_caster]") {
  const Exec exec;
  const auto tree = scattered(exec, 1000, 16, 5);
  random_numbers random(6);
  for (float distance : {1.5f, 100.0f}) {
    std::vector<ray> rays;
    for (int i = 0; i < 200; ++i) {
      const vec3 origin = vec3(0.5f) + distance * random.direction();
      rays.push_back(make_ray(origin, random.point(0.0f, 1.0f) - origin));
      rays.push_back(make_ray(origin, random.direction()));
    }
    const auto hits = cast(exec, svo_ray_caster(tree.view()), rays);
    if (distance < 2.0f) CHECK(compare(exec, tree.view(), rays, 0.0f).wrong == 0);
    CHECK(std::count_if(hits.begin(), hits.end(), [](const ray_hit& h) { return h.is_hit(); }) > 150);
  }
  // If a float's spacing exceeds a voxel, the call only has to return.
  std::vector<ray> far;
  for (float distance : {1e4f, 1e6f, 1e8f, 1e20f})
    for (int i = 0; i < 20; ++i) {
      const vec3 d = random.direction();
      far.push_back(make_ray(distance * d, -d));
      far.push_back(make_ray({distance, 0.4f, 0.6f}, {-1, 0, 0}));
    }
  for (const ray_hit& hit : cast(exec, svo_ray_caster(tree.view()), far)) CHECK(std::isfinite(hit.distance));
}

WFPG_TEST_CASE("SVO ray caster: it respects t_min, t_max and the clearance", "[ray_caster]") {
  const Exec exec;
  const std::vector<wfpg::surface_fragment> host = {{{0.2f, 0.5f, 0.5f}, {1, 0, 0}, 1.0f},
                                                    {{0.8f, 0.5f, 0.5f}, {1, 0, 0}, 1.0f}};
  const wfpg::buffer<wfpg::surface_fragment, Exec> device(exec, host);
  auto fragments = wfpg::fragments_from_samples(exec, const_view<wfpg::surface_fragment>(device), 32,
                                                {vec3(0.0f), vec3(1.0f)});
  const wfpg::sparse_voxel_octree<Exec> tree(exec, fragments);
  const float voxel = tree.view().grid().voxel_size();
  const auto distance = [&](float origin, float t_min, float t_max, float clearance) {
    ray r = make_ray({origin, 0.5f, 0.5f}, {1, 0, 0});
    r.t_min = t_min;
    r.t_max = t_max;
    return cast(exec, svo_ray_caster(tree.view(), 0.0f, clearance), {r})[0].distance;
  };
  CHECK(distance(-1.0f, 0.0f, 3e38f, 0.0f) == Approx(1.2f).margin(voxel));
  CHECK(distance(-1.0f, 1.3f, 3e38f, 0.0f) == Approx(1.8f).margin(voxel));
  CHECK(distance(-1.0f, 0.0f, 1.1f, 0.0f) < 0.0f);
  CHECK(distance(-1.0f, 1.3f, 1.7f, 0.0f) < 0.0f);
  CHECK(distance(0.2f, 0.0f, 3e38f, 0.0f) == Approx(0.0f).margin(0.01f * voxel));
  CHECK(distance(0.2f, 0.0f, 3e38f, 2.0f) == Approx(0.6f).margin(voxel));
}

WFPG_TEST_CASE("SVO ray caster: an empty octree and one voxel work", "[ray_caster]") {
  const Exec exec;
  const wfpg::buffer<wfpg::surface_fragment, Exec> none(exec, 0);
  auto nothing = wfpg::fragments_from_samples(exec, const_view<wfpg::surface_fragment>(none), 64);
  const wfpg::sparse_voxel_octree<Exec> empty(exec, nothing);
  const std::vector<ray> rays = {make_ray({0.5f, 0.5f, 0.5f}, {0, 0, 1}),
                                 make_ray({-3, 0, 0}, {1, 0.1f, 0.1f})};
  for (const ray_hit& hit : cast(exec, svo_ray_caster(empty.view(), 4.0f), rays)) {
    CHECK(!hit.is_hit());
    CHECK(hit.radiance == 4.0f);
  }
  const auto whole = scattered(exec, 1, 1, 1);
  const auto hits = cast(exec, svo_ray_caster(whole.view(), 4.0f, 0.0f), rays);
  CHECK(hits[0].distance == Approx(0.0f).margin(0.01));
  CHECK(hits[1].distance == Approx(2.5f).margin(0.1));
}

WFPG_TEST_CASE("SVO ray caster: degenerate rays end at once", "[ray_caster]") {
  const Exec exec;
  const auto tree = scattered(exec, 300, 32, 2);
  const float nan = std::nanf(""), far = 3.0e38f;
  const std::vector<ray> rays = {
      make_ray({0.5f, 0.5f, 0.5f}, vec3(0.0f)), make_ray({0.5f, 0.5f, 0.5f}, vec3(nan)),
      make_ray(vec3(nan), {0, 0, 1}),           make_ray(vec3(2.0f * far), {0, 0, 1}),
      make_ray(vec3(far), {0, 0, -1}),          make_ray({0.5f, 0.5f, nan}, {0, 1, 0})};
  for (const ray_hit& hit : cast(exec, svo_ray_caster(tree.view(), 4.0f), rays)) {
    CHECK(!hit.is_hit());
    CHECK(hit.radiance == 4.0f);
  }
}

}  // namespace
