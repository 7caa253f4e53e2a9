// Bins of the sphere in (cos theta, phi) that adapt to a density, for chi² tests of directions.
// Bins are small where many samples are expected.
// A bin's expected count is an integral, refined until two levels of a quadrature agree.
// Source: Gauss-Legendre quadrature with 3 x 3 points; adaptive refinement as in a quadtree.
// Cost: 9 evaluations of the density a node.
// Memory: 72 bytes a node, up to 2^17 nodes, on the host.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/testing/statistics.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

namespace wfpg::testing {

/// 2 pi: a full turn in radians, in double precision.
inline constexpr double full_turn = 6.283185307179586;

/// A rectangle of the unit sphere in z = cos theta, in [-1, 1], and turn = phi / 2 pi, in [0, 1].
/// Equal rectangles have equal solid angles.
/// A default cell is the whole sphere.
/// 32 bytes.
struct sphere_cell {
  double z0 = -1.0,    ///< least z
      z1 = 1.0;        ///< largest z
  double turn0 = 0.0,  ///< least azimuth, turns
      turn1 = 1.0;     ///< largest azimuth, turns

  /// Returns the solid angle, steradians.
  /// 4 pi for the whole sphere.
  double solid_angle() const { return full_turn * (z1 - z0) * (turn1 - turn0); }
  /// Returns the unit direction at (u, v) in [0,1]² of the rectangle, in the frame of the bins.
  /// Uniform (u, v) give uniform directions.
  vec3 direction(double u, double v) const {
    const double z = z0 + u * (z1 - z0), phi = full_turn * (turn0 + v * (turn1 - turn0));
    // The sine of theta. Rounding may take z past the pole.
    const double r = std::sqrt(std::max(1.0 - z * z, 0.0));
    return {float(r * std::cos(phi)), float(r * std::sin(phi)), float(z)};
  }
  /// Returns quarter `i`, 0 to 3.
  /// Bit 0 of `i`: upper z; bit 1: upper turn.
  /// The four quarters have one solid angle: a fourth of the cell's.
  /// Middle lines are halves of both ranges, so that nothing overlaps.
  sphere_cell quarter(std::uint32_t i) const {
    const double z = 0.5 * (z0 + z1), turn = 0.5 * (turn0 + turn1);
    return {i & 1u ? z : z0, i & 1u ? z1 : z, i & 2u ? turn : turn0, i & 2u ? turn1 : turn};
  }
  /// Returns the index of the quarter that holds a point.
  /// Points on a middle line are in the upper one.
  std::uint32_t quarter_of(double z, double turn) const {
    return (z >= 0.5 * (z0 + z1) ? 1u : 0u) | (turn >= 0.5 * (turn0 + turn1) ? 2u : 0u);
  }
  /// Returns "z in [0.5, 0.6], phi in [0, 1.57]", phi in radians.
  std::string describe() const {
    std::ostringstream text;
    // Enough to find the place in a picture.
    text.precision(4);
    text << "z in [" << z0 << ", " << z1 << "], phi in [" << full_turn * turn0 << ", " << full_turn * turn1
         << "]";
    return text.str();
  }
};

/// The expected counts of `samples` samples of a density, in bins that together are the sphere.
///
/// It begins with a grid of 8 x 16 rectangles.
/// A rectangle is split into four while any of these holds:
///
/// - its quadrature (Gauss-Legendre, 3 x 3 points) and its quarters' differ by over 0.1% plus 0.02 samples;
/// - more than 1/100 of the samples, and more than 20, are expected in it;
/// - more than 4 hints lie in it, or one where next to nothing is expected.
///
/// Splitting ends at 14 levels and at 2^17 nodes.
/// Bins are the first rectangles on the way down that expect 1/100 of the samples or less.
/// They lie at most 8 levels down.
///
/// `hints` are directions drawn by what is tested, independently of those that will be counted.
/// Where they are dense the grid is refined, so that a lobe between its points is not missed.
///
/// Cost: some 10⁴ evaluations for a wide density, 10⁵ for one with narrow lobes or edges.
class sphere_bins {
 public:
  /// Integrates a density, and makes the bins.
  /// `density(directions) -> values`: std::vectors of vec3 and float, per steradian, world space.
  /// z is along the third axis of `axes`.
  /// Precondition: values are finite and not negative.
  /// `samples`: the number of samples that the counts are scaled to.
  template <class Density>
  sphere_bins(const frame& axes, const Density& density, double samples, const std::vector<vec3>& hints = {})
      : axes_(axes), samples_(samples), largest_(std::max(samples / 100.0, 20.0)) {
    for (std::uint32_t i = 0; i < rows * columns; ++i) {
      // Integer division and remainder: the index goes along the azimuth first.
      const double row = i / columns, column = i % columns;
      nodes_.push_back({{2.0 * row / rows - 1.0, 2.0 * (row + 1.0) / rows - 1.0, column / columns,
                         (column + 1.0) / columns}});
    }
    // Hints first, as refine() asks for them.
    hand_out_hints(hints);
    refine(density);
    // Children lie behind their parents: from the back, every sum is of finished values.
    for (std::size_t n = nodes_.size(); n-- > 0;)
      if (nodes_[n].first_child != 0) nodes_[n].expected = sum_of_children(nodes_[n]);
    for (std::uint32_t n = 0; n < rows * columns; ++n) total_ += nodes_[n].expected;
    for (std::uint32_t n = 0; n < rows * columns; ++n) make_bins(n);
  }

