// Where the fields of a wave start, as ranks tell each other.
#pragma once

#include <wfpg/guides/octree/field_cells.hpp>

namespace wfpg::detail {

/// The origin of a field in words that ranks add up, so that all have those of the rank with the ray. Others
/// have zeros.
struct packed_origin {
  /// Words of an origin: position, normal, and flags.
  static constexpr std::uint32_t words = 7;

  /// Writes an origin, but for its seed.
  WFPG_HD static void put(std::uint32_t* to, const field_origin& origin) {
    for (int i = 0; i < 3; ++i) {
      to[i] = float_bits(origin.position[i]);
      to[3 + i] = float_bits(origin.normal[i]);
    }
    to[6] = (origin.cosine ? 1u : 0u) | (origin.hemisphere ? 2u : 0u);
  }
  /// Returns the origin, with a seed for the cones. It has the bits that the rank with the ray wrote.
  WFPG_HD static field_origin get(const std::uint32_t* from, std::uint32_t seed) {
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

/// Where the builds of a wave start, where several ranks have its rays. Empty without ranks.
struct shared_origins {
  std::uint32_t* place_of_slot = nullptr;  ///< a slot: its place among the wave's builds
  std::uint32_t* of_builds = nullptr;      ///< a build: packed_origin::words

  /// Whether builds start here, not at rays of the wave.
  WFPG_HD bool empty() const { return of_builds == nullptr; }
  /// Writes where a slot's build starts.
  WFPG_HD void put(std::uint32_t slot, const field_origin& origin) const {
    packed_origin::put(of_slot(slot), origin);
  }
  /// Returns where a slot's build starts, with a seed for its cones.
  /// Precondition: the slot is built in this wave.
  WFPG_HD field_origin get(std::uint32_t slot, std::uint32_t seed) const {
    return packed_origin::get(of_slot(slot), seed);
  }

 private:
  // The words of a slot's build.
  WFPG_HD std::uint32_t* of_slot(std::uint32_t slot) const {
    return of_builds + std::size_t(place_of_slot[slot]) * packed_origin::words;
  }
};

}  // namespace wfpg::detail
