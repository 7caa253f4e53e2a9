// The two forms of a guider: one samples a wave, the other lets a host's kernel sample. Both give the same
// directions.
#include "support/evaluate.hpp"
#include "support/guiding.hpp"
#include "support/kinds_of_guiding.hpp"
#include "support/policies.hpp"

#include <wfpg/path_guider.hpp>

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::guiding_mode;
using wfpg::sampled_direction;

namespace {

/// A renderer's kernel that samples from a prepared view.
struct sample_view {
  wfpg::guide_view view;
  stored_surfaces surfaces;
  hashed_numbers random;
  wfpg::array_view<sampled_direction> directions;
  WFPG_HD void operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    const test_surface s = surfaces(ray);
    directions[i] = {};
    if (s.active) directions[i] = view.sample(ray, s, random(ray, 0).x, random(ray, 1));
  }
};

template <class Exec>
std::vector<sampled_direction> sample_from(const Exec& exec, const wfpg::guide_view& view,
                                           const stored_surfaces& stored) {
  const std::size_t n = stored.surfaces.size();
  const wfpg::buffer<sampled_direction, Exec> directions(exec, n);
  exec.for_each(n, sample_view{view, stored, hashed_numbers{}, directions.view()});
  return directions.to_host(exec);
}

template <class Exec, class Caster>
std::vector<sampled_direction> sample_prepared(guided_box<Exec>& box,
                                               const wfpg::buffer<test_surface, Exec>& surfaces,
                                               const Caster& caster, std::uint32_t depth) {
  const stored_surfaces stored{const_view<test_surface>(surfaces)};
  const wfpg::guide_view view =
      box.guider.prepare(wfpg::wave{depth, surfaces.size(), stored, hashed_numbers{}}, caster);
  return sample_from(box.exec, view, stored);
}

WFPG_TEST_CASE("path guider: both forms sample the same directions, bit for bit", "[path_guider]") {
  for (guider_options options : kinds_of_guiding()) {
    options.binning.rays_per_bin = 8;  // bins have more and fewer rays than this
    guided_box<Exec> fused(options), prepared(options), batch(options), prepared_batch(options);
    for (guided_box<Exec>* box : {&fused, &prepared, &batch, &prepared_batch}) box->learn();
    const auto surfaces = mixed_surfaces(700, 4);
    const wfpg::buffer<test_surface, Exec> stored(fused.exec, surfaces);
    batch_box_caster::log log;
    const batch_box_caster caster{{}, &log};
    for (int sample = 0; sample < 3; ++sample) {
      for (std::uint32_t depth : {0u, 1u, 7u}) {
        INFO(describe(options) << ", sample " << sample << ", depth " << depth);
        const auto expected = fused.sample(surfaces, box_caster{}, 1, depth);
        CHECK(count_guided(expected) > 150);
        CHECK(same_draws(sample_prepared(prepared, stored, box_caster{}, depth), expected));
        CHECK(same_draws(sample_prepared(prepared_batch, stored, caster, depth), expected));
        CHECK(same_draws(batch.sample(surfaces, caster, 1, depth), expected));
      }
      for (guided_box<Exec>* box : {&fused, &prepared, &batch, &prepared_batch}) {
        box->guider.end_sample();
        box->guider.begin_sample();
      }
    }
  }
}

/// Tells the recorder of all surfaces that a host would tell of: those in use that are not delta.
struct record_wave {
  wfpg::path_recorder_view recorder;
  stored_surfaces surfaces;
  std::uint32_t depth;
  WFPG_HD void operator()(std::size_t i) const {
    const test_surface s = surfaces(static_cast<std::uint32_t>(i));
    if (s.active && !s.bsdf.is_delta())
      recorder.vertex(i, depth, s.position, s.outgoing, s.normal, s.bsdf.transmits(), 1.0f);
  }
};

template <class Exec>
std::vector<sampled_direction> sample_recorded(guided_box<Exec>& box,
                                               const wfpg::buffer<test_surface, Exec>& surfaces,
                                               std::uint32_t depth) {
  const stored_surfaces stored{const_view<test_surface>(surfaces)};
  box.exec.for_each(surfaces.size(), record_wave{box.guider.recorder(), stored, depth});
  const wfpg::guide_view view = box.guider.prepare(depth, box_caster{});
  return sample_from(box.exec, view, stored);
}

