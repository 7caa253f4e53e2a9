// Exchanges kept fields between ranks, so that all of them have equal ones: keys that want a slot, the ray
// that each build starts from, which slots were used, and what fractions of guided directions learnt.
//
// A build starts from the surface of a ray, which one rank knows. It sends position and normal.
//
// Cost: a wave that builds waits for the host once. Traffic of such a wave: up to 16 KiB of keys, 8 bytes a
// slot, 28 a build, and 4 a cone. Of a sample: 4 bytes a slot, and 56 a slot where paths are recorded.
// Memory: 88 bytes a slot, and 4 for each cone of a wave.
#pragma once

#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/rank_exchange.hpp>
#include <wfpg/guides/octree/detail/slot_table.hpp>
#include <wfpg/guides/octree/kept_field.hpp>
#include <wfpg/ranks/communicator.hpp>

namespace wfpg::detail {

/// Kernel: turns the least key of a bucket into the largest number, and back.
struct invert_wanted {
  std::uint32_t* buckets;
  field_wave_counts* counts;  // null: notes nothing

  WFPG_HD void operator()(std::size_t i) const {
    buckets[i] = ~buckets[i];
    // Keys that other ranks miss are allocated here, too.
    if (counts && buckets[i] != no_key) atomic_store(&counts->missing, 1u);
  }
};

/// Kernel: the origin of a slot's build as a number of which the largest wins; or back.
struct exchange_origin {
  array_view<field_slot> slots;
  std::uint64_t* inverted;
  bool back;
  WFPG_HD void operator()(std::size_t i) const {
    if (back)
      slots[i].origin = ~inverted[i];
    else
      inverted[i] = ~slots[i].origin;
  }
};

/// Kernel: numbers the slots of both lists of builds, and clears their origins.
struct number_builds {
  const std::uint32_t* list;
  std::size_t slots;
  std::uint32_t wholes;
  shared_origins origins;
  WFPG_HD void operator()(std::size_t i) const {
    origins.place_of_slot[list[i < wholes ? i : slots + (i - wholes)]] = static_cast<std::uint32_t>(i);
    for (std::uint32_t k = 0; k < packed_origin::words; ++k)
      origins.of_builds[i * packed_origin::words + k] = 0;
  }
};

/// Kernel: writes the origins of the builds that start from this rank's rays. `Builder`: kept_field_builder.
template <class Builder, class Rays>
struct write_origins {
  Builder builder;
  Rays rays;
  const std::uint32_t* field_of_ray;
  WFPG_HD void operator()(std::size_t i) const {
    const std::uint32_t slot = field_of_ray[i];
    if (slot == no_slot) return;
    const field_slot& state = builder.kept.slots.slots[slot];
    if (state.origin == field_slot::unpicked) return;
    if (static_cast<std::uint32_t>(state.origin) != rays.number(i)) return;
    builder.kept.origins.put(slot, builder.origin_of(static_cast<std::uint32_t>(i), state.key));
  }
};

/// Kernel: the last use of each slot, to or from an array.
struct exchange_use {
  array_view<field_slot> slots;
  std::uint32_t* last_used;
  bool back;
  WFPG_HD void operator()(std::size_t i) const {
    (back ? slots[i].last_used : last_used[i]) = back ? last_used[i] : slots[i].last_used;
  }
};

/// Kernel: sums that a slot's fractions learn from, to or from arrays. Those of slots that no rank used are
/// not written back: they may be anything.
struct exchange_fractions {
  array_view<const field_slot> slots;
  std::uint32_t sample;
  field_fractions* fractions;
  std::uint64_t* sums;     // 6 a slot
  std::uint32_t* largest;  // 2 a slot
  bool back;

  WFPG_HD void operator()(std::size_t i) const {
    if (back && slots[i].last_used != sample) return;
    for (std::uint32_t kind = 0; kind < 2; ++kind) {
      fraction_sums& of_slot = fractions[i].sums[kind];
      std::uint64_t* const to = sums + 6 * i + 3 * kind;
      std::uint32_t& most = largest[2 * i + kind];
      if (!back) {
        to[0] = of_slot.light;
        to[1] = of_slot.guided;
        to[2] = of_slot.count;
        most = of_slot.largest;
      } else {
        of_slot.light = to[0];
        of_slot.guided = to[1];
        of_slot.count = static_cast<std::uint32_t>(to[2]);
        of_slot.largest = most;
      }
    }
  }
};

/// Exchanges what belongs to kept fields. Without ranks it has no memory, and may not be called.
template <class Exec>
class field_ranks {
 public:
  field_ranks() = default;
  field_ranks(const Exec& exec, std::size_t slots, bool learns, communicator* ranks)
      : ranks_(ranks),
        words_(exec, ranks ? slots : 0),
        origins_(exec, ranks ? packed_origin::words * slots : 0),
        sums_(exec, ranks && learns ? 6 * slots : 0),
        largest_(exec, ranks && learns ? 2 * slots : 0) {}

