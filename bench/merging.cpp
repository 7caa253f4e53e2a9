// Merging vertices of camera paths with the photons around them, as the renderer does: each photon that is
// found is read, the BSDF evaluated and the weight computed. The floor casts as many rays from the same
// points, in random directions, among as many triangles. A triangle lies at each photon, and all of them have
// the area of the faces.
#include "casters/bvh_scene.hpp"
#include "path_vertices.hpp"
#include "photons.hpp"
#include "tracer/merge_kernels.hpp"

#include <wfpg/light/photon_map.hpp>

namespace bench {
namespace {

using wfpg::uvec3;

/// A vertex at each point.
struct place_vertices {
  vertex_maker make;
  wfpg::array_view<const vec3> points;
  bool is_camera;
  render::subpath_vertex* vertices;                       ///< of light paths
  render::tiled_view<render::subpath_vertex> of_cameras;  ///< or of camera paths, as the renderer stores them

  WFPG_HD void operator()(std::size_t i) const {
    const auto count = static_cast<std::uint32_t>(points.size());
    const render::subpath_vertex made = make(is_camera, i, points[i], normal_of(face_of(i, count)));
    if (is_camera)
      of_cameras.emplace(i, made);
    else
      vertices[i] = made;
  }
};

/// Copies vertices of light paths into the order of the map's places.
struct order_photons {
  wfpg::photon_map_view map;
  wfpg::array_view<const render::subpath_vertex> vertices;
  render::photon* photons;

  WFPG_HD void operator()(std::size_t place) const {
    const auto k = static_cast<std::uint32_t>(place);
    photons[place] = render::photon(vertices[map.index(k)], map.weight(k));
  }
};

struct merge_all {
  [[maybe_unused]] static constexpr bool waits_for_memory = true;

  wfpg::path_techniques techniques;
  render::tiled_view<render::subpath_vertex> cameras;
  wfpg::photon_map_view map;
  wfpg::array_view<const render::photon> photons;  ///< in the order of places
  wfpg::array_view<vec3> radiance;
  std::uint32_t max_depth;  ///< most segments of a whole path

  WFPG_HD void operator()(std::size_t i) const {
    const render::subpath_vertex camera = cameras[i];
    const render::scatterer f = camera.seen_from(camera.at.outgoing);
    vec3 found(0.0f);
    map.for_each_place(camera.at.position, [&](std::uint32_t place) {
      const render::photon light = photons[place];
      if (light.segments() + camera.segments <= max_depth) found += merge(camera, f, light);
    });
    radiance[i] = camera.throughput * found / techniques.surface_points;
  }

 private:
  WFPG_HD vec3 merge(const render::subpath_vertex& camera, const render::scatterer& f,
                     const render::photon& light) const {
    const vec3 incident = light.incident;
    const vec3 value = f.eval_rgb(camera.at.outgoing, incident) * light.flux / camera.cosine(incident);
    if (!(wfpg::luminance(value) > 0.0f)) return vec3(0.0f);
    return value * light.weights.merge(techniques, wfpg::merge_technique::surface_points, camera.weights,
                                       camera.leave(f, incident));
  }
};

/// An equilateral triangle at each photon, in its face.
struct place_triangles {
  wfpg::array_view<const vec3> photons;
  float edge;
  vec3* positions;
  uvec3* triangles;

  WFPG_HD void operator()(std::size_t i) const {
    const auto n = static_cast<std::uint32_t>(i);
    const int axis = face_of(i, static_cast<std::uint32_t>(photons.size())) / 2;
    const float angle = 2.0f * wfpg::pi * unit_vec2(hash(7, i)).x;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const float turn = angle + 2.0f * wfpg::pi / 3.0f * static_cast<float>(k);
      vec3 out(0.0f);
      out[(axis + 1) % 3] = std::cos(turn);
      out[(axis + 2) % 3] = std::sin(turn);
      positions[3 * n + k] = photons[i] + 0.57735f * edge * out;
    }
    triangles[i] = {3 * n, 3 * n + 1, 3 * n + 2};
  }
};

/// A ray from each point into the cube.
struct leave_points {
  wfpg::array_view<const vec3> points;
  float offset;
  wfpg::ray* rays;

