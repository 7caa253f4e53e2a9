// What a guide file's sections hold: a guider's octree, cache and counters to and from bytes; kept fields are
// kept_state.hpp's, choices of lights light_state.hpp's. What is read is checked before it is used: kernels
// may rely on it as on what they wrote. Memory: a section at a time.
#pragma once

#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/guides/octree/detail/kept_state.hpp>
#include <wfpg/guides/octree/detail/light_state.hpp>
#include <wfpg/path_guider.hpp>
#include <wfpg/state/section_file.hpp>

#include <thrust/fill.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

namespace wfpg::detail {

inline constexpr file_kind guide_file_kind{{"\x89wfpgG\n\x1a", 8}, 3, "a guide file"};

/// An option that decides how a guider's state is laid out.
struct shaping_option {
  const char* name;
  std::uint32_t value;
};

/// `resolution`: of the octree, which fragments decide where a host makes them itself.
inline std::vector<shaping_option> shaping_options(const guider_options& options, std::uint32_t resolution) {
  const bool kept = options.fields == field_lifetime::kept;
  return {{"octree_resolution", resolution},
          {"mode", static_cast<std::uint32_t>(options.mode)},
          {"fields", static_cast<std::uint32_t>(options.fields)},
          {"kept.resolution", kept ? options.kept.resolution : 0},
          {"kept.learn", kept && options.kept.learn ? 1u : 0u},
          {"lights.weights.size()", static_cast<std::uint32_t>(options.lights.weights.size())},
          {"lights.resolution", options.lights.weights.empty() ? 0 : options.lights.resolution}};
}

inline section_writer options_to_bytes(const guider_options& options, std::uint32_t resolution) {
  section_writer bytes;
  bytes.put(options.scene_tag);
  for (const shaping_option& option : shaping_options(options, resolution)) bytes.put(option.value);
  return bytes;
}

inline void check_options(file_reader& file, const guider_options& options) {
  section_reader bytes = file.section("options");
  const auto scene = bytes.get<std::uint64_t>();
  if (scene != options.scene_tag)
    file.fail("is of another scene: it was saved with scene_tag " + std::to_string(scene) +
              ", the guider's is " + std::to_string(options.scene_tag));
  for (const shaping_option& option : shaping_options(options, options.octree_resolution)) {
    const auto saved = bytes.get<std::uint32_t>();
    if (saved != option.value)
      file.fail(std::string("was saved with option ") + option.name + " " + std::to_string(saved) +
                ", the guider's is " + std::to_string(option.value));
  }
  bytes.end();
}

struct write_leaf_codes {
  sparse_voxel_octree_view tree;
  array_view<morton_code> codes;
  WFPG_HD void operator()(std::size_t leaf) const {
    codes[leaf] = morton_encode(tree.coordinates(tree.first_leaf() + static_cast<node_id>(leaf)));
  }
};

/// An octree is its grid and its leaves; all else is built from them.
template <class Exec>
section_writer octree_to_bytes(const Exec& exec, const sparse_voxel_octree<Exec>& octree) {
  const sparse_voxel_octree_view tree = octree.view();
  const buffer<morton_code, Exec> codes(exec, tree.leaf_count());
  exec.for_each(codes.size(), write_leaf_codes{tree, codes.view()});
  section_writer bytes;
  bytes.put(tree.grid().origin);
  bytes.put(tree.grid().side);
  bytes.put_all(codes.to_host(exec));
  return bytes;
}

inline bool is_divisible(const voxel_grid& grid) {
  const float most = 1.0e6f * grid.side;
  const vec3 o = grid.origin;
  if (!is_finite(o) || !is_finite(grid.side)) return false;
  return grid.side >= 1.0e-20f && grid.side <= 1.0e20f && fabsf(o.x) <= most && fabsf(o.y) <= most &&
         fabsf(o.z) <= most;
}

/// Fragments that the octree is built from, one a leaf. Their normals stand for those that the cache has.
template <class Exec>
voxel_fragments<Exec> fragments_from_bytes(const Exec& exec, section_reader bytes, std::uint32_t resolution) {
  voxel_grid grid;
  grid.resolution = resolution;
  grid.origin = bytes.get_vec3();
  grid.side = bytes.get<float>();
  bytes.require(is_divisible(grid), "has no cube that floats can divide");
  const auto codes = bytes.get_all<morton_code>(bytes.left() / sizeof(morton_code));
  bytes.end();
  const morton_code all = morton_code(resolution) * resolution * resolution;
  for (std::size_t i = 0; i < codes.size(); ++i)
    bytes.require(codes[i] < all && (i == 0 || codes[i - 1] < codes[i]), "has leaves out of order");
  voxel_fragments<Exec> fragments(exec, codes.size());
  exec.copy_from_host(fragments.codes.data(), codes.data(), fragments.codes.bytes());
  ::thrust::fill_n(exec.thrust(), fragments.surfaces.data(), codes.size(),
                   fragment_surface{pack_direction(vec3(0.0f, 0.0f, 1.0f)), 1.0f});
  fragments.grid = grid;
  return fragments;
}

/// Whether a file's fragments, one a leaf, are those of a mesh: the same cube, and all but one leaf in 100
/// the same, since devices and compilers round touching voxels differently.
template <class Exec>
bool is_octree_of(const Exec& exec, const voxel_fragments<Exec>& saved, const voxel_fragments<Exec>& mesh) {
  const float near = 1.0e-4f * saved.grid.side;
  if (fabsf(saved.grid.side - mesh.grid.side) > near ||
      glm::distance(saved.grid.origin, mesh.grid.origin) > near)
    return false;
  const std::vector<morton_code> leaves = saved.codes.to_host(exec);
  std::vector<morton_code> found = mesh.codes.to_host(exec), common;
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  std::set_intersection(leaves.begin(), leaves.end(), found.begin(), found.end(), std::back_inserter(common));
  return 100 * common.size() >= 99 * max(leaves.size(), found.size());
}

/// At least 0, and finite as a float; by bits, since compilers may assume that of every number.
inline bool is_float_radiance(double value) {
  std::uint64_t bits;
  std::memcpy(&bits, &value, sizeof value);
  return bits <= 0x47efffffe0000000ull;
}

/// To and from the members that a guide file holds.
struct state_access {
  /// Inner nodes' radiance is not there: it is their leaves'.
  template <class Exec>
  static section_writer to_bytes(const Exec& exec, const exitance_cache<Exec>& cache) {
    section_writer bytes;
    bytes.put_all(cache.normals_.to_host(exec));
    bytes.put_all(cache.swapped_sides_.to_host(exec));
    for (const leaf_exitance& leaf : cache.leaves_.to_host(exec))
      for (int side = 0; side < 2; ++side) {
        bytes.put(leaf.means[side]);
        bytes.put(leaf.counts[side]);
      }
    bytes.put_all(cache.counters_.to_host(exec));
    return bytes;
  }

