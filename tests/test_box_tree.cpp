// The tree over boxes, compared with a test of each box: points, boxes and rays, boxes of all kinds and
// sizes, equal trees on every policy, and memory that runs out.
#include "support/failing_resource.hpp"
#include "support/policies.hpp"

#include <wfpg/light/box_tree.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

using namespace wfpg_test;
using wfpg::bounds3;
using wfpg::box_tree;
using wfpg::box_tree_view;
using wfpg::ray;
using wfpg::vec3;

/// Types in kernels need names, for CUDA compilers.
namespace box_tree_test {

/// How often each query found each box, a byte each.
using counts = std::vector<std::uint8_t>;

/// Counts how often each box is found.
struct counter {
  std::uint8_t* found;
  WFPG_HD void operator()(std::uint32_t index) const { ++found[index]; }
};

template <class Query>
struct count_found {
  box_tree_view tree;
  wfpg::array_view<const Query> queries;
  std::uint8_t* found;
  std::size_t boxes;  ///< given ones
  WFPG_HD void operator()(std::size_t i) const { tree.overlaps(queries[i], counter{found + i * boxes}); }
};

struct read_order {
  box_tree_view tree;
  std::uint32_t* order;
  WFPG_HD void operator()(std::size_t i) const { order[i] = tree.index(static_cast<std::uint32_t>(i)); }
};

/// Where a ray enters a box, beyond t_min. Negative where it misses.
WFPG_HD inline float entry_of(const bounds3& box, const ray& r) {
  float first = r.t_min, last = r.t_max;
  for (int axis = 0; axis < 3; ++axis) {
    const float a = (box.lower[axis] - r.origin[axis]) / r.direction[axis];
    const float b = (box.upper[axis] - r.origin[axis]) / r.direction[axis];
    first = wfpg::max(first, wfpg::min(a, b));
    last = wfpg::min(last, wfpg::max(a, b));
  }
  return first <= last ? first : -1.0f;
}

struct nearest {
  float distance = -1.0f;
  std::uint32_t index = ~0u, visited = 0, first_only = 0;
};

/// Finds the box that each ray enters first, and counts the boxes that it looks at.
struct find_nearest {
  box_tree_view tree;
  wfpg::array_view<const bounds3> boxes;
  wfpg::array_view<const ray> rays;
  wfpg::array_view<nearest> found;
  WFPG_HD void operator()(std::size_t i) const {
    nearest best;
    tree.nearest_first(rays[i], [&](std::uint32_t place, float& t_max) {
      ++best.visited;
      const std::uint32_t index = tree.index(place);
      const float distance = entry_of(boxes[index], rays[i]);
      if (distance >= 0.0f && (best.distance < 0.0f || distance < best.distance)) {
        best.distance = t_max = distance;
        best.index = index;
      }
      return false;
    });
    tree.nearest_first(rays[i], [&](std::uint32_t, float&) {
      ++best.first_only;
      return true;
    });
    found[i] = best;
  }
};

/// Writes what queries find, in their order.
struct list_found {
  static constexpr std::size_t most = 256;
  box_tree_view tree;
  wfpg::array_view<const ray> rays;
  wfpg::array_view<std::uint32_t> lists;
  WFPG_HD void operator()(std::size_t i) const {
    std::size_t n = 0;
    const auto add = [&](std::uint32_t index) {
      if (n < most) lists[i * most + n] = index;
      ++n;
    };
    tree.overlaps(rays[i], add);
    tree.overlaps(rays[i].origin, add);
  }
};

/// Counts boxes by calls that wait for others: for rays, and then for their origins.
struct count_waiting {
  box_tree_view tree;
  wfpg::array_view<const ray> rays;
  std::uint8_t* found;
  std::size_t boxes;  ///< given ones

  /// Whether a box is to be found.
  WFPG_HD static bool is_wanted(std::uint32_t index) { return index % 3 != 0; }

  WFPG_HD void operator()(std::size_t i) const {
    const auto holds = [&](std::uint32_t place) { return is_wanted(tree.index(place)); };
    const counter along{found + i * boxes}, around{found + (rays.size() + i) * boxes};
    tree.for_each_place_along(rays[i], holds, [&](std::uint32_t place) { along(tree.index(place)); });
    const vec3 at = rays[i].origin;
    tree.for_each_place(bounds3{at, at}, holds, [&](std::uint32_t place) { around(tree.index(place)); });
  }
};

}  // namespace box_tree_test

