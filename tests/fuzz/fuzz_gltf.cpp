// The glTF loader on any bytes: a valid scene, or an error with the path and a reason.
#include "memory_file.hpp"
#include "require.hpp"
#include "scene/gltf_loader.hpp"

#include <wfpg/base/math.hpp>

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace {

using wfpg::is_finite;
using wfpg_fuzz::require;

bool is_texture(const render::scene& scene, const render::texture_reference& reference) {
  return reference.index < 0 || static_cast<std::size_t>(reference.index) < scene.textures.size();
}

/// Checks what the renderer relies on.
void check(const render::scene& scene) {
  const std::size_t vertices = scene.positions.size();
  require(scene.normals.empty() || scene.normals.size() == vertices, "as many normals as positions");
  require(scene.uvs.empty() || scene.uvs.size() == vertices, "as many texture coordinates as positions");
  require(scene.triangle_materials.size() == scene.triangles.size(), "a material for each triangle");
  for (const wfpg::uvec3& t : scene.triangles)
    require(t.x < vertices && t.y < vertices && t.z < vertices, "triangles of vertices that exist");
  for (const std::uint32_t m : scene.triangle_materials)
    require(m < scene.materials.size(), "materials that exist");
  for (const render::material& m : scene.materials) {
    require(is_texture(scene, m.base_texture) && is_texture(scene, m.metallic_roughness_texture) &&
                is_texture(scene, m.emission_texture),
            "textures that exist");
    require(m.alpha > 0.0f && m.alpha <= 1.0f && m.ior > 0.0f, "roughness and index in their ranges");
    require(is_finite(m.base_color) && is_finite(m.emission) && is_finite(m.absorption) &&
                is_finite(m.scattering) && std::fabs(m.g) < 1.0f,
            "finite materials");
  }
  require(is_finite(scene.fog.extinction()) && std::fabs(scene.fog.g) < 1.0f, "a finite fog");
  require(is_finite(scene.view.position) && is_finite(scene.view.forward) && is_finite(scene.view.up) &&
              scene.view.vertical_fov > 0.0f,
          "a camera that sees");
  require(scene.width > 0 && scene.height > 0 && scene.max_depth > 0, "a picture of some size");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const wfpg_fuzz::memory_file file;
  file.hold({reinterpret_cast<const char*>(bytes), size});
  try {
    check(render::load_gltf(file.path()));
  } catch (const std::runtime_error& error) {
    require(std::string(error.what()).rfind(file.path() + ": ", 0) == 0, "errors name the path");
  }
  return 0;
}
