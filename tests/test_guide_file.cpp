// Guide files. Loaded guides continue bit for bit. Truncated, altered, foreign, newer or invented files are
// refused by name and do no harm.
#include "support/catch.hpp"
#include "support/evaluate.hpp"
#include "support/guiding.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"
#include "support/section_bytes.hpp"
#include "support/temporary_folder.hpp"

#include <wfpg/guide_file.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace wfpg_test;
using wfpg::guiding_mode;

constexpr std::size_t paths = 600;

/// A guider that has traced some samples of the box.
template <class Exec, class Options>
auto trained(const Exec& exec, const Options& options, std::uint32_t samples = 3) {
  wfpg::path_guider<Exec, wfpg::octree_guide_for<Exec, Options>> guider(exec, box_mesh<Exec>(exec).view(),
                                                                        options);
  trace_paths(exec, guider, samples, paths, box_caster());
  return guider;
}

template <class Exec, class Guide>
std::string saved(const wfpg::path_guider<Exec, Guide>& guider) {
  std::ostringstream out;
  wfpg::save_guide(guider, out);
  return out.str();
}

template <class Exec, class Options>
auto loaded(const Exec& exec, const std::string& bytes, const Options& options) {
  std::istringstream in(bytes);
  return wfpg::load_guide(exec, in, options);
}

/// The error message for a file's bytes. Empty if they load.
template <class Options>
std::string fault(const std::string& bytes, const Options& options) {
  try {
    loaded(one_policy(), bytes, options);
  } catch (const wfpg::file_error& error) {
    return error.what();
  }
  return "";
}

wfpg::kept_guide_options small_options() {
  wfpg::kept_guide_options options = tracing_options(paths);
  options.octree_resolution = 8;
  options.kept.resolution = 4;
  options.kept.budget_bytes = 40 * wfpg::field_store<one_policy>::bytes_a_slot(4);
  return options;
}

bool same_counts(const wfpg::guider_statistics& a, const wfpg::guider_statistics& b) {
  bool same = a.samples == b.samples && a.guided_samples == b.guided_samples &&
              a.depths.size() == b.depths.size() && a.kept.live == b.kept.live &&
              a.kept.allocated == b.kept.allocated && a.kept.freed == b.kept.freed &&
              a.kept.refreshed == b.kept.refreshed && a.kept.refused == b.kept.refused &&
              a.deposits.total() == b.deposits.total() && a.dropped_vertices == b.dropped_vertices &&
              a.build.skipped() == b.build.skipped();
  for (std::size_t i = 0; same && i < a.depths.size(); ++i)
    same = a.depths[i].bins == b.depths[i].bins && a.depths[i].rays == b.depths[i].rays &&
           a.depths[i].unbinned == b.depths[i].unbinned && a.depths[i].cones == b.depths[i].cones;
  return same;
}

/// Checks that a loaded guider equals the saved one and traces the same paths.
template <class Exec, class Options>
void check_goes_on(const Exec& exec, const Options& options) {
  auto first = trained(exec, options, 5);
  const std::string bytes = saved(first);
  auto second = loaded(exec, bytes, options);
  CHECK(saved(second) == bytes);
  CHECK(same_counts(first.statistics(), second.statistics()));
  CHECK((second.statistics().kept.live > 0) == (std::is_same_v<Options, wfpg::kept_guide_options>));

  const auto picture = trace_paths(exec, first, 4, paths, box_caster());
  CHECK(trace_paths(exec, second, 4, paths, box_caster()) == picture);
  CHECK(saved(first) == saved(second));
  CHECK(same_counts(first.statistics(), second.statistics()));
  decltype(first) fresh(exec, box_mesh<Exec>(exec).view(), options);
  CHECK(trace_paths(exec, fresh, 4, paths, box_caster()) != picture);
}

WFPG_TEST_CASE("a loaded guider continues bit for bit", "[guide_file]") {
  const Exec exec;
  for (const field_lifetime lifetime : lifetimes)
    for (const guiding_mode mode : {guiding_mode::oriented, guiding_mode::plain})
      for (const std::uint32_t product : {0u, 4u}) {
        INFO(name_of(lifetime) << ", products " << product << ", plain " << (mode == guiding_mode::plain));
        guider_options either = tracing_options(paths, mode, lifetime);
        if (product > 0) either.product_resolution = product;
        with_own_options(either, [&](const auto& options) { check_goes_on(exec, options); });
      }
}