namespace {

using namespace box_tree_test;

const float nan = std::numeric_limits<float>::quiet_NaN();
const float infinity = std::numeric_limits<float>::infinity();

using box_list = std::vector<bounds3>;

bounds3 box_at(vec3 centre, vec3 half) {
  return {centre - half, centre + half};
}

box_list random_boxes(std::size_t n, float largest, std::uint64_t seed) {
  random_numbers random(seed);
  box_list boxes;
  for (std::size_t i = 0; i < n; ++i) {
    const vec3 centre = random.point(0.0f, 1.0f);
    boxes.push_back(box_at(centre, random.point(0.0f, largest)));
  }
  return boxes;
}

/// Most boxes lie in clusters that are small beside the distances between them.
box_list clustered_boxes(std::size_t n, std::uint64_t seed) {
  random_numbers random(seed);
  box_list boxes;
  for (std::size_t i = 0; i < n; ++i) {
    const float scale = std::pow(0.1f, static_cast<float>(i % 4));
    const vec3 cluster = i % 4 ? vec3(0.3f * static_cast<float>(i % 4)) : vec3(0.0f);
    boxes.push_back(box_at(cluster + scale * random.point(0.0f, 1.0f), scale * random.point(0.0f, 0.02f)));
  }
  return boxes;
}

/// Boxes on the axes, at powers of two: each of the codes' 63 bits splits seven off. Nodes of such a tree
/// would have more levels than the stack.
box_list nested_boxes() {
  box_list boxes(9, bounds3{vec3(0.0f), vec3(0.0f)});
  boxes.push_back({vec3(1.0f), vec3(1.0f)});
  for (int i = 1; i <= 21; ++i)
    for (int axis = 0; axis < 3; ++axis)
      for (int k = 0; k < 7; ++k) {
        vec3 at(0.0f);
        at[axis] = std::ldexp(1.0f, -i);
        boxes.push_back(box_at(at, vec3(0.01f * static_cast<float>(k) * at[axis])));
      }
  return boxes;
}

bounds3 around(const box_list& boxes) {
  bounds3 whole;
  for (const bounds3& box : boxes) whole = wfpg::bounds_union()(whole, box);
  return whole;
}

/// Points in boxes, on their corners, near them, and anywhere.
std::vector<vec3> points_near(const box_list& boxes, std::size_t n, std::uint64_t seed) {
  random_numbers random(seed);
  const bounds3 whole = around(boxes);
  std::vector<vec3> points;
  for (std::size_t i = 0; i < n; ++i) {
    const bounds3& box = boxes[random.below(static_cast<std::uint32_t>(boxes.size()))];
    const vec3 u = random.point(0.0f, 1.0f);
    if (i % 4 == 0) points.push_back(box.lower + u * box.extent());
    if (i % 4 == 1) points.push_back(i % 8 == 1 ? box.lower : box.upper);
    if (i % 4 == 2) points.push_back(box.lower + (2.0f * u - 0.5f) * box.extent());
    if (i % 4 == 3) points.push_back(whole.lower + (1.2f * u - 0.1f) * whole.extent());
  }
  return points;
}

std::vector<bounds3> boxes_near(const box_list& boxes, std::size_t n, std::uint64_t seed) {
  random_numbers random(seed);
  std::vector<bounds3> queries;
  for (const vec3 p : points_near(boxes, n, seed)) queries.push_back(box_at(p, random.point(0.0f, 0.05f)));
  return queries;
}

std::vector<ray> rays_near(const box_list& boxes, std::size_t n, std::uint64_t seed) {
  random_numbers random(seed);
  const float size = glm::length(around(boxes).extent());
  std::vector<ray> rays;
  for (const vec3 p : points_near(boxes, n, seed)) {
    const std::size_t i = rays.size();
    ray r;
    r.direction = i % 5 ? random.direction() : vec3(0.0f, i % 2 ? 1.0f : -1.0f, 0.0f);
    r.origin = i % 3 ? p - random.between(0.0f, 0.5f) * size * r.direction : p;
    if (i % 4 == 1) r.t_max = 0.3f * size;
    if (i % 4 == 2) r.t_min = 0.1f * size;
    rays.push_back(r);
  }
  return rays;
}

/// Knows how many bytes it has lent at most.
class peak_resource : public wfpg::memory_resource {
 public:
  std::size_t peak() const { return peak_; }

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    void* const block = upstream_->allocate(bytes, alignment);
    peak_ = std::max(peak_, lent_ += bytes);
    return block;
  }
  void do_deallocate(void* block, std::size_t bytes, std::size_t alignment) override {
    lent_ -= bytes;
    upstream_->deallocate(block, bytes, alignment);
  }
  bool do_is_equal(const wfpg::memory_resource& other) const noexcept override { return this == &other; }

