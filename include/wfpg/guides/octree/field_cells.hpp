// One incident radiance field (paper, section 3.3 and section 4; thesis, section 4.4.2): each cell of an
// equal-area grid casts a jittered cone from a surface, reads the exitance cache where it lands, and the
// filtered grid becomes a distribution. Transient and kept fields are made of these.
//
// Cost: F^2 cones and O(F^2) a field; scratch memory for the filter, field_scratch_bytes().
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/guides/octree/detail/field_filter.hpp>
#include <wfpg/host/bsdf.hpp>
#include <wfpg/host/ray_caster.hpp>
#include <wfpg/octree/exitance_cache.hpp>
#include <wfpg/sampling/field_sampler.hpp>

namespace wfpg {

/// How a field is made from what its cones found.
struct field_options {
  /// Width of the Gaussian exp(-x²/alpha²), in cells of a field over the sphere; 0: none (thesis, Eq. 5.1).
  /// Over a hemisphere cells are narrower, and it spans √2 as many: the same angle.
  float filter_alpha = 0.8f;
  float floor = 1.0e-2f;  ///< epsilon added to each cell: times the field's mean, or as it is where absolute
  bool absolute_floor = false;  ///< `floor` is radiance, not a share of the mean
};

/// Where a field's cones start, and what it covers.
struct field_origin {
  vec3 position{0.0f};      ///< world space, off the surface
  vec3 normal{0.0f};        ///< shading normal on the outgoing side, unit length
  bool cosine = false;      ///< cells carry the clamped cosine at `normal`
  bool hemisphere = false;  ///< over the hemisphere above `normal`; else over the sphere
  std::uint32_t seed = 0;   ///< of the jitter inside cells
};

/// What a cone found, in 4 bytes: a side of a node, or radiance of the environment. One that landed outside
/// every voxel found darkness.
class cone_hit {
 public:
  cone_hit() = default;
  /// Precondition: node < 2³⁰, side is 0 or 1.
  WFPG_HD static cone_hit surface(node_id node, std::uint32_t side) { return cone_hit(2 * node + side); }
  /// What is not finite or negative is darkness.
  WFPG_HD static cone_hit environment(float radiance) {
    return is_finite(radiance) && radiance > 0.0f ? cone_hit(escaped | float_bits(radiance)) : cone_hit();
  }

  /// What the cone sees in the cache as it is now; finite, at most 1e30.
  WFPG_HD float radiance(const exitance_cache_view& cache) const {
    const float value = word_ & escaped ? bits_float(word_ & ~escaped) : cache.read(word_ / 2, word_ % 2);
    return is_finite(value) ? min(value, 1.0e30f) : 0.0f;
  }
  /// Whether this is what a cone finds where there are so many nodes.
  bool is_sound(std::uint32_t nodes) const {
    return word_ & escaped ? is_finite(bits_float(word_)) : word_ / 2 < nodes;
  }

 private:
  static constexpr std::uint32_t escaped = 0x80000000u;  // the sign, which radiance does not need

  WFPG_HD explicit cone_hit(std::uint32_t word) : word_(word) {}

  std::uint32_t word_ = escaped;
};

/// A cell of a field.
struct field_cell {
  std::uint32_t x, y;

  WFPG_HD std::uint32_t index(std::uint32_t resolution) const { return y * resolution + x; }
};

/// The i-th cell, row by row.
WFPG_HD constexpr field_cell cell_at(std::uint32_t i, std::uint32_t resolution) {
  return {i % resolution, i / resolution};
}
/// The i-th cell in the order in which cones are cast: tiles of 8 x 4, so that the cones of a warp, and of a
/// batch caster's, go nearly the same way; row by row where tiles do not fit.
WFPG_HD constexpr field_cell cell_in_order(std::uint32_t i, std::uint32_t resolution) {
  if (resolution % 8 != 0) return cell_at(i, resolution);
  const field_cell tile = cell_at(i / 32, resolution / 8);
  return {tile.x * 8 + i % 8, tile.y * 4 + i % 32 / 8};
}

/// One field's cells: which direction they look, what they see.
struct field_cells {
  field_origin origin;
  directional_field domain;  // maps directions; its distribution is not there yet
  std::uint32_t resolution;

  WFPG_HD field_cells(const field_origin& from, std::uint32_t size) : origin(from), resolution(size) {
    const grid_distribution grid(nullptr, size);
    domain = from.hemisphere ? directional_field(grid, from.normal) : directional_field(grid);
  }

