// The scene for kernels: a trivially copyable view, the owner of its arrays on a policy, and the surface at a
// ray's hit.
#pragma once

#include "materials/materials.hpp"
#include "scene/environment.hpp"
#include "scene/texel_pair.hpp"

#include <wfpg/base/error.hpp>
#include <wfpg/base/math.hpp>
#include <wfpg/exec/buffer.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace render {

inline constexpr std::uint32_t no_triangle = 0xffffffffu;

/// A ray's first triangle, with barycentric weights u and v of its second and third corner.
struct triangle_hit {
  std::uint32_t triangle = no_triangle;
  float u = 0.0f;
  float v = 0.0f;

  WFPG_HD bool is_hit() const { return triangle != no_triangle; }
};

/// Texels of a texture inside scene_view::texels.
struct texture_span {
  std::uint32_t first, width, height;
  texture_wrap wrap_u, wrap_v;
};

/// A point on the scene's geometry, independent of the viewer.
struct surface_point {
  vec3 position{0.0f};
  vec3 geometric_normal{0.0f};  ///< unit length, counter-clockwise side
  vec3 normal{0.0f};            ///< shading normal, unit length, on the same side
  vec2 uv{0.0f};
  float offset = 0.0f;  ///< how far off the surface a ray must begin, scene units
  std::uint32_t material = 0;
};

/// The surface of a hit as paths need it: scattering, emission, and where rays may begin.
struct hit_surface {
  wfpg::surface<bsdf> surface;
  vec3 emission{0.0f};             ///< toward the viewer, W/(m² sr)
  float emitted_luminance = 0.0f;  ///< its mean over the texture; lights are chosen by it
  vec3 absorption{0.0f};           ///< along the ray that ends here, 1 / scene unit
  float offset = 0.0f;             ///< as in surface_point
  vec3 shading_normal{0.0f};       ///< as in surface_point, whoever looks
};

/// A point from which a ray toward `direction` does not hit the surface that it leaves.
WFPG_HD inline vec3 leave_surface(vec3 position, vec3 geometric_normal, vec3 direction, float offset) {
  return position + (glm::dot(geometric_normal, direction) < 0.0f ? -offset : offset) * geometric_normal;
}

/// Gives a BSDF its normals, as seen along `outgoing`. The parameters are those of a surface_point.
WFPG_HD inline void orient(bsdf& f, vec3 geometric_normal, vec3 normal, vec3 outgoing) {
  constexpr float least_cosine = 1e-2f;
  const float side = glm::dot(geometric_normal, outgoing) >= 0.0f ? 1.0f : -1.0f;
  // An interpolated normal that faces away from the viewer is bent until it just does not.
  vec3 facing = side * normal;
  const float seen = glm::dot(facing, outgoing);
  if (seen < least_cosine) facing = glm::normalize(facing + (least_cosine - seen) * outgoing);
  // A dielectric has an inside and an outside. The other kinds reflect on both sides.
  const float outward = f.transmits() ? side : 1.0f;
  f.normal = outward * facing;
  f.geometric_normal = outward * side * geometric_normal;
}

/// Boundaries whose index differs by less bend no light.
inline constexpr float least_index_step = 1e-4f;

/// Whether rays may enter what a material bounds: all that transmits and is no thin sheet.
WFPG_HD inline bool bounds_solid(const material& m) {
  if (m.kind == material_kind::metallic_roughness)
    return unorm8(m.metallic) < 1.0f && unorm8(m.transmission) > 0.0f;
  return m.kind == material_kind::dielectric || m.kind == material_kind::rough_dielectric;
}

/// Whether two materials bound the same solid. A ray that enters by one may then leave by the other.
WFPG_HD inline bool bound_same_solid(const material& a, const material& b) {
  return a.priority == b.priority && a.ior == b.ior && a.absorption == b.absorption &&
         a.scattering == b.scattering && a.g == b.g;
}

/// Whether light may pass boundaries of solids unbent: one has the index of air, or there are several solids,
/// which may overlap or touch.
inline bool may_pass_unbent(const std::vector<material>& materials) {
  const material* first = nullptr;
  for (const material& m : materials) {
    if (!bounds_solid(m)) continue;
    if (std::abs(m.ior - 1.0f) < least_index_step || (first && !bound_same_solid(*first, m))) return true;
    first = &m;
  }
  return false;
}

/// scene.hpp describes the arrays.
struct scene_view {
  wfpg::array_view<const vec3> positions, normals;
  wfpg::array_view<const vec2> uvs;
  wfpg::array_view<const uvec3> triangles;
  wfpg::array_view<const std::uint32_t> triangle_materials;
  wfpg::array_view<const material> materials;
  wfpg::array_view<const float> emitted_luminances;  ///< by material; means over its texture
  wfpg::array_view<const texture_span> textures;
  wfpg::array_view<const vec4> texels;
  environment_view environment;
  medium fog;
  bool has_solids = false;  ///< whether any of them bounds one
  /// Whether light may pass boundaries of solids unbent: one has the index of air, or there are several.
  bool has_unbent = false;

