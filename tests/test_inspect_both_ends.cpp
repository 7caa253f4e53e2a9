// wfpg-inspect on paths from both ends: what techniques bring to a pixel, photons in reach of its path,
// radii, and the page.
#include "app/option_names.hpp"
#include "both_ends.hpp"
#include "path_drawing.hpp"
#include "program.hpp"
#include "scene/builtin_scenes.hpp"
#include "support/catch.hpp"
#include "support/command_lines.hpp"
#include "support/inspections.hpp"
#include "support/renderer_io.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace {

using namespace render_test;
using glm::dvec3;
using inspect::both_ends;
using inspect::found_photon;
using render::technique;

constexpr int side = 24, samples = 3;
constexpr technique merging[] = {technique::surf, technique::pp3d, technique::pb2d, technique::bb1d};

render::render_options options_of(render::sampling_method method) {
  render::render_options options;
  options.method = method;
  options.width = options.height = side;
  options.spp = samples;
  options.max_depth = 6;
  options.seed = 5;
  options.light.surface_radius = 0.05f;
  options.light.volume_radius = 0.06f;
  options.light.beam_paths = side * side;
  return options;
}

struct looked_at {
  render::scene scene;
  render::render_options options;

  looked_at(const std::string& name, render::sampling_method method)
      : scene(render::make_builtin_scene(name)), options(options_of(method)) {}
  both_ends at(std::size_t pixel, int sample = 0) const {
    return inspect::look_at(scene, options, {pixel, sample}, {});
  }
};

/// Scenes in which all techniques find light: on surfaces, in fog, in dense media.
std::vector<looked_at> all_looked_at() {
  return {{"caustic-pool", render::sampling_method::vcm},
          {"fog-spot", render::sampling_method::upbp},
          {"wax", render::sampling_method::upbp}};
}

constexpr std::size_t pixels[] = {5 * side + 11, 12 * side + 12, 20 * side + 4};

double luminance(vec3 v) {
  return double(wfpg::luminance(v));
}

/// Distance of a photon from what it merges with; negative where that has no place for it.
double distance_from(const wfpg::path_beam& along, vec3 photon) {
  const dvec3 way = dvec3(photon) - dvec3(along.origin), direction(along.direction);
  const double t = glm::dot(way, direction);
  return t >= double(along.begin) && t < double(along.end) ? glm::length(way - t * direction) : -1.0;
}

double distance_from(const wfpg::path_beam& along, const wfpg::path_beam& light) {
  const dvec3 a(along.direction), b(light.direction), way = dvec3(light.origin) - dvec3(along.origin);
  const double c = glm::dot(a, b), sine2 = 1.0 - c * c;
  if (!(sine2 > 1e-8)) return -1.0;
  const double s = (glm::dot(way, a) - c * glm::dot(way, b)) / sine2;
  const double t = (c * glm::dot(way, a) - glm::dot(way, b)) / sine2;
  const bool has_place =
      s >= double(along.begin) && s < double(along.end) && t >= double(light.begin) && t < double(light.end);
  return has_place ? glm::length(way + t * b - s * a) : -1.0;
}

/// Distances within the radius, ascending. Those at its very edge depend on rounding.
struct distances {
  double radius;
  std::vector<double> within;
  std::size_t at_edge = 0;

  void add(double distance) {
    if (distance < 0.0) return;
    if (std::fabs(distance / radius - 1.0) < 1e-4)
      ++at_edge;
    else if (distance < radius)
      within.push_back(distance);
  }
};

