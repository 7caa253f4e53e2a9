// Implementation of fragments_from_caster.hpp. Lines are cast in groups. A step casts the next ray of all
// lines of a group, and keeps those lines that go on.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/octree/fragments_from_caster.hpp>

#include <thrust/copy.h>
#include <thrust/scan.h>

#include <cmath>

namespace wfpg {
namespace detail {

/// The rest of a line: a half-line with a unit direction, world space.
struct scan_line {
  vec3 origin;
  vec3 direction;
};

/// The octree's cube, and the lengths that lines need in it.
struct scan_cube {
  voxel_grid grid;
  float beside;  ///< from a ray to its two neighbours, scene units
  float behind;  ///< from a hit to where its line goes on, scene units

  /// Fractions of a voxel, but more than what rounding does to positions.
  explicit scan_cube(const voxel_grid& g) : grid(g) {
    const vec3 far = max_of(g.origin, g.origin + g.side);
    const float rounding = 2.0e-5f * max(far.x, max(far.y, far.z));
    beside = max(g.voxel_size() / 16.0f, rounding);
    behind = 4.0f * beside;
  }
  /// Distance to the cube's far side along a line; at most 0 where it has left the cube.
  WFPG_HD float exit_distance(const scan_line& line) const {
    const vec3 upper = grid.origin + grid.side;
    float nearest = 4.0f * grid.side;
    for (int axis = 0; axis < 3; ++axis) {
      const float d = line.direction[axis];
      if (fabsf(d) < 1.0e-12f) continue;
      nearest = min(nearest, ((d > 0.0f ? upper[axis] : grid.origin[axis]) - line.origin[axis]) / d);
    }
    return nearest;
  }

 private:
  static vec3 max_of(vec3 a, vec3 b) { return glm::max(glm::abs(a), glm::abs(b)); }
};

/// A random unit direction.
WFPG_HD inline vec3 random_direction(std::uint64_t state) {
  return glm::normalize(square_to_sphere(unit_vec2(hash(state, 0x5ca1ab1e))));
}

/// The lines of a round that enter through the cube's faces, each from a cell of a grid over its face.
struct lines_through_faces {
  scan_cube cube;
  std::uint64_t seed;  ///< of the round
  std::uint64_t side;  ///< cells along a face
  bool along_axes;     ///< false: in random directions

  /// Line i. Successive lines have different faces; those beyond the last cell lie anywhere on their face.
  WFPG_HD scan_line operator()(std::uint64_t i) const {
    const std::uint64_t state = hash(seed, i), cell = i / 6;
    const int axis = static_cast<int>(i % 3);
    const bool from_above = i % 6 >= 3;
    vec2 on_face = unit_vec2(state);
    if (cell < side * side)
      on_face = (vec2(static_cast<float>(cell % side), static_cast<float>(cell / side)) + on_face) /
                static_cast<float>(side);
    vec3 place(0.0f), inward(0.0f);
    place[axis] = from_above ? 1.0f : 0.0f;
    place[(axis + 1) % 3] = on_face.x;
    place[(axis + 2) % 3] = on_face.y;
    inward[axis] = from_above ? -1.0f : 1.0f;
    vec3 direction = inward;
    if (!along_axes) {
      // A normal plus a direction of the sphere is cosine-distributed, but its length may be 0.
      const vec3 sum = inward + random_direction(state);
      const float length = glm::length(sum);
      if (length > 1.0e-3f) direction = sum / length;
    }
    return {cube.grid.origin + cube.grid.side * place, direction};
  }
};

/// The lines of a round that start at random hits, in random directions. They leave either side of a surface.
struct lines_from_hits {
  scan_cube cube;
  std::uint64_t seed;  ///< of the round
  array_view<const surface_fragment> samples;

  /// Line i. It starts in the cube's middle where the hit is not in the cube.
  WFPG_HD scan_line operator()(std::uint64_t i) const {
    const std::uint64_t state = hash(seed, i);
    const vec3 direction = random_direction(state);
    const surface_fragment from = samples[state % samples.size()];
    uvec3 voxel;
    if (!cube.grid.voxel_of(from.position, voxel))
      return {cube.grid.origin + 0.5f * cube.grid.side, direction};
    const float side = glm::dot(from.normal, direction) < 0.0f ? -cube.behind : cube.behind;
    return {from.position + side * from.normal, direction};
  }
};

/// Writes the lines of a group.
template <class Lines>
struct start_lines {
  Lines all;
  std::uint64_t first;  ///< line of the group
  array_view<scan_line> lines;
  WFPG_HD void operator()(std::size_t i) const { lines[i] = all(first + i); }
};

/// Writes the three parallel rays of each line. Rays of lines that have left the cube are not of use.
struct write_scan_rays {
  scan_cube cube;
  array_view<const scan_line> lines;
  array_view<ray> rays;  ///< all lines' own, then their two neighbours

