// The photon map, compared with a test of each photon: each found once, in clusters and alone, equal maps on
// every policy, and memory that runs out.
#include "support/failing_resource.hpp"
#include "support/policies.hpp"
#include "support/sample_means.hpp"

#include <wfpg/light/photon_map.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <type_traits>
#include <vector>

using namespace wfpg_test;
using wfpg::photon_map;
using wfpg::photon_map_view;
using wfpg::vec3;

/// Types in kernels need names, for CUDA compilers.
namespace photon_map_test {

struct counter {
  std::uint8_t* found;
  WFPG_HD void operator()(std::uint32_t index) const { ++found[index]; }
};

struct count_photons {
  photon_map_view map;
  wfpg::array_view<const vec3> points;
  std::uint8_t* found;
  std::size_t photons;  ///< given ones
  WFPG_HD void operator()(std::size_t i) const {
    map.for_each_point(points[i], counter{found + i * photons});
  }
};

/// Sums what depends on the order in which photons are found: by indices, and by places.
struct order_sums {
  photon_map_view map;
  wfpg::array_view<const vec3> points;
  wfpg::array_view<std::uint64_t> sums;
  WFPG_HD void operator()(std::size_t i) const {
    std::uint64_t sum = 0, by_place = 0;
    map.for_each_point(points[i], [&](std::uint32_t index) { sum = wfpg::hash(sum, index); });
    map.for_each_place(points[i],
                       [&](std::uint32_t place) { by_place = wfpg::hash(by_place, map.index(place)); });
    sums[2 * i] = sum;
    sums[2 * i + 1] = by_place;
  }
};

/// The photons that a point finds: their number, and how many they count for.
struct weighed {
  std::uint32_t found = 0;
  float weight = 0.0f;
};

struct weigh {
  photon_map_view map;
  wfpg::array_view<const vec3> points;
  wfpg::array_view<weighed> result;
  WFPG_HD void operator()(std::size_t i) const {
    weighed sum;
    map.for_each_place(points[i], [&](std::uint32_t place) {
      ++sum.found;
      sum.weight += map.weight(place);
    });
    result[i] = sum;
  }
};

}  // namespace photon_map_test