  WFPG_HD const material& material_of(std::uint32_t triangle) const {
    return materials[triangle_materials[triangle]];
  }

  WFPG_HD surface_point point(const triangle_hit& hit) const {
    // Copies would go to the stack.
    const uvec3& corners = triangles[hit.triangle];
    const vec3 &a = positions[corners.x], &b = positions[corners.y], &c = positions[corners.z];
    const float w = 1.0f - hit.u - hit.v;
    surface_point point;
    point.material = triangle_materials[hit.triangle];
    point.position = w * a + hit.u * b + hit.v * c;
    // Rounding errors are relative to the corners' coordinates, not to the point's own.
    point.offset = 1e-5f * glm::max(largest_of(a), glm::max(largest_of(b), largest_of(c)));
    point.geometric_normal = glm::normalize(glm::cross(b - a, c - a));
    point.normal = point.geometric_normal;
    if (!normals.empty()) {
      const vec3 n = w * normals[corners.x] + hit.u * normals[corners.y] + hit.v * normals[corners.z];
      const float length = glm::length(n);
      if (length > 1e-6f) point.normal = n / length;
      if (glm::dot(point.normal, point.geometric_normal) < 0.0f) point.normal = -point.normal;
    }
    point.uv = uv_at(hit);
    return point;
  }

  /// Texture coordinates, or 0 if there are none.
  WFPG_HD vec2 uv_at(const triangle_hit& hit) const {
    if (uvs.empty()) return vec2(0.0f);
    const uvec3& corners = triangles[hit.triangle];
    return (1.0f - hit.u - hit.v) * uvs[corners.x] + hit.u * uvs[corners.y] + hit.v * uvs[corners.z];
  }

  /// The texture's value at `uv`, v down. Precondition: there is one.
  WFPG_HD vec4 texel(const texture_reference& reference, vec2 uv) const {
    const texture_span span = textures[static_cast<std::uint32_t>(reference.index)];
    const vec2 place = reference.transformed(uv);
    const texel_pair column(place.x, span.width, span.wrap_u), row(place.y, span.height, span.wrap_v);
    const float fx = column.second_weight, fy = row.second_weight;
    const auto along = [&](std::uint32_t r) {
      const std::size_t first = span.first + std::size_t(r) * span.width;
      return (1.0f - fx) * texels[first + column.first] + fx * texels[first + column.second];
    };
    return (1.0f - fy) * along(row.first) + fy * along(row.second);
  }

  /// Radiance of a material's front, W/(m² sr).
  WFPG_HD vec3 emitted(const material& m, vec2 uv) const {
    return m.emission_texture.index >= 0 ? m.emission * vec3(texel(m.emission_texture, uv)) : m.emission;
  }

  /// Whether the material of a triangle has a hole at the hit.
  WFPG_HD bool is_cut_out(const triangle_hit& hit) const {
    const material& m = material_of(hit.triangle);
    if (!(m.alpha_cutoff > 0.0f)) return false;
    const float alpha = m.base_texture.index >= 0 ? texel(m.base_texture, uv_at(hit)).w : 1.0f;
    return m.opacity * alpha < m.alpha_cutoff;
  }

  /// The surface at `hit` seen along `outgoing` (unit length, away from the surface). Its BSDF has a value
  /// only where paths go on.
  WFPG_HD hit_surface surface(const triangle_hit& hit, vec3 outgoing, bool goes_on = true) const {
    const surface_point at = point(hit);
    const material& scatters = materials[at.material];
    const bool front = glm::dot(at.geometric_normal, outgoing) >= 0.0f;

    hit_surface result;
    result.offset = at.offset;
    result.shading_normal = at.normal;
    if (!front) {
      result.absorption = scatters.absorption;
    } else if (scatters.emission != vec3(0.0f)) {
      result.emission = emitted(scatters, at.uv);
      result.emitted_luminance = emitted_luminances[at.material];
    }
    result.surface.position = at.position;
    result.surface.outgoing = outgoing;
    result.surface.geometric_normal = at.geometric_normal;
    if (!goes_on) return result;
    bsdf& f = result.surface.bsdf;
    f.kind = scatters.kind;
    set_lobes(scatters, at.uv, f);
    orient(f, at.geometric_normal, at.normal, outgoing);
    f.colour = scatters.base_color;
    if (scatters.base_texture.index >= 0) f.colour *= vec3(texel(scatters.base_texture, at.uv));
    f.ior = scatters.ior;
    result.surface.geometric_normal = f.geometric_normal;
    result.surface.normal = f.normal;
    return result;
  }

