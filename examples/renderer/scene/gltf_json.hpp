// Checks a glTF file's JSON before tinygltf reads it. tinygltf takes fields of another type for missing ones,
// and negative indices for none.
#pragma once

#include <string>
#include <string_view>

namespace render::gltf {

/// Checks the fields of buffers, accessors, nodes, meshes, materials, textures, cameras and lights. Throws
/// std::runtime_error "PLACE is VALUE, expected WHAT", such as "bufferViews[0].byteOffset is -4, expected a
/// whole number from 0 on". Reasons are another type, numbers out of range, and URIs that leave the scene's
/// `folder` or name nothing in it. Text that is not JSON passes, since tinygltf reports it.
void check_json(std::string_view text, const std::string& folder);

/// The file name of a URI. %20 and similar codes become bytes.
std::string decoded_uri(const std::string& uri);

}  // namespace render::gltf
