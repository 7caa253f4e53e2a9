// Checks of a glTF file's JSON before tinygltf reads it, which takes fields of another type for missing ones
// and negative indices for none.
#pragma once

#include <string>
#include <string_view>

namespace render::gltf {

/// Throws std::runtime_error "PLACE is VALUE, expected WHAT", such as "bufferViews[0].byteOffset is -4,
/// expected a whole number from 0 on", for fields of buffers, accessors, nodes, meshes, materials, textures,
/// cameras and lights that are of another type, or numbers out of range; and for URIs that leave `folder`,
/// the scene's, or name nothing in it. Text that is no JSON passes: tinygltf says what is wrong with it.
void check_json(std::string_view text, const std::string& folder);

/// The file name that a URI stands for: %20 and its like are bytes.
std::string decoded_uri(const std::string& uri);

}  // namespace render::gltf
