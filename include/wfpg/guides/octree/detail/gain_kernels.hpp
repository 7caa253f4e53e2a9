// Kernels of gain_meter.hpp, and what it keeps of paths.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guide/recorded_path.hpp>
#include <wfpg/guide/rest_schedule.hpp>
#include <wfpg/guide/statistics.hpp>
#include <wfpg/host/recorded_runs.hpp>
#include <wfpg/octree/exitance_cache.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg::detail {

/// Radiance that paths of one index brought to the camera in earlier samples: luminance, W/(m² sr). Negative
/// where it is not known, or the path began at another place. 28 bytes.
struct earlier_paths {
  /// Marks paths that hit no surface of the octree first.
  static constexpr std::uint32_t nowhere = 0xffffffffu;

  std::uint32_t place = nowhere;  ///< of the first unguided path's first surface: 2 * node + side
  std::uint32_t vertices = 0;     ///< surfaces of the first unguided path
  float unguided[rest_constants::most_unguided] = {-1.0f, -1.0f, -1.0f, -1.0f};  ///< in unguided samples
  float guided = -1.0f;  ///< in the last guided sample that was measured

  /// Number of `guided` for radiance().
  static constexpr std::uint32_t of_guided = rest_constants::most_unguided;
  /// Radiance in the unguided sample of a number, or in the guided one.
  WFPG_HD float& radiance(std::uint32_t number) { return number < of_guided ? unguided[number] : guided; }
  /// Forgets all radiance. The first unguided path began at `at` and has `surfaces`.
  WFPG_HD void begin(std::uint32_t at, std::uint32_t surfaces) {
    *this = {};
    place = at;
    vertices = surfaces;
  }
};

/// Losses of differences of paths, as guiding_gain has them.
struct path_losses {
  std::uint64_t all = 0;      ///< of guiding_gain::most_square
  std::uint64_t typical = 0;  ///< of guiding_gain::most_typical

  WFPG_HD path_losses operator+(const path_losses& other) const {
    return {all + other.all, typical + other.typical};
  }
};

/// Products of a path's typical losses, which the standard error of a gain is made of. In units of 2^-32.
struct loss_products {
  std::uint64_t unguided = 0;  ///< squares of unguided losses
  std::uint64_t guided = 0;    ///< squares of guided losses
  std::uint64_t both = 0;      ///< products of both

  /// Products of losses in units of 2^-36, each less than 2^6.
  WFPG_HD static loss_products of(std::uint64_t unguided, std::uint64_t guided) {
    const std::uint64_t u = unguided >> 20, g = guided >> 20;
    return {u * u, g * g, u * g};
  }
  WFPG_HD loss_products operator+(const loss_products& other) const {
    return {unguided + other.unguided, guided + other.guided, both + other.both};
  }
};

/// Sums over at most 2^17 paths. Integers, so that any order of additions gives the same bits. Values are in
/// units of 2^-30, losses in units of 2^-36.
struct path_sums {
  std::uint64_t paths = 0;
  std::uint64_t unguided = 0;           ///< mean values of unguided paths
  std::uint64_t guided = 0;             ///< values of guided paths
  path_losses unguided_losses;          ///< mean losses of differences of two unguided paths
  path_losses guided_losses;            ///< losses of differences of guided paths from earlier guided ones
  std::uint64_t unguided_vertices = 0;  ///< surfaces of unguided paths
  std::uint64_t guided_vertices = 0;    ///< surfaces of guided paths
  loss_products products;               ///< of typical losses

  WFPG_HD path_sums operator+(const path_sums& other) const {
    return {paths + other.paths,
            unguided + other.unguided,
            guided + other.guided,
            unguided_losses + other.unguided_losses,
            guided_losses + other.guided_losses,
            unguided_vertices + other.unguided_vertices,
            guided_vertices + other.guided_vertices,
            products + other.products};
  }
};

/// A path of a sample, as it is measured.
struct measured_path {
  float radiance = -1.0f;                        ///< that it brought to the camera, or -1
  std::uint32_t place = earlier_paths::nowhere;  ///< where it hit a surface first: 2 * node + side
  std::uint32_t vertices = 0;                    ///< its surfaces
};

/// Recorded paths that are measured: those that take part in `compared`.
struct measured_paths {
  path_recorder_view recorded;
  exitance_cache_view cache;
  recorded_runs compared;

  /// Number of paths, which i counts. Some may not be recorded.
  std::size_t size() const { return compared.size(recorded.paths()); }
  /// Path i: without radiance where it is not recorded, or hit no surface first. Not inlined: a reduction
  /// calls it from several places, and radiance must not depend on which of them.
  WFPG_HD WFPG_NOINLINE measured_path operator()(std::size_t i) const {
    std::uint32_t index;
    if (!recorded.has_place(compared.path(static_cast<std::uint32_t>(i)), index)) return {};
    const recorded_path path(recorded, index);
    if (path.surfaces() == 0 || path.is_gap(0)) return {};
    vec3 arriving(0.0f);
    for (std::uint32_t depth = path.vertices(); depth-- > 0;) arriving += path.contribution(depth);
    const float sum = luminance(arriving);
    if (!is_finite(sum) || sum < 0.0f) return {};
    return {sum, place(path), path.surfaces()};
  }
  /// Unit of differences at a place that is not nowhere.
  WFPG_HD float scale(std::uint32_t place) const {
    return cache.read(place / 2, place % 2) + 0.5f * (cache.read(0, 0u) + cache.read(0, 1u));
  }

 private:
  // Above a leaf: nodes with some hundred times its deposits.
  static constexpr int levels_up = 4;

