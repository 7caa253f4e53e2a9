// One kept field: which of its cells are cast, what they find, how it becomes a distribution.
#pragma once

#include <wfpg/guides/octree/detail/field_slots.hpp>
#include <wfpg/guides/octree/guide_view.hpp>
#include <wfpg/guides/octree/learnt_radiance.hpp>
#include <wfpg/guides/octree/transient_fields.hpp>

namespace wfpg::detail {

/// Cones of a refresh that casts one cell in `recast`.
WFPG_HD constexpr std::uint32_t refresh_cones(std::uint32_t resolution, std::uint32_t recast) {
  return (resolution * resolution - 1) / recast + 1;
}

/// The cell of a refresh's cone: one in each run of `recast` cells, another each time, and shifted from run
/// to run by about the golden ratio, odd where `recast` is even, so that rows and columns are covered evenly.
/// After `recast` refreshes every cell has been cast.
WFPG_HD constexpr std::uint32_t refreshed_cell(std::uint32_t cone, std::uint32_t refresh,
                                               std::uint32_t resolution, std::uint32_t recast) {
  const std::uint32_t begin = cone * recast;
  const std::uint32_t length = min(recast, resolution * resolution - begin);
  const std::uint32_t shift = (5 * recast + 4) / 8 | (recast % 2 == 0 ? 1u : 0u);
  return begin + (refresh + shift * (cone % recast)) % length;
}

/// Where the slots' fields are.
struct kept_fields_view {
  field_slots_view slots;
  resident_field* fields;
  std::uint32_t* words;
  cone_hit* hits;
  rough_mean* learnt;  // null: fields do not learn
  float cone_samples;
  std::uint32_t resolution;
  std::uint32_t recast;
  std::uint32_t sample;
  std::uint64_t* refreshed;  // counts builds that cast a part of the cones
};

/// Builds fields for a wave's rays.
template <class Wave>
struct kept_field_builder {
  Wave wave;
  kept_fields_view kept;

  WFPG_HD std::uint32_t cone_count(bool whole) const {
    return whole ? kept.resolution * kept.resolution : refresh_cones(kept.resolution, kept.recast);
  }
  WFPG_HD field_cell cell(std::uint32_t slot, bool whole, std::uint32_t cone) const {
    if (whole) return cell_in_order(cone, kept.resolution);
    return cell_at(refreshed_cell(cone, kept.slots.slots[slot].builds, kept.resolution, kept.recast),
                   kept.resolution);
  }

  /// Cones start from the ray that was picked; a field's frame is that of the ray that it was first cast for.
  WFPG_HD field_cells cells(std::uint32_t slot, bool whole) const {
    const field_slot& state = kept.slots.slots[slot];
    const auto s = wave.surfaces(static_cast<std::uint32_t>(state.origin));
    field_origin origin;
    origin.position = off_surface(s, wave.cache.octree());
    origin.hemisphere =
        wave.mode == guiding_mode::oriented && state.key % orientations < orientation_transmits;
    origin.cosine = origin.hemisphere;
    origin.normal = whole ? facing_normal(s) : kept.fields[slot].normal;
    origin.seed = static_cast<std::uint32_t>(hash(wave.seed, state.key));
    return {origin, kept.resolution};
  }

  /// Reads every cell through its hit and what was learnt of it, and makes the distribution. What was learnt
  /// is forgotten where all cones are cast: the field is new, or geometry moved.
  template <class Block>
  WFPG_HD void finish(Block& block, std::uint32_t slot, const field_cells& cells, bool whole) const {
    const auto size = static_cast<int>(kept.resolution);
    const std::size_t first = std::size_t(slot) * kept.resolution * kept.resolution;
    const cell_words words{kept.words + std::size_t(slot) * grid_distribution::words(kept.resolution)};
    block.for_each(size * size, [&](int cell) {
      const float radiance = radiance_of(first + static_cast<std::size_t>(cell), whole);
      words.set(cell, radiance * cells.central_cosine(static_cast<std::uint32_t>(cell)));
    });
    block.sync();
    const bool hemisphere = cells.origin.hemisphere;
    finish_field(block, words, size, hemisphere, wave.options);
    block.for_each(1, [&](int) {
      kept.fields[slot] = {hemisphere ? cells.origin.normal : vec3(0.0f), wave.fraction};
      field_slot& state = kept.slots.slots[slot];
      state.last_built = kept.sample;
      ++state.builds;
      state.origin = field_slot::unpicked;
      kept.slots.settled[slot] = 1;
      count(whole);
    });
  }

