// Guiders of renderings that go on, or that begin with what another one has learnt.
#pragma once

#include "render.hpp"

#include <wfpg/guide_file.hpp>

#include <sstream>
#include <string>

namespace render {

/// A guider over a scene's triangles: in the state that a guide file's bytes hold, where a rendering goes on,
/// or a file that options name, and else one that knows nothing yet. Throws wfpg::file_error.
template <class Exec>
wfpg::path_guider<Exec> begin_guider(const Exec& exec, const wfpg::triangle_mesh_view& mesh,
                                     const wfpg::guider_options& guided, const render_options& options,
                                     const std::string& saved) {
  if (!options.load_guide.empty()) return wfpg::load_guide(exec, options.load_guide, guided);
  if (options.resume.empty()) return wfpg::path_guider<Exec>(exec, mesh, guided);
  std::istringstream bytes(saved);
  return wfpg::load_guide(exec, bytes, guided, options.resume + ": its guide");
}

/// A guide file's bytes, where options ask for them.
template <class Exec>
std::string kept_guide(const wfpg::path_guider<Exec>& guider, const render_options& options) {
  if (!options.keep_guide && !options.keep_state) return {};
  std::ostringstream out;
  wfpg::save_guide(guider, out);
  return out.str();
}

}  // namespace render
