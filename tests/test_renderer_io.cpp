// The renderer's pictures, error measures and built-in scenes.
#include "app/image_io.hpp"
#include "app/metrics.hpp"
#include "app/plot.hpp"
#include "scene/builtin_scenes.hpp"
#include "scene/frame.hpp"
#include "scene/scene_builder.hpp"
#include "support/catch.hpp"
#include "support/renderer_io.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace {

using namespace render_test;
using render::image;
using render::material_kind;

image grey(int width, int height, float value) {
  image picture = render::make_image(width, height);
  for (vec3& pixel : picture.pixels) pixel = vec3(value);
  return picture;
}

template <class Call>
std::string error_of(const Call& call) {
  try {
    call();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "nothing was thrown";
}

std::string error_of_read(const std::string& path) {
  return error_of([&] { render::read_exr(path); });
}

}  // namespace

TEST_CASE("OpenEXR: a round trip is exact", "[renderer][exr]") {
  temporary_folder folder;
  image picture = render::make_image(7, 5);
  for (std::size_t i = 0; i < picture.pixels.size(); ++i)
    picture.pixels[i] = vec3(float(i) / 3.0f, -1.0f / float(i + 1), 1e20f * float(i));
  picture.pixels[3].y = std::numeric_limits<float>::infinity();
  render::write_exr(folder.file("a.exr"), picture);
  const image back = render::read_exr(folder.file("a.exr"));
  REQUIRE(back.width == 7);
  REQUIRE(back.height == 5);
  CHECK(std::memcmp(back.pixels.data(), picture.pixels.data(), 35 * sizeof(vec3)) == 0);
}

TEST_CASE("OpenEXR: failures name the path", "[renderer][exr]") {
  temporary_folder folder;
  CHECK(contains(error_of_read("/nonexistent/x.exr"), "/nonexistent/x.exr: "));
  const std::string noise = folder.write("noise.exr", std::string(300, 'x'));
  CHECK(contains(error_of_read(noise), noise + ": "));
  const std::string whole = folder.file("whole.exr");
  image picture = render::make_image(16, 64);
  for (std::size_t i = 0; i < picture.pixels.size(); ++i) picture.pixels[i] = vec3(std::sin(float(i)));
  render::write_exr(whole, picture);
  const std::string bytes = content_of(whole);
  for (std::size_t part : {std::size_t(20), bytes.size() / 3, bytes.size() - 40}) {
    const std::string cut = folder.write("cut.exr", bytes.substr(0, part));
    CHECK(contains(error_of_read(cut), cut + ": "));
  }
  CHECK_THROWS_AS(render::write_exr("/nonexistent/x.exr", grey(2, 2, 1.0f)), std::runtime_error);
  CHECK_THROWS_AS(render::write_exr(folder.file("none.exr"), image{}), std::runtime_error);
  CHECK_THROWS_AS(render::write_png("/nonexistent/x.png", grey(2, 2, 1.0f)), std::runtime_error);
}

