// A guider in the unit box with a bright patch in its ceiling, and a path tracer of two bounces.
#pragma once

#include "support/either_guide.hpp"
#include "support/evaluate.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/path_guider.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace wfpg_test {

/// The message of a std::invalid_argument that a call throws. Empty if it throws none.
inline std::string refusal(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

/// The ceiling's patch, 0.7 <= x, z <= 0.9 at y = 1, and its radiance.
constexpr float patch_low = 0.7f, patch_high = 0.9f, patch_radiance = 10.0f;

WFPG_HD inline float emitted(vec3 p) {
  const bool inside = p.x >= patch_low && p.x <= patch_high && p.z >= patch_low && p.z <= patch_high;
  return inside && p.y > 0.999f ? patch_radiance : 0.0f;
}

/// The patch's irradiance on the floor, facing up, by the midpoint rule in doubles.
inline double floor_irradiance(vec3 p) {
  constexpr int n = 400;
  const double side = double(patch_high) - double(patch_low), step = side / n;
  double sum = 0.0;
  for (int i = 0; i < n * n; ++i) {
    const double x = double(patch_low) + (i % n + 0.5) * step - double(p.x);
    const double z = double(patch_low) + (i / n + 0.5) * step - double(p.z);
    const double square = x * x + z * z + 1.0;
    sum += 1.0 / (square * square);
  }
  return double(patch_radiance) * sum * step * step;
}

constexpr field_lifetime lifetimes[] = {field_lifetime::kept, field_lifetime::transient};

inline const char* name_of(field_lifetime lifetime) {
  return lifetime == field_lifetime::kept ? "kept fields" : "transient fields";
}

inline guider_options box_options(wfpg::guiding_mode mode = wfpg::guiding_mode::oriented,
                                  field_lifetime lifetime = field_lifetime::kept) {
  guider_options options;
  options.mode = mode;
  options.fields = lifetime;
  options.kept.resolution = 16;
  options.kept.budget_bytes = std::size_t(4) << 20;
  options.octree_resolution = 32;
  options.binning.min_level = 2;
  options.binning.rays_per_bin = 32;
  options.field_resolution = 16;
  options.min_field_resolution = 8;
  options.unguided_samples = 0;
  options.max_rays = 1024;
  options.deposit_capacity = 6 * 40 * 40;
  return options;
}

/// Surfaces in a policy's memory, as a wave.
template <class Exec>
class wave_of_surfaces {
 public:
  wave_of_surfaces(const Exec& exec, const std::vector<test_surface>& surfaces, std::uint32_t depth = 0,
                   std::uint64_t seed = 1)
      : surfaces_(exec, surfaces), depth_(depth), seed_(seed) {}

  auto get() const {
    return wfpg::wave{depth_, surfaces_.size(), stored_surfaces{const_view<test_surface>(surfaces_)},
                      hashed_numbers{seed_}};
  }

 private:
  wfpg::buffer<test_surface, Exec> surfaces_;
  std::uint32_t depth_;
  std::uint64_t seed_;
};

/// Whether a ray has a field, and how many of the first `rays` have one.
template <class Exec>
bool guides(const Exec& exec, const wfpg::guide_view& view, std::uint32_t ray) {
  return evaluate(exec, [=] WFPG_HD() { return view.guides(ray); });
}
template <class Exec>
std::size_t count_guided(const Exec& exec, const wfpg::guide_view& view, std::size_t rays) {
  return count_where(exec, rays,
                     [=] WFPG_HD(std::size_t ray) { return view.guides(static_cast<std::uint32_t>(ray)); });
}

/// Densities of directions by the BSDFs of their rays.
struct density_of_bsdf {
  wfpg::array_view<const test_surface> surfaces;
  wfpg::array_view<const wfpg::sampled_direction> drawn;
  WFPG_HD float operator()(std::size_t i) const {
    return surfaces[i].bsdf.pdf(surfaces[i].outgoing, drawn[i].direction);
  }
};
template <class Exec>
std::vector<float> bsdf_densities(const Exec& exec, const std::vector<test_surface>& surfaces,
                                  const std::vector<wfpg::sampled_direction>& drawn) {
  const wfpg::buffer<test_surface, Exec> s(exec, surfaces);
  const wfpg::buffer<wfpg::sampled_direction, Exec> d(exec, drawn);
  return evaluate(exec, drawn.size(), density_of_bsdf{s.view(), d.view()});
}

/// A guider of the box that has learnt the patch.
template <class Exec>
struct guided_box {
  Exec exec;
  octree_guider<Exec> guider;

  explicit guided_box(const guider_options& options = box_options(),
                      wfpg::memory_resource* resource = nullptr)
      : exec(Exec().with_resource(resource)), guider(exec, box_mesh<Exec>(exec).view(), options) {}
  explicit guided_box(field_lifetime lifetime)
      : guided_box(box_options(wfpg::guiding_mode::oriented, lifetime)) {}

  /// Deposits the patch on 40² points a wall, and begins the next sample.
  void learn() {
    deposit_on_walls(exec, guider.guide().cache(), 40,
                     [](std::uint32_t face, float u, float v) { return emitted(face_point(face, u, v)); });
    guider.end_sample();
    guider.begin_sample();
  }

  template <class Caster = box_caster>
  std::vector<wfpg::sampled_direction> sample(const std::vector<test_surface>& surfaces,
                                              const Caster& caster = {}, std::uint64_t seed = 1,
                                              std::uint32_t depth = 0) {
    const wave_of_surfaces<Exec> wave(exec, surfaces, depth, seed);
    const wfpg::buffer<wfpg::sampled_direction, Exec> directions(exec, surfaces.size());
    guider.sample_directions(wave.get(), caster, directions.view());
    return directions.to_host(exec);
  }
  /// Samples a wave again that has come before. By now its rays have kept fields.
  template <class Caster = box_caster>
  std::vector<wfpg::sampled_direction> sample_again(const std::vector<test_surface>& surfaces,
                                                    const Caster& caster = {}) {
    for (int wave = 0; wave < 3; ++wave) sample(surfaces, caster);
    return sample(surfaces, caster);
  }
};

inline bool same_bits(const wfpg::sampled_direction& a, const wfpg::sampled_direction& b) {
  return std::memcmp(&a.direction, &b.direction, sizeof a.direction) == 0 &&
         wfpg::float_bits(a.pdf) == wfpg::float_bits(b.pdf) && a.technique == b.technique;
}

inline bool same_bits(const std::vector<wfpg::sampled_direction>& a,
                      const std::vector<wfpg::sampled_direction>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const auto& x, const auto& y) { return same_bits(x, y); });
}

