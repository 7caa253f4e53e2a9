// The beam map, and the photon map along beams, compared with all beams and photons one by one.
#include "support/catch.hpp"
#include "support/evaluate.hpp"
#include "support/failing_resource.hpp"
#include "support/policies.hpp"

#include <wfpg/light/beam_map.hpp>
#include <wfpg/light/photon_map.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <vector>

namespace {

using namespace wfpg_test;
using wfpg::merge_geometry;
using wfpg::merge_kernel;
using wfpg::path_beam;
using wfpg::vec3;

constexpr merge_kernel shape = merge_kernel::epanechnikov;

vec3 random_vector(random_numbers& random, float half) {
  const auto x = [&] { return half * (2.0f * random.unit() - 1.0f); };
  const float a = x(), b = x(), c = x();
  return {a, b, c};
}

/// Beams of very different lengths from one place, or all over a cube.
std::vector<path_beam> random_beams(std::size_t n, bool clustered, std::uint32_t seed) {
  random_numbers random(seed);
  std::vector<path_beam> beams;
  for (std::size_t i = 0; i < n; ++i) {
    path_beam b;
    b.origin = clustered ? vec3(0.9f) + random_vector(random, 0.02f) : random_vector(random, 1.0f);
    b.direction = glm::normalize(random_vector(random, 1.0f) + vec3(1e-3f, 0.0f, 0.0f));
    b.begin = i % 3 == 0 ? 0.1f : 0.0f;
    b.end = b.begin + 2.0f * std::pow(random.unit(), 4.0f) + 1e-3f;
    beams.push_back(b);
  }
  return beams;
}

/// What a query found: how many, and a sum that depends on which.
struct found_merges {
  std::uint32_t count = 0;
  std::uint64_t indices = 0;
  float kernels = 0.0f, camera = 0.0f;
};

WFPG_HD void add(found_merges& sum, std::uint32_t index, const merge_geometry& at) {
  ++sum.count;
  sum.indices += wfpg::hash(1, index);
  sum.kernels += at.kernel / at.sine;
  sum.camera += at.t_camera;
}

struct query_beams {
  wfpg::beam_map_view map;
  wfpg::array_view<const path_beam> cameras;
  WFPG_HD found_merges operator()(std::size_t i) const {
    found_merges found;
    map.for_each_beam_along(cameras[i], shape,
                            [&](std::uint32_t index, const merge_geometry& at) { add(found, index, at); });
    return found;
  }
};

struct query_points {
  wfpg::photon_map_view map;
  wfpg::array_view<const path_beam> cameras;
  WFPG_HD found_merges operator()(std::size_t i) const {
    found_merges found;
    map.for_each_point_along(cameras[i], shape,
                             [&](std::uint32_t index, const merge_geometry& at) { add(found, index, at); });
    return found;
  }
};

/// Compares with brute force. Sums of kernels have another order there. Returns the number of merges.
void check_found(const std::vector<found_merges>& found, const std::vector<found_merges>& expected,
                 std::size_t least) {
  REQUIRE(found.size() == expected.size());
  std::size_t merges = 0, wrong = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    wrong += found[i].count != expected[i].count || found[i].indices != expected[i].indices ? 1 : 0;
    wrong += std::abs(found[i].kernels - expected[i].kernels) <= 1e-4f * expected[i].kernels + 1e-6f ? 0 : 1;
    merges += expected[i].count;
  }
  CHECK(wrong == 0);
  CHECK(merges >= least);
}

std::vector<found_merges> beams_by_force(const std::vector<path_beam>& beams,
                                         const std::vector<path_beam>& cameras, float radius) {
  std::vector<found_merges> all(cameras.size());
  for (std::size_t c = 0; c < cameras.size(); ++c)
    for (std::size_t i = 0; i < beams.size(); ++i) {
      const merge_geometry at = wfpg::beam_beam_merge(shape, cameras[c], beams[i], radius);
      if (at.kernel > 0.0f) add(all[c], static_cast<std::uint32_t>(i), at);
    }
  return all;
}

}  // namespace

WFPG_TEST_CASE("a camera beam finds each beam that it merges with once", "[beam_map]") {
  const Exec exec;
  const std::vector<path_beam> cameras = random_beams(300, false, 1);
  const wfpg::buffer<path_beam, Exec> device_cameras(exec, cameras);
  wfpg::beam_map<Exec> map;
  for (const bool clustered : {false, true})
    for (const std::size_t n : {std::size_t(0), std::size_t(1), std::size_t(2), std::size_t(2000)}) {
      const std::vector<path_beam> beams = random_beams(n, clustered, 2);
      const wfpg::buffer<path_beam, Exec> device_beams(exec, beams);
      for (const float radius : {0.002f, 0.05f}) {
        const std::vector<found_merges> expected = beams_by_force(beams, cameras, radius);
        for (const std::size_t max_pieces : {n, 2 * n + 1, std::size_t(20000)}) {
          map.build(exec, device_beams.view(), {radius, max_pieces});
          CHECK(map.view().pieces() >= n);
          CHECK(map.view().pieces() <= max_pieces);
          if (n == 2000) CHECK(map.bytes() < 74 * std::max(max_pieces, std::size_t(20000)));
          const auto found = evaluate(exec, cameras.size(), query_beams{map.view(), device_cameras.view()});
          check_found(found, expected, n == 2000 && radius > 0.01f && !clustered ? 300 : 0);
        }
      }
    }
}

