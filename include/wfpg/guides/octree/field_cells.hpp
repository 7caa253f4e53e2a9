// Casts, filters and scans one incident radiance field, the grid that kept and transient fields are made of.
// Each cell of an equal-area grid casts a jittered cone from a surface. The cone reads the exitance cache
// where it lands. The filtered grid becomes a distribution.
//
// Source: Yalciner and Akyuz (2024), sections 3.3 and 4; thesis (2024), section 4.4.2.
//
// Cost: F^2 cones and O(F^2) for a field of F x F cells. Memory: scratch for the filter,
// field_scratch_bytes().
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/bins/spatial_binner.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/guides/octree/detail/field_filter.hpp>
#include <wfpg/guides/octree/options.hpp>
#include <wfpg/host/bsdf.hpp>
#include <wfpg/host/ray_caster.hpp>
#include <wfpg/octree/exitance_cache.hpp>
#include <wfpg/sampling/field_sampler.hpp>

namespace wfpg {

/// Where a field's cones start, and which directions its cells cover.
struct field_origin {
  /// World space, off the surface: off_surface().
  vec3 position{0.0f};
  vec3 normal{0.0f};        ///< shading normal on the outgoing side, unit length
  bool cosine = false;      ///< whether cells carry the clamped cosine at `normal`
  bool hemisphere = false;  ///< true: cells cover the hemisphere above `normal`; false: the sphere
  std::uint32_t seed = 0;   ///< of the jitter inside cells; another in each sample
};

/// What a cone found, in 4 bytes: one side of an octree node, or radiance of the environment. A default one
/// is darkness: the cone landed outside every voxel. Kept fields store hits instead of radiance, so that they
/// follow the cache without new cones.
class cone_hit {
 public:
  /// Darkness: reads as 0 from any cache.
  cone_hit() = default;
  /// A side of an octree node. Precondition: node < 2³⁰, side is 0 or 1.
  WFPG_HD static cone_hit surface(node_id node, std::uint32_t side) { return cone_hit(2 * node + side); }
  /// Radiance (luminance, W/(m² sr)) of a cone that left the scene. A negative or non-finite value becomes
  /// darkness.
  WFPG_HD static cone_hit environment(float radiance) {
    return is_finite(radiance) && radiance > 0.0f ? cone_hit(escaped | float_bits(radiance)) : cone_hit();
  }

  /// Radiance along the cone, in [0, 1e30]. A surface reads the cache as it is now; an environment keeps its
  /// value. Non-finite radiance reads as 0. O(1).
  WFPG_HD float radiance(const exitance_cache_view& cache) const {
    const float value = word_ & escaped ? bits_float(word_ & ~escaped) : cache.read(word_ / 2, word_ % 2);
    return is_finite(value) ? min(value, 1.0e30f) : 0.0f;
  }
  /// Returns this hit with a mark: the cone hit the bright node that it was aimed at. Environment and
  /// darkness stay as they are. A marked hit has no radiance yet. Precondition: the surface's node < 2²⁹.
  WFPG_HD cone_hit marked() const { return word_ & escaped ? *this : cone_hit(word_ | mark); }
  /// Whether it has the mark of marked().
  WFPG_HD bool is_marked() const { return (word_ & (escaped | mark)) == mark; }
  /// Returns this hit without a mark.
  WFPG_HD cone_hit unmarked() const { return is_marked() ? cone_hit(word_ & ~mark) : *this; }
  /// Whether this is a valid hit for an octree of `nodes` nodes. Checks hits that were read from a file,
  /// before a kernel reads the cache by them.
  bool is_sound(std::uint32_t nodes) const {
    return word_ & escaped ? is_finite(bits_float(word_)) : word_ / 2 < nodes;
  }

 private:
  // Marks an environment's radiance: the float's sign bit, which radiance does not need.
  static constexpr std::uint32_t escaped = 0x80000000u;
  static constexpr std::uint32_t mark = 0x40000000u;

  WFPG_HD explicit cone_hit(std::uint32_t word) : word_(word) {}

  std::uint32_t word_ = escaped;
};

/// Column and row of one cell in a field's square grid.
///
/// Columns go along the map's u axis, rows along its v axis.
struct field_cell {
  /// Column, in [0, F); nothing checks it.
  std::uint32_t x, y;  ///< row, in [0, F)

