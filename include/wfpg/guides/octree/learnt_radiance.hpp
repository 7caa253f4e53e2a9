// What paths found along the directions of kept fields, cell by cell: running means beside what the cells'
// cones see in the cache. A path tells what cones cannot: light that depends on the direction it leaves a
// surface in, what a mirror shows, an emitter smaller than a voxel. That fields learn is wfpg's own; that
// they are means of radiance by direction is as in Mueller et al., "Practical Path Guiding" (2017).
//
// Memory: 2 bytes a cell; in a sample 16 a cell and 8 a value.
#pragma once

#include <wfpg/exec/support/running_mean.hpp>
#include <wfpg/exec/support/value_queue.hpp>
#include <wfpg/guides/octree/detail/field_slots.hpp>
#include <wfpg/guides/octree/guide_view.hpp>

namespace wfpg {

/// Where kernels tell kept fields what their directions found. Trivially copyable; an empty one learns
/// nothing.
class learnt_radiance_view {
 public:
  learnt_radiance_view() = default;
  /// Of fields of `resolution`² cells.
  WFPG_HD learnt_radiance_view(array_view<const resident_field> fields, std::uint32_t resolution,
                               const detail::value_queue_view& queue)
      : fields_(fields), resolution_(resolution), queue_(queue) {}

  /// Whether nothing is learnt.
  WFPG_HD bool empty() const { return resolution_ == 0; }

  /// Radiance (luminance, W/(m² sr)) that arrives along a unit direction where `field` was drawn from or
  /// asked: sampled_direction::field, of this sample. Seen by fields that are built after the sample. What is
  /// negative or not finite, of no field, outside of it, or does not fit the queue is dropped.
  WFPG_HD void deposit(std::uint32_t field, vec3 direction, float radiance) const {
    const std::uint32_t entry = reserve(1);
    write(entry, field, direction, radiance);
    count(entry);
  }

  /// The same for several of one thread, as of exitance_cache_view.
  WFPG_HD std::uint32_t reserve(std::uint32_t n) const { return queue_.reserve(n); }
  /// Writes an entry of reserve(), as deposit() does.
  WFPG_HD void write(std::uint32_t entry, std::uint32_t field, vec3 direction, float radiance) const {
    if (!queue_.fits(entry)) return;
    std::uint32_t cell;
    if (radiance >= 0.0f && is_finite(radiance) && is_finite(direction) && find(field, direction, cell))
      queue_.write(entry, cell, min(radiance, 1.0e30f));
    else
      queue_.drop(entry);
  }
  /// Counts an entry that is written.
  WFPG_HD void count(std::uint32_t entry) const { queue_.count(entry); }

 private:
  /// The cell, among those of all fields.
  WFPG_HD bool find(std::uint32_t field, vec3 direction, std::uint32_t& cell) const {
    if (field >= fields_.size()) return false;
    const grid_distribution grid(nullptr, resolution_);
    const vec3 normal = fields_[field].normal;
    vec2 uv;
    if (!(fields_[field].hemisphere() ? directional_field(grid, normal) : directional_field(grid))
             .locate(direction, uv))
      return false;
    cell = (field * resolution_ + grid.cell_along(uv.y)) * resolution_ + grid.cell_along(uv.x);
    return true;
  }

  array_view<const resident_field> fields_;
  std::uint32_t resolution_ = 0;
  detail::value_queue_view queue_;
};

namespace detail {

/// Adds what the cells of the fields in use have received to their means; a field a block.
struct fold_learnt {
  array_view<field_slot> slots;
  std::uint32_t sample;
  std::uint32_t cells;  // of a field; all together fewer than 2³²
  value_queue_view queue;
  rough_mean* means;

  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t slot) const {
    if (slots[slot].last_used != sample) return;
    const std::size_t first = slot * cells;
    block.for_each(static_cast<int>(cells), [&](int i) {
      const std::size_t cell = first + static_cast<std::size_t>(i);
      double sum;
      const std::uint32_t n = queue.take(cell, sum);
      if (n > 0) means[cell].add(sum, n, hash32(sample, static_cast<std::uint32_t>(cell)));
    });
  }
};

}  // namespace detail
}  // namespace wfpg
