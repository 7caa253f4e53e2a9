// What glTF's metallic-roughness materials become in the renderer, and their base colour textures.
#pragma once

#include "scene/gltf_file.hpp"
#include "scene/scene.hpp"

namespace render::gltf {

/// Appends one material for each of the model's and, last, one for primitives without a material (diffuse 0.8
/// rather than glTF's white metal); fills `target.textures` with the images that are used, decoded to linear
/// numbers. What is not supported becomes a line in `target.warnings`. Throws
/// std::runtime_error for indices out of range and for images that cannot be decoded.
void add_materials(const tinygltf::Model& model, scene& target);

}  // namespace render::gltf
