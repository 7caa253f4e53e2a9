// The path tracer without guiding: known answers, next-event estimation against none, the same picture on any
// number of threads; and the parts that both methods share.
#include "builtin_scenes.hpp"
#include "bvh_scene.hpp"
#include "embree_caster.hpp"
#include "render.hpp"
#include "support/catch.hpp"
#include "unguided.hpp"
#include "wavefront.hpp"

#include <wfpg/exec/omp.hpp>
#include <wfpg/exec/seq.hpp>
#include <wfpg/exec/tbb.hpp>
#include <wfpg/path_guider.hpp>

#include <tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace render;

struct setup {
  int side = 16;
  std::uint32_t max_depth = 5;
  bool nee = true;
  std::uint64_t seed = 1;
  std::uint32_t samples = 16;
};

/// Embree as casters come that work on batches between kernels.
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

template <class Exec, class Caster = embree_caster, class Guider = unguided<Exec>>
std::vector<vec3> trace(const scene& scene, const setup& with, Guider guider = Guider(Exec())) {
  const Exec exec;
  const device_scene<Exec> geometry(exec, scene);
  const light_distribution<Exec> lights(exec, scene);
  const embree_scene accelerated(scene);
  path_tracer<Exec, Caster> tracer(exec, {with.side, with.side, with.max_depth, with.seed},
                                   {geometry.view(), lights.view(), with.nee}, accelerated.caster());
  const pinhole camera(scene.view, with.side, with.side);
  for (std::uint32_t i = 0; i < with.samples; ++i) tracer.render_sample(guider, camera, i, 1.0f);
  return tracer.picture();
}

double mean_of(const std::vector<vec3>& pixels) {
  double sum = 0.0;
  for (const vec3& p : pixels) sum += static_cast<double>(wfpg::luminance(p));
  return sum / static_cast<double>(pixels.size());
}

bool same_bits(const std::vector<vec3>& a, const std::vector<vec3>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(vec3)) == 0;
}

/// Means of independent pictures, and the z score of the difference of two sets of them.
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
    result.means.push_back(mean_of(trace<wfpg::exec::tbb>(scene, with)));
  }
  return result;
}

/// One square of side 2 in the plane z = 0 that faces +z, of a given material.
scene square_of(const material& material) {
  scene s;
  s.name = "square";
  s.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  s.triangles = {{0, 1, 2}, {0, 2, 3}};
  s.triangle_materials = {0, 0};
  s.materials = {material};
  s.view.position = {0, 0, 2};
  s.view.vertical_fov = 0.5f;
  return s;
}

/// What render() says of options that it refuses.
std::string refusal(const render_options& options) {
  try {
    render::render(square_of({}), options, {});
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing";
}

}  // namespace

TEMPLATE_TEST_CASE("the furnace has the radiance that theory says", "[renderer]", wfpg::exec::seq,
                   wfpg::exec::omp, wfpg::exec::tbb) {
  const scene furnace = make_builtin_scene("furnace");
  for (const bool nee : {false, true})
    for (const std::uint32_t depth : {1u, 2u, 8u}) {
      INFO("depth " << depth << ", nee " << nee);
      const setup with{112, depth, nee, 3, 8};
      CHECK(mean_of(trace<TestType>(furnace, with)) ==
            Approx(furnace_radiance(static_cast<int>(depth))).epsilon(0.005));
    }
}

TEST_CASE("next-event estimation changes the noise, not the mean", "[renderer]") {
  const std::vector<std::pair<const char*, std::uint32_t>> cases{
      {"cornell-box", 2}, {"cornell-box", 5}, {"thin-wall", 5}, {"cornell-enclosed", 6}};
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
  using exec_policy = wfpg::exec::tbb;
  using guider = wfpg::path_guider<exec_policy>;
  const scene scene = make_builtin_scene("cornell-enclosed");
  const device_scene<exec_policy> geometry(exec_policy(), scene);
  for (const bool nee : {false, true}) {
    const setup with{32, 6, nee, 5, 6};
    CHECK(same_bits(trace<exec_policy>(scene, with), trace<exec_policy, batch_caster>(scene, with)));
    for (const wfpg::field_lifetime lifetime :
         {wfpg::field_lifetime::kept, wfpg::field_lifetime::transient}) {
      wfpg::guider_options options;
      options.octree_resolution = 32;
      options.fields = lifetime;
      options.field_resolution = options.kept.resolution = 16;
      options.include_emission = !nee;
      options.max_paths = 32 * 32;
      options.max_depth = 6;
      const auto guided = [&] {
        const wfpg::triangle_mesh_view mesh{geometry.view().positions, geometry.view().triangles};
        return guider(exec_policy(), mesh, options);
      };
      CHECK(same_bits(trace<exec_policy, embree_caster>(scene, with, guided()),
                      trace<exec_policy, batch_caster>(scene, with, guided())));
    }
  }
}