  wfpg::memory_resource* upstream_ = default_resource();
  std::size_t lent_ = 0, peak_ = 0;
};

/// Whether a query finds a box: `none` if it may not, `perhaps` if the box lies near.
enum class verdict { none, perhaps, certain };

verdict judge(const bounds3& box, const bounds3& query, vec3 margin) {
  verdict found = verdict::certain;
  for (int axis = 0; axis < 3; ++axis) {
    const float gap = std::max(box.lower[axis] - query.upper[axis], query.lower[axis] - box.upper[axis]);
    if (gap > margin[axis]) return verdict::none;
    if (gap > 0.0f) found = verdict::perhaps;
  }
  return found;
}
verdict judge(const bounds3& box, vec3 point, vec3 margin) {
  return judge(box, bounds3{point, point}, margin);
}

bool crosses(const bounds3& box, const ray& r, double margin_x, double margin_y, double margin_z) {
  const double margins[] = {margin_x, margin_y, margin_z};
  double first = r.t_min, last = r.t_max;
  for (int axis = 0; axis < 3; ++axis) {
    const double lower = double(box.lower[axis]) - margins[axis],
                 upper = double(box.upper[axis]) + margins[axis];
    const double o = r.origin[axis], d = r.direction[axis];
    if (d == 0.0 && (o < lower || o > upper)) return false;
    if (d == 0.0) continue;
    first = std::max(first, std::min((lower - o) / d, (upper - o) / d));
    last = std::min(last, std::max((lower - o) / d, (upper - o) / d));
  }
  return first <= last;
}
verdict judge(const bounds3& box, const ray& r, vec3 margin) {
  if (crosses(box, r, 0.0, 0.0, 0.0)) return verdict::certain;
  return crosses(box, r, margin.x, margin.y, margin.z) ? verdict::perhaps : verdict::none;
}

template <class Exec, class Query>
counts count(const Exec& exec, const box_tree<Exec>& tree, std::size_t boxes,
             const std::vector<Query>& queries) {
  const wfpg::buffer<Query, Exec> asked(exec, queries);
  const wfpg::buffer<std::uint8_t, Exec> found(exec, boxes * queries.size());
  exec.fill_bytes(found.data(), 0, found.bytes());
  exec.for_each(queries.size(), count_found<Query>{tree.view(), asked.view(), found.data(), boxes});
  return found.to_host(exec);
}

/// The boxes of those beside each box in the tree's order, which may be in one leaf with it.
template <class Exec>
box_list leaves_around(const Exec& exec, const box_tree<Exec>& tree, const box_list& boxes,
                       std::uint32_t leaf_boxes) {
  const wfpg::buffer<std::uint32_t, Exec> order(exec, boxes.size());
  exec.for_each(boxes.size(), read_order{tree.view(), order.data()});
  const std::vector<std::uint32_t> places = order.to_host(exec);
  box_list leaves(boxes.size());
  for (std::size_t i = 0; i < places.size(); ++i)
    for (std::size_t k = i; k < std::min<std::size_t>(places.size(), i + leaf_boxes); ++k) {
      leaves[places[i]] = wfpg::bounds_union()(leaves[places[i]], boxes[places[k]]);
      leaves[places[k]] = wfpg::bounds_union()(leaves[places[k]], boxes[places[i]]);
    }
  return leaves;
}

