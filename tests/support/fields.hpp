// Fields for the tests of samplers: cell values of many kinds, and distributions that a policy builds from
// them.
#pragma once

#include "support/evaluate.hpp"
#include "support/policies.hpp"

#include <wfpg/sampling/field_sampler.hpp>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace wfpg_test {

enum class field_kind : std::uint32_t { noise, delta, uniform, one_row, all_zero, extreme, count };

inline const char* name_of(field_kind kind) {
  static constexpr const char* names[] = {"noise", "delta", "uniform", "one row", "all zero", "extreme"};
  return names[static_cast<std::uint32_t>(kind)];
}

/// F² values of a kind. `noise` includes zeros, `extreme` spans 30 orders of magnitude.
inline std::vector<float> field_values(field_kind kind, std::uint32_t resolution, std::uint64_t seed) {
  random_numbers random(seed);
  std::vector<float> values(std::size_t(resolution) * resolution, 0.0f);
  const std::uint32_t row = random.below(resolution);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const float u = random.unit();
    if (kind == field_kind::noise) values[i] = u < 0.25f ? 0.0f : u;
    if (kind == field_kind::uniform) values[i] = 3.0f;
    if (kind == field_kind::one_row && i / resolution == row) values[i] = 0.1f + u;
    if (kind == field_kind::extreme) values[i] = std::pow(10.0f, 30.0f * u - 15.0f);
  }
  if (kind == field_kind::delta) values[random.below(static_cast<std::uint32_t>(values.size()))] = 7.0f;
  return values;
}

/// The expected probabilities of cells, from their values alone.
inline std::vector<double> cell_probabilities(const std::vector<float>& values, float floor = 0.0f) {
  std::vector<double> result;
  double sum = 0.0;
  for (float value : values) sum += double(value) + double(floor);
  for (float value : values)
    result.push_back(sum > 0.0 ? (double(value) + double(floor)) / sum : 1.0 / double(values.size()));
  return result;
}

/// The words that a distribution is built in: cell values, and room for the rest.
inline std::vector<std::uint32_t> words_of(const std::vector<float>& values, std::uint32_t resolution) {
  std::vector<std::uint32_t> words;
  for (float value : values) words.push_back(wfpg::float_bits(value));
  words.resize(wfpg::grid_distribution::words(resolution));
  return words;
}

struct build_grid {
  std::uint32_t* words;
  std::uint32_t resolution;
  float floor;
  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t) const {
    wfpg::build_distribution(block, {words}, static_cast<int>(resolution), floor);
  }
};

/// A distribution in a policy's memory. The policy builds it.
template <class Exec>
class built_field {
 public:
  built_field(const Exec& exec, const std::vector<float>& values, std::uint32_t resolution,
              float floor = 0.0f)
      : words_(exec, words_of(values, resolution)), resolution_(resolution) {
    exec.for_each_block(1, 0, build_grid{words_.data(), resolution, floor});
  }

  wfpg::grid_distribution grid() const { return {words_.data(), resolution_}; }
  std::vector<std::uint32_t> words(const Exec& exec) const { return words_.to_host(exec); }

 private:
  wfpg::buffer<std::uint32_t, Exec> words_;
  std::uint32_t resolution_;
};

/// The weights of a distribution's cells, row by row.
template <class Exec>
std::vector<std::uint32_t> cell_weights(const Exec& exec, const wfpg::grid_distribution& grid) {
  const std::uint32_t n = grid.resolution();
  return evaluate(exec, std::size_t(n) * n, [=] WFPG_HD(std::size_t i) {
    return grid.weight(static_cast<std::uint32_t>(i) % n, static_cast<std::uint32_t>(i) / n);
  });
}

}  // namespace wfpg_test
