// A guider's state on disk: octree, cache, kept fields with what they learnt, and the samples so far. A
// guider that is loaded goes on as the one that was saved would have: with the same options and the same
// waves it draws the same directions, to the bit on the CPU policies, whichever of them saved it.
//
// A guide file of version 3, little-endian; detail/section_file.hpp has what is around the sections.
//
//   section  content                                              bytes
//   options  scene_tag                                            8
//            octree_resolution, mode, fields                      12
//            kept.resolution and kept.learn, 0 of transient ones  8
//            groups of lights and their resolution, 0 without     8
//   octree   least corner and side of its cube                    16
//            Morton code, in order                                8 a leaf
//   cache    normal                                               2 a node
//            whether the sides are swapped                        1 an inner node
//            mean radiance and number of deposits of two sides    24 a leaf
//            deposits dropped, by reason                          12
//   counts   samples                                              4
//            sample from which on fewer paths are recorded        4
//            triangles left out, by reason                        12
//            vertices dropped                                     4
//            bins, rays, unbinned rays, cones                     32 a depth
//   levels   samples counted                                      4  of kept fields alone
//            sample until which every wave builds fields          4
//            rays                                                 4 a leaf
//            level of the node that they belong to                1 a leaf
//   fields   pressure on the size of bins                         4  of kept fields alone
//            fields refused and delayed                           8
//            fields made and refreshed                            16
//            whether fields learn                                 4
//            number, key, last use, last build, builds            20 a field
//            normal and fraction                                  16 a field
//            sums of its distribution over cells                  4 a cell
//            sums of its distribution over rows                   4 a row
//            cone's hit                                           4 a cell
//            learnt radiance, where fields learn                  2 a cell
//   lights   learnt mean: of learning nodes, faces and groups     4 a mean
//
// Cells and rows are those of fields with a fraction above 0. All else that a guider has follows from these.
// About 40 bytes a leaf and 10 F² a field; detail/guide_state.hpp and kept_state.hpp say what is checked.
#pragma once

#include <wfpg/guides/octree/detail/guide_state.hpp>
#include <wfpg/path_guider.hpp>

#include <istream>
#include <ostream>
#include <string>

namespace wfpg {

/// Writes a guider's state, between end_sample() and begin_sample(); waits for the work before it. `name` is
/// what errors call the stream. Throws file_error where the stream takes no more.
template <class Exec>
void save_guide(const path_guider<Exec>& guider, std::ostream& out, const std::string& name = "the guide") {
  file_writer file(out, detail::guide_file_kind, name);
  detail::state_access::save(guider, file);
}

/// Writes a guider's state to a file: under a name of its own beside it, then renamed, so that an old file is
/// replaced by a whole one or not at all. Throws file_error.
template <class Exec>
void save_guide(const path_guider<Exec>& guider, const std::string& path) {
  replace_file(path, [&](std::ostream& out) { save_guide(guider, out, path); });
}

/// A guider in the state that was saved. These options must be what they were: scene_tag, octree_resolution,
/// mode, fields, kept.resolution, kept.learn, the number of lights.weights and lights.resolution; and
/// kept.budget_bytes must have room. Others may differ, and are not in the file. Reads up to the guide's end
/// and no further. Throws file_error that says what is wrong: no guide file, another version, where it is
/// truncated, which section is altered, which option differs; std::invalid_argument for options out of range,
/// out_of_memory. Memory is bounded by what is there, not by what the file says. O(bytes), and the octree is
/// built.
template <class Exec>
path_guider<Exec> load_guide(const Exec& exec, std::istream& in, const guider_options& options,
                             const std::string& name = "the guide") {
  file_reader file(in, detail::guide_file_kind, name);
  return detail::state_access::load(exec, file, options, nullptr);
}

/// A guider in the state that a file holds, of which nothing may be left over. Throws as the stream's form
/// does.
template <class Exec>
path_guider<Exec> load_guide(const Exec& exec, const std::string& path, const guider_options& options) {
  return read_file(path, [&](std::istream& in) { return load_guide(exec, in, options, path); });
}

/// A guider in the state that was saved, of a scene in hand: file_error, too, where the octree is not that of
/// `mesh`. Another cube, or one leaf in 100, makes it another scene. Voxelizes the mesh.
template <class Exec>
path_guider<Exec> load_guide(const Exec& exec, triangle_mesh_view mesh, std::istream& in,
                             const guider_options& options, const std::string& name = "the guide") {
  file_reader file(in, detail::guide_file_kind, name);
  return detail::state_access::load(exec, file, options, &mesh);
}

/// A guider in the state that a file holds, of a scene in hand. Throws as the stream's form does.
template <class Exec>
path_guider<Exec> load_guide(const Exec& exec, triangle_mesh_view mesh, const std::string& path,
                             const guider_options& options) {
  return read_file(path, [&](std::istream& in) { return load_guide(exec, mesh, in, options, path); });
}

}  // namespace wfpg