WFPG_TEST_CASE("fields that are refused, invalidated or dark continue bit for bit", "[guide_file]") {
  const Exec exec;
  wfpg::kept_guide_options options = small_options();
  options.octree_resolution = 32;
  for (const bool moved : {false, true}) {  // if nothing moved, waves take turns to build fields from now on
    wfpg::path_guider<Exec> first = trained(exec, options, 40);
    REQUIRE(first.statistics().kept.refused > 0);
    if (moved) {
      first.invalidate({wfpg::vec3(0.4f), wfpg::vec3(0.6f)});
      first.forget_light();
    }
    wfpg::path_guider<Exec> second = loaded(exec, saved(first), options);
    CHECK(trace_paths(exec, second, 9, paths, box_caster()) ==
          trace_paths(exec, first, 9, paths, box_caster()));
    CHECK(saved(first) == saved(second));
  }
}

WFPG_TEST_CASE("a loaded guide aims cones at the same bright nodes", "[guide_file]") {
  const Exec exec;
  wfpg::kept_guide_options options = tracing_options(paths);
  options.octree_resolution = 8;
  wfpg::path_guider<Exec> first = trained(exec, options, 7);
  wfpg::detail::bright_nodes<Exec> bright(exec);
  bright.find(exec, first.guide().cache());
  REQUIRE(wfpg::read_element(exec, bright.view().count) > 0);
  wfpg::path_guider<Exec> second = loaded(exec, saved(first), options);
  CHECK(trace_paths(exec, second, 1, paths, box_caster()) ==
        trace_paths(exec, first, 1, paths, box_caster()));
  CHECK((saved(first) == saved(second)));
}

WFPG_TEST_CASE("a loaded guide counts fields that wait for their cones", "[guide_file]") {
  const Exec exec;
  wfpg::kept_guide_options options = small_options();
  options.octree_resolution = 32;
  options.kept.budget_bytes *= 100;
  options.kept.max_wave_cones = 3 * 16;  // three new fields a wave
  wfpg::path_guider<Exec> first = trained(exec, options, 2);
  const wfpg::kept_field_statistics counted = first.statistics().kept;
  REQUIRE(2 * counted.live < counted.capacity);  // no field was refused for want of a slot
  REQUIRE(counted.refused > 0);
  wfpg::path_guider<Exec> second = loaded(exec, saved(first), options);
  CHECK(second.statistics().kept.refused == counted.refused);
  CHECK(same_counts(first.statistics(), second.statistics()));
  CHECK(saved(second) == saved(first));
  CHECK(trace_paths(exec, second, 3, paths, box_caster()) ==
        trace_paths(exec, first, 3, paths, box_caster()));
  CHECK(same_counts(first.statistics(), second.statistics()));
}

WFPG_TEST_CASE("a guide that records only some samples continues bit for bit", "[guide_file]") {
  const Exec exec;
  wfpg::kept_guide_options options = small_options();
  options.octree_resolution = 8;
  options.deposits_per_leaf = 1;
  for (const bool dark : {false, true}) {  // all samples are recorded for a while after that
    wfpg::path_guider<Exec> first = trained(exec, options, 41);
    REQUIRE(first.guide().recording().sample_stride == 4);
    if (dark) first.forget_light();
    wfpg::path_guider<Exec> second = loaded(exec, saved(first), options);
    CHECK(trace_paths(exec, second, 9, paths, box_caster()) ==
          trace_paths(exec, first, 9, paths, box_caster()));
    CHECK(saved(first) == saved(second));
  }
}

struct deposit_lights {
  wfpg::light_guide_view lights;
  WFPG_HD void operator()(std::size_t i) const {
    const vec2 u = hashed_numbers{8}(static_cast<std::uint32_t>(i), 0);
    const std::uint32_t row = lights.find({u.x, 0.0f, u.y}, {0.0f, 1.0f, 0.0f});
    const wfpg::light_choice choice =
        lights.choose(row, hashed_numbers{8}(static_cast<std::uint32_t>(i), 1).x);
    lights.deposit(i, choice.key, static_cast<float>(choice.group) * u.x / choice.probability);
  }
};

