// An irradiance record: the light that arrives at a voxel, in 16 x 8 directions with a 4-bit counter each.
// Also the distribution that rays sample from it: counters times the cosine at the surface.
//
// The paper gives neither the directions nor the sampling, which are wfpg's own. Directions have equal solid
// angle: 16 steps of azimuth about y times 8 steps of y. Sampling is by inversion in integers, so that
// densities are exact.
//
// Source: Jhang & Chang, "An Unbiased Hybrid Rendering Approach to Path Guiding", section 4.
// Cost: a direction takes some 100 integer operations, and 200 more above a normal without row sums. A
// density beside it takes a few.
// Memory: 64 bytes a record, 48 for its row sums, and 288 for the cosines of each of 290 normals.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/normal_lattice.hpp>
#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/sampling/field_sampler.hpp>

namespace wfpg {

/// Light that arrives at a voxel, by direction. 64 bytes. A cell is a range of directions of equal radiance;
/// cells are numbered row by row, from y = -1 up. A row's first cell begins at the x axis and turns toward z.
struct alignas(16) irradiance_record {
  static constexpr std::uint32_t columns = 16;            ///< cells of a row: steps of azimuth about y
  static constexpr std::uint32_t rows = 8;                ///< rows of cells: steps of y in [-1, 1]
  static constexpr std::uint32_t cells = columns * rows;  ///< cells of a record, 4 pi / 128 steradians each
  static constexpr std::uint32_t most = 15;               ///< largest value of a counter

  std::uint64_t words[rows];  ///< 16 counters of a row, 4 bits each, the first in the lowest bits

  /// Radiance that arrives in cell `cell`, in [0, 15]: in 15ths of the record's largest, rounded up. So only
  /// cells without light have 0.
  WFPG_HD std::uint32_t counter(std::uint32_t cell) const {
    return static_cast<std::uint32_t>(words[cell / columns] >> 4 * (cell % columns)) & most;
  }

  /// The cell of a unit direction, in [0, cells), also for directions with NaN.
  WFPG_HD static std::uint32_t cell_of(vec3 d) {
    // The quadrant by signs, then the place in it by the angle between the axes, without trigonometry.
    const std::uint32_t quadrant = d.z < 0.0f ? (d.x < 0.0f ? 2u : 3u) : (d.x > 0.0f ? 0u : 1u);
    const float along = fabsf(quadrant % 2 == 0 ? d.x : d.z), across = fabsf(quadrant % 2 == 0 ? d.z : d.x);
    const float turn = 4.0f * detail::quarters_of(along, across);  // of NaN, max gives 0
    const auto column = static_cast<std::uint32_t>(min(max(0.0f, turn), 3.0f));
    // Rows are even steps of y: bands of a sphere between parallels have areas by their heights.
    const float up = 4.0f * d.y + 4.0f;
    const auto row = static_cast<std::uint32_t>(min(max(0.0f, up), 7.0f));
    return row * columns + quadrant * 4 + column;
  }
  /// A unit direction of a cell, at the place `inside` in [0,1]²: azimuth and y. Uniform numbers give uniform
  /// directions of the cell.
  WFPG_HD static vec3 direction(std::uint32_t cell, vec2 inside) {
    const std::uint32_t column = cell % columns;
    const vec2 p = detail::quarter_turn((static_cast<float>(column % 4) + inside.x) * 0.25f);
    const float y = (static_cast<float>(cell / columns) + inside.y) * 0.25f - 1.0f;
    const float r = sqrtf(max(1.0f - y * y, 0.0f));
    // From the first quadrant into the cell's: odd ones swap x and z, and signs follow.
    const bool swaps = column / 4 % 2 != 0, left = column / 4 == 1 || column / 4 == 2, back = column >= 8;
    const float x = swaps ? p.y : p.x, z = swaps ? p.x : p.y;
    return {left ? -r * x : r * x, y, back ? -r * z : r * z};
  }
};

// Four loads of 16 bytes fetch a record.
static_assert(sizeof(irradiance_record) == 64);

namespace detail {

/// Cosines between a normal and the middles of a record's cells. They are computed in integers, so that all
/// compilers get equal ones. An offset is added: a cell that reaches above the surface at all has a cosine
/// above 0. From a middle to its cell's edge it is at most 30 degrees in the rows at the poles, and 14 in the
/// others. The offsets are their sines, rounded up.
class record_cosines {
 public:
  /// Cosines to a normal of zero length.
  record_cosines() = default;
  /// Cosines to a unit normal, which is rounded to 256ths.
  WFPG_HD explicit record_cosines(vec3 normal)
      : x_(scaled(normal.x)), y_(scaled(normal.y)), z_(scaled(normal.z)) {}