TEST_CASE("Environments: OpenEXR and Radiance HDR load, and errors name their fault",
          "[renderer][environment]") {
  temporary_folder folder;
  render::write_exr(folder.file("a.exr"), grey(4, 2, 1.5f));
  CHECK(render::read_environment(folder.file("a.exr")).texels == std::vector<vec3>(8, vec3(1.5f)));

  // Uncompressed pixels of 4 bytes. Values are (mantissa + 1/2) / 256 times 2^(exponent - 128), or without
  // the half.
  const std::string head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 3\n";
  std::string pixels;
  for (int i = 0; i < 6; ++i) pixels += std::string("\x80\x40\x20\x82", 4);
  const render::environment_map map = render::read_environment(folder.write("a.hdr", head + pixels));
  REQUIRE((map.width == 3 && map.height == 2 && map.texels.size() == 6));
  check_close(map.texels[5], {2.0f, 1.0f, 0.5f}, 0.02f);

  const auto error = [](const std::string& path) -> std::string {
    try {
      render::read_environment(path);
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "nothing was thrown";
  };
  for (const std::string& path :
       {folder.file("no.hdr"), folder.file("no.exr"), folder.write("noise.hdr", "noise"),
        folder.write("cut.hdr", head + pixels.substr(0, 9)), folder.write("head.hdr", head)})
    CHECK(error(path).rfind(path + ": ", 0) == 0);
  CHECK(contains(error(folder.file("cut.hdr")), "cut off"));
  render::write_exr(folder.file("negative.exr"), grey(2, 1, -1.0f));
  CHECK(contains(error(folder.file("negative.exr")), "negative"));
  render::write_exr(folder.file("nan.exr"), grey(2, 1, std::numeric_limits<float>::quiet_NaN()));
  CHECK(contains(error(folder.file("nan.exr")), "finite"));
  image bright = grey(2, 1, 1.0f);
  bright.pixels[1].y = 3e38f;
  render::write_exr(folder.file("bright.exr"), bright);
  CHECK(error(folder.file("bright.exr")) ==
        folder.file("bright.exr") + ": has radiance of 3e+38 W/(m^2 sr), at most 1e+15 is supported");
  bright.pixels[1].y = render::largest_radiance;
  render::write_exr(folder.file("bright.exr"), bright);
  CHECK(error(folder.file("bright.exr")) == "nothing was thrown");
}

TEST_CASE("PNG: a complete file is written, and errors name the path", "[renderer][png]") {
  const temporary_folder folder;
  const std::string path = folder.file("a.png");
  render::write_png(path, grey(4, 3, 0.5f), 1.0f);
  const std::string bytes = content_of(path);
  CHECK(bytes.substr(1, 3) == "PNG");
  CHECK(bytes.substr(bytes.size() - 8, 4) == "IEND");
  for (const std::string& nowhere : {folder.file("none/a.png"), std::string("/dev/full")})
    CHECK(contains(error_of([&] { render::write_png(nowhere, grey(4, 3, 0.5f), 1.0f); }), nowhere));
}

TEST_CASE("The sRGB curve and its inverse agree", "[renderer][png]") {
  for (int i = 0; i <= 255; ++i) {
    const float encoded = float(i) / 255.0f;
    CHECK(render::linear_to_srgb(render::srgb_to_linear(encoded)) == Approx(encoded).margin(1e-5));
  }
  CHECK(render::srgb_to_linear(0.5f) == Approx(0.21404f).margin(1e-4));
}

TEST_CASE("Pictures can be put side by side", "[renderer][png]") {
  const image row = render::side_by_side({grey(2, 3, 0.25f), grey(1, 2, 0.5f)}, 2);
  REQUIRE(row.width == 5);
  REQUIRE(row.height == 3);
  check_close(row.pixels[0], vec3(0.25f));
  check_close(row.pixels[2], vec3(1.0f));
  check_close(row.pixels[4], vec3(0.5f));
  check_close(row.pixels[14], vec3(1.0f));
  CHECK_THROWS_AS(render::side_by_side({}, 2), std::invalid_argument);
}

TEST_CASE("Pictures can be enlarged and cropped", "[renderer][png]") {
  image picture = grey(3, 2, 0.0f);
  for (std::size_t i = 0; i < 6; ++i) picture.pixels[i] = vec3(float(i));
  const image large = render::enlarged(picture, 2);
  REQUIRE((large.width == 6 && large.height == 4));
  check_close(large.pixels[0], vec3(0.0f));
  check_close(large.pixels[7], vec3(0.0f));
  check_close(large.pixels[23], vec3(5.0f));
  const image crop = render::cropped(picture, 1, 0, 2, 2);
  REQUIRE((crop.width == 2 && crop.height == 2));
  CHECK(crop.pixels == std::vector<vec3>{vec3(1.0f), vec3(2.0f), vec3(4.0f), vec3(5.0f)});
  CHECK_THROWS_AS(render::cropped(picture, 2, 0, 2, 2), std::invalid_argument);
  CHECK_THROWS_AS(render::cropped(picture, -1, 0, 2, 2), std::invalid_argument);
  CHECK_THROWS_AS(render::cropped(picture, 0, 0, 0, 2), std::invalid_argument);
}

TEST_CASE("Errors of hand-made pictures are right", "[renderer][metrics]") {
  const render::image_error none = render::compare(grey(4, 4, 2.0f), grey(4, 4, 2.0f));
  CHECK(none.mse == 0.0);
  CHECK((none.relmse == 0.0 && none.mse_reinhard == 0.0));

  const render::image_error one = render::compare(grey(4, 4, 3.0f), grey(4, 4, 1.0f));
  CHECK(one.mse == Approx(4.0));
  CHECK(one.relmse == Approx(4.0 / 1.01));
  CHECK(one.relmse_trimmed == Approx(4.0 / 1.01));
  CHECK(one.relmse_robust == Approx(4.0 / 1.01));
  CHECK(one.mse_reinhard == Approx(0.0625));
  CHECK(one.smape == Approx(2.0 / 4.01));
  CHECK(one.mae == Approx(2.0));
  CHECK((none.smape == 0.0 && none.mae == 0.0));
  CHECK(none.worst_share == 0.0);

  image channel = grey(2, 1, 0.0f);
  channel.pixels[1].y = 0.3f;
  CHECK(render::compare(channel, grey(2, 1, 0.0f)).mse == Approx(0.09 / 6.0));
  CHECK(render::compare(channel, grey(2, 1, 0.0f)).relmse == Approx(9.0 / 6.0));
}

TEST_CASE("Trimming drops one pixel in a thousand", "[renderer][metrics]") {
  image test = grey(50, 40, 1.0f);
  for (int i : {10, 700}) test.pixels[std::size_t(i)] = vec3(1000.0f);
  test.pixels[5] = vec3(2.0f);
  const render::image_error error = render::compare(test, grey(50, 40, 1.0f));
  CHECK(error.relmse > 900.0);
  CHECK(error.relmse_trimmed == Approx(1.0 / 1.01 / 1998.0));
  test.pixels[6] = vec3(1000.0f);
  CHECK(render::compare(test, grey(50, 40, 1.0f)).relmse_trimmed > 400.0);
}

TEST_CASE("One pixel in ten thousand is left out, and its fraction of the error is reported",
          "[renderer][metrics]") {
  image test = grey(200, 100, 1.0f);
  test.pixels[10] = vec3(11.0f);   // relative error 100 / 1.01
  test.pixels[700] = vec3(21.0f);  // 400 / 1.01
  test.pixels[5] = vec3(2.0f);     // 1 / 1.01
  const render::image_error error = render::compare(test, grey(200, 100, 1.0f));
  CHECK(error.relmse == Approx(501.0 / 1.01 / 20000.0));
  CHECK(error.relmse_robust == Approx(1.0 / 1.01 / 19998.0));
  CHECK(error.worst_share == Approx(500.0 / 501.0));
  // A picture of fewer than ten thousand pixels keeps all.
  const render::image_error small = render::compare(grey(4, 4, 3.0f), grey(4, 4, 1.0f));
  CHECK(small.relmse_robust == small.relmse);
  CHECK(small.worst_share == Approx(0.0).margin(1e-12));
}

TEST_CASE("Errors of single pixels are right", "[renderer][metrics]") {
  image test = grey(3, 1, 1.0f);
  test.pixels[1] = vec3(3.0f);
  test.pixels[2].x = std::numeric_limits<float>::quiet_NaN();
  const std::vector<double> errors = render::reinhard_errors(test, grey(3, 1, 1.0f));
  REQUIRE(errors.size() == 3);
  CHECK(errors[0] == 0.0);
  CHECK(errors[1] == Approx(0.0625));
  CHECK(std::isinf(errors[2]));
  CHECK_THROWS_AS(render::reinhard_errors(test, grey(1, 3, 1.0f)), std::invalid_argument);
}

TEST_CASE("Pixels that are not finite make errors infinite", "[renderer][metrics]") {
  image test = grey(50, 40, 1.0f);
  test.pixels[3].x = std::numeric_limits<float>::quiet_NaN();
  render::image_error error = render::compare(test, grey(50, 40, 1.0f));
  CHECK(error.non_finite == 1);
  CHECK(std::isinf(error.mse));
  CHECK(std::isinf(error.mse_reinhard));
  CHECK((std::isinf(error.smape) && std::isinf(error.mae)));
  CHECK(error.worst_share == 1.0);
  for (vec3& pixel : test.pixels) pixel.y = std::numeric_limits<float>::infinity();
  error = render::compare(grey(50, 40, 1.0f), test);
  CHECK(error.non_finite == 2000);
  CHECK(std::isinf(error.relmse_trimmed));
}

TEST_CASE("Errors of pictures that cannot be compared are refused", "[renderer][metrics]") {
  CHECK_THROWS_AS(render::compare(grey(4, 4, 1.0f), grey(4, 5, 1.0f)), std::invalid_argument);
  CHECK_THROWS_AS(render::compare(image{}, image{}), std::invalid_argument);
  CHECK(render::noise_of_halves(grey(4, 4, 3.0f), grey(4, 4, 1.0f)).mse == Approx(1.0));
  // The mean is 2, and each half differs from it by 1.
  CHECK(render::noise_of_halves(grey(4, 4, 3.0f), grey(4, 4, 1.0f)).relmse_robust == Approx(1.0 / 4.01));
  CHECK(render::noise_of_halves(grey(4, 4, 3.0f), grey(4, 4, 1.0f)).smape == Approx(0.5 / 5.01 + 0.5 / 3.01));
  CHECK_THROWS_AS(render::noise_of_halves(grey(4, 4, 1.0f), grey(4, 5, 1.0f)), std::invalid_argument);
}

TEST_CASE("Built-in scenes are valid", "[renderer][builtin]") {
  for (const std::string& name : render::builtin_scene_names()) {
    INFO(name);
    CHECK(render::is_builtin_scene(name));
    const scene s = render::make_builtin_scene(name);
    check_consistent(s);
    CHECK(s.name == name);
    const std::map<std::string, int> depths = {{"thin-wall", 6}, {"mirror-balls", 10},
                                               {"slab", 256},    {"glass-caustic-fog", 12},
                                               {"wax", 64},      {"bottles", 32}};
    CHECK(s.max_depth == (depths.count(name) > 0 ? depths.at(name) : 8));
    int emitters = 0;
    for (std::size_t t = 0; t < s.triangles.size(); ++t) {
      const vec3 normal = face_normal(s, t);
      CHECK(glm::length(normal) == Approx(1.0f));
      const render::material& m = s.materials[s.triangle_materials[t]];
      if (m.emission == vec3(0.0f)) continue;
      ++emitters;
      if (name == "furnace") continue;
      // Of veach-bidir's lamps, the one at the floor lights the ceiling.
      const bool faces_up = name == "glossy-room" || (name == "veach-bidir" && emitters <= 2);
      check_close(normal, {0.0f, faces_up ? 1.0f : -1.0f, 0.0f});
      CHECK(m.base_color == vec3(0.0f));
    }
    const std::map<std::string, int> others = {{"furnace", 12},    {"many-lamps", 24}, {"outdoor", 0},
                                               {"veach-bidir", 4}, {"fog-lamp", 0},    {"slab", 0},
                                               {"fog-spot", 0},    {"wax", 0}};
    CHECK(emitters == (others.count(name) > 0 ? others.at(name) : 2));
  }
  CHECK_FALSE(render::is_builtin_scene("nowhere"));
  CHECK_THROWS_AS(render::make_builtin_scene("nowhere"), std::invalid_argument);
}

TEST_CASE("The furnace is closed, faces inwards and has a known answer", "[renderer][builtin]") {
  const scene s = render::make_builtin_scene("furnace");
  vec3 area(0.0f);
  float volume = 0.0f;
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    const vec3 a = corner(s, t, 0), b = corner(s, t, 1), c = corner(s, t, 2);
    area += 0.5f * glm::cross(b - a, c - a);
    volume += glm::dot(a, glm::cross(b, c)) / 6.0f;
    CHECK(glm::dot(face_normal(s, t), s.view.position - a) > 0.0f);
    const render::material& m = s.materials[s.triangle_materials[t]];
    check_close(m.base_color, vec3(0.5f));
    check_close(m.emission, vec3(1.0f));
  }
  check_close(area, vec3(0.0f));
  CHECK(volume == Approx(-8.0f));  // negative: all sides face inwards
  CHECK(render::furnace_radiance(0) == 0.0);
  CHECK(render::furnace_radiance(1) == 1.0);
  CHECK(render::furnace_radiance(8) == Approx(2.0 - std::pow(2.0, -7)));
  CHECK(render::furnace_radiance(60) == Approx(2.0));
}