  WFPG_HD void operator()(std::size_t i) const {
    const scan_line line = lines[i];
    const frame around(line.direction);
    ray cast{line.origin, 0.0f, line.direction, max(cube.exit_distance(line), 0.0f)};
    rays[i] = cast;
    cast.origin = line.origin + cube.beside * around.x;
    rays[lines.size() + i] = cast;
    cast.origin = line.origin + cube.beside * around.y;
    rays[2 * lines.size() + i] = cast;
  }
};

/// Reads a step's hits: where surface was found, and which lines go on.
struct read_scan_hits {
  scan_cube cube;
  array_view<scan_line> lines;         ///< move behind their hits
  array_view<const ray_hit> hits;      ///< as rays of write_scan_rays
  array_view<surface_fragment> found;  ///< a line
  array_view<std::uint64_t> counts;    ///< a line: 1 where it found surface, and 2³² where it goes on

  WFPG_HD void operator()(std::size_t i) const {
    scan_line& line = lines[i];
    const float distance = hits[i].distance;
    counts[i] = 0;
    if (is_finite(distance) && !hits[i].is_hit()) return;
    // A distance that is not finite gives a position that is not, which is counted later.
    found[i].position = line.origin + distance * line.direction;
    found[i].normal = -line.direction;
    found[i].area = doubtful_area;
    counts[i] = 1;
    uvec3 voxel;
    if (!cube.grid.voxel_of(found[i].position, voxel)) return;
    measure(i, found[i]);
    line.origin = found[i].position + cube.behind * line.direction;
    if (cube.exit_distance(line) > 0.0f) counts[i] += std::uint64_t(1) << 32;
  }

 private:
  // Of a fragment whose normal is not known. Others have the area 1.
  static constexpr float doubtful_area = 1.0f / 64.0f;

  /// Finds the plane through the three hits, if they are those of one surface.
  WFPG_HD void measure(std::size_t i, surface_fragment& sample) const {
    const float first = hits[i].distance;
    const float u = hits[lines.size() + i].distance - first, v = hits[2 * lines.size() + i].distance - first;
    // Steeper surfaces, and edges. Misses are negative.
    const float most = 4.0f * cube.beside;
    if (!(is_finite(u) && is_finite(v) && fabsf(u) <= most && fabsf(v) <= most)) return;
    if (!hits[lines.size() + i].is_hit() || !hits[2 * lines.size() + i].is_hit()) return;
    const frame around(lines[i].direction);
    sample.normal = glm::normalize(u * around.x + v * around.y - cube.beside * around.z);
    sample.area = 1.0f;
  }
};

/// Appends what a step found to all samples, and the lines that go on to the next step's.
struct keep_scan_hits {
  array_view<const scan_line> lines;
  array_view<const surface_fragment> found;
  array_view<const std::uint64_t> sums;  ///< inclusive, of read_scan_hits's counts
  surface_fragment* samples;             ///< from the first free one on
  array_view<scan_line> next;

  WFPG_HD void operator()(std::size_t i) const {
    const std::uint64_t before = i > 0 ? sums[i - 1] : 0, sum = sums[i];
    if (std::uint32_t(sum) != std::uint32_t(before)) samples[std::uint32_t(before)] = found[i];
    if (sum >> 32 != before >> 32) next[before >> 32] = lines[i];
  }
};

/// Casts lines and collects their hits.
template <class Exec, class Caster>
class line_scanner {
 public:
  /// Allocates what a group of lines needs, with room for `capacity` of them.
  line_scanner(const Exec& exec, const Caster& caster, const scan_cube& cube, std::size_t capacity,
               std::uint32_t crossings)
      : exec_(exec),
        caster_(caster),
        cube_(cube),
        crossings_(crossings),
        lines_(exec, capacity),
        next_(exec, capacity),
        rays_(exec, 3 * capacity),
        hits_(exec, 3 * capacity),
        found_(exec, capacity),
        counts_(exec, capacity) {}

  /// The hits so far, in the order of their lines, with those that are to be skipped.
  array_view<const surface_fragment> samples() const {
    return array_view<const surface_fragment>(samples_.data(), size_);
  }

  /// Casts `count` lines until they end. `lines_of()` returns a functor of their numbers. It is called for
  /// each group, since samples() move while their number grows.
  template <class LinesOf>
  void scan(const LinesOf& lines_of, std::uint64_t count) {
    for (std::uint64_t first = 0; first < count; first += lines_.size()) {
      std::size_t n = static_cast<std::size_t>(min<std::uint64_t>(lines_.size(), count - first));
      exec_.for_each(n, start_lines<decltype(lines_of())>{lines_of(), first, lines_.view()});
      for (std::uint32_t crossing = 0; crossing < crossings_ && n > 0; ++crossing) n = step(n);
    }
  }