WFPG_TEST_CASE("a camera beam finds each photon that it merges with once", "[beam_map]") {
  const Exec exec;
  const std::vector<path_beam> cameras = random_beams(300, false, 3);
  const wfpg::buffer<path_beam, Exec> device_cameras(exec, cameras);
  random_numbers random(4);
  std::vector<vec3> photons;
  for (int i = 0; i < 3000; ++i) photons.push_back(random_vector(random, 1.0f));
  const wfpg::buffer<vec3, Exec> device_photons(exec, photons);
  wfpg::photon_map<Exec> map;
  for (const float radius : {0.01f, 0.1f}) {
    map.build(exec, device_photons.view(), radius);
    std::vector<found_merges> expected(cameras.size());
    for (std::size_t c = 0; c < cameras.size(); ++c)
      for (std::size_t i = 0; i < photons.size(); ++i) {
        const merge_geometry at = wfpg::beam_point_merge(shape, cameras[c], photons[i], radius);
        if (at.kernel > 0.0f) add(expected[c], static_cast<std::uint32_t>(i), at);
      }
    check_found(evaluate(exec, cameras.size(), query_points{map.view(), device_cameras.view()}), expected,
                radius > 0.05f ? 800 : 5);
  }
}

WFPG_TEST_CASE("beams that are empty or not finite have no pieces", "[beam_map]") {
  const Exec exec;
  constexpr float infinity = std::numeric_limits<float>::infinity(),
                  nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<path_beam> beams = random_beams(6, false, 5);
  beams[0].end = beams[0].begin;
  beams[1].end = infinity;
  beams[2].origin.y = nan;
  beams[3].direction = vec3(nan);
  beams[4].end = beams[4].begin - 1.0f;
  const wfpg::buffer<path_beam, Exec> device_beams(exec, beams);
  wfpg::beam_map<Exec> map;
  map.build(exec, device_beams.view(), {0.1f, 6});
  CHECK(map.view().pieces() == 1);
}

#if defined(WFPG_TEST_SEVERAL_POLICIES)
namespace {

bool operator==(const found_merges& a, const found_merges& b) {
  return a.count == b.count && a.indices == b.indices && a.kernels == b.kernels && a.camera == b.camera;
}

}  // namespace

TEST_CASE("beam maps find the same in one order on each policy", "[beam_map]") {
  const std::vector<path_beam> beams = random_beams(2000, false, 6), cameras = random_beams(200, false, 7);
  check_equal_on_backends([&] {
    const one_policy exec;
    const wfpg::buffer<path_beam, one_policy> device_beams(exec, beams), device_cameras(exec, cameras);
    wfpg::beam_map<one_policy> map;
    map.build(exec, device_beams.view(), {0.05f, 9000});
    return evaluate(exec, cameras.size(), query_beams{map.view(), device_cameras.view()});
  });
}
#endif

TEST_CASE("options of beam maps have ranges", "[beam_map]") {
  const host_policy exec;
  const wfpg::buffer<path_beam, host_policy> beams(exec, random_beams(3, false, 8));
  wfpg::beam_map<host_policy> map;
  for (const float radius : {0.0f, -1.0f, std::numeric_limits<float>::quiet_NaN(), 1e20f})
    CHECK_THROWS_AS(map.build(exec, beams.view(), {radius, 10}), std::invalid_argument);
  CHECK_THROWS_AS(map.build(exec, beams.view(), {0.1f, 2}), std::invalid_argument);
  CHECK_THROWS_AS(map.build(exec, beams.view(), {0.1f, std::size_t(1) << 28}), std::invalid_argument);
  CHECK(map.view().pieces() == 0);
}

WFPG_TEST_CASE("a beam map without memory has no beams", "[beam_map]") {
  failing_resource resource;
  const Exec exec = Exec().with_resource(&resource);
  const wfpg::buffer<path_beam, Exec> beams(exec, random_beams(100, false, 9));
  std::size_t failures = 0;
  for (std::size_t k = 1;; ++k) {
    resource.fail_at(k);
    wfpg::beam_map<Exec> map;
    const bool out = runs_out(resource, [&] { map.build(exec, beams.view(), {0.1f, 1000}); });
    CHECK((map.view().pieces() == 0) == out);
    if (!out) break;
    ++failures;
  }
  CHECK(failures >= 8);
}
