// An irradiance record, 16 x 8 directions with a 4-bit counter each (Jhang & Chang, "An Unbiased Hybrid
// Rendering Approach to Path Guiding", section 4), and what rays draw from in one. The paper does not say
// which directions, nor how it draws: here they have equal solid angle, 16 steps of azimuth about y times 8
// steps of y, and counters times a cosine are drawn from by inversion, in integers, so that a density is
// exact.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/normal_lattice.hpp>
#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/sampling/field_sampler.hpp>

namespace wfpg {

/// Light that arrives at a voxel, by direction: 64 bytes.
struct alignas(16) irradiance_record {
  static constexpr std::uint32_t columns = 16;            ///< steps of azimuth about y
  static constexpr std::uint32_t rows = 8;                ///< steps of y
  static constexpr std::uint32_t cells = columns * rows;  ///< directions, of 4 pi / 128 steradians each
  static constexpr std::uint32_t most = 15;               ///< of a counter

  std::uint64_t words[rows];  ///< a row: 16 counters, the first in the lowest bits

  /// Radiance along a cell's directions, in units of a 15th of the record's largest, rounded up.
  WFPG_HD std::uint32_t counter(std::uint32_t cell) const {
    return static_cast<std::uint32_t>(words[cell / columns] >> 4 * (cell % columns)) & most;
  }

  /// The cell of a unit direction.
  WFPG_HD static std::uint32_t cell_of(vec3 d) {
    const std::uint32_t quadrant = d.z < 0.0f ? (d.x < 0.0f ? 2u : 3u) : (d.x > 0.0f ? 0u : 1u);
    const float along = fabsf(quadrant % 2 == 0 ? d.x : d.z), across = fabsf(quadrant % 2 == 0 ? d.z : d.x);
    const float turn = 4.0f * detail::quarters_of(along, across);  // of NaN, max gives 0
    const auto column = static_cast<std::uint32_t>(min(max(0.0f, turn), 3.0f));
    const float up = 4.0f * d.y + 4.0f;
    const auto row = static_cast<std::uint32_t>(min(max(0.0f, up), 7.0f));
    return row * columns + quadrant * 4 + column;
  }
  /// A unit direction of a cell; `inside` in [0,1]².
  WFPG_HD static vec3 direction(std::uint32_t cell, vec2 inside) {
    const std::uint32_t column = cell % columns;
    const vec2 p = detail::quarter_turn((static_cast<float>(column % 4) + inside.x) * 0.25f);
    const float y = (static_cast<float>(cell / columns) + inside.y) * 0.25f - 1.0f;
    const float r = sqrtf(max(1.0f - y * y, 0.0f));
    const bool swaps = column / 4 % 2 != 0, left = column / 4 == 1 || column / 4 == 2, back = column >= 8;
    const float x = swaps ? p.y : p.x, z = swaps ? p.x : p.y;
    return {left ? -r * x : r * x, y, back ? -r * z : r * z};
  }
};

static_assert(sizeof(irradiance_record) == 64);

namespace detail {

/// Cosines at the middles of a record's cells, in integers: no compiler rounds them otherwise. A cell that
/// reaches above the surface by ever so little has one above zero, since no middle is further from its
/// cell's edge than 30 degrees in the two rows at the poles and 14 in the others.
class record_cosines {
 public:
  record_cosines() = default;
  WFPG_HD explicit record_cosines(vec3 normal)
      : x_(scaled(normal.x)), y_(scaled(normal.y)), z_(scaled(normal.z)) {}

  /// In [0, 192].
  WFPG_HD std::uint32_t operator()(std::uint32_t cell) const {
    const std::uint32_t column = cell % irradiance_record::columns, row = cell / irradiance_record::columns;
    const std::uint32_t from_pole = row < 4 ? row : 7 - row;
    const int radius = entry(0xfeedc87cu, from_pole), height = 64 * static_cast<int>(row) - 224;
    const int p = entry(0x328ed5fbu, column % 4), q = entry(0x328ed5fbu, 3 - column % 4);
    const bool swaps = column / 4 % 2 != 0, left = column / 4 == 1 || column / 4 == 2, back = column >= 8;
    const int x = swaps ? q : p, z = swaps ? p : q;
    const int level = ((left ? -x_ : x_) * x + (back ? -z_ : z_) * z) * radius + y_ * height * 256;
    const int reach = from_pole == 0 ? 1 << 23 : 1 << 22;  // 0.5 and 0.25 of 2²⁴
    return static_cast<std::uint32_t>(max(level + reach, 0)) >> 17;
  }

 private:
  WFPG_HD static int scaled(float x) { return static_cast<int>(256.5f + 256.0f * x) - 256; }
  /// One of four bytes: sines of the middles' polar angles, or cosines of the azimuths' first four, in
  /// 256ths.
  WFPG_HD static int entry(std::uint32_t bytes, std::uint32_t i) {
    return static_cast<int>(bytes >> 8 * i & 255u);
  }

