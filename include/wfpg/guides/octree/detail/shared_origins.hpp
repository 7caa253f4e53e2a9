// Where the fields of a wave start, as ranks tell each other.
#pragma once

#include <wfpg/guides/octree/field_cells.hpp>

namespace wfpg::detail {

/// Where the builds of a wave start, where several ranks have its rays. Empty without ranks.
struct shared_origins {
  /// Words of a build: position, normal, and flags. The ranks add these words up, so that all have those of
  /// the rank with the ray. Others have zeros.
  static constexpr std::uint32_t words = 7;

  std::uint32_t* place_of_slot = nullptr;  ///< a slot: its place among the wave's builds
  std::uint32_t* of_builds = nullptr;      ///< a build: `words` words

  /// Whether builds start here, not at rays of the wave.
  WFPG_HD bool empty() const { return of_builds == nullptr; }
  /// Writes where a slot's build starts.
  WFPG_HD void put(std::uint32_t slot, const field_origin& origin) const {
    std::uint32_t* const to = of_builds + std::size_t(place_of_slot[slot]) * words;
    for (int i = 0; i < 3; ++i) {
      to[i] = float_bits(origin.position[i]);
      to[3 + i] = float_bits(origin.normal[i]);
    }
    to[6] = (origin.cosine ? 1u : 0u) | (origin.hemisphere ? 2u : 0u);
  }
  /// Returns where a slot's build starts, with a seed for its cones. It has the bits that the rank with the
  /// ray wrote.
  /// Precondition: the slot is built in this wave.
  WFPG_HD field_origin get(std::uint32_t slot, std::uint32_t seed) const {
    const std::uint32_t* const from = of_builds + std::size_t(place_of_slot[slot]) * words;
    field_origin origin;
    for (int i = 0; i < 3; ++i) {
      origin.position[i] = bits_float(from[i]);
      origin.normal[i] = bits_float(from[3 + i]);
    }
    origin.cosine = (from[6] & 1u) != 0;
    origin.hemisphere = (from[6] & 2u) != 0;
    origin.seed = seed;
    return origin;
  }
};

}  // namespace wfpg::detail
