// Reads and writes the sections of a guide file that hold the octree's guides: options, octree, cache and
// counts. For guide_file.hpp. kept_state.hpp has the sections of kept fields, and light_state.hpp those of
// light choices. wfpg's own.
//
// What is read is checked before it is used: kernels rely on it as on what they wrote. A wrong section throws
// file_error.
//
// Cost: O(bytes), and an octree's build on loading. Memory: one section at a time.
#pragma once

#include <wfpg/detail/kept_state.hpp>
#include <wfpg/detail/light_state.hpp>
#include <wfpg/exec/support/fill.hpp>
#include <wfpg/guides/octree/kept_guide.hpp>
#include <wfpg/guides/octree/transient_guide.hpp>
#include <wfpg/octree/leaf_codes.hpp>
#include <wfpg/state/section_file.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

namespace wfpg::detail {

/// Magic, version and name of guide files. The magic has bytes that text conversion would change, so such
/// damage is detected.
inline constexpr file_kind guide_file_kind{{"\x89wfpgG\n\x1a", 8}, 8, "a guide file"};

/// An option that decides how a guide's state is laid out. A file is refused where one differs.
struct shaping_option {
  const char* name;     ///< as error messages call it
  std::uint32_t value;  ///< as saved, 0 where it has no meaning
};

/// Options that shape both of the octree's guides, in the order of the file. `resolution`: of the octree,
/// which fragments decide where a host makes them itself. `fields`: 0 for kept_guide, 1 for transient_guide.
inline std::vector<shaping_option> shaping_options(const octree_guide_options& options,
                                                   std::uint32_t resolution, std::uint32_t fields,
                                                   std::uint32_t kept_resolution, std::uint32_t kept_learn) {
  return {{"octree_resolution", resolution},
          {"mode", static_cast<std::uint32_t>(options.mode)},
          {"fields", fields},
          {"kept.resolution", kept_resolution},
          {"kept.learn", kept_learn},
          {"lights.weights.size()", static_cast<std::uint32_t>(options.lights.weights.size())},
          {"lights.resolution", options.lights.weights.empty() ? 0 : options.lights.resolution}};
}
/// Options that shape a kept_guide.
inline std::vector<shaping_option> shaping_options(const kept_guide_options& options,
                                                   std::uint32_t resolution) {
  return shaping_options(options, resolution, 0, options.kept.resolution, options.kept.learn ? 1 : 0);
}
/// Options that shape a transient_guide; those of kept fields are 0.
inline std::vector<shaping_option> shaping_options(const transient_guide_options& options,
                                                   std::uint32_t resolution) {
  return shaping_options(options, resolution, 1, 0, 0);
}

/// Section "options": scene_tag (8 bytes), then the value of each shaping option (4).
template <class Options>
section_writer options_to_bytes(const Options& options, std::uint32_t resolution) {
  section_writer bytes;
  bytes.put(options.scene_tag);
  for (const shaping_option& option : shaping_options(options, resolution)) bytes.put(option.value);
  return bytes;
}

/// Reads section "options" and compares it with a guide's. Throws file_error that names the first option that
/// differs, with both values.
template <class Options>
void check_options(file_reader& file, const Options& options) {
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

/// Section "octree": origin and side of the cube, then the leaves' Morton codes in ascending order. All else
/// is built from these on loading.
template <class Exec>
section_writer octree_to_bytes(const Exec& exec, const sparse_voxel_octree<Exec>& octree) {
  const sparse_voxel_octree_view tree = octree.view();
  section_writer bytes;
  bytes.put(tree.grid().origin);
  bytes.put(tree.grid().side);
  bytes.put_all(leaf_codes(exec, tree));
  return bytes;
}

/// Whether floats can divide a cube into voxels: finite, a side in [1e-20, 1e20], and an origin within 1e6
/// sides of 0.
inline bool is_divisible(const voxel_grid& grid) {
  const float most = 1.0e6f * grid.side;
  const vec3 o = grid.origin;
  if (!is_finite(o) || !is_finite(grid.side)) return false;
  return grid.side >= 1.0e-20f && grid.side <= 1.0e20f && fabsf(o.x) <= most && fabsf(o.y) <= most &&
         fabsf(o.z) <= most;
}

/// Fragments that the octree is built from, one a leaf. Their normals are placeholders: section "cache" has
/// the real ones. Throws file_error where the cube is degenerate, or leaves are out of range or out of order.
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
  fill(exec, fragments.surfaces, fragment_surface{pack_direction(vec3(0.0f, 0.0f, 1.0f)), 1.0f});
  fragments.grid = grid;
  return fragments;
}

/// Whether the octree of a file is that of a mesh. `saved`: a file's fragments, one a leaf. `mesh`: those of
/// the mesh, in any order.
///
/// The cubes must be equal to 1e-4 of their side. All but one leaf in 100 must be equal, since devices and
/// compilers round touching voxels differently. O(n log n) on the host.
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

/// Whether a value is at least 0, and finite as a float. Compares bits, since compilers may assume that every
/// number is finite.
inline bool is_float_radiance(double value) {
  std::uint64_t bits;
  std::memcpy(&bits, &value, sizeof value);
  return bits <= 0x47efffffe0000000ull;
}

/// Reads and writes members of the octree's guides; their friend.
struct guide_sections {
  /// Section "cache": normals, sides that are swapped, means and counts of the leaves, and the counters.
  /// Radiance of inner nodes is left out: restore() averages it from the leaves.
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