wfpg::kept_guide_options options_with_lights() {
  wfpg::kept_guide_options options = small_options();
  options.lights.weights = {1.0f, 2.0f, 0.5f};
  options.lights.resolution = 4;
  return options;
}

template <class Exec>
wfpg::path_guider<Exec> trained_with_lights(const Exec& exec) {
  wfpg::path_guider<Exec> guider(exec, box_mesh<Exec>(exec).view(), options_with_lights());
  guider.begin_sample();
  exec.for_each(paths, deposit_lights{guider.lights()});
  guider.end_sample();
  return guider;
}

WFPG_TEST_CASE("choices of lights are saved and loaded bit for bit", "[guide_file]") {
  const Exec exec;
  wfpg::path_guider<Exec> first = trained_with_lights(exec);
  const std::string bytes = saved(first);
  const std::string learnt = payload_of(bytes, "lights");
  CHECK(learnt.find_first_not_of('\0') != std::string::npos);
  wfpg::path_guider<Exec> second = loaded(exec, bytes, options_with_lights());
  CHECK(saved(second) == bytes);
  wfpg::path_guider<Exec>* const both[] = {&first, &second};
  for (wfpg::path_guider<Exec>* guider : both) {
    guider->begin_sample();
    exec.for_each(paths, deposit_lights{guider->lights()});
    guider->end_sample();
  }
  CHECK(saved(second) == saved(first));
  CHECK(saved(second) != bytes);
}

WFPG_TEST_CASE("a guider without samples or without surfaces can be saved", "[guide_file]") {
  const Exec exec;
  const wfpg::kept_guide_options options = small_options();
  for (const bool empty : {false, true}) {
    const wfpg::path_guider<Exec> first =
        empty ? wfpg::path_guider<Exec>(exec, wfpg::triangle_mesh_view{}, options)
              : trained(exec, options, 0);
    wfpg::path_guider<Exec> second = loaded(exec, saved(first), options);
    CHECK(saved(second) == saved(first));
    CHECK(second.guide().octree().leaf_count() == first.guide().octree().leaf_count());
    CHECK(trace_paths(exec, second, 2, paths, box_caster()).size() == 2 * paths);
  }
}

WFPG_TEST_CASE("a warm start guides from the first sample, with other options", "[guide_file]") {
  const Exec exec;
  const std::string bytes = saved(trained(exec, small_options()));
  wfpg::kept_guide_options options = small_options();
  options.max_paths = 200;
  options.max_depth = 2;
  options.seed = 7;
  options.binning.rays_per_bin = 8;
  options.kept.budget_bytes *= 2;
  wfpg::path_guider<Exec> warm = loaded(exec, bytes, options);
  CHECK(warm.statistics().depths.size() == 2);
  warm.begin_sample();
  CHECK(warm.guided());
  const auto surfaces = wall_surfaces(200, 3);
  const wave_of_surfaces<Exec> wave(exec, surfaces);
  const wfpg::guide_view view = warm.prepare(wave.get(), box_caster());
  CHECK(count_guided(exec, view, 200) > 150);
}

/// Fractions of a guider's fields, of rays that have one.
template <class Exec>
std::vector<float> fractions_of(const Exec& exec, wfpg::path_guider<Exec> guider) {
  const auto surfaces = wall_surfaces(200, 3);
  const wave_of_surfaces<Exec> wave(exec, surfaces);
  guider.begin_sample();
  std::vector<float> found =
      evaluate(exec, surfaces.size(), fraction_of_ray{guider.prepare(wave.get(), box_caster())});
  found.erase(std::remove(found.begin(), found.end(), 0.0f), found.end());
  return found;
}

