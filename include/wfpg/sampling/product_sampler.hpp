// Product sampling: a ray draws from a field times its own BSDF, in two levels (paper, section 3.6; thesis,
// section 4.5, Algorithms 6 and 7). After Conty Estevez & Lecocq 2018, "Fast Product Importance Sampling of
// Environment Maps".
//
// The F x F cells of a field form P x P blocks. The sum of each block's cells is multiplied by the BSDF,
// which is evaluated at a point or two of the block. A direction is drawn from a block, and then from the
// cells inside it. The density is exact for what was evaluated. It is the probability of the block, times
// that of the cell inside it, over the cell's solid angle.
//
// The paper gives a ray's product to a warp. One thread a ray is several times faster on a GPU, for three
// reasons. What a BSDF computes from the outgoing direction is computed once. All lanes read one point
// together. No lane waits while another ray is sampled.
//
// Memory: 4 P² bytes a ray in work. Where a thread block samples a field's rays, the blocks' sums take 4 P²
// more. Cost: P² evaluations of the BSDF a ray, and one more for each that is black. Without such sums a ray
// also reads P F sums of the field. A direction takes O(log P + F / P). A density takes O(1), or O(F / P)
// without sums.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/host/bsdf.hpp>
#include <wfpg/sampling/field_sampler.hpp>

#include <string>

namespace wfpg {

/// Largest P, the number of blocks along a side of a product.
inline constexpr std::uint32_t max_product_resolution = 16;
/// Number of 32-bit words that hold any product: 256, 1 KiB.
inline constexpr std::uint32_t max_product_words = max_product_resolution * max_product_resolution;

/// A block of directions and where products evaluate BSDFs in it, in the local space of the octahedral map.
/// The point is jittered anew for each sample and depth, so that no lobe between points is missed forever.
struct product_point {
  vec3 direction;  ///< a random direction of the block, unit length
  /// The direction mirrored at the block's centre, unit length. The BSDF is evaluated there where it is black
  /// at `direction`.
  vec3 opposite;
  vec3 mean;     ///< mean of the block's directions, shorter than 1
  float radius;  ///< of a disk about `mean` that spreads as much as the block
};

/// A wave's P² points over the hemisphere about +z and P² over the sphere, row by row. All rays of a wave
/// share them.
struct product_points {
  /// P² points, in the policy's memory, for fields over a hemisphere.
  const product_point* hemisphere = nullptr;
  const product_point* sphere = nullptr;  ///< P² points for fields over the sphere
  std::uint32_t resolution = 0;           ///< P; 0: no products
};

/// A probability density over directions: the product of a field and one ray's BSDF. It may also be the field
/// as it is, where the field has the BSDF in it already. A default-constructed one is empty.
class product_field {
 public:
  /// A product with nothing to draw from.
  product_field() = default;
  /// Wraps a field as it is, without a product.
  WFPG_HD explicit product_field(const directional_field& field) : field_(field) {}
  /// Product over P x P blocks; `resolution` is P and divides F. `weights`: inclusive sums of the P²
  /// products, row by row, below 2³². `sums`: weight of the field's cells in each block. Without `sums` they
  /// are summed where they are needed. The field's memory and both arrays must outlive the product.
  WFPG_HD product_field(const directional_field& field, std::uint32_t resolution,
                        const std::uint32_t* weights, const std::uint32_t* sums = nullptr)
      : field_(field),
        weights_(weights),
        sums_(sums),
        resolution_(resolution),
        side_(field.grid().resolution() / resolution) {}

  /// Returns true where there is nothing to draw from: no field, or a BSDF that is black wherever the field
  /// shines.
  WFPG_HD bool empty() const { return field_.empty() || (resolution_ > 0 && total() == 0); }

  /// GGX roughness of a lobe that is two blocks wide: 2 / P. Wider lobes are not missed by P² points. Without
  /// a product it is the field's.
  WFPG_HD float resolved_alpha() const {
    return resolution_ > 0 ? 2.0f / static_cast<float>(resolution_) : field_.resolved_alpha();
  }