namespace {

/// Twice the number of edges that triangles use in one direction only, compared by position.
std::size_t open_edges(const scene& s, material_kind kind) {
  using key = std::tuple<float, float, float>;
  std::map<std::pair<key, key>, int> balance;
  const auto key_of = [](vec3 p) { return key(p.x, p.y, p.z); };
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    if (s.materials[s.triangle_materials[t]].kind != kind) continue;
    for (int i = 0; i < 3; ++i) {
      const key a = key_of(corner(s, t, i)), b = key_of(corner(s, t, (i + 1) % 3));
      ++balance[{a, b}];
      --balance[{b, a}];
    }
  }
  std::size_t open = 0;
  for (const auto& edge : balance) open += edge.second != 0;
  return open;
}

}  // namespace

TEST_CASE("The glass around the enclosed lamp is closed and faces outwards", "[renderer][builtin]") {
  const scene s = render::make_builtin_scene("cornell-enclosed");
  CHECK(open_edges(s, material_kind::dielectric) == 0);
  float volume = 0.0f;
  vec3 lower(1e9f), upper(-1e9f);
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    if (s.materials[s.triangle_materials[t]].kind != material_kind::dielectric) continue;
    volume += glm::dot(corner(s, t, 0), glm::cross(corner(s, t, 1), corner(s, t, 2))) / 6.0f;
    for (int i = 0; i < 3; ++i) {
      lower = glm::min(lower, corner(s, t, i));
      upper = glm::max(upper, corner(s, t, i));
    }
  }
  CHECK(volume == Approx(0.70f * 0.24f * 0.60f).epsilon(1e-3));
  for (std::size_t t = 0; t < s.triangles.size(); ++t)
    if (s.materials[s.triangle_materials[t]].emission != vec3(0.0f))
      for (int i = 0; i < 3; ++i) {
        CHECK(glm::all(glm::greaterThan(corner(s, t, i), lower)));
        CHECK(glm::all(glm::lessThan(corner(s, t, i), upper)));
      }
}