WFPG_TEST_CASE("fractions of a guide file are those that the options allow", "[guide_file]") {
  const Exec exec;
  wfpg::kept_guide_options learning = small_options(), pinned = learning, all = learning;
  pinned.guide_fraction = 0.3f;
  all.guide_fraction = 1.0f;
  const std::string learnt = saved(trained(exec, learning, 5)), guided = saved(trained(exec, all, 5));
  const float third = wfpg::resident_field(wfpg::vec3(0.0f), 0.3f).fraction();
  for (const std::string& bytes : {learnt, guided}) {
    const std::vector<float> set = fractions_of(exec, loaded(exec, bytes, pinned));
    CHECK(set.size() > 50);
    CHECK(std::count(set.begin(), set.end(), third) == static_cast<std::ptrdiff_t>(set.size()));
    // A field without a BSDF would make products biased, so a fraction of 1 is not taken over.
    const std::vector<float> free = fractions_of(exec, loaded(exec, bytes, learning));
    CHECK(free.size() > 50);
    CHECK(*std::max_element(free.begin(), free.end()) < 0.951f);
  }
}

WFPG_TEST_CASE("guides with and without learnt radiance load each other's files", "[guide_file]") {
  const Exec exec;
  const wfpg::kept_guide_options learning = small_options();
  wfpg::kept_guide_options without_paths = learning;  // nothing to learn from
  without_paths.max_paths = 0;
  without_paths.max_rays = paths;
  const std::string bytes = saved(trained(exec, learning));
  const wfpg::path_guider<Exec> second = loaded(exec, bytes, without_paths);
  CHECK(second.guide().learnt().empty());
  CHECK(second.statistics().kept.live > 0);
  const std::string other = saved(second);
  CHECK(other.size() < bytes.size());
  wfpg::path_guider<Exec> third = loaded(exec, other, learning);
  CHECK_FALSE(third.guide().learnt().empty());
  CHECK(third.statistics().kept.live == second.statistics().kept.live);
  CHECK(saved(third).size() == bytes.size());
  wfpg::path_guider<Exec> forgetful = loaded(exec, bytes, learning);
  CHECK(saved(third) != bytes);
  forgetful.forget_light();
  third.forget_light();
  CHECK(saved(third) == saved(forgetful));
}

TEST_CASE("truncated, altered and foreign guide files have different errors", "[guide_file]") {
  const wfpg::kept_guide_options options = small_options();
  const std::string bytes = saved(trained(one_policy(), options));
  REQUIRE(fault(bytes, options).empty());

  for (const std::string& foreign : {std::string(), std::string("\x89PNG\r\n\x1a\n................"),
                                     std::string(1000, '\0'), std::string("glTF"), bytes.substr(1)})
    CHECK(fault(foreign, options) == "wfpg: the guide is not a guide file");
  CHECK(fault(with_version(bytes, 9), options) ==
        "wfpg: the guide is of version 9, expected 8 or older: a newer wfpg wrote it");
  CHECK(fault(with_version(bytes, 2), options) == "wfpg: the guide is of version 2, expected 8");
  for (const std::size_t at : {8u, 11u, 12u}) {
    std::string altered = bytes;
    altered[at] = static_cast<char>(altered[at] ^ 1);
    CHECK(fault(altered, options) == "wfpg: the guide is altered: the checksum of its head differs");
  }
  CHECK(fault(bytes.substr(0, 5), options) ==
        "wfpg: the guide is truncated at byte 5, in its head, which has 16 bytes");

  const auto names_it = [&](const std::string& altered, const std::string& text) {
    const std::string message = fault(altered, options);
    INFO(message << " against " << text);
    CHECK(message.find(text) != std::string::npos);
  };
  std::vector<std::string> names;
  for (const section_place& place : sections_of(bytes)) {
    names.push_back(place.name);
    std::string altered = bytes;
    altered[place.head + 9] ^= 1;  // the section's length
    names_it(altered, "altered: the checksum of the head of section " + place.name);
    altered = bytes;
    altered[place.payload + place.size] ^= 1;
    names_it(altered, "altered: the checksum of section " + place.name);
    names_it(bytes.substr(0, place.head + 3),
             "at byte " + std::to_string(place.head + 3) + ", in the head of section " + place.name);
    names_it(bytes.substr(0, place.payload + place.size + 2), "in the checksum of section " + place.name);
    if (place.size == 0) continue;
    altered = bytes;
    altered[place.payload + place.size / 2] ^= 4;
    names_it(altered, "altered: the checksum of section " + place.name);
    names_it(bytes.substr(0, place.payload + place.size - 1),
             ", in section " + place.name + ", which has " + std::to_string(place.size) + " bytes");
    names_it(with_payload(bytes, place.name, payload_of(bytes, place.name) + '\0'), "section " + place.name);
    names_it(with_payload(bytes, place.name, payload_of(bytes, place.name).substr(0, place.size - 1)),
             "section " + place.name + " is too ");
  }
  CHECK(names ==
        std::vector<std::string>{"options", "octree", "cache", "counts", "levels", "fields", "paths", "end"});
  // A length beyond all memory, with a correct checksum.
  const section_place octree = section_of(bytes, "octree");
  std::string endless = bytes;
  set_number(endless, octree.head + 8, 8, ~0ull);
  set_number(endless, octree.head + 16, 8, fnv1a(endless.substr(octree.head, 16)));
  names_it(endless, "in section octree, which has 18446744073709551615 bytes");
  names_it(bytes.substr(0, octree.head) + bytes.substr(section_of(bytes, "cache").head),
           "has no section octree where it belongs");
}