  /// Draws a unit direction from u in [0,1)² and sets `density` to its pdf(). u.x chooses the block and what
  /// is left of it the column; u.y chooses the row in the block. Precondition: not empty.
  WFPG_HD vec3 sample(vec2 u, float& density) const {
    if (resolution_ == 0) return field_.sample(u, density);
    // First level: one of P² blocks, by its product.
    const auto drawn = detail::find_in_sums([this](std::uint32_t i) { return weights_[i]; },
                                            resolution_ * resolution_, 0, total(), u.x);
    std::uint32_t weight;
    // Second level: a cell of that block, by the field alone. The rest of u.x is a fresh number in [0, 1).
    const std::uint32_t whole = sum_of(drawn.index);
    const vec2 uv =
        field_.grid().sample(block(drawn.index), whole, {min(drawn.fraction, 1.0f - 0x1p-24f), u.y}, weight);
    density = cell_pdf(weight, whole, drawn.index);
    return field_.direction(uv);
  }

  /// Density of a unit direction, per steradian; 0 outside a hemisphere. Precondition: empty() is false.
  WFPG_HD float pdf(vec3 d) const {
    if (resolution_ == 0) return field_.pdf(d);
    vec2 uv;
    if (!field_.locate(d, uv)) return 0.0f;
    const std::uint32_t x = field_.grid().cell_along(uv.x), y = field_.grid().cell_along(uv.y);
    const std::uint32_t i = y / side_ * resolution_ + x / side_;
    return cell_pdf(field_.grid().weight(x, y), sum_of(i), i);
  }

 private:
  /// Sum of all P² products.
  WFPG_HD std::uint32_t total() const { return weights_[resolution_ * resolution_ - 1]; }
  /// The cells of block i, which is in column i mod P and row i / P.
  WFPG_HD cell_block block(std::uint32_t i) const {
    return {i % resolution_ * side_, i / resolution_ * side_, side_};
  }

  /// Weight of the field in block i: read, or summed in O(F / P).
  WFPG_HD std::uint32_t sum_of(std::uint32_t i) const {
    return sums_ ? sums_[i] : field_.grid().weight(block(i));
  }

  /// Density in a cell of block i, per steradian. `weight`: the cell's, `whole`: the block's.
  WFPG_HD float cell_pdf(std::uint32_t weight, std::uint32_t whole, std::uint32_t i) const {
    // Probability of the block, times that of the cell in it, over the cell's solid angle.
    const std::uint32_t product = weights_[i] - (i > 0 ? weights_[i - 1] : 0u);
    if (product == 0) return 0.0f;
    return static_cast<float>(product) * static_cast<float>(weight) /
           (static_cast<float>(total()) * static_cast<float>(whole) * field_.cell_solid_angle());
  }

