// Waves of kept fields: limits on cones, and invalidation. Also invalid rays, options and casters.
#include "support/floor_rays.hpp"
#include "support/kept_fields.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/guides/octree/field_store.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::guide_view;
using wfpg::kept_field_options;

namespace {

constexpr vec3 up{0, 1, 0}, down{0, -1, 0};

WFPG_TEST_CASE("field store: a wave respects its limit of cones, and every field is built in time",
               "[field_store]") {
  const auto wave = floor_rays(16);
  for (std::uint64_t most : {0, 15, 16, 35, 64}) {
    kept_field_options options = slots_of(4, 16);
    options.max_wave_cones = most;
    kept_box<Exec> box(options);
    INFO("at most " << most);
    for (std::uint32_t sample = 0; sample < 30; ++sample) {
      box.begin();
      CHECK(box.cones(wave) <= most);
      const guide_view view = box.prepare(wave);
      CHECK(guided_otherwise(box, view, wave) == 0);
      CHECK(consistent(box));
      if (sample == 0) CHECK(box.counts().refused > 0);
    }
    CHECK(box.counts().allocated == (most < 16 ? 0 : 16));
    CHECK(count_guided(box.exec(), box.prepare(wave), 16) == (most < 16 ? 0 : 16));
    box.store.invalidate_all(box.exec());
    std::size_t recast = 0;
    for (std::uint32_t sample = 0; sample < 40; ++sample) {
      box.begin();
      box.prepare(wave);
      recast += box.last_wave().all;
    }
    CHECK(recast == (most < 16 ? 0 : 16));
  }
}

WFPG_TEST_CASE("field store: a reused slot guides nobody until its own field is built", "[field_store]") {
  const auto first = floor_rays(2);
  const std::vector<test_surface> second{first[1], make_surface({0.6f, 1.0f, 0.6f}, down, down)};
  int waited = 0;
  for (std::uint32_t skipped = 0; skipped < 8; ++skipped) {
    kept_field_options options = slots_of(4, 2);
    options.max_wave_cones = 16;
    options.idle_samples = 1;
    kept_box<Exec> box(options, wfpg::guiding_mode::oriented, 16);
    box.sample = skipped;
    box.begin();
    box.prepare_all(first);
    for (int sample = 0; sample < 3; ++sample) {
      box.begin();
      box.prepare({first[1]});
    }
    CHECK(box.counts().freed == 1);
    box.store.invalidate_all(box.exec());
    box.begin();
    box.log.take();
    const guide_view view = box.prepare(second);  // both need all cones, so one has to wait
    const bool built = box.log.cones().at(0).origin.y > 0.5f;
    CHECK(box.log.count() == 16);
    CHECK(guides(box.exec(), view, 0));
    CHECK(guides(box.exec(), view, 1) == built);
    CHECK(guided_otherwise(box, view, second) == 0);
    waited += !built;
  }
  CHECK(waited > 0);
}

WFPG_TEST_CASE("field store: a limit on cones is spread evenly, whatever the budget", "[field_store]") {
  const auto wave = floor_rays(16);
  kept_field_options options = slots_of(4, 2000);
  options.max_wave_cones = 16;  // one new field, or 4 refreshes
  kept_box<Exec> box(options, wfpg::guiding_mode::oriented, 16);
  box.begin();
  while (count_guided(box.exec(), box.prepare(wave), 16) < 16) {
  }
  std::vector<int> cones(16, 0);
  for (int sample = 0; sample < 14; ++sample) {  // every field is due in each sample
    box.begin();
    CHECK(box.cones(wave) == 16);
    for (const wfpg::ray& cone : box.log.cones(16))
      for (std::uint32_t i = 0; i < 16; ++i) cones[i] += glm::distance(cone.origin, floor_place(i)) < 0.1f;
  }
  const auto [least, most] = std::minmax_element(cones.begin(), cones.end());
  INFO("least " << *least << ", most " << *most);
  CHECK(*least >= 4);
  CHECK(*most < 14 * 4);
}

WFPG_TEST_CASE("field store: a limit on cones makes no bins larger", "[field_store]") {
  kept_field_options options = slots_of(4, 160);
  options.max_wave_cones = 16;
  kept_box<Exec> box(options);
  std::uint32_t delayed = 0;
  for (int sample = 0; sample < 4; ++sample) {
    box.begin();
    for (int wave = 0; wave < 8; ++wave) box.prepare(wall_surfaces(600, 1));
    delayed += box.state().delayed;
    box.end();
    CHECK(box.state().pressure <= wfpg::field_store_state().pressure);
  }
  CHECK(box.counts().live == 4 * 8);
  CHECK(delayed > 160 * 4);
}

WFPG_TEST_CASE("field store: samples that only count rays do not change bin sizes", "[field_store]") {
  kept_box<Exec> box(slots_of(4, 160));
  const auto surfaces = wall_surfaces(600, 1);
  const wfpg::buffer<test_surface, Exec> stored(box.exec(), surfaces);
  const wfpg::wave_rays<stored_surfaces> rays{{const_view<test_surface>(stored)},
                                              wfpg::guiding_mode::oriented};
  while (box.sample < 8) {
    box.begin();
    box.store.count(box.exec(), surfaces.size(), rays);
    box.end();
  }
  CHECK(box.state().pressure == wfpg::field_store_state().pressure);
}

/// Surfaces that give a ray's path alone, too.
struct surfaces_of_paths {
  stored_surfaces stored;
  wfpg::recorded_runs asked;
  WFPG_HD test_surface operator()(std::uint32_t ray) const {
    test_surface s = stored(ray);
    s.path = path(ray);
    s.active = asked.includes(s.path);
    return s;
  }
  WFPG_HD std::uint32_t path(std::uint32_t ray) const { return ray % 7 == 0 ? wfpg::no_path : 2 * ray; }
};
/// Surfaces without a function for paths.
struct surfaces_alone {
  surfaces_of_paths of_paths;
  WFPG_HD test_surface operator()(std::uint32_t ray) const { return of_paths(ray); }
};

WFPG_TEST_CASE("rays of other paths need no surface where a host gives paths", "[field_store]") {
  const Exec exec;
  const auto surfaces = wall_surfaces(600, 1);
  const wfpg::buffer<test_surface, Exec> stored(exec, surfaces);
  const wfpg::recorded_runs some{1, 5, 1};
  const surfaces_of_paths of_paths{{const_view<test_surface>(stored)}, some};
  const wfpg::wave_rays<surfaces_of_paths> rays{of_paths, wfpg::guiding_mode::oriented, some, 1000};
  const wfpg::wave_rays<surfaces_alone> others{{of_paths}, wfpg::guiding_mode::oriented, some, 1000};
  const auto found = evaluate(exec, surfaces.size(), rays),
             expected = evaluate(exec, surfaces.size(), others);
  const auto numbers = evaluate(exec, surfaces.size(), [=] WFPG_HD(std::size_t i) { return rays.number(i); });
  std::size_t active = 0;
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    INFO("ray " << i);
    CHECK(found[i].active == expected[i].active);
    CHECK(numbers[i] == 1000 + (i % 7 == 0 ? i : 2 * i));
    if (!found[i].active) continue;
    ++active;
    CHECK(found[i].position == expected[i].position);
    CHECK(found[i].orientation == expected[i].orientation);
    CHECK(found[i].paths == expected[i].paths);
  }
  CHECK(active > 600 / 7 + 50);
  CHECK(active < 400);
}

