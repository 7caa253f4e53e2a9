// Learns what paths found along the directions of kept fields, cell by cell. Running means are kept beside
// what the cells' cones see in the cache. A path finds what cones cannot: light that depends on the outgoing
// direction, what a mirror shows, an emitter smaller than a voxel.
//
// Source: means of radiance by direction are those of Mueller et al., "Practical Path Guiding" (2017). That
// these fields learn is wfpg's own.
//
// Cost: O(1) a deposit. Memory: 2 bytes a cell and 88 a field; in a sample 16 a cell and 8 a value.
#pragma once

#include <wfpg/exec/support/running_mean.hpp>
#include <wfpg/exec/support/value_queue.hpp>
#include <wfpg/guides/octree/guide_view.hpp>
#include <wfpg/guides/octree/learnt_fractions.hpp>

namespace wfpg {

/// Records radiance that directions found, for kept fields to learn. Trivially copyable. An empty view drops
/// everything. Any number of threads may call it at once; results do not depend on their order.
class learnt_radiance_view {
 public:
  /// An empty view.
  learnt_radiance_view() = default;
  /// View of fields of `resolution`² cells. `fields`: one entry a slot. `queue`: its keys are the cells of
  /// all slots. `fractions`: one entry a slot; null: fractions are not learnt.
  WFPG_HD learnt_radiance_view(array_view<const resident_field> fields, std::uint32_t resolution,
                               const detail::value_queue_view& queue, field_fractions* fractions = nullptr)
      : fields_(fields), resolution_(resolution), queue_(queue), fractions_(fractions) {}

  /// Whether it has no fields to record for.
  WFPG_HD bool empty() const { return resolution_ == 0; }

  /// Queues radiance (luminance, W/(m² sr)) that arrives along a unit direction. `field`:
  /// sampled_direction::field of this sample, where the direction was sampled or evaluated. Fields that are
  /// built after the sample use it.
  ///
  /// Radiance that is 2⁴³ times darker than what the field's other cells received in a sample counts as 0.
  ///
  /// Drops radiance that is negative or not finite, unknown fields, and directions outside a field's
  /// hemisphere. Drops what exceeds the queue's capacity. Radiance is clamped to 1e30.
  WFPG_HD void deposit(std::uint32_t field, vec3 direction, float radiance) const {
    write(reserve(1), field, direction, radiance);
  }

  /// Reserves `n` entries in a row and returns the first, for a thread with several values. Each entry must
  /// be written. An entry may lie beyond the capacity: write() then does nothing.
  WFPG_HD std::uint32_t reserve(std::uint32_t n) const { return queue_.reserve(n); }
  /// Writes one reserved entry: `radiance` that arrives along `direction`. Values that deposit() drops become
  /// empty entries.
  WFPG_HD void write(std::uint32_t entry, std::uint32_t field, vec3 direction, float radiance) const {
    if (!queue_.fits(entry)) return;
    std::uint32_t cell;
    if (radiance >= 0.0f && is_finite(radiance) && is_finite(direction) && find(field, direction, cell))
      queue_.write(entry, cell, min(radiance, 1.0e30f));
    else
      queue_.drop(entry);
  }
  /// Whether fields learn their fractions of guided directions.
  WFPG_HD bool learns_fractions() const { return fractions_ != nullptr; }
  /// Adds what a direction of `field` brought, over its density: luminance, BSDF and cosine included.
  /// `share`: that of the guide in the density. Drops unknown fields and shares, and what is negative or not
  /// finite. Precondition: learns_fractions().
  WFPG_HD void weigh(std::uint32_t field, float brought, guide_share share) const {
    if (field < fields_.size()) fractions_[field].add(brought, share);
  }

 private:
  /// Finds the cell of a direction, numbered over all fields: field * F² + row-major index. False outside the
  /// field.
  WFPG_HD bool find(std::uint32_t field, vec3 direction, std::uint32_t& cell) const {
    if (field >= fields_.size()) return false;
    const grid_distribution grid(nullptr, resolution_);
    const vec3 normal = fields_[field].normal;
    vec2 uv;
    if (!(fields_[field].hemisphere() ? directional_field(grid, normal) : directional_field(grid))
             .locate(direction, uv))
      return false;
    cell = field * resolution_ * resolution_ + grid.cell_of(uv);
    return true;
  }

  array_view<const resident_field> fields_;
  std::uint32_t resolution_ = 0;
  detail::value_queue_view queue_;
  field_fractions* fractions_ = nullptr;
};

}  // namespace wfpg