  directional_field field_;  ///< the field that is multiplied
  /// Inclusive sums of the P² products; null without a product.
  const std::uint32_t* weights_ = nullptr;  ///< inclusive sums of P² products; null without a product
  const std::uint32_t* sums_ = nullptr;     ///< a block: weight of its cells; null: not made
  std::uint32_t resolution_ = 0;            ///< P; 0: no product
  std::uint32_t side_ = 0;                  ///< cells along a block's side, F / P
};

namespace detail {

/// Throws std::invalid_argument where P is not 0, 4, 8 or 16, or does not divide `resolution`, which the
/// message calls `name`.
WFPG_COLD inline void require_product_resolution(std::uint32_t p, const char* name,
                                                 std::uint32_t resolution) {
  require(p == 0 || p == 4 || p == 8 || p == max_product_resolution, "product_resolution", p,
          "0, 4, 8 or 16");
  require(p == 0 || resolution % p == 0, name, resolution,
          ("a multiple of product_resolution, " + std::to_string(p)).c_str());
}

/// Mean over a block of the cosine at a normal, clamped to 0 below the horizon. `cosine`: that of the block's
/// mean direction. The block's cosines are taken to spread evenly over `radius` about it. Blocks that lie
/// wholly above give `cosine`, those wholly below give 0.
WFPG_HD inline float mean_cosine(float cosine, float radius) {
  const float above = clamp(cosine + radius, 0.0f, 2.0f * radius);
  return above * above / (4.0f * radius) + max(cosine - radius, 0.0f);
}

/// The BSDF times cosine of a block, without the cosine that the field carries already. `up` is the shading
/// normal on the outgoing side. The BSDF's value at the block's point stands for the block. The cosine varies
/// most there, so it is replaced by its mean over the block. A block across the horizon counts though its
/// point is below. Values are capped at 1e25; what is NaN, infinite or not positive gives 0.
template <class Bsdf>
WFPG_HD inline float block_factor(const surface<Bsdf>& s, vec3 up, const directional_field& field,
                                  const product_point& local) {
  const float cosine = glm::dot(field.to_world(local.mean), up);
  if (cosine <= -local.radius && !s.bsdf.transmits()) return 0.0f;
  vec3 direction = field.to_world(local.direction);
  float value = s.bsdf.eval(s.outgoing, direction);
  // One point may miss a lobe at the block's other side, and a block at 0 would never be drawn.
  if (value == 0.0f) {
    direction = field.to_world(local.opposite);
    value = s.bsdf.eval(s.outgoing, direction);
  }
  if (!(value > 0.0f) || !is_finite(value)) return 0.0f;
  // eval() has the cosine at the point in it. It is divided out, and the block's mean cosine put in its
  // place.
  const float there = glm::dot(direction, up);
  const float mean = mean_cosine(there >= 0.0f ? cosine : -cosine, local.radius);
  // A field over a hemisphere has the cosine about its own normal, which is z in its local space.
  const float carried = field.hemisphere() ? local.mean.z : 1.0f;
  return min(value, 1.0e25f) * mean / (max(fabsf(there), 1.0e-3f) * carried);
}

/// Returns true where a field has a surface's BSDF in it already. Such a field covers a hemisphere and
/// carries the cosine about its normal, which is within 8 degrees of `up`. The BSDF does not transmit, and
/// its glossy() reports no narrow part. BSDFs without glossy() are always multiplied.
template <class Bsdf>
WFPG_HD bool has_product(const directional_field& field, const surface<Bsdf>& s, vec3 up) {
  if constexpr (!has_glossy_part_v<Bsdf>)
    return false;
  else
    return field.hemisphere() && glm::dot(field.normal(), up) > 0.99f && !s.bsdf.transmits() &&
           s.bsdf.glossy(s.outgoing).fraction == 0.0f;
}

}  // namespace detail

/// Functor that measures the blocks, once: sets mean and radius of point i in both arrays. Run for i in [0,
/// P²). It sets directions to zero, for draw_product_points to fill.
struct measure_product_blocks {
  /// Receives P² points over the hemisphere.
  product_point* hemisphere;
  /// Receives P² points over the sphere.
  product_point* sphere;
  /// P, at least 1.
  std::uint32_t resolution;

  /// Measures block i by 64 points of the midpoint rule.
  WFPG_HD void operator()(std::size_t i) const {
    constexpr int n = 8;  // of the midpoint rule, along a side
    const vec2 corner(static_cast<float>(i % resolution), static_cast<float>(i / resolution));
    vec3 above(0.0f), around(0.0f);
    // The maps keep areas, so an even grid in the square is an even grid over directions.
    for (int k = 0; k < n * n; ++k) {
      const vec2 inside(static_cast<float>(k % n) + 0.5f, static_cast<float>(k / n) + 0.5f);
      const vec2 uv = (corner + inside / static_cast<float>(n)) / static_cast<float>(resolution);
      above += square_to_hemisphere(uv) / static_cast<float>(n * n);
      around += square_to_sphere(uv) / static_cast<float>(n * n);
    }
    hemisphere[i] = {vec3(0.0f), vec3(0.0f), above, radius(above)};
    sphere[i] = {vec3(0.0f), vec3(0.0f), around, radius(around)};
  }

 private:
  /// Radius of a block with this mean direction. 1 - |mean|² is the variance of the block's directions, and
  /// half of it lies along any line through the block. An even spread over [-r, r] has r² / 3.
  WFPG_HD static float radius(vec3 mean) { return sqrtf(1.5f * max(1.0f - glm::dot(mean, mean), 0.0f)); }
};

/// Functor that draws a wave's points in measured blocks: sets direction and opposite of point i in both
/// arrays. Run for i in [0, P²), for each wave.
struct draw_product_points {
  /// P² measured points over the hemisphere, of which the directions are replaced.
  product_point* hemisphere;
  /// Those over the sphere.
  product_point* sphere;
  /// P, for which the arrays were measured.
  std::uint32_t resolution;
  /// Seed of the jitter; another one for each wave.
  std::uint64_t seed;

