// The renderer on a GPU. Its pictures have the means of the CPU's, and one seed gives one picture. Needs a
// GPU.
#include "support/catch.hpp"
#include "support/renderings.hpp"

#include <cstring>

namespace {

using render::device;
using render::fields;
using render::guiding;
using render::sampling_method;
using wfpg_test::rendering;

/// Guiding on the CPU agrees with path tracing there (test_renderer_unbiased.cpp).
void check_as_on_cpu(rendering what) {
  what.where = device::cuda;
  wfpg_test::check_rendering(what);
}

// All scenes except many-lamps and outdoor. They need next-event estimation, since paths hardly hit the lamps
// and the sun.
constexpr const char* scenes[] = {"cornell-box", "cornell-enclosed", "cornell-wall", "ajar",   "thin-wall",
                                  "glossy-room", "caustic-pool",     "materials",    "furnace"};

void check_all_scenes(sampling_method method) {
  for (const char* scene : scenes)
    for (const bool nee : {false, true}) check_as_on_cpu({scene, nee, method});
  for (const char* scene : {"many-lamps", "outdoor"}) check_as_on_cpu({scene, true, method});
}

bool same_bits(const render::image& a, const render::image& b) {
  return a.pixels.size() == b.pixels.size() &&
         std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(wfpg::vec3)) == 0;
}

}  // namespace

TEST_CASE("unguided GPU pictures have the means of the CPU's", "[renderer][cuda]") {
  check_all_scenes(sampling_method::pt);
}

TEST_CASE("GPU pictures guided by kept fields have the means of the CPU's", "[renderer][cuda]") {
  check_all_scenes(sampling_method::wfpg);
}

TEST_CASE("GPU pictures guided by products have the means of the CPU's", "[renderer][cuda]") {
  check_all_scenes(sampling_method::wfpg_product);
}

TEST_CASE("GPU pictures guided by a SARSA grid have the means of the CPU's", "[renderer][cuda]") {
  check_all_scenes(sampling_method::sarsa);
  rendering what{"cornell-enclosed", true, sampling_method::sarsa};
  for (const auto& update : render::sarsa_update_names())
    for (const auto& sampler : render::sarsa_sampler_names()) {
      what.update = update.second;
      what.sampler = sampler.second;
      check_as_on_cpu(what);
    }
}

TEST_CASE("GPU pictures guided by irradiance records have the means of the CPU's", "[renderer][cuda]") {
  check_all_scenes(sampling_method::records);
}

TEST_CASE("GPU pictures guided by transient fields have the means of the CPU's", "[renderer][cuda]") {
  for (const sampling_method method : {sampling_method::wfpg, sampling_method::wfpg_product}) {
    for (const char* scene : scenes) {
      check_as_on_cpu({scene, true, method, fields::transient, guiding::oriented});
      check_as_on_cpu({scene, false, method, fields::transient, guiding::plain});
    }
    check_as_on_cpu({"many-lamps", true, method, fields::transient, guiding::oriented});
  }
}

TEST_CASE("GPU pictures after warm-up have the means of the CPU's", "[renderer][cuda]") {
  for (const sampling_method method :
       {sampling_method::wfpg, sampling_method::wfpg_product, sampling_method::sarsa})
    // In ajar, unguided pictures would need too many samples for normally distributed means.
    for (const char* scene : {"cornell-box", "cornell-enclosed", "glossy-room"})
      for (const bool nee : {false, true}) {
        rendering what{scene, nee, method};
        what.warmed_up = true;
        check_as_on_cpu(what);
      }
}

TEST_CASE("GPU pictures of paths from both ends have the means of the CPU's", "[renderer][cuda]") {
  for (const char* scene : {"cornell-box", "glossy-room", "materials", "outdoor"})
    for (const sampling_method method : {sampling_method::bpt, sampling_method::vcm})
      check_as_on_cpu({scene, true, method});
  check_as_on_cpu({"cornell-box", true, sampling_method::lt});
  check_as_on_cpu({"lamps without extent", true, sampling_method::bpt});
}

TEST_CASE("GPU pictures of paths through media have the means of the CPU's", "[renderer][cuda]") {
  check_as_on_cpu({"caustic-pool", false, sampling_method::vpt});
  check_as_on_cpu({"materials", true, sampling_method::vpt});
}

TEST_CASE("GPU pictures of paths from both ends in media are the CPU's", "[renderer][cuda]") {
  // The same paths: means of few samples are near each other. Their sums differ by rounding, and some paths
  // by what they meet.
  for (const char* name : {"fog-spot", "bottles"})
    for (const sampling_method method : {sampling_method::bpt, sampling_method::upbp}) {
      const render::scene world = render::make_builtin_scene(name);
      render::render_options options;
      options.method = method;
      options.width = options.height = 64;
      options.spp = 4;
      options.max_depth = 8;
      options.light.volume_radius = 0.01f;
      const auto mean_on = [&](device where) {
        options.where = where;
        wfpg::vec3 sum(0.0f);
        for (const wfpg::vec3& pixel : render::render(world, options, {}).picture.pixels) sum += pixel;
        return wfpg::luminance(sum);
      };
      INFO(name);
      CHECK(mean_on(device::cuda) == Approx(mean_on(device::cpu)).epsilon(0.02));
    }
}

TEST_CASE("one seed gives one picture on a GPU", "[renderer][cuda]") {
  const render::scene world = render::make_builtin_scene("cornell-enclosed");
  for (const sampling_method method :
       {sampling_method::pt, sampling_method::vpt, sampling_method::bpt, sampling_method::vcm,
        sampling_method::upbp, sampling_method::wfpg, sampling_method::wfpg_product, sampling_method::sarsa,
        sampling_method::records})
    for (const fields lifetime : {fields::kept, fields::transient}) {
      render::render_options options;
      options.method = method;
      options.lifetime = lifetime;
      options.where = device::cuda;
      options.width = options.height = 96;
      options.spp = 8;
      const render::image first = render::render(world, options, {}).picture;
      const render::image second = render::render(world, options, {}).picture;
      INFO(rendering({"cornell-enclosed", true, method, lifetime}).name());
      CHECK(same_bits(first, second));
    }
}
