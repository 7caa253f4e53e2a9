// Octrees from the renderer's caster and from hits of its paths, in built-in scenes. Their leaves are
// compared with those of the triangles, and pictures with --octree are resumed and have path tracing's mean.
#include "app/output_files.hpp"
#include "app/render.hpp"
#include "casters/bvh_scene.hpp"
#include "scene/builtin_scenes.hpp"
#include "scene/camera.hpp"
#include "scene/device_scene.hpp"
#include "support/fragments.hpp"
#include "support/policies.hpp"
#include "support/temporary_folder.hpp"

#include <wfpg/octree/fragments_from_caster.hpp>
#include <wfpg/octree/fragments_from_hits.hpp>
#include <wfpg/octree/surface_collector.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::surface_fragment;
using wfpg::vec2;
using wfpg::vec3;

/// Types in kernels need names, for CUDA compilers.
namespace octree_test {

constexpr std::uint32_t width = 120, height = 90, depth = 8;

/// Follows a diffuse path from each pixel, and collects its hits.
struct walk_paths {
  render::bvh_caster caster;
  render::scene_view scene;
  render::pinhole camera;
  wfpg::surface_collector_view hits;
  std::uint64_t seed;

  WFPG_HD void operator()(std::size_t pixel) const {
    const std::uint64_t state = wfpg::hash(seed, pixel);
    wfpg::ray ray = camera.through(static_cast<std::uint32_t>(pixel), wfpg::unit_vec2(state));
    for (std::uint32_t i = 0; i < depth; ++i) {
      const render::triangle_hit hit = caster.intersect(ray);
      if (!hit.is_hit()) return;
      const render::hit_surface at = scene.surface(hit, -ray.direction);
      const vec3 facing = glm::dot(at.surface.geometric_normal, ray.direction) < 0.0f
                              ? at.surface.geometric_normal
                              : -at.surface.geometric_normal;
      hits.add(pixel + i * std::size_t(width * height), at.surface.position, at.surface.geometric_normal);
      const vec2 u = wfpg::unit_vec2(wfpg::hash(state, i));
      ray.direction = glm::normalize(1.001f * facing + wfpg::square_to_sphere(u));
      ray.origin = at.surface.position + at.offset * facing;
    }
  }
};

}  // namespace octree_test

namespace {

using octree_test::walk_paths;

/// The hits of a sample of diffuse paths.
template <class Exec>
wfpg::buffer<surface_fragment, Exec> hits_of_paths(const Exec& exec, const render::scene& host,
                                                   const render::scene_view& view,
                                                   const render::bvh_caster& caster, std::uint64_t seed) {
  const std::size_t pixels = octree_test::width * octree_test::height;
  const wfpg::surface_collector<Exec> collector(exec, pixels * octree_test::depth);
  const render::pinhole camera(host.view, int(octree_test::width), int(octree_test::height));
  exec.for_each(pixels, walk_paths{caster, view, camera, collector.view(), seed});
  CHECK(collector.dropped(exec) == 0);
  return collector.samples(exec);
}

WFPG_TEST_CASE("a caster's octree has the leaves that paths see, in built-in scenes", "[renderer][octree]") {
  const Exec exec;
  for (const char* const name : {"cornell-box", "ajar", "glossy-room", "thin-wall"}) {
    INFO(name);
    const render::scene host = render::make_builtin_scene(name);
    const render::device_scene<Exec> device(exec, host);
    const render::bvh_scene<Exec> bvh(exec, host, device.view());
    const auto exact =
        voxels_of(exec, wfpg::voxelize(exec, {device.view().positions, device.view().triangles}, 64));
    wfpg::caster_fragments_options options;
    options.octree_resolution = 64;
    const auto cast = wfpg::fragments_from_caster(exec, bvh.caster(), render::bounds_of(host), options);
    const auto found = voxels_of(exec, cast);
    const auto hits = hits_of_paths(exec, host, device.view(), bvh.caster(), 1);
    const auto seen =
        voxels_of(exec, wfpg::fragments_from_samples(exec, const_view(hits), 64, render::bounds_of(host)));
    std::vector<wfpg::morton_code> leaves, both;
    std::set_intersection(seen.begin(), seen.end(), exact.begin(), exact.end(), std::back_inserter(leaves));
    std::set_intersection(leaves.begin(), leaves.end(), found.begin(), found.end(), std::back_inserter(both));
    CHECK(leaves.size() > 1000);
    CHECK(double(both.size()) > 0.95 * double(leaves.size()));
    CHECK(cast.report.skipped() == 0);
  }
}

WFPG_TEST_CASE("an octree of one sample's hits has the leaves of the next", "[renderer][octree]") {
  const Exec exec;
  for (const char* const name : {"ajar", "glossy-room"}) {
    INFO(name);
    const render::scene host = render::make_builtin_scene(name);
    const render::device_scene<Exec> device(exec, host);
    const render::bvh_scene<Exec> bvh(exec, host, device.view());
    const auto first = hits_of_paths(exec, host, device.view(), bvh.caster(), 1);
    const wfpg::bounds3 box = wfpg::bounds_of_samples(exec, const_view(first));
    const auto next = hits_of_paths(exec, host, device.view(), bvh.caster(), 2).to_host(exec);
    CHECK(next.size() > 50000);
    // Part of the next sample's hits that lie in voxels of the first one's fragments.
    const auto found = [&](const wfpg::voxel_fragments<Exec>& fragments) {
      const std::vector<wfpg::morton_code> voxels = voxels_of(exec, fragments);
      std::size_t n = 0;
      for (const surface_fragment& hit : next) {
        wfpg::uvec3 voxel;
        n += fragments.grid.voxel_of(hit.position, voxel) &&
             std::binary_search(voxels.begin(), voxels.end(), wfpg::morton_encode(voxel));
      }
      return double(n) / double(next.size());
    };
    const double filled = found(wfpg::fragments_from_hits(exec, const_view(first), 128, box));
    const double sparse = found(wfpg::fragments_from_samples(exec, const_view(first), 128, box));
    INFO("of hits " << filled << ", of samples " << sparse);
    CHECK(filled > 0.99);
    CHECK(1.0 - filled < 0.2 * (1.0 - sparse));
  }
}

bool same_bits(const render::image& a, const render::image& b) {
  return a.pixels.size() == b.pixels.size() &&
         std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(vec3)) == 0;
}