  /// Reads section "cache" into a cache over an octree with as many nodes. Throws file_error for wrong
  /// normals, or radiance that is negative or not finite; the cache is then unchanged.
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
    cache.shared_counters_.restart(exec, counters_in_a_row<std::uint32_t>{cache.counters_.data()});
    for_each_bottom_up(exec, cache.view_.tree_, 0,
                       average_children{cache.view_, cache.inner_radiance_.data()});
  }

  /// Writes the build's counts of triangles or samples that were left out.
  template <class Exec>
  static void put_build(const octree_scene<Exec>& scene, section_writer& bytes) {
    bytes.put(scene.build_.non_finite);
    bytes.put(scene.build_.out_of_range);
    bytes.put(scene.build_.degenerate);
  }
  /// Writes the counts by depth, 4 numbers of 8 bytes each.
  template <class Exec>
  static void put_depths(const Exec& exec, const octree_scene<Exec>& scene, section_writer& bytes) {
    for (const depth_statistics& depth : scene.counts_.to_host(exec)) {
      bytes.put(depth.bins);
      bytes.put(depth.rays);
      bytes.put(depth.unbinned);
      bytes.put(depth.cones);
    }
  }
  /// Reads what put_build() wrote.
  template <class Exec>
  static void take_build(section_reader& bytes, octree_scene<Exec>& scene) {
    scene.build_.non_finite = bytes.get<std::uint32_t>();
    scene.build_.out_of_range = bytes.get<std::uint32_t>();
    scene.build_.degenerate = bytes.get<std::uint32_t>();
  }
  /// Reads counts by depth, which are all that is left of a section. Drops depths that the guide does not
  /// have; other depths start at 0.
  template <class Exec>
  static void take_depths(const Exec& exec, section_reader& bytes, octree_scene<Exec>& scene) {
    const auto counts = bytes.get_all<std::uint64_t>(bytes.left() / sizeof(std::uint64_t));
    bytes.end();
    bytes.require(counts.size() % 4 == 0, "has a part of a depth");
    std::vector<depth_statistics> depths(scene.counts_.size());
    for (std::size_t i = 0; i < depths.size() && 4 * i < counts.size(); ++i)
      depths[i] = {counts[4 * i], counts[4 * i + 1], counts[4 * i + 2], counts[4 * i + 3]};
    exec.copy_from_host(scene.counts_.data(), depths.data(), scene.counts_.bytes());
    scene.shared_counts_.restart(exec, rays_of_depth{scene.counts_.data()});
  }

