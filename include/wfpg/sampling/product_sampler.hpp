// Product sampling: a ray draws from a field times its own BSDF, in two levels (paper, section 3.6; thesis,
// section 4.5, Algorithms 6 and 7; after Conty Estevez & Lecocq 2018, "Fast Product Importance Sampling of
// Environment Maps"). The F x F cells of a field form P x P blocks. Their sums
// are multiplied by the BSDF, evaluated at a point or two in each, and summed; a direction is drawn
// from a block and then from the cells inside it. The density is that of what was evaluated, exactly:
// probability of the block times that of the cell inside it, over the cell's solid angle. The paper gives a
// ray's product to a warp; one thread a ray is several times faster on a GPU, since what a BSDF computes from
// the outgoing direction is computed once, all lanes read the same point, and no lane waits while one ray is
// served.
//
// Memory: 4 P² bytes a ray in work, and where a thread block serves a field's rays as many for the blocks'
// sums. Cost: P² evaluations of the BSDF a ray, and one more for each that is black; P F reads of the field
// where there are no such sums; a direction takes O(log P + F / P), a density O(1), or O(F / P) without sums.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/host/bsdf.hpp>
#include <wfpg/sampling/field_sampler.hpp>

#include <string>

namespace wfpg {

/// The largest P of products.
inline constexpr std::uint32_t max_product_resolution = 16;
/// Words that hold any product: 1 KiB.
inline constexpr std::uint32_t max_product_words = max_product_resolution * max_product_resolution;

/// A block as products see it: where they evaluate BSDFs, jittered anew for each sample and depth, so that a
/// lobe between points is not missed forever; and the mean of all its directions.
struct product_point {
  vec3 direction;  ///< unit length
  vec3 opposite;   ///< as far from the block's centre, where the BSDF is black at `direction`
  vec3 mean;       ///< of the block, shorter than 1
  float radius;    ///< about the mean, of a disk that spreads as much as the block
};

/// A wave's P² points over the hemisphere about +z and over the sphere, row by row.
struct product_points {
  const product_point* hemisphere = nullptr;  ///< P² points, in the policy's memory
  const product_point* sphere = nullptr;      ///< P² points, in the policy's memory
  std::uint32_t resolution = 0;               ///< P; 0: no products
};

/// A density over directions: a field times a BSDF, of one ray; or the field as it is, where it has the BSDF
/// in it already. A default one is empty.
class product_field {
 public:
  product_field() = default;
  /// The field as it is.
  WFPG_HD explicit product_field(const directional_field& field) : field_(field) {}
  /// `weights`: inclusive sums of the P² products, row by row, below 2³². `sums`: of the field's cells, a
  /// block; null: they are summed when they are asked for. All outlive this.
  WFPG_HD product_field(const directional_field& field, std::uint32_t resolution,
                        const std::uint32_t* weights, const std::uint32_t* sums = nullptr)
      : field_(field),
        weights_(weights),
        sums_(sums),
        resolution_(resolution),
        side_(field.grid().resolution() / resolution) {}

  /// Nothing to draw from: the BSDF is black wherever the field shines.
  WFPG_HD bool empty() const { return field_.empty() || (resolution_ > 0 && total() == 0); }

  /// The GGX roughness of a lobe as wide as two blocks, which so many points do not miss.
  WFPG_HD float resolved_alpha() const {
    return resolution_ > 0 ? 2.0f / static_cast<float>(resolution_) : field_.resolved_alpha();
  }

  /// A unit direction from u in [0,1)², and pdf() of it. Precondition: not empty.
  WFPG_HD vec3 sample(vec2 u, float& density) const {
    if (resolution_ == 0) return field_.sample(u, density);
    const auto drawn = detail::find_in_sums([this](std::uint32_t i) { return weights_[i]; },
                                            resolution_ * resolution_, 0, total(), u.x);
    std::uint32_t weight;
    const std::uint32_t whole = sum_of(drawn.index);
    const vec2 uv =
        field_.grid().sample(block(drawn.index), whole, {min(drawn.fraction, 1.0f - 0x1p-24f), u.y}, weight);
    density = cell_pdf(weight, whole, drawn.index);
    return field_.direction(uv);
  }