 private:
  /// Casts the next rays of the first n lines. Returns how many lines go on.
  std::size_t step(std::size_t n) {
    const array_view<scan_line> lines = lines_.view().subview(0, n);
    const array_view<ray_hit> hits = hits_.view().subview(0, 3 * n);
    exec_.for_each(n, write_scan_rays{cube_, lines, rays_.view()});
    cast_rays(exec_, caster_, array_view<const ray>(rays_.data(), 3 * n), hits);
    exec_.for_each(n, read_scan_hits{cube_, lines, hits, found_.view(), counts_.view()});
    ::thrust::inclusive_scan(exec_.thrust(), counts_.data(), counts_.data() + n, counts_.data());
    const std::uint64_t sums = read_element(exec_, counts_.data() + n - 1);
    reserve(size_ + std::uint32_t(sums));
    exec_.for_each(
        n, keep_scan_hits{lines, found_.view(), counts_.view(), samples_.data() + size_, next_.view()});
    size_ += std::uint32_t(sums);
    lines_.swap(next_);
    return static_cast<std::size_t>(sums >> 32);
  }

  /// Grows the samples' buffer by half where it is too small.
  void reserve(std::size_t wanted) {
    if (wanted <= samples_.size()) return;
    buffer<surface_fragment, Exec> larger(exec_, max(wanted, samples_.size() + samples_.size() / 2));
    ::thrust::copy_n(exec_.thrust(), samples_.data(), size_, larger.data());
    samples_.swap(larger);
  }

  Exec exec_;
  Caster caster_;
  scan_cube cube_;
  std::uint32_t crossings_;
  buffer<scan_line, Exec> lines_, next_;
  buffer<ray, Exec> rays_;
  buffer<ray_hit, Exec> hits_;
  buffer<surface_fragment, Exec> found_;
  buffer<std::uint64_t, Exec> counts_;
  buffer<surface_fragment, Exec> samples_;
  std::size_t size_ = 0;  // samples in use
};

/// Throws std::invalid_argument where bounds or options are out of range.
inline void require_valid(const bounds3& bounds, const caster_fragments_options& options) {
  require(!bounds.empty(), "bounds", "empty", "a box that is not empty");
  for (const vec3 corner : {bounds.lower, bounds.upper})
    for (int axis = 0; axis < 3; ++axis)
      require(fabsf(corner[axis]) <= largest_coordinate, "bounds", corner[axis],
              "coordinates of at most 1e15");
  require_resolution(options.octree_resolution);
  if (options.rays)
    require(*options.rays >= 1 && *options.rays <= 1u << 28, "rays", *options.rays, "in [1, 2^28]");
  require(options.rounds >= 1 && options.rounds <= 64, "rounds", options.rounds, "in [1, 64]");
  require(options.crossings >= 1 && options.crossings <= 65536, "crossings", options.crossings,
          "in [1, 65536]");
}

}  // namespace detail

template <class Exec, class Caster>
voxel_fragments<Exec> fragments_from_caster(const Exec& exec, const Caster& caster, const bounds3& bounds,
                                            const caster_fragments_options& options) {
  static_assert(is_ray_caster_v<Caster, Exec>,
                "caster: needs ray_hit operator()(const ray&) const, or cast(exec, rays, hits) const");
  detail::require_valid(bounds, options);
  constexpr std::uint32_t most_lines = 1u << 22, group = 1u << 18;
  const std::uint32_t resolution = options.octree_resolution;
  const std::uint32_t rays = options.rays.value_or(min(6 * resolution * resolution, most_lines));
  const detail::scan_cube cube(detail::grid_around(bounds, resolution));
  const auto side = static_cast<std::uint64_t>(std::sqrt(static_cast<double>(rays / 6)));
  detail::line_scanner<Exec, Caster> scanner(exec, caster, cube, min(rays, group), options.crossings);
  for (std::uint32_t round = 0; round < options.rounds; ++round) {
    const std::uint64_t seed = hash(options.seed, round);
    // Lines start at hits of earlier rounds alone.
    const std::size_t known = scanner.samples().size();
    if (round % 2 == 0 || known == 0)
      scanner.scan([&] { return detail::lines_through_faces{cube, seed, side, round == 0}; }, rays);
    else
      scanner.scan(
          [&] {
            return detail::lines_from_hits{cube, seed, scanner.samples().subview(0, known)};
          },
          rays);
  }
  return fragments_from_samples(exec, scanner.samples(), resolution, bounds);
}

}  // namespace wfpg
