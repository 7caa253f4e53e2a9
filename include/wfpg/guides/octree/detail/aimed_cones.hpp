// Aims cones of a refresh at bright nodes (bright_nodes.hpp). A refresh casts one cone through each run of
// cells. Every second time a run with bright nodes in its cells has a cone at one of them, each in turn. So a
// refresh casts as many cones as ever.
//
// A cone that hits its node counts like several paths that found light there. A node that is hidden from the
// field is not hit, and draws no samples. wfpg's own.
//
// Cost: O(listed nodes) a cone of a refresh; one read of memory where nothing is listed. Memory:
// scratch_bytes of a block.
#pragma once

#include <wfpg/guides/octree/detail/bright_nodes.hpp>
#include <wfpg/guides/octree/field_cells.hpp>

namespace wfpg::detail {

/// A cone of a build.
struct aimed_cone {
  /// No number of a bright side.
  static constexpr std::uint32_t nowhere = 0xffffffffu;

  field_cell cell;                 // that it looks through
  std::uint32_t target = nowhere;  // number of a bright side; nowhere: a random direction of the cell

  WFPG_HD bool is_aimed() const { return target != nowhere; }
};

/// The cells of one field that have bright nodes in them, for one refresh.
class aimed_cells {
 public:
  /// Bytes of scratch memory that a block needs.
  static constexpr std::size_t scratch_bytes = bright_node_constants::most * sizeof(std::uint32_t);
  /// Paths that a cone counts as where it hits its node. 4 paths leave a seventh more variance in wfpg-room.
  /// As many as its cell has seen leave less there, and far more in veach-ajar.
  static constexpr std::uint32_t paths = 8;

  /// Finds the cell of each bright side, of those that face the field. `wanted`: false finds none. All
  /// threads of the block call it.
  template <class Block>
  WFPG_HD aimed_cells(Block& block, const bright_nodes_view& bright, const field_cells& cells, bool wanted)
      : sides_(bright.sides), size_(wanted ? bright.size() : 0) {
    if (size_ == 0) return;
    auto* const found = block.template scratch<std::uint32_t>(bright_node_constants::most);
    block.for_each(static_cast<int>(size_), [&](int i) { found[i] = cell_of(bright.sides[i], cells); });
    block.sync();
    cells_ = found;
  }

  /// Whether no cones are aimed.
  WFPG_HD bool empty() const { return size_ == 0; }
  /// Number of bright sides in the cells [begin, end).
  WFPG_HD std::uint32_t count(std::uint32_t begin, std::uint32_t end) const {
    std::uint32_t n = 0;
    for (std::uint32_t i = 0; i < size_; ++i) n += is_in(i, begin, end) ? 1u : 0u;
    return n;
  }
  /// The cone that is aimed at the n-th bright side in the cells [begin, end). Precondition: n is less than
  /// their count().
  WFPG_HD aimed_cone at(std::uint32_t n, std::uint32_t begin, std::uint32_t end,
                        std::uint32_t resolution) const {
    std::uint32_t i = 0;
    while (!is_in(i, begin, end) || n-- > 0) ++i;
    return {cell_at(cells_[i], resolution), i};
  }

  /// The ray of a cone.
  WFPG_HD ray path(const field_cells& cells, const aimed_cone& cone) const {
    ray result = cells.cone(cone.cell);
    if (cone.is_aimed())
      result.direction = glm::normalize(sides_[cone.target].position - cells.origin.position);
    return result;
  }
  /// The hit of a cone, marked if it was aimed and hit its node. `hit`: what the caster returned for `path`.
  WFPG_HD cone_hit find(const exitance_cache_view& cache, const field_cells& cells, const aimed_cone& cone,
                        const ray& path, const ray_hit& hit) const {
    const cone_hit found = cells.find(cache, path, hit);
    return cone.is_aimed() && hit.is_hit() && hits_target(cache.octree(), cone, path, hit) ? found.marked()
                                                                                           : found;
  }
  /// Radiance that the cell of an aimed cone has for guiding: the root of the mean square over the cell, of
  /// its bright sides alone. It has the least variance where a part of a cell is bright.
  WFPG_HD float guiding_radiance(const exitance_cache_view& cache, const field_cells& cells,
                                 const aimed_cone& cone) const {
    const bright_side& side = sides_[cone.target];
    const vec3 to = side.position - cells.origin.position;
    const float square = glm::dot(to, to), cosine = -glm::dot(to, side.normal) / sqrtf(square);
    const float width = cache.octree().node_size(cache.octree().level_of(side.id / 2));
    const std::uint32_t cell = cells_[cone.target];
    const float solid_angle = static_cast<float>(count(cell, cell + 1)) * width * width * cosine / square;
    const float part = min(solid_angle / cells.domain.cell_solid_angle(), 1.0f);
    return min(cache.read(side.id / 2, side.id % 2), 1.0e30f) * sqrtf(part);
  }

 private:
  static constexpr std::uint32_t no_cell = 0xffffffffu;

  WFPG_HD bool is_in(std::uint32_t side, std::uint32_t begin, std::uint32_t end) const {
    return cells_[side] >= begin && cells_[side] < end;
  }
  // Whether a cone hit the node that it was aimed at.
  WFPG_HD bool hits_target(const sparse_voxel_octree_view& tree, const aimed_cone& cone, const ray& path,
                           const ray_hit& hit) const {
    const node_id leaf = tree.nearest_leaf(path.origin + hit.distance * path.direction);
    const node_id node = sides_[cone.target].id / 2;
    return leaf != invalid_node && tree.ancestor(leaf, tree.level_of(node)) == node;
  }
  // Row-major index of the cell in which a side lies; no_cell if the field is behind it, or it is below the
  // field's horizon.
  WFPG_HD static std::uint32_t cell_of(const bright_side& side, const field_cells& cells) {
    const vec3 to = side.position - cells.origin.position;
    const float square = glm::dot(to, to);
    vec2 uv;
    if (!(square > 0.0f) || !(glm::dot(to, side.normal) < 0.0f)) return no_cell;
    if (!cells.domain.locate(to / sqrtf(square), uv)) return no_cell;
    return cells.domain.grid().cell_of(uv);
  }

  const bright_side* sides_;
  std::uint32_t size_;
  const std::uint32_t* cells_ = nullptr;
};

}  // namespace wfpg::detail
