// Scenes from glTF 2.0 files, .glb and .gltf.
#pragma once

#include "scene/scene.hpp"

#include <string>

namespace render {

/// Reads the file's default scene:
/// - triangle meshes with node transforms, normals and the first texture coordinates
/// - base colour and metallic-roughness, factors and textures with their wrap modes and KHR_texture_transform
/// - alpha masks
/// - KHR_materials_transmission, _diffuse_transmission, _ior, _specular (its factor), _emissive_strength with
///   textures, and _volume
/// - KHR_lights_punctual
/// - the first perspective camera, or without one a view of the bounding box from +z
/// - from the scene's extras `resolution` (width, height) and `environment.radiance` (a number or RGB)
///
/// Other requests of the file are left out, with a line in scene::warnings. A scene may have no triangles.
/// Throws std::runtime_error with path and reason for a file that is missing or damaged. It also throws for
/// references to missing content, or to files outside of its folder.
scene load_gltf(const std::string& path);

}  // namespace render