TEST_CASE("guide files truncated anywhere are refused", "[guide_file]") {
  const wfpg::kept_guide_options options = small_options();
  const std::string bytes = saved(trained(one_policy(), options));
  std::size_t read = 0;
  for (std::size_t size = 0; size < bytes.size(); size += 1 + size / 50)
    read += fault(bytes.substr(0, size), options).empty();
  CHECK(read == 0);
}

TEST_CASE("guide files of other options are refused by the option's name", "[guide_file]") {
  const wfpg::kept_guide_options options = options_with_lights();
  const std::string bytes = saved(trained(one_policy(), options));
  const auto refused = [&](const char* name, auto change) {
    wfpg::kept_guide_options other = options;
    change(other);
    const std::string message = fault(bytes, other);
    INFO(message);
    CHECK(message.find(std::string("option ") + name + " ") != std::string::npos);
  };
  refused("octree_resolution", [](wfpg::kept_guide_options& o) { o.octree_resolution = 16; });
  refused("mode", [](wfpg::kept_guide_options& o) { o.mode = guiding_mode::plain; });
  wfpg::transient_guide_options transient;
  static_cast<wfpg::octree_guide_options&>(transient) = options;
  CHECK(fault(bytes, transient).find("option fields ") != std::string::npos);
  refused("kept.resolution", [](wfpg::kept_guide_options& o) { o.kept.resolution = 8; });
  refused("kept.learn", [](wfpg::kept_guide_options& o) { o.kept.learn = false; });
  refused("kept.budget_bytes", [](wfpg::kept_guide_options& o) { o.kept.budget_bytes /= 40; });
  refused("lights.resolution", [](wfpg::kept_guide_options& o) { o.lights.resolution = 8; });
  refused("lights.weights.size()", [](wfpg::kept_guide_options& o) { o.lights.weights = {1.0f, 1.0f}; });
  wfpg::kept_guide_options invalid = options;
  invalid.binning.rays_per_bin = 0;
  CHECK_THROWS_AS(loaded(one_policy(), bytes, invalid), std::invalid_argument);
}

TEST_CASE("a guide file stores the octree's resolution, which fragments decide", "[guide_file]") {
  const one_policy exec;
  wfpg::kept_guide_options options = small_options();
  wfpg::path_guider<one_policy> guider(exec, wfpg::voxelize(exec, box_mesh<one_policy>(exec).view(), 16),
                                       options);
  trace_paths(exec, guider, 3, paths, box_caster());
  const std::string bytes = saved(guider);
  const std::string message = fault(bytes, options);
  INFO(message);
  CHECK(message.find("option octree_resolution 16, the guider's is 8") != std::string::npos);
  options.octree_resolution = 16;
  CHECK(saved(loaded(exec, bytes, options)) == bytes);
}

