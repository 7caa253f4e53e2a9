// Turns triangles, surface samples or points into voxel fragments. A fragment is a piece of surface in one
// voxel: its Morton code, normal and area (paper, section 3.2; conservative as in Crassin & Green 2012). The
// octree and its exitance cache are built from fragments.
//
// Cost: O(voxels touched + columns of the triangles' boxes). Memory: 16 bytes a fragment. While it runs, 20
// more a triangle and 76 for each item of up to 16 columns.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/morton.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/host/geometry.hpp>
#include <wfpg/octree/statistics.hpp>

#include <cstdint>

namespace wfpg {

/// The cube of the octree, divided into `resolution`³ voxels.
struct voxel_grid {
  vec3 origin{0.0f};             ///< its least corner, world space
  float side = 1.0f;             ///< of the whole cube, scene units
  std::uint32_t resolution = 1;  ///< voxels along a side, a power of two

  /// Side of one voxel, scene units.
  WFPG_HD float voxel_size() const { return side / static_cast<float>(resolution); }
  /// Maps a point from world space to units of voxels: [0, resolution)³ inside the cube.
  WFPG_HD vec3 to_grid(vec3 p) const { return (p - origin) * (static_cast<float>(resolution) / side); }

  /// Finds the voxel that holds a point. Returns false where the point is outside the cube or not finite, and
  /// leaves `voxel` as it is.
  WFPG_HD bool voxel_of(vec3 p, uvec3& voxel) const {
    const vec3 g = to_grid(p);
    const auto last = static_cast<float>(resolution);
    if (!(is_in_range(g.x, last) && is_in_range(g.y, last) && is_in_range(g.z, last))) return false;
    voxel = uvec3(g);
    return true;
  }
};

/// Normal and area of the piece of surface in one voxel, 8 bytes.
struct fragment_surface {
  std::uint32_t normal;  ///< unit normal, packed by pack_direction()
  float area;            ///< of the piece inside the voxel, square scene units
};

/// Voxel fragments in the policy's memory, one for each pair of a voxel and a piece of surface that touches
/// it.
template <class Exec>
struct voxel_fragments {
  buffer<morton_code, Exec> codes;          ///< a fragment: Morton code of its voxel
  buffer<fragment_surface, Exec> surfaces;  ///< a fragment: its normal and area
  voxel_grid grid;                          ///< the cube in which the codes count voxels
  build_report report;                      ///< what was left out

  /// No fragments.
  voxel_fragments() = default;
  /// Allocates n fragments, whose values are not set. Throws out_of_memory.
  voxel_fragments(const Exec& exec, std::size_t n) : codes(exec, n), surfaces(exec, n) {}
  /// Number of fragments, below 2³² - 1.
  std::size_t size() const { return codes.size(); }
  /// Bytes of all fragments, 16 each.
  std::size_t bytes() const { return codes.bytes() + surfaces.bytes(); }
};

/// Voxelizes triangles at `resolution`³ over the cube around them, conservatively. No voxel that a triangle
/// touches is missed. No voxel is added that is more than 2⁻¹⁰ voxels away from every triangle. Triangles
/// with bad vertices or indices, or without area, are skipped and counted in the report. Throws
/// std::invalid_argument for a resolution that is no power of two in [1, 4096]. Throws it too where there are
/// 2³² - 1 fragments or triangles, or more. Throws out_of_memory.
template <class Exec>
voxel_fragments<Exec> voxelize(const Exec& exec, triangle_mesh_view mesh, std::uint32_t resolution);

/// Makes fragments from surface samples, one a sample. Samples are pieces of geometry that is not triangles,
/// or hit points of a renderer that cannot hand over its mesh. The cube is the one around `bounds`; where
/// `bounds` is empty, the one around the samples. Samples outside the cube, with bad coordinates, no unit
/// normal or no positive area are skipped and counted. Throws as voxelize() does. O(samples).
template <class Exec>
voxel_fragments<Exec> fragments_from_samples(const Exec& exec, array_view<const surface_fragment> samples,
                                             std::uint32_t resolution, const bounds3& bounds = {});

}  // namespace wfpg

#include <wfpg/octree/detail/voxelizer_impl.hpp>
