// Small value types that all other headers use: vectors, rays, hits, boxes, views of arrays.
// All are trivially copyable and go to kernels by value.
// Cost: none beyond their members. Memory: a ray has 32 bytes, a hit 8, a box 24, a view 16.
#pragma once

#include <wfpg/base/config.hpp>
#include <wfpg/base/detail/glm.hpp>

#include <cstddef>
#include <cstdint>

/// Path guiding for wavefront path tracers; path_guider is where to begin.
namespace wfpg {

/// Two floats, such as random numbers in [0,1)².
using vec2 = glm::vec2;
/// Three floats: a position, a direction, or linear RGB.
using vec3 = glm::vec3;
/// Three unsigned integers: a triangle's corners, or a voxel's coordinates.
using uvec3 = glm::uvec3;

/// Index of a node of the octree; `invalid_node` where there is none.
using node_id = std::uint32_t;
/// No node: its id is larger than any node's.
inline constexpr node_id invalid_node = 0xffffffffu;
/// Stands for the index of a path that is not told.
inline constexpr std::uint32_t no_path = 0xffffffffu;

/// A segment of a half-line. Distances are in scene units.
struct ray {
  vec3 origin{0.0f};                 ///< world space
  float t_min = 0.0f;                ///< hits lie beyond this distance
  vec3 direction{0.0f, 0.0f, 1.0f};  ///< unit length
  float t_max = 3.0e38f;             ///< hits lie before this distance
};

/// The answer of a ray caster: the distance of the first surface, or the environment's radiance.
struct ray_hit {
  float distance = -1.0f;  ///< along the ray, scene units; negative on a miss
  /// Radiance of the environment along the ray on a miss: luminance, W/(m² sr), at least 0.
  /// Not read on a hit.
  float radiance = 0.0f;

  /// Returns whether the ray met a surface.
  WFPG_HD bool is_hit() const { return distance >= 0.0f; }
};

/// An axis-aligned box. A default one is empty (lower > upper).
struct bounds3 {
  vec3 lower{3.0e38f};   ///< least coordinates, world space
  vec3 upper{-3.0e38f};  ///< largest coordinates, world space

  /// Returns whether the box contains no point. A box of one point is not empty.
  WFPG_HD bool empty() const { return lower.x > upper.x || lower.y > upper.y || lower.z > upper.z; }
  /// Returns the middle of the box. Precondition: not empty.
  WFPG_HD vec3 centre() const { return 0.5f * (lower + upper); }
  /// Returns the side lengths, scene units. Precondition: the box has a point.
  WFPG_HD vec3 extent() const { return upper - lower; }
};

/// A pointer and a length, like std::span: it owns nothing.
/// The elements lie in the memory of an execution policy, and must outlive the view.
template <class T>
class array_view {
 public:
  /// No elements; data() is null.
  array_view() = default;
  /// A view of elements [data, data + size).
  WFPG_HD array_view(T* data, std::size_t size) : data_(data), size_(size) {}
  /// Converts a view of mutable elements to one of const elements. O(1).
  template <class U, class = decltype(static_cast<T*>(static_cast<U*>(nullptr)))>
  WFPG_HD array_view(array_view<U> other) : data_(other.data()), size_(other.size()) {}

  /// Returns the address of the first element, in the policy's memory. Where empty, it may be any pointer.
  WFPG_HD T* data() const { return data_; }
  /// Returns the number of elements, not bytes.
  WFPG_HD std::size_t size() const { return size_; }
  /// Returns whether size() is 0.
  WFPG_HD bool empty() const { return size_ == 0; }
  /// Returns element `i`. Precondition: i < size(), which is not checked.
  WFPG_HD T& operator[](std::size_t i) const { return data_[i]; }
  /// Returns the first element's address, for range-based loops.
  WFPG_HD T* begin() const { return data_; }
  /// Returns the address one past the last element.
  WFPG_HD T* end() const { return data_ + size_; }
  /// Returns a view of elements [first, first + count). Precondition: first + count <= size().
  WFPG_HD array_view subview(std::size_t first, std::size_t count) const { return {data_ + first, count}; }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// Returns the luminance of linear Rec. 709 RGB, in the unit of `rgb` (ITU-R BT.709-6, item 3.2).
WFPG_HD inline float luminance(vec3 rgb) {
  return 0.2126f * rgb.x + 0.7152f * rgb.y + 0.0722f * rgb.z;
}

}  // namespace wfpg
