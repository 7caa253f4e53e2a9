// A scene as loaders and built-in scenes describe it: triangles, materials, a camera, an environment. Host
// data only. device_scene.hpp makes the kernels' data from it.
#pragma once

#include <wfpg/base/types.hpp>

#include <glm/vec4.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace render {

using glm::vec4;
using wfpg::uvec3;
using wfpg::vec2;
using wfpg::vec3;

/// How a texture continues beyond its edges.
enum class texture_wrap : std::uint8_t { repeat, mirrored_repeat, clamp_to_edge };

/// Linear RGB texels and alpha, row by row from the top. Looked up bilinearly.
struct texture {
  int width = 0;
  int height = 0;
  std::vector<vec4> texels;
  texture_wrap wrap_u = texture_wrap::repeat;
  texture_wrap wrap_v = texture_wrap::repeat;
};

/// A texture of a material, and the map from the surface to it.
struct texture_reference {
  std::int32_t index = -1;  ///< into scene::textures; -1: none, white
  vec2 u_axis{1.0f, 0.0f};  ///< uv.x u_axis + uv.y v_axis + offset
  vec2 v_axis{0.0f, 1.0f};
  vec2 offset{0.0f};

  WFPG_HD vec2 transformed(vec2 uv) const { return uv.x * u_axis + uv.y * v_axis + offset; }
};

enum class material_kind : std::uint8_t {
  lambert,                  ///< diffuse reflection
  plastic,                  ///< diffuse below a GGX dielectric coat
  conductor,                ///< GGX with Schlick's Fresnel from base_color
  mirror,                   ///< perfect reflection times base_color
  dielectric,               ///< smooth; reflects, and refracts times base_color
  rough_dielectric,         ///< dielectric with GGX facets
  thin_dielectric,          ///< smooth; reflects, and lets base_color through unbent
  smooth_plastic,           ///< diffuse below a smooth dielectric coat
  metallic_roughness,       ///< all lobes of metallic_roughness.hpp, around a solid
  thin_metallic_roughness,  ///< all lobes of metallic_roughness.hpp, on a sheet
};
/// Whether all its directions have a probability, not a density. That of smooth_plastic is diffuse too.
WFPG_HD constexpr bool is_smooth(material_kind kind) {
  return kind == material_kind::mirror || kind == material_kind::dielectric ||
         kind == material_kind::thin_dielectric;
}
/// Kinds from this one on use all numbers of a material.
inline constexpr material_kind first_kind_of_all_lobes = material_kind::metallic_roughness;
/// Bits of a material's kind as a key. All kinds are below 2^bits - 1.
inline constexpr int material_key_bits = 4;

/// How a surface scatters and emits.
struct material {
  material_kind kind = material_kind::lambert;
  vec3 base_color{0.8f};                         ///< reflectance, per channel in [0, 1]
  texture_reference base_texture;                ///< multiplies base_color and opacity
  texture_reference metallic_roughness_texture;  ///< green multiplies the root of alpha, blue metallic
  float opacity = 1.0f;                          ///< in [0, 1]
  float alpha_cutoff = 0.0f;                     ///< smaller opacity makes a hole
  float alpha = 0.1f;                            ///< GGX roughness (not perceptual), (0, 1]
  float ior = 1.5f;       ///< inside over outside, for plastics and dielectrics; not 1 if rough
  float metallic = 0.0f;  ///< this and the next four: for kinds with all lobes, see lobe_factors
  float specular = 1.0f;
  float transmission = 0.0f;
  float diffuse_transmission = 0.0f;   ///< positive only for thin kinds
  vec3 transmitted_color{1.0f};        ///< of diffuse transmission
  vec3 emission{0.0f};                 ///< emitted radiance, W/(m² sr), on the counter-clockwise side
  texture_reference emission_texture;  ///< multiplies emission
  vec3 absorption{0.0f};               ///< inside of transmitting solids, 1 / scene unit
  vec3 scattering{0.0f};               ///< likewise
  float g = 0.0f;                      ///< mean cosine of that scattering, in (-1, 1)
  std::int32_t priority = 0;           ///< where solids overlap, the one with the largest is there
};

