// Geometry and kernels of merges: how much a photon, a point or a beam, counts where a camera path is, a
// point or a beam. Pure functions, for hosts with stores and queries of their own.
//
//   merge                       photon   camera path   function
//   surface points (P-P2D)      point    point         point_merge<2>()
//   volume points (P-P3D)       point    point         point_merge<3>()
//   beams and points (P-B2D)    point    beam          beam_point_merge()
//   beams (B-B1D)               beam     beam          beam_beam_merge()
//
// The estimate is a sum over photons, divided by the number of light paths. A term is `kernel` / `sine`,
// times what the photon carries, times the phase function or BSDF, times the transmittance to both ends.
//
// A long photon beam may be cut into pieces, so that boxes around them are tight. Each piece is an interval
// of the whole beam, and answers for that interval alone. Of all pieces of a beam exactly one merges.
//
// Source: Moonen & Jalba 2023, "Efficient Hardware Acceleration of Robust Volumetric Light Transport
// Simulation", section 3.4. The estimators are those of Krivanek et al. 2014. The closest points of two beams
// are found without dividing by their cosine.
//
// Cost: 10 to 30 operations a merge. Memory: none.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>

#include <cmath>
#include <cstdint>

namespace wfpg {

/// Shape of a kernel over the distance of a merge.
enum class merge_kernel : std::uint8_t {
  constant,      ///< one value within the radius
  epanechnikov,  ///< falls as the square of the distance, to 0 at the radius: less noise at the same blur
};

/// Value of a kernel at a distance, whose square is given. `dimension`: 1 for distances between lines, 2 in a
/// plane, 3 in space. Its integral over the ball of that dimension is 1. Unit: scene units to the power of
/// minus `dimension`. 0 beyond the radius, and where the distance is not finite. Precondition: the radius is
/// positive.
template <int dimension>
WFPG_HD float merge_kernel_value(merge_kernel shape, float square, float radius) {
  static_assert(dimension >= 1 && dimension <= 3);
  const float limit = radius * radius;
  if (!is_finite(square) || square > limit) return 0.0f;
  const float ball = dimension == 1   ? 2.0f * radius
                     : dimension == 2 ? 3.14159265f * limit
                                      : 4.18879020f * limit * radius;
  if (shape == merge_kernel::constant) return 1.0f / ball;
  // The mean of 1 - q² over the ball is 2 / (dimension + 2).
  return 0.5f * static_cast<float>(dimension + 2) * (1.0f - square / limit) / ball;
}

/// Value of the kernel, and where on both beams a merge is.
struct merge_geometry {
  float kernel = 0.0f;    ///< 0: no merge
  float t_camera = 0.0f;  ///< where it is on the camera's beam, scene units from its origin
  float t_light = 0.0f;   ///< where it is on the photon's beam
  float sine = 1.0f;      ///< between the two beams, (0, 1]; 1 where one of them is a point
};

/// A photon at a distance from a camera path's point. `dimension`: 2 on surfaces, 3 in media.
template <int dimension>
WFPG_HD merge_geometry point_merge(merge_kernel shape, vec3 camera, vec3 photon, float radius) {
  const vec3 away = photon - camera;
  merge_geometry found;
  found.kernel = merge_kernel_value<dimension>(shape, glm::dot(away, away), radius);
  return found;
}

/// A straight part of a path in one medium, or an interval of one.
struct path_beam {
  vec3 origin{0.0f};     ///< of the whole beam, for all of its pieces
  vec3 direction{0.0f};  ///< unit length
  float begin = 0.0f;    ///< of the interval, scene units from the origin
  float end = 0.0f;      ///< of the interval; that point does not belong to it

  /// Whether a distance from the origin lies in the interval.
  WFPG_HD bool holds(float t) const { return t >= begin && t < end; }
  /// Returns the interval as a ray, for queries of trees.
  WFPG_HD ray as_ray() const {
    ray along;
    along.origin = origin;
    along.direction = direction;
    along.t_min = begin;
    along.t_max = end;
    return along;
  }
};

/// A photon at a distance from a camera beam. The distance is that to the beam's line, and the photon merges
/// at the nearest point on it, if that belongs to the beam.
WFPG_HD inline merge_geometry beam_point_merge(merge_kernel shape, const path_beam& camera, vec3 photon,
                                               float radius) {
  const vec3 way = photon - camera.origin;
  merge_geometry found;
  found.t_camera = glm::dot(way, camera.direction);
  if (!camera.holds(found.t_camera)) return found;
  const vec3 away = way - found.t_camera * camera.direction;
  found.kernel = merge_kernel_value<2>(shape, glm::dot(away, away), radius);
  return found;
}

/// A photon beam at a distance from a camera beam. The distance is that between their lines. They merge at
/// the nearest points, if both belong to the beams. Beams whose sine is below 1e-4 never merge: they would
/// count without bound, and hardly any are so.
WFPG_HD inline merge_geometry beam_beam_merge(merge_kernel shape, const path_beam& camera,
                                              const path_beam& light, float radius) {
  constexpr float least_sine = 1e-4f;
  merge_geometry found;
  const vec3 across = glm::cross(camera.direction, light.direction);
  const float square = glm::dot(across, across);
  if (!(square > least_sine * least_sine)) return found;
  const vec3 way = light.origin - camera.origin;
  const float between = glm::dot(way, across);
  // Most beams are too far from each other, which is known before the nearest points are.
  if (!(between * between <= radius * radius * square)) return found;
  found.t_camera = glm::dot(glm::cross(way, light.direction), across) / square;
  found.t_light = glm::dot(glm::cross(way, camera.direction), across) / square;
  if (!camera.holds(found.t_camera) || !light.holds(found.t_light)) return found;
  found.sine = std::sqrt(square);
  found.kernel = merge_kernel_value<1>(shape, between * between / square, radius);
  return found;
}

/// Smallest radius of merges, scene units. The largest is largest_coordinate. Squares of both are normal
/// floats.
inline constexpr float least_merge_radius = 1.0e-15f;

/// Radius of merges, which shrinks from iteration to iteration so that their blur goes to 0.
struct radius_schedule {
  float initial = 0.0f;  ///< of the first iteration, scene units, positive
  /// In (0, 1]: the smaller, the faster the radius shrinks. 1: not at all, and the blur stays.
  float alpha = 0.75f;
  int dimension = 2;  ///< of the kernel, 1 to 3

  /// Returns the radius of an iteration, from 1. Source: Knaus & Zwicker 2011, "Progressive Photon Mapping: A
  /// Probabilistic Approach", whose radius falls as the power (alpha - 1) / dimension of the iteration.
  WFPG_HD float operator()(std::uint32_t iteration) const {
    return initial * std::pow(static_cast<float>(iteration), (alpha - 1.0f) / static_cast<float>(dimension));
  }
};

}  // namespace wfpg