 private:
  WFPG_HD void set_lobes(const material& scatters, vec2 uv, bsdf& f) const {
    const texture_reference& varied = scatters.metallic_roughness_texture;
    const vec4 factors = varied.index >= 0 ? texel(varied, uv) : vec4(1.0f);
    f.alpha = glm::max(least_alpha, scatters.alpha * factors.y * factors.y);
    if (f.kind < first_kind_of_all_lobes) return;
    f.factors.metallic = unorm8(scatters.metallic * factors.z);
    f.factors.specular = unorm8(scatters.specular);
    f.factors.transmission = unorm8(scatters.transmission);
    f.factors.diffuse_transmission = unorm8(scatters.diffuse_transmission);
    f.transmitted_colour = unorm8x3(scatters.transmitted_color);
  }

  // glm::abs() branches on a CPU.
  WFPG_HD static float largest_of(vec3 v) {
    return glm::max(std::abs(v.x), glm::max(std::abs(v.y), std::abs(v.z)));
  }

  static constexpr float least_alpha = 1e-3f;
};

/// The box around a scene's triangles.
inline wfpg::bounds3 bounds_of(const scene& host) {
  wfpg::bounds3 box;
  for (const uvec3& triangle : host.triangles)
    for (int corner = 0; corner < 3; ++corner) {
      const vec3 p = host.positions[triangle[corner]];
      box = wfpg::bounds_union()(box, {p, p});
    }
  return box;
}

/// Whether any material of a scene has holes.
inline bool has_cut_outs(const scene& host) {
  return std::any_of(host.materials.begin(), host.materials.end(),
                     [](const material& m) { return m.alpha_cutoff > 0.0f; });
}

/// The luminance that each material of a scene emits, averaged over its texture.
inline std::vector<float> emitted_luminances(const scene& host) {
  std::vector<float> luminances;
  for (const material& m : host.materials) {
    vec3 mean(1.0f);
    if (m.emission != vec3(0.0f) && m.emission_texture.index >= 0) {
      glm::dvec3 sum(0.0);
      const std::vector<vec4>& texels = host.textures[std::size_t(m.emission_texture.index)].texels;
      for (const vec4& texel : texels) sum += glm::dvec3(texel);
      mean = vec3(sum / static_cast<double>(texels.size()));
    }
    luminances.push_back(wfpg::luminance(m.emission * mean));
  }
  return luminances;
}

/// The arrays of a scene in a policy's memory.
template <class Exec>
class device_scene {
 public:
  /// Throws std::invalid_argument if an index of the scene is out of range, or a light is not usable.
  device_scene(const Exec& exec, const scene& host)
      : positions_(exec, host.positions),
        normals_(exec, host.normals),
        uvs_(exec, host.uvs),
        triangles_(exec, host.triangles),
        triangle_materials_(exec, host.triangle_materials),
        materials_(exec, host.materials),
        environment_(host.environment),
        fog_(host.fog),
        has_solids_(std::any_of(host.materials.begin(), host.materials.end(), bounds_solid)),
        has_unbent_(may_pass_unbent(host.materials)) {
    check(host);
    emitted_luminances_ = wfpg::buffer<float, Exec>(exec, emitted_luminances(host));
    if (!host.sky.texels.empty()) upload_sky(exec, host.sky);
    upload_textures(exec, host.textures);
  }

  scene_view view() const {
    scene_view v;
    v.positions = positions_.view();
    v.normals = normals_.view();
    v.uvs = uvs_.view();
    v.triangles = triangles_.view();
    v.triangle_materials = triangle_materials_.view();
    v.materials = materials_.view();
    v.emitted_luminances = emitted_luminances_.view();
    v.textures = textures_.view();
    v.texels = texels_.view();
    v.environment = environment_;
    v.fog = fog_;
    v.has_solids = has_solids_;
    v.has_unbent = has_unbent_;
    return v;
  }

 private:
  // Textures are copied one by one, since all of them together may be large.
  void upload_textures(const Exec& exec, const std::vector<texture>& textures) {
    std::vector<texture_span> spans;
    std::size_t count = 0;
    for (const texture& t : textures) {
      spans.push_back({static_cast<std::uint32_t>(count), static_cast<std::uint32_t>(t.width),
                       static_cast<std::uint32_t>(t.height), t.wrap_u, t.wrap_v});
      count += t.texels.size();
    }
    wfpg::require(count <= 0xffffffffu, "the number of all texels", count, "less than 2^32");
    textures_ = wfpg::buffer<texture_span, Exec>(exec, spans);
    texels_ = wfpg::buffer<vec4, Exec>(exec, count);
    for (std::size_t i = 0; i < textures.size(); ++i)
      exec.copy_from_host(texels_.data() + spans[i].first, textures[i].texels.data(),
                          textures[i].texels.size() * sizeof(vec4));
  }

