// What path_guider requires of guides, tested with the guide of docs/guides.md.
#include "pages/uniform_guide.hpp"
#include "support/estimates.hpp"
#include "support/guiding.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

/// A view without pdf(). Outside of the namespace below, where nvcc warns about unused functions.
struct without_pdf {
  template <class Bsdf>
  WFPG_HD wfpg::sampled_direction sample(std::uint32_t, const wfpg::surface<Bsdf>&, float, wfpg::vec2) const {
    return {};
  }
};

namespace {

using namespace wfpg_test;
using wfpg::sampled_direction;
using wfpg::sampling_technique;

// Guides that each lack one thing.
template <class Exec>
struct without_options : uniform_guide<Exec> {
  using uniform_guide<Exec>::uniform_guide;
  using options_type = int;
};
template <class Exec>
struct without_mesh : uniform_guide<Exec> {
  explicit without_mesh(const Exec& exec) : uniform_guide<Exec>(exec, exec, {}, {}) {}
};
template <class Exec>
struct without_view : uniform_guide<Exec> {
  using uniform_guide<Exec>::uniform_guide;
  using view_type = without_pdf;
};
template <class Exec>
struct without_memory : uniform_guide<Exec> {
  using uniform_guide<Exec>::uniform_guide;
  void memory() const {}
};

/// A guide that records fewer samples after warm-up, and logs what it is told of each.
template <class Exec>
struct with_stride : uniform_guide<Exec> {
  using uniform_guide<Exec>::uniform_guide;
  std::vector<std::size_t> recorded;       // paths, in each update that could learn
  std::vector<std::uint32_t> learnt_from;  // samples
  std::vector<std::uint32_t> said;         // samples that update() is told are recorded
  std::uint32_t updates = 0;

  wfpg::recording_needs recording() const { return {1, false, 4}; }
  void learn(const wfpg::sample_context<Exec>& at, const wfpg::path_recorder<Exec>& paths) {
    recorded.push_back(paths.recorded());
    learnt_from.push_back(at.number);
  }
  void update(const wfpg::sample_context<Exec>& at) {
    ++updates;
    if (at.recorded) said.push_back(at.number);
  }
  void forget_light(const Exec&) {}
};
template <class Exec>
struct with_zero_stride : with_stride<Exec> {
  using with_stride<Exec>::with_stride;
  wfpg::recording_needs recording() const { return {1, false, 0}; }
};

/// A guide that logs which samples are guided, before their waves.
template <class Exec>
struct with_notes : uniform_guide<Exec> {
  using uniform_guide<Exec>::uniform_guide;
  std::vector<bool> guided;

