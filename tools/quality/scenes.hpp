// Scenes as they are measured: loaded, with their options complete, and told apart by their content.
#pragma once

#include "scene/scene.hpp"
#include "settings.hpp"

#include <iosfwd>
#include <string>

namespace quality {

/// The scene with its environment. Throws as render::load_scene and render::read_environment do.
render::scene load(const scene_choice& choice);

/// Takes size and depth from the scene where the choice has none. Writes what the scene warns of to `log`.
/// Throws std::invalid_argument for a scene without light.
scene_choice completed(scene_choice choice, const render::scene& scene, std::ostream& log);

/// Of a built-in scene its name; of a file a hash of it and of the files that it refers to; of both the
/// environment's. Throws std::runtime_error that names what cannot be read.
std::string identity_of(const scene_choice& choice);

}  // namespace quality