  /// Draws the point of block i, and the one mirrored at the block's centre.
  WFPG_HD void operator()(std::size_t i) const {
    const vec2 corner(static_cast<float>(i % resolution), static_cast<float>(i / resolution));
    const vec2 jitter = unit_vec2(hash(seed, i));
    const vec2 uv = (corner + jitter) / static_cast<float>(resolution);
    const vec2 opposite = (corner + 1.0f - jitter) / static_cast<float>(resolution);
    hemisphere[i].direction = square_to_hemisphere(uv);
    hemisphere[i].opposite = square_to_hemisphere(opposite);
    sphere[i].direction = square_to_sphere(uv);
    sphere[i].opposite = square_to_sphere(opposite);
  }
};

/// Sums row `y` of a field's P x P blocks into the P words `sums`. Each row of cells is read once. O(F): P
/// sums in each of F / P rows. Precondition: `p`, which is P, divides F.
WFPG_HD inline void sum_block_row(const grid_distribution& grid, std::uint32_t p, std::uint32_t y,
                                  std::uint32_t* sums) {
  const std::uint32_t side = grid.resolution() / p;
  for (std::uint32_t x = 0; x < p; ++x) sums[x] = 0;
  for (std::uint32_t row = y * side; row < (y + 1) * side; ++row) {
    // Two neighbouring sums of a row give the weight of its cells in one block.
    std::uint32_t before = 0;
    for (std::uint32_t x = 0; x < p; ++x) {
      const std::uint32_t prefix = grid.prefix((x + 1) * side - 1, row);
      sums[x] += prefix - before;
      before = prefix;
    }
  }
}

/// Multiplies a field by a surface's BSDF. `words` holds P² words, which the product reads as long as it
/// lives. `sums` is as in product_field's constructor. The result is empty for delta BSDFs, and where no
/// block's product exceeds 1e-25. It is the field itself where that has the BSDF in it already. Weights are
/// integers, scaled by the largest, so every sum of them is exact. A block with a positive product keeps a
/// weight of at least 1. Precondition: `points.resolution` is positive and divides F.
template <class Bsdf>
WFPG_HD product_field multiply_field(const directional_field& field, const product_points& points,
                                     const surface<Bsdf>& s, std::uint32_t* words,
                                     const std::uint32_t* sums = nullptr) {
  // A delta BSDF is black at every point; mixtures do not guide it.
  if (s.bsdf.is_delta()) return {};
  const vec3 up = facing_normal(s);
  if (detail::has_product(field, s, up)) return product_field(field);
  const std::uint32_t p = points.resolution;
  const product_point* const local = field.hemisphere() ? points.hemisphere : points.sphere;
  for (std::uint32_t y = 0; !sums && y < p; ++y) sum_block_row(field.grid(), p, y, words + y * p);
  // Products as floats, in the words that later hold their integer sums.
  float brightest = 0.0f;
  for (std::uint32_t i = 0; i < p * p; ++i) {
    const std::uint32_t sum = sums ? sums[i] : words[i];
    const float product =
        sum > 0 ? static_cast<float>(sum) * detail::block_factor(s, up, field, local[i]) : 0.0f;
    words[i] = float_bits(product);
    brightest = max(brightest, product);
  }
  if (!(brightest > 1.0e-25f)) return {};
  // Even if all blocks were as bright as the brightest, the sum would be 2³¹.
  const float scale = 0x1p31f / static_cast<float>(p * p) / brightest;
  std::uint32_t prefix = 0;
  for (std::uint32_t i = 0; i < p * p; ++i) {
    const float product = bits_float(words[i]);
    // No block that reflects anything is rounded to 0.
    if (product > 0.0f) prefix += max(static_cast<std::uint32_t>(product * scale), 1u);
    words[i] = prefix;
  }
  return {field, p, words, sums};
}

}  // namespace wfpg
