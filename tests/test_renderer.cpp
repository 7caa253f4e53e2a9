// The path tracer without guiding: known answers, next-event estimation, one picture on any number of
// threads. Also the lights that all methods share.
#include "casters/embree_caster.hpp"
#include "scene/builtin_scenes.hpp"
#include "support/catch.hpp"
#include "support/either_guide.hpp"
#include "support/pictures.hpp"
#include "support/policies.hpp"
#include "tracer/unguided.hpp"
#include "tracer/wavefront.hpp"

#include <wfpg/guides/octree/kept_guide.hpp>
#include <wfpg/path_guider.hpp>

#include <tbb/global_control.h>

#include <cmath>
#include <utility>
#include <vector>

namespace {

using namespace render;
using namespace render_test;
using wfpg_test::backend;
using policy = wfpg_test::one_policy;

struct setup {
  int side = 16;
  std::uint32_t max_depth = 5;
  bool nee = true;
  std::uint64_t seed = 1;
  std::uint32_t samples = 16;
};

/// Embree as a batch caster, which runs between kernels.
class batch_caster {
 public:
  batch_caster(const embree_caster& inner) : inner_(inner) {}

  template <class Exec>
  void intersect(const Exec& exec, wfpg::array_view<const wfpg::ray> rays,
                 wfpg::array_view<triangle_hit> hits) const {
    answer(exec, rays, hits, triangle_hit{},
           [](const embree_caster& c, const wfpg::ray& r) { return c.intersect(r); });
  }
  template <class Exec>
  void occluded(const Exec& exec, wfpg::array_view<const wfpg::ray> rays,
                wfpg::array_view<std::uint32_t> hidden) const {
    answer(exec, rays, hidden, 0u,
           [](const embree_caster& c, const wfpg::ray& r) { return c.occluded(r) ? 1u : 0u; });
  }
  template <class Exec>
  void cast(const Exec& exec, wfpg::array_view<const wfpg::ray> rays,
            wfpg::array_view<wfpg::ray_hit> hits) const {
    answer(exec, rays, hits, wfpg::ray_hit{},
           [](const embree_caster& c, const wfpg::ray& r) { return c(r); });
  }

 private:
  template <class Exec, class T, class F>
  void answer(const Exec& exec, wfpg::array_view<const wfpg::ray> rays, wfpg::array_view<T> answers,
              const T& miss, const F& ask) const {
    exec.for_each(rays.size(), [=, inner = inner_](std::size_t i) {
      answers[i] = rays[i].t_max > rays[i].t_min ? ask(inner, rays[i]) : miss;
    });
  }

