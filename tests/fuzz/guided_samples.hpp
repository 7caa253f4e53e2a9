// Shared by the fuzzers of guiding: a few samples with any guider, and the checks of them.
#pragma once

#include "require.hpp"
#include "support/either_guide.hpp"

#include <wfpg/exec/seq.hpp>
#include <wfpg/host/ray_caster.hpp>
#include <wfpg/octree/svo_ray_caster.hpp>
#include <wfpg/path_guider.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

namespace wfpg_fuzz {

using policy = wfpg::exec::seq;
using wfpg::vec2;
using wfpg::vec3;

constexpr std::uint32_t rays = 12;

/// A white Lambertian surface.
struct lambert {
  vec3 normal{0.0f, 0.0f, 1.0f};

  float eval(vec3, vec3 incident) const { return pdf({}, incident); }
  float pdf(vec3, vec3 incident) const { return std::fmax(glm::dot(incident, normal), 0.0f) * 0.31830989f; }
  wfpg::bsdf_sample sample(vec3 outgoing, vec2 u) const {
    const float r = std::sqrt(u.x), phi = 6.2831853f * u.y;
    const vec3 local(r * std::cos(phi), r * std::sin(phi), std::sqrt(1.0f - u.x));
    const vec3 d = wfpg::frame(normal).to_world(local);
    return {d, pdf(outgoing, d)};
  }
  bool is_delta() const { return false; }
  bool transmits() const { return false; }
};

/// Points in the octree's leaves that face along all axes. Precondition: there are leaves.
struct leaf_surfaces {
  wfpg::sparse_voxel_octree_view tree;

  wfpg::surface<lambert> operator()(std::uint32_t ray) const {
    vec3 normal(0.0f);
    normal[static_cast<int>(ray % 3)] = ray % 2 == 0 ? 1.0f : -1.0f;
    const wfpg::node_id leaf = tree.first_leaf() + ray * (tree.leaf_count() - 1) / rays;
    return {tree.centre(leaf), normal, normal, normal, lambert{normal}, true};
  }
};

struct random_numbers {
  vec2 operator()(std::uint32_t ray, std::uint32_t dimension) const {
    return wfpg::unit_vec2(wfpg::hash(ray, dimension));
  }
};

inline void ask_lights(const wfpg::light_guide_view& lights, const wfpg::surface<lambert>& surface,
                       std::uint32_t ray) {
  if (lights.empty()) return;
  const wfpg::light_choice choice =
      lights.choose(lights.find(surface.position, surface.normal), random_numbers()(ray, 9).x);
  require(choice.group < lights.groups() && choice.probability > 0.0f && choice.probability <= 1.0f,
          "groups of lights have a probability");
  lights.deposit(ray, choice.key, static_cast<float>(ray % 4));
}

/// Two samples of one vertex at each of `rays` surfaces. Checks the sampled directions.
template <class Guider, class Surfaces>
void guide(Guider& guider, const Surfaces& surfaces) {
  const wfpg::sparse_voxel_octree_view tree = guider.guide().octree().view();
  std::vector<wfpg::sampled_direction> drawn(rays);
  for (int sample = 0; sample < 2; ++sample) {
    guider.begin_sample();
    for (std::uint32_t ray = 0; ray < rays; ++ray)
      guider.recorder().vertex(ray, 0, surfaces(ray).position, surfaces(ray).outgoing, vec3(1.0f));
    guider.sample_directions(wfpg::wave{0, rays, surfaces, random_numbers{}},
                             wfpg::svo_ray_caster(tree, 1.0f), {drawn.data(), drawn.size()});
    for (std::uint32_t ray = 0; ray < rays; ++ray) {
      const wfpg::sampled_direction& d = drawn[ray];
      require(d.pdf >= 0.0f && wfpg::is_finite(d.pdf) && wfpg::is_finite(d.direction),
              "directions and densities are finite");
      guider.recorder().scatter(ray, 0, d);
      guider.recorder().escape(ray, 1, vec3(1.0f));
      guider.recorder().emission(ray, 1, vec3(1.0f));
      ask_lights(guider.lights(), surfaces(ray), ray);
    }
    guider.end_sample();
  }
}

}  // namespace wfpg_fuzz
