// Photon beams in media, found by distance: all that a camera beam merges with, each once. The radius is that
// of an iteration, and the map is built anew for each.
//
//   beam_map<Exec> map;
//   map.build(exec, beams, {radius, max_pieces});   // beams[i] is the beam with index i
//   const beam_map_view view = map.view();          // for kernels
//   view.for_each_beam_along(camera, kernel, [&](std::uint32_t i, const merge_geometry& at) { ... });
//
// Boxes around long beams would be mostly empty. Beams are therefore cut into pieces of similar length, as
// many as memory allows. A piece answers for its own interval alone, so that no beam merges twice.
//
// Sources: Moonen & Jalba 2023, "Efficient Hardware Acceleration of Robust Volumetric Light Transport
// Simulation", section 5, which has cylinders in place of pieces. The tree is that of Karras 2012,
// "Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees".
// Cost: a build is that of the tree over pieces. A query is O(log pieces + found), where boxes overlap
// little. Most pieces that it tests are too far away, which is found first.
// Memory: 36 bytes a piece and about 34 of the tree.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/sum_prefix.hpp>
#include <wfpg/host/geometry.hpp>
#include <wfpg/light/box_tree.hpp>
#include <wfpg/light/detail/beam_pieces.hpp>
#include <wfpg/light/photon_estimators.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg {

/// How a beam map is built. More pieces have tighter boxes, so that queries test fewer beams for those that
/// they find.
struct beam_map_options {
  float radius = 0.0f;  ///< of merges, scene units, in [1e-15, 1e15]
  /// Most pieces of all beams together, at least the number of beams and below 2^28. Beams are cut no finer
  /// than into pieces as long as the diameter of merges.
  std::size_t max_pieces = std::size_t(1) << 20;
};

/// A beam map as kernels see it. Trivially copyable, 48 bytes. Valid until its owner is built again or
/// destroyed. A query reads 32 bytes of each piece that it tests, and the beam's index where it merges.
class beam_map_view {
 public:
  /// A map without beams.
  beam_map_view() = default;
  /// For beam_map. Not for hosts. `pieces`, `beams`: in the tree's order, as many as it has places. `beams`
  /// are indices of the host's.
  beam_map_view(const box_tree_view& tree, const detail::placed_piece* pieces, const std::uint32_t* beams,
                float radius)
      : tree_(tree), pieces_(pieces), beams_(beams), radius_(radius) {}

  /// Returns the number of pieces, of all beams together.
  WFPG_HD std::uint32_t pieces() const { return tree_.size(); }
  /// Returns the radius of the last build, scene units. 0 where there was none.
  WFPG_HD float radius() const { return radius_; }

  /// Calls f(index, merge_geometry) for each beam that merges with a camera beam, once each: whose kernel is
  /// not 0. The order depends on the beams alone. A camera beam that is not finite merges with none.
  /// `camera`: an interval of a ray in one medium, begin at least 0.
  /// `shape`: of the kernel, which merge_geometry has the value of.
  template <class F>
  WFPG_HD void for_each_beam_along(const path_beam& camera, merge_kernel shape, const F& f) const {
    const auto merge = [&](std::uint32_t place) {
      return beam_beam_merge(shape, camera, detail::placed_piece(pieces_[place]).beam, radius_);
    };
    tree_.for_each_place_along(
        camera.as_ray(), [&](std::uint32_t place) { return merge(place).kernel > 0.0f; },
        [&](std::uint32_t place) { f(beams_[place], merge(place)); });
  }

 private:
  box_tree_view tree_;                            // over pieces
  const detail::placed_piece* pieces_ = nullptr;  // by place in the tree
  const std::uint32_t* beams_ = nullptr;          // their indices, likewise
  float radius_ = 0.0f;
};

/// Owns a beam map, in a policy's memory. Movable. The same beams give the same map on every policy.
template <class Exec>
class beam_map {
 public:
  /// A map without beams or memory.
  beam_map() = default;

  /// Builds the map of beams, and waits for the policy's work. Beams that are empty or not finite are
  /// skipped. Memory of the map before is used again if it suffices.
  ///
  /// `beams`: in the policy's memory. They are not read later.
  ///
  /// Throws out_of_memory, after which the map has no beams. Throws std::invalid_argument that names the
  /// option out of range.
  void build(const Exec& exec, array_view<const path_beam> beams, const beam_map_options& options) {
    require(is_finite(options.radius) && options.radius >= least_merge_radius &&
                options.radius <= largest_coordinate,
            "beam_map_options.radius", options.radius, "in [1e-15, 1e15]");
    require(options.max_pieces >= beams.size() && options.max_pieces < (std::size_t(1) << 28),
            "beam_map_options.max_pieces", options.max_pieces,
            "at least the number of beams, and less than 2^28");
    // Where memory runs out, the map stays without beams.
    radius_ = 0.0f;
    const detail::cut_beams cut{beams,
                                detail::longest_piece(exec, beams, options.radius, options.max_pieces)};
    buffer<std::uint64_t, Exec> counts(exec, beams.size());
    exec.for_each(beams.size(), detail::count_beam_pieces{cut, counts.view()});
    const std::size_t n = sum_prefix(exec, counts);
    const buffer<detail::beam_piece, Exec> pieces(exec, n);
    exec.for_each(n, detail::list_beam_pieces{counts.view(), pieces.data()});
    tree_.build(exec, n, detail::beam_piece_boxes{cut, pieces.data(), options.radius});
    const box_tree_view tree = tree_.view();
    if (pieces_.size() < tree.size()) pieces_ = buffer<detail::placed_piece, Exec>(exec, tree.size());
    if (beams_.size() < tree.size()) beams_ = buffer<std::uint32_t, Exec>(exec, tree.size());
    exec.for_each(tree.size(),
                  detail::place_beam_pieces{tree, cut, pieces.data(), pieces_.data(), beams_.data()});
    radius_ = options.radius;
  }

  /// Returns the map for kernels. O(1).
  beam_map_view view() const {
    return radius_ > 0.0f ? beam_map_view(tree_.view(), pieces_.data(), beams_.data(), radius_)
                          : beam_map_view();
  }
  /// Returns the bytes held, without the host's beams: those of the largest map so far.
  /// 70 a piece.
  std::size_t bytes() const { return tree_.bytes() + pieces_.bytes() + beams_.bytes(); }

 private:
  // As in the view. They are as large as the largest map so far took.
  box_tree<Exec> tree_;
  buffer<detail::placed_piece, Exec> pieces_;
  buffer<std::uint32_t, Exec> beams_;
  float radius_ = 0.0f;  // 0: not built
};

}  // namespace wfpg
