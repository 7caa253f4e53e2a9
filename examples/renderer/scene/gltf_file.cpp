// Files, GLB framing and accessors. tinygltf parses the JSON. Checks that it lacks are made here, before
// (framing, nesting, types of fields) or after (accessors, buffer views).
#include "scene/gltf_file.hpp"

#include "scene/gltf_json.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace render::gltf {
namespace {

using bytes = std::vector<unsigned char>;

/// tinygltf converts extras recursively, so nesting costs stack.
constexpr int max_nesting = 200;

constexpr std::size_t glb_header_size = 12;
constexpr std::size_t glb_chunk_header_size = 8;

[[noreturn]] void fail(const std::string& reason) {
  throw std::runtime_error(reason);
}

bytes read_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) fail("cannot be opened");
  const std::streamoff size = file.tellg();
  if (size < 0 || !file.seekg(0)) fail("cannot be read");
  if (size == 0) fail("is empty");
  if (std::uint64_t(size) > std::numeric_limits<std::uint32_t>::max()) fail("is larger than 4 GiB");
  bytes content(static_cast<std::size_t>(size));
  if (!file.read(reinterpret_cast<char*>(content.data()), size)) fail("cannot be read to its end");
  return content;
}

std::uint32_t word_at(const bytes& file, std::size_t offset) {
  return std::uint32_t(file[offset]) | std::uint32_t(file[offset + 1]) << 8 |
         std::uint32_t(file[offset + 2]) << 16 | std::uint32_t(file[offset + 3]) << 24;
}

bool is_glb(const bytes& file) {
  return file.size() >= 4 && std::memcmp(file.data(), "glTF", 4) == 0;
}

/// The JSON chunk of a binary file. Every chunk must be inside the file with its header. tinygltf's own check
/// omits the second chunk's header.
byte_range glb_json(const bytes& file) {
  if (file.size() < glb_header_size + glb_chunk_header_size) fail("is cut off in the GLB header");
  const std::size_t length = word_at(file, 8);
  if (length > file.size())
    fail("is cut off: " + std::to_string(file.size()) + " bytes of " + std::to_string(length));
  if (length < glb_header_size + glb_chunk_header_size) fail("has no GLB chunk");
  std::size_t offset = glb_header_size;
  while (offset < length) {
    if (length - offset < glb_chunk_header_size) fail("is cut off in a GLB chunk's header");
    const std::size_t chunk = word_at(file, offset);
    if (chunk > length - offset - glb_chunk_header_size) fail("has a GLB chunk that leaves the file");
    offset += glb_chunk_header_size + chunk;
  }
  return {file.data() + glb_header_size + glb_chunk_header_size, word_at(file, glb_header_size)};
}

void require_shallow(const byte_range& json) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < json.size; ++i) {
    const char c = static_cast<char>(json.first[i]);
    if (in_string && c == '\\')
      ++i;
    else if (c == '"')
      in_string = !in_string;
    else if (!in_string && (c == '{' || c == '[') && ++depth > max_nesting)
      fail("nests too deeply");
    else if (!in_string && (c == '}' || c == ']'))
      --depth;
  }
}

/// Replaces tinygltf's decoder, which reads past buffer views that exceed their buffer. Bytes from a buffer
/// view are not read. Bytes from a URI live only during this call, so they are copied.
bool keep_encoded(tinygltf::Image* target, const int, std::string*, std::string*, int, int,
                  const unsigned char* encoded, int size, void*) {
  if (target->bufferView < 0 && size > 0) target->image.assign(encoded, encoded + size);
  return true;
}

void require_supported_extensions(const tinygltf::Model& model) {
  for (const std::string& name : model.extensionsRequired)
    if (!is_supported_extension(name)) fail("requires the extension " + name + ", which is not supported");
}

void add_lines(std::vector<std::string>& warnings, const std::string& text) {
  std::size_t start = 0;
  while (start < text.size()) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    if (end > start) warn_once(warnings, text.substr(start, end - start));
    start = end + 1;
  }
}

