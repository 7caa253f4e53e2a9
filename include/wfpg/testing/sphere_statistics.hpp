// Bins of the sphere in (cos theta, phi) that adapt to a density: where much is expected they are small, and
// what each of them expects is an integral refined until two levels of a quadrature agree.
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

inline constexpr double full_turn = 6.283185307179586;  // radians

/// A rectangle of the unit sphere: z = cos theta in [-1, 1], turn = phi / 2 pi in [0, 1].
struct sphere_cell {
  double z0 = -1.0, z1 = 1.0;
  double turn0 = 0.0, turn1 = 1.0;

  double solid_angle() const { return full_turn * (z1 - z0) * (turn1 - turn0); }
  /// The unit direction at (u, v) in [0,1]² of the rectangle, in its own frame.
  vec3 direction(double u, double v) const {
    const double z = z0 + u * (z1 - z0), phi = full_turn * (turn0 + v * (turn1 - turn0));
    const double r = std::sqrt(std::max(1.0 - z * z, 0.0));
    return {float(r * std::cos(phi)), float(r * std::sin(phi)), float(z)};
  }
  /// A quarter of it; bit 0 of `i`: upper z, bit 1: upper turn.
  sphere_cell quarter(std::uint32_t i) const {
    const double z = 0.5 * (z0 + z1), turn = 0.5 * (turn0 + turn1);
    return {i & 1u ? z : z0, i & 1u ? z1 : z, i & 2u ? turn : turn0, i & 2u ? turn1 : turn};
  }
  /// Which quarter holds a point.
  std::uint32_t quarter_of(double z, double turn) const {
    return (z >= 0.5 * (z0 + z1) ? 1u : 0u) | (turn >= 0.5 * (turn0 + turn1) ? 2u : 0u);
  }
  /// "z in [0.5, 0.6], phi in [0, 1.57]", phi in radians.
  std::string describe() const {
    std::ostringstream text;
    text.precision(4);
    text << "z in [" << z0 << ", " << z1 << "], phi in [" << full_turn * turn0 << ", " << full_turn * turn1
         << "]";
    return text.str();
  }
};

/// What `samples` samples of a density put into each of a number of bins that together are the sphere.
///
/// A grid of 8 x 16 rectangles, in which one is split into four while the quadrature of it (Gauss and
/// Legendre's, 3² points) and that of its quarters differ by more than 0.1% and 0.02 samples, or while more
/// than 1/100 of the samples is expected in it, or more than 4 hints lie in it, or one where next to nothing
/// is expected, to 14 levels and 2^17 nodes. Bins are the first rectangles on the way down that expect 1/100
/// of the samples or less, at most 8 levels down.
///
/// `hints` are directions drawn by what is to be tested, independently of those that will be counted: where
/// they are dense it is refined, so that a lobe between a grid's points is not missed.
///
/// Cost: 9 evaluations a node; some 10⁴ for a wide density, 10⁵ for one with narrow lobes or edges.
class sphere_bins {
 public:
  /// `density(directions) -> values`, std::vectors of vec3 and float, per steradian, world space; z is along
  /// the third axis of `axes`. Precondition: values are finite and not negative.
  template <class Density>
  sphere_bins(const frame& axes, const Density& density, double samples, const std::vector<vec3>& hints = {})
      : axes_(axes), samples_(samples), largest_(std::max(samples / 100.0, 20.0)) {
    for (std::uint32_t i = 0; i < rows * columns; ++i) {
      const double row = i / columns, column = i % columns;
      nodes_.push_back({{2.0 * row / rows - 1.0, 2.0 * (row + 1.0) / rows - 1.0, column / columns,
                         (column + 1.0) / columns}});
    }
    hand_out_hints(hints);
    refine(density);
    for (std::size_t n = nodes_.size(); n-- > 0;)
      if (nodes_[n].first_child != 0) nodes_[n].expected = sum_of_children(nodes_[n]);
    for (std::uint32_t n = 0; n < rows * columns; ++n) total_ += nodes_[n].expected;
    for (std::uint32_t n = 0; n < rows * columns; ++n) make_bins(n);
  }