  /// Writes the first sections of a scene: "octree" and "cache".
  template <class Exec>
  static void save_scene(const Exec& exec, const octree_scene<Exec>& scene, file_writer& file) {
    file.section("octree", octree_to_bytes(exec, scene.octree_));
    file.section("cache", to_bytes(exec, scene.cache_));
  }
  /// Reads section "cache"; the scene was built from "octree" before.
  template <class Exec>
  static void load_scene(const Exec& exec, file_reader& file, octree_scene<Exec>& scene) {
    restore(exec, file.section("cache"), scene.cache_);
  }
  /// Writes sections "levels" and "fields" of a kept_guide.
  template <class Exec>
  static void save_fields(const Exec& exec, const kept_guide<Exec>& guide, file_writer& file) {
    file.section("levels", kept_state::levels_to_bytes(exec, guide.store_));
    file.section("fields", kept_state::fields_to_bytes(exec, guide.store_));
  }
  /// Writes nothing: transient fields are not kept.
  template <class Exec>
  static void save_fields(const Exec&, const transient_guide<Exec>&, file_writer&) {}
  /// Reads the sections of kept fields. `samples`: that the saved guider had made.
  template <class Exec>
  static void load_fields(const Exec& exec, file_reader& file, std::uint32_t samples,
                          kept_guide<Exec>& guide) {
    kept_state::restore_levels(exec, file.section("levels"), samples, guide.store_);
    kept_state::restore_fields(exec, file.section("fields"), guide.first_fraction(), guide.learns_fractions(),
                               guide.store_);
    guide.store_.aim(exec, guide.cache());
  }
  /// Reads nothing: a transient_guide's file has no fields.
  template <class Exec>
  static void load_fields(const Exec&, file_reader&, std::uint32_t, transient_guide<Exec>&) {}
  /// Writes section "lights", where there are groups of lights to choose from.
  template <class Exec>
  static void save_lights(const Exec& exec, const octree_scene<Exec>& scene, file_writer& file) {
    if (!scene.lights_.view().empty()) file.section("lights", light_state::to_bytes(exec, scene.lights_));
  }
  /// Reads section "lights", under the condition of save_lights(): options were compared before.
  template <class Exec>
  static void load_lights(const Exec& exec, file_reader& file, octree_scene<Exec>& scene) {
    if (!scene.lights_.view().empty()) light_state::restore(exec, file.section("lights"), scene.lights_);
  }
  /// Writes section "paths": what earlier paths brought, for comparisons.
  template <class Exec>
  static void save_paths(const Exec& exec, const octree_scene<Exec>& scene, file_writer& file) {
    section_writer bytes;
    for (const earlier_paths& path : scene.meter_.kept_.to_host(exec)) {
      bytes.put(path.place);
      bytes.put(path.vertices);
      for (const float unguided : path.unguided) bytes.put(unguided);
      bytes.put(path.guided);
    }
    file.section("paths", bytes);
  }
  /// Reads section "paths". Drops paths that the guide has no room for. Throws file_error for radiance that
  /// is not finite, and for places that are none.
  template <class Exec>
  static void load_paths(const Exec& exec, file_reader& file, octree_scene<Exec>& scene) {
    section_reader bytes = file.section("paths");
    std::vector<earlier_paths> paths(bytes.left() / sizeof(earlier_paths));
    const std::uint32_t places = 2 * scene.octree_.node_count();
    for (earlier_paths& path : paths) {
      path.place = bytes.get<std::uint32_t>();
      bytes.require(path.place < places || path.place == earlier_paths::nowhere, "has paths from no node");
      path.vertices = bytes.get<std::uint32_t>();
      for (float& unguided : path.unguided) unguided = radiance(bytes);
      path.guided = radiance(bytes);
    }
    bytes.end();
    const buffer<earlier_paths, Exec>& kept = scene.meter_.kept_;
    paths.resize(kept.size());
    exec.copy_from_host(kept.data(), paths.data(), kept.bytes());
  }

 private:
  static float radiance(section_reader& bytes) {
    const auto value = bytes.get<float>();
    bytes.require(is_finite(value), "has radiance that is not finite");
    return value;
  }
};

}  // namespace wfpg::detail