/// A message of tinygltf on one line.
std::string one_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ';');
  return text.empty() ? "is no glTF file" : text;
}

const tinygltf::Accessor& accessor_at(const tinygltf::Model& model, int index) {
  if (index < 0 || std::size_t(index) >= model.accessors.size())
    fail("accessor " + std::to_string(index) + " does not exist, there are " +
         std::to_string(model.accessors.size()));
  return model.accessors[std::size_t(index)];
}

/// Elements of an accessor: `count` of them, `stride` bytes apart.
struct elements {
  const unsigned char* first = nullptr;
  std::size_t stride = 0;
  std::size_t count = 0;
  int component = 0;  ///< glTF's componentType
};

std::size_t component_size(int component) {
  switch (component) {
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 1;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 2;
    default:
      return 4;
  }
}

/// Finds an accessor's elements. `type` is glTF's, with `components` components, whose type must be one of
/// `allowed`.
elements locate(const tinygltf::Model& model, int index, int type, std::initializer_list<int> allowed) {
  const tinygltf::Accessor& accessor = accessor_at(model, index);
  const std::string name = "accessor " + std::to_string(index);
  if (accessor.type != type) fail(name + " has the wrong type");
  if (std::find(allowed.begin(), allowed.end(), accessor.componentType) == allowed.end())
    fail(name + " has the wrong component type " + std::to_string(accessor.componentType));
  if (accessor.sparse.isSparse) fail(name + " is sparse, which is not supported");
  const byte_range view = view_bytes(model, accessor.bufferView);
  const auto components = std::size_t(tinygltf::GetNumComponentsInType(std::uint32_t(type)));
  const std::size_t size = components * component_size(accessor.componentType);
  const std::size_t given_stride = model.bufferViews[std::size_t(accessor.bufferView)].byteStride;
  const std::size_t stride = given_stride == 0 ? size : given_stride;
  if (stride < size) fail(name + " has elements larger than their stride");
  const std::size_t offset = accessor.byteOffset;
  const bool fits = accessor.count == 0 || (size <= view.size && offset <= view.size - size &&
                                            accessor.count - 1 <= (view.size - size - offset) / stride);
  if (!fits) fail(name + " leaves its buffer view");
  return {view.first + (accessor.count == 0 ? 0 : offset), stride, accessor.count, accessor.componentType};
}

template <class T>
T value_at(const unsigned char* place) {
  T value;
  std::memcpy(&value, place, sizeof(T));
  return value;
}

/// A component as a float. Integers are fractions of their range.
float fraction_at(const unsigned char* place, int component) {
  if (component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) return float(*place) / 255.0f;
  if (component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT)
    return float(value_at<std::uint16_t>(place)) / 65535.0f;
  return value_at<float>(place);
}

std::uint32_t index_at(const unsigned char* place, int component) {
  if (component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) return *place;
  if (component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) return value_at<std::uint16_t>(place);
  return value_at<std::uint32_t>(place);
}

}  // namespace

bool is_supported_extension(const std::string& name) {
  const char* supported[] = {"KHR_materials_diffuse_transmission",
                             "KHR_materials_emissive_strength",
                             "KHR_materials_ior",
                             "KHR_materials_specular",
                             "KHR_materials_transmission",
                             "KHR_materials_volume",
                             "KHR_texture_transform",
                             "KHR_lights_punctual"};
  return std::find(std::begin(supported), std::end(supported), name) != std::end(supported);
}

void warn_once(std::vector<std::string>& warnings, const std::string& line) {
  if (std::find(warnings.begin(), warnings.end(), line) == warnings.end()) warnings.push_back(line);
}

