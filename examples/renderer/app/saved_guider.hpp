// Guiders of renderings that go on, or that begin with what another one has learnt.
#pragma once

#include "app/render.hpp"
#include "scene/scene_checksum.hpp"

#include <wfpg/guide_file.hpp>

#include <sstream>
#include <string>

namespace render {

/// A guider over a scene's triangles, which `mesh` has on the device: in the state of a guide file's bytes
/// where a rendering goes on, or of the file that options name; else it knows nothing yet. Throws
/// wfpg::file_error, also where the guide is of another scene.
template <class Exec, class Options>
auto begin_guider(const Exec& exec, const scene& scene, const wfpg::triangle_mesh_view& mesh, Options guided,
                  const render_options& options, const std::string& saved) {
  const bool on_disk =
      options.keep_guide || options.keep_state || !options.load_guide.empty() || !options.resume.empty();
  if (on_disk) guided.scene_tag = checksum_without_camera(scene);
  if (!options.load_guide.empty()) return wfpg::load_guide(exec, options.load_guide, guided);
  using guider_type = wfpg::path_guider<Exec, wfpg::octree_guide_for<Exec, Options>>;
  if (options.resume.empty()) return guider_type(exec, mesh, guided);
  std::istringstream bytes(saved);
  return wfpg::load_guide(exec, bytes, guided, options.resume + ": its guide");
}

/// A guide file's bytes, where options ask for them.
template <class Exec, class Guide>
std::string saved_guide(const wfpg::path_guider<Exec, Guide>& guider, const render_options& options) {
  if (!options.keep_guide && !options.keep_state) return {};
  std::ostringstream out;
  wfpg::save_guide(guider, out);
  return out.str();
}

}  // namespace render