/// Checks each answer: a box may be found if its leaf is near. Returns how many were found that do not meet
/// the query, for each that does.
template <class Query>
double check_counts(const box_list& boxes, const box_list& leaves, const std::vector<Query>& queries,
                    const counts& found) {
  const bounds3 whole = around(boxes);
  // The largest node is the first. Its boxes are at most 1% of its size too large.
  const vec3 margin = 0.01f * whole.extent() + 1e-5f * glm::max(glm::abs(whole.lower), glm::abs(whole.upper));
  std::size_t missed = 0, wrong = 0, again = 0, near = 0, met = 0;
  for (std::size_t i = 0; i < queries.size(); ++i)
    for (std::size_t k = 0; k < boxes.size(); ++k) {
      const int n = found[i * boxes.size() + k];
      const bool certain = judge(boxes[k], queries[i], margin) == verdict::certain;
      missed += certain && n == 0;
      wrong += n > 0 && judge(leaves[k], queries[i], margin) == verdict::none;
      again += n > 1;
      near += !certain && n > 0;
      met += certain;
    }
  CHECK(missed == 0);
  CHECK(wrong == 0);
  CHECK(again == 0);
  return static_cast<double>(near) / static_cast<double>(std::max<std::size_t>(met, 1));
}

/// Checks a tree over boxes with queries of each kind. Returns the largest part of boxes that are only near.
template <class Exec>
double check_tree(const Exec& exec, box_tree<Exec>& tree, const box_list& boxes, std::uint32_t leaf_boxes,
                  std::size_t n) {
  const wfpg::buffer<bounds3, Exec> given(exec, boxes);
  tree.build(exec, given.view(), leaf_boxes);
  CHECK(tree.view().size() == boxes.size());
  CHECK(tree.skipped() == 0);
  const auto points = points_near(boxes, n, 1);
  const auto queries = boxes_near(boxes, n, 2);
  const auto rays = rays_near(boxes, n, 3);
  const std::size_t size = boxes.size();
  const box_list leaves = leaves_around(exec, tree, boxes, leaf_boxes);
  const double of_points = check_counts(boxes, leaves, points, count(exec, tree, size, points));
  const double of_boxes = check_counts(boxes, leaves, queries, count(exec, tree, size, queries));
  const double of_rays = check_counts(boxes, leaves, rays, count(exec, tree, size, rays));
  return std::max(of_points, std::max(of_boxes, of_rays));
}

WFPG_TEST_CASE("a tree's queries agree with a test of each box", "[box_tree]") {
  const Exec exec;
  box_tree<Exec> tree;  // one for all, larger and smaller ones in turn
  for (const std::uint32_t leaf_boxes : {1u, 2u, 4u, 7u})
    for (const std::size_t n : {1u, 2u, 3u, 5u, 9u, 40u, 2000u, 300u}) {
      INFO(n << " boxes, leaves of " << leaf_boxes);
      check_tree(exec, tree, random_boxes(n, 0.05f, n), leaf_boxes, 200);
      check_tree(exec, tree, clustered_boxes(n, n), leaf_boxes, 200);
    }
}

WFPG_TEST_CASE("a tree of 300,000 boxes has each once, and points find those that hold them", "[box_tree]") {
  const Exec exec;
  // Its levels have more nodes than are made without asking how many there are.
  box_list boxes = random_boxes(300000, 0.001f, 61);
  for (std::size_t i = 0; i < boxes.size(); i += 3) boxes[i] = bounds3{};
  const wfpg::buffer<bounds3, Exec> given(exec, boxes);
  box_tree<Exec> tree;
  tree.build(exec, given.view());
  CHECK(tree.skipped() == 100000);
  REQUIRE(tree.view().size() == 200000);
  const wfpg::buffer<std::uint32_t, Exec> order(exec, tree.view().size());
  exec.for_each(order.size(), read_order{tree.view(), order.data()});
  std::vector<std::uint32_t> indices = order.to_host(exec);
  std::sort(indices.begin(), indices.end());
  std::size_t wrong = 0;
  for (std::size_t k = 0; k < indices.size(); ++k) wrong += indices[k] != 3 * (k / 2) + 1 + k % 2;
  CHECK(wrong == 0);

  const auto chosen = [](std::size_t i) { return 15000 * i + 1 + i % 2; };
  std::vector<vec3> centres;
  for (std::size_t i = 0; i < 20; ++i) centres.push_back(boxes[chosen(i)].centre());
  const counts found = count(exec, tree, boxes.size(), centres);
  std::size_t missed = 0, all = 0;
  for (std::size_t i = 0; i < centres.size(); ++i) missed += found[i * boxes.size() + chosen(i)] != 1;
  for (const std::uint8_t times : found) all += times;
  CHECK(missed == 0);
  CHECK(all < 60);
}

