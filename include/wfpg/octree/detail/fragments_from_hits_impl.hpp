// Implementation of fragments_from_hits.hpp. One kernel decides how far each hit reaches, another writes the
// fragments around it. Reach is an integer, kept between the two, so that they agree.
#pragma once

#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/base/prefix_search.hpp>
#include <wfpg/exec/support/sum_prefix.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/octree/fragments_from_hits.hpp>

#include <thrust/copy.h>
#include <thrust/sort.h>

#include <cmath>

namespace wfpg {
namespace detail {

/// Points of the square around a hit. They lie `step` voxels apart, less than the width of one, so that
/// they miss few voxels.
struct hit_squares {
  /// Hits that a square expects beside its own where hits are random, so that squares leave few gaps.
  static constexpr float expected_hits = 8.0f;
  /// Hits that a cube needs to tell of their distance.
  static constexpr std::uint32_t enough_hits = 8;
  /// Distance of neighbouring points, in voxels.
  static constexpr float step = 0.7f;
  /// Area of the fragments around a hit, whose own is 1.
  static constexpr float area_around = 1.0f / 64.0f;

  /// Number of points in a square, without the hit. `reach`: points from the hit to each side.
  WFPG_HD static std::uint64_t points(std::uint32_t reach) {
    const std::uint64_t side = 2 * std::uint64_t(reach) + 1;
    return side * side - 1;
  }
  /// Reach of a hit in a cube of `side` voxels with `hits` of them.
  WFPG_HD static std::uint32_t reach(float side, std::uint32_t hits) {
    // A surface through the cube has about the area of its face.
    const float radius = side * std::sqrt(expected_hits / (pi * static_cast<float>(hits)));
    return static_cast<std::uint32_t>(min(radius, most_reach) / step);
  }

 private:
  // Voxels. Hits that lie further apart say nothing about what is between them.
  static constexpr float most_reach = 16.0f;
};

/// Finds how far each hit reaches, and the number of points around it.
struct find_reaches {
  array_view<const surface_fragment> hits;
  voxel_grid grid;
  array_view<const morton_code> codes;  ///< of the hits in the grid, sorted
  array_view<std::uint32_t> reaches;    ///< a hit
  array_view<std::uint64_t> counts;     ///< a hit: points around it

  WFPG_HD void operator()(std::size_t i) const {
    uvec3 voxel;
    const bool is_used = is_surface_sample(hits[i]) && grid.voxel_of(hits[i].position, voxel);
    reaches[i] = is_used ? reach(morton_encode(voxel)) : 0;
    counts[i] = hit_squares::points(reaches[i]);
  }

 private:
  /// Reach of a hit whose voxel has a code: by the smallest cube around it with enough hits.
  WFPG_HD std::uint32_t reach(morton_code code) const {
    std::uint32_t level = 0, n = 0;
    for (; (1u << level) <= grid.resolution; ++level) {
      const morton_code first = code >> 3 * level << 3 * level;
      n = below(first + (morton_code(1) << 3 * level)) - below(first);
      if (n >= hit_squares::enough_hits) break;
    }
    // Without enough of them all hits are counted, in the whole cube.
    const float side = static_cast<float>(min(1u << level, grid.resolution));
    return n > 0 ? hit_squares::reach(side, n) : 0;
  }
  /// Number of codes below one.
  WFPG_HD std::uint32_t below(morton_code code) const {
    const auto n = static_cast<std::uint32_t>(codes.size());
    if (n == 0 || codes[n - 1] < code) return n;
    if (code == 0) return 0;
    return search_prefix([&](std::uint32_t i) { return codes[i]; }, n, morton_code(0), ~morton_code(0),
                         code - 1)
        .index;
  }
};

/// Writes the fragments around one hit.
struct emit_squares {
  array_view<const surface_fragment> hits;
  voxel_grid grid;
  array_view<const std::uint32_t> reaches;        ///< a hit
  array_view<const std::uint64_t> counts_prefix;  ///< a hit
  morton_code* codes;
  fragment_surface* surfaces;

  WFPG_HD void operator()(std::size_t i) const {
    const auto reach = static_cast<int>(reaches[i]);
    if (reach == 0) return;
    std::uint64_t at = i > 0 ? counts_prefix[i - 1] : 0;
    const vec3 normal = glm::normalize(hits[i].normal);
    const frame around(normal);
    const fragment_surface surface{pack_direction(normal), hit_squares::area_around};
    const float step = hit_squares::step * grid.voxel_size();
    for (int x = -reach; x <= reach; ++x)
      for (int y = -reach; y <= reach; ++y) {
        if (x == 0 && y == 0) continue;
        const vec3 aside = static_cast<float>(x) * around.x + static_cast<float>(y) * around.y;
        codes[at] = code_of(hits[i].position + step * aside, hits[i].position);
        surfaces[at++] = surface;
      }
  }

 private:
  /// Code of a point's voxel, or of the hit's where the point is outside of the grid.
  WFPG_HD morton_code code_of(vec3 point, vec3 hit) const {
    uvec3 voxel(0u);
    if (!grid.voxel_of(point, voxel)) voxel = clamped_voxel(grid, hit);
    return morton_encode(voxel);
  }
};

}  // namespace detail

template <class Exec>
voxel_fragments<Exec> fragments_from_hits(const Exec& exec, array_view<const surface_fragment> hits,
                                          std::uint32_t resolution, const bounds3& bounds) {
  voxel_fragments<Exec> own = fragments_from_samples(exec, hits, resolution, bounds);
  const buffer<std::uint32_t, Exec> reaches(exec, hits.size());
  buffer<std::uint64_t, Exec> counts(exec, hits.size());
  {
    const buffer<morton_code, Exec> sorted(exec, own.size());
    ::thrust::copy_n(exec.thrust(), own.codes.data(), own.size(), sorted.data());
    ::thrust::sort(exec.thrust(), sorted.data(), sorted.data() + sorted.size());
    exec.for_each(hits.size(),
                  detail::find_reaches{hits, own.grid, sorted.view(), reaches.view(), counts.view()});
  }
  const std::uint64_t around = sum_prefix(exec, counts);
  if (around == 0) return own;
  detail::require_fragment_count(own.size() + around);
  voxel_fragments<Exec> result(exec, own.size() + around);
  ::thrust::copy_n(exec.thrust(), own.codes.data(), own.size(), result.codes.data());
  ::thrust::copy_n(exec.thrust(), own.surfaces.data(), own.size(), result.surfaces.data());
  exec.for_each(hits.size(),
                detail::emit_squares{hits, own.grid, reaches.view(), counts.view(),
                                     result.codes.data() + own.size(), result.surfaces.data() + own.size()});
  result.grid = own.grid;
  result.report = own.report;
  return result;
}

}  // namespace wfpg
