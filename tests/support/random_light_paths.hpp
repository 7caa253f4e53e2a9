// Light paths without a scene: random vertices and beams, stored by wfpg::bidirectional, and sums over all of
// them for what its queries find. Types in kernels have names, for CUDA compilers.
#pragma once

#include "support/policies.hpp"

#include <wfpg/light/bidirectional.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace bidirectional_test {

using wfpg::array_view;
using wfpg::bidirectional_options;
using wfpg::bidirectional_statistics;
using wfpg::path_beam;
using wfpg::photon_merge;
using wfpg::vec3;
using wfpg_test::random_numbers;

struct vertex {
  vec3 at;
  float flux;
  bool inside;
  WFPG_HD vec3 position() const { return at; }
  WFPG_HD bool in_medium() const { return inside; }
};
struct photon {
  float flux;
  photon() = default;
  WFPG_HD explicit photon(const vertex& v) : flux(v.flux) {}
};
struct beam {
  path_beam beam;
  float flux;
};

/// Light paths without a scene. All that they do follows from hashes.
struct random_paths {
  std::uint64_t seed;

  WFPG_HD std::uint64_t draw(std::size_t path, std::uint32_t depth, std::uint32_t use) const {
    return wfpg::hash(wfpg::hash(wfpg::hash(seed, path), depth), use);
  }
  /// In [0, 1).
  WFPG_HD float fraction(std::size_t path, std::uint32_t depth, std::uint32_t use) const {
    return static_cast<float>(draw(path, depth, use) >> 40) * 0x1p-24f;
  }
  WFPG_HD vec3 point(std::size_t path, std::uint32_t depth, std::uint32_t use) const {
    return {fraction(path, depth, use), fraction(path, depth, use + 1), fraction(path, depth, use + 2)};
  }
  WFPG_HD bool keeps(std::size_t path, std::uint32_t depth) const { return draw(path, depth, 0) % 3 != 0; }
  WFPG_HD vertex at(std::size_t path, std::uint32_t depth) const {
    return {point(path, depth, 1), 0.5f + fraction(path, depth, 4), draw(path, depth, 5) % 2 == 0};
  }
  /// Of a segment, 0 to 10.
  WFPG_HD std::uint32_t beams(std::size_t path, std::uint32_t depth) const {
    return static_cast<std::uint32_t>(draw(path, depth, 6) % 11);
  }
  WFPG_HD beam beam_of(std::size_t path, std::uint32_t depth, std::uint32_t k) const {
    const std::uint32_t use = 7 + 8 * k;
    const float begin = 0.1f * fraction(path, depth, use + 6);
    return {{point(path, depth, use), glm::normalize(point(path, depth, use + 3) - 0.5f), begin,
             begin + 0.1f + 0.3f * fraction(path, depth, use + 7)},
            0.5f + fraction(path, depth, use + 5)};
  }
};

using recorder = wfpg::light_recorder_view<vertex, beam>;
using gatherer = wfpg::light_gather_view<vertex, photon, beam>;

struct trace {
  random_paths paths;
  std::uint32_t depth;
  recorder record;
  array_view<std::uint32_t> keeps;
  WFPG_HD void operator()(std::size_t path) const {
    keeps[path] = paths.keeps(path, depth) ? 1 : 0;
    for (std::uint32_t k = 0; record.leaves_beams(path) && k < paths.beams(path, depth); ++k)
      record.add_beam(path, paths.beam_of(path, depth, k));
  }
};

struct store {
  random_paths paths;
  std::uint32_t depth;
  recorder record;
  WFPG_HD void operator()(std::size_t path) const {
    if (record.has_place(path)) record.write(path, paths.at(path, depth));
  }
};

/// What is found at a point and along a camera beam: fluxes times scales, and where.
struct sums {
  float on_surface = 0.0f, in_medium = 0.0f, points_along = 0.0f, beams_along = 0.0f;
  float chain = 0.0f;  ///< fluxes of one light path's vertices
};

/// Depends on all that a merge tells. `stored`: the flux that it has in its store.
WFPG_HD inline float term(float flux, const photon_merge& at, float stored) {
  return stored * flux * at.scale * (1.0f + at.t_camera + 2.0f * at.t_light) * at.sine;
}

struct look {
  gatherer gather;
  array_view<const vec3> points;
  array_view<const path_beam> cameras;
  array_view<sums> found;
  WFPG_HD void operator()(std::size_t i) const {
    sums s;
    const auto add_point = [&](float& sum, const photon& light, const photon_merge& at) {
      sum += term(light.flux, at, gather.vertices()[at.index].flux);
    };
    gather.merge_on_surface(
        points[i], [&](const photon& light, const photon_merge& at) { add_point(s.on_surface, light, at); });
    gather.merge_in_medium(
        points[i], [&](const photon& light, const photon_merge& at) { add_point(s.in_medium, light, at); });
    gather.merge_points_along(cameras[i], [&](const photon& light, const photon_merge& at) {
      add_point(s.points_along, light, at);
    });
    gather.merge_beams_along(cameras[i], [&](const beam& light, const photon_merge& at) {
      s.beams_along += term(light.flux, at, gather.beams()[at.index].flux);
    });
    const auto& vertices = gather.vertices();
    if (vertices.paths() > 0)
      for (std::uint32_t k = vertices.last(i); k != vertices.none; k = vertices.previous(k))
        s.chain += vertices[k].flux;
    found[i] = s;
  }
};

struct ask_for_places {
  recorder record;
  array_view<std::uint32_t> found;
  WFPG_HD void operator()(std::size_t path) const { found[path] = record.has_place(path) ? 1 : 0; }
};