  embree_caster inner_;
};
static_assert(!wfpg::is_inline_caster_v<batch_caster>);

/// A picture, and what its film and clock counted.
struct traced {
  std::vector<vec3> picture;
  std::uint64_t segments = 0, light_hits = 0;
  bool has_whole_paths = false;     // in any sample
  bool ends_in_one_kernel = false;  // the last sample has nothing but whole paths
};

template <class Exec, class Caster = embree_caster, class Guider = unguided<Exec>>
traced trace_all(const scene& scene, const setup& with, Guider guider = Guider(Exec())) {
  const Exec exec;
  const device_scene<Exec> geometry(exec, scene);
  const light_distribution<Exec> lights(exec, scene);
  const embree_scene accelerated(scene);
  path_tracer<Exec, Caster> tracer(exec, {with.side, with.side, with.max_depth, with.seed},
                                   {geometry.view(), lights.view(), with.nee}, accelerated.caster());
  const pinhole camera(scene.view, with.side, with.side);
  const auto seconds_of = [&](const std::string& name) {
    double seconds = 0.0;
    for (const auto& stage : tracer.seconds()) seconds += stage.first == name ? stage.second : 0.0;
    return seconds;
  };
  double whole = 0.0, by_stages = 0.0;
  for (std::uint32_t i = 0; i < with.samples; ++i) {
    whole = seconds_of("paths");
    by_stages = seconds_of("trace");
    tracer.render_sample(guider, camera, i, 1.0f);
  }
  return {tracer.film().picture(), tracer.film().segments(), tracer.film().light_hits(),
          seconds_of("paths") > 0.0, seconds_of("paths") > whole && seconds_of("trace") == by_stages};
}
template <class Exec, class Caster = embree_caster, class Guider = unguided<Exec>>
std::vector<vec3> trace(const scene& scene, const setup& with, Guider guider = Guider(Exec())) {
  return trace_all<Exec, Caster, Guider>(scene, with, std::forward<Guider>(guider)).picture;
}

/// Means of independent pictures, and the z score of the difference between two sets.
struct batch {
  std::vector<double> means;
  double mean() const {
    double sum = 0.0;
    for (const double m : means) sum += m;
    return sum / static_cast<double>(means.size());
  }
  double variance_of_mean() const {
    double sum = 0.0;
    for (const double m : means) sum += (m - mean()) * (m - mean());
    const auto n = static_cast<double>(means.size());
    return sum / (n - 1.0) / n;
  }
};

batch batch_of(const scene& scene, setup with) {
  batch result;
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    with.seed = seed + (with.nee ? 1000 : 0);
    result.means.push_back(mean_of(trace<policy>(scene, with)));
  }
  return result;
}

}  // namespace

TEST_CASE("the furnace has its known radiance", "[renderer]") {
  const wfpg_test::backend_choice choice(GENERATE(backend::seq, backend::omp, backend::tbb));
  const scene furnace = make_builtin_scene("furnace");
  for (const bool nee : {false, true})
    for (const std::uint32_t depth : {1u, 2u, 8u}) {
      INFO("depth " << depth << ", nee " << nee);
      const setup with{112, depth, nee, 3, 8};
      CHECK(mean_of(trace<policy>(furnace, with)) ==
            Approx(furnace_radiance(static_cast<int>(depth))).epsilon(0.005));
    }
}

TEST_CASE("next-event estimation changes the noise, not the mean", "[renderer]") {
  const std::vector<std::pair<const char*, std::uint32_t>> cases{
      {"cornell-box", 2}, {"cornell-box", 5}, {"thin-wall", 5}, {"cornell-enclosed", 6}, {"materials", 4}};
  for (const auto& [name, depth] : cases) {
    INFO(name << ", depth " << depth);
    const scene scene = make_builtin_scene(name);
    setup with{96, depth, true, 0, 4};
    const batch on = batch_of(scene, with);
    with.nee = false;
    const batch off = batch_of(scene, with);
    INFO(on.mean() << " with, " << off.mean() << " without");
    CHECK(std::abs(on.mean() - off.mean()) < 4.0 * std::sqrt(on.variance_of_mean() + off.variance_of_mean()));
    CHECK(on.mean() > 0.0);
  }
}

TEST_CASE("a batch caster gives the pictures of an inline one", "[renderer]") {
  using guider = wfpg_test::octree_guider<policy>;
  const scene scene = make_builtin_scene("cornell-enclosed");
  const device_scene<policy> geometry(policy(), scene);
  for (const bool nee : {false, true}) {
    const setup with{32, 6, nee, 5, 6};
    const traced whole = trace_all<policy>(scene, with), waves = trace_all<policy, batch_caster>(scene, with);
    CHECK((whole.has_whole_paths && !waves.has_whole_paths));
    CHECK(same_bits(whole.picture, waves.picture));
    CHECK((whole.segments == waves.segments && whole.light_hits == waves.light_hits));
    for (const wfpg_test::field_lifetime lifetime :
         {wfpg_test::field_lifetime::kept, wfpg_test::field_lifetime::transient}) {
      wfpg_test::guider_options options;
      options.octree_resolution = 32;
      options.fields = lifetime;
      options.field_resolution = options.kept.resolution = 16;
      options.include_emission = !nee;
      options.max_paths = 32 * 32;
      options.max_depth = 6;
      const auto guided = [&] {
        const wfpg::triangle_mesh_view mesh{geometry.view().positions, geometry.view().triangles};
        return guider(policy(), mesh, options);
      };
      CHECK(same_bits(trace<policy, embree_caster>(scene, with, guided()),
                      trace<policy, batch_caster>(scene, with, guided())));
    }
  }
}

