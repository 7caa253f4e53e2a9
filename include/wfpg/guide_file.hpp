// A guider's state on disk: octree, cache, kept fields with what they learnt, and the samples so far. A
// guider that is loaded goes on as the one that was saved would have: with the same options and the same
// waves it draws the same directions, to the bit on the CPU policies, whichever of them saved it.
//
// A guide file of version 1, little-endian; detail/section_file.hpp has what is around the sections:
//   options  octree_resolution, mode, fields, kept.resolution and kept.learn (0 of transient fields),
//            groups of lights and lights.resolution (0 without), 4 each
//   octree   origin and side of its cube (4 floats), Morton codes of the leaves in order (8 each)
//   cache    normals (2 a node), swapped sides (1 an inner node); a leaf and side: mean (8) and count (4);
//            deposits dropped (3 x 4)
//   counts   samples, triangles left out (3), vertices dropped, 4 each; a depth: bins, rays, unbinned, cones,
//            8 each
// and of kept fields
//   levels   samples counted, sample until which fields are built in every wave, 4 each; rays a leaf
//            (4 each), level of the node that they belong to (1 each)
//   fields   pressure, births refused, delayed (4 each), born, refreshed (8 each), whether fields learn (4)
//            and a slot in use: its number, key, last use, last build, builds (4 each), normal and fraction
//            (4 floats), and where the fraction is positive its cells: sums of its distribution (4 a cell
//            and row), hits (4 a cell), what was learnt (2 a cell)
// and of groups of lights
//   lights   what was learnt: a node of the level that learns, each of its faces, a group: 4
// All else that a guider has follows from these. About 40 bytes a leaf and 10 F² a field; see
// detail/guide_state.hpp and kept_state.hpp for what is checked.
#pragma once

#include <wfpg/detail/guide_state.hpp>
#include <wfpg/path_guider.hpp>

#include <istream>
#include <ostream>
#include <string>

namespace wfpg {

/// Writes a guider's state, between end_sample() and begin_sample(); waits for the work before it. `name` is
/// what errors call the stream. Throws file_error where the stream takes no more.
template <class Exec>
void save_guide(const path_guider<Exec>& guider, std::ostream& out, const std::string& name = "the guide") {
  detail::file_writer file(out, detail::guide_file_kind, name);
  detail::state_access::save(guider, file);
}

/// The same to a file: under a temporary name beside it, then renamed, so that an old one is replaced by a
/// whole one or not at all. Throws file_error.
template <class Exec>
void save_guide(const path_guider<Exec>& guider, const std::string& path) {
  detail::replace_file(path, [&](std::ostream& out) { save_guide(guider, out, path); });
}

/// A guider in the state that was saved. Those of `options` that decide how state is laid out
/// (octree_resolution, mode, fields, kept.resolution, kept.learn, the number of lights.weights and
/// lights.resolution) are to be what they were, and kept.budget_bytes to have room; the others may differ,
/// and are not in the file. Reads up to the guide's end and no further. Throws file_error that says what is
/// wrong: no guide file, a newer version, where it is truncated, which section is altered, which option
/// differs; std::invalid_argument for options out of range, out_of_memory. What is there decides the memory
/// taken, not what the file says. O(bytes), and the octree is built.
template <class Exec>
path_guider<Exec> load_guide(const Exec& exec, std::istream& in, const guider_options& options,
                             const std::string& name = "the guide") {
  detail::file_reader file(in, detail::guide_file_kind, name);
  return detail::state_access::load(exec, file, options);
}

/// The same from a file, of which nothing may be left over.
template <class Exec>
path_guider<Exec> load_guide(const Exec& exec, const std::string& path, const guider_options& options) {
  return detail::read_file(path, [&](std::istream& in) { return load_guide(exec, in, options, path); });
}

}  // namespace wfpg