TEST_CASE("one seed gives one picture on any number of threads", "[renderer]") {
  const scene scene = make_builtin_scene("cornell-enclosed");
  const setup with{32, 6, true, 5, 4};
  const auto serial = trace<wfpg::exec::seq>(scene, with);
  CHECK(same_bits(serial, trace<wfpg::exec::seq>(scene, with)));
  for (const int threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    CHECK(same_bits(serial, trace<wfpg::exec::tbb>(scene, with)));
    const int before = omp_get_max_threads();
    omp_set_num_threads(threads);
    CHECK(same_bits(serial, trace<wfpg::exec::omp>(scene, with)));
    omp_set_num_threads(before);
  }
  setup other = with;
  other.seed = 6;
  CHECK_FALSE(same_bits(serial, trace<wfpg::exec::seq>(scene, other)));
}

TEST_CASE("emitters shine on one side, and the environment everywhere", "[renderer]") {
  material lamp;
  lamp.base_color = vec3(0.0f);
  lamp.emission = {1.0f, 2.0f, 3.0f};
  scene s = square_of(lamp);
  s.environment = vec3(0.25f);
  CHECK(trace<wfpg::exec::seq>(s, {}).front() == lamp.emission);
  s.view.position.z = -2.0f;
  s.view.forward = {0.0f, 0.0f, 1.0f};
  CHECK(trace<wfpg::exec::seq>(s, {}).front() == vec3(0.0f));
  s.view.forward = {0.0f, 0.0f, -1.0f};
  CHECK(trace<wfpg::exec::seq>(s, {}).front() == vec3(0.25f));
}

TEST_CASE("a surface under a constant sky returns its albedo", "[renderer]") {
  material grey;
  grey.base_color = vec3(0.5f);
  scene s = square_of(grey);
  s.environment = vec3(1.0f);
  // The square is all there is: every reflected path leaves.
  CHECK(mean_of(trace<wfpg::exec::tbb>(s, {})) == Approx(0.5).epsilon(1e-4));
  s.materials[0].kind = material_kind::mirror;
  CHECK(mean_of(trace<wfpg::exec::tbb>(s, {})) == Approx(0.5).epsilon(1e-4));
  s.materials[0].kind = material_kind::dielectric;
  s.materials[0].base_color = vec3(1.0f);
  setup deep;
  deep.samples = 256;
  // Light from below the one boundary has the radiance of its index: 0.04 + 0.96 / 1.5².
  CHECK(mean_of(trace<wfpg::exec::tbb>(s, deep)) == Approx(0.04 + 0.96 / 2.25).epsilon(0.01));
}

TEST_CASE("an empty scene shows its environment", "[renderer]") {
  scene s;
  s.environment = {0.1f, 0.2f, 0.3f};
  CHECK(trace<wfpg::exec::tbb>(s, {}).back() == s.environment);
}

TEST_CASE("light samples follow power, and report the density of a hit", "[renderer]") {
  scene s = square_of({});
  s.materials.push_back({});
  s.materials[0].emission = vec3(3.0f);
  s.materials[1].emission = vec3(1.0f);
  s.triangle_materials = {0, 1};
  const wfpg::exec::seq exec;
  const device_scene<wfpg::exec::seq> geometry(exec, s);
  const light_distribution<wfpg::exec::seq> lights(exec, s);
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

TEST_CASE("lights without extent light what faces them", "[renderer]") {
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
    return trace<wfpg::exec::seq>(s, narrow).front().x;
  };
  // Albedo / pi times irradiance: 32 / 4².
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
  // A slab of glass, seen straight on, before an emitter.
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
  const vec3 seen = trace<wfpg::exec::seq>(s, with).front();
  const vec3 expected = vec3(2.0f, 4.0f, 4.0f) * glm::exp(-s.materials[0].absorption);
  CHECK(glm::length(seen - expected) < 1e-3f);
}