/// A guider that does not say which paths its guide takes part in, so that all of them are in its waves.
template <class Guider>
class silent_guider : private Guider {
 public:
  explicit silent_guider(Guider guider) : Guider(std::move(guider)) {}

  using Guider::begin_sample;
  using Guider::end_sample;
  using Guider::lights;
  using Guider::recorder;
  using Guider::sample_directions;
  using Guider::sample_weight;
};

/// Makes guiders of one scene. They never find that guiding pays.
struct guiders_that_rest {
  using guider = wfpg::path_guider<policy, wfpg::kept_guide<policy>>;
  static constexpr int side = 96;
  static constexpr std::uint32_t max_depth = 5;

  scene world = make_builtin_scene("cornell-wall");
  device_scene<policy> geometry{policy(), world};

  static setup of_samples(std::uint32_t samples) { return {side, max_depth, true, 5, samples}; }
  guider make() const {
    wfpg::kept_guide_options options;
    options.octree_resolution = 32;
    options.kept.resolution = 16;
    options.max_paths = side * side;
    options.max_depth = max_depth;
    options.least_gain = 1e6f;
    return guider(policy(), {geometry.view().positions, geometry.view().triangles}, options);
  }
};

TEST_CASE("while a guide probes, paths that it takes no part in have the bits of their waves", "[renderer]") {
  using guider = guiders_that_rest::guider;
  const guiders_that_rest guiders;
  // The guide probes in all four samples. The first two are not guided.
  const setup with = guiders_that_rest::of_samples(4);
  guider probes = guiders.make();
  const traced split = trace_all<policy, embree_caster, guider&>(guiders.world, with, probes);
  const traced waves =
      trace_all<policy, embree_caster>(guiders.world, with, silent_guider<guider>(guiders.make()));
  REQUIRE(probes.probing());
  CHECK(probes.statistics().gain.paths > 2048);
  CHECK(split.has_whole_paths);
  CHECK(!split.ends_in_one_kernel);
  CHECK(!waves.has_whole_paths);
  std::size_t equal = 0;
  for (std::size_t i = 0; i < split.picture.size(); ++i)
    equal += split.picture[i] == waves.picture[i] ? 1u : 0u;
  const std::size_t paths = split.picture.size(), guided = probes.guided_paths().size(paths);
  CHECK(guided > 0);
  CHECK(guided <= paths / 2);
  CHECK(equal >= paths - guided);
  CHECK(mean_of(split.picture) == Approx(mean_of(waves.picture)).epsilon(0.01));
}

TEST_CASE("samples in which a guide rests have the bits of their waves", "[renderer]") {
  using guider = guiders_that_rest::guider;
  const guiders_that_rest guiders;
  const setup with = guiders_that_rest::of_samples(24);
  guider rests = guiders.make();
  const traced whole = trace_all<policy, embree_caster, guider&>(guiders.world, with, rests);
  // A batch caster's paths wait for each other in all samples.
  const traced waves = trace_all<policy, batch_caster>(guiders.world, with, guiders.make());
  CHECK(rests.resting());
  CHECK(rests.statistics().gain.paths > wfpg::guiding_gain::least_paths);
  CHECK(whole.ends_in_one_kernel);
  CHECK(!waves.has_whole_paths);
  CHECK(same_bits(whole.picture, waves.picture));
  CHECK(whole.segments == waves.segments);
  CHECK(whole.light_hits == waves.light_hits);
}

