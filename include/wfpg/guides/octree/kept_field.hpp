// Builds one kept field: chooses which of its cells are cast, stores what they hit, and makes the
// distribution. field_store.hpp launches these kernels.
//
// Refreshes aim some of their cones at bright nodes, such as small lamps (detail/aimed_cones.hpp).
//
// Source: fields are those of Yalciner and Akyuz (2024), section 3.3. Partial refreshes, learning and aimed
// cones are wfpg's own.
//
// Cost: F^2 cones for a new field and about F^2/R for a refresh; O(F^2) for either. Memory: none of its own.
#pragma once

#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/exec/support/running_mean.hpp>
#include <wfpg/guide/statistics.hpp>
#include <wfpg/guides/octree/detail/aimed_cones.hpp>
#include <wfpg/guides/octree/detail/shared_origins.hpp>
#include <wfpg/guides/octree/field_cells.hpp>
#include <wfpg/guides/octree/field_slots.hpp>
#include <wfpg/guides/octree/guide_view.hpp>
#include <wfpg/guides/octree/learnt_fractions.hpp>

namespace wfpg {

/// Number of cones that a refresh casts: F² / R, rounded up. Precondition: resolution and recast are at least
/// 1.
WFPG_HD constexpr std::uint32_t refresh_cones(std::uint32_t resolution, std::uint32_t recast) {
  return (resolution * resolution - 1) / recast + 1;
}

/// Returns the row-major index of the cell that a refresh's cone looks through. Each run of `recast` cells
/// has one cone, and casts another cell in each refresh. After `recast` refreshes every cell has been cast.
///
/// From run to run the cell shifts by about the golden ratio of `recast`. The shift is odd where `recast` is
/// even. After each `recast` runs it shifts by one more, since rows may begin alike. So rows and columns are
/// covered evenly.
///
/// `cone`: in [0, refresh_cones()). `refresh`: any number, such as the field's builds. The last run may be
/// shorter than the others.
WFPG_HD constexpr std::uint32_t refreshed_cell(std::uint32_t cone, std::uint32_t refresh,
                                               std::uint32_t resolution, std::uint32_t recast) {
  const std::uint32_t begin = cone * recast;
  const std::uint32_t length = min(recast, resolution * resolution - begin);
  const std::uint32_t shift = (5 * recast + 4) / 8 | (recast % 2 == 0 ? 1u : 0u);
  return begin + (refresh + shift * (cone % recast) + cone / recast) % length;
}

/// Memory of all kept fields, as the kernels that build them see it. Trivially copyable.
struct kept_fields_view {
  field_slots_view slots;               ///< state of each slot
  resident_field* fields;               ///< a slot: normal and fractions
  std::uint32_t* words;                 ///< a slot: its distribution
  cone_hit* hits;                       ///< a slot: F² hits in row-major order
  stochastic_mean16* learnt;            ///< a slot: F² means of what paths found; null: fields do not learn
  field_fractions* fractions;           ///< a slot: what its fractions learn; null: fields do not learn
  float cone_samples;                   ///< samples that a cone counts as, beside learnt values; positive
  std::uint32_t resolution;             ///< F: cells along a side
  std::uint32_t recast;                 ///< R: a refresh casts one of R cells
  std::uint32_t sample;                 ///< current sample, from 1
  std::uint64_t* refreshed;             ///< counter of refreshes: builds that cast a part of the cells
  detail::shared_origins origins = {};  ///< where builds start, with ranks
  detail::bright_nodes_view bright = {};  ///< that refreshes aim cones at
};

/// Builds the fields of slots for a wave's rays. `Wave`: kept_field_wave.
template <class Wave>
struct kept_field_builder {
  Wave wave;              ///< rays, cache and options of the wave
  kept_fields_view kept;  ///< where fields are written