  template <class Exec>
  static void restore(const Exec& exec, section_reader bytes, exitance_cache<Exec>& cache) {
    const auto normals = bytes.get_all<std::uint16_t>(cache.normals_.size());
    for (const std::uint16_t normal : normals)
      bytes.require((normal & 0xffu) < 0xffu && normal >> 8 < 0xffu, "has normals that are none");
    const auto swapped = bytes.get_all<std::uint8_t>(cache.swapped_sides_.size());
    std::vector<leaf_exitance> leaves(cache.leaves_.size());
    for (leaf_exitance& leaf : leaves)
      for (int side = 0; side < 2; ++side) {
        leaf.means[side] = bytes.get<double>();
        leaf.counts[side] = bytes.get<std::uint32_t>();
        bytes.require(is_float_radiance(leaf.means[side]), "has radiance that is negative or not finite");
      }
    const auto dropped = bytes.get_all<std::uint32_t>(cache.counters_.size());
    bytes.end();
    exec.copy_from_host(cache.normals_.data(), normals.data(), cache.normals_.bytes());
    exec.copy_from_host(cache.swapped_sides_.data(), swapped.data(), cache.swapped_sides_.bytes());
    exec.copy_from_host(cache.leaves_.data(), leaves.data(), cache.leaves_.bytes());
    exec.copy_from_host(cache.counters_.data(), dropped.data(), cache.counters_.bytes());
    for_each_bottom_up(exec, cache.view_.tree_, 0,
                       average_children{cache.view_, cache.inner_radiance_.data()});
  }

