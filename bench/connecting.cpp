// Connecting vertices of light and camera paths, as the renderer does: BSDFs and cosines at both ends, a ray
// between them, and the weight. The scene is small triangles that fill the unit cube. Ends face each other,
// so that every pair casts its ray. A warp's camera vertices are near each other, as those of neighbouring
// pixels. The floor is a constant for the weight, so that the ratio is what weights take, with the densities
// that they need.
#include "casters/bvh_scene.hpp"
#include "path_vertices.hpp"
#include "triangles.hpp"

#include <vector>

namespace bench {
namespace {

struct make_pairs {
  vertex_maker make;
  render::tiled_view<render::subpath_vertex> cameras;
  render::subpath_vertex* lights;

  WFPG_HD void operator()(std::size_t i) const {
    const vec3 position = 0.2f + 0.6f * random_point(11, i / 32) + 0.01f * random_point(12, i);
    const vec3 toward = random_direction(13, i);
    const float distance = 0.01f + 0.18f * unit_vec2(hash(14, i)).x;
    cameras.emplace(i, make(true, i, position, direction_above(toward, hash(15, i))));
    lights[i] = make(false, i, position + distance * toward, direction_above(-toward, hash(16, i)));
  }
};

/// How much of a weight is computed.
enum class weighting {
  none,       ///< it is a constant
  densities,  ///< what it is made of: densities and cosines of both ends, both ways
  whole,
};

template <weighting Weighting>
struct connect_pairs {
  wfpg::path_techniques techniques;
  render::bvh_caster caster;
  render::tiled_view<render::subpath_vertex> cameras;
  wfpg::array_view<const render::subpath_vertex> lights;
  wfpg::array_view<vec3> radiance;
  std::uint32_t max_depth;  ///< most segments of a whole path

  WFPG_HD void operator()(std::size_t i) const {
    const render::subpath_vertex camera = cameras[i];
    const render::scatterer f = camera.seen_from(camera.at.outgoing);
    const render::subpath_vertex& light = lights[i];
    radiance[i] = light.segments + camera.segments < max_depth ? camera.throughput * connect(camera, f, light)
                                                               : vec3(0.0f);
  }

 private:
  WFPG_HD vec3 connect(const render::subpath_vertex& camera, const render::scatterer& f,
                       const render::subpath_vertex& light) const {
    const vec3 way = light.at.position - camera.at.position;
    const float distance = glm::length(way);
    if (!(distance > 0.0f)) return vec3(0.0f);
    const vec3 toward = way / distance;
    const vec3 value = f.eval_rgb(camera.at.outgoing, toward) * light.scattered_flux(-toward) *
                       light.throughput / (distance * distance);
    if (!(wfpg::luminance(value) > 0.0f)) return vec3(0.0f);
    const vec3 end = light.leave_along(-way);
    const wfpg::ray ray = render::ray_between(camera.leave_along(end - camera.at.position), end);
    if (ray.t_max > 0.0f && caster.occluded(ray)) return vec3(0.0f);
    return value * weight(camera, f, light, toward, distance);
  }

  WFPG_HD float weight(const render::subpath_vertex& camera, const render::scatterer& f,
                       const render::subpath_vertex& light, vec3 toward, float distance) const {
    if constexpr (Weighting == weighting::none) {
      return 0.5f;
    } else {
      const wfpg::path_departure to_camera = light.leave(light.seen_from(light.at.outgoing), -toward);
      const wfpg::path_departure to_light = camera.leave(f, toward);
      if constexpr (Weighting == weighting::densities) {
        return to_camera.pdf + to_camera.pdf_back + to_camera.cosine + to_light.pdf + to_light.pdf_back +
               to_light.cosine;
      } else {
        wfpg::path_edge edge;
        edge.distance = distance;
        return light.weights.connection(techniques, to_camera, camera.weights, to_light, edge);
      }
    }
  }
};

/// The pairs, and the scene between them.
template <class Exec>
class connections {
 public:
  connections(const Exec& exec, const vertex_maker& make)
      : exec_(exec),
        techniques_(make.techniques),
        mesh_(exec, sizes::connection_thousands),
        hierarchy_(exec, mesh_.view(), 0.0f),
        cameras_(exec, sizes::connections),
        lights_(exec, sizes::connections),
        radiance_(exec, sizes::connections) {
    exec_.for_each(sizes::connections, make_pairs{make, cameras_.view(), lights_.data()});
  }

  template <weighting Weighting>
  void connect() const {
    exec_.for_each(sizes::connections,
                   connect_pairs<Weighting>{techniques_, hierarchy_.caster(), cameras_.view(),
                                            wfpg::array_view<const render::subpath_vertex>(lights_.view()),
                                            radiance_.view(), max_depth});
  }

  /// The fraction of pairs that see each other, of the last connect().
  double visible_fraction() const {
    std::size_t visible = 0;
    for (const vec3& found : radiance_.to_host(exec_)) visible += found != vec3(0.0f) ? 1u : 0u;
    return static_cast<double>(visible) / static_cast<double>(radiance_.size());
  }

 private:
  static constexpr std::uint32_t max_depth = 1000;  // no pair is too long

  Exec exec_;
  wfpg::path_techniques techniques_;
  triangles_of<Exec> mesh_;
  render::bvh_scene<Exec> hierarchy_;
  render::tiled_array<render::subpath_vertex, Exec> cameras_;
  wfpg::buffer<render::subpath_vertex, Exec> lights_;
  wfpg::buffer<vec3, Exec> radiance_;
};

template <class Exec>
void connecting(benchmark::State& state) {
  const Exec exec;
  vertex_maker make;
  make.techniques.splats = static_cast<float>(sizes::connections);
  make.kind = state.range(0) != 0 ? render::material_kind::plastic : render::material_kind::lambert;
  make.before = static_cast<std::uint32_t>(state.range(1));
  const connections<Exec> pairs(exec, make);

  const auto whole = [&] { pairs.template connect<weighting::whole>(); };
  const auto with_densities = [&] { pairs.template connect<weighting::densities>(); };
  const auto without = [&] { pairs.template connect<weighting::none>(); };
  std::vector<double> densities;
  compare(state, exec, whole, without, [&] { densities.push_back(seconds_of(exec, with_densities)); });
  whole();
  const double of_densities = median(densities);
  state.counters["densities_ratio"] = 1.0e3 * of_densities / state.counters["floor_ms"];
  state.counters["formula_ratio"] = 1.0e-3 * state.counters["median_ms"] / of_densities;
  state.counters["pairs_that_see"] = pairs.visible_fraction();
}

WFPG_BENCH_STAGE(connecting, {"coated", "vertices_before"}, sizes::connecting);

}  // namespace
}  // namespace bench
