// Vertices of light and camera paths on surfaces, as the renderer has them: what stages merge and connect.
#pragma once

#include "timing.hpp"
#include "tracer/bidirectional_state.hpp"

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>

#include <cmath>

namespace bench {

using wfpg::unit_vec2;
using wfpg::vec2;
using wfpg::vec3;

/// A direction above a surface, with density cos / pi.
WFPG_HD inline vec3 direction_above(vec3 normal, std::uint64_t random) {
  return glm::normalize(wfpg::frame(normal).to_world(render::cosine_hemisphere(unit_vec2(random))));
}

/// What vertices are made of.
struct vertex_maker {
  wfpg::path_techniques techniques;
  render::material_kind kind = render::material_kind::lambert;
  std::uint32_t before = 1;  ///< vertices of a path before the one that is made

  /// The vertex with index i of light paths, or of camera paths.
  WFPG_HD render::subpath_vertex operator()(bool is_camera, std::size_t i, vec3 position, vec3 normal) const {
    const std::uint64_t stream = wfpg::hash(is_camera ? 21 : 22, i);
    render::subpath_vertex v;
    v.at.position = position;
    v.at.offset = 1e-5f;
    v.at.geometric_normal = v.at.normal = normal;
    v.at.alpha = 0.2f;
    v.at.ior = 1.5f;
    v.at.outgoing = direction_above(normal, wfpg::hash(stream, 0));
    v.at.kind = kind;
    v.at.transmitted_colour = {};
    v.at.colour = vec3(0.6f, 0.4f, 0.3f);
    v.at.factors = {};
    v.throughput = vec3(0.5f, 0.6f, 0.7f);
    v.segments = before + 1;
    v.weights = weights(is_camera, stream);
    v.solids = {};
    v.material = 0;
    v.extinction = v.g = 0.0f;  // on a surface
    return v;
  }

 private:
  /// Weights of a path of diffuse vertices with random cosines.
  WFPG_HD wfpg::vertex_weights weights(bool is_camera, std::uint64_t stream) const {
    const auto cosine = [&](std::uint64_t use) {
      const vec2 u = unit_vec2(wfpg::hash(stream, use));
      return glm::max(std::sqrt(u.x), 0.01f);
    };
    const auto arrive = [&](const wfpg::subpath_weights& left, std::uint64_t use) {
      wfpg::path_arrival arrival;
      arrival.distance = 0.2f + cosine(use);
      arrival.cosine = cosine(use + 1);
      return left.arrive(arrival);
    };
    wfpg::light_end lamp;
    lamp.pdf_trace = lamp.pdf_connect = 10.0f;
    lamp.cosine = cosine(1);
    lamp.pdf_direction = lamp.cosine / wfpg::pi;
    wfpg::vertex_weights at = arrive(is_camera ? wfpg::subpath_weights::from_camera(1.0e6f)
                                               : wfpg::subpath_weights::from_light(techniques, lamp),
                                     2);
    for (std::uint32_t k = 0; k < before; ++k) {
      wfpg::path_departure to;
      to.cosine = cosine(4 + 4 * k);
      to.pdf = to.cosine / wfpg::pi;
      to.pdf_back = cosine(5 + 4 * k) / wfpg::pi;
      at = arrive(at.depart(techniques, to), 6 + 4 * k);
    }
    return at;
  }
};

}  // namespace bench