/// Whether two ways of sampling give the same directions: bit for bit on a host, nearly on a GPU. There each
/// kernel rounds in its own way. A cone on a voxel's border then reads another voxel, so a few may differ.
inline bool same_draws(const std::vector<wfpg::sampled_direction>& a,
                       const std::vector<wfpg::sampled_direction>& b) {
  if (same_operations_same_bits) return same_bits(a, b);
  std::size_t closely = 0;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i)
    closely += a[i].technique == b[i].technique && glm::distance(a[i].direction, b[i].direction) < 1.0e-3f &&
               std::fabs(a[i].pdf - b[i].pdf) <= 1.0e-3f * a[i].pdf;
  return a.size() == b.size() && 100 * closely >= 99 * a.size();
}

/// Rays of every kind: Lambert, glossy, glass, mirror and black surfaces. Inactive ones have invalid values.
inline std::vector<test_surface> mixed_surfaces(std::size_t n, std::uint64_t seed) {
  auto surfaces = wall_surfaces(n, seed);
  for (std::size_t i = 0; i < n; ++i) {
    surfaces[i].bsdf.kind = static_cast<bsdf_kind>(i % 8 < 5 ? i % 8 : 0);
    if (i % 8 != 7) continue;
    surfaces[i].active = false;
    surfaces[i].position = vec3(std::nanf(""));
  }
  return surfaces;
}

/// The state of one path between depths.
struct path_step {
  test_surface surface;
  float throughput = 1.0f;
  float radiance = 0.0f;
};

/// The normal of the wall nearest to a point.
WFPG_HD inline vec3 inward_normal(vec3 p) {
  std::uint32_t nearest = 0;
  float least = 2.0f;
  for (std::uint32_t face = 0; face < 6; ++face) {
    const float away = std::abs(p[int(face / 2)] - (face % 2 ? 1.0f : 0.0f));
    if (away >= least) continue;
    least = away;
    nearest = face;
  }
  return face_normal(nearest);
}

/// The box with its patch. All paths continue.
struct patch_box {
  static constexpr float survival = 1.0f;
  WFPG_HD float operator()(vec3 p) const { return emitted(p); }
};

/// A ray's fraction of guided directions on smooth surfaces, as fields store it; 0 where it has no field.
struct fraction_of_ray {
  wfpg::guide_view view;
  WFPG_HD float operator()(std::size_t ray) const {
    return view.fields().info(view.number(static_cast<std::uint32_t>(ray))).fraction();
  }
};

