// Kernels of a sarsa_grid: they compute values from recorded paths, fold them into means, and publish
// distributions. Values are summed exactly in any order (value_queue.hpp), and tables are integers. So reruns
// give the same bits.
#pragma once

#include <wfpg/exec/support/value_queue.hpp>
#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guide/recorded_path.hpp>
#include <wfpg/guides/sarsa/detail/sarsa_distribution.hpp>
#include <wfpg/host/bsdf.hpp>

namespace wfpg {

namespace detail {

/// Cells over a box. Positions beyond it belong to the nearest cell.
struct sarsa_cells {
  vec3 lower{0.0f};              // corner of the box, world space
  vec3 per_unit{0.0f};           // cells a scene unit, along each axis
  std::uint32_t resolution = 0;  // cells along a side

  WFPG_HD std::uint32_t index(vec3 p) const {
    const vec3 at = (p - lower) * per_unit;
    return (along(at.z) * resolution + along(at.y)) * resolution + along(at.x);
  }
  std::uint32_t size() const { return resolution * resolution * resolution; }

 private:
  WFPG_HD std::uint32_t along(float x) const {
    return static_cast<std::uint32_t>(min(max(x, 0.0f), static_cast<float>(resolution - 1)));
  }
};

/// Running mean of a direction's radiance, of `count` values.
struct direction_mean {
  float radiance;
  std::uint32_t count;
};

/// The known radiance that learning reads: of each cell and direction, as of the last step.
struct sarsa_table {
  sarsa_cells cells;
  const float* radiance = nullptr;
  std::uint32_t resolution = 0;

  WFPG_HD std::uint32_t index(vec3 position, vec3 direction) const {
    const sarsa_cell cell{nullptr, nullptr, resolution};
    return cells.index(position) * resolution * resolution + cell.index(direction);
  }
};

/// Queues a value for each direction that a recorded path took. With Monte Carlo it is all radiance that left
/// the next vertex. With SARSA it is Le + a L of Eq. 6. There Le includes the light that next-event
/// estimation sampled at the next vertex. The attenuation `a` is the ratio of the throughputs after and
/// before that vertex; it is 0 where the path ends.
struct learn_path {
  path_recorder_view paths;
  sarsa_table table;
  value_queue_view queue;
  sarsa_update update;
  array_view<const float> expected;  // by number of a direction

  WFPG_HD void operator()(std::size_t place) const {
    const recorded_path path(paths, place);
    const std::uint32_t n = path.vertices();
    if (n < 2) return;
    const std::uint32_t first = queue.reserve(n - 1);
    vec3 arriving(0.0f);
    for (std::uint32_t next = n - 1; next > 0; --next) {
      arriving += path.contribution(next);
      write(first + next - 1, path, next, arriving);
    }
  }

 private:
  /// Whether a vertex was left out: nothing is known of the light along the directions around it.
  WFPG_HD static bool is_gap(const recorded_path& path, std::uint32_t vertex) {
    return vertex < path.surfaces() && path.is_gap(vertex);
  }

  WFPG_HD void write(std::uint32_t entry, const recorded_path& path, std::uint32_t next,
                     vec3 arriving) const {
    if (!queue.fits(entry)) return;
    if (is_gap(path, next - 1) || is_gap(path, next) || is_gap(path, next + 1)) return queue.drop(entry);
    const float value =
        update == sarsa_update::monte_carlo
            ? leaving_luminance(arriving, path.throughput(next))
            : leaving_luminance(path.contribution(next), path.throughput(next)) + scattered(path, next);
    vec3 direction;
    const vec3 position = path.position(next - 1);
    if (value >= 0.0f && is_finite(value) && is_finite(position) && path.has_direction(next - 1, direction))
      queue.write(entry, table.index(position, direction), min(value, 1.0e30f));
    else
      queue.drop(entry);
  }

  /// Luminance that a vertex scatters of the known radiance: all of it by number (Eq. 5), or the path's next
  /// direction's (Eq. 6).
  WFPG_HD float scattered(const recorded_path& path, std::uint32_t vertex) const {
    if (vertex >= path.surfaces()) return 0.0f;
    if (update == sarsa_update::expected_sarsa && path.field(vertex) < expected.size())
      return expected[path.field(vertex)];
    vec3 direction;
    if (vertex + 1 >= path.vertices() || !path.has_direction(vertex, direction)) return 0.0f;
    const float attenuation = leaving_luminance(path.throughput(vertex + 1), path.throughput(vertex));
    return attenuation * table.radiance[table.index(path.position(vertex), direction)];
  }
};

/// Estimates the integral of Eq. 5 at each surface of a wave: with one random direction in each of the cell's
/// B² directions, over the sphere.
template <class Surfaces>
struct expect_scattering {
  Surfaces surfaces;
  sarsa_table table;
  float* expected;
  std::uint32_t seed;

  WFPG_HD void operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    const auto s = surfaces(ray);
    expected[i] = 0.0f;
    if (!s.active || s.bsdf.is_delta() || !is_finite(s.position)) return;
    const std::uint32_t b = table.resolution;
    const float* const radiance = table.radiance + std::size_t(table.cells.index(s.position)) * b * b;
    float sum = 0.0f;
    for (std::uint32_t k = 0; k < b * b; ++k) {
      if (!(radiance[k] > 0.0f)) continue;
      const vec2 inside = coarse_vec2(hash32(hash32(seed, ray), k));
      const vec2 uv =
          (vec2(static_cast<float>(k % b), static_cast<float>(k / b)) + inside) / static_cast<float>(b);
      sum += radiance[k] * s.bsdf.eval(s.outgoing, square_to_sphere(uv));
    }
    expected[i] = sum * (4.0f * pi / static_cast<float>(b * b));
  }
};

/// Moves each mean toward the n values that its direction received. Eq. 7, applied n times, moves it by the
/// fraction 1 - (1 - alpha)^n. A mean whose values all weigh alike moves by n / count. The larger one counts.
struct fold_values {
  value_queue_view queue;
  direction_mean* means;
  float learning_rate;