WFPG_TEST_CASE("a tree finds few boxes that are only near", "[box_tree]") {
  const Exec exec;
  box_tree<Exec> tree;
  CHECK(check_tree(exec, tree, random_boxes(2000, 0.05f, 7), 1, 400) < 0.06);
}

WFPG_TEST_CASE("trees over points, equal boxes and boxes of all scales are right", "[box_tree]") {
  const Exec exec;
  box_tree<Exec> tree;
  const bounds3 one = box_at(vec3(0.3f, -2.0f, 40.0f), vec3(0.1f, 0.0f, 0.2f));
  for (const std::uint32_t leaf_boxes : {1u, 4u}) {
    INFO("leaves of " << leaf_boxes);
    check_tree(exec, tree, random_boxes(1000, 0.0f, 5), leaf_boxes, 300);
    check_tree(exec, tree, box_list(700, one), leaf_boxes, 20);
    check_tree(exec, tree, nested_boxes(), leaf_boxes, 500);
    box_list same_centre, far_away = random_boxes(500, 0.1f, 6);
    for (int i = 0; i < 300; ++i)
      same_centre.push_back(box_at(vec3(1.0f), vec3(0.01f * static_cast<float>(i))));
    for (const bounds3& box : random_boxes(500, 1e-3f, 8))
      far_away.push_back({1e5f + box.lower, 1e5f + box.upper});
    far_away.push_back(box_at(vec3(1e14f), vec3(1e13f)));
    check_tree(exec, tree, same_centre, leaf_boxes, 300);
    check_tree(exec, tree, far_away, leaf_boxes, 300);
  }
}

WFPG_TEST_CASE("a tree skips and counts boxes that are empty or not finite", "[box_tree]") {
  const Exec exec;
  const vec3 zero(0.0f), one(1.0f);
  box_list boxes{bounds3{},
                 {one, zero},
                 {zero, {1.0f, -1.0f, 1.0f}},
                 {vec3(nan), one},
                 {zero, {1.0f, nan, 1.0f}},
                 {zero, vec3(infinity)},
                 {vec3(-infinity), one},
                 {zero, {0.0f, 1.0f, 1.0001e15f}}};
  box_tree<Exec> tree;
  const auto build = [&] {
    const wfpg::buffer<bounds3, Exec> given(exec, boxes);
    tree.build(exec, given.view());
  };
  const std::vector<vec3> points{vec3(0.5f), zero, vec3(nan), vec3(infinity), {0.5f, 0.5f, nan}, vec3(-2.0f)};
  build();
  CHECK(tree.skipped() == 8);
  CHECK(tree.view().size() == 0);
  CHECK(count(exec, tree, boxes.size(), points) == counts(boxes.size() * points.size(), 0));

  boxes.insert(boxes.begin() + 3, bounds3{zero, one});
  build();
  CHECK(tree.skipped() == 8);
  CHECK(tree.view().size() == 1);
  counts expected(boxes.size() * points.size(), 0);
  expected[3] = expected[boxes.size() + 3] = 1;
  CHECK(count(exec, tree, boxes.size(), points) == expected);

  boxes.clear();
  build();
  CHECK(tree.skipped() == 0);
  CHECK(tree.view().size() == 0);
  CHECK(count(exec, tree, 0, points).empty());
}

WFPG_TEST_CASE("queries that are empty or not finite find no box", "[box_tree]") {
  const Exec exec;
  const box_list boxes = random_boxes(50, 0.5f, 3);
  const wfpg::buffer<bounds3, Exec> given(exec, boxes);
  box_tree<Exec> tree;
  tree.build(exec, given.view());
  const std::vector<bounds3> queries{bounds3{},
                                     {vec3(1.0f), vec3(0.0f)},
                                     {vec3(nan), vec3(1.0f)},
                                     {vec3(0.0f), {1.0f, nan, 1.0f}},
                                     {vec3(-infinity), vec3(infinity)}};
  CHECK(count(exec, tree, boxes.size(), queries) == counts(boxes.size() * queries.size(), 0));
  ray r;
  r.origin = vec3(0.5f);
  std::vector<ray> rays(4, r);
  rays[0].origin.y = nan;
  rays[1].direction.x = infinity;
  rays[2].t_max = -1.0f;
  rays[3].t_min = 1e4f;
  CHECK(count(exec, tree, boxes.size(), rays) == counts(boxes.size() * rays.size(), 0));
}

