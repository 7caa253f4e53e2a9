// Photons on surfaces or in media, found by distance: all within one radius of a point or of a beam. The
// radius is that of an iteration, and the map is built anew for each.
//
//   photon_map<Exec> map;
//   map.build(exec, positions, radius);           // positions[i] is that of the photon with index i
//   const photon_map_view view = map.view();      // for kernels
//   view.for_each_point(p, [&](std::uint32_t i) { ... });
//   view.for_each_point_along(camera, kernel, [&](std::uint32_t i, const merge_geometry& at) { ... });
//
// The map is a box_tree over the photons' spheres, with up to seven of them a leaf. Positions are stored in
// the tree's order, so that a leaf's photons are next to each other. What a photon carries stays the host's,
// by index. A host that merges much copies it into the order of places, which neighbours share a leaf in.
//
// Where photons are dense, a map can leave most of them out. Each that stays then counts for several: means
// are the same, and queries save more time than they add noise.
//
// Sources: Moonen & Jalba 2023, "Efficient Hardware Acceleration of Robust Volumetric Light Transport
// Simulation", section 5, which queries boxes of spheres too. The tree is that of Karras 2012, "Maximizing
// Parallelism in the Construction of BVHs, Octrees, and k-d Trees". Suykens & Willems 2000, "Density Control
// for Photon Maps", leave photons out too; here, roulette decides.
// Cost: a build is that of the tree. A query tests about twice as many photons as it finds. Clusters cost no
// more than photons that are spread evenly. Queries first find up to 32 photons and then call f for them, so
// that a warp's lanes call it together.
// Memory: 12 bytes a photon for positions, about 11 of the tree, and 4 for weights where photons are left
// out.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/host/geometry.hpp>
#include <wfpg/light/box_tree.hpp>
#include <wfpg/light/detail/photon_map_kernels.hpp>
#include <wfpg/light/photon_estimators.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg {

/// Which photons a map keeps where they are dense. Each photon is kept with a probability, and counts for one
/// over it: photon_map_view::weight(), of its place. Hosts find photons of such maps by place.
struct photon_thinning {
  /// About how many photons are kept of those in a cell, at least 1. A cell is a cube whose faces have the
  /// area of a merge's disc. As many as there are photons, or more, keep all.
  std::uint32_t cell_photons = ~0u;
  std::uint64_t seed = 0;  ///< of what is kept: another one for each iteration
};

/// A photon map as kernels see it. Trivially copyable, 48 bytes. Valid until its owner is built again or
/// destroyed.
class photon_map_view {
 public:
  /// A map without photons.
  photon_map_view() = default;
  /// For photon_map. Not for hosts. `positions`, `weights`: in the tree's order, as many as it has places.
  /// Null weights are 1.
  photon_map_view(const box_tree_view& tree, const vec3* positions, const float* weights, float radius)
      : tree_(tree), positions_(positions), weights_(weights), radius_(radius) {}

  /// Returns the number of photons, without those that were left out.
  WFPG_HD std::uint32_t size() const { return tree_.size(); }
  /// Returns the radius of the last build, scene units. 0 where there was none.
  WFPG_HD float radius() const { return radius_; }

  /// Returns the index of the photon at a place in [0, size()). Each photon that is not skipped has one
  /// place, until the next build.
  WFPG_HD std::uint32_t index(std::uint32_t place) const { return tree_.index(place); }
  /// Returns how many photons the one at a place counts for, at least 1: a factor of what it carries. More
  /// than 1 where photons are dense, and the map has left some out by photon_thinning.
  WFPG_HD float weight(std::uint32_t place) const { return weights_ ? weights_[place] : 1.0f; }

  /// Calls f(index) for each photon whose distance from `p` is at most the radius, once each. The order
  /// depends on the photons alone. Distances are rounded as floats. A point that is not finite has no photon.
  /// Calls of f wait for others, as box_tree_view::for_each_place() says. O(log photons + found).
  template <class F>
  WFPG_HD void for_each_point(vec3 p, const F& f) const {
    for_each_place(p, [&](std::uint32_t place) { f(tree_.index(place)); });
  }
  /// Likewise f(place): for hosts that keep what photons carry in the order of places. A leaf's photons,
  /// which are near each other, have neighbouring places.
  template <class F>
  WFPG_HD void for_each_place(vec3 p, const F& f) const {
    const auto is_near = [&](std::uint32_t place) {
      const vec3 away = positions_[place] - p;
      return glm::dot(away, away) <= radius_ * radius_;
    };
    tree_.for_each_place(bounds3{p, p}, is_near, f);
  }