WFPG_TEST_CASE("path guider: a wave that the recorder knows samples as a wave of surfaces", "[path_guider]") {
  for (guider_options options : kinds_of_guiding()) {
    options.binning.rays_per_bin = 8;
    options.max_paths = 700;
    options.records_waves = true;
    guided_box<Exec> whole(options), recorded(options);
    for (guided_box<Exec>* box : {&whole, &recorded}) box->learn();
    const auto surfaces = mixed_surfaces(700, 4);
    const wfpg::buffer<test_surface, Exec> stored(whole.exec, surfaces);
    const auto record = [&](guided_box<Exec>& box, std::uint32_t depth) {
      box.exec.for_each(
          surfaces.size(),
          record_wave{box.guider.recorder(), stored_surfaces{const_view<test_surface>(stored)}, depth});
    };
    const auto guides_none = [&](const wfpg::guide_view& view) {
      return count_where(recorded.exec, surfaces.size(), [=] WFPG_HD(std::size_t i) {
               return view.guides(static_cast<std::uint32_t>(i));
             }) == 0;
    };
    for (int sample = 0; sample < 3; ++sample) {
      for (std::uint32_t depth : {0u, 1u, 1u, 7u}) {  // two passes have a wave of depth 1
        INFO(describe(options) << ", sample " << sample << ", depth " << depth);
        record(whole, depth);  // both learn from the same paths
        const auto expected = whole.sample(surfaces, box_caster{}, 1, depth);
        CHECK(count_guided(expected) > 150);
        CHECK(same_draws(sample_recorded(recorded, stored, depth), expected));
      }
      // What was prepared is forgotten, and a sample begins without vertices.
      whole.sample({}, box_caster{}, 1, 7);
      CHECK(guides_none(recorded.guider.prepare(7, box_caster{})));
      for (guided_box<Exec>* box : {&whole, &recorded}) {
        record(*box, 2);
        box->guider.end_sample();
        box->guider.begin_sample();
      }
      whole.sample({}, box_caster{}, 1, 2);
      CHECK(guides_none(recorded.guider.prepare(2, box_caster{})));
    }
  }
}

WFPG_TEST_CASE("path guider: a wave is refused where the recorder keeps none", "[path_guider]") {
  guided_box<Exec> box(box_options(guiding_mode::oriented, field_lifetime::kept));
  try {
    box.guider.prepare(0, box_caster{});
    FAIL("prepare(depth, caster) returned");
  } catch (const std::invalid_argument& error) {
    CHECK(std::string(error.what()).find("records_waves") != std::string::npos);
  }
}

WFPG_TEST_CASE("path guider: both forms and their counts agree after warm-up, when few waves build",
               "[path_guider]") {
  for (guiding_mode mode : modes)
    for (std::uint32_t products : {0u, 4u}) {
      guider_options options = box_options(mode, field_lifetime::kept);
      options.product_resolution = unless_zero(products);
      guided_box<Exec> fused(options), prepared(options);
      fused.learn();
      prepared.learn();
      const auto surfaces = mixed_surfaces(300, 4);
      const wfpg::buffer<test_surface, Exec> stored(fused.exec, surfaces);
      for (int sample = 1; sample < 52; ++sample) {
        CHECK(fused.sample({}).empty());
        const wfpg::buffer<test_surface, Exec> none(prepared.exec, 0);
        CHECK(sample_prepared(prepared, none, box_caster{}, 0).empty());
        for (std::uint32_t depth : {0u, 1u, 7u}) {
          INFO(describe(options) << ", P " << products << ", sample " << sample << ", depth " << depth);
          const auto expected = fused.sample(surfaces, box_caster{}, 1, depth);
          CHECK(count_guided(expected) > 60);
          CHECK(same_draws(sample_prepared(prepared, stored, box_caster{}, depth), expected));
        }
        for (guided_box<Exec>* box : {&fused, &prepared}) {
          box->guider.end_sample();
          box->guider.begin_sample();
        }
      }
      const auto counted = fused.guider.statistics().depths, alike = prepared.guider.statistics().depths;
      for (std::size_t depth = 0; depth < counted.size(); ++depth) {
        CHECK(counted[depth].rays == alike[depth].rays);
        CHECK(counted[depth].unbinned == alike[depth].unbinned);
        CHECK(counted[depth].cones == alike[depth].cones);
      }
      CHECK(counted[7].rays > 51 * 150);
    }
}

WFPG_TEST_CASE("path guider: both forms agree before anything guides", "[path_guider]") {
  for (guider_options options : kinds_of_guiding()) {
    INFO(describe(options));
    options.unguided_samples = 1;
    guided_box<Exec> box(options);
    box.guider.begin_sample();
    CHECK(!box.guider.guided());
    const auto surfaces = mixed_surfaces(200, 4);
    const wfpg::buffer<test_surface, Exec> stored(box.exec, surfaces);
    const auto fused = box.sample(surfaces);
    CHECK(count_guided(fused) == 0);
    CHECK(same_draws(sample_prepared(box, stored, box_caster{}, 0), fused));
    box.guider.end_sample();
    box.guider.begin_sample();
    CHECK(box.guider.guided());
    CHECK(count_guided(box.sample(surfaces)) > 20);
  }
}

}  // namespace