WFPG_TEST_CASE("field store: fields that may see moved geometry are cast again, others refreshed",
               "[field_store]") {
  kept_box<Exec> box(slots_of(4, 100));
  std::vector<test_surface> floor = floor_rays(5), ceiling, glass = rays_at({0.0f, 0.4f, 0.4f}, {1, 0, 0});
  for (const test_surface& s : floor) ceiling.push_back(make_surface(s.position + up, down, down));
  glass[0].bsdf.kind = bsdf_kind::glass;
  std::vector<test_surface> all = floor;
  all.insert(all.end(), ceiling.begin(), ceiling.end());
  all.insert(all.end(), glass.begin(), glass.end());
  const auto next = [&](const wfpg::bounds3& moved) {
    box.store.invalidate(box.exec(), moved);
    box.begin();
    return std::vector<std::size_t>{box.cones(floor), box.cones(ceiling), box.cones(glass)};
  };
  box.begin();
  box.prepare_all(all);
  const std::vector<std::size_t> none{20, 20, 4}, see_all{80, 80, 16};
  CHECK(next({{0.4f, -2.0f, 0.4f}, {0.6f, -1.8f, 0.6f}}) == std::vector<std::size_t>{20, 80, 16});
  CHECK(next({{0.4f, 2.8f, 0.4f}, {0.6f, 3.0f, 0.6f}}) == std::vector<std::size_t>{80, 20, 16});
  CHECK(next({{0.4f, 0.4f, 0.4f}, {0.6f, 0.6f, 0.6f}}) == see_all);
  CHECK(next({floor_place(0) - 0.01f, floor_place(0) + 0.01f}) == see_all);
  CHECK(next({vec3(-9.0f), vec3(9.0f)}) == see_all);
  box.store.invalidate_all(box.exec());
  CHECK(box.cones(all) == 80 + 80 + 16);  // in the same sample too
  CHECK(box.cones(all) == 0);
  box.begin();
  CHECK(box.cones(floor) == none[0]);
  CHECK(box.counts().allocated == 11);
}