  int x_ = 0, y_ = 0, z_ = 0;
};

/// Cosines of a record's cells above a normal, where the products of four cells with their counters are
/// summed in one multiplication: in the topmost 16 of its 64 bits. Of columns alike modulo 4 the first is
/// topmost. No sum of a row, 16 · 15 · 192 at most, leaves its 16 bits.
class cell_cosines {
 public:
  static constexpr std::uint32_t groups = 4;  ///< of a row: columns alike modulo 4

  cell_cosines() = default;
  WFPG_HD explicit cell_cosines(const record_cosines& cosine_of) {
    for (std::uint32_t cell = 0; cell < irradiance_record::cells; ++cell) set(cell, cosine_of(cell));
  }
  /// The same for all.
  WFPG_HD static cell_cosines flat() {
    cell_cosines result;
    for (std::uint32_t cell = 0; cell < irradiance_record::cells; ++cell) result.set(cell, 1);
    return result;
  }

  WFPG_HD std::uint32_t operator()(std::uint32_t cell) const {
    return static_cast<std::uint32_t>(lanes_[cell / columns][cell % groups] >> shift(cell)) & 0xffffu;
  }
  WFPG_HD std::uint32_t sum(std::uint32_t row) const { return sums_[row]; }
  WFPG_HD std::uint32_t sum(std::uint32_t row, std::uint32_t group) const {
    return static_cast<std::uint32_t>(lanes_[row][group] * 0x0001000100010001u >> 48);
  }
  /// Times the counters of a record's row.
  WFPG_HD std::uint32_t dot(std::uint64_t counters, std::uint32_t row) const {
    std::uint64_t sums = 0;
    for (std::uint32_t group = 0; group < groups; ++group) sums += products(counters, row, group);
    return static_cast<std::uint32_t>(sums >> 48);
  }
  WFPG_HD std::uint32_t dot(std::uint64_t counters, std::uint32_t row, std::uint32_t group) const {
    return static_cast<std::uint32_t>(products(counters, row, group) >> 48);
  }

 private:
  static constexpr std::uint32_t columns = irradiance_record::columns;

  WFPG_HD static std::uint32_t shift(std::uint32_t cell) { return 48 - 16 * (cell % columns / groups); }
  WFPG_HD void set(std::uint32_t cell, std::uint32_t cosine) {
    lanes_[cell / columns][cell % groups] |= std::uint64_t(cosine) << shift(cell);
    sums_[cell / columns] += cosine;
  }
  WFPG_HD std::uint64_t products(std::uint64_t counters, std::uint32_t row, std::uint32_t group) const {
    return (counters >> 4 * group & 0x000f000f000f000fu) * lanes_[row][group];
  }

  std::uint64_t lanes_[irradiance_record::rows][groups] = {};
  std::uint32_t sums_[irradiance_record::rows] = {};
};

/// Those above each normal of a lattice, and flat ones behind them.
struct tabulate_cell_cosines {
  normal_lattice normals;
  cell_cosines* table;
  WFPG_HD void operator()(std::size_t i) const {
    table[i] = i == normals.size()
                   ? cell_cosines::flat()
                   : cell_cosines(record_cosines(normals.normal(static_cast<std::uint32_t>(i))));
  }
};

/// Weights of a record's rows above one normal. All zero: those of a record without light.
struct alignas(16) record_rows {
  std::uint32_t weights[irradiance_record::rows] = {};
  std::uint32_t base = 0;    ///< of each direction, before its cosine
  std::uint32_t normal = 0;  ///< whose cosines these are, by its number in a table

  static constexpr std::uint32_t counter_scale = 1024;

  record_rows() = default;
  /// `floor`: what each direction has at least, times the record's mean; at most 1.
  WFPG_HD record_rows(const irradiance_record& record, float floor, const cell_cosines* table,
                      std::uint32_t normal)
      : base(base_of(record, floor)), normal(normal) {
    const cell_cosines& cosines = table[normal];
    for (std::uint32_t row = 0; row < irradiance_record::rows; ++row)
      weights[row] = cosines.dot(record.words[row], row) * counter_scale + base * cosines.sum(row);
  }
  WFPG_HD std::uint32_t total() const {
    std::uint32_t result = 0;
    for (const std::uint32_t weight : weights) result += weight;
    return result;
  }

