// Replaces render_openpgl.cpp in builds without Open PGL.
#include "app/render.hpp"

#include <stdexcept>

namespace render {

bool has_openpgl() {
  return false;
}

render_result render_with_openpgl(const scene&, const render_options&, const progress_callback&) {
  throw std::runtime_error(
      "--method openpgl-vmm and openpgl-dqt: this program was built without Open PGL; install 0.7 of it or "
      "later from its repository RenderKit/openpgl, configure with -Dopenpgl_DIR=DIRECTORY, which holds its "
      "openpglConfig.cmake, and build again");
}

}  // namespace render