render::render_options small_picture(render::octree_source octree) {
  render::render_options options;
  options.width = 24;
  options.height = 16;
  options.spp = 7;
  options.octree_resolution = 32;
  options.kept.budget_bytes = std::size_t(1) << 20;
  options.octree = octree;
  options.keep_state = true;
  return options;
}

/// Whether a state file has --octree, and not only --octree-resolution.
bool names_source(const std::string& state) {
  const std::string option = "--octree";
  for (std::size_t at = state.find(option); at != std::string::npos; at = state.find(option, at + 1))
    if (state[at + option.size()] != '-') return true;
  return false;
}

TEST_CASE("renderings by octrees of all sources are resumed", "[renderer][octree][state]") {
  const temporary_folder folder;
  const render::scene world = render::make_builtin_scene("ajar");
  for (const auto source :
       {render::octree_source::triangles, render::octree_source::caster, render::octree_source::samples})
    for (const int first : {1, 3}) {
      INFO("source " << int(source) << ", stopped after " << first);
      render::render_options options = small_picture(source);
      const render::render_result whole = render::render(world, options, {});
      CHECK(whole.report.octree.leaves > 500);
      int taken = 0;
      options.is_stopped = [&] { return ++taken == first; };
      const render::render_result part = render::render(world, options, {});
      CHECK(part.report.spp == first);
      options.is_stopped = nullptr;
      options.resume = folder.file("state");
      render::write_file(options.resume, part.state);
      CHECK(same_bits(render::render(world, options, {}).picture, whole.picture));
      // Files with the default do not name the option, as those of older versions.
      const bool is_default = source == render::octree_source::triangles;
      CHECK(names_source(part.state) == !is_default);
      options.octree = is_default ? render::octree_source::caster : render::octree_source::triangles;
      CHECK_THROWS_AS(render::render(world, options, {}), wfpg::file_error);
    }
}

/// A rendering of few samples by kept fields.
render::render_result rendered(const char* scene, render::octree_source octree, int spp) {
  render::render_options options = small_picture(octree);
  options.spp = spp;
  return render::render(render::make_builtin_scene(scene), options, {});
}

TEST_CASE("octrees of all sources leave the mean as it is", "[renderer][octree]") {
  for (const auto source :
       {render::octree_source::triangles, render::octree_source::caster, render::octree_source::samples}) {
    const render::render_result furnace = rendered("furnace", source, 64);
    double sum = 0.0;
    for (const vec3 pixel : furnace.picture.pixels) sum += double(pixel.x);
    const double mean = sum / double(furnace.picture.pixels.size());
    INFO("source " << int(source));
    CHECK(furnace.report.slots.live > 0);
    CHECK(mean ==
          Approx(render::furnace_radiance(render::make_builtin_scene("furnace").max_depth)).epsilon(0.01));
  }
}

TEST_CASE("the source decides the octree of a rendering", "[renderer][octree]") {
  const auto leaves = [](render::octree_source source) {
    return double(rendered("ajar", source, 3).report.octree.leaves);
  };
  const double exact = leaves(render::octree_source::triangles);
  const double cast = leaves(render::octree_source::caster);
  CHECK(cast != exact);
  CHECK(cast == Approx(exact).epsilon(0.03));
  const double hit = leaves(render::octree_source::samples);
  CHECK(hit != exact);
  CHECK(hit > 0.9 * exact);
  // 384 pixels hit few voxels, and squares around hits reach beyond edges.
  CHECK(hit < 2.0 * exact);
}

}  // namespace
