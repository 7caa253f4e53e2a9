// Building a tree over boxes, and finding photons with it. Photons lie on the faces of a cube, or nine of ten
// in a corner of it. Points that look for them are spread likewise, row by row. Each finds about ten.
#include "floors.hpp"

#include <wfpg/light/box_tree.hpp>
#include <wfpg/light/photon_map.hpp>

#include <cmath>

namespace bench {
namespace {

using wfpg::hash;
using wfpg::unit_vec2;
using wfpg::vec2;
using wfpg::vec3;

/// A part of the cube's size: that of the corner with most photons.
constexpr float corner = 0.01f;

/// Points on the cube's faces, at random or row by row.
struct place_points {
  vec3* points;
  std::uint32_t count;
  std::uint64_t stream;
  bool clustered, in_rows;

  WFPG_HD void operator()(std::size_t i) const {
    vec2 at = unit_vec2(hash(stream, i));
    if (in_rows) {
      const auto side = static_cast<std::uint32_t>(std::sqrt(static_cast<float>(count)));
      const auto n = static_cast<std::uint32_t>(i);
      at = (at + vec2(static_cast<float>(n % side), static_cast<float>(n / side % side))) /
           static_cast<float>(side);
    }
    const auto face = static_cast<int>(6 * i / count);
    vec3 p;
    p[face / 2] = face % 2 ? 1.0f : 0.0f;
    p[(face / 2 + 1) % 3] = at.x;
    p[(face / 2 + 2) % 3] = at.y;
    points[i] = clustered && i % 10 != 0 ? corner * p : p;
  }
};

/// The radius in which a point finds ten photons.
float radius_for_ten(std::uint32_t photons, bool clustered) {
  const float area = clustered ? 6.0f * corner * corner / 0.9f : 6.0f;
  return std::sqrt(10.0f * area / (static_cast<float>(photons) * wfpg::pi));
}

template <class Exec>
wfpg::buffer<vec3, Exec> points_on(const Exec& exec, std::uint32_t n, std::uint64_t stream, bool clustered,
                                   bool in_rows) {
  wfpg::buffer<vec3, Exec> points(exec, n);
  exec.for_each(n, place_points{points.data(), n, stream, clustered, in_rows});
  return points;
}

struct sphere_boxes {
  wfpg::array_view<const vec3> centres;
  float radius;
  WFPG_HD wfpg::bounds3 operator()(std::size_t i) const { return {centres[i] - radius, centres[i] + radius}; }
};

struct random_codes {
  std::uint64_t* codes;
  WFPG_HD void operator()(std::size_t i) const { codes[i] = hash(5, i) >> 1; }
};

/// Builds a tree with one box a leaf. The floor sorts as many codes of 63 bits.
template <class Exec>
void building_boxes(benchmark::State& state) {
  const Exec exec;
  const auto n = static_cast<std::uint32_t>(1000 * state.range(0));
  const bool clustered = state.range(1) != 0;
  const auto centres = points_on(exec, n, 1, clustered, false);
  const sphere_boxes boxes{centres.view(), radius_for_ten(n, clustered)};
  const wfpg::buffer<std::uint64_t, Exec> codes(exec, n);
  exec.for_each(n, random_codes{codes.data()});
  const sort_of sort(exec, codes, 63, n);
  set_cpu_floor(state, "a sort of as many 63-bit keys");
  wfpg::box_tree<Exec> tree;
  compare(
      state, exec, [&] { tree.build(exec, n, boxes); }, sort);
  state.counters["bytes_a_box"] = static_cast<double>(tree.bytes()) / n;
}

struct count_photons {
  wfpg::photon_map_view map;
  wfpg::array_view<const vec3> points;
  std::uint32_t* found;
  WFPG_HD void operator()(std::size_t i) const {
    std::uint32_t n = 0;
    map.for_each_point(points[i], [&](std::uint32_t) { ++n; });
    found[i] = n;
  }
};

/// Finds the photons around as many points. The floor reads the points, and each photon that is found.
template <class Exec>
void finding_photons(benchmark::State& state) {
  const Exec exec;
  const auto n = static_cast<std::uint32_t>(1000 * state.range(0));
  const bool clustered = state.range(1) != 0;
  const auto photons = points_on(exec, n, 1, clustered, false),
             points = points_on(exec, n, 2, clustered, true);
  wfpg::photon_map<Exec> map;
  map.build(exec, photons.view(), radius_for_ten(n, clustered));
  const wfpg::buffer<std::uint32_t, Exec> found(exec, n);
  const auto find = [&] { exec.for_each(n, count_photons{map.view(), points.view(), found.data()}); };
  find();
  std::uint64_t pairs = 0;
  for (const std::uint32_t k : found.to_host(exec)) pairs += k;
  const copy_of floor(exec, points.bytes() + pairs * (sizeof(vec3) + sizeof(std::uint32_t)));
  compare(state, exec, find, floor);
  state.counters["pairs_a_point"] = static_cast<double>(pairs) / n;
  state.counters["bytes_a_photon"] = static_cast<double>(map.bytes()) / n;
}

WFPG_BENCH_STAGE(building_boxes, {"thousands", "clustered"}, sizes::photons);
WFPG_BENCH_STAGE(finding_photons, {"thousands", "clustered"}, sizes::photons);

}  // namespace
}  // namespace bench