  WFPG_HD ray cone(field_cell cell) const {
    const vec2 jitter = coarse_vec2(hash32(origin.seed, cell.index(resolution)));
    const vec2 corner(static_cast<float>(cell.x), static_cast<float>(cell.y));
    ray result;
    result.origin = origin.position;
    result.direction = domain.direction((corner + jitter) / static_cast<float>(resolution));
    return result;
  }

  /// What a cone found: the node of its footprint's size where it landed.
  WFPG_HD cone_hit find(const exitance_cache_view& cache, const ray& cone, const ray_hit& hit) const {
    if (!hit.is_hit()) return cone_hit::environment(hit.radiance);
    const sparse_voxel_octree_view& tree = cache.octree();
    const node_id leaf = tree.nearest_leaf(cone.origin + hit.distance * cone.direction);
    if (leaf == invalid_node) return {};
    const node_id node = tree.node_for_cone(leaf, hit.distance, domain.cell_solid_angle());
    return cone_hit::surface(node, cache.side_facing(node, -cone.direction));
  }

  /// The cosine at a cell's centre; 1 where cells carry none. Precondition: cosine only over a hemisphere.
  WFPG_HD float central_cosine(std::uint32_t cell) const {
    if (!origin.cosine) return 1.0f;
    const vec2 corner(static_cast<float>(cell % resolution), static_cast<float>(cell / resolution));
    return square_to_hemisphere_z((corner + 0.5f) / static_cast<float>(resolution));
  }

  /// A cell's value from the radiance that it saw and the direction in which it saw that.
  WFPG_HD float weigh(float radiance, vec3 direction) const {
    return origin.cosine ? radiance * max(glm::dot(direction, origin.normal), 0.0f) : radiance;
  }
};

/// Filters, floors and scans F² cell values in place. Takes field_scratch_bytes() of scratch memory.
template <class Block>
WFPG_HD grid_distribution finish_field(Block& block, const cell_words& cells, int resolution, bool hemisphere,
                                       const field_options& options) {
  if (options.filter_alpha > 0.0f && resolution >= 2 * detail::gaussian_taps::radius) {
    auto* const scratch = block.template scratch<float>(
        detail::field_filter::scratch_floats(static_cast<std::uint32_t>(resolution), Block::warps));
    const float alpha = hemisphere ? options.filter_alpha * 1.41421356f : options.filter_alpha;
    detail::field_filter(cells, resolution, hemisphere, alpha).apply(block, scratch);
  }
  return build_distribution(block, cells, resolution, options.absolute_floor ? options.floor : 0.0f,
                            options.absolute_floor ? 0.0f : options.floor);
}

/// Where cones from a surface start: off it, on the outgoing side. A geometric normal that is not finite
/// gives way to the shading normal.
template <class Bsdf>
WFPG_HD vec3 off_surface(const surface<Bsdf>& s, const sparse_voxel_octree_view& tree) {
  const vec3 n = is_finite(glm::dot(s.geometric_normal, s.geometric_normal)) ? s.geometric_normal : s.normal;
  const vec3 off = glm::dot(n, s.outgoing) >= 0.0f ? n : -n;
  const float magnitude = max(fabsf(s.position.x), max(fabsf(s.position.y), fabsf(s.position.z)));
  return s.position + off * max(1.0e-4f * magnitude, 1.0e-3f * tree.grid().voxel_size());
}

/// Hits of a caster called in place.
template <class Caster>
struct inline_hits {
  Caster caster;
  WFPG_HD ray_hit operator()(std::size_t, std::uint32_t, const ray& cone,
                             [[maybe_unused]] float solid_angle) const {
    if constexpr (is_cone_caster_v<Caster>)
      return caster(cone, solid_angle);
    else
      return caster(cone);
  }
};

/// Hits that a batch caster wrote for bins from `first_bin`.
struct stored_hits {
  array_view<const ray_hit> hits;
  std::size_t first_bin;
  std::uint32_t cells;
  WFPG_HD ray_hit operator()(std::size_t bin, std::uint32_t i, const ray&, float) const {
    return hits[(bin - first_bin) * cells + i];
  }
};

/// Scratch that finish_field needs, of blocks of so many warps.
inline std::size_t field_scratch_bytes(std::uint32_t resolution, int warps) {
  return sizeof(float) * detail::field_filter::scratch_floats(resolution, warps) + 16;
}

}  // namespace wfpg