namespace {

using namespace photon_map_test;

using points = std::vector<vec3>;
using counts = std::vector<std::uint8_t>;

const float nan = std::numeric_limits<float>::quiet_NaN();
const float infinity = std::numeric_limits<float>::infinity();

/// Points on the faces of a box.
points on_faces(std::size_t n, vec3 corner, float size, std::uint64_t seed) {
  random_numbers random(seed);
  points result;
  for (std::size_t i = 0; i < n; ++i) {
    vec3 p = random.point(0.0f, 1.0f);
    p[static_cast<int>(i % 3)] = i % 2 ? 1.0f : 0.0f;
    result.push_back(corner + size * p);
  }
  return result;
}

points joined(points a, const points& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

template <class Exec>
counts count(const Exec& exec, const photon_map<Exec>& map, std::size_t photons, const points& asked) {
  const wfpg::buffer<vec3, Exec> at(exec, asked);
  const wfpg::buffer<std::uint8_t, Exec> found(exec, photons * asked.size());
  exec.fill_bytes(found.data(), 0, found.bytes());
  exec.for_each(asked.size(), count_photons{map.view(), at.view(), found.data(), photons});
  return found.to_host(exec);
}

template <class Exec>
void build(const Exec& exec, photon_map<Exec>& map, const points& photons, float radius,
           const wfpg::photon_thinning& thinning = {}) {
  const wfpg::buffer<vec3, Exec> given(exec, photons);
  map.build(exec, given.view(), radius, thinning);
}

/// Builds a map, and checks what it finds at photons and beside them. Returns the number of pairs.
template <class Exec>
std::size_t check_map(const Exec& exec, photon_map<Exec>& map, const points& photons, float radius) {
  build(exec, map, photons, radius);
  CHECK(map.view().size() == photons.size());
  CHECK(map.view().radius() == radius);
  CHECK(map.skipped() == 0);
  random_numbers random(photons.size());
  points asked;
  for (std::size_t i = 0; i < 200; ++i) {
    const vec3 p = photons[random.below(static_cast<std::uint32_t>(photons.size()))];
    // Some at about the radius, where a photon is found or not by its last bit.
    const float far[] = {0.0f, random.between(0.0f, 1.5f), random.between(0.999f, 1.001f)};
    asked.push_back(p + far[i % 3] * radius * random.direction());
  }
  const counts found = count(exec, map, photons.size(), asked);
  std::size_t missed = 0, wrong = 0, again = 0, pairs = 0;
  for (std::size_t i = 0; i < asked.size(); ++i)
    for (std::size_t k = 0; k < photons.size(); ++k) {
      const int n = found[i * photons.size() + k];
      const double distance = glm::length(glm::dvec3(photons[k]) - glm::dvec3(asked[i]));
      const double rounding = 1e-6 * double(radius) + 1e-7 * double(glm::length(asked[i]));
      missed += distance < double(radius) - rounding && n == 0;
      wrong += distance > double(radius) + rounding && n > 0;
      again += n > 1;
      pairs += n > 0;
    }
  CHECK(missed == 0);
  CHECK(wrong == 0);
  CHECK(again == 0);
  return pairs;
}

WFPG_TEST_CASE("a photon map agrees with a test of each photon", "[photon_map]") {
  const Exec exec;
  photon_map<Exec> map;  // one for all, larger and smaller ones in turn
  for (const std::size_t n : {1u, 2u, 3u, 8u, 50u, 3000u, 200u})
    for (const float radius : {1e-4f, 0.02f, 0.3f, 5.0f}) {
      INFO(n << " photons, radius " << radius);
      const std::size_t pairs = check_map(exec, map, on_faces(n, vec3(-0.2f), 1.0f, n), radius);
      CHECK(pairs >= 60);
      if (radius > 2.0f) CHECK(pairs >= 60 * n);
    }
}

WFPG_TEST_CASE("clustered and far photons, and many in one place, are found once", "[photon_map]") {
  const Exec exec;
  photon_map<Exec> map;
  const points cluster = on_faces(2000, vec3(3.0f), 1e-3f, 2);
  CHECK(check_map(exec, map, joined(on_faces(500, vec3(0.0f), 100.0f, 1), cluster), 2e-4f) > 200);
  CHECK(check_map(exec, map, joined(on_faces(500, vec3(-1e4f), 1.0f, 3), on_faces(500, vec3(1e4f), 1.0f, 4)),
                  0.05f) > 200);
  CHECK(check_map(exec, map, points(600, vec3(0.5f, -7.0f, 0.0f)), 0.1f) > 600 * 67);
  CHECK(check_map(exec, map, points(600, vec3(0.0f)), wfpg::least_merge_radius) >= 600 * 67);
}

WFPG_TEST_CASE("a photon is found at the radius, and not beyond", "[photon_map]") {
  const Exec exec;
  photon_map<Exec> map;
  const float radius = 0.5f, beyond = std::nextafter(radius, 1.0f);
  points asked;
  for (int axis = 0; axis < 3; ++axis)
    for (const float distance : {-radius, radius, -beyond, beyond}) {
      asked.emplace_back(0.0f);
      asked.back()[axis] = distance;
    }
  build(exec, map, {vec3(0.0f)}, radius);
  const counts expected{1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0};
  CHECK(count(exec, map, 1, asked) == expected);
}

WFPG_TEST_CASE("a photon map skips and counts positions that are not finite", "[photon_map]") {
  const Exec exec;
  photon_map<Exec> map;
  const points photons{
      vec3(nan), {0.0f, infinity, 0.0f}, vec3(1.0f), {0.0f, 0.0f, -1e15f}, {nan, 1.0f, 1.0f}};
  build(exec, map, photons, 0.5f);
  CHECK(map.view().size() == 1 + 1);
  CHECK(map.skipped() == 3);
  build(exec, map, photons, 1e14f);  // the sphere of the far one reaches too far
  CHECK(map.view().size() == 1);
  CHECK(map.skipped() == 4);

  build(exec, map, photons, 0.5f);
  const points asked{vec3(1.0f), {1.0f, 1.0f, 1.6f}, vec3(nan), {1.0f, infinity, 1.0f}};
  counts expected(photons.size() * asked.size(), 0);
  expected[2] = 1;
  CHECK(count(exec, map, photons.size(), asked) == expected);
}

WFPG_TEST_CASE("a photon map without photons finds none", "[photon_map]") {
  const Exec exec;
  photon_map<Exec> map;
  const points asked{vec3(0.0f)};
  CHECK(map.view().size() == 0);
  CHECK(map.bytes() == 0);
  CHECK(count(exec, map, 1, asked) == counts(1, 0));
  build(exec, map, {vec3(0.0f)}, 1.0f);
  CHECK(count(exec, map, 1, asked) == counts(1, 1));
  build(exec, map, {}, 1.0f);
  CHECK(map.view().size() == 0);
  CHECK(count(exec, map, 1, asked) == counts(1, 0));
}

WFPG_TEST_CASE("a radius out of range is refused, and leaves the map as it was", "[photon_map]") {
  const Exec exec;
  photon_map<Exec> map;
  const points photons{vec3(0.0f)};
  build(exec, map, photons, 1.0f);
  for (const float radius : {0.0f, -1.0f, nan, infinity, 0.5e-15f, 2e15f})
    CHECK_THROWS_AS(build(exec, map, photons, radius), std::invalid_argument);
  CHECK(map.view().radius() == 1.0f);
  CHECK(count(exec, map, 1, photons) == counts(1, 1));
}

/// The policy to compare with: the same one, a second time, where others may round in another way.
template <class Exec>
using reference = std::conditional_t<same_operations_same_bits, host_policy, Exec>;

template <class Exec>
std::vector<std::uint64_t> sums(const points& photons, const points& asked,
                                const wfpg::photon_thinning& thinning = {}) {
  const Exec exec;
  photon_map<Exec> map;
  build(exec, map, photons, 0.05f, thinning);
  const wfpg::buffer<vec3, Exec> at(exec, asked);
  const wfpg::buffer<std::uint64_t, Exec> result(exec, 2 * asked.size());
  exec.for_each(asked.size(), order_sums{map.view(), at.view(), result.view()});
  return result.to_host(exec);
}

WFPG_TEST_CASE("photons are found in one order on all policies", "[photon_map]") {
  const points photons = joined(on_faces(5000, vec3(0.0f), 1.0f, 5), points(50, vec3(0.5f, 0.5f, 0.0f)));
  const points asked = on_faces(1000, vec3(0.0f), 1.0f, 6);
  const std::vector<std::uint64_t> found = sums<Exec>(photons, asked);
  CHECK((found == sums<reference<Exec>>(photons, asked)));
  for (std::size_t i = 0; i < found.size(); i += 2) CHECK(found[i] == found[i + 1]);
  const wfpg::photon_thinning thinning{3, 8};
  const std::vector<std::uint64_t> fewer = sums<Exec>(photons, asked, thinning);
  CHECK((fewer == sums<reference<Exec>>(photons, asked, thinning)));
  CHECK(fewer != found);
}

WFPG_TEST_CASE("where photons are dense some are left out, and others count for them", "[photon_map]") {
  const Exec exec;
  photon_map<Exec> map;
  const std::size_t clusters = 100, size = 150, builds = 150;
  const float radius = 0.1f;
  random_numbers random(21);
  points photons, centres;
  for (std::size_t k = 0; k < clusters; ++k) {
    centres.push_back(static_cast<float>(k) * vec3(0.77f, 1.31f, -0.59f));
    for (std::size_t i = 0; i < size; ++i)
      photons.push_back(centres.back() + 0.3f * radius * random.point(-1.0f, 1.0f));
  }
  const wfpg::buffer<vec3, Exec> at(exec, centres);
  const wfpg::buffer<weighed, Exec> result(exec, clusters);
  wfpg::testing::sample_mean weight;
  std::size_t found = 0;
  for (std::uint64_t seed = 1; seed <= builds; ++seed) {
    build(exec, map, photons, radius, {16, seed});
    CHECK(map.view().size() + map.skipped() == photons.size());
    exec.for_each(clusters, weigh{map.view(), at.view(), result.view()});
    for (const weighed& one : result.to_host(exec)) {
      weight.add(double(one.weight) / double(size));
      found += one.found;
    }
  }
  CHECK(has_mean(weight, 1.0));
  // A cluster is in up to eight cells.
  CHECK(found > 16 * clusters * builds * 3 / 4);
  CHECK(found < 16 * clusters * builds * 4);
}

WFPG_TEST_CASE("photons that are not dense are all kept, and count once", "[photon_map]") {
  const Exec exec;
  photon_map<Exec> map;
  const points photons = on_faces(3000, vec3(0.0f), 1.0f, 31);
  build(exec, map, photons, 0.01f, {32, 1});
  CHECK(map.view().size() == photons.size());
  const wfpg::buffer<vec3, Exec> at(exec, photons);
  const wfpg::buffer<weighed, Exec> result(exec, photons.size());
  exec.for_each(photons.size(), weigh{map.view(), at.view(), result.view()});
  std::size_t wrong = 0;
  for (const weighed& one : result.to_host(exec))
    wrong += one.found == 0 || one.weight != static_cast<float>(one.found);
  CHECK(wrong == 0);
  CHECK_THROWS_WITH(build(exec, map, photons, 0.01f, {0, 1}), WFPG_TEST_CONTAINS("cell_photons"));
}

static_assert(std::is_trivially_copyable_v<photon_map_view> && sizeof(photon_map_view) == 48);

WFPG_TEST_CASE("a photon map takes at most 40 bytes a photon, and uses its memory again", "[photon_map]") {
  const Exec exec;
  photon_map<Exec> map;
  const std::size_t n = 20000;
  build(exec, map, on_faces(n, vec3(0.0f), 1.0f, 7), 0.01f);
  const std::size_t bytes = map.bytes();
  CHECK(bytes <= 24 * n);
  build(exec, map, on_faces(n / 2, vec3(0.0f), 1.0f, 8), 0.02f);
  CHECK(map.bytes() == bytes);
  build(exec, map, joined(on_faces(n, vec3(0.0f), 1e-3f, 9), {vec3(100.0f)}), 1e-5f);
  CHECK(map.bytes() <= 40 * n);
}

WFPG_TEST_CASE("a photon map whose memory runs out has no photons, and can be built again", "[photon_map]") {
  failing_resource resource;
  const Exec exec = Exec().with_resource(&resource);
  const points few = on_faces(50, vec3(0.0f), 1.0f, 10), many = on_faces(900, vec3(0.0f), 1.0f, 11);
  const wfpg::buffer<vec3, Exec> few_given(exec, few), many_given(exec, many);
  const std::size_t failures =
      fail_at_each(resource, [&] { photon_map<Exec>().build(exec, many_given.view(), 0.1f); });
  CHECK(failures >= 12);
  for (std::size_t k = 1; k < failures; ++k) {
    resource.fail_at(0);
    photon_map<Exec> map;
    map.build(exec, few_given.view(), 0.1f);
    resource.fail_at(k);
    CHECK(runs_out(resource, [&] { map.build(exec, many_given.view(), 0.1f); }));
    resource.fail_at(0);
    CHECK(map.view().size() == 0);
    CHECK(count(exec, map, 1, few) == counts(few.size(), 0));
    if (k % 4 == 0) check_map(exec, map, many, 0.1f);
  }
  print_failed(failures);
}

}  // namespace