  /// Returns the number of bins.
  /// At least 128: one for each rectangle of the grid.
  std::size_t size() const { return bins_.size(); }
  /// Returns expected counts by bin.
  /// Their sum is `samples` times the integral of the density.
  const std::vector<double>& expected() const { return expected_; }
  /// Returns the integral of the density over the sphere.
  /// It is about 1 for a density whose samples never fail.
  double integral() const { return total_ / samples_; }
  /// Returns the sum of the differences between the last two levels of the quadrature.
  /// It bounds the error of integral(), unless both levels miss a lobe.
  double integral_error() const { return error_ / samples_; }

  /// Returns the bin of a unit direction. O(levels).
  /// Directions of another length end up in some bin, without an error.
  std::size_t of(vec3 direction) const {
    const vec3 d = axes_.to_local(direction);
    const double z = d.z, turn = turn_of(d);
    std::uint32_t n = root_of(z, turn);
    // Nodes above the bins have no bin, and nodes below are not reached.
    while (nodes_[n].bin == no_bin) n = nodes_[n].first_child + nodes_[n].cell.quarter_of(z, turn);
    return nodes_[n].bin;
  }
  /// Returns counts of directions by bin.
  /// `directions` is any range of vec3.
  template <class Directions>
  std::vector<double> count(const Directions& directions) const {
    std::vector<double> counts(size(), 0.0);
    for (const vec3 d : directions) counts[of(d)] += 1.0;
    return counts;
  }

  /// Returns the rectangle of a bin, in the frame of the bins.
  /// Valid while the bins are.
  const sphere_cell& cell(std::size_t bin) const { return nodes_[bins_[bin]].cell; }
  /// Returns the world-space direction in the middle of a bin.
  /// It is the middle in z and azimuth, not the densest place.
  vec3 middle(std::size_t bin) const { return axes_.to_world(cell(bin).direction(0.5, 0.5)); }
  /// Returns a bin, or a pool of bins, in words.
  std::string describe(const chi_square_bin& bin) const {
    // A pool lists its ends only.
    if (bin.first == bin.last) return "the bin with " + cell(bin.first).describe();
    return "the thinly filled bins from that with " + cell(bin.first).describe() + " to that with " +
           cell(bin.last).describe();
  }

 private:
  // The first grid: rows in z, columns in azimuth.
  static constexpr std::uint32_t rows = 8, columns = 16;
  // Levels of nodes and of bins below the grid, at most.
  static constexpr std::uint32_t deepest = 14, deepest_bin = 8;
  // Hints in a node that need no split.
  static constexpr std::size_t most_hints = 4;
  // Bounds time and memory for densities that no quadrature resolves.
  static constexpr std::size_t most_nodes = std::size_t(1) << 17;
  // Marks nodes above the bins.
  static constexpr std::uint32_t no_bin = 0xffffffffu;

