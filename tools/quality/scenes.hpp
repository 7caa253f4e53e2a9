// Scenes as they are measured: loaded, with complete options, and identified by their content.
#pragma once

#include "scene/scene.hpp"
#include "settings.hpp"

#include <iosfwd>
#include <string>

namespace quality {

/// The scene with its environment. Throws as render::load_scene and render::read_environment do.
render::scene load(const scene_choice& choice);

/// Takes size and depth from the scene if the choice has none. Writes the scene's warnings to `log`. Throws
/// std::invalid_argument for a scene without light.
scene_choice completed(scene_choice choice, const render::scene& scene, std::ostream& log);

/// Identifies a scene: a built-in scene by its name, a file by a hash of it and of the files that it refers
/// to. Includes the environment. Throws std::runtime_error that names an unreadable file.
std::string identity_of(const scene_choice& choice);

}  // namespace quality