tinygltf::Model read_model(const std::string& path, std::vector<std::string>& warnings) {
  const bytes file = read_bytes(path);
  const bool binary = is_glb(file);
  const byte_range json = binary ? glb_json(file) : byte_range{file.data(), file.size()};
  require_shallow(json);
  const std::size_t slash = path.find_last_of('/');
  const std::string folder = slash == std::string::npos ? "" : path.substr(0, slash);
  check_json({reinterpret_cast<const char*>(json.first), json.size}, folder);
  const auto size = static_cast<unsigned int>(file.size());

  tinygltf::TinyGLTF parser;
  parser.SetImageLoader(keep_encoded, nullptr);
  tinygltf::Model model;
  std::string errors, remarks;
  const bool parsed =
      binary ? parser.LoadBinaryFromMemory(&model, &errors, &remarks, file.data(), size, folder)
             : parser.LoadASCIIFromString(&model, &errors, &remarks,
                                          reinterpret_cast<const char*>(file.data()), size, folder);
  if (!parsed) fail(one_line(errors));
  if (model.asset.version.rfind("2.", 0) != 0)
    fail("is of glTF version '" + model.asset.version + "', not 2");
  require_supported_extensions(model);
  add_lines(warnings, remarks);
  for (const std::string& name : model.extensionsUsed)
    if (!is_supported_extension(name)) warn_once(warnings, "the extension " + name + " is not supported");
  return model;
}

byte_range view_bytes(const tinygltf::Model& model, int buffer_view) {
  const std::string name = "buffer view " + std::to_string(buffer_view);
  if (buffer_view < 0 || std::size_t(buffer_view) >= model.bufferViews.size()) fail(name + " does not exist");
  const tinygltf::BufferView& view = model.bufferViews[std::size_t(buffer_view)];
  if (view.buffer < 0 || std::size_t(view.buffer) >= model.buffers.size()) fail(name + " has no buffer");
  const bytes& data = model.buffers[std::size_t(view.buffer)].data;
  if (view.byteOffset > data.size() || view.byteLength > data.size() - view.byteOffset)
    fail(name + " leaves its buffer");
  return {data.data() + view.byteOffset, view.byteLength};
}

bool is_sparse(const tinygltf::Model& model, int accessor) {
  return accessor >= 0 && std::size_t(accessor) < model.accessors.size() &&
         model.accessors[std::size_t(accessor)].sparse.isSparse;
}

std::vector<vec3> read_vec3(const tinygltf::Model& model, int accessor) {
  const elements e = locate(model, accessor, TINYGLTF_TYPE_VEC3, {TINYGLTF_COMPONENT_TYPE_FLOAT});
  std::vector<vec3> values(e.count);
  for (std::size_t i = 0; i < e.count; ++i)
    for (int c = 0; c < 3; ++c)
      values[i][c] = value_at<float>(e.first + i * e.stride + sizeof(float) * std::size_t(c));
  return values;
}

std::vector<vec2> read_vec2(const tinygltf::Model& model, int accessor) {
  const elements e = locate(model, accessor, TINYGLTF_TYPE_VEC2,
                            {TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE,
                             TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT});
  const std::size_t size = component_size(e.component);
  std::vector<vec2> values(e.count);
  for (std::size_t i = 0; i < e.count; ++i)
    for (int c = 0; c < 2; ++c)
      values[i][c] = fraction_at(e.first + i * e.stride + size * std::size_t(c), e.component);
  return values;
}

std::vector<std::uint32_t> read_indices(const tinygltf::Model& model, int accessor) {
  const elements e = locate(model, accessor, TINYGLTF_TYPE_SCALAR,
                            {TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT,
                             TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT});
  std::vector<std::uint32_t> values(e.count);
  for (std::size_t i = 0; i < e.count; ++i) values[i] = index_at(e.first + i * e.stride, e.component);
  return values;
}

std::runtime_error too_bright(const std::string& what, double found) {
  std::ostringstream text;
  text << what << " of " << found << ", at most " << largest_radiance << " is supported";
  return std::runtime_error(text.str());
}

double number_of(const tinygltf::Value& object, const char* member, double otherwise) {
  if (!object.IsObject() || !object.Has(member)) return otherwise;
  const tinygltf::Value& value = object.Get(member);
  if (!value.IsNumber()) return otherwise;
  const double number = value.GetNumberAsDouble();
  return std::isfinite(number) ? number : otherwise;
}

}  // namespace render::gltf