  std::size_t size() const { return bins_.size(); }
  /// Counts by bin; their sum is `samples` times the integral of the density.
  const std::vector<double>& expected() const { return expected_; }
  /// The integral of the density over the sphere.
  double integral() const { return total_ / samples_; }
  /// By how much the last two levels of the quadrature differed, all in all: a bound of integral()'s error
  /// unless both miss a lobe.
  double integral_error() const { return error_ / samples_; }

  /// The bin of a unit direction. O(levels).
  std::size_t of(vec3 direction) const {
    const vec3 d = axes_.to_local(direction);
    const double z = d.z, turn = turn_of(d);
    std::uint32_t n = root_of(z, turn);
    while (nodes_[n].bin == no_bin) n = nodes_[n].first_child + nodes_[n].cell.quarter_of(z, turn);
    return nodes_[n].bin;
  }
  /// Counts of directions by bin.
  template <class Directions>
  std::vector<double> count(const Directions& directions) const {
    std::vector<double> counts(size(), 0.0);
    for (const vec3 d : directions) counts[of(d)] += 1.0;
    return counts;
  }

  const sphere_cell& cell(std::size_t bin) const { return nodes_[bins_[bin]].cell; }
  /// The world-space direction in the middle of a bin.
  vec3 middle(std::size_t bin) const { return axes_.to_world(cell(bin).direction(0.5, 0.5)); }
  /// A bin in words, or a pool of bins.
  std::string describe(const chi_square_bin& bin) const {
    if (bin.first == bin.last) return "the bin with " + cell(bin.first).describe();
    return "the thinly filled bins from that with " + cell(bin.first).describe() + " to that with " +
           cell(bin.last).describe();
  }

 private:
  static constexpr std::uint32_t rows = 8, columns = 16;
  static constexpr std::uint32_t deepest = 14, deepest_bin = 8;
  static constexpr std::size_t most_hints = 4;
  static constexpr std::size_t most_nodes = std::size_t(1) << 17;
  static constexpr std::uint32_t no_bin = 0xffffffffu;

  struct node {
    sphere_cell cell;
    std::uint32_t level = 0;
    std::uint32_t first_child = 0;  // of four; 0: none
    std::uint32_t bin = no_bin;
    std::size_t first_hint = 0, last_hint = 0;
    double expected = 0.0;
  };

  struct hint {
    double z, turn;
  };

  static double turn_of(vec3 d) {
    const double turn = std::atan2(double(d.y), double(d.x)) / (full_turn);
    return turn < 0.0 ? turn + 1.0 : turn;
  }
  static std::uint32_t root_of(double z, double turn) {
    const auto row = static_cast<std::uint32_t>(std::max(0.5 * (z + 1.0), 0.0) * rows);
    const auto column = static_cast<std::uint32_t>(turn * columns);
    return std::min(row, rows - 1) * columns + std::min(column, columns - 1);
  }

  double sum_of_children(const node& n) const {
    double sum = 0.0;
    for (std::uint32_t i = 0; i < 4; ++i) sum += nodes_[n.first_child + i].expected;
    return sum;
  }
  std::size_t hint_count(const node& n) const { return n.last_hint - n.first_hint; }
  /// Whether too much for a bin is expected in a node, by the quadrature or by the hints.
  bool is_large(const node& n) const {
    const double all = std::max(double(hints_.size()), 1.0);
    return std::max(n.expected, double(hint_count(n)) * samples_ / all) > largest_;
  }

  /// Whether the quadrature may miss what the hints tell of: where they are dense, or where one lies though
  /// next to nothing is expected.
  bool is_missed(const node& n) const {
    const double expected = n.expected / samples_ * double(hints_.size());
    return hint_count(n) > most_hints || expected < 0.01 * double(hint_count(n));
  }