WFPG_TEST_CASE("a ray finds the nearest box, and looks at few", "[box_tree]") {
  const Exec exec;
  const box_list boxes = random_boxes(4000, 0.06f, 12);
  std::vector<ray> rays = rays_near(boxes, 1000, 4);
  for (ray& r : rays)
    for (int axis = 0; axis < 3; ++axis) r.direction[axis] += r.direction[axis] == 0.0f ? 1e-3f : 0.0f;
  const wfpg::buffer<bounds3, Exec> given(exec, boxes);
  const wfpg::buffer<ray, Exec> asked(exec, rays);
  const wfpg::buffer<nearest, Exec> found(exec, rays.size());
  for (const std::uint32_t leaf_boxes : {1u, 4u}) {
    box_tree<Exec> tree;
    tree.build(exec, given.view(), leaf_boxes);
    exec.for_each(rays.size(), find_nearest{tree.view(), given.view(), asked.view(), found.view()});
    std::size_t wrong = 0, visited = 0, crossed = 0, ends = 0;
    const std::vector<nearest> answers = found.to_host(exec);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      float expected = -1.0f;
      for (const bounds3& box : boxes) {
        const float distance = entry_of(box, rays[i]);
        crossed += distance >= 0.0f;
        if (distance >= 0.0f && (expected < 0.0f || distance < expected)) expected = distance;
      }
      wrong += !alike(answers[i].distance, expected);
      visited += answers[i].visited;
      ends += answers[i].first_only > 1 || (expected >= 0.0f && answers[i].first_only == 0);
    }
    INFO("leaves of " << leaf_boxes << ": " << visited << " visited, " << crossed << " crossed");
    CHECK(wrong == 0);
    CHECK(ends == 0);
    CHECK(visited * 20 < crossed * leaf_boxes * 3);
  }
}

/// The policy to compare with: the same one, a second time, where others may round in another way.
template <class Exec>
using reference = std::conditional_t<same_operations_same_bits, host_policy, Exec>;

template <class Exec>
std::vector<std::uint32_t> lists(const box_list& boxes, const std::vector<ray>& rays) {
  const Exec exec;
  const wfpg::buffer<bounds3, Exec> given(exec, boxes);
  const wfpg::buffer<ray, Exec> asked(exec, rays);
  const wfpg::buffer<std::uint32_t, Exec> listed(exec, rays.size() * list_found::most);
  exec.fill_bytes(listed.data(), 0xff, listed.bytes());
  box_tree<Exec> tree;
  tree.build(exec, given.view(), 2);
  exec.for_each(rays.size(), list_found{tree.view(), asked.view(), listed.view()});
  std::vector<std::uint32_t> result = listed.to_host(exec);
  result.push_back(static_cast<std::uint32_t>(tree.node_count()));
  return result;
}

WFPG_TEST_CASE("trees and the order of what is found are equal on all policies", "[box_tree]") {
  box_list boxes = random_boxes(3000, 0.03f, 21);
  for (const bounds3& box : box_list(boxes.begin(), boxes.begin() + 500))
    boxes.push_back(box);  // equal codes
  const std::vector<ray> rays = rays_near(boxes, 500, 22);
  CHECK((lists<Exec>(boxes, rays) == lists<reference<Exec>>(boxes, rays)));
}

WFPG_TEST_CASE("calls that wait for others find the same boxes, each once", "[box_tree]") {
  const Exec exec;
  // Some queries find more boxes than wait at once.
  const box_list boxes = random_boxes(3000, 0.2f, 23);
  const std::vector<ray> rays = rays_near(boxes, 100, 24);
  std::vector<vec3> origins;
  for (const ray& r : rays) origins.push_back(r.origin);
  const wfpg::buffer<bounds3, Exec> given(exec, boxes);
  const wfpg::buffer<ray, Exec> asked(exec, rays);
  for (const std::uint32_t leaf_boxes : {1u, 7u}) {
    box_tree<Exec> tree;
    tree.build(exec, given.view(), leaf_boxes);
    counts expected = count(exec, tree, boxes.size(), rays);
    const counts by_origins = count(exec, tree, boxes.size(), origins);
    expected.insert(expected.end(), by_origins.begin(), by_origins.end());
    for (std::size_t k = 0; k < expected.size(); ++k)
      if (!count_waiting::is_wanted(static_cast<std::uint32_t>(k % boxes.size()))) expected[k] = 0;
    std::ptrdiff_t most = 0;
    for (auto query = expected.begin(); query != expected.end(); query += 3000)
      most = std::max(most, std::count(query, query + 3000, 1));
    CHECK(most > 100);

    const wfpg::buffer<std::uint8_t, Exec> found(exec, expected.size());
    exec.fill_bytes(found.data(), 0, found.bytes());
    exec.for_each(rays.size(), count_waiting{tree.view(), asked.view(), found.data(), boxes.size()});
    CHECK((found.to_host(exec) == expected));
  }
}

