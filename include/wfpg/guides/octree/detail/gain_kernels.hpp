// Kernels of gain_meter.hpp, and what it keeps of paths.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guide/recorded_path.hpp>
#include <wfpg/octree/exitance_cache.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg::detail {

/// Radiance that paths of one index brought to the camera in earlier samples: luminance, W/(m² sr). 12 bytes.
struct earlier_paths {
  /// Marks paths that hit no surface of the octree first.
  static constexpr std::uint32_t nowhere = 0xffffffffu;

  std::uint32_t place = nowhere;  ///< of the unguided path's first surface: 2 * node + side
  float unguided = -1.0f;         ///< in the unguided sample; negative where it is not known
  /// In the last guided sample that was measured; negative where it is not known, or began at another place.
  float guided = -1.0f;
};

/// Sums over paths. Integers, so that any order of additions gives the same bits. Values are in units of
/// 2^-30, squared differences in units of 2^-40.
struct path_sums {
  std::uint64_t paths = 0;
  std::uint64_t unguided = 0;        ///< values of unguided paths
  std::uint64_t cut_off = 0;         ///< what is cut off of them
  std::uint64_t guided = 0;          ///< values of guided paths
  std::uint64_t guided_cut_off = 0;  ///< what is cut off of them
  std::uint64_t now_first = 0;       ///< squared differences of guided paths from unguided ones
  std::uint64_t now_earlier = 0;     ///< squared differences of guided paths from earlier guided ones
  std::uint64_t earlier_first = 0;   ///< squared differences of earlier guided paths from unguided ones

  WFPG_HD path_sums operator+(const path_sums& other) const {
    return {paths + other.paths,
            unguided + other.unguided,
            cut_off + other.cut_off,
            guided + other.guided,
            guided_cut_off + other.guided_cut_off,
            now_first + other.now_first,
            now_earlier + other.now_earlier,
            earlier_first + other.earlier_first};
  }
};

/// Recorded paths that are measured: every `stride`-th.
struct measured_paths {
  path_recorder_view recorded;
  exitance_cache_view cache;
  std::size_t stride = 1;

  /// Radiance that path i brought to the camera, or -1.
  WFPG_HD float radiance(std::size_t i) const {
    const recorded_path path(recorded, i * stride);
    if (path.surfaces() == 0 || path.is_gap(0)) return -1.0f;
    vec3 arriving(0.0f);
    for (std::uint32_t depth = path.vertices(); depth-- > 0;) arriving += path.contribution(depth);
    const float sum = luminance(arriving);
    return is_finite(sum) && sum >= 0.0f ? sum : -1.0f;
  }
  /// Where path i hit a surface first: 2 * node + side, or nowhere. Precondition: it has a radiance.
  WFPG_HD std::uint32_t place(std::size_t i) const {
    const recorded_path path(recorded, i * stride);
    const sparse_voxel_octree_view& tree = cache.octree();
    const vec3 position = path.position(0);
    node_id node = is_finite(position) ? tree.nearest_leaf(position) : invalid_node;
    if (node == invalid_node) return earlier_paths::nowhere;
    std::uint32_t side = cache.side_facing(node, path.outgoing(0));
    for (int up = 0; up < levels_up && node != 0; ++up) {
      const node_id parent = tree.parent(node);
      side = cache.matching_side(parent, node - tree.first_child(parent), side);
      node = parent;
    }
    return 2 * node + side;
  }
  /// Unit of differences at a place that is not nowhere.
  WFPG_HD float scale(std::uint32_t place) const {
    return cache.read(place / 2, place % 2) + 0.5f * (cache.read(0, 0u) + cache.read(0, 1u));
  }

 private:
  // Above a leaf: nodes with some hundred times its deposits.
  static constexpr int levels_up = 2;
};

/// Kernel: keeps what paths brought, of an unguided sample or of a guided one.
struct keep_paths {
  measured_paths paths;
  array_view<earlier_paths> kept;
  bool unguided;

  WFPG_HD void operator()(std::size_t i) const {
    const float radiance = paths.radiance(i);
    const std::uint32_t place = radiance < 0.0f ? earlier_paths::nowhere : paths.place(i);
    if (unguided)
      kept[i] = {place, radiance, -1.0f};
    else
      kept[i].guided = place == kept[i].place ? radiance : -1.0f;
  }
};

/// Terms of a guided path in the sums: 0 where one of the three paths is missing, or began elsewhere.
struct measure_path {
  measured_paths paths;
  array_view<const earlier_paths> kept;

  WFPG_HD path_sums operator()(std::size_t i) const {
    const earlier_paths before = kept[i];
    if (before.place == earlier_paths::nowhere || before.unguided < 0.0f || before.guided < 0.0f) return {};
    const float now = paths.radiance(i);
    if (now < 0.0f || paths.place(i) != before.place) return {};
    const float scale = paths.scale(before.place);
    if (!(scale > 0.0f) || !is_finite(scale)) return {};
    const float first = before.unguided / scale, earlier = before.guided / scale, last = now / scale;
    return {1,
            units(min(first, most)),
            units(cut_off(first)),
            units(min(last, most)),
            units(cut_off(last)),
            squared_units(first - last),
            squared_units(earlier - last),
            squared_units(first - earlier)};
  }

 private:
  static constexpr float most = 8.0f, brightest = 0x1p16f;

  WFPG_HD static float cut_off(float value) { return max(min(value, brightest) - most, 0.0f); }
  WFPG_HD static std::uint64_t units(float value) { return static_cast<std::uint64_t>(value * 0x1p30f); }
  WFPG_HD static std::uint64_t squared_units(float difference) {
    const float cut = min(fabsf(difference), most);
    return static_cast<std::uint64_t>(cut * cut * 0x1p40f);
  }
};

/// Terms of sums that are only made so that memory for them is there.
struct measure_nothing {
  WFPG_HD path_sums operator()(std::size_t) const { return {}; }
};

}  // namespace wfpg::detail