TEST_CASE("next-event estimation finds a textured emitter's mean", "[renderer]") {
  // A lamp of which the texture leaves half dark, above a floor.
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

TEST_CASE("an environment map lights as it is sampled and as it is found", "[renderer]") {
  material grey;
  grey.base_color = vec3(0.5f);
  scene s = square_of(grey);
  s.view.vertical_fov = 0.01f;
  s.sky.width = 4;
  s.sky.height = 4;
  setup with{8, 3, true, 0, 64};
  s.sky.texels.assign(16, vec3(2.0f));
  CHECK(mean_of(trace<wfpg::exec::tbb>(s, with)) == Approx(1.0).epsilon(0.02));
  for (std::size_t i = 0; i < 16; ++i) s.sky.texels[i] = vec3(i % 5 == 0 ? 20.0f : 0.1f);
  const batch on = batch_of(s, with);
  with.nee = false;
  const batch off = batch_of(s, with);
  INFO(on.mean() << " with, " << off.mean() << " without");
  CHECK(std::abs(on.mean() - off.mean()) < 4.0 * std::sqrt(on.variance_of_mean() + off.variance_of_mean()));
}

TEST_CASE("textures are bilinear and repeat", "[renderer]") {
  scene s = square_of({});
  s.uvs = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  s.textures.push_back({2, 2, {vec4(1, 0, 0, 1), vec4(0, 1, 0, 1), vec4(0, 0, 1, 1), vec4(1)}});
  const wfpg::exec::seq exec;
  const device_scene<wfpg::exec::seq> geometry(exec, s);
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
}

TEST_CASE("rays go through what an alpha mask cuts out", "[renderer]") {
  // Three squares behind one another: one cut out in its left half, one opaque, one whose holes nobody sees.
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
  const wfpg::exec::seq exec;
  const device_scene<wfpg::exec::seq> geometry(exec, s);
  const embree_scene embree(exec, s, geometry.view());
  const bvh_scene<wfpg::exec::seq> bvh(exec, s, geometry.view());
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
  const wfpg::exec::seq exec;
  const device_scene<wfpg::exec::seq> geometry(exec, s);
  for (const float side : {1.0f, -1.0f}) {
    const vec3 outgoing = glm::normalize(vec3(-1.0f, 0.0f, side * 0.1f));
    const hit_surface hit = geometry.view().surface({0, 0.2f, 0.2f}, outgoing);
    CHECK(glm::dot(hit.surface.normal, outgoing) > 0.0f);
    CHECK(glm::dot(hit.surface.normal, hit.surface.geometric_normal) > 0.0f);
    CHECK(hit.surface.bsdf.sample(outgoing, {0.01f, 0.5f}).pdf > 0.0f);
  }
}

TEST_CASE("scenes and options that cannot be right are refused by name", "[renderer]") {
  const wfpg::exec::seq exec;
  scene broken = square_of({});
  broken.triangles[1].y = 4;
  CHECK_THROWS_AS(device_scene<wfpg::exec::seq>(exec, broken), std::invalid_argument);
  broken = square_of({});
  broken.triangle_materials[0] = 1;
  CHECK_THROWS_AS(device_scene<wfpg::exec::seq>(exec, broken), std::invalid_argument);

  render_options options;
  options.method = sampling_method::pt;
  options.spp = 0;
  CHECK(refusal(options).find("spp is 0") != std::string::npos);
  options.spp = 1;
  options.combine = wfpg::sample_combination::discard_first;
  CHECK(refusal(options).find("spp is 1") != std::string::npos);
}

TEST_CASE("a rendering reports itself and takes samples or seconds", "[renderer]") {
  render_options options;
  options.method = sampling_method::pt;
  options.width = 16;
  options.height = 8;
  options.spp = 3;
  int calls = 0;
  const auto counted = [&calls](const render_progress& p) { calls += p.fraction <= 1.0; };
  const scene box = make_builtin_scene("cornell-box");
  for (const device where : {device::cpu, device::omp, device::seq}) {
    options.where = where;
    const render_result result = render::render(box, options, counted);
    CHECK(result.report.spp == 3);
    CHECK((result.picture.width == 16 && result.picture.height == 8 && result.picture.pixels.size() == 128));
  }
  CHECK(calls == 9);
  options.seconds = 0.05;
  const render_result timed = render::render(box, options, {});
  CHECK(timed.report.spp >= 1);
  CHECK(timed.report.total_seconds >= 0.05);
}

TEST_CASE("checkpoints are the pictures on the way", "[renderer]") {
  render_options options;
  options.width = options.height = 16;
  options.octree_resolution = 32;
  options.spp = 4;
  const scene box = make_builtin_scene("cornell-box");
  CHECK(render::render(box, options, {}).checkpoints.empty());
  options.checkpoints = checkpoint_times::powers_of_two;
  const render_result result = render::render(box, options, {});
  REQUIRE(result.checkpoints.size() == 3);
  CHECK(result.checkpoints[0].seconds <= result.checkpoints[2].seconds);
  CHECK(result.checkpoints[2].samples == 4);
  CHECK(result.checkpoints[2].picture.pixels == result.picture.pixels);
  options.spp = 2;
  CHECK(render::render(box, options, {}).picture.pixels == result.checkpoints[1].picture.pixels);
  options.spp = 3;
  const render_result odd = render::render(box, options, {});
  REQUIRE(odd.checkpoints.size() == 3);
  CHECK(odd.checkpoints[2].samples == 3);
  CHECK(odd.checkpoints[2].picture.pixels == odd.picture.pixels);
  options.spp = 6;
  options.checkpoints = checkpoint_times::all;
  const render_result all = render::render(box, options, {});
  REQUIRE(all.checkpoints.size() == 6);
  for (int i = 0; i < 6; ++i) CHECK(all.checkpoints[static_cast<std::size_t>(i)].samples == i + 1);
  CHECK(all.checkpoints[2].picture.pixels == odd.picture.pixels);
}

TEST_CASE("later samples count more only where they are better", "[renderer]") {
  render_options options;
  CHECK(combination_of(options) == wfpg::sample_combination::pt_linear);
  options.method = sampling_method::pt;
  CHECK(combination_of(options) == wfpg::sample_combination::constant);
  options.combine = wfpg::sample_combination::quadratic;
  CHECK(combination_of(options) == wfpg::sample_combination::quadratic);
}

TEST_CASE("a guided rendering finds the furnace's radiance", "[renderer][guided]") {
  const scene furnace = make_builtin_scene("furnace");
  render_options options;
  options.width = options.height = 40;
  options.max_depth = 4;
  options.spp = 20;
  options.octree_resolution = 32;
  options.field_resolution = 16;
  options.slot_resolution = 16;
  for (const fields lifetime : {fields::kept, fields::transient})
    for (const bool nee : {false, true})
      for (const guiding mode : {guiding::oriented, guiding::plain}) {
        INFO("nee " << nee << ", mode " << static_cast<int>(mode) << ", fields "
                    << static_cast<int>(lifetime));
        options.lifetime = lifetime;
        options.nee = nee;
        options.mode = mode;
        const render_result result = render::render(furnace, options, {});
        CHECK(mean_of(result.picture.pixels) == Approx(furnace_radiance(4)).epsilon(0.005));
      }
}

TEST_CASE("a guided rendering is one picture on any device and number of threads", "[renderer][guided]") {
  const scene scene = make_builtin_scene("cornell-enclosed");
  render_options options;
  options.width = options.height = 24;
  options.spp = 3;
  options.octree_resolution = 32;
  for (const fields lifetime : {fields::kept, fields::transient}) {
    options.lifetime = lifetime;
    options.where = device::seq;
    const std::vector<vec3> serial = render::render(scene, options, {}).picture.pixels;
    CHECK(same_bits(serial, render::render(scene, options, {}).picture.pixels));
    for (const int threads : {1, 3}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                      static_cast<std::size_t>(threads));
      options.where = device::cpu;
      CHECK(same_bits(serial, render::render(scene, options, {}).picture.pixels));
      const int before = omp_get_max_threads();
      omp_set_num_threads(threads);
      options.where = device::omp;
      CHECK(same_bits(serial, render::render(scene, options, {}).picture.pixels));
      omp_set_num_threads(before);
    }
  }
}

