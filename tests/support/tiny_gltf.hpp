// A .gltf or .glb file of one triangle. A test replaces its parts, valid or hostile.
#pragma once

#include "scene/gltf_loader.hpp"
#include "support/catch.hpp"
#include "support/renderer_io.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace render_test {

inline std::string base64(const std::string& bytes) {
  static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (i + k < bytes.size() ? std::uint8_t(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k <= bytes.size() ? digits[group >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

template <class T>
std::string raw(const std::vector<T>& values) {
  std::string bytes(values.size() * sizeof(T), '\0');
  if (!values.empty()) std::memcpy(&bytes[0], values.data(), bytes.size());
  return bytes;
}

/// A .gltf of one triangle, whose parts a test replaces. Its buffer has 36 bytes of positions, 6 of indices
/// and 2 unused.
struct tiny_gltf {
  std::string buffer = raw<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}) + raw<std::uint16_t>({0, 1, 2, 0});
  std::map<std::string, std::string> parts = {
      {"asset", R"({"version": "2.0"})"},
      {"scene", "0"},
      {"scenes", R"([{"nodes": [0]}])"},
      {"nodes", R"([{"mesh": 0}])"},
      {"meshes", R"([{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}])"},
      {"materials", R"([{"pbrMetallicRoughness": {"metallicFactor": 0}}])"},
      {"accessors", R"([{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
                        {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}])"},
      {"bufferViews", R"([{"buffer": 0, "byteOffset": 0, "byteLength": 36},
                          {"buffer": 0, "byteOffset": 36, "byteLength": 6}])"},
  };

  tiny_gltf& with(const std::string& part, const std::string& json) {
    parts[part] = json;
    return *this;
  }

  std::string json(bool embedded = true) const {
    std::string text = "{";
    for (const auto& part : parts) text += '"' + part.first + "\": " + part.second + ",\n";
    const std::string uri =
        embedded ? R"(, "uri": "data:application/octet-stream;base64,)" + base64(buffer) + '"' : "";
    return text + R"("buffers": [{"byteLength": )" + std::to_string(buffer.size()) + uri + "}]}";
  }

  /// The same content as a binary file.
  std::string glb() const {
    std::string text = json(false);
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const auto size = [](std::size_t n) { return std::uint32_t(n); };
    const std::vector<std::uint32_t> head = {0x46546C67u, 2u, size(12 + 8 + text.size() + 8 + buffer.size()),
                                             size(text.size()), 0x4E4F534Au};
    return raw(head) + text + raw<std::uint32_t>({size(buffer.size()), 0x004E4942u}) + buffer;
  }

  scene load() const {
    temporary_folder folder;
    return render::load_gltf(folder.write("tiny.gltf", json()));
  }

  /// The message of the error when it is loaded.
  std::string error() const { return error_of(json()); }

  static std::string error_of(const std::string& content) {
    temporary_folder folder;
    const std::string path = folder.write("hostile.gltf", content);
    try {
      render::load_gltf(path);
    } catch (const std::runtime_error& error) {
      const std::string message = error.what();
      CHECK(message.rfind(path + ": ", 0) == 0);
      CHECK(message.size() > path.size() + 2);
      return message.substr(std::min(message.size(), path.size() + 2));
    }
    return "nothing was thrown";
  }
};

}  // namespace render_test
