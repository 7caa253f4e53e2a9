// Small arithmetic for host and device: float bits, finite tests, hashing, random numbers, bases.
// It survives fast-math flags: what must recognise NaN, infinity or a sign works on bits.
// Sources stand with each function. Cost: a few instructions each, O(1). Memory: none.
#pragma once

#include <wfpg/base/types.hpp>

#include <cstring>

namespace wfpg {

/// The ratio of a circle's circumference to its diameter, rounded to float.
inline constexpr float pi = 3.14159265358979323846f;

/// Returns the IEEE 754 bits of `x`: sign in bit 31, exponent in bits 30 to 23, mantissa below.
/// Copies bytes, since a cast of the pointer is undefined in C++. Compilers make it one move.
WFPG_HD inline std::uint32_t float_bits(float x) {
  std::uint32_t bits;
  memcpy(&bits, &x, sizeof bits);
  return bits;
}

/// Returns the float with these bits. Inverse of float_bits().
/// Any bits are allowed: those of NaN and infinity too.
WFPG_HD inline float bits_float(std::uint32_t bits) {
  float x;
  memcpy(&x, &bits, sizeof x);
  return x;
}

/// Returns whether `x` is neither NaN nor infinite.
/// Tests the exponent's bits, since fast-math compilers may assume that every float is finite.
WFPG_HD inline bool is_finite(float x) {
  return (float_bits(x) & 0x7f800000u) != 0x7f800000u;
}
/// Returns whether `x` is neither NaN nor infinite; by the 11 bits of a double's exponent.
WFPG_HD inline bool is_finite(double x) {
  std::uint64_t bits;
  memcpy(&bits, &x, sizeof bits);
  return (bits & 0x7ff0000000000000u) != 0x7ff0000000000000u;
}
/// Returns whether all three components are finite.
/// False where a single one is NaN or infinite.
WFPG_HD inline bool is_finite(vec3 v) {
  return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}

/// Returns whether `x` lies in [0, end). Precondition: `end` is positive and not NaN.
/// NaN and negative numbers are outside; -0 counts as 0.
/// Compares bits, whose order is that of floats where neither is negative.
/// One comparison thus tests both ends, and no flag of the compiler removes it.
WFPG_HD inline bool is_in_range(float x, float end) {
  return float_bits(x) < float_bits(end) || float_bits(x) == 0x80000000u;
}

/// Returns the number of significant bits: the least b with x < 2^b, in [0, 32]. bits_of(0) is 0.
WFPG_HD constexpr int bits_of(std::uint32_t x) {
  int bits = 0;
  for (; x > 0; x >>= 1) ++bits;
  return bits;
}

/// Returns the lesser of two values, and `a` where neither is less. Unlike std::min, device code can call it.
template <class T>
WFPG_HD constexpr T min(T a, T b) {
  return b < a ? b : a;
}
/// Returns the greater of two values, and `a` where neither is greater.
template <class T>
WFPG_HD constexpr T max(T a, T b) {
  return a < b ? b : a;
}
/// Returns the value of [low, high] that is nearest to `x`. Precondition: low <= high.
/// With low > high the result is `high`.
template <class T>
WFPG_HD constexpr T clamp(T x, T low, T high) {
  return min(max(x, low), high);
}

/// Functor that merges two boxes, for reductions. Associative and commutative.
/// Its neutral element is a default bounds3.
struct bounds_union {
  /// Returns the smallest box around `a` and `b`. Either may be empty: the result is then the other one.
  WFPG_HD bounds3 operator()(const bounds3& a, const bounds3& b) const {
    return {{min(a.lower.x, b.lower.x), min(a.lower.y, b.lower.y), min(a.lower.z, b.lower.z)},
            {max(a.upper.x, b.upper.x), max(a.upper.y, b.upper.y), max(a.upper.z, b.upper.z)}};
  }
};

/// Returns a well mixed word for a word; one-to-one, and 0 stays 0.
/// Source: the 64-bit finaliser of MurmurHash3 (Appleby, 2011).
/// Each bit of the input changes each bit of the output with a probability of about one half.
WFPG_HD inline std::uint64_t mix_bits(std::uint64_t x) {
  x ^= x >> 33;
  x *= 0xff51afd7ed558ccdull;
  x ^= x >> 33;
  x *= 0xc4ceb9fe1a85ec53ull;
  return x ^ (x >> 33);
}

/// Returns the hash of a sequence with one more word: hash(hash(seed, a), b) and so on.
/// Counter-based random numbers come from it: no generator's state is stored.
/// The two words are combined as by boost::hash_combine, with 64 bits of the golden ratio, and then mixed.
/// Not for security. The order of the words matters.
WFPG_HD inline std::uint64_t hash(std::uint64_t state, std::uint64_t word) {
  return mix_bits(state ^ (word + 0x9e3779b97f4a7c15ull + (state << 6) + (state >> 2)));
}

/// Returns the 32-bit hash of a sequence with one more word.
/// Cheaper than hash() on GPUs, which multiply 32 bits at a time.
/// For numbers that a frame draws by the million.
/// Source of the finaliser: C. Wellons, "Prospecting for hash functions", 2018.
WFPG_HD inline std::uint32_t hash32(std::uint32_t state, std::uint32_t word) {
  std::uint32_t x = state + word * 0x9e3779b9u;
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}

/// Returns a number of [0, 1) from the upper 24 of 32 random bits: a multiple of 2^-24, at most 1 - 2^-24.
/// All of these are exact floats. The lower 8 bits are ignored.
WFPG_HD inline float unit_float(std::uint32_t bits) {
  return static_cast<float>(bits >> 8) * 0x1p-24f;
}

/// Returns a point of [0, 1)² from 64 random bits: x from the lower half, y from the upper one.
/// Each coordinate is a unit_float().
WFPG_HD inline vec2 unit_vec2(std::uint64_t bits) {
  return {unit_float(static_cast<std::uint32_t>(bits)), unit_float(static_cast<std::uint32_t>(bits >> 32))};
}

/// Returns a point of [0, 1)² from 32 random bits, 16 for each coordinate: multiples of 2^-16.
/// Enough where 65536 strata a coordinate are: placing a point inside a small cell, for instance.
WFPG_HD inline vec2 coarse_vec2(std::uint32_t bits) {
  return vec2{static_cast<float>(bits & 0xffffu), static_cast<float>(bits >> 16)} * 0x1p-16f;
}

/// An orthonormal, right-handed basis whose z axis is a given unit normal. 36 bytes.
/// Source: Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
struct frame {
  /// First tangent, unit length, world space.
  vec3 x{1.0f, 0.0f, 0.0f};
  /// Second tangent: cross(z, x).
  vec3 y{0.0f, 1.0f, 0.0f};
  /// The normal that the frame is made for.
  vec3 z{0.0f, 0.0f, 1.0f};

  /// The axes of world space.
  frame() = default;
  /// A basis around `normal`, which must have unit length.
  /// No direction is singular; the tangents jump where normal.z changes its sign.
  WFPG_HD explicit frame(vec3 normal) : z(normal) {
    const float sign = z.z < 0.0f ? -1.0f : 1.0f;
    const float a = -1.0f / (sign + z.z);
    const float b = z.x * z.y * a;
    x = {1.0f + sign * z.x * z.x * a, sign * b, -sign * z.x};
    y = {b, sign + z.y * z.y * a, -z.y};
  }

  /// Returns a local vector in world space. Keeps lengths.
  /// A vector of length 1 therefore stays a direction, without normalisation. 9 multiplications.
  WFPG_HD vec3 to_world(vec3 local) const { return local.x * x + local.y * y + local.z * z; }
  /// Returns a vector of world space in this basis. Inverse of to_world().
  /// Its z is the cosine of the angle to the normal, for a unit vector.
  WFPG_HD vec3 to_local(vec3 world) const {
    return {glm::dot(world, x), glm::dot(world, y), glm::dot(world, z)};
  }
};

}  // namespace wfpg
