// GPU instructions that compilers do not choose by themselves. Plain C++ elsewhere.
#pragma once

#include <wfpg/base/math.hpp>

namespace render::detail {

/// 1 + q / 2^15 for byte number `i` of a word, a float that needs no conversion. `one` is byte_float_base,
/// best from memory, so that the compiler does not know its value.
inline constexpr std::uint32_t byte_float_base = 0x3f800000u;
WFPG_HD inline float byte_float(std::uint32_t word, int i, std::uint32_t one) {
#if defined(__CUDA_ARCH__)
  return __uint_as_float(__byte_perm(word, one, 0x7604u | static_cast<unsigned>(i) << 4));
#else
  return wfpg::bits_float((word >> (8 * i) & 0xffu) << 8 | one);
#endif
}

/// The largest of four floats, of which the last is not negative. Compares them as integers, which have the
/// same order except for negative floats.
WFPG_HD inline float largest_of(float a, float b, float c, float not_negative) {
#if defined(__CUDA_ARCH__)
  return fmaxf(__int_as_float(__vimax3_s32(__float_as_int(a), __float_as_int(b), __float_as_int(c))),
               not_negative);
#else
  return fmaxf(fmaxf(a, b), fmaxf(c, not_negative));
#endif
}

/// The smallest of four floats, or any negative one if there is one.
WFPG_HD inline float smallest_of(float a, float b, float c, float d) {
#if defined(__CUDA_ARCH__)
  return __int_as_float(
      min(__vimin3_s32(__float_as_int(a), __float_as_int(b), __float_as_int(c)), __float_as_int(d)));
#else
  return fminf(fminf(a, b), fminf(c, d));
#endif
}

/// The number of active lanes of the warp.
WFPG_HD inline int lanes_here() {
#if defined(__CUDA_ARCH__)
  return __popc(__activemask());
#else
  return 32;
#endif
}

}  // namespace render::detail
