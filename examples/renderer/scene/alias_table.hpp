// Chooses one of many in proportion to their weights in constant time, by Walker's alias method. Tables are
// built as in Vose 1991, "A Linear Algorithm for Generating Random Numbers with a Given Distribution".
#pragma once

#include <wfpg/base/types.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace render {

/// A column of the table: its own element with a probability, else the other one.
struct alias_column {
  float probability = 1.0f;
  std::uint32_t other = 0;
};

/// An element from u in [0,1)². One number would have too little precision left to choose inside one of many
/// columns. Precondition: the table is not empty.
WFPG_HD inline std::uint32_t pick(wfpg::array_view<const alias_column> table, wfpg::vec2 u) {
  const auto last = static_cast<std::uint32_t>(table.size() - 1);
  const auto drawn = static_cast<std::uint32_t>(u.x * static_cast<float>(table.size()));
  const std::uint32_t column = drawn < last ? drawn : last;
  return u.y < table[column].probability ? column : table[column].other;
}

/// The table for weights >= 0. At least one must be positive.
inline std::vector<alias_column> make_alias_table(const std::vector<double>& weights) {
  double sum = 0.0;
  for (const double weight : weights) sum += weight;
  const auto count = static_cast<double>(weights.size());
  std::vector<double> fractions;  // of a column, 1 on average
  std::vector<std::uint32_t> small, large;
  for (const double weight : weights) {
    auto& group = weight * count < sum ? small : large;
    group.push_back(static_cast<std::uint32_t>(fractions.size()));
    fractions.push_back(weight * count / sum);
  }
  // Fills each small column from a large one. Columns that rounding leaves at the end count as full.
  std::vector<alias_column> table(weights.size());
  while (!small.empty() && !large.empty()) {
    const std::uint32_t from = large.back(), to = small.back();
    small.pop_back();
    table[to] = {static_cast<float>(fractions[to]), from};
    fractions[from] -= 1.0 - fractions[to];
    if (fractions[from] < 1.0) {
      large.pop_back();
      small.push_back(from);
    }
  }
  return table;
}

}  // namespace render