  /// The density of a unit direction, per steradian; 0 outside a hemisphere. Precondition: not empty.
  WFPG_HD float pdf(vec3 d) const {
    if (resolution_ == 0) return field_.pdf(d);
    vec2 uv;
    if (!field_.locate(d, uv)) return 0.0f;
    const std::uint32_t x = field_.grid().cell_along(uv.x), y = field_.grid().cell_along(uv.y);
    const std::uint32_t i = y / side_ * resolution_ + x / side_;
    return cell_pdf(field_.grid().weight(x, y), sum_of(i), i);
  }

 private:
  WFPG_HD std::uint32_t total() const { return weights_[resolution_ * resolution_ - 1]; }
  WFPG_HD cell_block block(std::uint32_t i) const {
    return {i % resolution_ * side_, i / resolution_ * side_, side_};
  }

  WFPG_HD std::uint32_t sum_of(std::uint32_t i) const {
    return sums_ ? sums_[i] : field_.grid().weight(block(i));
  }

  /// In a cell of block i, whose sum is `whole`.
  WFPG_HD float cell_pdf(std::uint32_t weight, std::uint32_t whole, std::uint32_t i) const {
    const std::uint32_t product = weights_[i] - (i > 0 ? weights_[i - 1] : 0u);
    if (product == 0) return 0.0f;
    return static_cast<float>(product) * static_cast<float>(weight) /
           (static_cast<float>(total()) * static_cast<float>(whole) * field_.cell_solid_angle());
  }

  directional_field field_;
  const std::uint32_t* weights_ = nullptr;
  const std::uint32_t* sums_ = nullptr;  // a block; null: not made
  std::uint32_t resolution_ = 0;         // P; 0: no product
  std::uint32_t side_ = 0;               // of a block, in cells
};

namespace detail {

/// Throws std::invalid_argument where P is not 0, 4, 8 or 16, or does not divide the resolution of that name.
inline void require_product_resolution(std::uint32_t p, const char* name, std::uint32_t resolution) {
  require(p == 0 || p == 4 || p == 8 || p == max_product_resolution, "product_resolution", p,
          "0, 4, 8 or 16");
  require(p == 0 || resolution % p == 0, name, resolution,
          ("a multiple of product_resolution, " + std::to_string(p)).c_str());
}

/// The mean over a block of the cosine at a normal where that is positive, if the block's cosines are spread
/// evenly over `radius` about their mean: exact above the horizon, 0 below it.
WFPG_HD inline float mean_cosine(float cosine, float radius) {
  const float above = clamp(cosine + radius, 0.0f, 2.0f * radius);
  return above * above / (4.0f * radius) + max(cosine - radius, 0.0f);
}

/// What a BSDF does to a block of a field; `up` is the shading normal on the outgoing side. Its value at the
/// block's point is that of the block but for the cosine, which varies most there and is replaced by its
/// mean; and taken out where the field carries it. A block across the horizon counts though its point is
/// below.
template <class Bsdf>
WFPG_HD inline float block_factor(const surface<Bsdf>& s, vec3 up, const directional_field& field,
                                  const product_point& local) {
  const float cosine = glm::dot(field.to_world(local.mean), up);
  if (cosine <= -local.radius && !s.bsdf.transmits()) return 0.0f;
  vec3 direction = field.to_world(local.direction);
  float value = s.bsdf.eval(s.outgoing, direction);
  if (value == 0.0f) {
    direction = field.to_world(local.opposite);
    value = s.bsdf.eval(s.outgoing, direction);
  }
  if (!(value > 0.0f) || !is_finite(value)) return 0.0f;
  const float there = glm::dot(direction, up);
  const float mean = mean_cosine(there >= 0.0f ? cosine : -cosine, local.radius);
  const float carried = field.hemisphere() ? local.mean.z : 1.0f;
  return min(value, 1.0e25f) * mean / (max(fabsf(there), 1.0e-3f) * carried);
}

/// Whether a field has a surface's BSDF in it already: the cosine about its normal, and there is no narrow
/// part. Fields over hemispheres carry the cosine.
template <class Bsdf>
WFPG_HD bool has_product(const directional_field& field, const surface<Bsdf>& s, vec3 up) {
  if constexpr (!has_glossy_part_v<Bsdf>)
    return false;
  else
    return field.hemisphere() && glm::dot(field.normal(), up) > 0.99f && !s.bsdf.transmits() &&
           s.bsdf.glossy(s.outgoing).share == 0.0f;
}

}  // namespace detail

/// Measures the blocks, once: f(i) for i in [0, P²).
struct measure_product_blocks {
  product_point* hemisphere;
  product_point* sphere;
  std::uint32_t resolution;

