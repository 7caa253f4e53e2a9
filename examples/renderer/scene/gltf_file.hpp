// Reading a glTF file without trusting it: the model as tinygltf parses it, and accessors with every bound
// checked. Everything here throws std::runtime_error with the reason; load_gltf puts the path in front.
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

/// Whether files that need an extension are read as they are meant.
bool is_supported_extension(const std::string& name);

/// The model of a .gltf or .glb file (told apart by their first bytes), glTF version 2 only. Images are not
/// decoded: tinygltf::Image::image holds the encoded bytes of an image from a URI, nothing for one from a
/// buffer view.
tinygltf::Model read_model(const std::string& path, std::vector<std::string>& warnings);

/// Bytes [first, first + size) inside a model's buffer.
struct byte_range {
  const unsigned char* first = nullptr;
  std::size_t size = 0;
};

/// The bytes of a buffer view; throws where it leaves its buffer.
byte_range view_bytes(const tinygltf::Model& model, int buffer_view);

/// Whether the accessor exists and is sparse, which nothing here reads.
bool is_sparse(const tinygltf::Model& model, int accessor);

/// A VEC3 accessor of floats.
std::vector<vec3> read_vec3(const tinygltf::Model& model, int accessor);

/// A VEC2 accessor of floats, or of 8- or 16-bit unsigned integers as fractions of their range.
std::vector<vec2> read_vec2(const tinygltf::Model& model, int accessor);

/// A SCALAR accessor of 8-, 16- or 32-bit unsigned integers.
std::vector<std::uint32_t> read_indices(const tinygltf::Model& model, int accessor);

/// The refusal of a light brighter than `largest_radiance` or not finite: "WHAT of X, at most 1e+15 is
/// supported". `what` names the light and what is too large.
std::runtime_error too_bright(const std::string& what, double found);

/// A number of an object's member, or `otherwise` where it is missing or no finite number.
double number_of(const tinygltf::Value& object, const char* member, double otherwise);

}  // namespace render::gltf