  WFPG_HD void operator()(std::size_t i) const {
    double sum;
    const std::uint32_t n = queue.take(i, sum);
    if (n == 0) return;
    const direction_mean before = means[i];
    const std::uint64_t count = std::uint64_t(before.count) + n;
    const auto values = static_cast<float>(n);
    const float by_rate = 1.0f - powf(1.0f - learning_rate, values);
    const float share = max(values / static_cast<float>(count), by_rate);
    const float mean = static_cast<float>(sum / static_cast<double>(n));
    means[i] = {before.radiance + share * (mean - before.radiance),
                static_cast<std::uint32_t>(min<std::uint64_t>(count, 0xffffffffu))};
  }
};

/// Publishes the means at the end of a step, one block a cell: as the radiance that learning reads, and as
/// the distribution that rays sample. Directions without values get the mean of the others.
struct publish_cell {
  const direction_mean* means;
  float* radiance;
  std::uint32_t* weights;
  std::uint32_t* sums;
  std::uint32_t resolution;
  float floor;

  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t cell) const {
    const auto n = static_cast<int>(resolution * resolution);
    const std::size_t first = cell * static_cast<std::size_t>(n);
    const direction_mean* const from = means + first;
    const float known = block.sum(n, [&](int i) { return from[i].count > 0 ? 1.0f : 0.0f; });
    const float sum = block.sum(n, [&](int i) { return from[i].radiance; });
    const float mean = known > 0.0f ? sum / known : 0.0f;
    const cell_words words{sums + cell * grid_distribution::words(resolution)};
    block.for_each(n, [&](int i) {
      radiance[first + static_cast<std::size_t>(i)] = from[i].radiance;
      words.set(i, from[i].count > 0 ? from[i].radiance : mean);
    });
    block.sync();
    const grid_distribution grid =
        build_distribution(block, words, static_cast<int>(resolution), 0.0f, floor);
    block.for_each(n, [&](int i) {
      const auto k = static_cast<std::uint32_t>(i);
      weights[first + k] = grid.weight(k % resolution, k / resolution);
    });
  }
};

/// Tabulates the clamped cosine between each normal of the lattice and each direction, in 255ths: the mean
/// over 16 points of the direction's range, at least 1 where any is positive. Of a direction and its
/// opposite, one is positive.
struct tabulate_cosines {
  normal_lattice normals;
  std::uint32_t resolution;
  std::uint8_t* cosines;

  WFPG_HD void operator()(std::size_t i) const {
    constexpr int n = 4;  // along a side
    const std::uint32_t cells = resolution * resolution;
    const vec3 normal = normals.normal(static_cast<std::uint32_t>(i / cells));
    const auto k = static_cast<std::uint32_t>(i % cells);
    const vec2 corner(static_cast<float>(k % resolution), static_cast<float>(k / resolution));
    float sum = 0.0f;
    for (int j = 0; j < n * n; ++j) {
      const vec2 inside(static_cast<float>(j % n) + 0.5f, static_cast<float>(j / n) + 0.5f);
      const vec2 uv = (corner + inside / static_cast<float>(n)) / static_cast<float>(resolution);
      sum += max(glm::dot(normal, square_to_sphere(uv)), 0.0f);
    }
    const float mean = sum * (255.0f / static_cast<float>(n * n));
    cosines[i] = sum > 0.0f ? static_cast<std::uint8_t>(max(mean, 1.0f)) : std::uint8_t(0);
  }
};

/// Computes the paper's memoised normalisers, of each cell and each normal of the lattice.
struct normalise_products {
  const std::uint32_t* weights;
  const std::uint8_t* cosines;
  const std::uint32_t* opposites;  // of a direction: that of the opposite one
  sarsa_normaliser* normalisers;
  std::uint32_t directions, normals;

  WFPG_HD void operator()(std::size_t i) const {
    const std::uint32_t* const w = weights + i / normals * directions;
    const std::uint8_t* const c = cosines + i % normals * directions;
    sarsa_normaliser result;
    for (std::uint32_t k = 0; k < directions; ++k) {
      const std::uint32_t other = opposites[k];
      const std::uint64_t product = std::uint64_t(w[k]) * c[k];
      result.total += product;
      result.peak = max(result.peak, product + std::uint64_t(w[other]) * c[other]);
    }
    normalisers[i] = result;
  }
};

/// Tabulates the opposite of each direction of the octahedral square. It is a direction of the grid, since
/// `resolution` is even.
struct find_opposites {
  std::uint32_t resolution;
  std::uint32_t* opposites;

  WFPG_HD void operator()(std::size_t i) const {
    const auto k = static_cast<std::uint32_t>(i);
    const vec2 centre(static_cast<float>(k % resolution) + 0.5f, static_cast<float>(k / resolution) + 0.5f);
    const sarsa_cell cell{nullptr, nullptr, resolution};
    // Off the centre, where a cell of the edge has directions of both hemispheres.
    const vec2 uv = (centre + vec2(0.21f, 0.13f)) / static_cast<float>(resolution);
    opposites[i] = cell.index(-square_to_sphere(uv));
  }
};

}  // namespace detail
}  // namespace wfpg
