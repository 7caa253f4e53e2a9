// The kernels of light/photon_map.hpp: the boxes of photons, their order, and which are left out where they
// are dense.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/host/geometry.hpp>
#include <wfpg/light/box_tree.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg::detail {

/// Numbers of photons in cells of space, and which photons are kept. Cells may share a counter, and then
/// count as one.
struct photon_cells {
  const std::uint32_t* counts = nullptr;  ///< null where all are kept
  std::uint32_t last = 0;                 ///< number of counters - 1; their number is a power of two
  float cells_a_unit = 0.0f;              ///< along an axis
  std::uint32_t cell_photons = 0;         ///< about how many are kept of a cell
  std::uint64_t seed = 0;

  WFPG_HD std::uint32_t counter(vec3 p) const {
    // Adding 0 makes one cell of those at 0 and -0.
    return static_cast<std::uint32_t>(hash_of(0, glm::floor(p * cells_a_unit) + 0.0f)) & last;
  }
  /// 1 over the probability that a photon is kept. Precondition: not all are.
  WFPG_HD float weight(vec3 p) const {
    return max(1.0f, static_cast<float>(counts[counter(p)]) / static_cast<float>(cell_photons));
  }
  WFPG_HD bool keeps(std::size_t index, vec3 p) const {
    if (counts == nullptr || !is_valid_position(p)) return true;
    const std::uint64_t random = hash_of(hash(seed, index), p) >> 32;
    return random * counts[counter(p)] < std::uint64_t(cell_photons) << 32;
  }

 private:
  WFPG_HD static std::uint64_t hash_of(std::uint64_t state, vec3 p) {
    return hash(hash(state, std::uint64_t(float_bits(p.x)) << 32 | float_bits(p.y)), float_bits(p.z));
  }
};

/// Kernel: adds each photon to its cell.
struct count_cell_photons {
  array_view<const vec3> positions;
  photon_cells cells;
  std::uint32_t* counts;
  WFPG_HD void operator()(std::size_t i) const {
    if (is_valid_position(positions[i])) atomic_add(counts + cells.counter(positions[i]), 1);
  }
};

/// Returns the box around each photon's sphere.
struct photon_boxes {
  array_view<const vec3> positions;
  float radius;
  photon_cells cells;
  WFPG_HD bounds3 operator()(std::size_t i) const {
    const vec3 p = positions[i];
    return cells.keeps(i, p) ? bounds3{p - radius, p + radius} : bounds3{};
  }
};

/// Copies positions into the tree's order, and finds their weights where photons are left out.
struct order_photons {
  box_tree_view tree;
  array_view<const vec3> positions;
  photon_cells cells;
  vec3* ordered;
  float* weights;
  WFPG_HD void operator()(std::size_t place) const {
    const vec3 p = positions[tree.index(static_cast<std::uint32_t>(place))];
    ordered[place] = p;
    if (cells.counts != nullptr) weights[place] = cells.weight(p);
  }
};

}  // namespace wfpg::detail