TEST_CASE("the first sample of a guided rendering is path tracing's, later ones are not",
          "[renderer][guided]") {
  const scene scene = make_builtin_scene("thin-wall");
  render_options options;
  options.width = options.height = 16;
  options.octree_resolution = 32;
  const auto render_with = [&](sampling_method method, int spp) {
    options.method = method;
    options.spp = spp;
    return render::render(scene, options, {});
  };
  const std::vector<vec3> unguided = render_with(sampling_method::pt, 3).picture.pixels;
  const std::vector<vec3> first = render_with(sampling_method::pt, 1).picture.pixels;
  for (const fields lifetime : {fields::transient, fields::kept}) {
    options.lifetime = lifetime;
    CHECK(same_bits(render_with(sampling_method::wfpg, 1).picture.pixels, first));
    CHECK_FALSE(same_bits(render_with(sampling_method::wfpg, 3).picture.pixels, unguided));
  }
  const render_result guided = render_with(sampling_method::wfpg, 3);
  CHECK(guided.report.octree.resolution == 32);
  CHECK(guided.report.octree.nodes > guided.report.octree.leaves);
  CHECK(guided.report.bins.at(0).count >= 1.0);
  CHECK(guided.report.cones_per_segment > 0.0);
  CHECK(guided.report.persistent_bytes > 0);
  CHECK(guided.report.slots.capacity > guided.report.slots.live);
  CHECK(guided.report.slots.live > 0);
  CHECK(guided.report.slots.refreshed > 0.0);
}