  void begin_sample(const wfpg::sample_context<Exec>& at) { guided.push_back(at.guided); }
};

/// A guide that records no paths.
template <class Exec>
struct without_paths : uniform_guide<Exec> {
  using uniform_guide<Exec>::uniform_guide;
  static constexpr bool records_paths = false;
};

WFPG_TEST_CASE("a guide has options, a mesh constructor, a view, and learns", "[guide]") {
  using guide = uniform_guide<Exec>;
  CHECK(wfpg::is_guide_v<guide, Exec>);
  CHECK(wfpg::is_guide_v<either_guide<Exec>, Exec>);
  CHECK(wfpg::is_guide_view_v<wfpg::guide_view>);
  CHECK(wfpg::is_guide_view_v<uniform_view>);
  CHECK(!wfpg::is_guide_v<without_options<Exec>, Exec>);
  CHECK(!wfpg::is_guide_v<without_mesh<Exec>, Exec>);
  CHECK(!wfpg::is_guide_view_v<without_pdf>);
  CHECK(!wfpg::is_guide_v<without_view<Exec>, Exec>);
  CHECK(!wfpg::is_guide_v<without_memory<Exec>, Exec>);
}

/// Which of 100 samples are recorded, if light is forgotten after some of them.
template <class Exec>
std::vector<std::uint32_t> recorded_samples(std::uint64_t seed, std::uint32_t forgotten_after) {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  wfpg::sampling_options options;
  options.max_paths = 1024;
  options.seed = seed;
  wfpg::path_guider<Exec, with_stride<Exec>> guider(exec, mesh.view(), options);
  for (std::uint32_t sample = 1; sample <= 100; ++sample) {
    guider.begin_sample();
    guider.end_sample();
    if (sample == forgotten_after) guider.forget_light();
  }
  const with_stride<Exec>& guide = guider.guide();
  CHECK(guide.updates == 100);
  CHECK(guide.said == guide.learnt_from);
  CHECK(guide.recorded == std::vector<std::size_t>(guide.learnt_from.size(), 512));
  return guide.learnt_from;
}

/// How many samples are in [first, last].
std::ptrdiff_t count_between(const std::vector<std::uint32_t>& samples, std::uint32_t first,
                             std::uint32_t last) {
  return std::count_if(samples.begin(), samples.end(),
                       [=](std::uint32_t s) { return s >= first && s <= last; });
}

WFPG_TEST_CASE("after warm-up one sample in so many is recorded, if a guide asks for it", "[guide]") {
  const auto samples = recorded_samples<Exec>(7, 0), others = recorded_samples<Exec>(8, 0);
  CHECK(count_between(samples, 1, 32) == 32);
  for (std::uint32_t first = 33; first < 100; first += 4)
    CHECK(count_between(samples, first, first + 3) == 1);
  for (std::uint32_t offset = 0; offset < 4;
       ++offset)  // no fixed position of a host's own cycle is always left out
    CHECK(std::any_of(samples.begin() + 32, samples.end(), [=](std::uint32_t s) { return s % 4 == offset; }));
  CHECK(samples != others);

  const auto forgotten = recorded_samples<Exec>(7, 50);
  CHECK(count_between(forgotten, 1, 50) == count_between(samples, 1, 50));
  CHECK(count_between(forgotten, 51, 82) == 32);
  CHECK(count_between(forgotten, 85, 100) == 4);
}

WFPG_TEST_CASE("a sample_stride of 0 is refused", "[guide]") {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  CHECK_THROWS_WITH((wfpg::path_guider<Exec, with_zero_stride<Exec>>(exec, mesh.view())),
                    "wfpg: sample_stride is 0, expected at least 1");
}

TEST_CASE("recorded_fraction() records enough paths for the wanted vertices, at most twice", "[guide]") {
  const auto needs = [](std::size_t paths, std::uint64_t wanted) {
    wfpg::sampling_options options;
    options.max_paths = paths;
    options.max_depth = 4;
    return wfpg::detail::recorded_fraction(options, wanted).needs(true);
  };
  const auto is = [](const wfpg::recording_needs& n, std::uint32_t shift, std::uint32_t stride) {
    return n.directions && n.fraction_shift == shift && n.sample_stride == stride;
  };
  CHECK(is(needs(1000, 0), 0, 1));       // no number wanted: all
  CHECK(is(needs(1000, 128001), 0, 2));  // 4000 are few
  CHECK(is(needs(1000, 128000), 0, 4));
  CHECK(is(needs(1000, 4000), 0, 4));
  CHECK(is(needs(1000, 2004), 0, 4));
  CHECK(is(needs(1000, 2000), 1, 4));
  CHECK(is(needs(1000000, 2000), 10, 4));
  CHECK(is(needs(8, 7), 2, 4));
  CHECK(is(needs(1000, 3), 10, 4));
}

/// A guider in its n-th sample.
template <class Exec>
uniform_guider<Exec> guider_in_sample(const Exec& exec, const box_mesh<Exec>& mesh, std::uint32_t n) {
  uniform_guider<Exec> guider = make_guider(exec, mesh.view(), 4096);
  for (std::uint32_t sample = 0; sample < n; ++sample) {
    guider.begin_sample();
    if (sample + 1 < n) guider.end_sample();
  }
  return guider;
}

template <class Exec>
std::vector<sampled_direction> draw(const Exec& exec, uniform_guider<Exec>& guider,
                                    const std::vector<test_surface>& surfaces, std::uint32_t depth = 0) {
  const wave_of_surfaces<Exec> wave(exec, surfaces, depth);
  const wfpg::buffer<sampled_direction, Exec> directions(exec, surfaces.size());
  guider.sample_directions(wave.get(), box_caster(), directions.view());
  return directions.to_host(exec);
}

template <class Exec>
struct density_of_view {
  uniform_view view;
  wfpg::array_view<const test_surface> surfaces;
  wfpg::array_view<const sampled_direction> drawn;
  WFPG_HD float operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    return surfaces[i].active ? view.pdf(ray, surfaces[i], drawn[i].direction) : 0.0f;
  }
};

struct direction_of {
  wfpg::array_view<const sampled_direction> drawn;
  WFPG_HD vec3 operator()(std::uint32_t ray) const { return drawn[ray].direction; }
};

WFPG_TEST_CASE("a guide is told at a sample's beginning whether it guides", "[guide]") {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  wfpg::sampling_options options;
  options.max_paths = 16;
  options.unguided_samples = 2;
  wfpg::path_guider<Exec, with_notes<Exec>> guider(exec, mesh.view(), options);
  for (int sample = 0; sample < 4; ++sample) {
    guider.begin_sample();
    CHECK(guider.guided() == guider.guide().guided.back());
    guider.end_sample();
  }
  CHECK(guider.guide().guided == std::vector<bool>{false, false, true, true});
}