  /// Index in row-major order, in [0, F²).
  WFPG_HD std::uint32_t index(std::uint32_t resolution) const { return y * resolution + x; }
};

/// Returns cell `i` in row-major order. Precondition: i < resolution².
WFPG_HD constexpr field_cell cell_at(std::uint32_t i, std::uint32_t resolution) {
  return {i % resolution, i / resolution};
}
/// Returns the i-th cell in the order in which whole fields cast their cones. The order goes through tiles of
/// 8 x 4 cells, so that the cones of a warp have similar directions. Where 8 does not divide the resolution,
/// cells come row by row. Precondition: i < resolution².
WFPG_HD constexpr field_cell cell_in_order(std::uint32_t i, std::uint32_t resolution) {
  if (resolution % 8 != 0) return cell_at(i, resolution);
  const field_cell tile = cell_at(i / 32, resolution / 8);
  return {tile.x * 8 + i % 8, tile.y * 4 + i % 32 / 8};
}

/// Maps the cells of one field to cones, and what the cones found to values.
struct field_cells {
  field_origin origin;       ///< where cones start
  directional_field domain;  ///< maps directions; has no distribution yet
  std::uint32_t resolution;  ///< F: cells along a side

  /// `size`: F. Precondition: the normal of a hemisphere has unit length.
  WFPG_HD field_cells(const field_origin& from, std::uint32_t size) : origin(from), resolution(size) {
    const grid_distribution grid(nullptr, size);
    domain = from.hemisphere ? directional_field(grid, from.normal) : directional_field(grid);
  }

  /// Ray of one cell, from the field's origin. Its direction is jittered uniformly inside the cell. The
  /// jitter depends on the origin's seed and the cell alone.
  WFPG_HD ray cone(field_cell cell) const {
    const vec2 jitter = coarse_vec2(hash32(origin.seed, cell.index(resolution)));
    const vec2 corner(static_cast<float>(cell.x), static_cast<float>(cell.y));
    ray result;
    result.origin = origin.position;
    result.direction = domain.direction((corner + jitter) / static_cast<float>(resolution));
    return result;
  }

  /// Returns what a cone found. `hit`: what the caster returned for `cone`. A hit takes the leaf nearest to
  /// its point, then the ancestor whose size fits the cone's footprint. It takes the side that faces the
  /// cone. A point without a leaf near it gives darkness. O(depth).
  WFPG_HD cone_hit find(const exitance_cache_view& cache, const ray& cone, const ray_hit& hit) const {
    if (!hit.is_hit()) return cone_hit::environment(hit.radiance);
    const sparse_voxel_octree_view& tree = cache.octree();
    const node_id leaf = tree.nearest_leaf(cone.origin + hit.distance * cone.direction);
    if (leaf == invalid_node) return {};
    // The node's radiance is the mean over the cone's footprint: one cone needs one read.
    const node_id node = tree.node_for_cone(leaf, hit.distance, domain.cell_solid_angle());
    return cone_hit::surface(node, cache.side_facing(node, -cone.direction));
  }

  /// Cosine at a cell's centre, in [0, 1]; 1 where cells carry none. `cell`: a row-major index. Kept fields
  /// use it, since they do not keep the jittered directions. Precondition: `origin.cosine` implies
  /// `origin.hemisphere`.
  WFPG_HD float central_cosine(std::uint32_t cell) const {
    if (!origin.cosine) return 1.0f;
    const vec2 corner(static_cast<float>(cell % resolution), static_cast<float>(cell / resolution));
    return square_to_hemisphere_z((corner + 0.5f) / static_cast<float>(resolution));
  }

