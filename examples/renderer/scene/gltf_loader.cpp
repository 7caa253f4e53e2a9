// The node hierarchy, geometry and camera of a glTF scene. Files and materials have their own sources.
#include "scene/gltf_loader.hpp"

#include "scene/gltf_file.hpp"
#include "scene/gltf_materials.hpp"

#include <glm/common.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace render {
namespace {

using gltf::warn_once;

constexpr int max_picture_side = 1 << 15;

bool finite(vec3 v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

vec3 unit_or(vec3 v, vec3 otherwise) {
  const float length = glm::length(v);
  return length > 0.0f && std::isfinite(length) ? v / length : otherwise;
}

/// A node's own transform. Without a matrix, it comes from translation, rotation and scale.
glm::dmat4 local_transform(const tinygltf::Node& node) {
  const auto has = [](const std::vector<double>& values, std::size_t count, const char* name) {
    if (!values.empty() && values.size() != count)
      throw std::runtime_error(std::string("a node's ") + name + " has not " + std::to_string(count) +
                               " numbers");
    return !values.empty();
  };
  glm::dmat4 result(1.0);
  if (has(node.matrix, 16, "matrix")) return glm::make_mat4(node.matrix.data());
  if (has(node.translation, 3, "translation"))
    result[3] = glm::dvec4(node.translation[0], node.translation[1], node.translation[2], 1.0);
  if (has(node.rotation, 4, "rotation")) {
    const std::vector<double>& q = node.rotation;
    const glm::dquat rotation(q[3], q[0], q[1], q[2]);
    if (glm::length(rotation) > 0.0) result *= glm::mat4_cast(glm::normalize(rotation));
  }
  if (has(node.scale, 3, "scale"))
    for (int c = 0; c < 3; ++c) result[c] *= node.scale[std::size_t(c)];
  return result;
}

/// One primitive's triangles, in the mesh's own space until placed.
struct surface_patch {
  std::vector<vec3> positions;
  std::vector<vec3> normals;  ///< empty: flat
  std::vector<vec2> uvs;      ///< empty: none
  std::vector<std::uint32_t> indices;
};

/// Gives each triangle its own three vertices, for flat normals.
void split_vertices(surface_patch& patch) {
  surface_patch split;
  for (std::uint32_t index : patch.indices) {
    split.indices.push_back(std::uint32_t(split.positions.size()));
    split.positions.push_back(patch.positions[index]);
    if (!patch.uvs.empty()) split.uvs.push_back(patch.uvs[index]);
  }
  patch = std::move(split);
}

/// Replaces zero normals by the mean of the adjacent triangles'.
void repair_normals(surface_patch& patch) {
  std::vector<vec3> sums(patch.positions.size(), vec3(0.0f));
  for (std::size_t t = 0; t + 2 < patch.indices.size(); t += 3) {
    const std::uint32_t* corner = &patch.indices[t];
    const vec3 a = patch.positions[corner[0]];
    const vec3 area = glm::cross(patch.positions[corner[1]] - a, patch.positions[corner[2]] - a);
    for (int i = 0; i < 3; ++i) sums[corner[i]] += area;
  }
  patch.normals.resize(patch.positions.size(), vec3(0.0f));
  for (std::size_t i = 0; i < sums.size(); ++i)
    patch.normals[i] = unit_or(patch.normals[i], unit_or(sums[i], vec3(0.0f, 1.0f, 0.0f)));
}

void transform(surface_patch& patch, const glm::dmat4& to_world) {
  const glm::dmat3 linear(to_world);
  const double determinant = glm::determinant(linear);
  // Cofactors transform normals as the inverse's transpose does, up to a positive factor after the
  // determinant's sign is removed. They exist even if the inverse does not.
  const double sign = determinant < 0.0 ? -1.0 : 1.0;
  const glm::dmat3 for_normals(sign * glm::cross(linear[1], linear[2]),
                               sign * glm::cross(linear[2], linear[0]),
                               sign * glm::cross(linear[0], linear[1]));
  for (vec3& p : patch.positions) {
    p = vec3(to_world * glm::dvec4(p, 1.0));
    if (!finite(p)) throw std::runtime_error("a position is not finite");
  }
  for (vec3& n : patch.normals) n = unit_or(vec3(for_normals * glm::dvec3(n)), vec3(0.0f));
  if (determinant < 0.0)
    for (std::size_t t = 0; t + 2 < patch.indices.size(); t += 3)
      std::swap(patch.indices[t + 1], patch.indices[t + 2]);
}

class scene_reader {
 public:
  scene_reader(const tinygltf::Model& model, scene& target) : model_(model), target_(target) {
    for (const tinygltf::Mesh& mesh : model.meshes)
      for (const tinygltf::Primitive& primitive : mesh.primitives) {
        any_normals_ = any_normals_ || primitive.attributes.count("NORMAL") > 0;
        any_uvs_ = any_uvs_ || primitive.attributes.count("TEXCOORD_0") > 0;
      }
  }

  void read() {
    gltf::add_materials(model_, target_);
    read_nodes();
    read_extras();
    if (!has_camera_) frame_everything();
    if (!model_.animations.empty()) warn("animations are not supported");
  }

 private:
  struct placed_node {
    int index;
    glm::dmat4 parent_to_world;
  };

  void warn(const std::string& line) { warn_once(target_.warnings, line); }

  const tinygltf::Scene* chosen_scene() const {
    if (model_.scenes.empty()) return nullptr;
    const int index = std::max(model_.defaultScene, 0);
    if (std::size_t(index) >= model_.scenes.size())
      throw std::runtime_error("scene " + std::to_string(index) + " does not exist");
    return &model_.scenes[std::size_t(index)];
  }

  /// The scene's nodes, or without a scene all nodes that are not children.
  std::vector<int> roots() const {
    if (const tinygltf::Scene* chosen = chosen_scene()) return chosen->nodes;
    std::vector<bool> is_child(model_.nodes.size(), false);
    for (const tinygltf::Node& node : model_.nodes)
      for (int child : node.children)
        if (child >= 0 && std::size_t(child) < is_child.size()) is_child[std::size_t(child)] = true;
    std::vector<int> result;
    for (std::size_t i = 0; i < is_child.size(); ++i)
      if (!is_child[i]) result.push_back(int(i));
    return result;
  }

  /// Depth first with an explicit stack, since a file decides how deep the hierarchy is.
  void read_nodes() {
    std::vector<placed_node> stack;
    const auto push = [&](const std::vector<int>& nodes, const glm::dmat4& parent) {
      for (auto i = nodes.rbegin(); i != nodes.rend(); ++i) stack.push_back({*i, parent});
    };
    push(roots(), glm::dmat4(1.0));
    std::vector<bool> seen(model_.nodes.size(), false);
    while (!stack.empty()) {
      const placed_node next = stack.back();
      stack.pop_back();
      if (next.index < 0 || std::size_t(next.index) >= model_.nodes.size())
        throw std::runtime_error("node " + std::to_string(next.index) + " does not exist");
      if (seen[std::size_t(next.index)])
        throw std::runtime_error("node " + std::to_string(next.index) +
                                 " is reached twice: the hierarchy is no tree");
      seen[std::size_t(next.index)] = true;
      const tinygltf::Node& node = model_.nodes[std::size_t(next.index)];
      const glm::dmat4 to_world = next.parent_to_world * local_transform(node);
      read_node(node, to_world);
      push(node.children, to_world);
    }
  }

  void read_node(const tinygltf::Node& node, const glm::dmat4& to_world) {
    if (node.skin >= 0) warn("skinning is not supported");
    if (node.camera >= 0) read_camera(node.camera, to_world);
    const auto light = node.extensions.find("KHR_lights_punctual");
    if (light != node.extensions.end()) read_light(gltf::number_of(light->second, "light", -1.0), to_world);
    if (node.mesh < 0) return;
    if (std::size_t(node.mesh) >= model_.meshes.size())
      throw std::runtime_error("mesh " + std::to_string(node.mesh) + " does not exist");
    for (const tinygltf::Primitive& primitive : model_.meshes[std::size_t(node.mesh)].primitives) {
      if (!is_supported(primitive)) continue;
      const std::uint32_t material_index = material_of(primitive);
      surface_patch patch = read_patch(primitive);
      if (patch.indices.empty() && target_.materials[material_index].emission != vec3(0.0f))
        throw std::runtime_error("mesh " + std::to_string(node.mesh) + " emits light and has no triangles");
      add(std::move(patch), to_world, material_index);
    }
  }

  bool is_supported(const tinygltf::Primitive& primitive) {
    if (primitive.mode != TINYGLTF_MODE_TRIANGLES) {
      warn("points, lines, strips and fans are not supported: left out");
      return false;
    }
    bool sparse = gltf::is_sparse(model_, primitive.indices);
    for (const auto& attribute : primitive.attributes)
      sparse = sparse || gltf::is_sparse(model_, attribute.second);
    if (sparse) warn("sparse accessors are not supported: the mesh is left out");
    if (!primitive.targets.empty()) warn("morph targets are not supported");
    if (primitive.attributes.count("COLOR_0") > 0) warn("vertex colours are not supported");
    return !sparse;
  }

  std::uint32_t material_of(const tinygltf::Primitive& primitive) const {
    if (primitive.material < 0) return std::uint32_t(model_.materials.size());
    if (std::size_t(primitive.material) >= model_.materials.size())
      throw std::runtime_error("material " + std::to_string(primitive.material) + " does not exist");
    return std::uint32_t(primitive.material);
  }

  surface_patch read_patch(const tinygltf::Primitive& primitive) const {
    const auto attribute = [&](const char* name) {
      const auto found = primitive.attributes.find(name);
      return found == primitive.attributes.end() ? -1 : found->second;
    };
    surface_patch patch;
    if (attribute("POSITION") < 0) throw std::runtime_error("a mesh has no positions");
    patch.positions = gltf::read_vec3(model_, attribute("POSITION"));
    if (attribute("NORMAL") >= 0) patch.normals = gltf::read_vec3(model_, attribute("NORMAL"));
    if (attribute("TEXCOORD_0") >= 0) patch.uvs = gltf::read_vec2(model_, attribute("TEXCOORD_0"));
    if (primitive.indices >= 0) {
      patch.indices = gltf::read_indices(model_, primitive.indices);
    } else {
      patch.indices.resize(patch.positions.size());
      for (std::size_t i = 0; i < patch.indices.size(); ++i) patch.indices[i] = std::uint32_t(i);
    }
    check(patch);
    return patch;
  }

  static void check(const surface_patch& patch) {
    const std::size_t vertices = patch.positions.size();
    const bool same_lengths = (patch.normals.empty() || patch.normals.size() == vertices) &&
                              (patch.uvs.empty() || patch.uvs.size() == vertices);
    if (!same_lengths) throw std::runtime_error("a mesh's attributes differ in length");
    if (patch.indices.size() % 3 != 0)
      throw std::runtime_error("a mesh's corners do not make whole triangles");
    for (std::uint32_t index : patch.indices)
      if (index >= vertices)
        throw std::runtime_error("vertex index " + std::to_string(index) + " is out of range, there are " +
                                 std::to_string(vertices) + " vertices");
    for (const vec2& uv : patch.uvs)
      if (!std::isfinite(uv.x) || !std::isfinite(uv.y))
        throw std::runtime_error("a texture coordinate is not finite");
  }

  void add(surface_patch patch, const glm::dmat4& to_world, std::uint32_t material_index) {
    transform(patch, to_world);
    if (any_normals_) {
      if (patch.normals.empty()) split_vertices(patch);
      repair_normals(patch);
      target_.normals.insert(target_.normals.end(), patch.normals.begin(), patch.normals.end());
    }
    if (any_uvs_) {
      patch.uvs.resize(patch.positions.size(), vec2(0.0f));
      target_.uvs.insert(target_.uvs.end(), patch.uvs.begin(), patch.uvs.end());
    }
    const std::size_t first = target_.positions.size();
    if (first + patch.positions.size() > std::numeric_limits<std::uint32_t>::max())
      throw std::runtime_error("the scene has more than 2^32 vertices");
    const auto base = static_cast<std::uint32_t>(first);
    target_.positions.insert(target_.positions.end(), patch.positions.begin(), patch.positions.end());
    for (std::size_t t = 0; t + 2 < patch.indices.size(); t += 3)
      target_.triangles.push_back(base + uvec3(patch.indices[t], patch.indices[t + 1], patch.indices[t + 2]));
    target_.triangle_materials.resize(target_.triangles.size(), material_index);
  }

  void read_camera(int index, const glm::dmat4& to_world) {
    if (std::size_t(index) >= model_.cameras.size())
      throw std::runtime_error("camera " + std::to_string(index) + " does not exist");
    const tinygltf::Camera& source = model_.cameras[std::size_t(index)];
    if (source.type != "perspective") return warn("only perspective cameras are supported");
    if (has_camera_) return warn("the scene has several cameras: the first is used");
    const double fov = source.perspective.yfov;
    if (!(fov > 1e-6 && fov < 3.14159)) throw std::runtime_error("a camera's yfov is not in (1e-6, pi)");
    target_.view.position = vec3(to_world[3]);
    target_.view.forward = unit_or(-vec3(to_world[2]), vec3(0.0f));
    target_.view.up = unit_or(vec3(to_world[1]), vec3(0.0f));
    target_.view.vertical_fov = static_cast<float>(fov);
    if (!finite(target_.view.position) || glm::cross(target_.view.forward, target_.view.up) == vec3(0.0f))
      throw std::runtime_error("a camera's transform is degenerate");
    const double aspect = source.perspective.aspectRatio;
    if (aspect > 0.1 && aspect < 10.0) target_.width = int(std::lround(target_.height * aspect));
    has_camera_ = true;
  }

  void read_light(double index, const glm::dmat4& to_world) {
    if (!(index >= 0.0 && index < double(model_.lights.size())))
      throw std::runtime_error("light " + std::to_string(int(std::clamp(index, -1.0, 1e9))) +
                               " does not exist");
    const tinygltf::Light& source = model_.lights[std::size_t(index)];
    punctual_light light;
    if (source.type == "spot")
      light.kind = punctual_kind::spot;
    else if (source.type == "directional")
      light.kind = punctual_kind::directional;
    else if (source.type != "point")
      return warn("lights of type '" + source.type + "' are not supported");
    light.position = vec3(to_world[3]);
    light.direction = unit_or(-vec3(to_world[2]), vec3(0.0f));
    light.intensity = light_intensity(source, "light " + std::to_string(int(index)));
    light.cos_inner = float(std::cos(source.spot.innerConeAngle));
    light.cos_outer = float(std::cos(source.spot.outerConeAngle));
    if (!finite(light.position) || light.direction == vec3(0.0f))
      throw std::runtime_error("a light's transform is degenerate");
    if (light.kind == punctual_kind::spot && !(light.cos_inner > light.cos_outer))
      throw std::runtime_error("a spot's inner cone is not inside its outer one");
    if (source.range > 0.0) warn("the range of lights is not supported: they shine on everything");
    target_.punctual_lights.push_back(light);
  }

  static vec3 light_intensity(const tinygltf::Light& source, const std::string& name) {
    if (!source.color.empty() && source.color.size() != 3)
      throw std::runtime_error("a light's color has not 3 components");
    vec3 intensity(0.0f);
    for (int c = 0; c < 3; ++c) {
      const double channel = source.intensity * (source.color.empty() ? 1.0 : source.color[std::size_t(c)]);
      if (!(channel >= 0.0)) throw std::runtime_error(name + "'s intensity is negative or no number");
      if (channel > double(largest_radiance)) throw gltf::too_bright(name + " has an intensity", channel);
      intensity[c] = float(channel);
    }
    return intensity;
  }

  /// Makes a camera that looks along -z at the whole bounding box.
  void frame_everything() {
    glm::dvec3 lower(std::numeric_limits<double>::max()), upper(-lower);
    for (const vec3& p : target_.positions) {
      if (!finite(p)) continue;
      lower = glm::min(lower, glm::dvec3(p));
      upper = glm::max(upper, glm::dvec3(p));
    }
    if (upper.x < lower.x) return;
    const double radius = std::max(0.5 * glm::length(upper - lower), 1e-6);
    camera view;
    const double distance = radius / std::sin(0.5 * static_cast<double>(view.vertical_fov));
    view.position = vec3(0.5 * (lower + upper) + glm::dvec3(0.0, 0.0, distance));
    if (!finite(view.position)) throw std::runtime_error("the scene is too large for a camera to see it");
    target_.view = view;
    warn("the file has no perspective camera: one that sees the whole scene is made up");
  }

  void read_extras() {
    const tinygltf::Scene* chosen = chosen_scene();
    if (!chosen || !chosen->extras.IsObject()) return;
    if (chosen->extras.Has("resolution")) read_resolution(chosen->extras.Get("resolution"));
    if (chosen->extras.Has("fog")) target_.fog = gltf::read_medium(chosen->extras.Get("fog"), "extras.fog");
    if (!chosen->extras.Has("environment")) return;
    const tinygltf::Value& environment = chosen->extras.Get("environment");
    if (environment.IsObject() && environment.Has("radiance")) read_radiance(environment.Get("radiance"));
  }

  void read_resolution(const tinygltf::Value& value) {
    const auto side = [&](int i) {
      const bool usable = value.IsArray() && value.ArrayLen() == 2 && value.Get(i).IsNumber();
      return usable ? value.Get(i).GetNumberAsDouble() : 0.0;
    };
    const auto in_range = [](double pixels) { return pixels >= 1.0 && pixels <= max_picture_side; };
    if (!in_range(side(0)) || !in_range(side(1))) return warn("extras.resolution is unusable");
    target_.width = int(side(0));
    target_.height = int(side(1));
  }

  void read_radiance(const tinygltf::Value& value) {
    const char* const name = "extras.environment.radiance";
    vec3 radiance(0.0f);
    const bool is_colour = value.IsArray() && value.ArrayLen() == 3;
    for (int c = 0; c < 3; ++c) {
      const tinygltf::Value& channel = is_colour ? value.Get(c) : value;
      const double number = channel.IsNumber() ? channel.GetNumberAsDouble() : -1.0;
      if (!(number >= 0.0)) return warn(std::string(name) + " is unusable");
      if (number > double(largest_radiance)) throw gltf::too_bright(std::string("an ") + name, number);
      radiance[c] = float(number);
    }
    target_.environment = radiance;
  }

  const tinygltf::Model& model_;
  scene& target_;
  bool any_normals_ = false;
  bool any_uvs_ = false;
  bool has_camera_ = false;
};

std::string file_name(const std::string& path) {
  const std::string last = path.substr(path.find_last_of('/') + 1);
  return last.substr(0, last.find_last_of('.'));
}

}  // namespace

scene load_gltf(const std::string& path) try {
  scene result;
  result.name = file_name(path);
  const tinygltf::Model model = gltf::read_model(path, result.warnings);
  scene_reader(model, result).read();
  return result;
} catch (const std::exception& reason) {
  throw std::runtime_error(path + ": " + reason.what());
}

}  // namespace render