  /// The cosine at a cell, plus the row's offset, in 128ths; clamped to [0, 192].
  WFPG_HD std::uint32_t operator()(std::uint32_t cell) const {
    const std::uint32_t column = cell % irradiance_record::columns, row = cell / irradiance_record::columns;
    // The middle of a cell in 256ths: the radius of its parallel and its height, then x and z on the unit
    // circle.
    const std::uint32_t from_pole = row < 4 ? row : 7 - row;
    const int radius = entry(0xfeedc87cu, from_pole), height = 64 * static_cast<int>(row) - 224;
    const int p = entry(0x328ed5fbu, column % 4), q = entry(0x328ed5fbu, 3 - column % 4);
    const bool swaps = column / 4 % 2 != 0, left = column / 4 == 1 || column / 4 == 2, back = column >= 8;
    const int x = swaps ? q : p, z = swaps ? p : q;
    // A dot product in 2²⁴ths: normal, circle and radius are 256ths each.
    const int level = ((left ? -x_ : x_) * x + (back ? -z_ : z_) * z) * radius + y_ * height * 256;
    const int reach = from_pole == 0 ? 1 << 23 : 1 << 22;  // 0.5 and 0.25 of 2²⁴
    return static_cast<std::uint32_t>(max(level + reach, 0)) >> 17;
  }

 private:
  /// In 256ths, rounded to the nearest.
  WFPG_HD static int scaled(float x) { return static_cast<int>(256.5f + 256.0f * x) - 256; }
  /// One of four bytes: sines of the middles' polar angles, or cosines of the azimuths' first four, in
  /// 256ths.
  WFPG_HD static int entry(std::uint32_t bytes, std::uint32_t i) {
    return static_cast<int>(bytes >> 8 * i & 255u);
  }

  // The normal in 256ths.
  int x_ = 0, y_ = 0, z_ = 0;
};

/// Table of a record's cosines to one normal, packed so that a multiplication sums four products. 288 bytes.
///
/// Four columns of a row that are equal modulo 4 are a group. A word has the cosines of a group, in 16 bits
/// each, the first topmost. The group's counters, spread to 16 bits each, are in the opposite order. So the
/// topmost 16 bits of the product are the sum of counter times cosine. No row's sum, 16 · 15 · 192 at most,
/// exceeds 16 bits.
class cell_cosines {
 public:
  static constexpr std::uint32_t groups = 4;  ///< groups of a row: column modulo 4

  /// All cosines are 0.
  cell_cosines() = default;
  /// Packs the cosines of all cells.
  WFPG_HD explicit cell_cosines(const record_cosines& cosine_of) {
    for (std::uint32_t cell = 0; cell < irradiance_record::cells; ++cell) set(cell, cosine_of(cell));
  }
  /// Cosines of 1 for all cells: products with them are the record itself.
  WFPG_HD static cell_cosines flat() {
    cell_cosines result;
    for (std::uint32_t cell = 0; cell < irradiance_record::cells; ++cell) result.set(cell, 1);
    return result;
  }

  /// The cosine of a cell, in [0, 192].
  WFPG_HD std::uint32_t operator()(std::uint32_t cell) const {
    return static_cast<std::uint32_t>(lanes_[cell / columns][cell % groups] >> shift(cell)) & 0xffffu;
  }
  /// Sum of a row's cosines.
  WFPG_HD std::uint32_t sum(std::uint32_t row) const { return sums_[row]; }
  /// Sum of the four cosines of a group.
  WFPG_HD std::uint32_t sum(std::uint32_t row, std::uint32_t group) const {
    return static_cast<std::uint32_t>(lanes_[row][group] * 0x0001000100010001u >> 48);
  }
  /// Sum of counter times cosine over a row; `counters` is irradiance_record::words[row]. 4 multiplications.
  WFPG_HD std::uint32_t dot(std::uint64_t counters, std::uint32_t row) const {
    std::uint64_t sums = 0;
    for (std::uint32_t group = 0; group < groups; ++group) sums += products(counters, row, group);
    return static_cast<std::uint32_t>(sums >> 48);
  }
  /// Sum of counter times cosine over a group of a row. One multiplication.
  WFPG_HD std::uint32_t dot(std::uint64_t counters, std::uint32_t row, std::uint32_t group) const {
    return static_cast<std::uint32_t>(products(counters, row, group) >> 48);
  }

