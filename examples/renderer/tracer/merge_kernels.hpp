// Merges of camera paths with photons: what light paths' vertices and beams bring to a camera path's vertices
// and segments. Source: Krivanek et al. 2014, "Unifying Points, Beams, and Paths in Volumetric Light
// Transport Simulation".
#pragma once

#include "tracer/bidirectional_state.hpp"
#include "tracer/found_light.hpp"

#include <wfpg/light/light_gather.hpp>

namespace render {

/// What merges read of a light path's vertex. Kernels load it in three pieces.
struct alignas(16) photon {
  static constexpr int segment_bits = 11;
  static constexpr std::uint32_t most_segments = (1u << segment_bits) - 1;
  static constexpr std::uint32_t most_solids = solid_stack::none >> segment_bits;

  vec3 incident;  ///< where it came from, unit length
  vec3 flux;      ///< of all photons that it counts for; in a medium with scattering
  wfpg::vertex_weights weights;
  std::uint32_t packed;  ///< segments(), and above these bits solid()

  photon() = default;
  WFPG_HD photon(const subpath_vertex& vertex, float count)
      : incident(vertex.at.outgoing),
        flux(vertex.throughput * count),
        weights(vertex.weights),
        packed(vertex.segments | vertex.material << segment_bits) {}

  /// Of its path.
  WFPG_HD std::uint32_t segments() const { return packed & most_segments; }
  /// Whose medium it is in.
  WFPG_HD std::uint32_t solid() const {
    const std::uint32_t number = packed >> segment_bits;
    return number == most_solids ? solid_stack::none : number;
  }
};

static_assert(sizeof(photon) == 48);

/// The light paths of a sample, as kernels of camera paths find them.
using photon_gather = wfpg::light_gather_view<subpath_vertex, photon, light_beam>;

/// Whether two numbers of solids mean one medium.
WFPG_HD inline bool have_one_medium(const scene_view& scene, std::uint32_t a, std::uint32_t b) {
  if (a == b) return true;
  return a != solid_stack::none && b != solid_stack::none &&
         bound_same_solid(scene.materials[a], scene.materials[b]);
}

/// Merges a camera path's vertex with the photons around it.
template <class World>
struct merge_at_vertex {
  const World& world;
  const photon_gather& photons;
  std::size_t pixel;
  const subpath_vertex& vertex;
  const scatterer& f;

  WFPG_HD technique_sum on_surface() const {
    technique_sum found;
    photons.merge_on_surface(vertex.at.position, [&](const photon& light, const wfpg::photon_merge& at) {
      world.observer.reach(pixel, {technique::surf, vertex.segments, at});
      if (light.segments() + vertex.segments > world.max_depth) return;
      // The photon's flux is that of a surface with the geometric normal.
      add(found, light, wfpg::merge_technique::surface_points,
          f.eval_rgb(vertex.at.outgoing, light.incident) * light.flux *
              (at.scale / vertex.cosine(light.incident)));
    });
    return found;
  }

  WFPG_HD technique_sum in_medium() const {
    const vec3 scattering = vertex.solids.medium_of(world.scene).scattering;
    technique_sum found;
    photons.merge_in_medium(vertex.at.position, [&](const photon& light, const wfpg::photon_merge& at) {
      world.observer.reach(pixel, {technique::pp3d, vertex.segments, at});
      if (light.segments() + vertex.segments > world.max_depth ||
          !have_one_medium(world.scene, light.solid(), vertex.material))
        return;
      // Both paths have scattered here.
      const vec3 flux = light.flux / glm::max(scattering, vec3(1e-30f));
      add(found, light, wfpg::merge_technique::volume_points,
          flux * (f.phase.eval(vertex.at.outgoing, light.incident) * at.scale));
    });
    return found;
  }