WFPG_TEST_CASE("guide_fraction is the guide's fraction, after the samples that only record", "[guide]") {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  const auto surfaces = wall_surfaces(4096, 3);
  uniform_guider<Exec> first = guider_in_sample(exec, mesh, 1), second = guider_in_sample(exec, mesh, 2);
  CHECK(!first.guided());
  CHECK(second.guided());
  for (const sampled_direction& d : draw(exec, first, surfaces))
    CHECK(d.technique == sampling_technique::bsdf);
  double guided = 0.0, below = 0.0;
  const auto drawn = draw(exec, second, surfaces);
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    if (drawn[i].technique != sampling_technique::guide) continue;
    guided += 1.0;
    below += glm::dot(drawn[i].direction, surfaces[i].normal) < 0.0f ? 1.0 : 0.0;
  }
  CHECK(std::abs(guided / 4096.0 - 0.3) < 4.0 * std::sqrt(0.3 * 0.7 / 4096.0));
  CHECK(std::abs(below / guided - 0.5) < 4.0 * 0.5 / std::sqrt(guided));
}

WFPG_TEST_CASE("rays deeper than guided_depths sample their BSDF, with the octree's guide too", "[guide]") {
  const auto surfaces = wall_surfaces(700, 3);
  for (wfpg::guiding_mode mode : {wfpg::guiding_mode::oriented, wfpg::guiding_mode::plain})
    for (field_lifetime lifetime : lifetimes)
      for (std::uint32_t products : {0u, 4u}) {
        guider_options options = box_options(mode, lifetime);
        options.product_resolution = unless_zero(products);
        options.guided_depths = 2;
        guided_box<Exec> box(options);
        box.learn();
        for (std::uint32_t depth : {0u, 1u, 2u, 5u}) {
          int guided = 0;
          for (const sampled_direction& d : box.sample(surfaces, box_caster{}, 1, depth))
            guided += d.technique == sampling_technique::guide;
          INFO(name_of(lifetime) << ", P " << products << ", depth " << depth);
          CHECK((guided > 0) == (depth < 2));
          const wave_of_surfaces<Exec> wave(box.exec, surfaces, depth);
          const wfpg::guide_view view = box.guider.prepare(wave.get(), box_caster());
          CHECK((count_guided(box.exec, view, surfaces.size()) > 0) == (depth < 2));
        }
      }
}

WFPG_TEST_CASE("rays deeper than guided_depths have the density of their BSDF", "[guide]") {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  const auto surfaces = wall_surfaces(4096, 3);
  wfpg::sampling_options options;
  options.max_paths = surfaces.size();
  options.unguided_samples = 0;
  options.guided_depths = 2;
  uniform_guider<Exec> guider(exec, mesh.view(), options);
  guider.begin_sample();
  for (std::uint32_t depth = 0; depth < 4; ++depth) {
    int guided = 0;
    const auto drawn = draw(exec, guider, surfaces, depth);
    const std::vector<float> densities = bsdf_densities(exec, surfaces, drawn);
    for (std::size_t i = 0; i < drawn.size(); ++i) {
      guided += drawn[i].technique == sampling_technique::guide;
      if (depth < 2 || drawn[i].technique != sampling_technique::bsdf) continue;
      REQUIRE(drawn[i].pdf == Approx(densities[i]).epsilon(1e-5));
    }
    INFO("depth " << depth);
    CHECK((guided > 0) == (depth < 2));
  }
}

WFPG_TEST_CASE("a guide's view reports the densities of its directions, also in queries", "[guide]") {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  const auto surfaces = mixed_surfaces(1000, 5);
  uniform_guider<Exec> guider = guider_in_sample(exec, mesh, 2);
  const wfpg::buffer<sampled_direction, Exec> drawn(exec, draw(exec, guider, surfaces));
  const wfpg::buffer<test_surface, Exec> stored(exec, surfaces);
  const wave_of_surfaces<Exec> wave(exec, surfaces);
  const uniform_view view = guider.prepare(wave.get(), box_caster());
  const auto asked = evaluate(
      exec, surfaces.size(),
      density_of_view<Exec>{view, const_view<test_surface>(stored), const_view<sampled_direction>(drawn)});
  const wfpg::buffer<float, Exec> answers(exec, surfaces.size());
  const wfpg::buffer<sampled_direction, Exec> again(exec, surfaces.size());
  guider.sample_directions(
      wave.get(), box_caster(), again.view(),
      wfpg::density_queries{direction_of{const_view<sampled_direction>(drawn)}, answers.view()});
  const auto expected = drawn.to_host(exec);
  const auto answered = answers.to_host(exec);
  CHECK(same_draws(again.to_host(exec), expected));
  int wrong = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const bool none = expected[i].technique == sampling_technique::none ||
                      expected[i].technique == sampling_technique::delta;
    const float density = none ? 0.0f : expected[i].pdf;
    wrong += std::abs(answered[i] - density) > 1.0e-5f * density;
    wrong += !none && std::abs(asked[i] - density) > 1.0e-5f * density;
  }
  CHECK(wrong == 0);
}