WFPG_TEST_CASE("field store: invalid fields keep guiding until they are next used", "[field_store]") {
  kept_box<Exec> box(slots_of(8, 10));
  const auto wave = floor_rays(3);
  box.begin();
  const auto before = field_bits(box.exec(), box.prepare_all(wave), 3);
  box.store.invalidate_all(box.exec());
  CHECK(box.cones({wave[0]}) == 64);
  box.begin();
  CHECK(box.cones({wave[1]}) == 64);
  CHECK(box.cones({wave[1], wave[0]}) == 16);
  CHECK(box.counts().allocated == 3);
  CHECK(field_bits(box.exec(), box.prepare({wave[2]}), 1)[0] != before[2]);
}

WFPG_TEST_CASE("field store: unusual rays are counted and have no field", "[field_store]") {
  kept_box<Exec> box(slots_of(4, 100));
  auto wave = floor_rays(12);
  wave[1].active = false;
  wave[2].bsdf.kind = bsdf_kind::mirror;
  wave[3].position = vec3(std::nanf(""));
  wave[4].position = vec3(INFINITY);
  wave[5].position = {0.5f, 0.5f, 0.5f};
  box.begin();
  const guide_view view = box.prepare_all(wave);
  CHECK(box.last_wave().unbinned == 3);
  CHECK(box.last_wave().without_field == 0);
  CHECK(box.last_wave().with_field == 7);
  CHECK(count_guided(box.exec(), view, wave.size()) == 7);
  CHECK(count_guided(box.exec(), box.prepare({}), 12) == 0);
}

WFPG_TEST_CASE("field store: options out of range are named, and too many rays are refused",
               "[field_store]") {
  const auto refused = [](const char* name, void (*spoil)(kept_field_options&)) {
    kept_field_options options;
    spoil(options);
    const std::string message = refusal([&] { kept_box<Exec> box(options); });
    INFO("expected: " << name << ", message: " << message);
    CHECK(message.find(name) != std::string::npos);
  };
  refused("kept.resolution", [](kept_field_options& o) { o.resolution = 1; });
  refused("kept.resolution", [](kept_field_options& o) { o.resolution = 129; });
  refused("kept.recast", [](kept_field_options& o) { o.recast = 0; });
  refused("kept.idle_samples", [](kept_field_options& o) { o.idle_samples = 0; });
  refused("kept.budget_bytes", [](kept_field_options& o) { o.budget_bytes = ~std::size_t(0); });
  CHECK(refusal([] { kept_box<Exec> box(slots_of(128, 2, 128 * 128)); }).empty());

  kept_box<Exec> box(slots_of(4, 10));
  box.begin();
  const std::string message = refusal([&] { box.prepare(rays_at({}, up, box.max_rays + 1)); });
  CHECK(message.find("ray_count") != std::string::npos);
  CHECK(count_guided(box.exec(), box.prepare(rays_at(floor_place(0), up, box.max_rays)), 2000) ==
        box.max_rays);
}

WFPG_TEST_CASE("field store: after a caster throws, the next wave builds its fields", "[field_store]") {
  const auto wave = floor_rays(16);
  kept_box<Exec> box(slots_of(4, 100)), other(slots_of(4, 100));
  for (std::size_t call : {0, 1, 3}) {
    box.begin();
    other.begin();
    const auto expected = field_bits(other.exec(), other.prepare_all(wave), wave.size());
    batch_box_caster::log log;
    log.throw_at = call;
    CHECK_THROWS_AS(box.prepare(wave, batch_box_caster{{}, &log}, 1), std::runtime_error);
    CHECK(consistent(box));
    CHECK(field_bits(box.exec(), box.prepare_all(wave), wave.size()) == expected);
    CHECK(count_guided(box.exec(), box.prepare(wave), wave.size()) == wave.size());
    CHECK(box.counts().live == 16);
    box.end();
    other.end();
  }
}

WFPG_TEST_CASE("field store: a wave after a failed one builds fields for its own rays only",
               "[field_store]") {
  kept_box<Exec> box(slots_of(4, 100));
  const auto wave = floor_rays(2);
  batch_box_caster::log log;
  log.throw_at = 0;
  box.begin();
  for (int i = 0; i < 2; ++i) {
    log.calls = 0;
    CHECK_THROWS_AS(box.prepare(wave, batch_box_caster{{}, &log}), std::runtime_error);
  }
  CHECK(box.counts().live == 2);
  CHECK(box.cones({wave[1]}) == 16);
  CHECK(box.cones(wave) == 16);
  CHECK(box.cones(wave) == 0);
}

}  // namespace
