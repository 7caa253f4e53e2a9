// Checks that ranks are about to learn the same guide. They need the same library, scene and options, and
// parts of the paths that together are all of them.
//
// Ranks that differ would learn different guides, or wait for each other in calls that others do not make.
//
// Source: wfpg's own. Cost: three reductions when a guider is made. Memory: 24 bytes an item, during the
// call.
#pragma once

#include <wfpg/base/config.hpp>
#include <wfpg/base/math.hpp>
#include <wfpg/guide/sampling_options.hpp>
#include <wfpg/ranks/communicator.hpp>

#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

namespace wfpg {

/// Things that have to be equal on all ranks: options by name, and hashes of what is larger. A guide adds its
/// own in `agree()` (guide.hpp). Every rank adds as many items, in the same order.
///
/// Numbers are compared by their bits. An unset option has a value that the option cannot have.
class agreed_items {
 public:
  /// Adds an item. `name`: as an error names it, a string literal.
  WFPG_COLD void add(const char* name, std::uint64_t value) { items_.push_back({name, value}); }
  /// Adds a number's bits.
  void add(const char* name, float value) { add(name, std::uint64_t(float_bits(value))); }
  /// Adds the hash of an array of integers or of floats, so that a message names the array as a whole. Two
  /// arrays of one hash are as likely as one in 2^64. O(n) on the host.
  template <class T>
  void add(const char* name, const std::vector<T>& values) {
    std::uint64_t key = values.size();
    for (const T value : values) key = hash(key, bits_of(value));
    add(name, key);
  }

  /// Throws rank_error on every rank where some item differs, and names the first one that does. All ranks
  /// call it with as many items: 16 bytes of traffic an item. Waits for the work before it. Throws
  /// out_of_memory.
  template <class Exec>
  WFPG_COLD void check(const Exec& exec, communicator& ranks) const;

 private:
  // Bits of a number, for the hash of an array. Floats are compared by their bits, so that 0 and -0 differ.
  // Integers have at most 64 bits.
  template <class T>
  static std::uint64_t bits_of(T value) {
    if constexpr (std::is_same_v<T, float>)
      return float_bits(value);
    else
      return value;
  }

  // Name and value of each, in the order in which they were added.
  std::vector<std::pair<const char*, std::uint64_t>> items_;
};

namespace detail {

/// Throws rank_error on every rank where the ranks' parts of the paths overlap, or leave out some. Parts may
/// lie in any order of ranks. The message names the first path that is in no part, or in two. 16 bytes of
/// traffic a rank.
template <class Exec>
WFPG_COLD void require_all_paths(const Exec& exec, const sampling_options& options);

/// Adds the options that all guides have, and that decide what is learnt.
void add_options(agreed_items& items, const sampling_options& options);

}  // namespace detail
}  // namespace wfpg

#include <wfpg/guide/detail/rank_agreement_impl.hpp>