/// Estimate of the radiance that paths of two bounces gather.
template <class Guider, class Exec>
estimate estimate_radiance(const Exec& exec, Guider&& guider, std::uint32_t samples, std::size_t paths) {
  return estimate_of(trace_paths(exec, guider, samples, paths, box_caster()));
}

WFPG_TEST_CASE("the mean of paths is the same with each guide", "[guide]") {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  constexpr std::size_t paths = 2048;
  constexpr std::uint32_t samples = 24;
  guider_options unguided = tracing_options(paths);
  unguided.unguided_samples = samples;
  const estimate expected =
      estimate_radiance(exec, octree_guider<Exec>(exec, mesh.view(), unguided), samples, paths);
  const estimate found = estimate_radiance(exec, make_guider(exec, mesh.view(), paths), samples, paths);
  CHECK(std::abs(found.mean - expected.mean) < 4.0 * std::sqrt(found.variance + expected.variance));
  CHECK(std::sqrt(found.variance) < 0.05 * found.mean);
}

WFPG_TEST_CASE("a guide that records no paths gets a recorder that drops them", "[guide]") {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  wfpg::sampling_options options;
  options.max_paths = 200;
  options.max_depth = 3;
  uniform_guider<Exec> recorded(exec, mesh.view(), options);
  wfpg::path_guider<Exec, without_paths<Exec>> guider(exec, mesh.view(), options);
  CHECK(std::is_same_v<decltype(recorded.recorder()), wfpg::path_recorder_view>);
  CHECK(std::is_same_v<decltype(guider.recorder()), wfpg::no_path_recorder>);
  CHECK(trace_paths(exec, guider, 3, 200, box_caster()) == trace_paths(exec, recorded, 3, 200, box_caster()));
  const auto recorder = guider.recorder();
  exec.for_each(1, [=] WFPG_HD(std::size_t) {
    recorder.vertex(0, 0, vec3(0.5f), vec3(0, 0, 1), vec3(1.0f));
    recorder.scatter(0, 0, {});
    recorder.escape(0, 1, vec3(1.0f));
    recorder.radiance(0, 0, vec3(1.0f));
    recorder.emission(0, 0, vec3(1.0f));
  });
  CHECK(guider.statistics().dropped_vertices == 0);
  CHECK(guider.memory().transient() + 200 * 3 * 40 <= recorded.memory().transient());
}

WFPG_TEST_CASE("move assignment of a guider frees its own memory", "[guide]") {
  counting_resource resource;
  const Exec exec = Exec().with_resource(&resource);
  const box_mesh<Exec> mesh(exec);
  const std::size_t before = resource.bytes_in_use;
  {
    const guider_options options = tracing_options(256);
    octree_guider<Exec> first(exec, mesh.view(), options), second(exec, mesh.view(), options);
    trace_paths(exec, first, 2, 256, box_caster());
    const std::size_t both = resource.bytes_in_use;
    first = std::move(second);
    CHECK(resource.bytes_in_use < both);
    CHECK(first.statistics().samples == 0);
    const auto picture = trace_paths(exec, first, 3, 256, box_caster());
    second = octree_guider<Exec>(exec, mesh.view(), options);
    CHECK(trace_paths(exec, second, 3, 256, box_caster()) == picture);
  }
  CHECK(resource.bytes_in_use == before);
}

WFPG_TEST_CASE("statistics, memory and checks of a guider work with any guide", "[guide]") {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  uniform_guider<Exec> guider = guider_in_sample(exec, mesh, 3);
  draw(exec, guider, wall_surfaces(100, 1));
  CHECK(guider.statistics().samples == 3);
  CHECK(guider.statistics().guided_samples == 2);
  CHECK(guider.options().max_rays == 4096);
  CHECK(wfpg::light_guide_view(guider.lights()).empty());
  const wfpg::memory_report memory = guider.memory();
  CHECK(memory.persistent() == 0);
  CHECK(memory.transient() > 4096 * 8 * 40);
  CHECK(refusal([&] { make_guider(exec, mesh.view(), std::size_t(1) << 40); }).find("max_paths") !=
        std::string::npos);
  CHECK(refusal([&] { draw(exec, guider, wall_surfaces(5000, 1)); }).find("ray_count") != std::string::npos);
}

}  // namespace