TEST_CASE("one seed gives one picture on any number of threads", "[renderer]") {
  const scene scene = make_builtin_scene("cornell-enclosed");
  const setup with{32, 6, true, 5, 4};
  const auto traced_by = [&](backend chosen) {
    return wfpg_test::with_backend(chosen, [&] { return trace<policy>(scene, with); });
  };
  const auto serial = traced_by(backend::seq);
  CHECK(same_bits(serial, traced_by(backend::seq)));
  for (const int threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    CHECK(same_bits(serial, traced_by(backend::tbb)));
    const int before = omp_get_max_threads();
    omp_set_num_threads(threads);
    CHECK(same_bits(serial, traced_by(backend::omp)));
    omp_set_num_threads(before);
  }
  setup other = with;
  other.seed = 6;
  CHECK_FALSE(same_bits(serial, trace<policy>(scene, other)));
}

TEST_CASE("emitters emit on one side, and the environment everywhere", "[renderer]") {
  material lamp;
  lamp.base_color = vec3(0.0f);
  lamp.emission = {1.0f, 2.0f, 3.0f};
  scene s = square_of(lamp);
  s.environment = vec3(0.25f);
  CHECK(trace<policy>(s, {}).front() == lamp.emission);
  s.view.position.z = -2.0f;
  s.view.forward = {0.0f, 0.0f, 1.0f};
  CHECK(trace<policy>(s, {}).front() == vec3(0.0f));
  s.view.forward = {0.0f, 0.0f, -1.0f};
  CHECK(trace<policy>(s, {}).front() == vec3(0.25f));
}

TEST_CASE("a surface under a constant sky returns its albedo", "[renderer]") {
  material grey;
  grey.base_color = vec3(0.5f);
  scene s = square_of(grey);
  s.environment = vec3(1.0f);
  // The scene has only this square, so every reflected path leaves.
  CHECK(mean_of(trace<policy>(s, {})) == Approx(0.5).epsilon(1e-4));
  s.materials[0].kind = material_kind::mirror;
  CHECK(mean_of(trace<policy>(s, {})) == Approx(0.5).epsilon(1e-4));
  s.materials[0].kind = material_kind::dielectric;
  s.materials[0].base_color = vec3(1.0f);
  setup deep;
  deep.samples = 256;
  // Light from below the boundary has the radiance of its index: 0.04 + 0.96 / 1.5².
  CHECK(mean_of(trace<policy>(s, deep)) == Approx(0.04 + 0.96 / 2.25).epsilon(0.01));
}

TEST_CASE("a smooth coat under an even sky returns its albedo", "[renderer]") {
  material coated;
  coated.kind = material_kind::smooth_plastic;
  coated.base_color = vec3(0.5f);
  scene s = square_of(coated);
  constexpr float cosine = 0.3f;
  s.view.position = 4.0f * vec3(std::sqrt(1.0f - cosine * cosine), 0.0f, cosine);
  s.view.forward = glm::normalize(-s.view.position);
  s.view.vertical_fov = 0.001f;
  setup with{32, 3, true, 0, 64};
  // Of light from everywhere, a coat of this index lets 0.90822 through.
  const float mirrored = fresnel_dielectric(cosine, coated.ior);
  const float expected = mirrored + (1.0f - mirrored) * 0.5f * 0.90822f;
  const auto check = [&] {
    for (const bool nee : {false, true}) {
      with.nee = nee;
      CHECK(mean_of(trace<policy>(s, with)) == Approx(expected).epsilon(0.003));
      wfpg_test::guider_options options;
      options.octree_resolution = 16;
      options.kept.resolution = 16;
      options.include_emission = !nee;
      options.max_paths = 32 * 32;
      options.max_depth = 3;
      const device_scene<policy> geometry(policy(), s);
      wfpg_test::octree_guider<policy> guider(
          policy(), {geometry.view().positions, geometry.view().triangles}, options);
      const auto guided = trace<policy, embree_caster>(s, with, std::move(guider));
      CHECK(mean_of(guided) == Approx(expected).epsilon(0.003));
    }
  };
  s.environment = vec3(1.0f);
  check();
  // A map is found by next-event estimation too, but not its mirror image in the coat.
  s.sky = {4, 4, std::vector<vec3>(16, vec3(1.0f))};
  check();
}