  /// Cones of one build: F² for a whole field, refresh_cones() for a refresh.
  WFPG_HD std::uint32_t cone_count(bool whole) const {
    return whole ? kept.resolution * kept.resolution : refresh_cones(kept.resolution, kept.recast);
  }
  /// Returns the cell that cone number `cone` of a build looks through. Whole fields go through all cells in
  /// tiles; refreshes go through refreshed_cell().
  WFPG_HD field_cell cell(std::uint32_t slot, bool whole, std::uint32_t cone) const {
    if (whole) return cell_in_order(cone, kept.resolution);
    return cell_at(refreshed_cell(cone, kept.slots.slots[slot].builds, kept.resolution, kept.recast),
                   kept.resolution);
  }

  /// Returns cone number `number` of a build: that of cell(), or one that is aimed at a bright node.
  ///
  /// A run of cells that has bright nodes has an aimed cone in every second refresh, at each node in turn.
  /// The other refreshes go on through its cells, at half the pace. Other runs are as if there were no such
  /// nodes. `aimed`: of this build. O(listed nodes).
  WFPG_HD detail::aimed_cone cone(std::uint32_t slot, bool whole, std::uint32_t number,
                                  const detail::aimed_cells& aimed) const {
    return aimed.empty() ? detail::aimed_cone{cell(slot, whole, number)} : cone_of_run(slot, number, aimed);
  }
  /// Stores what a cone found in the cell that it looked through. A cone that hit its bright node counts as
  /// paths that found light, too. `found`: what aimed_cells::find() returned.
  ///
  /// A refresh has at most one cone in each cell, so that threads write to different cells. O(listed nodes)
  /// for such a cone, and O(1) for others.
  WFPG_HD void store(std::uint32_t slot, const field_cells& cells, const detail::aimed_cells& aimed,
                     const detail::aimed_cone& cone, cone_hit found) const {
    const std::size_t cell =
        std::size_t(slot) * kept.resolution * kept.resolution + cone.cell.index(kept.resolution);
    kept.hits[cell] = found.unmarked();
    // A whole field has no aimed cones: its means are forgotten after this.
    if (found.is_marked() && kept.learnt) learn(cell, cells, aimed, cone);
  }

  /// Returns where the cones of a build start. They start at the surface of the ray that the wave picked for
  /// the slot. A refresh keeps the normal of the first build, since the stored cells lie in its frame.
  /// Precondition: the slot's origin is a ray of the wave, or kept.origins has it.
  WFPG_HD field_cells cells(std::uint32_t slot, bool whole) const {
    const field_slot& state = kept.slots.slots[slot];
    field_origin origin = kept.origins.empty()
                              ? origin_of(static_cast<std::uint32_t>(state.origin), state.key)
                              : kept.origins.get(slot, seed_of(state.key));
    if (!whole) origin.normal = kept.fields[slot].normal;
    return {origin, kept.resolution};
  }

  /// Returns where a field of a key starts, if it starts at the surface of a ray of the wave. With ranks, the
  /// one that has the ray tells it to the others. Another rank has no such ray, or another one of that
  /// number. O(1).
  WFPG_HD field_origin origin_of(std::uint32_t ray, std::uint32_t key) const {
    return origin_at(wave.surfaces(ray), wave.cache.octree(), wave.mode, key % orientations, seed_of(key));
  }