  WFPG_HD void operator()(std::size_t i) const {
    constexpr int n = 8;  // of the midpoint rule, along a side
    const vec2 corner(static_cast<float>(i % resolution), static_cast<float>(i / resolution));
    vec3 above(0.0f), around(0.0f);
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
  /// 1 - |mean|² is the variance of the block's directions, half of it along any line through the block; an
  /// even spread over [-r, r] has r²/3.
  WFPG_HD static float radius(vec3 mean) { return sqrtf(1.5f * max(1.0f - glm::dot(mean, mean), 0.0f)); }
};

/// Draws a wave's points in measured blocks: f(i) for i in [0, P²).
struct draw_product_points {
  product_point* hemisphere;
  product_point* sphere;
  std::uint32_t resolution;
  std::uint64_t seed;

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

/// Sums row `y` of a field's P x P blocks into P words. Each row of cells is read once. O(F^2 / P).
WFPG_HD inline void sum_block_row(const grid_distribution& grid, std::uint32_t p, std::uint32_t y,
                                  std::uint32_t* sums) {
  const std::uint32_t side = grid.resolution() / p;
  for (std::uint32_t x = 0; x < p; ++x) sums[x] = 0;
  for (std::uint32_t row = y * side; row < (y + 1) * side; ++row) {
    std::uint32_t before = 0;
    for (std::uint32_t x = 0; x < p; ++x) {
      const std::uint32_t prefix = grid.through((x + 1) * side - 1, row);
      sums[x] += prefix - before;
      before = prefix;
    }
  }
}

/// Multiplies a field by a surface's BSDF; `words` holds P², which the product reads as long as it lives;
/// `sums` as product_field has them. Weights are integers, scaled by the largest of them: exact in every sum.
/// Of a delta BSDF nothing is left.
template <class Bsdf>
WFPG_HD product_field multiply_field(const directional_field& field, const product_points& points,
                                     const surface<Bsdf>& s, std::uint32_t* words,
                                     const std::uint32_t* sums = nullptr) {
  if (s.bsdf.is_delta()) return {};
  const vec3 up = facing_normal(s);
  if (detail::has_product(field, s, up)) return product_field(field);
  const std::uint32_t p = points.resolution;
  const product_point* const local = field.hemisphere() ? points.hemisphere : points.sphere;
  for (std::uint32_t y = 0; !sums && y < p; ++y) sum_block_row(field.grid(), p, y, words + y * p);
  float brightest = 0.0f;
  for (std::uint32_t i = 0; i < p * p; ++i) {
    const std::uint32_t sum = sums ? sums[i] : words[i];
    const float product =
        sum > 0 ? static_cast<float>(sum) * detail::block_factor(s, up, field, local[i]) : 0.0f;
    words[i] = float_bits(product);
    brightest = max(brightest, product);
  }
  if (!(brightest > 1.0e-25f)) return {};
  const float scale = 0x1p31f / static_cast<float>(p * p) / brightest;
  std::uint32_t through = 0;
  for (std::uint32_t i = 0; i < p * p; ++i) {
    const float product = bits_float(words[i]);
    if (product > 0.0f) through += max(static_cast<std::uint32_t>(product * scale), 1u);
    words[i] = through;
  }
  return {field, p, words, sums};
}

}  // namespace wfpg
