// The renderer guided by Open PGL. Pictures have the means of path tracing. Densities match the directions,
// incident light is learnt, and invalid options are refused.
#include "casters/embree_caster.hpp"
#include "scene/builtin_scenes.hpp"
#include "scene/device_scene.hpp"
#include "support/catch.hpp"
#include "support/guided_depths.hpp"
#include "support/renderings.hpp"
#include "support/reports.hpp"
#include "tracer/openpgl_guider.hpp"
#include "tracer/wavefront.hpp"

#include <wfpg/testing/check_bsdf.hpp>

#include <tbb/global_control.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace {

using namespace render;
using policy = wfpg::exec::tbb;
using wfpg_test::rendering;

constexpr sampling_method methods[] = {sampling_method::openpgl_vmm, sampling_method::openpgl_dqt};

/// A guider that has learnt from a few samples of cornell-box.
template <class F>
void with_trained_guider(PGL_DIRECTIONAL_DISTRIBUTION_TYPE directional, const F& f) {
  constexpr int side = 32, max_depth = 5;
  const policy exec;
  const scene box = make_builtin_scene("cornell-box");
  const device_scene<policy> geometry(exec, box);
  const light_distribution<policy> lights(exec, box);
  const embree_scene accelerated(box);
  path_tracer<policy, embree_caster> tracer(exec, {side, side, max_depth, 1},
                                            {geometry.view(), lights.view(), false}, accelerated.caster());
  openpgl_options options;
  options.directional = directional;
  options.samples_per_leaf = 500;
  options.paths = side * side;
  options.max_depth = max_depth;
  options.bounds = {{-10.0f, -10.0f, -10.0f}, {10.0f, 10.0f, 10.0f}};
  openpgl_guider guider(exec, options);
  for (std::uint32_t i = 0; i < 6; ++i) tracer.render_sample(guider, pinhole(box.view, side, side), i, 1.0f);
  f(guider);
}

/// Open PGL's distribution at a point, with all of the cosine or none, as a BSDF for check_bsdf.
struct drawn_from_field {
  openpgl_field_view field;
  wfpg::surface<bsdf> at;

  openpgl_distribution distribution() const { return field.at(at); }
  float eval(vec3, vec3 incident) const { return distribution().pdf(incident); }
  float pdf(vec3, vec3 incident) const { return distribution().pdf(incident); }
  wfpg::bsdf_sample sample(vec3, vec2 u) const {
    wfpg::bsdf_sample drawn;
    drawn.direction = distribution().sample(u, drawn.pdf);
    return drawn;
  }
  bool is_delta() const { return false; }
  bool transmits() const { return true; }
};