/// Follows a sampled direction to the wall that it hits, and records a vertex there. `World` gives the
/// emission at a point, and the fraction of paths that continue.
template <class World>
struct follow_path {
  World world;
  wfpg::array_view<path_step> paths;
  wfpg::array_view<const wfpg::sampled_direction> directions;
  wfpg::array_view<test_surface> surfaces;
  wfpg::path_recorder_view recorder;
  std::uint32_t depth;
  std::uint64_t seed;

  WFPG_HD void operator()(std::size_t i) const {
    const auto path = static_cast<std::uint32_t>(i);
    path_step& step = paths[path];
    test_surface& surface = surfaces[path];
    const wfpg::sampled_direction& d = directions[path];
    if (!surface.active) return;
    recorder.scatter(path, depth, d);
    surface.active = d.pdf > 0.0f && hashed_numbers{seed}(path, 2).x < World::survival;
    if (!surface.active) return;
    step.throughput *= surface.bsdf.eval(surface.outgoing, d.direction) / (World::survival * d.pdf);
    wfpg::ray ray;
    ray.origin = surface.position;
    ray.direction = d.direction;
    const float distance = box_caster()(ray).distance;
    const vec3 p = glm::clamp(ray.origin + distance * d.direction, vec3(0.0f), vec3(1.0f));
    surface = make_surface(p, inward_normal(p), -d.direction);
    surface.active = step.throughput > 0.0f;
    const float found = step.throughput * world(p);
    recorder.vertex(path, depth + 1, p, -d.direction, vec3(step.throughput));
    recorder.emission(path, depth + 1, vec3(found));
    step.radiance += found;
  }
};

/// Samples and paths to trace. Paths start at points on the walls and have `directions` bounces.
struct paths_to_trace {
  std::uint32_t samples;
  std::size_t paths;
  std::uint32_t directions = 2;
  std::uint64_t first = 0;  ///< first sample; each has its own points and numbers
};

/// Traces samples. Returns the radiance of each path.
template <class Exec, class Guide, class Caster, class World>
std::vector<float> trace_paths(const Exec& exec, wfpg::path_guider<Exec, Guide>& guider,
                               const paths_to_trace& what, const Caster& caster, const World& world) {
  std::vector<float> picture;
  for (std::uint64_t sample = what.first; sample < what.first + what.samples; ++sample) {
    const wfpg::buffer<test_surface, Exec> surfaces(exec, wall_surfaces(what.paths, sample));
    const wfpg::buffer<path_step, Exec> steps(exec, std::vector<path_step>(what.paths));
    const wfpg::buffer<wfpg::sampled_direction, Exec> directions(exec, what.paths);
    guider.begin_sample();
    const wfpg::path_recorder_view recorder = guider.recorder();
    const wfpg::array_view<test_surface> at = surfaces.view();
    exec.for_each(what.paths, [=] WFPG_HD(std::size_t i) {
      recorder.vertex(i, 0, at[i].position, at[i].outgoing, vec3(1.0f));
    });
    for (std::uint32_t depth = 0; depth < what.directions; ++depth) {
      const std::uint64_t seed = 100 * sample + depth;
      const stored_surfaces stored{const_view<test_surface>(surfaces)};
      guider.sample_directions(wfpg::wave{depth, what.paths, stored, hashed_numbers{seed}}, caster,
                               directions.view());
      exec.for_each(what.paths,
                    follow_path<World>{world, steps.view(), const_view<wfpg::sampled_direction>(directions),
                                       surfaces.view(), recorder, depth, seed});
    }
    guider.end_sample();
    for (const path_step& step : steps.to_host(exec)) picture.push_back(step.radiance);
  }
  return picture;
}
/// Traces paths of two bounces in the box with its patch.
template <class Exec, class Guide, class Caster>
std::vector<float> trace_paths(const Exec& exec, wfpg::path_guider<Exec, Guide>& guider,
                               std::uint32_t samples, std::size_t paths, const Caster& caster) {
  return trace_paths(exec, guider, paths_to_trace{samples, paths}, caster, patch_box());
}

/// Options for trace_paths.
inline guider_options tracing_options(std::size_t paths,
                                      wfpg::guiding_mode mode = wfpg::guiding_mode::oriented,
                                      field_lifetime lifetime = field_lifetime::kept) {
  guider_options options = box_options(mode, lifetime);
  options.max_paths = paths;
  options.max_depth = 3;
  options.max_rays.reset();
  options.deposit_capacity.reset();
  options.unguided_samples = 1;
  return options;
}

}  // namespace wfpg_test
