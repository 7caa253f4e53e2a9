// A table of fields and their types. Materials are walked by their fields' names.
#include "scene/gltf_json.hpp"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <stdexcept>
#include <vector>

namespace render::gltf {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

enum class kind { index, indices, size, number, numbers, number_or_numbers, text, object, objects };
using fields = std::map<std::string, kind>;

[[noreturn]] void refuse(const std::string& place, const json& value, const std::string& expected) {
  std::string shown = value.dump(-1, ' ', true, json::error_handler_t::replace);
  if (shown.size() > 60) shown = shown.substr(0, 57) + "...";
  throw std::runtime_error(place + " is " + shown + ", expected " + expected);
}

bool is_whole(const json& value, std::uint64_t most) {
  return value.is_number_unsigned() && value.get<std::uint64_t>() <= most;
}

template <class Holds>
bool is_array_of(const json& value, const Holds& holds) {
  if (!value.is_array()) return false;
  for (const json& element : value)
    if (!holds(element)) return false;
  return true;
}

void check(const std::string& place, const json& value, kind expected) {
  const auto is_index = [](const json& v) { return is_whole(v, std::numeric_limits<std::int32_t>::max()); };
  const auto is_number = [](const json& v) { return v.is_number(); };
  const auto is_object = [](const json& v) { return v.is_object(); };
  const auto require = [&](bool holds, const char* what) {
    if (!holds) refuse(place, value, what);
  };
  switch (expected) {
    case kind::index:
      return require(is_index(value), "a whole number from 0 to 2^31 - 1");
    case kind::indices:
      return require(is_array_of(value, is_index), "a list of whole numbers from 0 to 2^31 - 1");
    case kind::size:
      return require(is_whole(value, std::uint64_t(1) << 53), "a whole number from 0 to 2^53");
    case kind::number:
      return require(is_number(value), "a number");
    case kind::numbers:
      return require(is_array_of(value, is_number), "a list of numbers");
    case kind::number_or_numbers:
      return require(is_number(value) || is_array_of(value, is_number), "numbers");
    case kind::text:
      return require(value.is_string(), "a text");
    case kind::object:
      return require(is_object(value), "an object");
    case kind::objects:
      return require(is_array_of(value, is_object), "a list of objects");
  }
}

void check_fields(const std::string& place, const json& object, const fields& expected) {
  for (const auto& [name, type] : expected)
    if (const auto field = object.find(name); field != object.end())
      check(place.empty() ? name : place + "." + name, *field, type);
}

std::string element_name(const std::string& list, std::size_t index) {
  return list + "[" + std::to_string(index) + "]";
}

/// Calls `visit(place, element)` for each object of a list, if the list exists.
template <class Visit>
void for_each_object(const std::string& list, const json& owner, const std::string& name,
                     const Visit& visit) {
  const auto found = owner.find(name);
  if (found == owner.end()) return;
  check(list, *found, kind::objects);
  for (std::size_t i = 0; i < found->size(); ++i) visit(element_name(list, i), (*found)[i]);
}

const json* member(const json& object, const char* name) {
  const auto found = object.find(name);
  return found == object.end() ? nullptr : &*found;
}

void check_mesh(const std::string& place, const json& mesh) {
  for_each_object(place + ".primitives", mesh, "primitives",
                  [](const std::string& at, const json& primitive) {
                    check_fields(at, primitive,
                                 {{"indices", kind::index},
                                  {"material", kind::index},
                                  {"mode", kind::index},
                                  {"attributes", kind::object}});
                    if (const json* const attributes = member(primitive, "attributes"))
                      for (const auto& [name, accessor] : attributes->items())
                        check(at + "." + name, accessor, kind::index);
                  });
}

/// Checks materials, their textures and extensions, in which a name has one type.
void check_material(const std::string& place, const json& part) {
  static const fields expected = {{"index", kind::index},
                                  {"texCoord", kind::index},
                                  {"baseColorFactor", kind::numbers},
                                  {"metallicFactor", kind::number},
                                  {"roughnessFactor", kind::number},
                                  {"emissiveFactor", kind::numbers},
                                  {"alphaCutoff", kind::number},
                                  {"emissiveStrength", kind::number},
                                  {"ior", kind::number},
                                  {"transmissionFactor", kind::number},
                                  {"diffuseTransmissionFactor", kind::number},
                                  {"diffuseTransmissionColorFactor", kind::numbers},
                                  {"thicknessFactor", kind::number},
                                  {"attenuationDistance", kind::number},
                                  {"attenuationColor", kind::numbers},
                                  {"specularFactor", kind::number},
                                  {"specularColorFactor", kind::numbers},
                                  {"strength", kind::number},
                                  {"offset", kind::numbers},
                                  {"rotation", kind::number},
                                  {"scale", kind::number_or_numbers},
                                  {"alphaMode", kind::text},
                                  {"pbrMetallicRoughness", kind::object},
                                  {"extensions", kind::object}};
  check_fields(place, part, expected);
  for (const auto& [name, value] : part.items())
    if (value.is_object() && name != "extras") check_material(place + "." + name, value);
}

void check_light(const std::string& place, const json& light) {
  check_fields(place, light,
               {{"type", kind::text},
                {"color", kind::numbers},
                {"intensity", kind::number},
                {"range", kind::number},
                {"spot", kind::object}});
  if (const json* const spot = member(light, "spot"))
    check_fields(place + ".spot", *spot,
                 {{"innerConeAngle", kind::number}, {"outerConeAngle", kind::number}});
}

/// The KHR_lights_punctual of a file or a node, if it has one.
const json* lights_of(const std::string& place, const json& owner) {
  const json* const extensions = member(owner, "extensions");
  if (!extensions) return nullptr;
  check(place + "extensions", *extensions, kind::object);
  const json* const lights = member(*extensions, "KHR_lights_punctual");
  if (lights) check(place + "extensions.KHR_lights_punctual", *lights, kind::object);
  return lights;
}

void check_camera(const std::string& place, const json& camera) {
  check_fields(place, camera, {{"type", kind::text}, {"perspective", kind::object}});
  if (const json* const perspective = member(camera, "perspective"))
    check_fields(place + ".perspective", *perspective,
                 {{"yfov", kind::number},
                  {"aspectRatio", kind::number},
                  {"znear", kind::number},
                  {"zfar", kind::number}});
}

/// Symbolic links are followed, since the folder's owner made them.
void check_uri(const std::string& place, const json& owner, const std::string& folder) {
  const json* const uri = member(owner, "uri");
  if (!uri) return;
  check(place + ".uri", *uri, kind::text);
  const auto& text = uri->get_ref<const std::string&>();
  if (text.rfind("data:", 0) == 0) return;
  const std::string name = decoded_uri(text);
  const fs::path file = fs::path(name).lexically_normal();
  const bool leaves = file.is_absolute() || name.find("://") != std::string::npos ||
                      (file.begin() != file.end() && *file.begin() == "..");
  if (leaves) refuse(place + ".uri", *uri, "a file in the scene's folder");
  std::error_code error;
  if (name.find('\0') != std::string::npos || !fs::is_regular_file(fs::path(folder) / name, error))
    refuse(place + ".uri", *uri, "a file that is there, in the scene's folder");
}

void check_lists(const json& file) {
  static const std::vector<std::pair<std::string, fields>> lists = {
      {"buffers", {{"byteLength", kind::size}}},
      {"bufferViews",
       {{"buffer", kind::index},
        {"byteOffset", kind::size},
        {"byteLength", kind::size},
        {"byteStride", kind::size},
        {"target", kind::index}}},
      {"accessors",
       {{"bufferView", kind::index},
        {"byteOffset", kind::size},
        {"componentType", kind::index},
        {"count", kind::size},
        {"type", kind::text},
        {"min", kind::numbers},
        {"max", kind::numbers},
        {"sparse", kind::object}}},
      {"nodes",
       {{"mesh", kind::index},
        {"camera", kind::index},
        {"skin", kind::index},
        {"children", kind::indices},
        {"translation", kind::numbers},
        {"rotation", kind::numbers},
        {"scale", kind::numbers},
        {"matrix", kind::numbers},
        {"weights", kind::numbers}}},
      {"scenes", {{"nodes", kind::indices}}},
      {"textures", {{"source", kind::index}, {"sampler", kind::index}}},
      {"images", {{"bufferView", kind::index}, {"mimeType", kind::text}}},
      {"samplers",
       {{"magFilter", kind::index},
        {"minFilter", kind::index},
        {"wrapS", kind::index},
        {"wrapT", kind::index}}}};
  for (const auto& [name, expected] : lists)
    for_each_object(name, file, name, [&types = expected](const std::string& place, const json& object) {
      check_fields(place, object, types);
    });
}

}  // namespace

