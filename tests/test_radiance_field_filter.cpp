// The filter and the floor of a field's cells. The Gaussian crosses the square's edges as the sphere does,
// and keeps energy and symmetry. Floors are relative or absolute.
#include "support/fields.hpp"
#include "support/policies.hpp"

#include <wfpg/guides/octree/transient_fields.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

using namespace wfpg_test;
using wfpg::vec3;

namespace {

struct finish_cells {
  std::uint32_t* words;
  int resolution;
  bool hemisphere;
  wfpg::field_options options;
  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t) const {
    wfpg::finish_field(block, {words}, resolution, hemisphere, options);
  }
};

/// Probabilities of the cells after filter and floor.
template <class Exec>
std::vector<double> finished(const std::vector<float>& values, std::uint32_t resolution, bool hemisphere,
                             const wfpg::field_options& options) {
  const Exec exec;
  const wfpg::buffer<std::uint32_t, Exec> words(exec, words_of(values, resolution));
  exec.for_each_block(1, wfpg::field_scratch_bytes(resolution, Exec::warps_per_block),
                      finish_cells{words.data(), int(resolution), hemisphere, options});
  const std::vector<std::uint32_t> weights = cell_weights(exec, {words.data(), resolution});
  const std::uint32_t total = std::accumulate(weights.begin(), weights.end(), 0u);
  std::vector<double> result;
  for (const std::uint32_t weight : weights) result.push_back(double(weight) / double(total));
  return result;
}

wfpg::field_options only_filter() {
  return {0.8f, 0.0f, false};
}
wfpg::field_options only_floor(float floor, bool absolute) {
  return {0.0f, floor, absolute};
}

vec3 cell_centre(std::size_t cell, std::uint32_t resolution) {
  return wfpg::square_to_sphere({(float(cell % resolution) + 0.5f) / float(resolution),
                                 (float(cell / resolution) + 0.5f) / float(resolution)});
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

WFPG_TEST_CASE("radiance field filter: it is a Gaussian of 0.8 cells of a sphere", "[radiance_field]") {
  constexpr std::uint32_t n = 16;
  std::vector<float> values(n * n, 0.0f);
  values[7 * n + 8] = 3.0f;
  for (bool hemisphere : {false, true}) {
    const double alpha =
        hemisphere ? 0.8 * std::sqrt(2.0) : 0.8;  // a hemisphere has twice the cells per angle²
    double tap[3], sum = 0.0;
    for (int i = 0; i < 3; ++i) sum += (i ? 2.0 : 1.0) * (tap[i] = std::exp(-i * i / (alpha * alpha)));
    const auto p = finished<Exec>(values, n, hemisphere, only_filter());
    double error = 0.0;
    for (int y = 0; y < int(n); ++y)
      for (int x = 0; x < int(n); ++x) {
        const int dx = std::abs(x - 8), dy = std::abs(y - 7);
        const double expected = dx <= 2 && dy <= 2 ? tap[dx] * tap[dy] / (sum * sum) : 0.0;
        error = std::max(error, std::abs(p[std::size_t(y) * n + std::size_t(x)] - expected));
      }
    INFO("hemisphere " << hemisphere);
    CHECK(error < 1e-6);
  }
}

/// How far the light of cell `from` spreads over the sphere, in widths of a cell, and over how many cells.
struct spread {
  double distance = 0.0;
  int cells = 0;
};

spread spread_of(const std::vector<double>& p, std::size_t from, std::uint32_t resolution) {
  const double width = std::sqrt(4.0 * 3.14159265) / resolution;
  spread result;
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (p[i] < 1e-7) continue;
    const double cosine = glm::dot(cell_centre(i, resolution), cell_centre(from, resolution));
    result.distance = std::max(result.distance, std::acos(std::clamp(cosine, -1.0, 1.0)) / width);
    ++result.cells;
  }
  return result;
}