  /// A rectangle of the quadtree.
  /// Its hints are a range of all hints. `expected` is a count of samples.
  struct node {
    sphere_cell cell;
    std::uint32_t level = 0;
    std::uint32_t first_child = 0;  // of four; 0: none
    std::uint32_t bin = no_bin;
    std::size_t first_hint = 0, last_hint = 0;
    double expected = 0.0;
  };

  /// A direction of the hints, in the frame of the bins.
  struct hint {
    double z, turn;
  };

  /// Returns the azimuth in turns, in [0, 1].
  static double turn_of(vec3 d) {
    // atan2 gives [-1/2, 1/2] turns; the negative half moves up by one.
    const double turn = std::atan2(double(d.y), double(d.x)) / (full_turn);
    return turn < 0.0 ? turn + 1.0 : turn;
  }
  /// Returns the rectangle of the first grid that holds a point.
  static std::uint32_t root_of(double z, double turn) {
    // Rounding may reach past the last row or column: both are clamped.
    const auto row = static_cast<std::uint32_t>(std::max(0.5 * (z + 1.0), 0.0) * rows);
    const auto column = static_cast<std::uint32_t>(turn * columns);
    return std::min(row, rows - 1) * columns + std::min(column, columns - 1);
  }

  /// Returns what the four quarters expect together.
  double sum_of_children(const node& n) const {
    double sum = 0.0;
    for (std::uint32_t i = 0; i < 4; ++i) sum += nodes_[n.first_child + i].expected;
    return sum;
  }
  std::size_t hint_count(const node& n) const { return n.last_hint - n.first_hint; }
  /// Returns whether a node expects too much for a bin, by the quadrature or by the hints.
  bool is_large(const node& n) const {
    // At least 1, against a division by 0 without hints.
    const double all = std::max(double(hints_.size()), 1.0);
    return std::max(n.expected, double(hint_count(n)) * samples_ / all) > largest_;
  }

  /// Returns whether the quadrature may miss what the hints show.
  /// True where hints are dense, and where one lies though next to nothing is expected.
  bool is_missed(const node& n) const {
    // The number of hints that the quadrature expects here.
    const double expected = n.expected / samples_ * double(hints_.size());
    return hint_count(n) > most_hints || expected < 0.01 * double(hint_count(n));
  }

  /// Sorts the hints by root: each root has a range of them.
  void hand_out_hints(const std::vector<vec3>& directions) {
    // One pass by the grid; split() partitions further.
    std::vector<std::vector<hint>> by_root(rows * columns);
    for (const vec3 direction : directions) {
      const vec3 d = axes_.to_local(direction);
      const hint h{d.z, turn_of(d)};
      by_root[root_of(h.z, h.turn)].push_back(h);
    }
    for (std::uint32_t n = 0; n < rows * columns; ++n) {
      nodes_[n].first_hint = hints_.size();
      hints_.insert(hints_.end(), by_root[n].begin(), by_root[n].end());
      nodes_[n].last_hint = hints_.size();
    }
  }

  /// Appends the four children of a node, and divides its hints among them.
  /// Each child inherits a part of the parent's range, in the order of the quarters.
  void split(std::uint32_t parent) {
    // A copy, since appending children may move all nodes.
    const node from = nodes_[parent];
    nodes_[parent].first_child = static_cast<std::uint32_t>(nodes_.size());
    const auto begin = hints_.begin();
    std::size_t first = from.first_hint;
    for (std::uint32_t i = 0; i < 4; ++i) {
      // Hints of quarter i move to the front of what is left.
      const auto inside = [&](const hint& h) { return from.cell.quarter_of(h.z, h.turn) == i; };
      const auto last =
          std::partition(begin + std::ptrdiff_t(first), begin + std::ptrdiff_t(from.last_hint), inside);
      node child;
      child.cell = from.cell.quarter(i);
      child.level = from.level + 1;
      child.first_hint = first;
      child.last_hint = first = static_cast<std::size_t>(last - begin);
      nodes_.push_back(child);
    }
  }