  explicit operator bool() const { return ranks_ != nullptr; }
  communicator& ranks() const { return *ranks_; }
  std::size_t bytes() const {
    return words_.bytes() + origins_.bytes() + sums_.bytes() + largest_.bytes() + hits_.bytes();
  }

  /// Where the builds of a wave start; without ranks at a ray of this rank's wave.
  shared_origins origins() const {
    return ranks_ ? shared_origins{words_.data(), origins_.data()} : shared_origins{};
  }

  /// Makes each bucket's key the least that any rank wants.
  void share_wanted(const Exec& exec, const array_view<std::uint32_t>& buckets, field_wave_counts* counts) {
    exec.for_each(buckets.size(), invert_wanted{buckets.data(), nullptr});
    ranks_->all_reduce_max(buckets);
    exec.for_each(buckets.size(), invert_wanted{buckets.data(), counts});
  }
  /// Makes each slot's origin the least that any rank has. `scratch`: an element a slot.
  void share_origins(const Exec& exec, array_view<field_slot> slots, array_view<std::uint64_t> scratch) {
    exec.for_each(slots.size(), exchange_origin{slots, scratch.data(), false});
    ranks_->all_reduce_max(scratch);
    exec.for_each(slots.size(), exchange_origin{slots, scratch.data(), true});
  }
  /// Tells all ranks where the listed builds start. `list`: those of whole fields, and others from entry
  /// `slots` on. Waits for the number of builds.
  template <class Builder, class Rays>
  void send_origins(const Exec& exec, const Builder& builder, const Rays& rays, std::size_t n,
                    const std::uint32_t* field_of_ray, const std::uint32_t* list,
                    const field_wave_counts* counts) {
    wave_ = read_element(exec, counts);
    if (wave_.builds == 0) return;
    exec.for_each(wave_.builds, number_builds{list, words_.size(), wave_.all, origins()});
    exec.for_each(n, write_origins<Builder, Rays>{builder, rays, field_of_ray});
    ranks_->all_reduce_sum(origins_.view().subview(0, std::size_t(wave_.builds) * packed_origin::words));
  }

  /// Number of builds of the wave whose origins were sent: of whole fields, or of others.
  std::size_t builds(bool whole) const { return whole ? wave_.all : wave_.part; }
  /// The first build of a list whose cones this rank casts. The next rank's first one is the end.
  std::size_t first_build(bool whole, std::uint32_t ranks_before) const {
    return builds(whole) * ranks_before / ranks_->size();
  }
  /// Room for what all cones of the wave hit, which is 0 bytes.
  array_view<cone_hit> begin_hits(const Exec& exec, std::size_t cones) {
    const array_view<cone_hit> hits = hits_.fit(exec, cones, cones / 2);
    exec.fill_bytes(hits.data(), 0, cones * sizeof(cone_hit));
    return hits;
  }
  /// Tells all ranks what the cones hit. Each cone is one rank's.
  void share_hits(array_view<cone_hit> hits) {
    static_assert(sizeof(cone_hit) == sizeof(std::uint32_t), "hits are summed as words");
    ranks_->all_reduce_sum({reinterpret_cast<std::uint32_t*>(hits.data()), hits.size()});
  }

  /// Adds the slots that rays used to an exchange, which notes those of all ranks.
  void share_use(const Exec& exec, rank_exchange<Exec>& all, array_view<field_slot> slots) {
    exec.for_each(slots.size(), exchange_use{slots, words_.data(), false});
    all.add(reduction::max(words_.view()), [this, exec, slots] {
      exec.for_each(slots.size(), exchange_use{slots, words_.data(), true});
    });
  }
  /// Adds what fractions learn from in a sample. Call share_use() before, so that results are taken by the
  /// slots that any rank used.
  void share_fractions(const Exec& exec, rank_exchange<Exec>& all, array_view<field_slot> slots,
                       std::uint32_t sample, field_fractions* fractions) {
    if (sums_.size() == 0) return;
    exchange_fractions exchange{slots, sample, fractions, sums_.data(), largest_.data(), false};
    exec.for_each(slots.size(), exchange);
    exchange.back = true;
    all.add(reduction::sum(sums_.view()), [] {});
    all.add(reduction::max(largest_.view()),
            [exec, slots, exchange] { exec.for_each(slots.size(), exchange); });
  }

 private:
  communicator* ranks_ = nullptr;
  buffer<std::uint32_t, Exec> words_;    // a slot: its place among the builds, or its last use
  buffer<std::uint32_t, Exec> origins_;  // a build: packed_origin::words
  buffer<std::uint64_t, Exec> sums_;     // a slot: exchange_fractions
  buffer<std::uint32_t, Exec> largest_;  // likewise
  buffer<cone_hit, Exec> hits_;          // of a wave's cones, whole fields first
  field_wave_counts wave_;               // of the wave whose origins were sent
};

}  // namespace wfpg::detail
