// Small arithmetic that survives fast-math flags: bit tests, counter-based hashing, orthonormal frames.
#pragma once

#include <wfpg/base/types.hpp>

#include <cstring>

namespace wfpg {

inline constexpr float pi = 3.14159265358979323846f;

WFPG_HD inline std::uint32_t float_bits(float x) {
  std::uint32_t bits;
  memcpy(&bits, &x, sizeof bits);
  return bits;
}

WFPG_HD inline float bits_float(std::uint32_t bits) {
  float x;
  memcpy(&x, &bits, sizeof x);
  return x;
}

/// Neither NaN nor infinite; by bits, since compilers may assume that of every float.
WFPG_HD inline bool is_finite(float x) {
  return (float_bits(x) & 0x7f800000u) != 0x7f800000u;
}
WFPG_HD inline bool is_finite(double x) {
  std::uint64_t bits;
  memcpy(&bits, &x, sizeof bits);
  return (bits & 0x7ff0000000000000u) != 0x7ff0000000000000u;
}
WFPG_HD inline bool is_finite(vec3 v) {
  return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}

/// In [0, end), for a positive end; by bits, whose order is that of floats where neither is negative.
WFPG_HD inline bool is_in_range(float x, float end) {
  return float_bits(x) < float_bits(end) || float_bits(x) == 0x80000000u;
}

/// How many bits a number has: the least b with x < 2^b.
WFPG_HD constexpr int bits_of(std::uint32_t x) {
  int bits = 0;
  for (; x > 0; x >>= 1) ++bits;
  return bits;
}

template <class T>
WFPG_HD constexpr T min(T a, T b) {
  return b < a ? b : a;
}
template <class T>
WFPG_HD constexpr T max(T a, T b) {
  return a < b ? b : a;
}
template <class T>
WFPG_HD constexpr T clamp(T x, T low, T high) {
  return min(max(x, low), high);
}

/// The smallest box around two; a functor for reductions.
struct bounds_union {
  /// The box around a and b, either of which may be empty.
  WFPG_HD bounds3 operator()(const bounds3& a, const bounds3& b) const {
    return {{min(a.lower.x, b.lower.x), min(a.lower.y, b.lower.y), min(a.lower.z, b.lower.z)},
            {max(a.upper.x, b.upper.x), max(a.upper.y, b.upper.y), max(a.upper.z, b.upper.z)}};
  }
};

/// A well mixed word from a word (the finaliser of MurmurHash3, 64 bits).
WFPG_HD inline std::uint64_t mix_bits(std::uint64_t x) {
  x ^= x >> 33;
  x *= 0xff51afd7ed558ccdull;
  x ^= x >> 33;
  x *= 0xc4ceb9fe1a85ec53ull;
  return x ^ (x >> 33);
}

/// A hash of the words so far and one more: hash(hash(seed, a), b), ...
WFPG_HD inline std::uint64_t hash(std::uint64_t state, std::uint64_t word) {
  return mix_bits(state ^ (word + 0x9e3779b97f4a7c15ull + (state << 6) + (state >> 2)));
}

/// The same in 32 bits, for what is drawn millions of times and needs no more (finaliser by C. Wellons,
/// "Prospecting for hash functions", 2018).
WFPG_HD inline std::uint32_t hash32(std::uint32_t state, std::uint32_t word) {
  std::uint32_t x = state + word * 0x9e3779b9u;
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}

/// [0, 1) from the upper 24 of 32 bits.
WFPG_HD inline float unit_float(std::uint32_t bits) {
  return static_cast<float>(bits >> 8) * 0x1p-24f;
}

/// [0, 1)² from 64 bits.
WFPG_HD inline vec2 unit_vec2(std::uint64_t bits) {
  return {unit_float(static_cast<std::uint32_t>(bits)), unit_float(static_cast<std::uint32_t>(bits >> 32))};
}

/// [0, 1)² from 32 bits.
WFPG_HD inline vec2 coarse_vec2(std::uint32_t bits) {
  return vec2{static_cast<float>(bits & 0xffffu), static_cast<float>(bits >> 16)} * 0x1p-16f;
}

/// An orthonormal basis whose z is a unit normal (Duff et al. 2017, "Building an Orthonormal Basis,
/// Revisited").
struct frame {
  vec3 x{1.0f, 0.0f, 0.0f};
  vec3 y{0.0f, 1.0f, 0.0f};
  vec3 z{0.0f, 0.0f, 1.0f};

  frame() = default;
  WFPG_HD explicit frame(vec3 normal) : z(normal) {
    const float sign = z.z < 0.0f ? -1.0f : 1.0f;
    const float a = -1.0f / (sign + z.z);
    const float b = z.x * z.y * a;
    x = {1.0f + sign * z.x * z.x * a, sign * b, -sign * z.x};
    y = {b, sign + z.y * z.y * a, -z.y};
  }

  WFPG_HD vec3 to_world(vec3 local) const { return local.x * x + local.y * y + local.z * z; }
  WFPG_HD vec3 to_local(vec3 world) const {
    return {glm::dot(world, x), glm::dot(world, y), glm::dot(world, z)};
  }
};

}  // namespace wfpg
