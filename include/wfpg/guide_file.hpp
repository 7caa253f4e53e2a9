// Saves a guider's state to a file or stream and loads it: octree, cache, kept fields with what they learnt,
// choices of lights, and counts. A loaded guider goes on where the saved one stopped. With equal options and
// waves it samples the directions that the saved one would have sampled. On the CPU policies they are equal
// to the bit, whichever of these policies saved the file.
//
// Source: wfpg's own. Cost: O(bytes), and loading builds the octree. Memory: a file has about 40 bytes a leaf
// and 10 F² a kept field.
//
// A guide file of version 8, little-endian; state/section_file.hpp has what is around the sections.
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
//            options and unguided sample of comparisons           8
//            samples rested, in how many paths it takes part      8
//            weight of guided samples                             4
//            gain below which the guide rests                     4
//            unguided sample and noise before it waited           8
//            gain of choices of lights while it waited            4
//            mean gain of comparisons                             80
//            triangles left out, by reason                        12
//            vertices dropped                                     4
//            bins, rays, unbinned rays, cones                     32 a depth
//   levels   samples counted                                      4  of kept fields alone
//            sample until which every wave builds fields          4
//            samples before all paths were guided                 4
//            log2 of the paths of which one is guided             4
//            rays                                                 4 a leaf
//            level of the node that they belong to                1 a leaf
//   fields   pressure on the size of bins                         4  of kept fields alone
//            fields refused and delayed                           8
//            fields made and refreshed                            16
//            whether fields learn                                 4
//            number, key, last use, last build, builds            20 a field
//            normal and fractions                                 16 a field
//            sums of its distribution over cells                  4 a cell
//            sums of its distribution over rows                   4 a row
//            cone's hit                                           4 a cell
//            learnt radiance, where fields learn                  2 a cell
//            what fractions learnt, where fields learn            32 a built field
//   lights   learnt mean: of learning nodes, faces and groups     4 a mean
//   paths    place, surfaces, what five paths brought             28 a path that is compared
//
// Cells and rows are those of fields that are built. All else that a guider has follows from these.
// detail/guide_sections.hpp says what is checked.
#pragma once

#include <wfpg/detail/guide_state.hpp>
#include <wfpg/path_guider.hpp>

#include <istream>
#include <ostream>
#include <string>
#include <type_traits>

namespace wfpg {

/// The guide that load_guide() returns a guider of: kept_guide for kept_guide_options, else transient_guide.
template <class Exec, class Options>
using octree_guide_for = std::conditional_t<std::is_base_of_v<kept_guide_options, Options>, kept_guide<Exec>,
                                            transient_guide<Exec>>;

/// Writes a guider's state to a stream. Call it between end_sample() and begin_sample(). `Guide` is
/// kept_guide or transient_guide. Open the stream in binary mode. Error messages call it `name`. Throws
/// file_error where a write fails. Waits for the work before it.
template <class Exec, class Guide>
void save_guide(const path_guider<Exec, Guide>& guider, std::ostream& out,
                const std::string& name = "the guide") {
  file_writer file(out, detail::guide_file_kind, name);
  detail::state_access::save(guider, file);
}

/// Writes a guider's state to the file `path`. It writes a temporary file beside it and then renames that. So
/// an old file is replaced by a complete one, or not at all. Throws file_error.
template <class Exec, class Guide>
void save_guide(const path_guider<Exec, Guide>& guider, const std::string& path) {
  replace_file(path, [&](std::ostream& out) { save_guide(guider, out, path); });
}

/// Reads a guider's state from a stream and returns a guider in that state. `Options` is kept_guide_options
/// or transient_guide_options and decides the guide. Reads up to the end of the guide's data and no further.
///
/// These options must equal those of the saved guider:
/// - scene_tag, octree_resolution, mode, the kind of fields,
/// - kept.resolution, kept.learn,
/// - the number of lights.weights, and lights.resolution.
///
/// kept.budget_bytes must have room for the saved fields. Other options are not in the file and may differ.
///
/// Throws file_error, whose message says what is wrong:
/// - It is no guide file, or one of another version.
/// - It is truncated, with the place.
/// - A section was altered, or an option differs, with its name.
///
/// Throws std::invalid_argument for options out of range, and out_of_memory. The data that is there bounds
/// the memory, not the sizes that the file claims.
template <class Exec, class Options>
auto load_guide(const Exec& exec, std::istream& in, const Options& options,
                const std::string& name = "the guide") {
  file_reader file(in, detail::guide_file_kind, name);
  return detail::state_access::load<octree_guide_for<Exec, Options>>(exec, file, options, nullptr);
}

/// Reads a guider's state from the file `path`. Throws file_error also where data follows the guide's; else
/// as the form above, for streams.
template <class Exec, class Options>
auto load_guide(const Exec& exec, const std::string& path, const Options& options) {
  return read_file(path, [&](std::istream& in) { return load_guide(exec, in, options, path); });
}

/// Reads a guider's state from a stream, and checks that it is of the scene `mesh`. Throws file_error also
/// where the file's octree is not that of the mesh. Their cubes must be equal, and 99 of 100 leaves in both:
/// devices and compilers round touching voxels differently. The check voxelizes the mesh.
template <class Exec, class Options>
auto load_guide(const Exec& exec, triangle_mesh_view mesh, std::istream& in, const Options& options,
                const std::string& name = "the guide") {
  file_reader file(in, detail::guide_file_kind, name);
  return detail::state_access::load<octree_guide_for<Exec, Options>>(exec, file, options, &mesh);
}

/// Reads a guider's state from the file `path`, and checks that it is of the scene `mesh`. Nothing may follow
/// the guide's data.
template <class Exec, class Options>
auto load_guide(const Exec& exec, triangle_mesh_view mesh, const std::string& path, const Options& options) {
  return read_file(path, [&](std::istream& in) { return load_guide(exec, mesh, in, options, path); });
}

}  // namespace wfpg
