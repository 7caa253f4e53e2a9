// Kernels of a beam map: beams cut into pieces, and the boxes around them.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/prefix_search.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/host/geometry.hpp>
#include <wfpg/light/box_tree.hpp>
#include <wfpg/light/photon_estimators.hpp>

#include <thrust/functional.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/transform_reduce.h>

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace wfpg::detail {

/// A piece of a beam, by number from the beam's begin.
struct beam_piece {
  std::uint32_t beam, number, count;  ///< `count`: of the beam's pieces
};

/// Beams and how they are cut. Trivially copyable.
struct cut_beams {
  array_view<const path_beam> beams;
  float piece_length = 0.0f;  ///< longest piece

  /// Length of a beam. 0 where it is not finite, empty, or reaches beyond largest_coordinate: it has no
  /// pieces.
  WFPG_HD float length(std::size_t i) const {
    const path_beam& b = beams[i];
    const vec3 first = b.origin + b.begin * b.direction, last = b.origin + b.end * b.direction;
    const bool is_usable = is_finite(first) && is_finite(last) && is_finite(b.end - b.begin);
    return is_usable && b.end > b.begin ? b.end - b.begin : 0.0f;
  }
  /// Number of a beam's pieces.
  WFPG_HD std::uint32_t pieces(std::size_t i) const {
    const float all = length(i);
    if (!(all > 0.0f)) return 0;
    // Not more than 2^24, so that numbers of pieces are exact as floats.
    return static_cast<std::uint32_t>(min(std::ceil(all / piece_length), 16777216.0f));
  }
  /// A piece as a beam. Neighbours have the bits of the end that they share in common.
  WFPG_HD path_beam cut(const beam_piece& piece) const {
    path_beam b = beams[piece.beam];
    const float step = (b.end - b.begin) / static_cast<float>(piece.count);
    const float begin = b.begin, end = b.end;
    if (piece.number > 0) b.begin = begin + step * static_cast<float>(piece.number);
    b.end = piece.number + 1 < piece.count ? begin + step * static_cast<float>(piece.number + 1) : end;
    return b;
  }
};

/// Length of a beam, for a maximum.
struct beam_length {
  cut_beams cut;
  WFPG_HD float operator()(std::size_t i) const { return cut.length(i); }
};

/// Length of a beam in units of the longest one over 2^20, rounded up. Sums of integers have one order.
struct beam_length_units {
  cut_beams cut;
  float longest;
  WFPG_HD std::uint64_t operator()(std::size_t i) const {
    return static_cast<std::uint64_t>(std::ceil(cut.length(i) / longest * 0x1p20f));
  }
};

/// Kernel: writes how many pieces each beam has.
struct count_beam_pieces {
  cut_beams cut;
  array_view<std::uint64_t> counts;
  WFPG_HD void operator()(std::size_t i) const { counts[i] = cut.pieces(i); }
};

/// Kernel: finds the beam of each piece.
struct list_beam_pieces {
  array_view<const std::uint64_t> counts_prefix;
  beam_piece* pieces;
  WFPG_HD void operator()(std::size_t i) const {
    const auto n = static_cast<std::uint32_t>(counts_prefix.size());
    const auto found = search_prefix([&](std::uint32_t k) { return counts_prefix[k]; }, n, std::uint64_t(0),
                                     counts_prefix[n - 1], std::uint64_t(i));
    pieces[i] = {found.index, static_cast<std::uint32_t>(i - found.begin),
                 static_cast<std::uint32_t>(found.end - found.begin)};
  }
};

/// The box around what merges with a piece.
struct beam_piece_boxes {
  cut_beams cut;
  const beam_piece* pieces;
  float radius;
  WFPG_HD bounds3 operator()(std::size_t i) const {
    const path_beam b = cut.cut(pieces[i]);
    const vec3 first = b.origin + b.begin * b.direction, last = b.origin + b.end * b.direction;
    // Covers the rounding of both ends.
    const float margin = radius + 1e-5f * (b.end - b.begin);
    return {glm::min(first, last) - margin, glm::max(first, last) + margin};
  }
};

/// A piece as queries read it, at once.
struct alignas(16) placed_piece {
  path_beam beam;
};

/// Cuts pieces in the tree's order.
struct place_beam_pieces {
  box_tree_view tree;
  cut_beams cut;
  const beam_piece* pieces;
  placed_piece* placed;
  std::uint32_t* beams;
  WFPG_HD void operator()(std::size_t place) const {
    const beam_piece piece = pieces[tree.index(static_cast<std::uint32_t>(place))];
    placed[place] = {cut.cut(piece)};
    beams[place] = piece.beam;
  }
};

/// Length of the longest piece: as many pieces as allowed, but none shorter than the diameter of merges.
template <class Exec>
float longest_piece(const Exec& exec, array_view<const path_beam> beams, float radius,
                    std::size_t max_pieces) {
  const cut_beams whole{beams};
  const ::thrust::counting_iterator<std::size_t> first(0),
      last = first + static_cast<std::ptrdiff_t>(beams.size());
  const float longest = ::thrust::transform_reduce(exec.thrust(), first, last, beam_length{whole}, 0.0f,
                                                   ::thrust::maximum<float>());
  if (!(longest > 0.0f)) return 1.0f;
  const std::uint64_t units =
      ::thrust::transform_reduce(exec.thrust(), first, last, beam_length_units{whole, longest},
                                 std::uint64_t(0), ::thrust::plus<std::uint64_t>());
  // Each beam has less than one piece more than its length says.
  const std::size_t more = max_pieces - beams.size();
  const double allowed = more > 0 ? static_cast<double>(units) * 0x1p-20 / static_cast<double>(more) : 1.0;
  // Rounded up, so that no beam has a piece too many.
  const float piece = longest * static_cast<float>(allowed) * 1.00001f;
  return max(min(piece, longest * 1.00001f), 2.0f * radius);
}

}  // namespace wfpg::detail