std::string decoded_uri(const std::string& uri) {
  std::string result;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const bool is_escape =
        uri[i] == '%' && i + 2 < uri.size() && uri.find_first_not_of("0123456789abcdefABCDEF", i + 1) > i + 2;
    result += is_escape ? static_cast<char>(std::stoi(uri.substr(i + 1, 2), nullptr, 16)) : uri[i];
    if (is_escape) i += 2;
  }
  return result;
}

void check_json(std::string_view text, const std::string& folder) {
  const json file = json::parse(text.begin(), text.end(), nullptr, false);
  if (!file.is_object()) return;
  check_fields("", file, {{"scene", kind::index}, {"asset", kind::object}});
  check_lists(file);
  for (const std::string list : {"buffers", "images"})
    for_each_object(list, file, list,
                    [&](const std::string& place, const json& object) { check_uri(place, object, folder); });
  for_each_object("meshes", file, "meshes", check_mesh);
  for_each_object("materials", file, "materials", check_material);
  for_each_object("cameras", file, "cameras", check_camera);
  for_each_object("nodes", file, "nodes", [](const std::string& place, const json& node) {
    if (const json* const light = lights_of(place + ".", node))
      check_fields(place + ".extensions.KHR_lights_punctual", *light, {{"light", kind::index}});
  });
  if (const json* const lights = lights_of("", file))
    for_each_object("extensions.KHR_lights_punctual.lights", *lights, "lights", check_light);
}

}  // namespace render::gltf