 private:
  /// Of a cell of all fields.
  WFPG_HD float radiance_of(std::size_t cell, bool whole) const {
    const float seen = kept.hits[cell].radiance(wave.cache);
    if (!kept.learnt) return seen;
    if (whole) kept.learnt[cell] = {};
    return mixed_with(kept.learnt[cell], seen, kept.cone_samples);
  }

  WFPG_HD void count(bool whole) const {
    if (!whole) atomic_add(kept.refreshed, std::uint64_t(1));
    if (!wave.statistics) return;
    atomic_add(&wave.statistics->bins, std::uint64_t(1));
    atomic_add(&wave.statistics->cones, std::uint64_t(cone_count(whole)));
  }
};

/// Casts a part of the listed slots' cones, or all, and finishes their fields.
template <class Builder, class Hits>
struct build_kept_fields {
  Builder builder;
  Hits hits;
  const std::uint32_t* list;
  bool whole;

  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    const std::uint32_t slot = list[i];
    const field_cells cells = builder.cells(slot, whole);
    const std::uint32_t n = builder.kept.resolution * builder.kept.resolution;
    cone_hit* const kept = builder.kept.hits + std::size_t(slot) * n;
    const float solid_angle = cells.domain.cell_solid_angle();
    block.for_each(static_cast<int>(builder.cone_count(whole)), [&](int c) {
      const auto cone = static_cast<std::uint32_t>(c);
      const field_cell cell = builder.cell(slot, whole, cone);
      const ray r = cells.cone(cell);
      kept[cell.index(cells.resolution)] = cells.find(builder.wave.cache, r, hits(i, cone, r, solid_angle));
    });
    block.sync();
    builder.finish(block, slot, cells, whole);
  }
};

/// Both: first those of which all cones are cast.
template <class Build>
struct build_listed_fields {
  Build whole, part;
  const field_wave_counts* counts;

  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    const std::uint32_t wholes = counts->all;
    if (i < wholes)
      whole(block, i);
    else
      part(block, i - wholes);
  }
};

/// The cones of listed slots, for a batch caster.
template <class Builder>
struct write_kept_cones {
  Builder builder;
  array_view<ray> cones;
  const std::uint32_t* list;
  bool whole;

  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    const field_cells cells = builder.cells(list[i], whole);
    const std::uint32_t n = builder.cone_count(whole);
    block.for_each(static_cast<int>(n), [&](int c) {
      const auto cone = static_cast<std::uint32_t>(c);
      cones[i * n + cone] = cells.cone(builder.cell(list[i], whole, cone));
    });
  }
};

/// Marks fields to be cast anew from which `bounds` may be seen: those whose node is inside, and those with a
/// part of the bounding sphere above their horizon, from anywhere in their node.
struct invalidate_fields {
  field_slots_view slots;
  const resident_field* fields;
  sparse_voxel_octree_view tree;
  bounds3 bounds;

  WFPG_HD void operator()(std::size_t i) const {
    field_slot& s = slots.slots[i];
    if (s.key == no_key || !may_see(s.key / orientations, fields[i])) return;
    s.builds = 0;
    slots.settled[i] = 0;
  }

 private:
  WFPG_HD bool may_see(node_id node, const resident_field& field) const {
    if (!field.hemisphere()) return true;
    const bounds3 box = tree.bounds(node);
    const float reach = 0.5f * (glm::length(bounds.extent()) + glm::length(box.extent()));
    return glm::dot(bounds.centre() - box.centre(), field.normal) >= -reach;
  }
};

}  // namespace wfpg::detail
