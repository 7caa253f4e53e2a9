// Guiders of renderings that are resumed, or that begin with another rendering's guide.
#pragma once

#include "app/render.hpp"
#include "scene/scene_checksum.hpp"

#include <wfpg/guide_file.hpp>

#include <sstream>
#include <string>

namespace render {

/// A guide's options, with the scene's tag where a file is read or written.
template <class Options>
Options tagged(const scene& scene, const render_options& options, Options guided) {
  const bool on_disk =
      options.keep_guide || options.keep_state || !options.load_guide.empty() || !options.resume.empty();
  if (on_disk) guided.scene_tag = checksum_without_camera(scene);
  return guided;
}

/// A guider over a scene. `from()` returns the triangles or fragments that a new one is made over. Its state
/// comes from a guide file's bytes if the rendering is resumed, or from the file in the options; then `from`
/// is not called. Throws wfpg::file_error, also for a guide of another scene.
template <class Exec, class From, class Options>
auto begin_guider(const Exec& exec, const scene& scene, const From& from, Options guided,
                  const render_options& options, const std::string& saved) {
  guided = tagged(scene, options, guided);
  if (!options.load_guide.empty()) return wfpg::load_guide(exec, options.load_guide, guided);
  using guider_type = wfpg::path_guider<Exec, wfpg::octree_guide_for<Exec, Options>>;
  if (options.resume.empty()) return guider_type(exec, from(), guided);
  std::istringstream bytes(saved);
  return wfpg::load_guide(exec, bytes, guided, options.resume + ": its guide");
}

/// A guide file's bytes, if the options ask for them.
template <class Exec, class Guide>
std::string saved_guide(const wfpg::path_guider<Exec, Guide>& guider, const render_options& options) {
  if (!options.keep_guide && !options.keep_state) return {};
  std::ostringstream out;
  wfpg::save_guide(guider, out);
  return out.str();
}

}  // namespace render
