// The surfaces that rays find in a scene: textures, holes, and normals on the viewer's side.
#include "casters/bvh_scene.hpp"
#include "casters/embree_caster.hpp"
#include "scene/device_scene.hpp"
#include "scene/texel_pair.hpp"
#include "support/catch.hpp"
#include "support/pictures.hpp"
#include "support/policies.hpp"

#include <cmath>
#include <utility>

namespace {

using namespace render;
using namespace render_test;
using wfpg_test::one_policy;

}  // namespace

TEST_CASE("textures are bilinear and repeat", "[renderer]") {
  scene s = square_of({});
  s.uvs = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  s.textures.push_back({2, 2, {vec4(1, 0, 0, 1), vec4(0, 1, 0, 1), vec4(0, 0, 1, 1), vec4(1)}});
  const one_policy exec;
  const device_scene<one_policy> geometry(exec, s);
  const scene_view view = geometry.view();
  texture_reference whole;
  whole.index = 0;
  const auto at = [&](const texture_reference& t, vec2 uv) { return vec3(view.texel(t, uv)); };
  CHECK(at(whole, {0.25f, 0.25f}) == vec3(1, 0, 0));
  CHECK(at(whole, {0.75f, 0.25f}) == vec3(0, 1, 0));
  CHECK(at(whole, {0.25f, 0.75f}) == vec3(0, 0, 1));
  CHECK(at(whole, {-0.25f, 3.75f}) == vec3(1, 1, 1));
  CHECK(glm::length(at(whole, {0.5f, 0.5f}) - vec3(0.5f)) < 1e-6f);
  CHECK(glm::length(at(whole, {0.0f, 0.25f}) - vec3(0.5f, 0.5f, 0.0f)) < 1e-6f);
  texture_reference turned = whole;
  turned.u_axis = {0.0f, 2.0f};
  turned.v_axis = {1.0f, 0.0f};
  turned.offset = {0.5f, 0.0f};
  CHECK(at(turned, {0.125f, 0.25f}) == vec3(0, 1, 0));
}

TEST_CASE("textures are clamped or mirrored beyond their edges", "[renderer]") {
  const auto texels_of = [](float coordinate, texture_wrap wrap) {
    const texel_pair pair(coordinate, 3, wrap);
    CHECK((pair.second_weight >= 0.0f && pair.second_weight <= 1.0f));
    return std::make_pair(pair.first, pair.second);
  };
  using found = std::pair<std::uint32_t, std::uint32_t>;
  CHECK(texels_of(0.0f, texture_wrap::repeat) == found(2, 0));
  CHECK(texels_of(0.99f, texture_wrap::repeat) == found(2, 0));
  CHECK(texels_of(-0.7f, texture_wrap::repeat) == found(0, 1));
  CHECK(texels_of(0.01f, texture_wrap::clamp_to_edge) == found(0, 0));
  CHECK(texels_of(7.0f, texture_wrap::clamp_to_edge) == found(2, 2));
  CHECK(texels_of(-1e30f, texture_wrap::clamp_to_edge) == found(0, 0));
  CHECK(texels_of(0.99f, texture_wrap::mirrored_repeat) == found(2, 2));
  CHECK(texels_of(1.3f, texture_wrap::mirrored_repeat) == found(2, 1));
  CHECK(texels_of(-0.3f, texture_wrap::mirrored_repeat) == found(1, 0));
  CHECK(texels_of(2.0f, texture_wrap::mirrored_repeat) == found(0, 0));
  for (const texture_wrap wrap :
       {texture_wrap::repeat, texture_wrap::mirrored_repeat, texture_wrap::clamp_to_edge})
    for (const float far : {std::nanf(""), INFINITY, -INFINITY, 3e38f, -3e38f, 1e10f, -1e10f}) {
      INFO(far);
      CHECK(texels_of(far, wrap).first < 3);
      CHECK(texels_of(far, wrap).second < 3);
    }
}

TEST_CASE("rays pass through the holes of an alpha mask", "[renderer]") {
  // Three squares in a row: one with a hole in its left half, one opaque, one whose holes are hidden.
  scene s;
  for (const float z : {0.0f, -1.0f, -2.0f}) {
    const auto first = static_cast<std::uint32_t>(s.positions.size());
    for (const vec2 corner : {vec2(-1, -1), vec2(1, -1), vec2(1, 1), vec2(-1, 1)}) {
      s.positions.emplace_back(corner.x, corner.y, z);
      s.uvs.push_back(0.5f * corner + vec2(0.5f));
    }
    for (const uvec3 t : {uvec3(0, 1, 2), uvec3(0, 2, 3)}) s.triangles.push_back(first + t);
  }
  s.triangle_materials = {0, 0, 1, 1, 0, 0};
  s.materials.resize(2);
  s.textures.push_back({2, 1, {vec4(1, 1, 1, 0), vec4(1)}, texture_wrap::clamp_to_edge});
  s.materials[0].base_texture.index = 0;
  s.materials[0].alpha_cutoff = 0.5f;
  const one_policy exec;
  const device_scene<one_policy> geometry(exec, s);
  const embree_scene embree(exec, s, geometry.view());
  const bvh_scene<one_policy> bvh(exec, s, geometry.view());
  const auto check = [](const auto& caster) {
    for (int i = 0; i < 200; ++i) {
      const float x = -0.99f + 0.00995f * static_cast<float>(i);
      if (std::abs(x) < 0.02f) continue;
      wfpg::ray ray;
      ray.origin = {x, 0.3f, 1.0f};
      ray.direction = {0.0f, 0.0f, -1.0f};
      const bool hole = x < 0.0f;
      CHECK(caster.intersect(ray).triangle / 2 == (hole ? 1 : 0));
      CHECK(caster(ray).distance == Approx(hole ? 2.0 : 1.0));
      ray.t_max = 1.5f;
      CHECK(caster.occluded(ray) == !hole);
      ray.origin.z = -1.5f;
      CHECK(caster.occluded(ray) == !hole);
    }
  };
  check(embree.caster());
  check(bvh.caster());
}

TEST_CASE("a shading normal never hides a surface from its viewer", "[renderer]") {
  scene s = square_of({});
  s.normals.assign(4, glm::normalize(vec3(1.0f, 0.0f, 0.2f)));
  const one_policy exec;
  const device_scene<one_policy> geometry(exec, s);
  for (const float side : {1.0f, -1.0f}) {
    const vec3 outgoing = glm::normalize(vec3(-1.0f, 0.0f, side * 0.1f));
    const hit_surface hit = geometry.view().surface({0, 0.2f, 0.2f}, outgoing);
    CHECK(glm::dot(hit.surface.normal, outgoing) > 0.0f);
    CHECK(glm::dot(hit.surface.normal, hit.surface.geometric_normal) > 0.0f);
    CHECK(hit.surface.bsdf.sample(outgoing, {0.01f, 0.5f}).pdf > 0.0f);
  }
}
