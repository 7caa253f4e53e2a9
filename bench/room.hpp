// The scene of the benchmarks: the unit box from inside with a ball in its centre, and a camera that looks at
// both. Hits are known without a ray caster.
#pragma once

#include "timing.hpp"

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/octree/voxelizer.hpp>

#include <cmath>
#include <vector>

namespace bench {

using wfpg::vec2;
using wfpg::vec3;

inline constexpr float ball_radius = 0.25f;
inline constexpr std::uint32_t width = sizes::width, height = sizes::height, pixels = width * height;

/// The walls and the ball as triangles.
template <class Exec>
class room_mesh {
 public:
  room_mesh(const Exec& exec, int triangle_count) {
    std::vector<vec3> positions{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    std::vector<wfpg::uvec3> triangles{{0, 1, 2}, {0, 2, 3}, {4, 6, 5}, {4, 7, 6}, {0, 4, 5}, {0, 5, 1},
                                       {3, 2, 6}, {3, 6, 7}, {0, 3, 7}, {0, 7, 4}, {1, 5, 6}, {1, 6, 2}};
    const int rings = static_cast<int>(std::sqrt(triangle_count / 4.0)), segments = 2 * rings;
    const auto first = static_cast<std::uint32_t>(positions.size());
    for (int i = 0; i <= rings; ++i)
      for (int j = 0; j < segments; ++j) {
        const float theta = wfpg::pi * static_cast<float>(i) / static_cast<float>(rings);
        const float phi = 2.0f * wfpg::pi * static_cast<float>(j) / static_cast<float>(segments);
        positions.push_back(vec3(0.5f) + ball_radius * vec3(std::sin(theta) * std::cos(phi), std::cos(theta),
                                                            std::sin(theta) * std::sin(phi)));
      }
    const auto vertex = [&](int i, int j) {
      return first + static_cast<std::uint32_t>(i * segments + j % segments);
    };
    for (int i = 0; i < rings; ++i)
      for (int j = 0; j < segments; ++j) {
        triangles.push_back({vertex(i, j), vertex(i, j + 1), vertex(i + 1, j)});
        triangles.push_back({vertex(i, j + 1), vertex(i + 1, j + 1), vertex(i + 1, j)});
      }
    positions_ = {exec, positions};
    triangles_ = {exec, triangles};
  }

  wfpg::triangle_mesh_view view() const { return {positions_.view(), triangles_.view()}; }
  std::size_t size() const { return triangles_.size(); }

 private:
  wfpg::buffer<vec3, Exec> positions_;
  wfpg::buffer<wfpg::uvec3, Exec> triangles_;
};

/// The first hit inside the room, on ball or walls.
struct room_caster {
  WFPG_HD wfpg::ray_hit operator()(const wfpg::ray& r) const {
    float nearest = 3.0e38f;
    for (int axis = 0; axis < 3; ++axis) {
      if (r.direction[axis] == 0.0f) continue;
      const float face = r.direction[axis] > 0.0f ? 1.0f : 0.0f;
      nearest = wfpg::min(nearest, wfpg::max((face - r.origin[axis]) / r.direction[axis], 0.0f));
    }
    const vec3 to_centre = vec3(0.5f) - r.origin;
    const float along = glm::dot(to_centre, r.direction);
    const float square = ball_radius * ball_radius - glm::dot(to_centre, to_centre) + along * along;
    if (square > 0.0f) {
      const float t = along - sqrtf(square);
      if (t > 1.0e-4f) nearest = wfpg::min(nearest, t);
    }
    return {nearest, 0.0f};
  }
};

/// A point on the room's surfaces, and its normal.
struct room_point {
  vec3 position, normal, outgoing;
};

/// The hit of the camera's ray through a pixel.
struct camera_hits {
  WFPG_HD room_point operator()(std::uint32_t pixel) const {
    const vec2 jitter = wfpg::unit_vec2(wfpg::hash(7, pixel));
    const float x = (static_cast<float>(pixel % width) + jitter.x) / static_cast<float>(width) - 0.5f;
    const float y = (static_cast<float>(pixel / width) + jitter.y) / static_cast<float>(height) - 0.5f;
    wfpg::ray r;
    r.origin = vec3(0.5f, 0.5f, 0.02f);
    r.direction = glm::normalize(vec3(1.6f * x, -0.9f * y, 0.5f));
    return hit(r);
  }

  WFPG_HD static room_point hit(const wfpg::ray& r) {
    const vec3 p = r.origin + room_caster()(r).distance * r.direction;
    const vec3 from_centre = p - vec3(0.5f);
    vec3 normal = from_centre / ball_radius;
    if (glm::dot(from_centre, from_centre) > 1.01f * ball_radius * ball_radius) {
      const vec3 size = glm::abs(from_centre);
      const int axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
      normal = vec3(0.0f);
      normal[axis] = from_centre[axis] > 0.0f ? -1.0f : 1.0f;
    }
    return {p, normal, -r.direction};
  }
};

/// The point of a path through a pixel after `bounces` diffuse bounces.
struct bounced_hits {
  int bounces = 1;
  WFPG_HD room_point operator()(std::uint32_t pixel) const {
    room_point at = camera_hits()(pixel);
    for (int i = 0; i < bounces; ++i) {
      const vec2 u = wfpg::unit_vec2(wfpg::hash(wfpg::hash(11, static_cast<std::uint64_t>(i)), pixel));
      const float r = sqrtf(u.x), phi = 2.0f * wfpg::pi * u.y;
      wfpg::ray next;
      next.direction = wfpg::frame(at.normal).to_world({r * cosf(phi), r * sinf(phi), sqrtf(1.0f - u.x)});
      next.origin = at.position + 1.0e-4f * at.normal;
      at = camera_hits::hit(next);
    }
    return at;
  }
};

/// Stores hits, so that stages do not spend time on finding them.
struct store_points {
  bounced_hits hits;
  wfpg::array_view<room_point> points;
  WFPG_HD void operator()(std::size_t i) const { points[i] = hits(static_cast<std::uint32_t>(i)); }
};

/// The points of a wave's paths after `bounces` bounces.
template <class Exec>
wfpg::buffer<room_point, Exec> points_after(const Exec& exec, int bounces) {
  wfpg::buffer<room_point, Exec> points(exec, pixels);
  exec.for_each(pixels, store_points{{bounces}, points.view()});
  return points;
}

}  // namespace bench