/// Distances of all stored photons from a segment and the vertex at its end.
distances by_brute_force(const both_ends& found, technique by, std::uint32_t segment,
                         std::uint32_t max_depth) {
  const inspect::path_step& step = found.path.steps[segment - 1];
  distances all{double(found.radius_of(by)), {}};
  if (segment == max_depth) return all;
  const bool in_medium = step.at == inspect::arrival::medium,
             on_surface = step.at == inspect::arrival::surface;
  if ((by == technique::surf && on_surface) || (by == technique::pp3d && in_medium))
    for (const vec3 photon : in_medium ? found.stored.in_media : found.stored.on_surfaces)
      all.add(glm::length(dvec3(photon) - dvec3(step.end)));
  for (const inspect::merged_part& part : found.path.parts) {
    if (part.segments != segment) continue;
    if (by == technique::pb2d)
      for (const vec3 photon : found.stored.in_media) all.add(distance_from(part.along, photon));
    if (by == technique::bb1d)
      for (const wfpg::path_beam& beam : found.stored.beams) all.add(distance_from(part.along, beam));
  }
  std::sort(all.within.begin(), all.within.end());
  return all;
}

distances listed(const both_ends& found, technique by, std::uint32_t segment) {
  distances all{double(found.radius_of(by)), {}};
  for (const found_photon& p : found.photons)
    if (p.near.where.by == by && p.near.where.segments == segment) all.add(double(p.distance));
  std::sort(all.within.begin(), all.within.end());
  return all;
}

outcome run(std::vector<std::string> arguments) {
  return run_command(inspect::run_program, "wfpg-inspect", arguments);
}

}  // namespace

TEST_CASE("inspect: techniques' means are those of the renderer's technique pictures", "[inspect]") {
  for (const looked_at& look : all_looked_at()) {
    render::render_options options = look.options;
    options.technique_pictures = true;
    const render::render_result rendered = render::render(look.scene, options, {});
    for (const std::size_t pixel : pixels) {
      const both_ends found = look.at(pixel);
      INFO(look.scene.name << ", pixel " << pixel);
      CHECK(found.samples == samples);
      CHECK(found.picture.pixels == rendered.picture.pixels);
      REQUIRE(found.techniques.size() == rendered.by_technique.size());
      double share = 0.0;
      for (std::size_t i = 0; i < found.techniques.size(); ++i) {
        const inspect::technique_findings& t = found.techniques[i];
        const render::technique_images& images = rendered.by_technique[i];
        INFO(render::name_of(t.by));
        CHECK(t.by == images.by);
        CHECK(t.weighted.mean == images.weighted.pixels[pixel]);
        CHECK(t.plain == images.plain.pixels[pixel]);
        share += t.share;
      }
      check_close(found.all.mean, rendered.picture.pixels[pixel],
                  1e-5f * glm::length(rendered.picture.pixels[pixel]));
      CHECK(share == Approx(1.0));
    }
  }
}

TEST_CASE("inspect: variances and brightest samples are those of the samples, one by one", "[inspect]") {
  const looked_at look("fog-spot", render::sampling_method::upbp);
  const both_ends whole = look.at(pixels[1]);
  std::vector<both_ends> single;
  for (int sample = 1; sample <= samples; ++sample) {
    single.push_back(look.at(pixels[1], sample));
    CHECK(single.back().shown == sample);
  }
  for (std::size_t i = 0; i < whole.techniques.size(); ++i) {
    const inspect::sample_statistics& all = whole.techniques[i].weighted;
    INFO(render::name_of(whole.techniques[i].by));
    double sum = 0.0, squares = 0.0, greatest = 0.0, lit = 0.0;
    int brightest = 0;
    for (const both_ends& one : single) {
      const double value = luminance(one.techniques[i].in_sample.weighted);
      sum += value;
      squares += value * value;
      lit += value > 0.0;
      if (value > greatest) brightest = one.shown;
      greatest = std::max(greatest, value);
    }
    const double mean = sum / samples, variance = (squares - sum * mean) / (samples - 1);
    CHECK(luminance(all.mean) == Approx(mean).epsilon(1e-5));
    CHECK(all.variance == Approx(variance).epsilon(1e-4).margin(1e-12));
    CHECK(all.greatest == Approx(greatest));
    CHECK(all.brightest == brightest);
    CHECK(all.lit == Approx(lit / samples));
  }
}