TEST_CASE("The water of caustic-pool is smooth and touches the walls; the camera is below",
          "[renderer][builtin]") {
  const scene s = render::make_builtin_scene("caustic-pool");
  vec3 lower(1e9f), upper(-1e9f), room(0.0f);
  float least = 1.0f;
  for (std::size_t t = 0; t < s.triangles.size(); ++t)
    for (int i = 0; i < 3; ++i) {
      const vec3 at = corner(s, t, i);
      if (s.materials[s.triangle_materials[t]].kind != material_kind::dielectric) {
        room = glm::max(room, at);
        continue;
      }
      least = std::min(least, glm::dot(s.normals[s.triangles[t][i]], face_normal(s, t)));
      CHECK(face_normal(s, t).y > 0.8f);
      lower = glm::min(lower, at);
      upper = glm::max(upper, at);
    }
  CHECK(least > 0.98f);  // waves are several cells long
  CHECK((upper.x > room.x && upper.z > room.z && lower.x < -room.x && lower.z < -room.z));
  CHECK((s.view.position.y < lower.y && upper.y < room.y));
}

TEST_CASE("The conductor box of ajar is closed", "[renderer][builtin]") {
  CHECK(open_edges(render::make_builtin_scene("ajar"), material_kind::conductor) == 0);
}

