// The SARSA grid: densities of its samplers, what it learns from a path, options. test_sarsa_grid_light.cpp
// tests its convergence and the means of pictures.
#include "support/catch.hpp"
#include "support/sarsa.hpp"
#include "support/statistics.hpp"

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace {

using namespace wfpg_test;
using wfpg::sarsa_grid_options;
using wfpg::sarsa_sampler;
using wfpg::sarsa_update;

const vec3 place(0.4f, 0.6f, 0.3f);
const vec3 spot = glm::normalize(vec3(0.3f, 0.8f, -0.4f));

/// A grid that has learnt the light at `place`.
template <class Exec>
sarsa_guider<Exec> taught(const Exec& exec, sarsa_sampler sampler, const bright_spot& light,
                          std::uint32_t samples = 2) {
  sarsa_grid_options options = sarsa_options(20000);
  options.sampler = sampler;
  const box_mesh<Exec> mesh(exec);
  sarsa_guider<Exec> guider(exec, mesh.view(), options);
  for (std::uint32_t i = 0; i < samples; ++i) teach(exec, guider, place, light);
  return guider;
}

struct draw_directions {
  wfpg::sarsa_grid_view view;
  vec3 normal;
  bool transmits;
  WFPG_HD drawn_direction operator()(std::size_t i) const {
    drawn_direction drawn;
    const vec2 u = hashed_numbers{7}(static_cast<std::uint32_t>(i), 0);
    drawn.direction = view.distribution(place_of(), normal, transmits).sample(u, drawn.pdf);
    return drawn;
  }
  WFPG_HD static vec3 place_of() { return {0.4f, 0.6f, 0.3f}; }
};
struct density_of_direction {
  wfpg::sarsa_grid_view view;
  vec3 normal;
  bool transmits;
  WFPG_HD float operator()(vec3 d) const {
    return view.distribution(draw_directions::place_of(), normal, transmits).pdf(d);
  }
};

/// Normals along axes, where the lattice has one, and between.
const std::vector<vec3>& test_normals() {
  static const std::vector<vec3> list = {{0, 1, 0},
                                         {0, 0, -1},
                                         glm::normalize(vec3(0.5f, 0.7f, -0.3f)),
                                         glm::normalize(vec3(-0.71f, -0.13f, 0.36f)),
                                         -spot};
  return list;
}

WFPG_TEST_CASE("sarsa grid: densities integrate to one and match the frequencies", "[sarsa]") {
  const Exec exec;
  chi_square_family family;
  for (const sarsa_sampler sampler : sarsa_samplers) {
    const sarsa_guider<Exec> guider = taught(exec, sampler, {spot});
    for (const vec3 normal : test_normals())
      for (const bool transmits : {false, true}) {
        if (transmits && normal != test_normals()[0]) continue;
        const std::string name = std::string(name_of(sampler)) + (transmits ? ", sphere" : "") + ", normal " +
                                 std::to_string(normal.x) + " " + std::to_string(normal.y) + " " +
                                 std::to_string(normal.z);
        INFO(name);
        const auto drawn = evaluate(exec, 8000, draw_directions{guider.guide().view(), normal, transmits});
        sampler_check_options options;
        options.moments = false;
        const auto report = check_sampler(
            drawn, densities_by{exec, density_of_direction{guider.guide().view(), normal, transmits}},
            options);
        CHECK(report);
        INFO(report.message);
        family.add(report.frequencies, name);
      }
  }
  INFO(family.message());
  CHECK(family.size() == 4 * 6);
  CHECK(family.accepted());
}

WFPG_TEST_CASE("sarsa grid: samplers of the hemisphere sample nothing below the surface", "[sarsa]") {
  const Exec exec;
  random_numbers random(5);
  for (const sarsa_sampler sampler : sarsa_samplers) {
    INFO(name_of(sampler));
    const sarsa_guider<Exec> guider = taught(exec, sampler, {spot});
    std::size_t below = 0, all = 0;
    double density_below = 0.0;
    for (int i = 0; i < 20; ++i) {
      const vec3 normal = random.direction();
      const density_of_direction density{guider.guide().view(), normal, false};
      for (const drawn_direction& d :
           evaluate(exec, 2000, draw_directions{guider.guide().view(), normal, false})) {
        below += glm::dot(normal, d.direction) < 0.0f ? 1 : 0;
        ++all;
      }
      vec3 down = random.direction();
      if (glm::dot(down, normal) > 0.0f) down = -down;
      density_below += double(evaluate(exec, std::vector<vec3>{down}, density)[0]);
    }
    if (sampler == sarsa_sampler::sphere_inversion) {
      CHECK(below > all / 4);
      CHECK(density_below > 0.0);
    } else {
      CHECK(below == 0);
      CHECK(density_below == 0.0);
    }
  }
}

WFPG_TEST_CASE("sarsa grid: samplers find a bright spot, with the optimal fraction", "[sarsa]") {
  const Exec exec;
  const bright_spot light{spot};
  double fractions[4];
  for (const sarsa_sampler sampler : sarsa_samplers) {
    const sarsa_guider<Exec> guider = taught(exec, sampler, light);
    int hits = 0;
    for (const drawn_direction& d :
         evaluate(exec, 20000, draw_directions{guider.guide().view(), {0, 1, 0}, false}))
      hits += light(d.direction) > 10.0f ? 1 : 0;
    fractions[int(sampler)] = hits / 20000.0;
  }
  // The spot covers 1/20 of the sphere. Uniform directions above the surface hit it with 1/10.
  CHECK(fractions[0] > 0.3);
  CHECK(fractions[1] > 0.5);
  CHECK(fractions[2] == Approx(fractions[1]).margin(0.02));
  CHECK(fractions[3] < fractions[2] - 0.1);
  CHECK(fractions[3] > 0.5 * fractions[2]);  // eps is 1/2 at most
}

WFPG_TEST_CASE("sarsa grid: under uniform light samplers of the hemisphere sample the cosine", "[sarsa]") {
  const Exec exec;
  const vec3 normal(0.0f, 1.0f, 0.0f);
  for (const sarsa_sampler sampler : {sarsa_sampler::hemisphere_inversion, sarsa_sampler::rejection}) {
    const sarsa_guider<Exec> guider = taught(exec, sampler, {spot, 2.0f});  // no spot is so narrow
    double high = 0.0;
    for (const drawn_direction& d :
         evaluate(exec, 20000, draw_directions{guider.guide().view(), normal, false}))
      high += glm::dot(d.direction, normal) > 0.5f ? 1.0 / 20000.0 : 0.0;
    INFO(name_of(sampler));
    CHECK(high == Approx(0.75).margin(0.05));  // 0.5 without the cosine
  }
}

WFPG_TEST_CASE("sarsa grid: reruns give the same bits", "[sarsa]") {
  const Exec exec;
  for (const sarsa_update update : sarsa_updates) {
    std::vector<std::vector<float>> pictures;
    for (int run = 0; run < 2; ++run) {
      sarsa_grid_options options = sarsa_options(512);
      options.update = update;
      const box_mesh<Exec> mesh(exec);
      sarsa_guider<Exec> guider(exec, mesh.view(), options);
      pictures.push_back(trace_paths(exec, guider, 6, 512, box_caster()));
    }
    CHECK(pictures[0] == pictures[1]);
  }
}

/// A hand-written path of three surfaces. It attenuates by 0.5 at the second, where light is.
struct write_path {
  wfpg::path_recorder_view recorder;
  WFPG_HD void operator()(std::size_t) const {
    const vec3 y(0.0f, 1.0f, 0.0f), x(1.0f, 0.0f, 0.0f);
    recorder.vertex(0, 0, vec3(0.1f, 0.1f, 0.1f), y, vec3(1.0f));
    recorder.vertex(0, 1, vec3(0.1f, 0.9f, 0.1f), -y, vec3(0.8f));
    recorder.emission(0, 1, vec3(0.8f * 2.0f));
    recorder.radiance(0, 1, vec3(0.8f * 1.0f));
    recorder.vertex(0, 2, vec3(0.9f, 0.9f, 0.1f), -x, vec3(0.4f));
    recorder.emission(0, 2, vec3(0.4f * 6.0f));
  }
};

struct known_radiance {
  wfpg::sarsa_grid_view view;
  vec3 position, direction;
  WFPG_HD float operator()() const { return view.radiance(position, direction); }
};

/// The learnt radiance at the path's first two vertices, along its directions.
template <class Exec>
std::pair<float, float> known(const Exec& exec, const sarsa_guider<Exec>& guider) {
  const wfpg::sarsa_grid_view view = guider.guide().view();
  return {evaluate(exec, known_radiance{view, {0.1f, 0.1f, 0.1f}, {0, 1, 0}}),
          evaluate(exec, known_radiance{view, {0.1f, 0.9f, 0.1f}, {1, 0, 0}})};
}

template <class Exec>
void sample_of_one_path(const Exec& exec, sarsa_guider<Exec>& guider) {
  guider.begin_sample();
  exec.for_each(1, write_path{guider.recorder()});
  guider.end_sample();
}

WFPG_TEST_CASE("sarsa grid: a path teaches Eq. 6 and 7 at the end of a step", "[sarsa]") {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  for (const sarsa_update update : {sarsa_update::sarsa, sarsa_update::monte_carlo}) {
    INFO(name_of(update));
    sarsa_grid_options options = sarsa_options(1);
    options.update = update;
    options.step = 2;
    options.learning_rate = 0.25f;
    sarsa_guider<Exec> guider(exec, mesh.view(), options);
    sample_of_one_path(exec, guider);
    CHECK(known(exec, guider) == std::pair<float, float>(0.0f, 0.0f));  // not yet
    sample_of_one_path(exec, guider);
    // 2 emitted, 1 scattered from a light, and half of the 6 from the third vertex.
    const bool bootstraps = update == sarsa_update::sarsa;
    CHECK(known(exec, guider).first == Approx(bootstraps ? 3.0f : 6.0f));
    CHECK(known(exec, guider).second == Approx(6.0f));
    for (int sample = 0; sample < 2; ++sample) sample_of_one_path(exec, guider);
    CHECK(known(exec, guider).first == Approx(bootstraps ? (2 * 3.0f + 2 * 6.0f) / 4.0f : 6.0f));
    for (int sample = 0; sample < 2; ++sample) sample_of_one_path(exec, guider);
    // After four values, the fifth and the sixth have a weight of a quarter each.
    CHECK(known(exec, guider).first ==
          Approx(bootstraps ? 4.5f + (6.0f - 4.5f) * (1.0f - 0.75f * 0.75f) : 6.0f));
    guider.forget_light();
    CHECK(known(exec, guider) == std::pair<float, float>(0.0f, 0.0f));
  }
}

/// A white Lambertian surface at a place with known light: eval is 0.8 cos / pi.
WFPG_TEST_CASE("sarsa grid: expected SARSA sums over all directions of the next surface", "[sarsa]") {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  sarsa_grid_options options = sarsa_options(20000);
  options.update = sarsa_update::expected_sarsa;
  sarsa_guider<Exec> guider(exec, mesh.view(), options);
  const vec3 first(0.1f, 0.1f, 0.1f);
  teach(exec, guider, place, bright_spot{spot, 2.0f});  // no spot: 0.3 + 0.2 x y
  // A path that hits the place and continues along a sampled direction.
  guider.begin_sample();
  const std::vector<test_surface> surfaces(1, make_surface(place, {0, 1, 0}, {0, 1, 0}));
  const wave_of_surfaces<Exec> wave(exec, surfaces);
  const wfpg::buffer<wfpg::sampled_direction, Exec> drawn(exec, 1);
  guider.sample_directions(wave.get(), box_caster(), drawn.view());
  for (std::uint64_t seed = 1; drawn.to_host(exec)[0].field == wfpg::no_field && seed < 100; ++seed)
    guider.sample_directions(wave_of_surfaces<Exec>(exec, surfaces, 0, seed).get(), box_caster(),
                             drawn.view());
  const wfpg::path_recorder_view recorder = guider.recorder();
  const wfpg::array_view<wfpg::sampled_direction> next = drawn.view();
  exec.for_each(1, [=] WFPG_HD(std::size_t) {
    const vec3 y(0.0f, 1.0f, 0.0f);
    const vec3 there(0.4f, 0.6f, 0.3f);
    recorder.vertex(0, 0, vec3(0.1f, 0.1f, 0.1f), y, vec3(1.0f));
    recorder.vertex(0, 1, there, y, vec3(1.0f));
    recorder.emission(0, 1, vec3(5.0f));
    recorder.scatter(0, 1, next[0]);
    recorder.vertex(0, 2, there + 0.2f * next[0].direction, -next[0].direction, vec3(123.0f));
  });
  guider.end_sample();
  // The integral of (0.3 + 0.2 x y) 0.8 cos / pi over the hemisphere is 0.24.
  CHECK(evaluate(exec, known_radiance{guider.guide().view(), first, {0, -1, 0}}) ==
        Approx(5.24f).epsilon(0.01));
}

/// A path that leaves the scene from its first surface, along a direction that no field sampled.
struct leave_scene {
  wfpg::path_recorder_view recorder;
  WFPG_HD void operator()(std::size_t) const {
    const vec3 y(0.0f, 1.0f, 0.0f);
    recorder.vertex(0, 0, vec3(0.1f, 0.1f, 0.1f), y, vec3(1.0f));
    recorder.scatter(0, 0, {y, 1.0f, wfpg::sampling_technique::bsdf, {}, wfpg::no_field});
    recorder.escape(0, 1, vec3(0.5f));
    recorder.emission(0, 1, vec3(0.5f * 7.0f));
  }
};

WFPG_TEST_CASE("sarsa grid: it learns the environment as it learns surfaces", "[sarsa]") {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  for (const sarsa_update update : sarsa_updates) {
    sarsa_grid_options options = sarsa_options(1);
    options.update = update;
    sarsa_guider<Exec> guider(exec, mesh.view(), options);
    guider.begin_sample();
    exec.for_each(1, leave_scene{guider.recorder()});
    guider.end_sample();
    CHECK(known(exec, guider).first == Approx(7.0f));
  }
}

struct bad_option {
  const char* name;
  std::function<void(sarsa_grid_options&)> spoil;
};

WFPG_TEST_CASE("sarsa grid: options out of range are named", "[sarsa]") {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  const bad_option bad_options[] = {{"resolution", [](auto& o) { o.resolution = 0; }},
                                    {"resolution", [](auto& o) { o.resolution = 65; }},
                                    {"direction_resolution", [](auto& o) { o.direction_resolution = 7; }},
                                    {"direction_resolution", [](auto& o) { o.direction_resolution = 66; }},
                                    {"normal_resolution", [](auto& o) { o.normal_resolution = 0; }},
                                    {"step", [](auto& o) { o.step = 0; }},
                                    {"learning_rate", [](auto& o) { o.learning_rate = 1.5f; }},
                                    {"learning_rate", [](auto& o) { o.learning_rate = std::nanf(""); }},
                                    {"floor", [](auto& o) { o.floor = -1.0f; }},
                                    {"guide_fraction", [](auto& o) { o.guide_fraction = 2.0f; }}};
  for (const bad_option& bad : bad_options) {
    sarsa_grid_options options = sarsa_options(10);
    bad.spoil(options);
    const std::string message = refusal([&] { sarsa_guider<Exec>(exec, mesh.view(), options); });
    INFO("expected: " << bad.name << ", message: " << message);
    CHECK(message.find(bad.name) != std::string::npos);
  }
}

WFPG_TEST_CASE("sarsa grid: memory is reported, and it guides without paths or extent", "[sarsa]") {
  counting_resource resource;
  const Exec exec = Exec().with_resource(&resource);
  const box_mesh<Exec> mesh(exec);
  const std::size_t before = resource.bytes_in_use;
  {
    sarsa_guider<Exec> guider(exec, mesh.view(), sarsa_options(500));
    trace_paths(exec, guider, 2, 500, box_caster());
    const std::size_t held = resource.bytes_in_use - before;
    CHECK(guider.memory().persistent() + guider.memory().transient() == held);
    const std::size_t allocations = resource.allocations;
    trace_paths(exec, guider, 1, 500, box_caster());
    CHECK(resource.allocations - allocations <= (loops_on_host ? 3 : 7));  // the test's own
  }
  sarsa_grid_options without_paths = sarsa_options(0);
  without_paths.max_rays = 500;
  sarsa_guider<Exec> untaught(exec, mesh.view(), without_paths);
  for (const float value : trace_paths(exec, untaught, 2, 500, box_caster())) CHECK(value >= 0.0f);
  CHECK(known(exec, untaught) == std::pair<float, float>(0.0f, 0.0f));
  for (const wfpg::bounds3& bounds : {wfpg::bounds3{}, wfpg::bounds3{vec3(0.5f), vec3(0.5f)}}) {
    sarsa_guider<Exec> guider(exec, bounds, sarsa_options(500));
    CHECK(trace_paths(exec, guider, 2, 500, box_caster()).size() == 1000);
  }
}

}  // namespace