  /// Value of a cell from the radiance that its cone saw along `direction`. Multiplies by the clamped cosine
  /// where cells carry it.
  WFPG_HD float weigh(float radiance, vec3 direction) const {
    return origin.cosine ? radiance * max(glm::dot(direction, origin.normal), 0.0f) : radiance;
  }
};

/// Filters F² cell values in place, adds the floor, and scans them into a distribution. `cells`: non-negative
/// and finite. Fields of fewer than 4 cells along a side are not filtered, since the taps reach two cells.
///
/// Uses field_scratch_bytes() of the block's scratch memory. Returns the distribution, which lies where the
/// cells did. All threads of the block call it. O(F²).
template <class Block>
WFPG_HD grid_distribution finish_field(Block& block, const cell_words& cells, int resolution, bool hemisphere,
                                       const field_options& options) {
  if (options.filter_alpha > 0.0f && resolution >= 2 * detail::gaussian_taps::radius) {
    auto* const scratch = block.template scratch<float>(
        detail::field_filter::scratch_floats(static_cast<std::uint32_t>(resolution), Block::warps));
    // A hemisphere's cells are √2 times narrower, so that many more cells make the same angle.
    const float alpha = hemisphere ? options.filter_alpha * 1.41421356f : options.filter_alpha;
    detail::field_filter(cells, resolution, hemisphere, alpha).apply(block, scratch);
  }
  return build_distribution(block, cells, resolution, options.absolute_floor ? options.floor : 0.0f,
                            options.absolute_floor ? 0.0f : options.floor);
}

/// Start of the cones from a surface: off the surface, along its geometric normal, on the outgoing side. The
/// offset is the larger of 1e-4 of the largest absolute coordinate and 1e-3 of a voxel. A geometric normal
/// that is not finite is replaced by the shading normal.
template <class Bsdf>
WFPG_HD vec3 off_surface(const surface<Bsdf>& s, const sparse_voxel_octree_view& tree) {
  const vec3 n = is_finite(glm::dot(s.geometric_normal, s.geometric_normal)) ? s.geometric_normal : s.normal;
  const vec3 off = glm::dot(n, s.outgoing) >= 0.0f ? n : -n;
  const float magnitude = max(fabsf(s.position.x), max(fabsf(s.position.y), fabsf(s.position.z)));
  return s.position + off * max(1.0e-4f * magnitude, 1.0e-3f * tree.grid().voxel_size());
}

/// Origin of a field whose cones start at one of its rays' surfaces. In oriented mode, reflecting surfaces
/// get a hemisphere with the cosine. All others get the sphere without it. `orientation`: of the field's bin,
/// in [0, orientations). `seed`: of the jitter.
template <class Bsdf>
WFPG_HD field_origin origin_at(const surface<Bsdf>& s, const sparse_voxel_octree_view& tree,
                               guiding_mode mode, std::uint32_t orientation, std::uint32_t seed) {
  field_origin result;
  result.position = off_surface(s, tree);
  result.normal = facing_normal(s);
  result.hemisphere = mode == guiding_mode::oriented && orientation < orientation_transmits;
  result.cosine = result.hemisphere;
  result.seed = seed;
  return result;
}

/// Supplies hits by calling an inline caster inside the kernel. Needs no memory.
template <class Caster>
struct inline_hits {
  /// Traces one ray; a cone caster also gets the cone's solid angle.
  Caster caster;
  /// Traces `cone`. `solid_angle`: of its cell, in steradians. The unnamed arguments are the bin and the
  /// cone's number, which stored_hits needs.
  WFPG_HD ray_hit operator()(std::size_t, std::uint32_t, const ray& cone,
                             [[maybe_unused]] float solid_angle) const {
    if constexpr (is_cone_caster_v<Caster>)
      return caster(cone, solid_angle);
    else
      return caster(cone);
  }
};

/// Supplies hits that a batch caster wrote, for `hits.size() / cells` bins from `first_bin` on.
struct stored_hits {
  array_view<const ray_hit> hits;  ///< bin by bin, in the order in which cones were written
  std::size_t first_bin;           ///< bin of hits[0]
  std::uint32_t cells;             ///< cones a bin
  /// Returns the hit of cone `i` of `bin`. Precondition: the bin is one of those that were cast.
  WFPG_HD ray_hit operator()(std::size_t bin, std::uint32_t i, const ray&, float) const {
    return hits[(bin - first_bin) * cells + i];
  }
};

/// Bytes of scratch memory that finish_field() needs in blocks of `warps` warps. The larger of 2 (F + 4)
/// floats a warp and 4 F floats for every 16 rows, plus 16 bytes for alignment.
inline std::size_t field_scratch_bytes(std::uint32_t resolution, int warps) {
  return sizeof(float) * detail::field_filter::scratch_floats(resolution, warps) + 16;
}

/// Casts the cones of `count` fields by a batch caster.
///   write(first, n, cones)  launches the kernel that writes the cones of fields [first, first + n)
///   read(first, n, hits)    launches the kernel that reads their hits
///
/// The buffers decide how many fields are cast at once, so memory stays bounded. Throws what the caster
/// throws. Precondition: `cones` and `hits` have room for at least one field.
template <class Exec, class Caster, class Write, class Read>
void cast_in_batches(const Exec& exec, const Caster& caster, std::size_t count, std::uint32_t cones_a_field,
                     array_view<ray> cones, array_view<ray_hit> hits, const Write& write, const Read& read) {
  // The last batch may have fewer fields than the others.
  const std::size_t at_once = cones.size() / cones_a_field;
  for (std::size_t first = 0; first < count; first += at_once) {
    const std::size_t n = min(at_once, count - first);
    write(first, n, cones);
    caster.cast(exec, array_view<const ray>(cones.data(), n * cones_a_field),
                array_view<ray_hit>(hits.data(), n * cones_a_field));
    read(first, n, hits);
  }
}

}  // namespace wfpg