  void upload_sky(const Exec& exec, const environment_map& sky) {
    const std::vector<double> powers = texel_powers(sky);
    const auto total = static_cast<float>(std::accumulate(powers.begin(), powers.end(), 0.0));
    sky_texels_ = wfpg::buffer<vec3, Exec>(exec, sky.texels);
    if (total > 0.0f) sky_table_ = wfpg::buffer<alias_column, Exec>(exec, make_alias_table(powers));
    environment_ = {sky, sky_texels_.view(), sky_table_.view(), total};
  }

  static void check_lights(const scene& host) {
    const auto check = [](vec3 light, const std::string& name) {
      for (const float channel : {light.x, light.y, light.z})
        wfpg::require(is_usable_light(vec3(channel)), name.c_str(), channel, "in [0, 1e+15]");
    };
    const auto check_each = [&](const auto& elements, const std::string& name, const auto& light_of) {
      for (std::size_t i = 0; i < elements.size(); ++i)  // without making a string for each
        if (!is_usable_light(light_of(elements[i]))) check(light_of(elements[i]), name + std::to_string(i));
    };
    check(host.environment, "scene.environment");
    check_each(host.sky.texels, "scene.sky, texel ", [](vec3 texel) { return texel; });
    check_each(host.materials, "the emission of scene.materials, element ",
               [](const material& m) { return m.emission; });
    check_each(host.punctual_lights, "the intensity of scene.punctual_lights, element ",
               [](const punctual_light& light) { return light.intensity; });
  }

  static void check_medium(const medium& inside, const std::string& owner) {
    for (int c = 0; c < 3; ++c)
      for (const float coefficient : {inside.absorption[c], inside.scattering[c]})
        wfpg::require(coefficient >= 0.0f && coefficient <= largest_coefficient,
                      ("a coefficient of " + owner).c_str(), coefficient, "in [0, 1e+06]");
    wfpg::require(std::abs(inside.g) <= largest_mean_cosine, ("g of " + owner).c_str(), inside.g,
                  "in [-0.999, 0.999]");
  }

  static void check(const scene& host) {
    check_lights(host);
    check_medium(host.fog, "scene.fog");
    for (std::size_t i = 0; i < host.materials.size(); ++i)
      check_medium(interior_of(host.materials[i]), "scene.materials, element " + std::to_string(i));
    wfpg::require(host.sky.texels.size() == std::size_t(host.sky.width) * std::size_t(host.sky.height),
                  "scene.sky.texels.size()", host.sky.texels.size(), "width times height");
    using wfpg::require;
    const std::size_t vertices = host.positions.size();
    require(host.normals.empty() || host.normals.size() == vertices, "scene.normals.size()",
            host.normals.size(), "0 or the number of positions");
    require(host.uvs.empty() || host.uvs.size() == vertices, "scene.uvs.size()", host.uvs.size(),
            "0 or the number of positions");
    require(host.triangle_materials.size() == host.triangles.size(), "scene.triangle_materials.size()",
            host.triangle_materials.size(), "the number of triangles");
    for (const uvec3& t : host.triangles)
      require(t.x < vertices && t.y < vertices && t.z < vertices, "a corner of scene.triangles",
              glm::max(t.x, glm::max(t.y, t.z)), "below the number of positions");
    for (const std::uint32_t m : host.triangle_materials)
      require(m < host.materials.size(), "an element of scene.triangle_materials", m,
              "below the number of materials");
    for (const texture& t : host.textures)
      require(t.width > 0 && t.height > 0 && t.texels.size() == std::size_t(t.width) * std::size_t(t.height),
              "texture.texels.size()", t.texels.size(), "positive, and width times height");
    const auto textures = static_cast<std::int32_t>(host.textures.size());
    for (const material& m : host.materials)
      for (const texture_reference& reference :
           {m.base_texture, m.metallic_roughness_texture, m.emission_texture})
        require(reference.index < textures, "texture_reference.index", reference.index,
                "below the number of textures");
  }

  wfpg::buffer<vec3, Exec> positions_, normals_;
  wfpg::buffer<vec2, Exec> uvs_;
  wfpg::buffer<uvec3, Exec> triangles_;
  wfpg::buffer<std::uint32_t, Exec> triangle_materials_;
  wfpg::buffer<material, Exec> materials_;
  wfpg::buffer<float, Exec> emitted_luminances_;
  wfpg::buffer<texture_span, Exec> textures_;
  wfpg::buffer<vec4, Exec> texels_;
  wfpg::buffer<vec3, Exec> sky_texels_;
  wfpg::buffer<alias_column, Exec> sky_table_;
  environment_view environment_;
  medium fog_;
  bool has_solids_;
  bool has_unbent_;
};

}  // namespace render