WFPG_TEST_CASE("radiance field filter: light crosses the square's edges as on the sphere",
               "[radiance_field]") {
  constexpr std::uint32_t n = 16;
  for (std::size_t from = 0; from < n * n; ++from) {
    const std::size_t x = from % n, y = from / n;
    if (x > 2 && x < n - 3 && y > 2 && y < n - 3) continue;
    std::vector<float> values(n * n, 0.0f);
    values[from] = 1.0f;
    const auto p = finished<Exec>(values, n, false, only_filter());
    INFO("cell " << x << ' ' << y);
    const spread s = spread_of(p, from, n);
    CHECK(s.distance < 5.0);  // 2.8 cells in the square, stretched by the map; the far side is 14 away
    // Light near an edge spreads over as many cells as inside. Exceptions are corners and the middles of
    // edges, about which the edges fold.
    const bool left_right = x < 2 || x >= n - 2, up_down = y < 2 || y >= n - 2;
    const auto near_fold = [](std::size_t along) { return along == std::clamp<std::size_t>(along, 6, 9); };
    if ((left_right && up_down) || near_fold(left_right ? y : x)) continue;
    CHECK(s.cells == 25);
    if (x == 0) CHECK(p[(n - 1 - y) * n] > 0.05);  // the neighbour across the left edge
    if (y == n - 1) CHECK(p[(n - 1) * n + n - 1 - x] > 0.05);
  }
}

WFPG_TEST_CASE("radiance field filter: it keeps energy, symmetry and constants", "[radiance_field]") {
  for (std::uint32_t n : {16u, 31u})
    for (bool hemisphere : {false, true}) {
      const auto flat = finished<Exec>(std::vector<float>(n * n, 2.0f), n, hemisphere, only_filter());
      CHECK(largest_difference(flat, std::vector<double>(n * n, 1.0 / (n * n))) < 1e-8);

      // Each cell keeps its energy if the filter's columns sum to one. Distributions are normalised, so a
      // known floor makes this visible.
      std::vector<float> values(n * n, 0.0f);
      random_numbers random(n);
      for (std::size_t cell : {std::size_t(0), std::size_t(n - 1), std::size_t(n * n - n), std::size_t(n / 2),
                               std::size_t(random.below(n * n))}) {
        std::fill(values.begin(), values.end(), 0.0f);
        values[cell] = 1.0f;
        const float floor = 1.0f / float(n * n);
        const auto p = finished<Exec>(values, n, hemisphere, {0.8f, floor, true});
        const double least = *std::min_element(p.begin(), p.end());  // a cell with only the floor
        CHECK(double(floor) / least == Approx(2.0).epsilon(1e-4));   // the sum of energy 1 and floors 1
      }

      // Half a turn about the pole, and reflections, map cells onto cells. Inputs with these symmetries keep
      // them.
      for (std::uint32_t y = 0; y < n; ++y)
        for (std::uint32_t x = 0; x < n; ++x) {
          const std::uint32_t fx = std::min(x, n - 1 - x), fy = std::min(y, n - 1 - y);
          values[y * n + x] = float((fx * 7 + fy * 3) % 11);
        }
      const auto p = finished<Exec>(values, n, hemisphere, only_filter());
      double asymmetry = 0.0;
      for (std::uint32_t y = 0; y < n; ++y)
        for (std::uint32_t x = 0; x < n; ++x) {
          asymmetry = std::max(asymmetry, std::abs(p[y * n + x] - p[(n - 1 - y) * n + n - 1 - x]));
          asymmetry = std::max(asymmetry, std::abs(p[y * n + x] - p[y * n + n - 1 - x]));
        }
      CHECK(asymmetry < 1e-9);
    }
}

WFPG_TEST_CASE("radiance field filter: floors are relative or absolute, and black becomes uniform",
               "[radiance_field]") {
  constexpr std::uint32_t n = 8;
  std::vector<float> values(n * n, 0.0f);
  values[5] = 64.0f;  // mean 1
  const auto relative = finished<Exec>(values, n, false, only_floor(0.01f, false));
  CHECK(relative[0] == Approx(0.01 / 64.64).epsilon(1e-5));
  CHECK(relative[5] == Approx(64.01 / 64.64).epsilon(1e-5));
  for (float& value : values) value *= 1e-6f;
  CHECK(largest_difference(relative, finished<Exec>(values, n, false, only_floor(0.01f, false))) < 1e-6);

  const auto absolute = finished<Exec>(values, n, false, only_floor(0.01f, true));
  CHECK(absolute[0] == Approx(0.01 / (0.64 + 64e-6)).epsilon(1e-5));
  CHECK(absolute[5] == Approx((0.01 + 64e-6) / (0.64 + 64e-6)).epsilon(1e-5));

  for (bool hemisphere : {false, true})
    for (bool is_absolute : {false, true}) {
      const auto black = finished<Exec>(std::vector<float>(n * n, 0.0f), n, hemisphere,
                                        {0.8f, is_absolute ? 0.0f : 0.01f, is_absolute});
      for (double p : black) CHECK(p == 1.0 / (n * n));
    }
}

}  // namespace