/// A homogeneous medium with the phase function of Henyey and Greenstein. Coefficients are per scene unit.
struct medium {
  vec3 absorption{0.0f};
  vec3 scattering{0.0f};
  float g = 0.0f;  ///< mean cosine of scattering, in (-1, 1)

  WFPG_HD vec3 extinction() const { return absorption + scattering; }
};

/// The medium inside of solids that a material bounds.
WFPG_HD inline medium interior_of(const material& m) {
  return {m.absorption, m.scattering, m.g};
}

/// The largest coefficient of a medium, 1 / scene unit. Products with distances and densities stay finite.
inline constexpr float largest_coefficient = 1e6f;
/// The largest |g|. Beyond it, floats do not resolve the lobe.
inline constexpr float largest_mean_cosine = 0.999f;

/// The largest radiance, intensity or irradiance of a light, each channel, in the units of its field below.
/// Sums of light are floats, whose largest is 3.4e38. 1e15 leaves a factor of 3e23 for a path's other
/// factors. These are area and solid angle of lights, inverse densities, inverse squared distances, and
/// roulette. The sun's disc has 2e7 W/(m² sr).
inline constexpr float largest_radiance = 1e15f;
/// The largest sum over all lights of radiance times area, W/sr. Such a sum, and its product with a BSDF,
/// stay finite.
inline constexpr double largest_light_power = 1e30;

/// Whether each channel is in [0, largest_radiance]. False if one is NaN.
inline bool is_usable_light(vec3 light) {
  const auto usable = [](float channel) { return channel >= 0.0f && channel <= largest_radiance; };
  return usable(light.x) && usable(light.y) && usable(light.z);
}

/// Radiance from all directions, W/(m² sr), row by row from the top. environment.hpp defines the directions.
struct environment_map {
  int width = 0;
  int height = 0;
  std::vector<vec3> texels;
};

enum class punctual_kind : std::uint8_t { point, spot, directional };

/// A light without extent, as in KHR_lights_punctual. Only next-event estimation finds it.
struct punctual_light {
  punctual_kind kind = punctual_kind::point;
  vec3 position{0.0f};                ///< of points and spots
  vec3 direction{0.0f, 0.0f, -1.0f};  ///< in which spots and directional lights emit, unit length
  vec3 intensity{1.0f};               ///< W/sr; of directional lights irradiance, W/m²
  float cos_inner = 1.0f;             ///< of a spot's half angle of full brightness
  float cos_outer = 0.0f;             ///< of the half angle where it ends; less than cos_inner
};

/// A pinhole camera. The picture's y runs down from `up`.
struct camera {
  vec3 position{0.0f};
  vec3 forward{0.0f, 0.0f, -1.0f};  ///< unit length
  vec3 up{0.0f, 1.0f, 0.0f};        ///< unit length, need not be orthogonal to forward
  float vertical_fov = 0.8f;        ///< radians, (0, pi)
};

struct scene {
  std::string name;
  std::vector<vec3> positions;  ///< world space
  std::vector<vec3> normals;    ///< shading normals per vertex; same length as positions, or empty
  std::vector<vec2> uvs;        ///< same length as positions, or empty
  std::vector<uvec3> triangles;
  std::vector<std::uint32_t> triangle_materials;  ///< per triangle; index into materials
  std::vector<material> materials;
  std::vector<texture> textures;
  std::vector<punctual_light> punctual_lights;
  camera view;
  medium fog;                         ///< around all solids, and without end
  vec3 environment{0.0f};             ///< constant radiance, W/(m² sr)
  environment_map sky;                ///< replaces the constant radiance if it has texels
  int width = 512, height = 512;      ///< intended size of the picture, pixels
  int max_depth = 8;                  ///< intended number of path segments
  std::vector<std::string> warnings;  ///< features of the file that the loader does not support, once each
};

/// Whether a scene is for methods that trace paths through media: it has fog, or solids that scatter inside.
inline bool needs_volume_tracing(const scene& host) {
  bool scatters = host.fog.extinction() != vec3(0.0f);
  for (const material& m : host.materials) scatters = scatters || m.scattering != vec3(0.0f);
  return scatters;
}

}  // namespace render