  WFPG_HD void operator()(std::size_t i) const {
    const vec3 normal = normal_of(face_of(i, static_cast<std::uint32_t>(points.size())));
    rays[i] = render::ray_along(points[i] + offset * normal, direction_above(normal, hash(8, i)));
  }
};

struct cast_rays {
  render::bvh_caster caster;
  wfpg::array_view<const wfpg::ray> rays;
  wfpg::array_view<render::triangle_hit> hits;
  WFPG_HD void operator()(std::size_t i) const { hits[i] = caster.intersect(rays[i]); }
};

/// The floor: the rays, their hits, and the hierarchy over the triangles.
template <class Exec>
class rays_among_photons {
 public:
  rays_among_photons(const Exec& exec, wfpg::array_view<const vec3> photons,
                     wfpg::array_view<const vec3> points, float radius)
      : exec_(exec),
        positions_(exec, 3 * photons.size()),
        triangles_(exec, photons.size()),
        rays_(exec, points.size()),
        hits_(exec, points.size()),
        hierarchy_(exec, mesh(photons, radius), 0.0f) {
    exec_.for_each(points.size(), leave_points{points, 1e-3f * radius, rays_.data()});
  }

  void operator()() const {
    exec_.for_each(rays_.size(), cast_rays{hierarchy_.caster(),
                                           wfpg::array_view<const wfpg::ray>(rays_.view()), hits_.view()});
  }

  double hit_fraction() const {
    std::size_t hits = 0;
    for (const render::triangle_hit& hit : hits_.to_host(exec_)) hits += hit.is_hit() ? 1u : 0u;
    return static_cast<double>(hits) / static_cast<double>(hits_.size());
  }

 private:
  /// A disc of the radius has the area of ten triangles.
  wfpg::triangle_mesh_view mesh(wfpg::array_view<const vec3> photons, float radius) const {
    const float edge = radius * std::sqrt(0.4f * wfpg::pi / 1.7320508f);
    exec_.for_each(photons.size(), place_triangles{photons, edge, positions_.data(), triangles_.data()});
    return {positions_.view(), triangles_.view()};
  }

  Exec exec_;
  wfpg::buffer<vec3, Exec> positions_;
  wfpg::buffer<uvec3, Exec> triangles_;
  wfpg::buffer<wfpg::ray, Exec> rays_;
  wfpg::buffer<render::triangle_hit, Exec> hits_;
  render::bvh_scene<Exec> hierarchy_;
};

template <class Exec>
void merging(benchmark::State& state) {
  const Exec exec;
  const auto n = static_cast<std::uint32_t>(1000 * state.range(0));
  const bool clustered = state.range(1) != 0;
  const float radius = radius_for_ten(n, clustered);
  const auto photons = points_on(exec, n, 1, clustered, false),
             points = points_on(exec, n, 2, clustered, true);
  const wfpg::array_view<const vec3> photon_points(photons.view()), camera_points(points.view());
  wfpg::photon_map<Exec> map;
  map.build(exec, photon_points, radius);

  wfpg::path_techniques techniques;
  techniques.splats = static_cast<float>(n);
  techniques.surface_points = static_cast<float>(n) * wfpg::pi * radius * radius;
  vertex_maker make;
  make.techniques = techniques;
  const wfpg::buffer<render::subpath_vertex, Exec> vertices(exec, n);
  const render::tiled_array<render::subpath_vertex, Exec> cameras(exec, n);
  exec.for_each(n, place_vertices{make, photon_points, false, vertices.data(), {}});
  exec.for_each(n, place_vertices{make, camera_points, true, nullptr, cameras.view()});

  const wfpg::buffer<render::photon, Exec> ordered(exec, n);
  exec.for_each(n, order_photons{map.view(), wfpg::array_view<const render::subpath_vertex>(vertices.view()),
                                 ordered.data()});
  const wfpg::buffer<vec3, Exec> radiance(exec, n);
  const rays_among_photons<Exec> floor(exec, photon_points, camera_points, radius);
  const merge_all kernel{techniques,      cameras.view(),
                         map.view(),      wfpg::array_view<const render::photon>(ordered.view()),
                         radiance.view(), 8};
  compare(
      state, exec, [&] { exec.for_each(n, kernel); }, floor);

  const wfpg::buffer<std::uint32_t, Exec> found(exec, n);
  exec.for_each(n, count_photons{map.view(), camera_points, found.data()});
  state.counters["pairs_a_point"] = static_cast<double>(sum_of(exec, found)) / n;
  state.counters["rays_that_hit"] = floor.hit_fraction();
}

WFPG_BENCH_STAGE(merging, {"thousands", "clustered"}, sizes::photons);

}  // namespace
}  // namespace bench