  /// Integrates the density over nodes [first, nodes_.size()), with 9 points each.
  template <class Density>
  void integrate(const Density& density, std::size_t first) {
    // Nodes and weights of Gauss-Legendre with 3 points, on [0, 1]: exact for polynomials of degree 5.
    static constexpr double at[] = {0.1127016653792583, 0.5, 0.8872983346207417};
    static constexpr double weight[] = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
    // All points of all new nodes, in one call of the density: it may be a kernel.
    std::vector<vec3> directions;
    directions.reserve(9 * (nodes_.size() - first));
    for (std::size_t n = first; n < nodes_.size(); ++n)
      for (int i = 0; i < 9; ++i)
        directions.push_back(axes_.to_world(nodes_[n].cell.direction(at[i / 3], at[i % 3])));
    // One value for each direction, in order.
    const std::vector<float> values = density(directions);
    for (std::size_t n = first; n < nodes_.size(); ++n) {
      // The mean over the cell, as the weights add up to 1 in each direction.
      double mean = 0.0;
      for (std::size_t i = 0; i < 9; ++i)
        mean += weight[i / 3] * weight[i % 3] * double(values[9 * (n - first) + i]);
      nodes_[n].expected = samples_ * nodes_[n].cell.solid_angle() * mean;
    }
  }

  /// Refines level by level, so that a density is asked for many directions at once.
  template <class Density>
  void refine(const Density& density) {
    integrate(density, 0);
    // All rectangles of the grid are split once: a single level has nothing to be compared with.
    std::vector<std::uint32_t> active(rows * columns);
    for (std::uint32_t n = 0; n < active.size(); ++n) active[n] = n;
    // A pass handles one level, and ends when no node of it needs a split.
    while (!active.empty()) {
      const std::size_t first = nodes_.size();
      for (const std::uint32_t n : active) split(n);
      integrate(density, first);
      // Children that will be split themselves.
      std::vector<std::uint32_t> next;
      for (const std::uint32_t n : active) {
        // Both levels' values, in samples.
        const double sum = sum_of_children(nodes_[n]), difference = std::fabs(sum - nodes_[n].expected);
        const bool agrees = difference <= 1.0e-3 * sum + 0.02;
        for (std::uint32_t i = nodes_[n].first_child; i < nodes_[n].first_child + 4; ++i) {
          // Nodes that wait for their split count four children each.
          const bool may_split = nodes_[i].level < deepest && nodes_.size() + 4 * next.size() < most_nodes;
          if (may_split && (!agrees || is_large(nodes_[i]) || is_missed(nodes_[i])))
            next.push_back(i);
          else
            // A quarter of the parent's difference for each child that stays.
            error_ += 0.25 * difference;
        }
      }
      active.swap(next);
    }
  }

  /// Makes bins of a node: itself, or those of its children where too much is expected in it.
  void make_bins(std::uint32_t n) {
    // Too much is expected, and there are children to go down to.
    if (nodes_[n].first_child != 0 && nodes_[n].level < deepest_bin && is_large(nodes_[n])) {
      for (std::uint32_t i = 0; i < 4; ++i) make_bins(nodes_[n].first_child + i);
      return;
    }
    // A leaf of the bins' tree.
    nodes_[n].bin = static_cast<std::uint32_t>(bins_.size());
    bins_.push_back(n);
    expected_.push_back(nodes_[n].expected);
  }

  // z is the polar axis.
  frame axes_;
  // The number of samples, and the largest count of a bin that is not divided.
  double samples_, largest_;
  // Sums over the sphere, in samples.
  double total_ = 0.0, error_ = 0.0;
  // Sorted by node.
  std::vector<hint> hints_;
  std::vector<node> nodes_;
  // The node of each bin, and what it expects.
  std::vector<std::uint32_t> bins_;
  std::vector<double> expected_;
};

/// Tests directions against the bins' expected counts, which are scaled to as many: shape, not sum.
/// A few samples where nothing is expected are no violation of their own.
/// Rounding takes a direction over a bin's edge; such bins are pooled as rare ones.
/// Precondition: directions are unit vectors, and there is at least one.
inline chi_square_result test_directions(const sphere_bins& bins, const std::vector<vec3>& directions) {
  std::vector<double> expected = bins.expected();
  double sum = 0.0;
  // 1e-9 samples at least, so that no bin fails alone by an edge's rounding.
  for (double& e : expected) sum += e = std::max(e, 1.0e-9);
  for (double& e : expected) e *= double(directions.size()) / sum;
  return chi_square_test(bins.count(directions), expected);
}

}  // namespace wfpg::testing