TEST_CASE("inspect: the sample that is shown is the one to which merges bring most", "[inspect]") {
  const looked_at look("caustic-pool", render::sampling_method::vcm);
  int others = 0;  // are brighter
  for (std::size_t pixel = side; pixel < side * side; pixel += 4 * side + 7) {
    double most_merged = 0.0, brightest = 0.0;
    int merged_in = 0, brightest_in = 0;
    for (int sample = 1; sample <= samples; ++sample) {
      const both_ends one = look.at(pixel, sample);
      double merged = 0.0, all = 0.0;
      for (const found_photon& p : one.photons) merged += luminance(p.contribution());
      for (const inspect::technique_findings& t : one.techniques) all += luminance(t.in_sample.weighted);
      if (merged > most_merged) merged_in = sample;
      if (all > brightest) brightest_in = sample;
      most_merged = std::max(most_merged, merged);
      brightest = std::max(brightest, all);
    }
    INFO("pixel " << pixel);
    CHECK(look.at(pixel).shown == std::max(merged_in > 0 ? merged_in : brightest_in, 1));
    others += merged_in > 0 && merged_in != brightest_in;
  }
  CHECK(others > 0);
}

TEST_CASE("inspect: merges that are listed add up to what techniques find in the sample", "[inspect]") {
  std::map<technique, int> lit;
  for (const looked_at& look : all_looked_at())
    for (const std::size_t pixel : pixels) {
      const int sample = 1 + static_cast<int>(pixel % samples);
      const both_ends found = look.at(pixel, sample);
      INFO(look.scene.name << ", pixel " << pixel);
      CHECK(found.shown == sample);
      for (const inspect::technique_findings& t : found.techniques) {
        if (std::find(std::begin(merging), std::end(merging), t.by) == std::end(merging)) continue;
        INFO(render::name_of(t.by));
        dvec3 weighted(0.0), plain(0.0);
        for (const found_photon& p : found.photons) {
          if (p.near.where.by != t.by) continue;
          weighted += dvec3(p.contribution());
          plain += dvec3(p.near.value);
        }
        check_close(vec3(weighted), t.in_sample.weighted, 1e-5f * glm::length(t.in_sample.weighted));
        check_close(vec3(plain), t.in_sample.plain, 1e-5f * glm::length(t.in_sample.plain));
        lit[t.by] += luminance(t.in_sample.weighted) > 0.0;
      }
    }
  for (const technique by : merging) {
    INFO(render::name_of(by));
    CHECK(lit[by] >= 1);
  }
}

TEST_CASE("inspect: photons in reach are those that brute force finds", "[inspect]") {
  std::map<technique, std::size_t> compared;
  std::size_t at_edges = 0;
  for (const looked_at& look : all_looked_at())
    for (const std::size_t pixel : pixels) {
      const both_ends found = look.at(pixel);
      REQUIRE(!found.path.steps.empty());
      for (const inspect::shrinking_radius& r : found.radii)
        for (std::uint32_t segment = 1; segment <= found.path.steps.size(); ++segment) {
          const auto depth = static_cast<std::uint32_t>(look.options.max_depth);
          const distances expected = by_brute_force(found, r.by, segment, depth);
          const distances photons = listed(found, r.by, segment);
          INFO(look.scene.name << ", pixel " << pixel << ", " << render::name_of(r.by) << ", segment "
                               << segment);
          REQUIRE(photons.within.size() == expected.within.size());
          for (std::size_t i = 0; i < photons.within.size(); ++i)
            CHECK(photons.within[i] == Approx(expected.within[i]).margin(1e-3 * photons.radius));
          compared[r.by] += expected.within.size();
          at_edges += expected.at_edge;
        }
    }
  for (const technique by : merging) {
    INFO(render::name_of(by));
    CHECK(compared[by] >= 20);
  }
  CHECK(at_edges < 20);
}