  WFPG_HD std::uint32_t place(const recorded_path& path) const {
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
};

/// Kernel: keeps what the paths of a sample brought.
struct keep_paths {
  measured_paths paths;
  array_view<earlier_paths> kept;
  std::uint32_t number;  // earlier_paths::radiance() that it is kept in

  WFPG_HD void operator()(std::size_t i) const {
    const measured_path now = paths(i);
    if (number == 0) kept[i].begin(now.place, now.vertices);
    kept[i].radiance(number) = now.place == kept[i].place ? now.radiance : -1.0f;
  }
};

/// Kernel: what a rank's paths brought, as differences from what is kept of unknown paths. Sums over ranks
/// are then the differences of all paths, since a path is one rank's. Words are 0 before.
struct write_path_words {
  measured_paths paths;
  array_view<const earlier_paths> kept;
  std::uint32_t number;  // as keep_paths has it
  std::uint32_t* words;  // 3 a path for number 0, else 1
  WFPG_HD void operator()(std::size_t i) const {
    const measured_path now = paths(i);
    const std::size_t place = i + paths.compared.first_place();
    const std::uint32_t radiance = float_bits(now.radiance) - float_bits(-1.0f);
    if (number == 0) {
      words[3 * place] = now.place - earlier_paths::nowhere;
      words[3 * place + 1] = radiance;
      words[3 * place + 2] = now.vertices;
    } else if (now.place == kept[place].place) {
      words[place] = radiance;
    }
  }
};

/// Kernel: keeps what the words of all ranks say.
struct keep_path_words {
  const std::uint32_t* words;
  std::uint32_t number;
  array_view<earlier_paths> kept;
  WFPG_HD void operator()(std::size_t i) const {
    if (number == 0) kept[i].begin(words[3 * i] + earlier_paths::nowhere, words[3 * i + 2]);
    kept[i].radiance(number) = bits_float(words[number == 0 ? 3 * i + 1 : i] + float_bits(-1.0f));
  }
};

/// Terms of a pixel in the sums.
struct path_terms {
  /// Those of its unguided paths: 0 where these are fewer than two. `scale`: unit of differences at its
  /// place.
  WFPG_HD static path_sums unguided(const earlier_paths& kept, float scale) {
    if (!(scale > 0.0f) || !is_finite(scale)) return {};
    path_losses of_pairs;
    float value = 0.0f;
    std::uint32_t n = 0;
    for (const float path : kept.unguided) {
      if (path < 0.0f) continue;
      for (const float other : kept.unguided)
        if (other >= 0.0f) of_pairs = of_pairs + losses((path - other) / scale);
      value += min(path / scale, most);
      ++n;
    }
    if (n < 2) return {};
    const std::uint32_t pairs = n * (n - 1);
    path_sums result;
    result.paths = 1;
    result.unguided = units(value / static_cast<float>(n));
    result.unguided_losses = {of_pairs.all / pairs, of_pairs.typical / pairs};
    result.unguided_vertices = kept.vertices;
    return result;
  }
  /// Those of all its paths: 0 where unguided ones have none. `now`: its guided path.
  WFPG_HD static path_sums all(const earlier_paths& kept, const measured_path& now, float scale) {
    path_sums result = unguided(kept, scale);
    if (result.paths == 0) return result;
    result.guided = units(min(now.radiance / scale, most));
    result.guided_losses = losses((kept.guided - now.radiance) / scale);
    result.guided_vertices = now.vertices;
    result.products = loss_products::of(result.unguided_losses.typical, result.guided_losses.typical);
    return result;
  }

 private:
  static constexpr float most = static_cast<float>(guiding_gain::most_square);

  WFPG_HD static std::uint64_t units(float value) { return static_cast<std::uint64_t>(value * 0x1p30f); }
  // Huber's loss: the square of a difference up to `least`, and the line through it up to eight times that.
  WFPG_HD static std::uint64_t loss(float difference, float least) {
    const float d = min(fabsf(difference), 8.0f * least);
    return static_cast<std::uint64_t>((d <= least ? d * d : least * (2.0f * d - least)) * 0x1p36f);
  }
  WFPG_HD static path_losses losses(float difference) {
    return {loss(difference, most), loss(difference, static_cast<float>(guiding_gain::most_typical))};
  }
};

/// Terms of a guided path in the sums: 0 where no earlier guided path, or fewer than two unguided ones, began
/// where it did.
struct measure_path {
  measured_paths paths;
  array_view<const earlier_paths> kept;

  WFPG_HD path_sums operator()(std::size_t i) const {
    const earlier_paths before = kept[i + paths.compared.first_place()];
    if (before.place == earlier_paths::nowhere || before.guided < 0.0f) return {};
    const measured_path now = paths(i);
    if (now.radiance < 0.0f || now.place != before.place) return {};
    return path_terms::all(before, now, paths.scale(before.place));
  }
};

/// Terms of unguided paths alone in the sums.
struct measure_unguided {
  measured_paths paths;
  array_view<const earlier_paths> kept;

  WFPG_HD path_sums operator()(std::size_t i) const {
    const earlier_paths& pixel = kept[i + paths.compared.first_place()];
    return pixel.place == earlier_paths::nowhere ? path_sums{}
                                                 : path_terms::unguided(pixel, paths.scale(pixel.place));
  }
};

/// Terms of sums that are only made so that memory for them is there.
struct measure_nothing {
  WFPG_HD path_sums operator()(std::size_t) const { return {}; }
};

}  // namespace wfpg::detail