  /// Samples, and what statistics count.
  template <class Exec>
  static section_writer counts_to_bytes(const path_guider<Exec>& guider) {
    section_writer bytes;
    bytes.put(guider.samples_);
    bytes.put(guider.settled_after_);
    const octree_guide<Exec>& guide = guider.guide_;
    bytes.put(guide.build_.non_finite);
    bytes.put(guide.build_.out_of_range);
    bytes.put(guide.build_.degenerate);
    bytes.put(guider.recorder_.dropped(guider.exec_));
    for (const depth_statistics& depth : guide.counts_.to_host(guider.exec_)) {
      bytes.put(depth.bins);
      bytes.put(depth.rays);
      bytes.put(depth.unbinned);
      bytes.put(depth.cones);
    }
    return bytes;
  }

  /// Depths that the guider does not have are left out.
  template <class Exec>
  static void restore_counts(section_reader bytes, path_guider<Exec>& guider) {
    octree_guide<Exec>& guide = guider.guide_;
    guider.samples_ = bytes.get<std::uint32_t>();
    bytes.require(guider.samples_ < 0x80000000u, "has samples without end");
    guider.settled_after_ = bytes.get<std::uint32_t>();
    bytes.require(guider.settled_after_ <= guider.samples_ + recording_needs::settling_samples,
                  "settles after samples that are to come");
    guide.build_.non_finite = bytes.get<std::uint32_t>();
    guide.build_.out_of_range = bytes.get<std::uint32_t>();
    guide.build_.degenerate = bytes.get<std::uint32_t>();
    const auto dropped = bytes.get<std::uint32_t>();
    const auto counts = bytes.get_all<std::uint64_t>(bytes.left() / sizeof(std::uint64_t));
    bytes.end();
    bytes.require(counts.size() % 4 == 0, "has a part of a depth");
    std::vector<depth_statistics> depths(guide.counts_.size());
    for (std::size_t i = 0; i < depths.size() && 4 * i < counts.size(); ++i)
      depths[i] = {counts[4 * i], counts[4 * i + 1], counts[4 * i + 2], counts[4 * i + 3]};
    guider.exec_.copy_from_host(guider.recorder_.dropped_.data(), &dropped, sizeof dropped);
    guider.exec_.copy_from_host(guide.counts_.data(), depths.data(), guide.counts_.bytes());
  }

  template <class Exec>
  static void save(const path_guider<Exec>& guider, file_writer& file) {
    const Exec& exec = guider.exec_;
    const octree_guide<Exec>& guide = guider.guide_;
    file.section("options", options_to_bytes(guider.options_, guide.octree_.resolution()));
    file.section("octree", octree_to_bytes(exec, guide.octree_));
    file.section("cache", to_bytes(exec, guide.cache_));
    file.section("counts", counts_to_bytes(guider));
    if (guide.keeps_fields()) {
      file.section("levels", store_state::levels_to_bytes(exec, guide.store_));
      file.section("fields", store_state::fields_to_bytes(exec, guide.store_));
    }
    if (!guide.lights_.view().empty()) file.section("lights", light_state::to_bytes(exec, guide.lights_));
    file.end();
  }

  /// `mesh`: what the octree must be of; null where that is not known.
  template <class Exec>
  static path_guider<Exec> load(const Exec& exec, file_reader& file, const guider_options& options,
                                const triangle_mesh_view* mesh) {
    check_options(file, options);
    voxel_fragments<Exec> fragments =
        fragments_from_bytes(exec, file.section("octree"), options.octree_resolution);
    if (mesh && !is_octree_of(exec, fragments, voxelize(exec, *mesh, options.octree_resolution)))
      file.fail("is of another scene: its octree is not that of the triangles");
    path_guider<Exec> guider(exec, std::move(fragments), options);
    octree_guide<Exec>& guide = guider.guide_;
    restore(guider.exec_, file.section("cache"), guide.cache_);
    restore_counts(file.section("counts"), guider);
    if (guide.keeps_fields()) {
      store_state::restore_levels(guider.exec_, file.section("levels"), guider.samples_, guide.store_);
      store_state::restore_fields(guider.exec_, file.section("fields"), guide.store_);
    }
    if (!guide.lights_.view().empty())
      light_state::restore(guider.exec_, file.section("lights"), guide.lights_);
    file.end();
    return guider;
  }
};

}  // namespace wfpg::detail
