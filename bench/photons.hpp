// Photons on the faces of the unit cube, or nine of ten in a corner of it. Points that look for them are
// spread likewise, row by row. Each finds about ten.
#pragma once

#include "timing.hpp"

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/light/photon_map.hpp>

#include <cmath>
#include <numeric>
#include <vector>

namespace bench {

using wfpg::hash;
using wfpg::unit_vec2;
using wfpg::vec2;
using wfpg::vec3;

/// A part of the cube's size: that of the corner with most photons.
inline constexpr float corner = 0.01f;

/// The face of point i of `count`: its axis is face / 2, and odd faces are at 1.
WFPG_HD inline int face_of(std::size_t i, std::uint32_t count) {
  return static_cast<int>(6 * i / count);
}
/// The normal of that face, into the cube.
WFPG_HD inline vec3 normal_of(int face) {
  vec3 normal(0.0f);
  normal[face / 2] = face % 2 ? -1.0f : 1.0f;
  return normal;
}

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
    const int face = face_of(i, count);
    vec3 p;
    p[face / 2] = face % 2 ? 1.0f : 0.0f;
    p[(face / 2 + 1) % 3] = at.x;
    p[(face / 2 + 2) % 3] = at.y;
    points[i] = clustered && i % 10 != 0 ? corner * p : p;
  }
};

/// The radius in which a point finds ten photons.
inline float radius_for_ten(std::uint32_t photons, bool clustered) {
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

template <class Exec>
std::uint64_t sum_of(const Exec& exec, const wfpg::buffer<std::uint32_t, Exec>& found) {
  const std::vector<std::uint32_t> counts = found.to_host(exec);
  return std::accumulate(counts.begin(), counts.end(), std::uint64_t(0));
}

}  // namespace bench
