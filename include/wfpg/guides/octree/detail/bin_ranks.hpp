// Exchanges a wave's bins between ranks, so that a bin's rays of all ranks sample equal fields: how many rays
// a bin has on all ranks, and where its field starts. A bin's field starts from the ray of all ranks that has
// the least random number. Each rank makes the fields of the bins in which it has rays.
//
// Cost: a wave waits for the host twice. Traffic: 48 bytes for each bin of each rank. Memory: 20 bytes a ray,
// and 48 for each bin of all ranks.
#pragma once

#include <wfpg/bins/spatial_binner.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/guides/octree/detail/shared_origins.hpp>
#include <wfpg/ranks/communicator.hpp>

#include <vector>

namespace wfpg::detail {

/// The bins that ranks have told each other of, each rank's in ascending order of keys. Trivially copyable.
struct told_bins {
  static constexpr std::uint32_t words = 6;  // of 8 bytes, a bin

  const std::uint64_t* entries = nullptr;
  const std::uint32_t* begins = nullptr;  // a rank: its first entry; then the number of entries
  std::uint32_t ranks = 0;

  WFPG_HD std::uint32_t key(std::size_t i) const { return static_cast<std::uint32_t>(entries[words * i]); }
  WFPG_HD std::uint32_t size(std::size_t i) const {
    return static_cast<std::uint32_t>(entries[words * i] >> 32);
  }
  WFPG_HD std::uint64_t candidate(std::size_t i) const { return entries[words * i + 1]; }
  // Finds a rank's entry of a key. False where it has none. O(log bins).
  WFPG_HD bool find(std::uint32_t rank, std::uint32_t wanted, std::uint32_t& entry) const {
    std::uint32_t low = begins[rank], high = begins[rank + 1];
    while (low < high) {
      const std::uint32_t middle = low + (high - low) / 2;
      if (key(middle) < wanted)
        low = middle + 1;
      else
        high = middle;
    }
    entry = low;
    return low < begins[rank + 1] && key(low) == wanted;
  }

  // Writes an entry: two words of the origin share one of 8 bytes.
  WFPG_HD static void put(std::uint64_t* to, std::uint32_t key, std::uint32_t size, std::uint64_t candidate,
                          const field_origin& from) {
    to[0] = std::uint64_t(size) << 32 | key;
    to[1] = candidate;
    std::uint32_t packed[2 * (words - 2)] = {};
    packed_origin::put(packed, from);
    for (std::uint32_t i = 2; i < words; ++i)
      to[i] = std::uint64_t(packed[2 * i - 3]) << 32 | packed[2 * i - 4];
  }
  // Origin in an entry, with a seed for the cones.
  WFPG_HD field_origin origin(std::size_t i, std::uint32_t seed) const {
    const std::uint64_t* const from = entries + words * i;
    std::uint32_t packed[2 * (words - 2)] = {};
    for (std::uint32_t k = 2; k < words; ++k) {
      packed[2 * k - 4] = static_cast<std::uint32_t>(from[k]);
      packed[2 * k - 3] = static_cast<std::uint32_t>(from[k] >> 32);
    }
    return packed_origin::get(packed, seed);
  }
};

/// Where the fields of a wave's bins start, with ranks; empty without.
struct shared_bins {
  told_bins told;
  const std::uint32_t* winners = nullptr;  // a bin: the entry that it starts from

  WFPG_HD bool empty() const { return winners == nullptr; }
  WFPG_HD field_origin origin(std::size_t bin, std::uint32_t seed) const {
    return told.origin(winners[bin], seed);
  }
};

/// Kernel: picks the ray that each bin would start from among this rank's, or writes the bin's entry.
template <class Fields, class Rays>
struct pick_bin_ray {
  Fields fields;  // bin_fields
  Rays rays;      // wave_rays
  std::uint64_t* candidates;
  std::uint64_t* entries;  // null: picks

