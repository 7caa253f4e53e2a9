// Collects the surfaces that a host's paths hit, for hosts that have neither triangles in hand nor rays to
// spare. The host's kernels write the hits of its first, unguided sample. fragments_from_hits() then makes
// the octree's fragments from them:
//
//   surface_collector<Exec> hits(exec, pixels * max_depth);
//   ...                                           kernels call hits.view().add(slot, position, normal)
//   const auto samples = hits.samples(exec);
//   const auto box = bounds_of_samples(exec, samples.view());
//   path_guider<Exec> guider(exec, fragments_from_hits(exec, samples.view(), resolution, box), options);
//
// Source: none.
// Cost: a call writes 28 bytes. Memory: 28 bytes a slot, and 28 a hit of samples().
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/host/geometry.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg {

/// View of the collector for kernels. Trivially copyable. A default-constructed view ignores all calls, so
/// that kernels may keep theirs when the octree is made.
class surface_collector_view {
 public:
  /// A view that ignores all calls.
  surface_collector_view() = default;
  /// A view of a collector's slots and its counter, in the policy's memory.
  WFPG_HD surface_collector_view(array_view<surface_fragment> slots, std::uint32_t* dropped)
      : slots_(slots), dropped_(dropped) {}

  /// Number of slots.
  WFPG_HD std::size_t capacity() const { return slots_.size(); }
  /// Writes a hit into a slot, such as path + depth * paths. A later call for the slot replaces an earlier
  /// one. `position` is in world space; `normal` has unit length, and may point to either side. A slot from
  /// capacity() on is dropped and counted. Values that are not finite stay, and fragments_from_hits()
  /// counts them.
  ///
  /// Precondition: one thread at a time writes a slot.
  WFPG_HD void add(std::size_t slot, vec3 position, vec3 normal) const {
    if (slots_.empty()) return;
    if (slot < slots_.size())
      slots_[slot] = {position, normal, 1.0f};
    else
      atomic_add(dropped_, 1);
  }

 private:
  array_view<surface_fragment> slots_;
  std::uint32_t* dropped_ = nullptr;
};

/// Owns slots for hits in the policy's memory. Movable, not copyable.
template <class Exec>
class surface_collector {
 public:
  /// Allocates `capacity` empty slots; 0 makes a view that ignores all calls. Throws out_of_memory.
  surface_collector(const Exec& exec, std::size_t capacity);

  /// View for kernels, valid while the collector lives.
  surface_collector_view view() const { return {slots_.view(), dropped_.data()}; }
  /// Number of slots.
  std::size_t capacity() const { return slots_.size(); }
  /// Number of calls whose slot was beyond the capacity, modulo 2³². Waits for the work before it.
  std::uint32_t dropped(const Exec& exec) const { return read_element(exec, dropped_.data()); }
  /// Returns the hits, in the order of their slots, without empty slots. Waits for the work before it.
  /// O(capacity). Throws out_of_memory.
  buffer<surface_fragment, Exec> samples(const Exec& exec) const;

 private:
  buffer<surface_fragment, Exec> slots_;  // of area 0 where empty
  buffer<std::uint32_t, Exec> dropped_;   // a single counter
};

/// Returns the box around most samples, for fragments_from_hits(). It leaves out what is far away, so that
/// an instance on the horizon does not make all other voxels too large.
///
/// On each axis a part `outliers` of the samples is set aside at either end. The box around the others grows
/// by its longest side in all directions. The result is the box around all samples in it. Samples outside
/// the result are dropped by fragments_from_hits(), and counted as `out_of_range`.
///
/// `outliers`: in [0, 0.5); with 0 the box holds all samples. Positions that are not valid are left out.
/// Without a valid one the result is empty. O(samples · log samples) time, 4 bytes a sample. Throws
/// std::invalid_argument for outliers out of range, and out_of_memory.
template <class Exec>
bounds3 bounds_of_samples(const Exec& exec, array_view<const surface_fragment> samples,
                          float outliers = 0.01f);

}  // namespace wfpg

#include <wfpg/octree/detail/surface_collector_impl.hpp>
