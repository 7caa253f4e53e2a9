// Builds the BVH of bvh_caster.hpp on any policy: a box_tree over the triangles' boxes. The same scene gives
// the same BVH. Memory while it builds: as that of a box_tree.
#pragma once

#include "casters/bvh_caster.hpp"

#include <wfpg/exec/buffer.hpp>
#include <wfpg/host/geometry.hpp>
#include <wfpg/light/box_tree.hpp>

#include <vector>

namespace render {

namespace detail {

/// A mesh's triangles. The BVH leaves out those that no ray can hit.
struct bvh_mesh {
  wfpg::triangle_mesh_view mesh;

  WFPG_HD vec3 corner(std::size_t triangle, int i) const {
    return mesh.positions[mesh.triangles[triangle][i]];
  }

  WFPG_HD bool is_usable(std::size_t triangle) const {
    const uvec3 corners = mesh.triangles[triangle];
    const std::size_t n = mesh.positions.size();
    if (corners.x >= n || corners.y >= n || corners.z >= n) return false;
    const vec3 a = mesh.positions[corners.x], b = mesh.positions[corners.y], c = mesh.positions[corners.z];
    if (!wfpg::is_valid_position(a) || !wfpg::is_valid_position(b) || !wfpg::is_valid_position(c))
      return false;
    const vec3 u = b - a, v = c - a;
    return difference_of_products(u.y, v.z, u.z, v.y) != 0.0f ||
           difference_of_products(u.z, v.x, u.x, v.z) != 0.0f ||
           difference_of_products(u.x, v.y, u.y, v.x) != 0.0f;
  }
  /// A triangle's box. Empty if no ray can hit it.
  WFPG_HD wfpg::bounds3 operator()(std::size_t triangle) const {
    if (!is_usable(triangle)) return {};
    const vec3 a = corner(triangle, 0), b = corner(triangle, 1), c = corner(triangle, 2);
    return {glm::min(a, glm::min(b, c)), glm::max(a, glm::max(b, c))};
  }
};

/// Writes the triangles in the tree's order.
struct order_triangles {
  bvh_mesh mesh;
  wfpg::box_tree_view tree;
  bvh_triangle* triangles;

  WFPG_HD void operator()(std::size_t i) const {
    const std::uint32_t t = tree.index(static_cast<std::uint32_t>(i));
    triangles[i] = {mesh.corner(t, 0), t, mesh.corner(t, 1), 0.0f, mesh.corner(t, 2), 0.0f};
  }
};

}  // namespace detail

/// Owns the BVH over a mesh's triangles, in a policy's memory. Leaves out triangles without area, or with
/// vertices that are not finite or beyond 1e15. No ray hits them.
template <class Exec>
class bvh_scene {
 public:
  static constexpr const char* name = "bvh";

  /// `environment` is the luminance of rays that miss. `leaf_triangles`: as box_tree's `leaf_boxes`. Reads
  /// the mesh only here. Throws out_of_memory, and std::invalid_argument for leaf_triangles out of range or
  /// 2^28 triangles or more.
  bvh_scene(const Exec& exec, const wfpg::triangle_mesh_view& mesh, float environment,
            std::uint32_t leaf_triangles = 1)
      : environment_(vec3(environment)) {
    const detail::bvh_mesh triangles{mesh};
    tree_.build(exec, mesh.triangles.size(), triangles, leaf_triangles);
    triangles_ = wfpg::buffer<bvh_triangle, Exec>(exec, tree_.view().size());
    exec.for_each(triangles_.size(), detail::order_triangles{triangles, tree_.view(), triangles_.data()});
  }

  /// Over a scene whose arrays are already in the policy's memory.
  bvh_scene(const Exec& exec, const scene& host, const scene_view& arrays)
      : bvh_scene(exec, {arrays.positions, arrays.triangles}, 0.0f) {
    environment_ = arrays.environment;
    if (has_cut_outs(host)) cut_outs_ = wfpg::buffer<scene_view, Exec>(exec, std::vector<scene_view>{arrays});
  }

  bvh_caster caster() const { return {tree_.view(), triangles_.data(), cut_outs_.data(), environment_}; }
  std::size_t bytes() const { return tree_.bytes() + triangles_.bytes(); }
  std::size_t node_count() const { return tree_.node_count(); }

 private:
  wfpg::box_tree<Exec> tree_;
  wfpg::buffer<bvh_triangle, Exec> triangles_;
  wfpg::buffer<scene_view, Exec> cut_outs_;  // one, or none
  environment_view environment_;
};

}  // namespace render