  /// Makes the distribution from all F² cells. A cell's value mixes two sources: the radiance that the cache
  /// has at its hit, and what paths found there. A whole build first forgets what paths found: the field is
  /// new, or geometry moved.
  ///
  /// Writes the slot's state, and adds to the wave's statistics. All threads of the block call it, after the
  /// hits are written.
  template <class Block>
  WFPG_HD void finish(Block& block, std::uint32_t slot, const field_cells& cells, bool whole) const {
    const auto size = static_cast<int>(kept.resolution);
    // Cells that this build did not cast read the cache of today through older hits.
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
      // A field that begins anew has learnt nothing of its fractions, either.
      if (whole || !wave.learns_fraction)
        kept.fields[slot] = {hemisphere ? cells.origin.normal : vec3(0.0f), wave.fraction};
      if (whole && kept.fractions) begin(kept.fractions[slot]);
      field_slot& state = kept.slots.slots[slot];
      state.last_built = kept.sample;
      ++state.builds;
      state.origin = field_slot::unpicked;
      kept.slots.noted[slot] = 1;
      count(whole);
    });
  }

 private:
  // Seed of the jitter of a field's cones: it differs between samples, depths and fields, and not between
  // ranks.
  WFPG_HD std::uint32_t seed_of(std::uint32_t key) const {
    return static_cast<std::uint32_t>(hash(wave.seed, key));
  }
  // A cone of a refresh where bright nodes are listed: cone(). It is a function of its own, so that builds
  // without bright nodes stay as short as they were.
  WFPG_HD detail::aimed_cone cone_of_run(std::uint32_t slot, std::uint32_t number,
                                         const detail::aimed_cells& aimed) const {
    const std::uint32_t begin = number * kept.recast, end = begin + kept.recast;
    const std::uint32_t n = aimed.count(begin, end);
    if (n == 0) return {cell(slot, false, number)};
    const std::uint32_t builds = kept.slots.slots[slot].builds;
    if ((builds + number) % 2 == 0) return aimed.at(builds / 2 % n, begin, end, kept.resolution);
    return {cell_at(refreshed_cell(number, builds / 2, kept.resolution, kept.recast), kept.resolution)};
  }
  // Adds what a cone at a bright node found to the mean of a cell of the pool. Its radiance is the larger of
  // the cell's mean in the cache, and of the root of the mean square that the bright nodes make.
  WFPG_HD void learn(std::size_t cell, const field_cells& cells, const detail::aimed_cells& aimed,
                     const detail::aimed_cone& cone) const {
    const float radiance =
        max(kept.hits[cell].radiance(wave.cache), aimed.guiding_radiance(wave.cache, cells, cone));
    kept.learnt[cell].add(double(radiance) * detail::aimed_cells::paths, detail::aimed_cells::paths,
                          hash32(cells.origin.seed, static_cast<std::uint32_t>(cell)));
  }
  /// Radiance of one cell of the pool, `cell` = slot * F² + row-major index. The cone counts as
  /// `cone_samples` values beside the learnt ones.
  WFPG_HD float radiance_of(std::size_t cell, bool whole) const {
    const float seen = kept.hits[cell].radiance(wave.cache);
    if (!kept.learnt) return seen;
    if (whole) kept.learnt[cell] = {};
    return mixed_with(kept.learnt[cell], seen, kept.cone_samples);
  }

  // Fractions of a field that begins: those of the wave's options.
  WFPG_HD void begin(field_fractions& fractions) const {
    fractions = {};
    fractions.first = wave.fraction;
  }

  // Counts one build. One thread of the block calls it.
  WFPG_HD void count(bool whole) const {
    if (!whole) atomic_add(kept.refreshed, std::uint64_t(1));
    if (!wave.statistics) return;
    atomic_add(&wave.statistics->bins, std::uint64_t(1));
    atomic_add(&wave.statistics->cones, std::uint64_t(cone_count(whole)));
  }
};

/// Bytes of scratch memory that a block of `warps` warps needs to build a kept field.
inline std::size_t kept_scratch_bytes(std::uint32_t resolution, int warps) {
  return field_scratch_bytes(resolution, warps) + detail::aimed_cells::scratch_bytes;
}

/// Kernel: casts the cones of listed slots, and finishes their fields. One block builds one slot.
///   Builder  kept_field_builder
///   Hits     (std::size_t i, std::uint32_t cone, const ray&, float solid_angle) -> ray_hit
///
/// Hits of other cells stay from earlier builds.
template <class Builder, class Hits>
struct build_kept_fields {
  Builder builder;            ///< where cones start, and where fields are written
  Hits hits;                  ///< inline_hits or stored_hits
  const std::uint32_t* list;  ///< slots to build
  bool whole;                 ///< casts all cells; false: those of a refresh