TEST_CASE("the content of a guide file is checked, even if its checksums are right", "[guide_file]") {
  const wfpg::kept_guide_options options = small_options();
  const std::string bytes = saved(trained(one_policy(), options));
  const std::uint64_t infinity = 0x7f800000u, nan = 0x7ff8000000000000ull;
  const auto refused = [&](const char* section, std::size_t at, std::size_t n, std::uint64_t value,
                           const std::string& reason) {
    const std::string message = fault(with_number(bytes, section, at, n, value), options);
    INFO(message << " against " << reason);
    CHECK(message == std::string("wfpg: the guide section ") + section + " " + reason);
  };
  refused("octree", 0, 4, infinity, "has no cube that floats can divide");
  refused("octree", 12, 4, 0, "has no cube that floats can divide");
  refused("octree", 16, 8, ~0ull, "has leaves out of order");
  refused("octree", 24, 8, 0, "has leaves out of order");
  refused("octree", section_of(bytes, "octree").size - 8, 8, 8 * 8 * 8, "has leaves out of order");

  const wfpg::path_guider<one_policy> guider = loaded(one_policy(), bytes, options);
  const std::size_t nodes = guider.guide().octree().node_count(),
                    leaves = guider.guide().octree().leaf_count();
  refused("cache", 0, 2, 0xff00, "has normals that are none");
  refused("cache", 3 * nodes - leaves, 8, nan, "has radiance that is negative or not finite");
  refused("cache", 3 * nodes - leaves, 8, 1ull << 63 | 0x3ff0000000000000ull,
          "has radiance that is negative or not finite");
  refused("counts", 0, 4, 0x80000000u, "has samples without end");
  refused("counts", 4, 4, 36, "warms up until after samples that are to come");
  refused("counts", 12, 4, 6, "has rests that no guider has");
  refused("counts", 16, 4, 5, "rests in samples that are to come");
  refused("counts", 20, 4, 3, "has rests that no guider has");
  refused("counts", 24, 4, 0, "has rests that no guider has");
  refused("counts", 28, 4, 0x3f000000u, "has rests that no guider has");
  refused("counts", 32, 4, 4, "has rests that no guider has");
  refused("counts", 36, 4, 0x3f000000u, "has rests that no guider has");
  refused("counts", 40, 4, 0x3f000000u, "has rests that no guider has");
  refused("counts", 52, 8, nan, "has a gain out of range");
  refused("counts", 108, 8, nan, "has a gain out of range");
  refused("paths", 0, 4, 2 * nodes, "has paths from no node");
  for (const std::size_t at : {8u, 20u, 24u})
    refused("paths", at, 4, infinity, "has radiance that is not finite");
  refused("paths", section_of(bytes, "paths").size - 4, 4, infinity, "has radiance that is not finite");
  refused("levels", 0, 4, 4, "has more samples than there were");
  refused("levels", 4, 4, 36, "has more samples than there were");
  refused("levels", 8, 4, 4, "has more samples than there were");
  refused("levels", 12, 4, 32, "has bins for too few paths");
  refused("levels", 16 + 5 * leaves - 1, 1, 4, "has a level below the leaves");

  refused("fields", 0, 4, 1, "has a pressure out of range");
  constexpr std::size_t slot = 32, cells = slot + 36;  // the first slot in use, and its cells
  refused("fields", slot, 4, 40, "has more fields than option kept.budget_bytes has room for");
  refused("fields", slot + 4, 4, 8 * nodes, "has a field of no node");
  refused("fields", slot + 8, 4, 4, "has a field of a sample to come");
  refused("fields", slot + 20, 4, infinity, "has a normal without unit length");
  refused("fields", slot + 32, 4, 0x40000000u, "has a field of one fraction");
  refused("fields", slot + 32, 4, 0, "has a field without cells");
  refused("fields", cells, 4, 0xffffffffu, "has a field that is no distribution");
  refused("fields", cells + 64, 4, 0xffffffffu,
          "has a field that is no distribution");  // the first row's sum
  refused("fields", cells + 80, 4, 2 * nodes, "has a cone that hit no node");
  const std::string lit = saved(trained_with_lights(one_policy()));
  CHECK(fault(with_number(lit, "lights", 0, 4, 0xffffff01u), options_with_lights())
            .find("section lights has learnt light out of range") != std::string::npos);
  const std::string fields = payload_of(bytes, "fields");
  constexpr std::size_t learnt = cells + 80 + 64 + 32;  // what the field's fractions learnt
  refused("fields", learnt, 4, infinity, "has a fraction that learnt from what is no number");
  refused("fields", learnt, 4, 0x7f61b1e6u, "has a fraction that learnt from what is no number");  // 3e38
  refused("fields", learnt + 8, 4, 0xbf800000u, "has a fraction that learnt from what is no number");
  const std::size_t one = 36 + 80 + 64 + 32 + 32;
  std::string twice = fields.substr(0, slot) + fields.substr(slot, one) + fields.substr(slot, one);
  CHECK(fault(with_payload(bytes, "fields", twice), options).find("slots out of order") != std::string::npos);
  set_number(twice, slot + one, 4, number_in(twice, slot, 4) + 1);
  CHECK(fault(with_payload(bytes, "fields", twice), options).find("a field twice") != std::string::npos);
}

