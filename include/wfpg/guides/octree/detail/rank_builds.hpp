// Builds of kept fields whose cones ranks share. Each rank casts the cones of a part of the listed builds.
// The ranks exchange what the cones hit, and then all make all distributions.
//
// Cost: cones of a rank's part, and O(F^2) a build. Traffic: 4 bytes a cone. Memory: as much.
#pragma once

#include <wfpg/guides/octree/kept_field.hpp>

namespace wfpg::detail {

/// Kernel: casts the cones of listed builds, or looks up what a batch caster found. One block a build.
template <class Builder, class Hits>
struct cast_listed_cones {
  Builder builder;            // kept_field_builder
  Hits hits;                  // inline_hits or stored_hits
  const std::uint32_t* list;  // slots
  bool whole;                 // all cells, or those of a refresh
  cone_hit* found;            // of the first listed build, cone by cone

  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    const std::uint32_t slot = list[i], n = builder.cone_count(whole);
    const field_cells cells = builder.cells(slot, whole);
    const aimed_cells aimed(block, builder.kept.bright, cells, !whole);
    const float solid_angle = cells.domain.cell_solid_angle();
    block.for_each(static_cast<int>(n), [&](int c) {
      const auto number = static_cast<std::uint32_t>(c);
      const aimed_cone cone = builder.cone(slot, whole, number, aimed);
      const ray r = aimed.path(cells, cone);
      const ray_hit hit = hits(i, number, r, solid_angle);
      found[i * n + number] = aimed.find(builder.wave.cache, cells, cone, r, hit);
    });
  }
};

/// Kernel: stores what cones hit, and finishes the fields of listed slots. One block a build.
template <class Builder>
struct finish_listed_fields {
  Builder builder;
  const std::uint32_t* list;
  bool whole;
  const cone_hit* found;

  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    const std::uint32_t slot = list[i], n = builder.cone_count(whole);
    const field_cells cells = builder.cells(slot, whole);
    const aimed_cells aimed(block, builder.kept.bright, cells, !whole);
    block.for_each(static_cast<int>(n), [&](int c) {
      const auto number = static_cast<std::uint32_t>(c);
      builder.store(slot, cells, aimed, builder.cone(slot, whole, number, aimed), found[i * n + number]);
    });
    block.sync();
    builder.finish(block, slot, cells, whole);
  }
};

}  // namespace wfpg::detail