  /// Builds the field of slot list[i]. F² or F²/R cones, then O(F²).
  template <class Block>
  WFPG_HD WFPG_FLATTEN void operator()(Block& block, std::size_t i) const {
    const std::uint32_t slot = list[i];
    const field_cells cells = builder.cells(slot, whole);
    const detail::aimed_cells aimed(block, builder.kept.bright, cells, !whole);
    const float solid_angle = cells.domain.cell_solid_angle();
    block.for_each(static_cast<int>(builder.cone_count(whole)), [&](int c) {
      const auto number = static_cast<std::uint32_t>(c);
      const detail::aimed_cone cone = builder.cone(slot, whole, number, aimed);
      const ray r = aimed.path(cells, cone);
      const ray_hit hit = hits(i, number, r, solid_angle);
      builder.store(slot, cells, aimed, cone, aimed.find(builder.wave.cache, cells, cone, r, hit));
    });
    block.sync();
    builder.finish(block, slot, cells, whole);
  }
};

/// Kernel: builds the slots of both lists in one launch, whole fields first. `Build`: build_kept_fields.
template <class Build>
struct build_listed_fields {
  /// Builds the slots of which all cells are cast.
  Build whole, part;                ///< builds the slots that are refreshed
  const field_wave_counts* counts;  ///< lengths of both lists, on the device

  /// Builds entry `i` of the two lists, one after the other. Precondition: i < counts->builds.
  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    const std::uint32_t wholes = counts->all;
    if (i < wholes)
      whole(block, i);
    else
      part(block, i - wholes);
  }
};

/// Kernel: writes the cones of listed slots, for a batch caster. One block writes those of one slot.
template <class Builder>
struct write_kept_cones {
  Builder builder;            ///< where cones start
  array_view<ray> cones;      ///< slot by slot, Builder::cone_count() each
  const std::uint32_t* list;  ///< a slot a block
  /// Which cones are written: all F², or one of R.
  bool whole;

  /// Writes the cones of slot list[i], in the order in which build_kept_fields reads their hits.
  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    const field_cells cells = builder.cells(list[i], whole);
    const detail::aimed_cells aimed(block, builder.kept.bright, cells, !whole);
    const std::uint32_t n = builder.cone_count(whole);
    block.for_each(static_cast<int>(n), [&](int c) {
      const auto number = static_cast<std::uint32_t>(c);
      cones[i * n + number] = aimed.path(cells, builder.cone(list[i], whole, number, aimed));
    });
  }
};

/// Kernel: marks the fields that may see `bounds`, so that all their cones are cast when they are next used.
/// These are all fields over spheres. Of those over hemispheres they are the fields above whose horizon a
/// part of the bounding sphere may lie.
///
/// The test holds from anywhere in the field's node, so no field is missed. Occlusion is ignored.
struct invalidate_fields {
  field_slots_view slots;         ///< slots to mark
  const resident_field* fields;   ///< normal of each slot's field
  sparse_voxel_octree_view tree;  ///< places of the fields' nodes
  bounds3 bounds;                 ///< world space: where geometry moved

  /// Tests slot `i`. O(1); free slots stay as they are.
  WFPG_HD void operator()(std::size_t i) const {
    field_slot& s = slots.slots[i];
    if (s.key == no_key || !may_see(s.key / orientations, fields[i])) return;
    s.builds = 0;
    slots.noted[i] = 0;
  }

 private:
  // `reach` is the sum of both bounding spheres' radii: the normal's plane may lie this far below the
  // centres.
  WFPG_HD bool may_see(node_id node, const resident_field& field) const {
    if (!field.hemisphere()) return true;
    const bounds3 box = tree.bounds(node);
    const float reach = 0.5f * (glm::length(bounds.extent()) + glm::length(box.extent()));
    return glm::dot(bounds.centre() - box.centre(), field.normal) >= -reach;
  }
};

}  // namespace wfpg