TEST_CASE("Spheres are closed, smooth and face outwards", "[renderer][builtin]") {
  render::scene_builder b("sphere");
  const vec3 centre(1.0f, 2.0f, 3.0f);
  b.sphere(centre, 0.5f, 16, b.diffuse(vec3(0.5f)));
  const scene s = b.finish(1);
  check_consistent(s);
  CHECK(open_edges(s, material_kind::lambert) == 0);
  float volume = 0.0f;
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    volume +=
        glm::dot(corner(s, t, 0) - centre, glm::cross(corner(s, t, 1) - centre, corner(s, t, 2) - centre)) /
        6.0f;
    for (int i = 0; i < 3; ++i) {
      check_close(s.normals[s.triangles[t][i]], 2.0f * (corner(s, t, i) - centre));
      CHECK(glm::dot(s.normals[s.triangles[t][i]], face_normal(s, t)) > 0.95f);
    }
  }
  CHECK(volume == Approx(render::pi / 6.0f).epsilon(0.03));
  for (const char* name : {"materials", "outdoor"})
    CHECK(open_edges(render::make_builtin_scene(name), material_kind::rough_dielectric) == 0);
}

TEST_CASE("The sun of outdoor is where its map is brightest, and texels differ little from the next",
          "[renderer][builtin]") {
  const render::environment_map sky = render::make_builtin_scene("outdoor").sky;
  const auto at = [&](int row, int column) {
    return wfpg::luminance(sky.texels[std::size_t(row * sky.width + column % sky.width)]);
  };
  float brightest = 0.0f, steepest = 1.0f;
  for (int row = 0; row + 1 < sky.height; ++row)
    for (int column = 0; column < sky.width; ++column) {
      brightest = std::max(brightest, at(row, column));
      for (const float next : {at(row, column + 1), at(row + 1, column)})
        steepest = std::max(steepest, std::max(next / at(row, column), at(row, column) / next));
    }
  CHECK(brightest > 1000.0f);
  CHECK(steepest < 3.0f);
}

