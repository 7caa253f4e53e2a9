// Renderings that are interrupted and resumed, and guides that later renderings load.
#include "app/interruption.hpp"
#include "app/output_files.hpp"
#include "app/render.hpp"
#include "app/render_state.hpp"
#include "scene/builtin_scenes.hpp"
#include "scene/scene_checksum.hpp"
#include "support/catch.hpp"
#include "support/renderer_io.hpp"
#include "support/renderings.hpp"
#include "support/section_bytes.hpp"

#include <wfpg/base/error.hpp>

#include <csignal>
#include <cstring>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace render_test;
using namespace render;
using wfpg_test::rendering;

bool same_bits(const image& a, const image& b) {
  return a.pixels.size() == b.pixels.size() &&
         std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(vec3)) == 0;
}

render_options small(const rendering& what, int spp) {
  render_options options = what.options();
  options.width = 24;
  options.height = 16;
  options.spp = spp;
  options.kept.budget_bytes = std::size_t(1) << 18;
  return options;
}

/// A rendering that is stopped after `samples` samples.
render_result stopped(const scene& world, render_options options, int samples) {
  int taken = 0;
  options.keep_state = true;
  options.is_stopped = [&taken, samples] { return ++taken == samples; };
  return render::render(world, options, {});
}

/// The message of an Error that a call throws. Empty if it throws none.
template <class Error = wfpg::file_error>
std::string fault(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("a stopped and resumed rendering gives the same picture", "[renderer][state]") {
  const temporary_folder folder;
  std::vector<rendering> renderings = {
      {"ajar", true, sampling_method::pt},
      {"glossy-room", true, sampling_method::bpt},
      {"materials", true, sampling_method::vcm},
      {"ajar", true, sampling_method::wfpg},
      {"cornell-enclosed", false, sampling_method::wfpg, fields::transient},
      {"many-lamps", true, sampling_method::wfpg},
      {"glossy-room", false, sampling_method::wfpg_product},
      {"glossy-room", true, sampling_method::wfpg_product, fields::transient},
      {"thin-wall", true, sampling_method::wfpg, fields::kept, guiding::plain}};
  for (rendering& what : renderings)
    for (const device where : {device::cpu, device::omp, device::seq}) {
      what.where = where;
      INFO(what.name() << ", device " << int(where));
      const scene world = make_builtin_scene(what.scene);
      render_options options = small(what, 11);
      const render_result whole = render::render(world, options, {});
      CHECK_FALSE(whole.is_stopped);
      CHECK((whole.state.empty() && whole.guide.empty()));

      // Stopped twice, and the second time on another device.
      const render_result first = stopped(world, options, 3);
      CHECK((first.is_stopped && first.report.spp == 3));
      options.resume = folder.file("state");
      render::write_file(options.resume, first.state);
      options.where = where == device::cpu ? device::seq : device::cpu;
      const render_result second = stopped(world, options, 4);
      CHECK((second.is_stopped && second.report.spp == 7));
      render::write_file(options.resume, second.state);
      options.where = where;
      const render_result third = render::render(world, options, {});
      CHECK((!third.is_stopped && third.report.spp == 11));
      CHECK(same_bits(third.picture, whole.picture));
      CHECK(third.report.segments == whole.report.segments);
      CHECK(third.report.light_hits_per_path == whole.report.light_hits_per_path);
      CHECK(third.report.cones_per_segment == whole.report.cones_per_segment);
      CHECK(third.report.slots.live == whole.report.slots.live);
      CHECK(third.report.slots.allocated == whole.report.slots.allocated);
      CHECK_FALSE(same_bits(second.picture, whole.picture));
    }
}

TEST_CASE("resuming a complete rendering adds samples, or does nothing", "[renderer][state]") {
  const temporary_folder folder;
  const scene world = make_builtin_scene("ajar");
  render_options options = small({"ajar"}, 9);
  const render_result whole = render::render(world, options, {});
  options.spp = 4;
  options.keep_state = true;
  const render_result part = render::render(world, options, {});
  options.resume = folder.file("state");
  render::write_file(options.resume, part.state);
  const render_result again = render::render(world, options, {});
  CHECK(again.report.spp == 4);
  CHECK(same_bits(again.picture, part.picture));
  CHECK(again.state == part.state);
  options.spp = 9;
  CHECK(same_bits(render::render(world, options, {}).picture, whole.picture));
  options.spp = 3;
  CHECK(fault<std::invalid_argument>([&] { render::render(world, options, {}); }) ==
        "wfpg: spp is 3, expected no fewer than the rendering to go on with has");
  options.seconds = 0.01;
  CHECK(render::render(world, options, {}).report.spp > 4);
}

TEST_CASE("a signal ends a rendering after the sample in flight", "[renderer][state]") {
  const scene world = make_builtin_scene("ajar");
  for (const int signal : {SIGINT, SIGTERM}) {
    render_options options = small({"ajar"}, 100);
    options.is_stopped = is_interrupted;
    note_interruptions();
    const render_result result = render::render(world, options, [signal](const render_progress& p) {
      if (p.samples == 2) std::raise(signal);
    });
    CHECK((result.is_stopped && result.report.spp == 3));  // sample 2 was reported, and 3 in flight
    // The next signal has the system's own handler again.
    CHECK(std::signal(SIGINT, SIG_DFL) == SIG_DFL);
    CHECK(std::signal(SIGTERM, SIG_DFL) == SIG_DFL);
  }
  note_interruptions();
  CHECK_FALSE(is_interrupted());
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

TEST_CASE("a rendering with other options or another scene does not resume", "[renderer][state]") {
  const temporary_folder folder;
  const scene world = make_builtin_scene("ajar");
  const render_options options = small({"ajar"}, 5);
  const render_result part = stopped(world, options, 2);
  const std::string path = folder.file("state");
  render::write_file(path, part.state);
  const auto refused = [&](const std::string& difference, auto change) {
    render_options other = options;
    other.resume = path;
    change(other);
    CHECK(fault([&] { render::render(world, other, {}); }) ==
          "wfpg: " + path + " was rendered with " + difference);
  };
  refused("--size 24x16, not 24x17", [](render_options& o) { o.height = 17; });
  refused("--max-depth 6, not 7", [](render_options& o) { o.max_depth = 7; });
  refused("--roulette-depth 3, not 4", [](render_options& o) { o.roulette_depth = 4; });
  refused("--seed 0, not 1", [](render_options& o) { o.seed = 1; });
  refused("--nee on, not off", [](render_options& o) { o.nee = false; });
  refused("--method wfpg, not pt", [](render_options& o) { o.method = sampling_method::pt; });
  refused("--combine pt-linear, not linear",
          [](render_options& o) { o.combine = wfpg::sample_combination::linear; });
  refused("--guiding oriented, not plain", [](render_options& o) { o.mode = guiding::plain; });
  refused("--fields kept, not transient", [](render_options& o) { o.lifetime = fields::transient; });
  refused("--octree-resolution 32, not 64", [](render_options& o) { o.octree_resolution = 64; });
  refused("--rays-per-bin 128, not 64", [](render_options& o) { o.binning.rays_per_bin = 64; });
  refused("--min-bin-level 2, not 3", [](render_options& o) { o.binning.min_level = 3; });
  refused("--least-gain 0, not 2", [](render_options& o) {
    o.least_gain = 2.0f;
    o.combine = wfpg::sample_combination::pt_linear;
  });
  refused("--deposits-per-leaf 16, not 8", [](render_options& o) { o.deposits_per_leaf = 8; });
  refused("--guide-fraction 0, not 0.25", [](render_options& o) { o.guide_fraction = 0.25f; });
  refused("--guided-depths 4294967295, not 2", [](render_options& o) { o.guided_depths = 2; });
  refused("--slot-resolution 8, not 16", [](render_options& o) { o.kept.resolution = 16; });
  refused("--recast 4, not 8", [](render_options& o) { o.kept.recast = 8; });
  refused("--learn on, not off", [](render_options& o) { o.kept.learn = false; });
  refused("--field-budget 262144, not 1048576", [](render_options& o) { o.kept.budget_bytes = 1 << 20; });

  render_options same = options;
  same.resume = path;
  const std::string elsewhere = fault([&] { render::render(make_builtin_scene("thin-wall"), same, {}); });
  CHECK(contains(elsewhere, path + " was rendered of scene ajar with checksum "));
  CHECK(contains(elsewhere, ", not of thin-wall with "));
  scene brighter = world;
  for (material& m : brighter.materials) m.emission *= 1.01f;
  CHECK(contains(fault([&] { render::render(brighter, same, {}); }), "was rendered of scene ajar"));
  scene renamed = world;
  renamed.name = "another name";
  CHECK(render::render(renamed, same, {}).report.spp == 5);
}

TEST_CASE("truncated, altered and foreign state files have different errors", "[renderer][state]") {
  const temporary_folder folder;
  const scene world = make_builtin_scene("ajar");
  render_options options = small({"ajar"}, 5);
  const std::string bytes = stopped(world, options, 2).state;
  options.resume = folder.file("state");
  const auto refused = [&](const std::string& content, const std::string& reason) {
    folder.write("state", content);
    const std::string message = fault([&] { render::render(world, options, {}); });
    INFO(message << " against " << reason);
    CHECK(contains(message, "wfpg: " + options.resume));
    CHECK(contains(message, reason));
  };
  CHECK(fault([&] { render::render(world, options, {}); }) ==
        "wfpg: " + options.resume + " cannot be opened");
  refused("OpenEXR", "is not a rendering's state file");
  refused(wfpg_test::with_version(bytes, 9), "is of version 9, expected 1 or older: a newer wfpg wrote it");
  refused(bytes + "x", "goes on after its end");
  for (const wfpg_test::section_place& place : wfpg_test::sections_of(bytes)) {
    refused(bytes.substr(0, place.payload + place.size), "section " + place.name);
    std::string altered = bytes;
    altered[place.payload + place.size / 2] ^= 1;
    refused(altered, "the checksum of section " + place.name + " differs");
  }
  using wfpg_test::with_number;
  refused(with_number(bytes, "film", 0, 4, 0), "section film has a number of samples out of range");
  refused(with_number(bytes, "film", 4, 8, ~0ull), "section film has a weight out of range");
  refused(with_number(bytes, "guide", 0, 8, ~0ull), "section guide is too short");
  refused(wfpg_test::with_payload(bytes, "guide", std::string(8, '\0')), ": its guide is not a guide file");
  std::string guide = wfpg_test::payload_of(bytes, "guide");
  guide[guide.size() / 2] ^= 1;
  refused(wfpg_test::with_payload(bytes, "guide", guide), ": its guide is altered: the checksum of section ");

  options.resume.clear();
  options.load_guide = folder.write("guide", bytes);
  CHECK(fault([&] { render::render(world, options, {}); }) ==
        "wfpg: " + options.load_guide + " is not a guide file");
}

TEST_CASE("a rendering can begin with the guide of another one", "[renderer][state]") {
  const temporary_folder folder;
  const scene world = make_builtin_scene("ajar");
  for (const fields lifetime : {fields::kept, fields::transient}) {
    render_options options = small({"ajar", true, sampling_method::wfpg, lifetime}, 12);
    options.keep_guide = true;
    const render_result teacher = render::render(world, options, {});
    CHECK(teacher.state.empty());
    options.keep_guide = false;
    options.spp = 1;
    options.width = 32;
    options.seed = 5;
    const render_result cold = render::render(world, options, {});
    CHECK(cold.report.cones_per_segment == 0.0);
    options.load_guide = folder.file("guide");
    render::write_file(options.load_guide, teacher.guide);
    CHECK(combination_of(options) == wfpg::sample_combination::constant);
    const render_result warm = render::render(world, options, {});
    CHECK(warm.report.spp == 1);
    CHECK(warm.report.cones_per_segment > 0.0);
    // Counts of the other rendering are not included.
    CHECK(warm.report.cones_per_segment < 3.0 * teacher.report.cones_per_segment);
    CHECK_FALSE(same_bits(warm.picture, cold.picture));

    options.spp = 5;
    const render_result whole = render::render(world, options, {});
    render::write_file(folder.file("state"), stopped(world, options, 2).state);
    render_options rest = options;
    rest.load_guide.clear();
    rest.resume = folder.file("state");
    rest.combine = combination_of(options);
    double begun = 0.0;
    const auto progress = [&begun](const render_progress& p) { begun = p.begun; };
    CHECK(same_bits(render::render(world, rest, progress).picture, whole.picture));
    CHECK(begun == Approx(0.4));
    scene turned = world;  // another camera: the same light
    turned.view.position += vec3(0.01f);
    CHECK(fault([&] { render::render(turned, options, {}); }).empty());
    options.octree_resolution = 64;
    CHECK(contains(fault([&] { render::render(world, options, {}); }), "option octree_resolution 32"));
    options.octree_resolution = 32;
    CHECK(contains(fault([&] { render::render(make_builtin_scene("cornell-box"), options, {}); }),
                   folder.file("guide") + " is of another scene: it was saved with scene_tag "));
  }
}

TEST_CASE("guides and states need a method that can save them", "[renderer][state]") {
  const scene world = make_builtin_scene("ajar");
  const auto refused = [&](sampling_method method, auto change, const std::string& expected) {
    render_options options = small({"ajar"}, 1);
    options.method = method;
    change(options);
    CHECK(contains(fault<std::invalid_argument>([&] { render::render(world, options, {}); }), expected));
  };
  refused(
      sampling_method::pt, [](render_options& o) { o.load_guide = "a"; }, "method is pt, expected wfpg or");
  refused(
      sampling_method::pt, [](render_options& o) { o.keep_guide = true; }, "method is pt, expected wfpg or");
  refused(
      sampling_method::openpgl_dqt, [](render_options& o) { o.keep_state = true; },
      "method is openpgl-dqt, expected pt, vpt, bpt, vcm, upbp, lt, wfpg or");
  refused(
      sampling_method::openpgl_vmm, [](render_options& o) { o.resume = "a"; },
      "method is openpgl-vmm, expected pt, vpt, bpt, vcm, upbp, lt, wfpg or");
  refused(
      sampling_method::sarsa, [](render_options& o) { o.keep_state = true; },
      "method is sarsa, expected pt, vpt, bpt, vcm, upbp, lt, wfpg or");
  refused(
      sampling_method::wfpg, [](render_options& o) { o.load_guide = o.resume = "a"; },
      "load_guide is a, expected none");
}

TEST_CASE("scenes that look different have different checksums", "[renderer][state]") {
  const scene world = make_builtin_scene("glossy-room");
  const std::uint64_t sum = checksum_of(world);
  CHECK(checksum_of(make_builtin_scene("glossy-room")) == sum);
  const std::vector<std::function<void(scene&)>> changes = {
      [](scene& s) { s.positions[3].y += 0.001f; },
      [](scene& s) {
        s.triangles[1] = {s.triangles[1].y, s.triangles[1].z, s.triangles[1].x};
      },
      [](scene& s) { s.triangle_materials[0] ^= 1; },
      [](scene& s) { s.materials[0].absorption.z = 1.0f; },
      [](scene& s) { s.materials[0].scattering.x = 1.0f; },
      [](scene& s) { s.materials[0].priority = -1; },
      [](scene& s) { s.fog.absorption.y = 0.5f; },
      [](scene& s) { s.fog.scattering.y = 0.5f; },
      [](scene& s) { s.materials[0].kind = material_kind::mirror; },
      [](scene& s) { s.materials[0].base_texture.offset.x = 0.5f; },
      [](scene& s) {
        s.textures.push_back({1, 1, {vec4(1.0f)}});
      },
      [](scene& s) { s.punctual_lights.emplace_back(); },
      [](scene& s) { s.normals.assign(s.positions.size(), vec3(0, 0, 1)); },
      [](scene& s) { s.uvs.assign(s.positions.size(), wfpg::vec2(0.0f)); },
      [](scene& s) { s.view.vertical_fov += 0.01f; },
      [](scene& s) { s.environment.x = 1.0f; },
      [](scene& s) {
        s.sky = {1, 1, {vec3(1.0f)}};
      }};
  for (const auto& change : changes) {
    scene other = world;
    change(other);
    CHECK(checksum_of(other) != sum);
  }
}
