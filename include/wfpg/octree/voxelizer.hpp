// Triangles, surface samples or points to voxel fragments: for each voxel that a piece of surface touches,
// its Morton code, normal and area (paper, section 3.2; conservative as in Crassin & Green 2012). Fragments
// are what the octree and its cache are built from.
//
// Cost: O(voxels touched + columns of the triangles' boxes) time; 16 bytes a fragment, and while it runs 16 a
// triangle and 76 for each 16 columns begun.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/morton.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/host/geometry.hpp>
#include <wfpg/octree/statistics.hpp>

#include <cstdint>

namespace wfpg {

/// The cube of the octree: `resolution`³ voxels from `origin`.
struct voxel_grid {
  vec3 origin{0.0f};             ///< its least corner, world space
  float side = 1.0f;             ///< of the whole cube, scene units
  std::uint32_t resolution = 1;  ///< voxels along a side, a power of two

  /// A voxel's side, scene units.
  WFPG_HD float voxel_size() const { return side / static_cast<float>(resolution); }
  /// World space to voxels: [0, resolution)³ inside the cube.
  WFPG_HD vec3 to_grid(vec3 p) const { return (p - origin) * (static_cast<float>(resolution) / side); }

  /// The voxel that holds p; false where p is outside the cube, or not finite.
  WFPG_HD bool voxel_of(vec3 p, uvec3& voxel) const {
    const vec3 g = to_grid(p);
    const auto last = static_cast<float>(resolution);
    if (!(is_in_range(g.x, last) && is_in_range(g.y, last) && is_in_range(g.z, last))) return false;
    voxel = uvec3(g);
    return true;
  }
};

/// The surface of a voxel fragment.
struct fragment_surface {
  std::uint32_t normal;  ///< pack_direction
  float area;            ///< inside the voxel, square scene units
};

/// Voxel fragments in the policy's memory, one for each pair of a voxel and a piece of surface that touches
/// it.
template <class Exec>
struct voxel_fragments {
  buffer<morton_code, Exec> codes;          ///< a fragment: its voxel
  buffer<fragment_surface, Exec> surfaces;  ///< a fragment: its surface
  voxel_grid grid;                          ///< the voxels' cube
  build_report report;                      ///< what was left out

  voxel_fragments() = default;
  /// n fragments, not yet written. Throws out_of_memory.
  voxel_fragments(const Exec& exec, std::size_t n) : codes(exec, n), surfaces(exec, n) {}
  /// Number of fragments.
  std::size_t size() const { return codes.size(); }
  /// Of all fragments.
  std::size_t bytes() const { return codes.bytes() + surfaces.bytes(); }
};

/// Voxelizes triangles at `resolution`³ over the cube around them, conservatively: no voxel that a triangle
/// touches is missed, none is added that no triangle comes within 2⁻¹⁰ voxels of. Triangles with bad
/// vertices, indices or no area are skipped and counted. Throws std::invalid_argument for a resolution that
/// is no power of two in [1, 4096] and where 2³² - 1 fragments are exceeded; out_of_memory.
template <class Exec>
voxel_fragments<Exec> voxelize(const Exec& exec, triangle_mesh_view mesh, std::uint32_t resolution);

/// Fragments from surface samples: pieces of geometry that is not triangles, or hit points of a renderer that
/// cannot hand over its mesh. The cube is the one around `bounds`, or around the samples where `bounds` is
/// empty. Samples outside, with bad coordinates, no unit normal or no positive area are skipped and counted.
/// Throws as voxelize does.
template <class Exec>
voxel_fragments<Exec> fragments_from_samples(const Exec& exec, array_view<const surface_fragment> samples,
                                             std::uint32_t resolution, const bounds3& bounds = {});

}  // namespace wfpg

#include <wfpg/octree/detail/voxelizer_impl.hpp>