static_assert(std::is_trivially_copyable_v<box_tree_view> && sizeof(box_tree_view) == 24);

WFPG_TEST_CASE("a tree keeps within 40 bytes a box, and its memory is used again", "[box_tree]") {
  peak_resource resource;
  const Exec exec = Exec().with_resource(&resource);
  const std::size_t n = 5000;
  box_tree<Exec> tree;
  const auto build = [&](const box_list& boxes, std::uint32_t leaf_boxes) {
    const wfpg::buffer<bounds3, Exec> given(exec, boxes);
    tree.build(exec, given.view(), leaf_boxes);
  };
  build(random_boxes(n, 0.01f, 31), 1);
  CHECK(resource.peak() <= (165 + sizeof(bounds3)) * n + 16384);  // the given boxes too
  CHECK(tree.bytes() == 64 * tree.node_count() + 4 * n);
  CHECK(tree.bytes() <= 40 * n);
  const std::size_t bytes = tree.bytes();
  build(random_boxes(n / 2, 0.01f, 32), 1);
  CHECK(tree.bytes() == bytes);
  CHECK(64 * tree.node_count() < bytes * 2 / 3);
  box_tree<Exec> other;
  std::swap(tree, other);
  CHECK(other.bytes() == bytes);
  CHECK(other.view().size() == n / 2);
}

WFPG_TEST_CASE("a second build over kept memory asks for none", "[box_tree]") {
  failing_resource resource;
  wfpg::retaining_resource kept(&resource);
  const Exec exec = Exec().with_resource(&kept);
  const wfpg::buffer<bounds3, Exec> given(exec, random_boxes(1000, 0.1f, 51));
  box_tree<Exec> tree;
  tree.build(exec, given.view());
  resource.fail_at(1);
  tree.build(exec, given.view());
  CHECK(resource.asked() == 0);
  CHECK(tree.view().size() == 1000);
}

WFPG_TEST_CASE("a tree whose memory runs out is empty, and can be built again", "[box_tree]") {
  failing_resource resource;
  const Exec exec = Exec().with_resource(&resource);
  const box_list few = random_boxes(100, 0.1f, 41), many = random_boxes(1000, 0.1f, 42);
  const wfpg::buffer<bounds3, Exec> few_given(exec, few), many_given(exec, many);
  const std::size_t failures =
      fail_at_each(resource, [&] { box_tree<Exec>().build(exec, many_given.view()); });
  CHECK(failures >= 12);
  for (std::size_t k = 1; k < failures; k += 3) {
    resource.fail_at(0);
    box_tree<Exec> tree;
    tree.build(exec, few_given.view());
    resource.fail_at(k);
    CHECK(runs_out(resource, [&] { tree.build(exec, many_given.view()); }));
    resource.fail_at(0);
    CHECK(tree.view().size() == 0);
    CHECK(tree.node_count() == 0);
    CHECK(count(exec, tree, 1, std::vector<vec3>{vec3(0.5f)}) == counts(1, 0));
    check_tree(exec, tree, many, 1, 20);
  }
  print_failed(failures);
}

WFPG_TEST_CASE("numbers of boxes out of range are refused", "[box_tree]") {
  const Exec exec;
  box_tree<Exec> tree;
  const wfpg::array_view<const bounds3> none;
  CHECK_THROWS_AS(tree.build(exec, none, 0), std::invalid_argument);
  CHECK_THROWS_AS(tree.build(exec, none, 8), std::invalid_argument);
  CHECK_THROWS_AS(tree.build(exec, {nullptr, std::size_t(1) << 28}), std::invalid_argument);
}

}  // namespace