  /// Calls f(index, merge_geometry) for each photon that merges with a camera beam, once each: whose kernel
  /// is not 0. The order depends on the photons alone. A beam that is not finite merges with none.
  /// `camera`: an interval of a ray in one medium, begin at least 0.
  /// `shape`: of the kernel, which merge_geometry has the value of.
  template <class F>
  WFPG_HD void for_each_point_along(const path_beam& camera, merge_kernel shape, const F& f) const {
    for_each_place_along(camera, shape, [&](std::uint32_t place, const merge_geometry& found) {
      f(tree_.index(place), found);
    });
  }
  /// Likewise f(place, merge_geometry), for hosts that keep what photons carry in the order of places.
  template <class F>
  WFPG_HD void for_each_place_along(const path_beam& camera, merge_kernel shape, const F& f) const {
    const auto merge = [&](std::uint32_t place) {
      return beam_point_merge(shape, camera, positions_[place], radius_);
    };
    tree_.for_each_place_along(
        camera.as_ray(), [&](std::uint32_t place) { return merge(place).kernel > 0.0f; },
        [&](std::uint32_t place) { f(place, merge(place)); });
  }

 private:
  box_tree_view tree_;
  const vec3* positions_ = nullptr;  // by place
  const float* weights_ = nullptr;   // likewise
  float radius_ = 0.0f;
};

/// Owns a photon map, in a policy's memory. Movable. The same photons give the same map on every policy.
template <class Exec>
class photon_map {
 public:
  /// A map without photons or memory.
  photon_map() = default;

  /// Builds the map of the photons at `positions`, in the policy's memory, which are not read later. Photons
  /// are skipped whose positions are not finite, or whose spheres reach beyond largest_coordinate.
  ///
  /// Memory of the map before is used again if it suffices. Other memory is as box_tree::build() says, and 4
  /// to 8 bytes a photon for `thinning`.
  ///
  /// Throws out_of_memory, after which the map has no photons. Throws std::invalid_argument for a radius that
  /// is not in [least_merge_radius, largest_coordinate], for no photons a cell, and for 2^28 photons or more.
  void build(const Exec& exec, array_view<const vec3> positions, float radius,
             const photon_thinning& thinning = {}) {
    require(is_finite(radius) && radius >= least_merge_radius && radius <= largest_coordinate, "radius",
            radius, "in [1e-15, 1e15]");
    require(thinning.cell_photons > 0, "photon_thinning.cell_photons", thinning.cell_photons, "at least 1");
    radius_ = 0.0f;
    const bool thins = positions.size() > thinning.cell_photons;
    const buffer<std::uint32_t, Exec> counts(exec, thins ? counters_for(positions.size()) : 0);
    detail::photon_cells cells;
    if (thins) {
      constexpr float root_of_pi = 1.77245385f;
      cells = {counts.data(), static_cast<std::uint32_t>(counts.size() - 1), 1.0f / (root_of_pi * radius),
               thinning.cell_photons, thinning.seed};
      exec.fill_bytes(counts.data(), 0, counts.bytes());
      exec.for_each(positions.size(), detail::count_cell_photons{positions, cells, counts.data()});
    }
    // The tree's margins, 1/1000 of the radius here, are larger than what rounding adds to a distance.
    tree_.build(exec, positions.size(), detail::photon_boxes{positions, radius, cells}, leaf_photons);
    const box_tree_view tree = tree_.view();
    if (positions_.size() < tree.size()) positions_ = buffer<vec3, Exec>(exec, tree.size());
    if (!thins || weights_.size() < tree.size())
      weights_ = buffer<float, Exec>(exec, thins ? tree.size() : 0);
    exec.for_each(tree.size(),
                  detail::order_photons{tree, positions, cells, positions_.data(), weights_.data()});
    radius_ = radius;
  }

  /// Returns the map for kernels. O(1).
  photon_map_view view() const {
    if (!(radius_ > 0.0f)) return {};
    return {tree_.view(), positions_.data(), weights_.data(), radius_};
  }
  /// Returns how many photons the last build left out, by photon_thinning too. Their indices are not found,
  /// and others keep theirs.
  std::uint32_t skipped() const { return tree_.skipped(); }
  /// Returns the bytes held: those of the largest map so far.
  std::size_t bytes() const { return tree_.bytes() + positions_.bytes() + weights_.bytes(); }

 private:
  // Fewer take more memory, and are not faster: nodes cost as much as the photons that they spare.
  static constexpr std::uint32_t leaf_photons = 7;

  /// The number of counters for n photons. More cells than that have few photons each, and may share them.
  static std::size_t counters_for(std::size_t n) {
    std::size_t counters = 1;
    while (counters < n) counters *= 2;
    return counters;
  }

  box_tree<Exec> tree_;
  buffer<vec3, Exec> positions_;  // by place
  buffer<float, Exec> weights_;   // likewise; none where all are kept
  float radius_ = 0.0f;           // 0: not built
};

}  // namespace wfpg
