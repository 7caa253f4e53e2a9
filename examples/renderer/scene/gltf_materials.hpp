// Converts glTF's metallic-roughness materials and their textures to the renderer's.
#pragma once

#include "scene/gltf_file.hpp"
#include "scene/scene.hpp"

namespace render::gltf {

/// Appends one material for each of the model's. The last one is for primitives without a material (diffuse
/// 0.8 rather than glTF's white metal). Fills `target.textures` with the images in use, decoded to linear
/// numbers. Each unsupported feature becomes a line in `target.warnings`. Throws std::runtime_error for
/// indices out of range and for images that cannot be decoded.
void add_materials(const tinygltf::Model& model, scene& target);

/// A medium in `extras`: absorption and scattering, each a number or three, and g. Missing ones are 0. Throws
/// std::runtime_error that names `place` and the member.
medium read_medium(const tinygltf::Value& value, const std::string& place);

}  // namespace render::gltf