TEST_CASE("inspect: radii are those of the sample, and shrink by their dimension", "[inspect]") {
  const looked_at look("fog-spot", render::sampling_method::upbp);
  const both_ends found = look.at(pixels[0], 2);
  REQUIRE(found.radii.size() == 4);
  const double exponents[] = {1.0 / 2.0, 1.0 / 3.0, 1.0 / 2.0, 1.0};
  for (std::size_t i = 0; i < 4; ++i) {
    const inspect::shrinking_radius& r = found.radii[i];
    const double exponent = (double(look.options.light.radius_alpha) - 1.0) * exponents[i];
    CHECK(r.by == merging[i]);
    CHECK(double(r.shown) == Approx(double(r.first) * std::pow(2.0, exponent)));
    CHECK(double(r.last) == Approx(double(r.first) * std::pow(double(samples), exponent)));
    for (const found_photon& p : found.photons)
      if (p.near.where.by == r.by) CHECK(p.radius == r.shown);
  }
  CHECK(found.radii[0].first == Approx(5.0 / 6.0 * double(found.radii[1].first)));
  // Of a picture twice as large, a pixel is half as wide.
  looked_at finer = look;
  finer.options.width = finer.options.height = 2 * side;
  const both_ends fine = finer.at(2 * side * side + side, 1), coarse = look.at(side * side / 2 + side / 2, 1);
  REQUIRE(coarse.pixel_width > 0.0f);
  const auto angle = [](const both_ends& f) {
    return f.pixel_width / glm::length(f.path.steps[0].end - f.path.steps[0].begin);
  };
  CHECK(angle(fine) == Approx(0.5f * angle(coarse)).epsilon(0.02));
}

TEST_CASE("inspect: methods without merges have techniques alone", "[inspect]") {
  for (const auto method : {render::sampling_method::bpt, render::sampling_method::lt}) {
    const both_ends found = looked_at("cornell-box", method).at(pixels[1]);
    CHECK(found.radii.empty());
    CHECK(found.photons.empty());
    CHECK(!found.path.steps.empty());
    CHECK(found.techniques.size() == (method == render::sampling_method::bpt ? 4 : 2));
    CHECK(luminance(found.all.mean) > 0.0);
  }
}

TEST_CASE("inspect: the program writes a page on paths from both ends", "[inspect]") {
  temporary_folder folder;
  const std::string output = folder.file("page");
  const outcome done = run({"fog-spot", "--pixel",      "12,12", "--method", "upbp", "--size",
                            "24x24",    "--spp",        "3",     "--radius", "0.05", "--volume-radius",
                            "0.06",     "--beam-paths", "576",   "--seed",   "5",    "--max-depth",
                            "6",        "-o",           output});
  INFO(done.log);
  REQUIRE(done.code == 0);
  CHECK(done.out == output + "/index.html\n");
  const std::string page = content_of(output + "/index.html");
  CHECK_FALSE(contains(page, "http"));
  CHECK(contains(page, "data:image/svg+xml;base64,"));
  for (const std::string part :
       {"<h2>Techniques</h2>", "<h2>Radii</h2>", "<h2>Merges of sample ", "<td>bb1d</td>"})
    CHECK(contains(page, part));
  const auto numbers = nlohmann::json::parse(content_of(output + "/numbers.json"));
  const both_ends found = looked_at("fog-spot", render::sampling_method::upbp).at(12 * side + 12);
  CHECK(numbers["method"] == "upbp");
  CHECK(numbers["techniques"] == "hits+nee+connect+splat+surf+pp3d+pb2d+bb1d");
  CHECK(numbers["rendered"] == samples);
  CHECK(numbers["sample"] == found.shown);
  CHECK(numbers["by_technique"].size() == 8);
  CHECK(numbers["radii"].size() == 4);
  CHECK(numbers["path"].size() == found.path.steps.size());
  REQUIRE(numbers["photons"].size() == found.photons.size());
  for (std::size_t i = 0; i < found.photons.size(); ++i) {
    const found_photon& p = found.photons[i];
    CHECK(numbers["photons"][i]["technique"] == render::name_of(p.near.where.by));
    CHECK(numbers["photons"][i]["distance"].get<float>() == Approx(p.distance));
    CHECK(numbers["photons"][i]["contribution"][1].get<float>() == Approx(p.contribution().y));
    CHECK(numbers["photons"][i]["merges"] == p.near.merges);
  }
  for (const std::string file : {"path.svg", "segment-1.svg"})
    CHECK(contains(content_of(output + "/" + file), "<circle"));
  for (const std::string name : {"picture", "crop", "crop-hits", "crop-bb1d"})
    CHECK(std::filesystem::exists(output + "/" + name + ".png"));
}