  WFPG_HD void operator()(std::size_t i) const {
    const bins_view& bins = fields.bins;
    if (bins.sorted_keys[i] == 0xffffffffu) return;
    const std::uint32_t bin = bins.group_prefix[i] - 1, ray = bins.permutation[i];
    const std::uint32_t number = rays.number(ray);
    const std::uint64_t bits = hash(fields.seed, bins.key(bin));
    const std::uint64_t candidate = (hash(bits, number) & ~0xffffffffull) | number;
    if (!entries)
      atomic_min(candidates + bin, candidate);
    else if (candidates[bin] == candidate)
      told_bins::put(entries + std::size_t(told_bins::words) * bin, bins.key(bin), bins.size(bin), candidate,
                     fields.origin_of(bin, ray));
  }
};

/// Kernel: finds the size of each of this rank's bins on all ranks, and the entry that it starts from.
struct find_told_bins {
  bins_view bins;
  told_bins told;
  std::uint32_t* sizes;
  std::uint32_t* winners;
  WFPG_HD void operator()(std::size_t bin) const {
    std::uint32_t size = 0, winner = 0xffffffffu, entry;
    for (std::uint32_t r = 0; r < told.ranks; ++r) {
      if (!told.find(r, bins.key(bin), entry)) continue;
      size += told.size(entry);
      if (winner == 0xffffffffu || told.candidate(entry) < told.candidate(winner)) winner = entry;
    }
    sizes[bin] = size;
    winners[bin] = winner;
  }
};

/// Kernel: counts the bins of all ranks. A bin counts where no rank before has it.
struct count_told_bins {
  told_bins told;
  std::uint32_t* count;
  WFPG_HD void operator()(std::size_t i) const {
    std::uint32_t entry;
    for (std::uint32_t r = 0; told.begins[r + 1] <= i; ++r)
      if (told.find(r, told.key(i), entry)) return;
    atomic_add(count, 1);
  }
};

/// Exchanges a wave's bins. Without ranks it has no memory, and may not be called.
template <class Exec>
class bin_ranks {
 public:
  bin_ranks() = default;
  bin_ranks(const Exec& exec, std::size_t max_rays, communicator* ranks)
      : ranks_(ranks),
        candidates_(exec, ranks ? max_rays : 0),
        sizes_(exec, candidates_.size()),
        winners_(exec, candidates_.size()),
        begins_(exec, ranks ? ranks->size() + 1 : 0),
        count_(exec, ranks ? 1 : 0) {}

  explicit operator bool() const { return ranks_ != nullptr; }
  communicator* ranks() const { return ranks_; }
  /// Number of bins of all ranks in the last wave, in the policy's memory; null without ranks.
  const std::uint32_t* count() const { return count_.data(); }
  std::size_t bytes() const {
    return candidates_.bytes() + sizes_.bytes() + winners_.bytes() + begins_.bytes() + count_.bytes() +
           entries_.bytes();
  }

  /// Sets what a wave's fields need of other ranks. `Fields`: bin_fields. Throws rank_error.
  template <class Fields, class Rays>
  void share(const Exec& exec, Fields& fields, const Rays& rays) {
    const std::uint32_t own = read_element(exec, fields.bins.count);
    const std::vector<std::uint32_t> begins = begins_of_ranks(exec, own);
    const std::uint32_t first = begins[ranks_->rank()], all = begins.back();
    const std::size_t words = std::size_t(told_bins::words) * all;
    const array_view<std::uint64_t> shared = entries_.fit(exec, words, words / 2);
    exec.fill_bytes(shared.data(), 0, words * sizeof(std::uint64_t));
    exec.fill_bytes(candidates_.data(), 0xff, candidates_.bytes());
    const std::size_t n = fields.bins.permutation.size();
    std::uint64_t* const entries = entries_.data() + std::size_t(told_bins::words) * first;
    exec.for_each(n, pick_bin_ray<Fields, Rays>{fields, rays, candidates_.data(), nullptr});
    if (own > 0) exec.for_each(n, pick_bin_ray<Fields, Rays>{fields, rays, candidates_.data(), entries});
    ranks_->all_reduce_sum(shared);  // where other ranks write, it is 0
    const told_bins told{entries_.data(), begins_.data(), ranks_->size()};
    exec.for_each(own, find_told_bins{fields.bins, told, sizes_.data(), winners_.data()});
    exec.fill_bytes(count_.data(), 0, count_.bytes());
    exec.for_each(all, count_told_bins{told, count_.data()});
    fields.bins.sizes_of_ranks = sizes_.data();
    fields.ranks = {told, winners_.data()};
  }

 private:
  // Where each rank's entries begin, and their number; also in begins_.
  std::vector<std::uint32_t> begins_of_ranks(const Exec& exec, std::uint32_t own) {
    exec.fill_bytes(begins_.data(), 0, begins_.bytes());
    exec.copy_from_host(begins_.data() + ranks_->rank() + 1, &own, sizeof own);
    ranks_->all_reduce_sum(begins_.view());
    std::vector<std::uint32_t> begins = begins_.to_host(exec);
    for (std::size_t r = 1; r < begins.size(); ++r) begins[r] += begins[r - 1];
    exec.copy_from_host(begins_.data(), begins.data(), begins_.bytes());
    return begins;
  }

  communicator* ranks_ = nullptr;
  buffer<std::uint64_t, Exec> candidates_;       // a bin of this rank
  buffer<std::uint32_t, Exec> sizes_, winners_;  // likewise
  buffer<std::uint32_t, Exec> begins_;           // told_bins::begins
  buffer<std::uint32_t, Exec> count_;            // bins of all ranks
  buffer<std::uint64_t, Exec> entries_;          // of all ranks
};

}  // namespace wfpg::detail
