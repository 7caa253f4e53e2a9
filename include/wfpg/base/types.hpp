// The small value types that every other header speaks: vectors, rays, hits, bounds, views of arrays.
// All are trivially copyable and go to kernels by value.
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

/// A half-line segment. `direction` has unit length; distances are in scene units.
struct ray {
  vec3 origin{0.0f};                 ///< world space
  float t_min = 0.0f;                ///< hits lie beyond it
  vec3 direction{0.0f, 0.0f, 1.0f};  ///< unit length
  float t_max = 3.0e38f;             ///< and before it
};

/// What a ray caster answers: the distance of the first surface, or the environment's radiance.
struct ray_hit {
  float distance = -1.0f;  ///< along the ray, scene units; negative where nothing was hit
  float radiance = 0.0f;   ///< of the environment along the ray where nothing was hit, luminance, W/(m² sr)

  /// Whether there is a surface.
  WFPG_HD bool is_hit() const { return distance >= 0.0f; }
};

/// An axis-aligned box. A default one is empty (lower > upper).
struct bounds3 {
  vec3 lower{3.0e38f};   ///< the least coordinates, world space
  vec3 upper{-3.0e38f};  ///< the largest coordinates, world space

  /// Whether there is no point in it.
  WFPG_HD bool empty() const { return lower.x > upper.x || lower.y > upper.y || lower.z > upper.z; }
  /// Its middle. Precondition: not empty.
  WFPG_HD vec3 centre() const { return 0.5f * (lower + upper); }
  /// Its length along each axis. Precondition: not empty.
  WFPG_HD vec3 extent() const { return upper - lower; }
};

/// A pointer and a length: elements owned by someone else, in the memory of an execution policy.
template <class T>
class array_view {
 public:
  array_view() = default;
  /// Elements [data, data + size).
  WFPG_HD array_view(T* data, std::size_t size) : data_(data), size_(size) {}
  /// A view of const elements from one of mutable ones.
  template <class U, class = decltype(static_cast<T*>(static_cast<U*>(nullptr)))>
  WFPG_HD array_view(array_view<U> other) : data_(other.data()), size_(other.size()) {}

  /// The first element, in the policy's memory; null or any pointer where empty.
  WFPG_HD T* data() const { return data_; }
  /// Number of elements.
  WFPG_HD std::size_t size() const { return size_; }
  /// Whether there are no elements.
  WFPG_HD bool empty() const { return size_ == 0; }
  /// Element i, below size().
  WFPG_HD T& operator[](std::size_t i) const { return data_[i]; }
  /// The first element.
  WFPG_HD T* begin() const { return data_; }
  /// One past the last element.
  WFPG_HD T* end() const { return data_ + size_; }
  /// Elements [first, first + count); the caller keeps the range inside the view.
  WFPG_HD array_view subview(std::size_t first, std::size_t count) const { return {data_ + first, count}; }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// Luminance of linear Rec. 709 RGB (ITU-R BT.709-6, item 3.2).
WFPG_HD inline float luminance(vec3 rgb) {
  return 0.2126f * rgb.x + 0.7152f * rgb.y + 0.0722f * rgb.z;
}

}  // namespace wfpg
