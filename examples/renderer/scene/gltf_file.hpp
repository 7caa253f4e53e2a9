// Reads a glTF file without trusting it: the model as tinygltf parses it, and accessors with all bounds
// checked. All functions throw std::runtime_error with the reason. load_gltf puts the path in front.
#pragma once

#include "scene/scene.hpp"

#include <tiny_gltf.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace render::gltf {

/// Adds a line to `warnings` unless it is there already.
void warn_once(std::vector<std::string>& warnings, const std::string& line);

/// Whether the loader supports an extension that a file requires.
bool is_supported_extension(const std::string& name);

/// The model of a .gltf or .glb file (identified by their first bytes), only glTF version 2. Images are not
/// decoded. tinygltf::Image::image holds the encoded bytes of an image from a URI, and nothing for one from a
/// buffer view.
tinygltf::Model read_model(const std::string& path, std::vector<std::string>& warnings);

/// Bytes [first, first + size) inside a model's buffer.
struct byte_range {
  const unsigned char* first = nullptr;
  std::size_t size = 0;
};

/// The bytes of a buffer view. Throws if it exceeds its buffer.
byte_range view_bytes(const tinygltf::Model& model, int buffer_view);

/// Whether the accessor exists and is sparse, which is not supported.
bool is_sparse(const tinygltf::Model& model, int accessor);

/// Reads a VEC3 accessor of floats.
std::vector<vec3> read_vec3(const tinygltf::Model& model, int accessor);

/// Reads a VEC2 accessor of floats, or of 8- or 16-bit unsigned integers as fractions of their range.
std::vector<vec2> read_vec2(const tinygltf::Model& model, int accessor);

/// Reads a SCALAR accessor of 8-, 16- or 32-bit unsigned integers.
std::vector<std::uint32_t> read_indices(const tinygltf::Model& model, int accessor);

/// The error for a light that is brighter than `largest_radiance` or not finite: "WHAT of X, at most 1e+15 is
/// supported". `what` names the light and its quantity.
std::runtime_error too_bright(const std::string& what, double found);

/// A number in an object's member, or `otherwise` if it is missing or not a finite number.
double number_of(const tinygltf::Value& object, const char* member, double otherwise);

}  // namespace render::gltf
