// Loads scenes, and hashes their files.
#include "scenes.hpp"

#include "app/image_io.hpp"
#include "app/render_arguments.hpp"
#include "scene/builtin_scenes.hpp"
#include "scene/gltf_json.hpp"
#include "system.hpp"

#include <ostream>
#include <stdexcept>

namespace quality {
namespace {

namespace fs = std::filesystem;

/// The contents of the buffers and images that a .gltf file refers to.
std::string referred_content(const fs::path& path, const std::string& content) {
  std::string result;
  const json document = json::parse(content);
  for (const char* const kind : {"buffers", "images"})
    for (const json& part : document.value(kind, json::array())) {
      const std::string uri = part.value("uri", "");
      if (!uri.empty() && uri.rfind("data:", 0) != 0)
        result += hash_of(content_of(path.parent_path() / render::gltf::decoded_uri(uri)));
    }
  return result;
}

std::string hash_of_scene_file(const fs::path& path) {
  const std::string content = content_of(path);
  return hash_of(path.extension() == ".gltf" ? content + referred_content(path, content) : content);
}

}  // namespace

render::scene load(const scene_choice& choice) {
  render::scene scene = render::load_scene(choice.source);
  if (!choice.environment.empty()) scene.sky = render::read_environment(choice.environment);
  return scene;
}

scene_choice completed(scene_choice choice, const render::scene& scene, std::ostream& log) {
  const std::string begin = "wfpg-quality: warning: " + choice.title + ": ";
  for (const std::string& warning : scene.warnings) log << begin << warning << '\n';
  if (!scene.punctual_lights.empty() && !choice.options.nee)
    log << begin << "point, spot and directional lights are lost with --nee off\n";
  if (render::is_dark(scene))
    throw std::invalid_argument(choice.title + " has no light: there is nothing to measure");
  if (choice.options.width == 0) {
    choice.options.width = scene.width;
    choice.options.height = scene.height;
  }
  if (choice.options.max_depth == 0) choice.options.max_depth = scene.max_depth;
  return choice;
}

std::string identity_of(const scene_choice& choice) {
  const bool is_builtin = render::is_builtin_scene(choice.source);
  std::string identity =
      is_builtin ? "built-in " + choice.source : "file " + hash_of_scene_file(choice.source);
  if (!choice.environment.empty()) identity += ", environment " + hash_of(content_of(choice.environment));
  return identity;
}

}  // namespace quality