 private:
  WFPG_HD static std::uint32_t base_of(const irradiance_record& record, float floor) {
    std::uint32_t counters = 0;
    for (const std::uint64_t word : record.words) {
      constexpr std::uint64_t every_other = 0x0f0f0f0f0f0f0f0fu;
      const std::uint64_t pairs = (word & every_other) + (word >> 4 & every_other);
      counters += static_cast<std::uint32_t>(pairs * 0x0101010101010101u >> 56);
    }
    constexpr float share = static_cast<float>(counter_scale) / static_cast<float>(irradiance_record::cells);
    return static_cast<std::uint32_t>(ceilf(floor * share * static_cast<float>(counters)));
  }
};

/// What a mixture (mis.hpp) draws from. A record without light is empty, and so is one that has none above
/// the surface where there is no floor.
class record_distribution {
 public:
  record_distribution() = default;
  /// The record times cosines, those that the rows' weights are made with.
  WFPG_HD record_distribution(const irradiance_record* record, const cell_cosines* cosines,
                              const record_rows& rows)
      : record_(record), cosines_(cosines), rows_(rows), total_(rows.total()) {}

  WFPG_HD bool empty() const { return total_ == 0; }
  /// It knows of no lobe but the diffuse one.
  WFPG_HD static constexpr float resolved_alpha() { return directional_field::resolved_alpha(); }

  /// A unit direction from u in [0,1)², and pdf() of it. Precondition: not empty.
  WFPG_HD vec3 sample(vec2 u, float& density) const {
    const auto scaled = static_cast<std::uint64_t>(u.x * 0x1p24f) * total_;
    auto target = static_cast<std::uint32_t>(scaled >> 24);
    const auto row = find<irradiance_record::rows>(target, [&](std::uint32_t r) { return rows_.weights[r]; });
    const auto group =
        find<cell_cosines::groups>(target, [&](std::uint32_t g) { return group_weight(row, g); });
    const auto cell_in_group = [&](std::uint32_t k) {
      return row * irradiance_record::columns + group + cell_cosines::groups * k;
    };
    const std::uint32_t cell =
        cell_in_group(find<cells_a_group>(target, [&](std::uint32_t k) { return weight(cell_in_group(k)); }));
    const std::uint32_t width = weight(cell);
    density = density_of(width);
    const float rest = static_cast<float>(scaled & 0xffffffu) * 0x1p-24f;
    const float inside = (static_cast<float>(target) + rest) / static_cast<float>(width);
    return irradiance_record::direction(cell, {inside_cell(inside), inside_cell(u.y)});
  }
  /// The density of a unit direction, per steradian. Precondition: not empty.
  WFPG_HD float pdf(vec3 d) const { return density_of(weight(irradiance_record::cell_of(d))); }

 private:
  static constexpr std::uint32_t cells_a_group = irradiance_record::columns / cell_cosines::groups;

  WFPG_HD std::uint32_t weight(std::uint32_t cell) const {
    return (record_->counter(cell) * record_rows::counter_scale + rows_.base) * (*cosines_)(cell);
  }
  WFPG_HD std::uint32_t group_weight(std::uint32_t row, std::uint32_t group) const {
    return cosines_->dot(record_->words[row], row, group) * record_rows::counter_scale +
           rows_.base * cosines_->sum(row, group);
  }
  /// Which of n weights a target lies in; what is before it is taken off. Precondition: it lies in one.
  template <std::uint32_t n, class Weight>
  WFPG_HD static std::uint32_t find(std::uint32_t& target, const Weight& weight_of) {
    std::uint32_t found = 0, before = 0, through = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      through += weight_of(i);
      const bool passed = through <= target;
      found += passed ? 1u : 0u;
      before = passed ? through : before;
    }
    target -= before;
    return found;
  }
  WFPG_HD float density_of(std::uint32_t weight) const {
    constexpr float cells_per_steradian = static_cast<float>(irradiance_record::cells) / (4.0f * pi);
    return static_cast<float>(weight) / static_cast<float>(total_) * cells_per_steradian;
  }

  const irradiance_record* record_ = nullptr;
  const cell_cosines* cosines_ = nullptr;
  record_rows rows_;
  std::uint32_t total_ = 0;
};

/// Radiances of a record's cells to its counters.
struct count_record {
  const float* radiance;  // a cell of a record
  irradiance_record* records;

  WFPG_HD void operator()(std::size_t i) const {
    const float* const from = radiance + i * irradiance_record::cells;
    float peak = 0.0f;
    for (std::uint32_t cell = 0; cell < irradiance_record::cells; ++cell) peak = max(peak, from[cell]);
    const float scale = peak > 1.0e-30f ? static_cast<float>(irradiance_record::most) / peak : 0.0f;
    irradiance_record record{};
    for (std::uint32_t cell = 0; cell < irradiance_record::cells; ++cell) {
      const float counted = min(ceilf(from[cell] * scale), static_cast<float>(irradiance_record::most));
      const auto counter = static_cast<std::uint64_t>(counted);
      record.words[cell / irradiance_record::columns] |= counter << 4 * (cell % irradiance_record::columns);
    }
    records[i] = record;
  }
};

}  // namespace detail
}  // namespace wfpg
