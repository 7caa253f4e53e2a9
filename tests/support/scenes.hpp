// A small host renderer: the unit box from inside, whose hits are known exactly. It has ray casters of both
// forms, a BSDF of several kinds, and surfaces and random numbers from arrays and hashes. Also a counting
// memory resource.
#pragma once

#include "support/deposits.hpp"
#include "support/policies.hpp"

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/host/bsdf.hpp>
#include <wfpg/octree/voxelizer.hpp>

#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <vector>

namespace wfpg_test {

using wfpg::vec2;
using wfpg::vec3;

enum class bsdf_kind : std::uint32_t {
  lambert,  ///< white, on the outgoing side
  glossy,   ///< a cosine-power lobe around the mirror direction, cut at the horizon
  mirror,   ///< delta, its lobe chosen with probability 0.75
  glass,    ///< uniform over the whole sphere; transmits
  black,    ///< sampling always fails
};

/// A BSDF of one of these kinds, around a shading normal.
struct test_bsdf {
  bsdf_kind kind = bsdf_kind::lambert;
  vec3 normal{0.0f, 0.0f, 1.0f};

  WFPG_HD bool is_delta() const { return kind == bsdf_kind::mirror; }
  WFPG_HD bool transmits() const { return kind == bsdf_kind::glass; }

  WFPG_HD float eval(vec3 outgoing, vec3 incident) const { return 0.8f * pdf(outgoing, incident); }

  WFPG_HD float pdf(vec3 outgoing, vec3 incident) const {
    const vec3 up = facing(outgoing);
    const float cosine = glm::dot(up, incident);
    if (kind == bsdf_kind::glass) return 0.25f / wfpg::pi;
    if (cosine <= 0.0f || is_delta() || kind == bsdf_kind::black) return 0.0f;
    if (kind == bsdf_kind::lambert) return cosine / wfpg::pi;
    const float along = glm::dot(mirrored(outgoing), incident);
    return along > 0.0f ? std::pow(along, exponent) * (exponent + 1.0f) / (2.0f * wfpg::pi) : 0.0f;
  }

  WFPG_HD wfpg::bsdf_sample sample(vec3 outgoing, vec2 u) const {
    const float turn = 2.0f * wfpg::pi * u.y;
    if (kind == bsdf_kind::black) return {};
    if (is_delta()) return {mirrored(outgoing), 0.75f};
    const bool lambert = kind == bsdf_kind::lambert;
    float z = lambert ? std::sqrt(1.0f - u.x) : std::pow(1.0f - u.x, 1.0f / (exponent + 1.0f));
    if (kind == bsdf_kind::glass) z = 1.0f - 2.0f * u.x;
    const float r = std::sqrt(std::fmax(1.0f - z * z, 0.0f));
    const wfpg::frame around(lambert ? facing(outgoing) : mirrored(outgoing));
    const vec3 d = glm::normalize(around.to_world({r * std::cos(turn), r * std::sin(turn), z}));
    const float density = pdf(outgoing, d);
    return density > 0.0f ? wfpg::bsdf_sample{d, density} : wfpg::bsdf_sample{};
  }

 private:
  static constexpr float exponent = 20.0f;

  WFPG_HD vec3 facing(vec3 outgoing) const { return glm::dot(normal, outgoing) >= 0.0f ? normal : -normal; }
  WFPG_HD vec3 mirrored(vec3 outgoing) const { return 2.0f * glm::dot(normal, outgoing) * normal - outgoing; }
};

/// A normal and a viewer above it, along no axis.
inline const vec3 up = glm::normalize(vec3(-0.2f, 0.9f, 0.4f));
inline const vec3 toward_eye = glm::normalize(vec3(0.5f, 0.6f, 0.3f));

using test_surface = wfpg::surface<test_bsdf>;

WFPG_HD inline test_surface make_surface(vec3 position, vec3 normal, vec3 outgoing,
                                         bsdf_kind kind = bsdf_kind::lambert) {
  return {position, normal, normal, outgoing, {kind, normal}, true};
}

/// Surfaces in an array.
struct stored_surfaces {
  wfpg::array_view<const test_surface> surfaces;
  WFPG_HD test_surface operator()(std::uint32_t ray) const { return surfaces[ray]; }
};

struct hashed_numbers {
  std::uint64_t seed = 1;
  WFPG_HD vec2 operator()(std::uint32_t ray, std::uint32_t dimension) const {
    return wfpg::unit_vec2(wfpg::hash(wfpg::hash(seed, ray), dimension));
  }
};

/// Faces of the unit box, numbered as dominant_axis numbers their inward normals: x = 0 is 0, x = 1 is 1, ...
WFPG_HD inline vec3 face_normal(std::uint32_t face) {
  vec3 n(0.0f);
  n[int(face / 2)] = face % 2 ? -1.0f : 1.0f;
  return n;
}
WFPG_HD inline vec3 face_point(std::uint32_t face, float u, float v) {
  vec3 p;
  const int axis = int(face / 2);
  p[axis] = face % 2 ? 1.0f : 0.0f;
  p[(axis + 1) % 3] = u;
  p[(axis + 2) % 3] = v;
  return p;
}

/// The unit box, 12 triangles.
inline std::vector<vec3> box_positions() {
  return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
}
inline std::vector<wfpg::uvec3> box_triangles() {
  return {{0, 1, 2}, {0, 2, 3}, {4, 6, 5}, {4, 7, 6}, {0, 4, 5}, {0, 5, 1},
          {3, 2, 6}, {3, 6, 7}, {0, 3, 7}, {0, 7, 4}, {1, 5, 6}, {1, 6, 2}};
}

/// The box in a policy's memory.
template <class Exec>
struct box_mesh {
  wfpg::buffer<vec3, Exec> positions;
  wfpg::buffer<wfpg::uvec3, Exec> triangles;