TEST_CASE("inspect: drawings have a dot for each photon at a vertex", "[inspect]") {
  const both_ends found = looked_at("caustic-pool", render::sampling_method::vcm).at(pixels[1]);
  const std::string mark = std::string("fill=\"") + inspect::colour_of(technique::surf);
  for (std::uint32_t segment = 1; segment <= found.path.steps.size(); ++segment) {
    if (found.path.steps[segment - 1].at != inspect::arrival::surface) continue;
    const std::string drawn = inspect::vertex_drawing(found, segment, {0.0f, 1.0f, 0.0f}).content();
    std::size_t dots = 0, merged = 0;
    for (std::size_t at = drawn.find(mark); at != std::string::npos; at = drawn.find(mark, at + 1)) ++dots;
    for (const found_photon& p : found.photons) merged += p.near.merges && p.near.where.segments == segment;
    CHECK(dots == merged);
  }
}

TEST_CASE("inspect: invalid arguments of paths from both ends are named before rendering", "[inspect]") {
  temporary_folder folder;
  const std::string output = folder.file("none");
  const auto error = [&](std::vector<std::string> arguments, const std::string& method = "upbp") {
    arguments.insert(arguments.begin(), {"fog-spot", "--size", "16x8", "-o", output, "--method", method});
    const outcome failed = run(std::move(arguments));
    CHECK(failed.code == 2);
    CHECK(failed.out.empty());
    CHECK_FALSE(std::filesystem::exists(output));
    CHECK_FALSE(contains(failed.log, "rendering"));
    return failed.log;
  };
  CHECK(contains(error({"--pixel", "16,0"}), "pixel's x is 16, expected 0 to 15"));
  CHECK(contains(error({"--pixel", "0,-1"}), "pixel's y is -1, expected 0 to 7"));
  CHECK(contains(error({"--pixel", "0,0", "--spp", "4", "--sample", "5"}), "sample is 5, expected 1 to 4"));
  CHECK(contains(error({"--pixel", "0,0", "--sample", "0"}), "--sample: expected a whole number from 1"));
  CHECK(contains(error({"--pixel", "0,0", "--sample", "1", "--seconds", "1"}), "--sample requires --spp"));
  CHECK(contains(error({"--pixel", "0,0", "--sample", "1"}, "wfpg"),
                 "--sample requires --method bpt, vcm, upbp"));
  CHECK(contains(error({"--pixel", "0,0", "--radius", "0.1"}, "wfpg"),
                 "--radius requires --method vcm or upbp"));
  CHECK(contains(error({"--pixel", "0,0", "--techniques", "surf"}, "lt"),
                 "--techniques requires --method bpt"));
  CHECK(contains(error({"--pixel", "0,0", "--techniques", "surf+x"}), "--techniques"));
  for (const std::string option : {"--reference-spp", "--histogram"})
    CHECK(
        contains(error({"--pixel", "0,0", option, "4"}), option + " requires --method wfpg or wfpg-product"));
  CHECK(contains(error({"--pixel", "0,0", "--vdb", "v"}), "--vdb requires --method wfpg or wfpg-product"));
  CHECK(contains(error({"--pixel", "0,0", "--combine", "constant"}), "--combine requires --method wfpg"));
  CHECK(contains(error({"--pixel", "0,0", "--device", "seq"}), "device is seq, expected cpu"));
  CHECK(contains(error({"--pixel", "0,0"}, "pt"), "method is pt, expected"));
}