/// Bytes altered anywhere, with correct checksums, are refused or give a guider that guides.
TEST_CASE("guide files with random bytes do no harm", "[guide_file]") {
  const one_policy exec;
  const wfpg::kept_guide_options options = small_options();
  const std::string bytes = saved(trained(exec, options));
  const std::vector<section_place> places = sections_of(bytes);
  random_numbers random(5);
  std::size_t refused = 0, guided = 0;
  for (int round = 0; round < 400; ++round) {
    const section_place& place = places[1 + random.below(5)];
    std::string payload = payload_of(bytes, place.name);
    for (int i = 0; i < 2; ++i)
      payload[random.below(static_cast<std::uint32_t>(payload.size()))] = static_cast<char>(random.bits());
    try {
      wfpg::path_guider<one_policy> guider = loaded(exec, with_payload(bytes, place.name, payload), options);
      trace_paths(exec, guider, 2, 100, box_caster());
      ++guided;
    } catch (const wfpg::file_error&) {
      ++refused;
    }
  }
  CHECK(refused > 50);
  CHECK(guided > 50);
}

TEST_CASE("saving replaces a guide file as a whole", "[guide_file]") {
  const one_policy exec;
  const wfpg::kept_guide_options options = small_options();
  const temporary_folder folder;
  const std::string path = folder.file("a.guide");
  folder.write("a.guide", "something older");
  const wfpg::path_guider<one_policy> guider = trained(exec, options);
  wfpg::save_guide(guider, path);
  CHECK(content_of(path) == saved(guider));
  CHECK(files_in(folder) == 1);
  CHECK(saved(wfpg::load_guide(exec, path, options)) == saved(guider));

  const auto fault_of = [&](auto call) -> std::string {
    try {
      call();
    } catch (const wfpg::file_error& error) {
      return error.what();
    }
    return "";
  };
  const auto load = [&](const std::string& from) {
    return fault_of([&] { wfpg::load_guide(exec, from, options); });
  };
  CHECK(load(folder.file("none")) == "wfpg: " + folder.file("none") + " cannot be opened");
  CHECK(load(folder.file("")) == "wfpg: " + folder.file("") + " cannot be opened");
  CHECK(load(folder.write("noise", "noise")) == "wfpg: " + folder.file("noise") + " is not a guide file");
  CHECK(load(folder.write("more", content_of(path) + "x")) ==
        "wfpg: " + folder.file("more") + " goes on after its end");
  const auto save = [&](const std::string& to) { return fault_of([&] { wfpg::save_guide(guider, to); }); };
  CHECK(save(folder.file("none/a.guide")) ==
        "wfpg: " + folder.file("none/a.guide") + " cannot be written: No such file or directory");
  std::istringstream with_more(saved(guider) + "tail");
  wfpg::load_guide(exec, with_more, options);
  std::string left;
  with_more >> left;
  CHECK(left == "tail");
  std::ostringstream broken;
  broken.setstate(std::ios::badbit);
  CHECK(fault_of([&] { wfpg::save_guide(guider, broken); }) == "wfpg: the guide cannot be written");
}

}  // namespace