TEST_CASE("an empty scene shows its environment", "[renderer]") {
  scene s;
  s.environment = {0.1f, 0.2f, 0.3f};
  CHECK(trace<policy>(s, {}).back() == s.environment);
}

TEST_CASE("light samples follow power, and report the density of a hit", "[renderer]") {
  scene s = square_of({});
  s.materials.push_back({});
  s.materials[0].emission = vec3(3.0f);
  s.materials[1].emission = vec3(1.0f);
  s.triangle_materials = {0, 1};
  const policy exec;
  const device_scene<policy> geometry(exec, s);
  const light_distribution<policy> lights(exec, s);
  const random_stream random{1, 0};
  const std::uint32_t n = 100000;
  int bright = 0;
  vec3 centre(0.0f);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t light = pick(lights.view().table, random(i, 0));
    const emitter_point drawn = lights.view().sample_emitter(geometry.view(), light, random(i, 1));
    REQUIRE(drawn.pdf == lights.view().pdf(wfpg::luminance(drawn.radiance)));
    if (drawn.radiance.x < 2.0f) continue;
    ++bright;
    centre += drawn.position;
    REQUIRE(drawn.pdf == Approx(3.0f / 8.0f));  // 3/4 of the samples on an area of 2
  }
  CHECK(bright / static_cast<double>(n) == Approx(0.75).margin(0.006));
  CHECK(glm::length(centre / static_cast<float>(bright) - vec3(1.0f / 3.0f, -1.0f / 3.0f, 0.0f)) < 0.01f);
}

TEST_CASE("lights without extent light surfaces that face them", "[renderer]") {
  material grey;
  grey.base_color = vec3(0.5f);
  scene s = square_of(grey);
  setup narrow;
  narrow.side = 1;
  narrow.max_depth = 3;
  punctual_light light;
  light.position = {0.0f, 0.0f, 4.0f};
  light.intensity = vec3(32.0f);
  const auto radiance = [&](const punctual_light& source) {
    s.punctual_lights = {source};
    s.view.vertical_fov = 0.01f;
    return trace<policy>(s, narrow).front().x;
  };
  // Albedo / pi times irradiance, 32 / 4².
  CHECK(radiance(light) == Approx(0.5f / pi * 2.0f).epsilon(1e-3));
  light.kind = punctual_kind::spot;
  light.cos_inner = 0.9f;
  light.cos_outer = 0.8f;
  CHECK(radiance(light) == Approx(0.5f / pi * 2.0f).epsilon(1e-3));
  light.direction = glm::normalize(vec3(std::sqrt(1.0f - 0.85f * 0.85f), 0.0f, -0.85f));
  CHECK(radiance(light) == Approx(0.25f * 0.5f / pi * 2.0f).epsilon(2e-2));  // half way between the cones
  light.direction = {0.0f, 0.0f, 1.0f};
  CHECK(radiance(light) == 0.0f);
  light.kind = punctual_kind::directional;
  light.direction = {0.0f, 0.6f, -0.8f};
  CHECK(radiance(light) == Approx(0.5f / pi * 32.0f * 0.8f).epsilon(1e-3));
  light.direction = {0.0f, 0.0f, 1.0f};
  CHECK(radiance(light) == 0.0f);
}