 private:
  static constexpr std::uint32_t columns = irradiance_record::columns;

  /// Place of a cell's cosine in the word of its group.
  WFPG_HD static std::uint32_t shift(std::uint32_t cell) { return 48 - 16 * (cell % columns / groups); }
  /// Sets a cell that is 0 so far.
  WFPG_HD void set(std::uint32_t cell, std::uint32_t cosine) {
    lanes_[cell / columns][cell % groups] |= std::uint64_t(cosine) << shift(cell);
    sums_[cell / columns] += cosine;
  }
  /// The topmost 16 bits are the sum; those below are products that are not wanted.
  WFPG_HD std::uint64_t products(std::uint64_t counters, std::uint32_t row, std::uint32_t group) const {
    return (counters >> 4 * group & 0x000f000f000f000fu) * lanes_[row][group];
  }

  std::uint64_t lanes_[irradiance_record::rows][groups] = {};  ///< words of the groups of each row
  std::uint32_t sums_[irradiance_record::rows] = {};           ///< sum of the cosines of each row
};

/// Kernel that fills a table of cell_cosines: one for each normal of a lattice, and flat ones at its end, for
/// surfaces that transmit.
struct tabulate_cell_cosines {
  normal_lattice normals;  ///< 17 x 17 normals in irradiance_records
  cell_cosines* table;     ///< output, normals.size() + 1 elements

  /// Fills element `i`.
  WFPG_HD void operator()(std::size_t i) const {
    table[i] = i == normals.size()
                   ? cell_cosines::flat()
                   : cell_cosines(record_cosines(normals.normal(static_cast<std::uint32_t>(i))));
  }
};

/// Sums of a record's weights by row, above one normal. Sampling finds a row with them. 48 bytes. A cell's
/// weight is (counter · 1024 + base) · cosine. All sums are 0 where the record has no light.
struct alignas(16) record_rows {
  std::uint32_t weights[irradiance_record::rows] = {};  ///< sum of the weights of each row
  std::uint32_t base = 0;    ///< floor of each cell, in 1024ths of a counter's unit
  std::uint32_t normal = 0;  ///< index of the cosines in the table

  static constexpr std::uint32_t counter_scale = 1024;  ///< resolution of the floor

  /// Rows of a record without light.
  record_rows() = default;
  /// Sums a record's weights with the cosines table[normal]. `floor` is the least weight of a cell before its
  /// cosine, in multiples of the record's mean, in [0, 1]. 32 multiplications.
  WFPG_HD record_rows(const irradiance_record& record, float floor, const cell_cosines* table,
                      std::uint32_t normal)
      : base(base_of(record, floor)), normal(normal) {
    // The floor's part of a row needs no counters: it is the base times the row's cosines.
    const cell_cosines& cosines = table[normal];
    for (std::uint32_t row = 0; row < irradiance_record::rows; ++row)
      weights[row] = cosines.dot(record.words[row], row) * counter_scale + base * cosines.sum(row);
  }
  /// Sum of all weights, below 2^30.
  WFPG_HD std::uint32_t total() const {
    std::uint32_t result = 0;
    for (const std::uint32_t weight : weights) result += weight;
    return result;
  }

