// Guiding changes the noise of a picture and not its mean. Tile means and picture means of pt and wfpg agree
// within their standard errors. For every kind of guiding, one picture is precise enough to show a bias of 1%
// in indirect light. One policy is enough, since pictures are bit-identical on all
// (test_renderer_render.cpp).
#include "support/catch.hpp"
#include "support/renderings.hpp"

#include <cstddef>
#include <iterator>

namespace {

using wfpg_test::check_precisely;
using wfpg_test::check_rendering;
using wfpg_test::rendering;

using render::fields;
using render::guiding;
using render::sampling_method;
constexpr auto wfpg_method = sampling_method::wfpg;
constexpr auto product_method = sampling_method::wfpg_product;
constexpr const char* map_scene = "cornell-box with a map";

}  // namespace

TEST_CASE("pictures guided by kept fields have the mean of unguided ones", "[renderer][unbiased][thorough]") {
  for (const char* scene : {"cornell-box", "cornell-enclosed", "ajar", "thin-wall", "furnace"})
    for (const bool nee : {false, true}) check_rendering({scene, nee});
  check_rendering({"cornell-wall", true});
  check_rendering({"many-lamps", true});  // the choice among them is learnt
  check_rendering({"outdoor", true});     // hardly any path finds the sun by chance
  for (const bool nee : {false, true}) {
    check_rendering({"materials", nee});
    check_rendering({map_scene, nee});
    check_precisely({"", nee});
    check_precisely({"", nee, wfpg_method, fields::kept, guiding::plain});
  }
  check_rendering({"cornell-enclosed", false, wfpg_method, fields::kept, guiding::plain});
  check_rendering({"thin-wall", true, wfpg_method, fields::kept, guiding::plain});
}

TEST_CASE("guided pictures have the mean of unguided ones after warm-up too",
          "[renderer][unbiased][thorough]") {
  for (const sampling_method method : {wfpg_method, product_method, sampling_method::sarsa})
    for (const bool nee : {false, true}) {
      rendering what{"cornell-enclosed", nee, method};
      what.warmed_up = true;
      check_rendering(what);
      check_precisely(what);
    }
}

TEST_CASE("pictures guided by transient fields have the mean of unguided ones",
          "[renderer][unbiased][thorough]") {
  for (const bool nee : {false, true}) {
    check_rendering({"cornell-enclosed", nee, wfpg_method, fields::transient, guiding::oriented});
    check_rendering({"thin-wall", nee, wfpg_method, fields::transient, guiding::plain});
    check_precisely({"", nee, wfpg_method, fields::transient, guiding::oriented});
  }
  check_precisely({"", true, wfpg_method, fields::transient, guiding::plain});
  check_rendering({"many-lamps", true, wfpg_method, fields::transient, guiding::oriented});
  check_rendering({map_scene, true, wfpg_method, fields::transient, guiding::oriented});
}

TEST_CASE("pictures guided by fields of octree cones have the mean of unguided ones",
          "[renderer][unbiased][thorough]") {
  for (const render::cones through : {render::cones::march, render::cones::trace})
    for (const fields lifetime : {fields::kept, fields::transient}) {
      rendering what{"thin-wall", true, wfpg_method, lifetime};
      what.through = through;
      check_rendering(what);
      if ((through == render::cones::march) == (lifetime == fields::kept)) check_precisely(what);
    }
  rendering what{"cornell-enclosed", false, product_method};
  what.through = render::cones::trace;
  check_rendering(what);
}

TEST_CASE("pictures guided by products have the mean of unguided ones", "[renderer][unbiased]") {
  for (const char* scene : {"ajar", "glossy-room"})
    for (const bool nee : {false, true}) check_rendering({scene, nee, product_method});
  check_precisely({"", true, product_method});
}

TEST_CASE("pictures guided by products have that mean in more scenes", "[renderer][unbiased][thorough]") {
  for (const char* scene : {"cornell-box", "cornell-enclosed", "thin-wall"})
    for (const bool nee : {false, true}) check_rendering({scene, nee, product_method});
}

TEST_CASE("pictures guided by products of all fields, materials and maps have that mean, too",
          "[renderer][unbiased][thorough]") {
  for (const bool nee : {false, true}) {
    check_rendering({"cornell-enclosed", nee, product_method, fields::transient, guiding::oriented});
    check_rendering({"thin-wall", nee, product_method, fields::transient, guiding::plain});
    check_rendering({"materials", nee, product_method});
  }
  check_rendering({map_scene, true, product_method});
  check_precisely({"", false, product_method});
  for (const bool nee : {false, true})
    check_precisely({"", nee, product_method, fields::transient, guiding::oriented});
}

TEST_CASE("pictures guided by a SARSA grid have the mean of unguided ones",
          "[renderer][unbiased][thorough]") {
  for (const char* scene : {"ajar", "glossy-room"})
    for (const bool nee : {false, true}) check_rendering({scene, nee, sampling_method::sarsa});
  check_precisely({"", true, sampling_method::sarsa});
  rendering what{"cornell-enclosed", true, sampling_method::sarsa};
  // Each update with another sampler. test_sarsa_grid_light.cpp has all pairs.
  const auto updates = render::sarsa_update_names();
  const auto samplers = render::sarsa_sampler_names();
  for (std::size_t i = 0; i < samplers.size(); ++i) {
    what.update = std::next(updates.begin(), static_cast<std::ptrdiff_t>(i % updates.size()))->second;
    what.sampler = std::next(samplers.begin(), static_cast<std::ptrdiff_t>(i))->second;
    check_rendering(what);
  }
}

TEST_CASE("pictures guided by irradiance records have the mean of unguided ones", "[renderer][unbiased]") {
  for (const bool nee : {false, true}) check_rendering({"cornell-enclosed", nee, sampling_method::records});
  check_precisely({"", true, sampling_method::records});
}

TEST_CASE("pictures guided by grids and records have that mean without light samples, too",
          "[renderer][unbiased][thorough]") {
  for (const sampling_method method : {sampling_method::sarsa, sampling_method::records})
    check_precisely({"", false, method});
}

TEST_CASE("a furnace guided by products has its radiance within 0.5%", "[renderer][unbiased]") {
  for (const bool nee : {false, true}) {
    rendering furnace{"furnace", nee, product_method};
    render::render_options options = furnace.options();
    const render::image picture = render::render(render::make_builtin_scene("furnace"), options, {}).picture;
    double mean = 0.0;
    for (const double tile : wfpg_test::tiles_of(picture))
      mean += tile / (wfpg_test::tiles * wfpg_test::tiles);
    CHECK(mean == Approx(render::furnace_radiance(options.max_depth)).epsilon(0.005));
  }
}
