// Owns the memory of kept fields. Each slot has its field's frame and fractions, its distribution, what
// its cones hit, what paths found in its cells, and what its fractions learn.
//
// Memory: 8 F^2 + 4 F + 16 bytes a slot, and 2 F^2 + 88 more where fields learn. A sample takes 16 bytes a
// cell and 8 a value.
#pragma once

#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/rank_exchange.hpp>
#include <wfpg/exec/support/running_mean.hpp>
#include <wfpg/guides/octree/field_cells.hpp>
#include <wfpg/guides/octree/field_slots.hpp>
#include <wfpg/guides/octree/guide_view.hpp>
#include <wfpg/guides/octree/learnt_fractions.hpp>
#include <wfpg/guides/octree/learnt_radiance.hpp>

#include <vector>

namespace wfpg::detail {

/// Kernel: adds the values of a sample to the means of the fields that received any. A block folds one field.
struct fold_learnt {
  std::uint32_t sample;
  std::uint32_t cells;  // of a field; all together fewer than 2^32
  value_queue_view queue;
  stochastic_mean16* means;

  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t slot) const {
    const std::size_t first = slot * cells;
    if (!queue.has_values(first, cells)) return;
    block.for_each(static_cast<int>(cells), [&](int i) {
      const std::size_t cell = first + static_cast<std::size_t>(i);
      double sum;
      const std::uint32_t n = queue.take(cell, sum);
      if (n > 0) means[cell].add(sum, n, hash32(sample, static_cast<std::uint32_t>(cell)));
    });
  }
};

/// Kernel: gives fields the fractions that they began with, and forgets what they learnt of them.
struct forget_fractions {
  field_fractions* fractions;
  resident_field* fields;
  WFPG_HD void operator()(std::size_t i) const {
    const float first = fractions[i].first;
    fractions[i] = {};
    fractions[i].first = first;
    if (fields[i].is_built()) fields[i].set_fractions(first, first);
  }
};

/// The fields of all slots, in the memory of `Exec`.
template <class Exec>
class field_pool {
 public:
  field_pool() = default;
  /// Makes `slots` fields of `resolution`² cells. They learn up to `max_values` values in a sample; 0: they
  /// do not learn. `ranks`: they learn the values of all ranks.
  field_pool(const Exec& exec, std::size_t slots, std::uint32_t resolution, std::size_t max_values,
             communicator* ranks = nullptr)
      : resolution_(resolution),
        fields_(exec, std::vector<resident_field>(slots)),
        words_(exec, slots * words_a_field()),
        hits_(exec, slots * cells_a_field()),
        learnt_(exec, max_values > 0 ? hits_.size() : 0),
        fractions_(exec, std::vector<field_fractions>(max_values > 0 ? slots : 0)),
        queue_(exec, learnt_.size() > 0 ? max_values : 0, learnt_.size(), ranks) {}

  std::uint32_t resolution() const { return resolution_; }
  std::uint32_t cells_a_field() const { return resolution_ * resolution_; }
  std::uint32_t words_a_field() const { return grid_distribution::words(resolution_); }
  /// Bytes of one slot's field.
  static std::size_t bytes_a_field(std::uint32_t resolution, bool learns) {
    const std::size_t a_cell = sizeof(cone_hit) + (learns ? sizeof(stochastic_mean16) : 0);
    return a_cell * resolution * resolution + sizeof(resident_field) +
           (learns ? sizeof(field_fractions) : 0) +
           grid_distribution::words(resolution) * sizeof(std::uint32_t);
  }

  bool learns() const { return learnt_.size() > 0; }
  resident_field* fields() const { return fields_.data(); }
  std::uint32_t* words() const { return words_.data(); }
  cone_hit* hits() const { return hits_.data(); }
  stochastic_mean16* means() const { return learnt_.data(); }       ///< null where fields do not learn
  field_fractions* fractions() const { return fractions_.data(); }  ///< null where fields do not learn

  /// All fields, with the points of a wave's products.
  resident_fields view(const product_points& points) const {
    return {fields_.data(), words_.data(), resolution_, points};
  }
  /// Where a sample's paths are recorded; empty where fields do not learn. `with_fractions`: fractions of
  /// guided directions are learnt, too.
  learnt_radiance_view learnt(bool with_fractions) const {
    if (!learns()) return {};
    return {array_view<const resident_field>(fields_.data(), fields_.size()), resolution_, queue_.view(),
            with_fractions ? fractions_.data() : nullptr};
  }
  /// Adds the recorded values of all ranks to an exchange, for learn().
  void share(rank_exchange<Exec>& all) {
    if (learns()) all.add(queue_);
  }
  /// Adds the recorded values to the means of their fields, and to the fractions of those that were used in
  /// `sample`. O(values + cells of these fields).
  void learn(const Exec& exec, array_view<field_slot> slots, std::uint32_t sample) {
    if (!learns()) return;
    exec.for_each(fields_.size(), learn_fractions{slots, sample, fractions_.data(), fields_.data()});
    queue_.sum(exec);
    exec.for_each_block(fields_.size(), 0,
                        fold_learnt{sample, cells_a_field(), queue_.view(), learnt_.data()});
    queue_.end_takes(exec);
  }
  /// Forgets all means and fractions, and values recorded since the last learn().
  void forget(const Exec& exec) {
    forget_means(exec);
    exec.for_each(fractions_.size(), forget_fractions{fractions_.data(), fields_.data()});
    if (learns()) queue_.clear(exec);
  }

  /// Bytes of all fields, without the values that a sample records.
  std::size_t bytes() const {
    return fields_.bytes() + words_.bytes() + hits_.bytes() + learnt_.bytes() + fractions_.bytes();
  }
  std::size_t value_bytes() const { return queue_.bytes(); }

 private:
  friend struct kept_state;

  void forget_means(const Exec& exec) { exec.fill_bytes(learnt_.data(), 0, learnt_.bytes()); }

  std::uint32_t resolution_ = 0;
  buffer<resident_field, Exec> fields_;      // a slot
  buffer<std::uint32_t, Exec> words_;        // a slot: its distribution
  buffer<cone_hit, Exec> hits_;              // a slot: its cells
  buffer<stochastic_mean16, Exec> learnt_;   // a slot: its cells; empty where fields do not learn
  buffer<field_fractions, Exec> fractions_;  // a slot; empty where fields do not learn
  value_queue<Exec> queue_;
};

}  // namespace wfpg::detail
