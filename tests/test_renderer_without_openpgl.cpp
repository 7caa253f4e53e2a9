// The renderer's errors for Open PGL's methods if it was built without Open PGL.
#include "app/render.hpp"
#include "scene/builtin_scenes.hpp"
#include "support/catch.hpp"

#include <stdexcept>
#include <string>

TEST_CASE("without Open PGL its methods say how to get it", "[renderer]") {
  CHECK_FALSE(render::has_openpgl());
  const render::scene box = render::make_builtin_scene("cornell-box");
  render::render_options options;
  options.spp = 1;
  for (const auto method : {render::sampling_method::openpgl_vmm, render::sampling_method::openpgl_dqt}) {
    options.method = method;
    std::string message;
    try {
      render::render(box, options, {});
    } catch (const std::runtime_error& error) {
      message = error.what();
    }
    INFO(message);
    CHECK(message.find("built without Open PGL") != std::string::npos);
    CHECK(message.find("-Dopenpgl_DIR=") != std::string::npos);
  }
}