 private:
  WFPG_HD void add(technique_sum& found, const photon& light, wfpg::merge_technique by, vec3 value) const {
    if (!(wfpg::luminance(value) > 0.0f)) return;
    const float weight =
        light.weights.merge(world.techniques, by, vertex.weights, vertex.leave(f, light.incident));
    found.add(value, weight);
    world.observer.merge(pixel, vertex.throughput * value, weight);
  }
};

/// Merges a piece of a camera path's segment with the photons and the photon beams along it. The piece is
/// long: it goes on where the path scatters.
template <class World>
class merge_along_piece {
 public:
  WFPG_HD merge_along_piece(const World& world, const photon_gather& photons, std::size_t pixel,
                            const subpath& path, std::uint32_t segments, const path_segment& before,
                            const medium_piece& piece)
      : world_(world),
        photons_(photons),
        pixel_(pixel),
        path_(path),
        segments_(segments),
        before_(before),
        piece_(piece),
        medium_(coefficients_of(piece.around)),
        solid_(before.solids.top(world.scene)),
        along_{path.origin, path.direction, piece.begin, piece.limit} {
    // Weights are floats, and what is left beyond is nothing.
    const vec3 sigma = piece.around.extinction();
    const float least = glm::min(sigma.x, glm::min(sigma.y, sigma.z));
    if (least > 0.0f) along_.end = glm::min(along_.end, piece.begin + 25.0f / least);
  }

  /// What is merged: as far as light is left.
  WFPG_HD const wfpg::path_beam& along() const { return along_; }

  WFPG_HD technique_sum with_points() const {
    technique_sum found;
    photons_.merge_points_along(along_, [&](const photon& light, const wfpg::photon_merge& at) {
      world_.observer.reach(pixel_, {technique::pb2d, segments_, at});
      if (!may_merge(light.segments(), light.solid())) return;
      const vec3 value = arriving(at.t_camera) * light.flux * (phase(light.incident) * at.scale);
      add(found, light.weights, wfpg::merge_technique::beam_points, at.t_camera, light.incident, value);
    });
    return found;
  }

  WFPG_HD technique_sum with_beams() const {
    technique_sum found;
    photons_.merge_beams_along(along_, [&](const light_beam& light, const wfpg::photon_merge& at) {
      world_.observer.reach(pixel_, {technique::bb1d, segments_, at});
      if (!may_merge(light.segments, light.solid)) return;
      const float length = at.t_light - light.beam.begin;
      // Short beams: a light path gets as far with this probability.
      const vec3 flux = light.throughput * medium_.transmittance(length) / medium_.pdf(length, false);
      const vec3 back = -light.beam.direction;
      const vec3 value = arriving(at.t_camera) * piece_.around.scattering * flux * (phase(back) * at.scale);
      way_densities pdf = light.before;
      pdf.add(piece_.around, length, light.begins_inside != 0, true);
      wfpg::path_arrival arrival;
      arrival.distance = at.t_light;
      arrival.pdf_distance = pdf.there;
      arrival.pdf_distance_back = pdf.back;
      add(found, light.weights.arrive(arrival), wfpg::merge_technique::beams, at.t_camera, back, value);
    });
    return found;
  }

 private:
  WFPG_HD bool may_merge(std::uint32_t light_segments, std::uint32_t light_solid) const {
    return light_segments + segments_ <= world_.max_depth &&
           have_one_medium(world_.scene, light_solid, solid_);
  }
  /// Of the camera path, with what is left of light up to a distance.
  WFPG_HD vec3 arriving(float distance) const {
    return before_.throughput * medium_.transmittance(distance - piece_.begin);
  }
  WFPG_HD float phase(vec3 incident) const {
    return wfpg::henyey_greenstein{piece_.around.g}.eval(-path_.direction, incident);
  }

  WFPG_HD void add(technique_sum& found, const wfpg::vertex_weights& light, wfpg::merge_technique by,
                   float distance, vec3 incident, vec3 value) const {
    if (!(wfpg::luminance(value) > 0.0f)) return;
    path_segment s = before_;
    s.distance = distance;
    s.pdf.add(piece_.around, distance - piece_.begin, piece_.begins_inside, true);
    // The vertex where the camera path would scatter.
    const subpath_vertex vertex(path_.origin + distance * path_.direction, -path_.direction, piece_.around,
                                solid_, s, segments_, World::weights_at(path_, s, 1.0f));
    const scatterer f = vertex.seen_from(incident);
    const float weight = light.merge(world_.techniques, by, vertex.weights, vertex.leave(f, incident));
    found.add(value, weight);
    world_.observer.merge(pixel_, value, weight);
  }

  const World& world_;
  const photon_gather& photons_;
  std::size_t pixel_;
  const subpath& path_;
  std::uint32_t segments_;
  const path_segment& before_;
  const medium_piece& piece_;
  wfpg::homogeneous_medium medium_;
  std::uint32_t solid_;
  wfpg::path_beam along_;
};

}  // namespace render