std::string refusal(const render_options& options) {
  try {
    render::render(make_builtin_scene("cornell-box"), options, {});
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("pictures guided by Open PGL have the mean of unguided ones", "[renderer][openpgl][unbiased]") {
  for (const char* scene : {"cornell-enclosed", "ajar", "thin-wall", "glossy-room"})
    for (const bool nee : {false, true})
      for (const sampling_method method : methods) wfpg_test::check_rendering({scene, nee, method});
}

TEST_CASE("a furnace guided by Open PGL has its radiance within 0.5%", "[renderer][openpgl][unbiased]") {
  for (const sampling_method method : methods)
    for (const bool nee : {false, true}) {
      const rendering furnace{"furnace", nee, method};
      const image picture = render::render(make_builtin_scene("furnace"), furnace.options(), {}).picture;
      double mean = 0.0;
      for (const double tile : wfpg_test::tiles_of(picture))
        mean += tile / (wfpg_test::tiles * wfpg_test::tiles);
      CHECK(mean == Approx(furnace_radiance(furnace.options().max_depth)).epsilon(0.005));
    }
}

TEST_CASE("reported densities are those of Open PGL's directions", "[renderer][openpgl]") {
  wfpg::testing::bsdf_check_options options;
  options.reciprocal = false;
  options.samples = std::size_t(1) << 14;
  for (const auto directional :
       {PGL_DIRECTIONAL_DISTRIBUTION_PARALLAX_AWARE_VMM, PGL_DIRECTIONAL_DISTRIBUTION_QUADTREE})
    with_trained_guider(directional, [&](openpgl_guider& guider) {
      wfpg::surface<bsdf> floor;
      floor.position = {1.0f, 0.0f, 4.0f};
      floor.normal = floor.geometric_normal = floor.outgoing = {0.0f, 1.0f, 0.0f};
      for (const material_kind kind : {material_kind::lambert, material_kind::rough_dielectric}) {
        floor.bsdf.kind = kind;
        REQUIRE_FALSE(guider.view().at(floor).empty());
        const drawn_from_field drawn{guider.view(), floor};
        wfpg_test::check_passes(wfpg::testing::check_bsdf(policy(), drawn, options));
      }
      floor.bsdf.kind = material_kind::mirror;
      CHECK(guider.view().at(floor).empty());
    });
}

TEST_CASE("Open PGL learns the light along sampled directions", "[renderer][openpgl]") {
  const policy exec;
  openpgl_paths paths(3, 3);
  const openpgl_recorder& recorder = paths.recorder();
  const vec3 up{0.0f, 0.0f, 1.0f}, white(1.0f);
  wfpg::surface<bsdf> diffuse;
  diffuse.normal = diffuse.geometric_normal = diffuse.outgoing = up;
  diffuse.bsdf.normal = diffuse.bsdf.geometric_normal = up;
  diffuse.bsdf.colour = vec3(0.5f);
  const wfpg::sampled_direction drawn{up, 0.25f, wfpg::sampling_technique::guide};
  const vec3 scattered = diffuse.bsdf.eval_rgb(up, up) / drawn.pdf;
  wfpg::surface<bsdf> mirror = diffuse;
  mirror.bsdf.kind = material_kind::mirror;
  const wfpg::sampled_direction mirrored{up, 1.0f, wfpg::sampling_technique::delta};
  paths.clear();

  // A lamp and a lit surface behind a surface that takes half of the light. The first vertex is lit too.
  recorder.vertex(0, 0, vec3(0.0f), up, white);
  recorder.radiance(0, 0, vec3(7.0f));
  recorder.drawn(0, 0, diffuse, drawn);
  recorder.vertex(0, 1, 2.0f * up, -up, 0.5f * scattered);
  recorder.emission(0, 1, 0.5f * scattered * 3.0f);
  recorder.radiance(0, 1, 0.5f * scattered * 1.0f);
  // The environment.
  recorder.vertex(1, 0, vec3(1.0f), up, white);
  recorder.drawn(1, 0, diffuse, drawn);
  recorder.emission(1, 1, scattered * 4.0f);
  // A lamp in a mirror.
  recorder.vertex(2, 0, vec3(2.0f), up, white);
  recorder.drawn(2, 0, diffuse, drawn);
  recorder.vertex(2, 1, vec3(2.0f) + 3.0f * up, -up, scattered);
  recorder.drawn(2, 1, mirror, mirrored);
  recorder.vertex(2, 2, vec3(2.0f) + 8.0f * up, -up, 0.5f * scattered);
  recorder.emission(2, 2, 0.5f * scattered * 6.0f);
  paths.make_samples(exec);

  REQUIRE(paths.samples().GetSizeSurface() == 3);
  CHECK(paths.sample_bytes() == 3 * sizeof(openpgl::cpp::SampleData));
  const float radiance[] = {0.5f * (3.0f + 1.0f), 4.0f, 0.5f * 6.0f};
  const float distance[] = {2.0f, 1e6f, 8.0f};
  for (int i = 0; i < 3; ++i) {
    const openpgl::cpp::SampleData sample = paths.samples().GetSampleSurface(i);
    const int path = static_cast<int>(sample.position.x);
    INFO("path " << path);
    CHECK(from_pgl(sample.direction) == up);
    CHECK(sample.pdf == drawn.pdf);
    CHECK(sample.weight == Approx(radiance[path] / drawn.pdf));
    CHECK(sample.distance == Approx(distance[path]));
  }
  paths.clear();
  paths.make_samples(exec);
  CHECK(paths.samples().GetSizeSurface() == 0);
}

TEST_CASE("a rendering guided by Open PGL is equal on any number of threads", "[renderer][openpgl]") {
  for (const sampling_method method : methods) {
    render_options options = rendering{"cornell-enclosed", false, method}.options();
    const scene enclosed = make_builtin_scene("cornell-enclosed");
    const auto with_threads = [&](std::size_t threads) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      return render::render(enclosed, options, {}).picture.pixels;
    };
    CHECK(with_threads(1) == with_threads(3));
  }
}

TEST_CASE("a rendering guided by Open PGL reports its cost", "[renderer][openpgl]") {
  const scene wall = make_builtin_scene("thin-wall");
  for (const sampling_method method : methods) {
    render_options options = rendering{"thin-wall", true, method}.options();
    const render_report report = render::render(wall, options, {}).report;
    CHECK(report.method == (method == sampling_method::openpgl_vmm ? "openpgl-vmm" : "openpgl-dqt"));
    CHECK(report.regions > 1);
    CHECK(report.persistent_bytes > 100 * report.regions);
    CHECK(report.transient_bytes > 0);
    for (const char* stage : {"guide samples", "guide train", "guide query"}) {
      const auto timed = std::find_if(report.seconds.begin(), report.seconds.end(),
                                      [&](const auto& entry) { return entry.first == stage; });
      REQUIRE(timed != report.seconds.end());
      CHECK(timed->second > 0.0);
    }
    options.samples_per_leaf = 32000;
    CHECK(render::render(wall, options, {}).report.regions < report.regions);
  }
}

TEST_CASE("a rendering in the dark teaches Open PGL nothing", "[renderer][openpgl]") {
  scene box = make_builtin_scene("cornell-box");
  for (material& m : box.materials) m.emission = vec3(0.0f);
  for (const sampling_method method : methods) {
    const render_result dark = render::render(box, rendering{"cornell-box", false, method}.options(), {});
    CHECK(dark.report.regions == 0);
    CHECK(dark.report.persistent_bytes == 0);
    for (const vec3& pixel : dark.picture.pixels) REQUIRE(pixel == vec3(0.0f));
  }
}

TEST_CASE("the first sample with Open PGL is unguided", "[renderer][openpgl]") {
  const scene wall = make_builtin_scene("thin-wall");
  const auto picture = [&](sampling_method method, int spp) {
    render_options options = rendering{"thin-wall", true, method}.options();
    options.spp = spp;
    return render::render(wall, options, {}).picture.pixels;
  };
  for (const sampling_method method : methods) {
    CHECK(picture(method, 1) == picture(sampling_method::pt, 1));
    CHECK(picture(method, 3) != picture(sampling_method::pt, 3));
  }
}

TEST_CASE("with next-event estimation Open PGL does not guide a path's last direction",
          "[renderer][openpgl]") {
  for (const sampling_method method : methods) wfpg_test::check_depths_are_guided(method);
}

TEST_CASE("Open PGL refuses other devices and options out of range by name", "[renderer][openpgl]") {
  render_options options = rendering{"cornell-box", true, sampling_method::openpgl_vmm}.options();
  for (const auto& [where, name] : {std::pair(device::cuda, "cuda"), std::pair(device::optix, "optix"),
                                    std::pair(device::omp, "omp"), std::pair(device::seq, "seq")}) {
    options.where = where;
    CHECK(refusal(options).find(std::string("device is ") + name) != std::string::npos);
  }
  options.where = device::cpu;
  options.samples_per_leaf = 7;
  CHECK(refusal(options).find("samples_per_leaf is 7") != std::string::npos);
  options.samples_per_leaf = 8;
  options.guide_fraction = 1.5f;
  CHECK(refusal(options).find("guide_fraction is 1.5") != std::string::npos);
}
