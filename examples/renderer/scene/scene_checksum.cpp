// Hashes every number of a scene, member by member, since structures have padding.
#include "scene/scene_checksum.hpp"

#include <wfpg/state/section_file.hpp>

#include <string>
#include <type_traits>
#include <vector>

namespace render {
namespace {

class scene_hash {
 public:
  std::uint64_t value() const { return hash_; }

  template <class... Values>
  void add_all(const Values&... values) {
    (add(values), ...);
  }

 private:
  template <class T, class = std::enable_if_t<std::is_arithmetic_v<T>>>
  void add(T number) {
    std::string bytes;
    wfpg::put_number(bytes, number);
    hash_ = wfpg::checksum(bytes, hash_);
  }
  void add(texture_wrap wrap) { add(static_cast<std::uint8_t>(wrap)); }
  void add(material_kind kind) { add(static_cast<std::uint8_t>(kind)); }
  void add(punctual_kind kind) { add(static_cast<std::uint8_t>(kind)); }
  template <int n, class T, glm::qualifier q>
  void add(const glm::vec<n, T, q>& v) {
    for (int i = 0; i < n; ++i) add(v[i]);
  }
  template <class T>
  void add(const std::vector<T>& values) {
    add(std::uint64_t(values.size()));
    for (const T& value : values) add(value);
  }

  // Bindings name every member, so a new member does not compile until it is added.
  void add(const texture_reference& t) {
    const auto& [index, u_axis, v_axis, offset] = t;
    add_all(index, u_axis, v_axis, offset);
  }
  void add(const texture& t) {
    const auto& [width, height, texels, wrap_u, wrap_v] = t;
    add_all(width, height, texels, wrap_u, wrap_v);
  }
  void add(const environment_map& m) {
    const auto& [width, height, texels] = m;
    add_all(width, height, texels);
  }
  void add(const punctual_light& l) {
    const auto& [kind, position, direction, intensity, cos_inner, cos_outer] = l;
    add_all(kind, position, direction, intensity, cos_inner, cos_outer);
  }
  void add(const camera& c) {
    const auto& [position, forward, up, vertical_fov] = c;
    add_all(position, forward, up, vertical_fov);
  }
  void add(const material& m) {
    const auto& [kind, base_color, base_texture, metallic_roughness_texture, opacity, alpha_cutoff, alpha,
                 ior, metallic, specular, transmission, diffuse_transmission, transmitted_color, emission,
                 emission_texture, absorption, scattering, g, priority] = m;
    add_all(kind, base_color, base_texture, metallic_roughness_texture, opacity, alpha_cutoff, alpha, ior,
            metallic, specular, transmission, diffuse_transmission, transmitted_color, emission,
            emission_texture, absorption);
    // Only where they are not the default: checksums of scenes without them stay as they were.
    if (scattering != vec3(0.0f) || priority != 0) add_all(scattering, g, priority);
  }
  void add(const medium& m) {
    const auto& [absorption, scattering, g] = m;
    if (m.extinction() != vec3(0.0f)) add_all(absorption, scattering, g);
  }

  std::uint64_t hash_ = wfpg::checksum({});
};

scene_hash hash_without_camera(const scene& s) {
  scene_hash hash;
  hash.add_all(s.positions, s.normals, s.uvs, s.triangles, s.triangle_materials, s.materials, s.textures,
               s.punctual_lights, s.environment, s.sky, s.fog);
  return hash;
}

}  // namespace

std::uint64_t checksum_of(const scene& s) {
  scene_hash hash = hash_without_camera(s);
  hash.add_all(s.view);
  return hash.value();
}

std::uint64_t checksum_without_camera(const scene& s) {
  return hash_without_camera(s).value();
}

}  // namespace render