  /// Each root has a range of the hints.
  void hand_out_hints(const std::vector<vec3>& directions) {
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

  /// Four children of a node, with their hints.
  void split(std::uint32_t parent) {
    const node from = nodes_[parent];
    nodes_[parent].first_child = static_cast<std::uint32_t>(nodes_.size());
    const auto begin = hints_.begin();
    std::size_t first = from.first_hint;
    for (std::uint32_t i = 0; i < 4; ++i) {
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

  /// The quadrature of nodes [first, nodes_.size()).
  template <class Density>
  void integrate(const Density& density, std::size_t first) {
    static constexpr double at[] = {0.1127016653792583, 0.5, 0.8872983346207417};
    static constexpr double weight[] = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
    std::vector<vec3> directions;
    directions.reserve(9 * (nodes_.size() - first));
    for (std::size_t n = first; n < nodes_.size(); ++n)
      for (int i = 0; i < 9; ++i)
        directions.push_back(axes_.to_world(nodes_[n].cell.direction(at[i / 3], at[i % 3])));
    const std::vector<float> values = density(directions);
    for (std::size_t n = first; n < nodes_.size(); ++n) {
      double mean = 0.0;
      for (std::size_t i = 0; i < 9; ++i)
        mean += weight[i / 3] * weight[i % 3] * double(values[9 * (n - first) + i]);
      nodes_[n].expected = samples_ * nodes_[n].cell.solid_angle() * mean;
    }
  }

  /// Level by level, so that a density is asked for many directions at once.
  template <class Density>
  void refine(const Density& density) {
    integrate(density, 0);
    std::vector<std::uint32_t> active(rows * columns);
    for (std::uint32_t n = 0; n < active.size(); ++n) active[n] = n;
    while (!active.empty()) {
      const std::size_t first = nodes_.size();
      for (const std::uint32_t n : active) split(n);
      integrate(density, first);
      std::vector<std::uint32_t> next;
      for (const std::uint32_t n : active) {
        const double sum = sum_of_children(nodes_[n]), difference = std::fabs(sum - nodes_[n].expected);
        const bool agrees = difference <= 1.0e-3 * sum + 0.02;
        for (std::uint32_t i = nodes_[n].first_child; i < nodes_[n].first_child + 4; ++i) {
          const bool may_split = nodes_[i].level < deepest && nodes_.size() + 4 * next.size() < most_nodes;
          if (may_split && (!agrees || is_large(nodes_[i]) || is_missed(nodes_[i])))
            next.push_back(i);
          else
            error_ += 0.25 * difference;
        }
      }
      active.swap(next);
    }
  }

  void make_bins(std::uint32_t n) {
    if (nodes_[n].first_child != 0 && nodes_[n].level < deepest_bin && is_large(nodes_[n])) {
      for (std::uint32_t i = 0; i < 4; ++i) make_bins(nodes_[n].first_child + i);
      return;
    }
    nodes_[n].bin = static_cast<std::uint32_t>(bins_.size());
    bins_.push_back(n);
    expected_.push_back(nodes_[n].expected);
  }

  frame axes_;
  double samples_, largest_;
  double total_ = 0.0, error_ = 0.0;
  std::vector<hint> hints_;
  std::vector<node> nodes_;
  std::vector<std::uint32_t> bins_;
  std::vector<double> expected_;
};

/// Tests directions against the bins' expected counts, which are scaled to as many: shape, not sum. A few
/// samples where nothing is expected are no violation of their own, since rounding takes a direction over a
/// bin's edge; they are pooled as what is expected to be rare.
inline chi_square_result test_directions(const sphere_bins& bins, const std::vector<vec3>& directions) {
  std::vector<double> expected = bins.expected();
  double sum = 0.0;
  for (double& e : expected) sum += e = std::max(e, 1.0e-9);
  for (double& e : expected) e *= double(directions.size()) / sum;
  return chi_square_test(bins.count(directions), expected);
}

}  // namespace wfpg::testing