TEST_CASE("a solid absorbs by Beer's law, and an emitter shows its texture", "[renderer]") {
  // A slab of glass in front of an emitter, seen along its normal.
  scene s;
  for (const float z : {0.0f, -1.0f, -2.0f}) {
    const auto first = static_cast<std::uint32_t>(s.positions.size());
    for (const vec2 corner : {vec2(-9, -9), vec2(9, -9), vec2(9, 9), vec2(-9, 9)}) {
      s.positions.emplace_back(corner.x, corner.y, z);
      s.uvs.push_back(vec2(0.5f));
    }
    for (const uvec3 t : {uvec3(0, 1, 2), uvec3(0, 2, 3)})
      s.triangles.push_back(first + (z == -1.0f ? uvec3(t.x, t.z, t.y) : t));
  }
  s.triangle_materials = {0, 0, 0, 0, 1, 1};
  s.materials.resize(2);
  s.materials[0].kind = material_kind::dielectric;
  s.materials[0].base_color = vec3(1.0f);
  s.materials[0].ior = 1.0f;
  s.materials[0].absorption = {0.5f, 1.0f, 2.0f};
  s.materials[1].emission = vec3(4.0f);
  s.materials[1].emission_texture.index = 0;
  s.textures.push_back({1, 1, {vec4(0.5f, 1.0f, 1.0f, 1.0f)}});
  s.view.position = {0.0f, 0.0f, 1.0f};
  s.view.vertical_fov = 0.01f;
  setup with;
  with.side = 4;
  const vec3 seen = trace<policy>(s, with).front();
  const vec3 expected = vec3(2.0f, 4.0f, 4.0f) * glm::exp(-s.materials[0].absorption);
  CHECK(glm::length(seen - expected) < 1e-3f);
}

TEST_CASE("next-event estimation finds a textured emitter's mean", "[renderer]") {
  // A lamp above a floor. Its texture leaves half of it dark.
  material floor;
  floor.base_color = vec3(0.7f);
  scene s = square_of(floor);
  for (const vec3 corner : {vec3(-1, -1, 1), vec3(-1, 1, 1), vec3(1, 1, 1), vec3(1, -1, 1)})
    s.positions.push_back(corner);
  for (const vec3& p : s.positions) s.uvs.push_back(0.5f * vec2(p) + vec2(0.5f));
  s.triangles.insert(s.triangles.end(), {{4, 5, 6}, {4, 6, 7}});
  s.triangle_materials = {0, 0, 1, 1};
  s.materials.resize(2);
  s.materials[1].emission = vec3(3.0f);
  s.materials[1].emission_texture.index = 0;
  s.textures.push_back({2, 1, {vec4(0.0f, 0.0f, 0.0f, 1.0f), vec4(1.0f)}});
  s.view.position = {0.0f, -0.5f, 0.9f};
  s.view.forward = {0.0f, 0.4f, -0.9f};
  setup with{32, 3, true, 0, 32};
  const batch on = batch_of(s, with);
  with.nee = false;
  const batch off = batch_of(s, with);
  INFO(on.mean() << " with, " << off.mean() << " without");
  CHECK(std::abs(on.mean() - off.mean()) < 4.0 * std::sqrt(on.variance_of_mean() + off.variance_of_mean()));
  CHECK(on.mean() > 0.0);
}

TEST_CASE("next-event estimation and hits agree on an environment map", "[renderer]") {
  material grey;
  grey.base_color = vec3(0.5f);
  scene s = square_of(grey);
  s.view.vertical_fov = 0.01f;
  s.sky.width = 4;
  s.sky.height = 4;
  setup with{8, 3, true, 0, 64};
  s.sky.texels.assign(16, vec3(2.0f));
  CHECK(mean_of(trace<policy>(s, with)) == Approx(1.0).epsilon(0.02));
  for (std::size_t i = 0; i < 16; ++i) s.sky.texels[i] = vec3(i % 5 == 0 ? 20.0f : 0.1f);
  const batch on = batch_of(s, with);
  with.nee = false;
  const batch off = batch_of(s, with);
  INFO(on.mean() << " with, " << off.mean() << " without");
  CHECK(std::abs(on.mean() - off.mean()) < 4.0 * std::sqrt(on.variance_of_mean() + off.variance_of_mean()));
}