TEST_CASE("plots: names do not overlap, and long names have room", "[renderer][plot]") {
  temporary_folder folder;
  const std::string name = "a name of many more letters than the others";
  const render::curve first{name, {{1.0, 0.1}, {2.0, 0.05}}}, second{"b", {{1.0, 0.1}, {2.0, 0.05}}};
  const double infinite = std::numeric_limits<double>::infinity();
  render::write_svg(folder.file("a.svg"), {"t", "x", "y", {first, second, {"c", {{1.0, infinite}}}}});
  const std::string svg = content_of(folder.file("a.svg"));
  CHECK(std::stod(svg.substr(svg.find("width='") + 7)) > 520.0 + 7.0 * double(name.size()));
  const auto height_of = [&svg](const std::string& text) {
    const std::size_t at = svg.rfind("y='", svg.find('>' + text + '<'));
    return std::stod(svg.substr(at + 3));
  };
  CHECK(std::abs(height_of(name) - height_of("b")) >= 12.0);
  CHECK_FALSE(contains(svg, ">c<"));
  CHECK_FALSE(contains(svg, "inf"));
}

TEST_CASE("plots: short axes have labels between powers of ten", "[renderer][plot]") {
  temporary_folder folder;
  render::write_svg(folder.file("a.svg"), {"t", "x", "y", {{"a", {{1.0, 0.0023}, {1000.0, 0.0171}}}}});
  const std::string svg = content_of(folder.file("a.svg"));
  CHECK(contains(svg, ">0.002<"));
  CHECK(contains(svg, ">0.005<"));
  CHECK_FALSE(contains(svg, ">0.001<"));
  CHECK(contains(svg, ">0.02<"));
  CHECK_FALSE(contains(svg, ">0.003<"));
  CHECK(contains(svg, ">1000<"));
  CHECK_FALSE(contains(svg, ">500<"));
  // A single value has an axis too.
  render::write_svg(folder.file("b.svg"), {"t", "x", "y", {{"a", {{1.0, 1.0}}}}});
  CHECK_FALSE(contains(content_of(folder.file("b.svg")), "nan"));
  render::write_svg(folder.file("c.svg"), {"t", "x", "y", {{"a", {{3.0, 1.0}, {4.0, 100.0}}}}});
  CHECK(contains(content_of(folder.file("c.svg")), ">4<"));
}

TEST_CASE("plots: positive points are inside the frame, and names are escaped", "[renderer][plot]") {
  temporary_folder folder;
  const render::curve falling{"a<b", {{0.02, 5.0}, {0.2, 0.5}, {7.0, 0.003}, {0.0, 1.0}, {1.0, -1.0}}};
  render::write_svg(folder.file("a.svg"), {"title", "x", "y", {falling, {"empty", {}}}});
  const std::string svg = content_of(folder.file("a.svg"));
  CHECK(contains(svg, "a&lt;b"));
  CHECK(contains(svg, ">title<"));
  int circles = 0;
  for (std::size_t at = svg.find("<circle cx='"); at != std::string::npos;
       at = svg.find("<circle cx='", at + 1)) {
    ++circles;
    const double x = std::stod(svg.substr(at + 12));
    const double y = std::stod(svg.substr(svg.find("cy='", at) + 4));
    CHECK((x >= 80.0 && x <= 520.0 && y >= 40.0 && y <= 365.0));
  }
  CHECK(circles == 3);
  CHECK_THROWS_AS(render::write_svg("/nonexistent/a.svg", {}), std::runtime_error);
}