  explicit box_mesh(const Exec& exec) : positions(exec, box_positions()), triangles(exec, box_triangles()) {}
  wfpg::triangle_mesh_view view() const {
    return {const_view<vec3>(positions), const_view<wfpg::uvec3>(triangles)};
  }
};

/// Inline caster: returns the face that a ray from inside the unit box hits. With `open_top`, rays leave
/// through y = 1 and see an environment of radiance 5.
struct box_caster {
  bool open_top = false;     ///< to a bright sky
  bool open_bottom = false;  ///< to the dark

  WFPG_HD wfpg::ray_hit operator()(const wfpg::ray& r) const {
    float nearest = r.t_max;
    bool hits = false, leaves = false, falls = false;
    for (int axis = 0; axis < 3; ++axis) {
      if (r.direction[axis] == 0.0f) continue;
      const float face = r.direction[axis] > 0.0f ? 1.0f : 0.0f;
      const float t = std::fmax((face - r.origin[axis]) / r.direction[axis], 0.0f);
      if (t >= nearest) continue;
      nearest = t;
      hits = true;
      leaves = open_top && axis == 1 && face == 1.0f;
      falls = open_bottom && axis == 1 && face == 0.0f;
    }
    if (leaves) return {-1.0f, 5.0f};
    if (falls) return {-1.0f, 0.0f};
    return {hits ? nearest : -1.0f, 0.0f};
  }
};

/// Batch caster with the same hits. Counts calls and rays. Throws std::runtime_error at a chosen call.
struct batch_box_caster {
  struct log {
    std::size_t calls = 0, rays = 0, largest = 0;
    std::size_t throw_at = std::numeric_limits<std::size_t>::max();  ///< number of the call
  };

  box_caster box;
  log* calls;

  template <class Exec>
  void cast(const Exec& exec, wfpg::array_view<const wfpg::ray> rays,
            wfpg::array_view<wfpg::ray_hit> hits) const {
    if (calls->calls++ == calls->throw_at) throw std::runtime_error("the caster fails on request");
    calls->rays += rays.size();
    if (rays.size() > calls->largest) calls->largest = rays.size();
    const box_caster one = box;
    exec.for_each(rays.size(), [=] WFPG_HD(std::size_t i) { hits[i] = one(rays[i]); });
  }
};

/// `n` surfaces at random places on the six walls, seen from inside.
inline std::vector<test_surface> wall_surfaces(std::size_t n, std::uint64_t seed,
                                               bsdf_kind kind = bsdf_kind::lambert) {
  random_numbers random(seed);
  std::vector<test_surface> result;
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t face = random.below(6);
    const float u = random.unit(), v = random.unit();
    vec3 outgoing = random.direction();
    const vec3 normal = face_normal(face);
    if (glm::dot(outgoing, normal) < 0.0f) outgoing = -outgoing;
    result.push_back(make_surface(face_point(face, u, v), normal, outgoing, kind));
  }
  return result;
}

/// Deposits `radiance(face, u, v)`, a host function, on a grid of n² points on each face. Light leaves toward
/// the inside.
template <class Exec, class Radiance>
void deposit_on_walls(const Exec& exec, const wfpg::exitance_cache_view& cache, int n,
                      const Radiance& radiance) {
  std::vector<deposit> light;
  for (std::uint32_t face = 0; face < 6; ++face)
    for (int i = 0; i < n * n; ++i) {
      const float u = (float(i % n) + 0.5f) / float(n), v = (float(i / n) + 0.5f) / float(n);
      light.push_back({face_point(face, u, v), face_normal(face), float(radiance(face, u, v))});
    }
  deposit_all(exec, cache, light);
}

/// Counts allocations and bytes of a resource.
class counting_resource : public wfpg::memory_resource {
 public:
  explicit counting_resource(wfpg::memory_resource* upstream = default_resource()) : upstream_(upstream) {}

  std::size_t allocations = 0, bytes_in_use = 0;

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    ++allocations;
    bytes_in_use += bytes;
    return upstream_->allocate(bytes, alignment);
  }
  void do_deallocate(void* block, std::size_t bytes, std::size_t alignment) override {
    bytes_in_use -= bytes;
    upstream_->deallocate(block, bytes, alignment);
  }
  bool do_is_equal(const wfpg::memory_resource& other) const noexcept override { return this == &other; }

  wfpg::memory_resource* upstream_;
};

}  // namespace wfpg_test