inline constexpr std::size_t light_paths = 600, beam_paths = 40, beam_point_paths = 450, queries = 200;
inline constexpr std::uint32_t depths = 4;

template <class Exec>
using light_of = wfpg::bidirectional<Exec, vertex, photon, beam>;

/// All techniques, radii large enough for some merges a query.
inline bidirectional_options all_techniques() {
  bidirectional_options options;
  options.paths = light_paths;
  options.max_vertices = depths;
  options.max_beams = 64;
  options.volume_points = options.beam_points = options.beams = true;
  options.surface_radius = 0.15f;
  options.volume_radius = 0.1f;
  options.dense_photons = 0xffffffffu;  // all are kept, so that sums are exact
  options.beam_paths = beam_paths;
  options.beam_point_paths = beam_point_paths;
  return options;
}

template <class Exec>
void follow(const Exec& exec, light_of<Exec>& light, const random_paths& paths) {
  const wfpg::buffer<std::uint32_t, Exec> keeps(exec, light.options().paths);
  for (std::uint32_t depth = 0; depth < depths; ++depth) {
    exec.for_each(keeps.size(), trace{paths, depth, light.light_recorder(), keeps.view()});
    light.reserve(keeps.view());
    exec.for_each(keeps.size(), store{paths, depth, light.light_recorder()});
  }
}

/// Where camera paths look.
struct asked {
  std::vector<vec3> points;
  std::vector<path_beam> cameras;

  asked() {
    random_numbers random(17);
    for (std::size_t i = 0; i < queries; ++i) {
      points.push_back(random.point(0.0f, 1.0f));
      cameras.push_back({random.point(0.0f, 1.0f), random.direction(), 0.05f, 0.6f});
    }
  }
};

template <class Exec>
std::vector<sums> found_by(const Exec& exec, light_of<Exec>& light) {
  const asked where;
  const wfpg::buffer<vec3, Exec> points(exec, where.points);
  const wfpg::buffer<path_beam, Exec> cameras(exec, where.cameras);
  const wfpg::buffer<sums, Exec> found(exec, queries);
  exec.for_each(queries, look{light.gather(), points.view(), cameras.view(), found.view()});
  return found.to_host(exec);
}

/// What a test of each vertex and beam finds.
inline std::vector<sums> expected(const random_paths& paths, const bidirectional_statistics& s,
                                  std::uint32_t segment_beams) {
  const asked where;
  std::vector<sums> all(queries);
  for (std::size_t i = 0; i < queries; ++i) {
    const auto count = static_cast<float>(light_paths);
    const auto add = [&](float& sum, float flux, const wfpg::merge_geometry& at, float number) {
      if (at.kernel > 0.0f)
        sum += term(flux, {at.kernel / (number * at.sine), at.t_camera, at.t_light, at.sine, 0}, flux);
    };
    for (std::size_t path = 0; path < light_paths; ++path)
      for (std::uint32_t depth = 0; depth < depths; ++depth) {
        using wfpg::merge_kernel;
        if (paths.keeps(path, depth)) {
          const vertex v = paths.at(path, depth);
          const auto constant = merge_kernel::constant, smooth = merge_kernel::epanechnikov;
          const vec3 p = where.points[i];
          if (v.inside) {
            add(all[i].in_medium, v.flux, wfpg::point_merge<3>(constant, p, v.at, s.radii.volume), count);
            if (path < beam_point_paths)
              add(all[i].points_along, v.flux,
                  wfpg::beam_point_merge(smooth, where.cameras[i], v.at, s.radii.beam_points),
                  static_cast<float>(beam_point_paths));
          } else {
            add(all[i].on_surface, v.flux, wfpg::point_merge<2>(constant, p, v.at, s.radii.surface), count);
          }
          if (path == i) all[i].chain += v.flux;
        }
        for (std::uint32_t k = 0; path < beam_paths && k < paths.beams(path, depth) && k < segment_beams;
             ++k) {
          const beam b = paths.beam_of(path, depth, k);
          add(all[i].beams_along, b.flux,
              wfpg::beam_beam_merge(merge_kernel::epanechnikov, where.cameras[i], b.beam, s.radii.beams),
              static_cast<float>(beam_paths));
        }
      }
  }
  return all;
}

/// The sum of one member over queries, and whether each agrees. Distances at the radius round either way: a
/// query may differ by a photon.
inline void check_member(const std::vector<sums>& found, const std::vector<sums>& exact,
                         float sums::*member) {
  double sum = 0.0, whole = 0.0;
  std::size_t differ = 0, merged = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    sum += double(found[i].*member);
    whole += double(exact[i].*member);
    differ += std::abs(found[i].*member - exact[i].*member) > 1e-4f * std::abs(exact[i].*member) ? 1 : 0;
    merged += exact[i].*member != 0.0f ? 1 : 0;
  }
  CHECK(merged > found.size() / 4);
  CHECK(differ <= 1);
  CHECK(sum == Approx(whole).epsilon(1e-3));
}

inline void check(const std::vector<sums>& found, const std::vector<sums>& exact) {
  for (const auto member :
       {&sums::on_surface, &sums::in_medium, &sums::points_along, &sums::beams_along, &sums::chain})
    check_member(found, exact, member);
}

inline bool are_empty(const std::vector<sums>& found) {
  for (const sums& s : found)
    if (s.on_surface != 0.0f || s.in_medium != 0.0f || s.points_along != 0.0f || s.beams_along != 0.0f)
      return false;
  return true;
}

}  // namespace bidirectional_test
