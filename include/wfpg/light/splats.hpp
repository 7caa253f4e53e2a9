// Splats: what light paths bring to pixels of their own choice, summed into a picture. A place has one splat:
// each light path has a place for its newest vertex, or each stored vertex has one. Splats are sorted by
// pixel, so that the sums have the same bits on any policy and with any number of threads.
//
//   exec.for_each(places, kernel);        // calls splats.view().add(place, pixel, value), or skip(place)
//   splats.add_to(exec, pixels, scale);   // pixels[pixel] += scale * value, for all of them
//
// Source: light tracing, Veach 1997, section 10.3.4. Sums in the order of places are wfpg's own.
// Cost: one stable sort of (pixel, place) pairs and one scan. A pixel's splats are added by one thread.
// Memory: 32 bytes a place, and about 8 more while it sorts.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/bins/partitioner.hpp>
#include <wfpg/exec/buffer.hpp>

#include <cstdint>

namespace wfpg {

/// View of splats for kernels. Trivially copyable. Calls for one place come from one thread at a time.
class splat_view {
 public:
  /// A view of no places.
  splat_view() = default;
  /// A view of arrays of one length. `none` marks places without a splat.
  WFPG_HD splat_view(array_view<std::uint32_t> pixels, array_view<vec3> values, std::uint32_t none)
      : pixels_(pixels), values_(values), none_(none) {}

  /// Number of places.
  WFPG_HD std::size_t size() const { return pixels_.size(); }
  /// Leaves a value for a pixel, in place of what the place had. O(1). Preconditions: place < size(), and
  /// the pixel is one of the picture's.
  /// `pixel`: index in the picture that add_to() is given.
  /// `value`: linear RGB, not scaled yet. It may be negative or not finite, and is added as it is.
  WFPG_HD void add(std::size_t place, std::uint32_t pixel, vec3 value) const {
    pixels_[place] = pixel;
    values_[place] = value;
  }
  /// Leaves nothing at a place. O(1). Precondition: place < size(). A place that no call was made for since
  /// the last add_to() is empty too.
  WFPG_HD void skip(std::size_t place) const { pixels_[place] = none_; }

 private:
  // An element a place. A value is not read where the pixel is none_.
  array_view<std::uint32_t> pixels_;
  array_view<vec3> values_;
  std::uint32_t none_ = 0xffffffffu;
};

namespace detail {

/// Kernel: adds one pixel's splats to it, in the order of their places. A thread for each group of places
/// with one pixel. There are no more groups than places.
struct add_splats {
  partition_view by_pixel;        ///< places, grouped by pixel
  array_view<const vec3> values;  ///< by place
  array_view<vec3> pixels;        ///< the picture
  float scale;                    ///< of all values
  WFPG_HD void operator()(std::size_t group) const {
    if (group >= *by_pixel.count) return;
    // The sum begins at 0, not at the pixel, so that it has the same bits in any picture.
    const std::uint32_t begin = by_pixel.begin(group), end = begin + by_pixel.size(group);
    vec3 sum(0.0f);
    for (std::uint32_t i = begin; i < end; ++i) sum += values[by_pixel.permutation[i]];
    pixels[by_pixel.key(group)] += scale * sum;
  }
};

}  // namespace detail

/// Owns the places of splats. Movable, not copyable; the policy's memory must outlive it.
template <class Exec>
class splats {
 public:
  /// Has no places.
  splats() = default;
  /// Allocates places, all empty.
  /// `places`: most splats at a time.
  /// `pixels`: number of the picture's pixels, at least 1.
  /// Throws out_of_memory, and std::invalid_argument where either is 2³² - 1 or more or there are no pixels.
  splats(const Exec& exec, std::size_t places, std::size_t pixels)
      : key_bits_(bits_of(pixels)),
        pixels_(exec, checked(places)),
        values_(exec, places),
        by_pixel_(exec, places) {
    clear(exec, places);
  }

  /// View for kernels, valid as long as the owner is not moved.
  splat_view view() { return {pixels_.view(), values_.view(), partitioner<Exec>::excluded}; }

  /// Adds all splats times `scale` to a picture, and empties all places. The order of additions depends on
  /// nothing but places. On a GPU it returns before the work is done. O(places). Throws out_of_memory.
  /// `picture`: has an element a pixel, as many as the constructor was told.
  /// `scale`: for means over light paths, one over their number.
  void add_to(const Exec& exec, array_view<vec3> picture, float scale) {
    add_to(exec, picture, scale, pixels_.size());
  }
  /// Likewise those of the first n places. The others must be empty. O(n).
  void add_to(const Exec& exec, array_view<vec3> picture, float scale, std::size_t n) {
    const array_view<const std::uint32_t> pixels(pixels_.data(), n);
    const partition_view by_pixel = by_pixel_.partition(exec, pixels, key_bits_);
    exec.for_each(n, detail::add_splats{by_pixel, values_.view(), picture, scale});
    clear(exec, n);
  }

  /// Bytes allocated, without the sort's temporaries.
  std::size_t bytes() const { return pixels_.bytes() + values_.bytes() + by_pixel_.bytes(); }

 private:
  /// Bits of keys below `pixels` and of one that is larger than all of them.
  static int bits_of(std::size_t pixels) {
    require(pixels > 0 && pixels < 0xffffffffull, "number of pixels", pixels, "from 1 to 2^32 - 2");
    int bits = 1;
    while (bits < 32 && (std::uint64_t(1) << bits) <= pixels) ++bits;
    return bits;
  }
  // Checks the number before memory is asked for.
  static std::size_t checked(std::size_t places) {
    require(places < 0xffffffffull, "number of splats", places, "less than 2^32 - 1");
    return places;
  }
  // Empties the first n places.
  void clear(const Exec& exec, std::size_t n) {
    exec.fill_bytes(pixels_.data(), 0xff, n * sizeof(std::uint32_t));
  }

  int key_bits_ = 1;  // of pixels, and of the key of empty places
  // An element a place each.
  buffer<std::uint32_t, Exec> pixels_;
  buffer<vec3, Exec> values_;
  partitioner<Exec> by_pixel_;
};

}  // namespace wfpg