 private:
  /// The floor times the mean of the counters, rounded up. Sums the counters of a word by bytes.
  WFPG_HD static std::uint32_t base_of(const irradiance_record& record, float floor) {
    // Adds even and odd counters to bytes, then sums 8 bytes by a multiplication: at most 240, which is a
    // byte.
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

/// Distribution of directions by a record times cosines, for a mixture (sampling/mixture.hpp). Piecewise
/// constant over the cells. Refers to the record and the cosines, in the policy's memory.
class record_distribution {
 public:
  /// An empty distribution.
  record_distribution() = default;
  /// `rows` must be made from the same record and cosines.
  WFPG_HD record_distribution(const irradiance_record* record, const cell_cosines* cosines,
                              const record_rows& rows)
      : record_(record), cosines_(cosines), rows_(rows), total_(rows.total()) {}

  /// Whether there is nothing to sample: the record has no light, or none above the surface and no floor.
  WFPG_HD bool empty() const { return total_ == 0; }
  /// GGX roughness that the distribution resolves, for guided_part(): that of fields, since it accounts for
  /// no lobe but the diffuse one.
  WFPG_HD static constexpr float resolved_alpha() { return directional_field::resolved_alpha(); }

  /// Samples a unit direction from u in [0,1)² and writes its pdf(). Finds a row, a group and a cell, each by
  /// inversion of u.x, and a place inside the cell. Precondition: not empty.
  WFPG_HD vec3 sample(vec2 u, float& density) const {
    // A float in [0,1) has 24 bits. They choose an integer below the total; what remains of them is the place
    // inside the chosen weight, to be used again inside the cell.
    const auto scaled = static_cast<std::uint64_t>(u.x * 0x1p24f) * total_;
    auto target = static_cast<std::uint32_t>(scaled >> 24);
    const auto row = find<irradiance_record::rows>(target, [&](std::uint32_t r) { return rows_.weights[r]; });
    const auto group =
        find<cell_cosines::groups>(target, [&](std::uint32_t g) { return group_weight(row, g); });
    // A row, then one of its 4 groups, then one of the group's 4 cells: 16 steps instead of 128.
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
  /// Density of sample() at a unit direction, per steradian. O(1). Precondition: not empty.
  WFPG_HD float pdf(vec3 d) const { return density_of(weight(irradiance_record::cell_of(d))); }

 private:
  static constexpr std::uint32_t cells_a_group = irradiance_record::columns / cell_cosines::groups;

  /// Weight of a cell: what its row's sum has of it.
  WFPG_HD std::uint32_t weight(std::uint32_t cell) const {
    return (record_->counter(cell) * record_rows::counter_scale + rows_.base) * (*cosines_)(cell);
  }
  /// Sum of the weights of a group's four cells.
  WFPG_HD std::uint32_t group_weight(std::uint32_t row, std::uint32_t group) const {
    return cosines_->dot(record_->words[row], row, group) * record_rows::counter_scale +
           rows_.base * cosines_->sum(row, group);
  }
  /// Index of the weight, of n in a row, that `target` falls on; subtracts the weights before it from
  /// `target`. Always runs n steps, so that lanes stay together. Precondition: target is below the sum.
  template <std::uint32_t n, class Weight>
  WFPG_HD static std::uint32_t find(std::uint32_t& target, const Weight& weight_of) {
    std::uint32_t found = 0, before = 0, prefix = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      prefix += weight_of(i);
      const bool passed = prefix <= target;
      found += passed ? 1u : 0u;
      before = passed ? prefix : before;
    }
    target -= before;
    return found;
  }
  /// Density in a cell of this weight: its probability over its solid angle.
  WFPG_HD float density_of(std::uint32_t weight) const {
    constexpr float cells_per_steradian = static_cast<float>(irradiance_record::cells) / (4.0f * pi);
    return static_cast<float>(weight) / static_cast<float>(total_) * cells_per_steradian;
  }

  const irradiance_record* record_ = nullptr;  ///< read for the row of a sample, and for a cell's density
  const cell_cosines* cosines_ = nullptr;      ///< of the normal that `rows_` is for
  record_rows rows_;                           ///< row sums above that normal
  std::uint32_t total_ = 0;                    ///< sum of the rows' weights
};

/// Kernel that converts radiances of a record's cells to counters: in 15ths of the largest, rounded up. A
/// record whose largest radiance is 1e-30 or less has no light.
struct count_record {
  const float* radiance;       ///< of each cell of each record, at least 0 and finite
  irradiance_record* records;  ///< output

  WFPG_HD void operator()(std::size_t i) const {
    const float* const from = radiance + i * irradiance_record::cells;
    // Two passes over the record's radiances: the largest first, then each in units of it.
    float peak = 0.0f;
    for (std::uint32_t cell = 0; cell < irradiance_record::cells; ++cell) peak = max(peak, from[cell]);
    const float scale = peak > 1.0e-30f ? static_cast<float>(irradiance_record::most) / peak : 0.0f;
    irradiance_record record{};
    for (std::uint32_t cell = 0; cell < irradiance_record::cells; ++cell) {
      // Rounding can give a little more than 15 for the largest radiance.
      const float counted = min(ceilf(from[cell] * scale), static_cast<float>(irradiance_record::most));
      const auto counter = static_cast<std::uint64_t>(counted);
      record.words[cell / irradiance_record::columns] |= counter << 4 * (cell % irradiance_record::columns);
    }
    records[i] = record;
  }
};

}  // namespace detail
}  // namespace wfpg
