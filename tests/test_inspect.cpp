// wfpg-inspect: directions and pictures of them, measures, colour scales, and the program's files and errors.
#include "colour_scale.hpp"
#include "directions.hpp"
#include "inspection.hpp"
#include "measures.hpp"
#include "program.hpp"
#include "support/catch.hpp"
#include "support/command_lines.hpp"
#include "support/inspections.hpp"
#include "support/renderer_io.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

namespace {

using namespace render_test;
using namespace inspect_test;
using inspect::direction_grid;
using render::image;
using render::vec2;

outcome run(const std::vector<std::string>& arguments) {
  return run_command(inspect::run_program, "wfpg-inspect", arguments);
}

/// The bytes of each base64 block in a page.
std::vector<std::string> embedded_in(const std::string& page) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/",
                    mark = "base64,";
  std::vector<std::string> all;
  for (std::size_t at = page.find(mark); at != std::string::npos; at = page.find(mark, at)) {
    at += mark.size();
    std::string bytes;
    unsigned word = 0, bits = 0;
    for (; digits.find(page[at]) != std::string::npos; ++at) {
      word = word << 6 | static_cast<unsigned>(digits.find(page[at]));
      bits += 6;
      if (bits >= 8) bytes += static_cast<char>(word >> (bits -= 8) & 255u);
    }
    all.push_back(bytes);
  }
  return all;
}

nlohmann::json numbers_in(const std::string& folder) {
  return nlohmann::json::parse(content_of(folder + "/numbers.json"));
}

}  // namespace

TEST_CASE("inspect: a cell's directions lie in it, and known directions in known cells", "[inspect]") {
  const vec3 up = glm::normalize(vec3(0.3f, -0.5f, 0.8f));
  for (const direction_grid& grid :
       {direction_grid(7), direction_grid(7, up), direction_grid(2, up).refined(4)})
    for (std::size_t cell = 0; cell < grid.size(); ++cell)
      for (const vec2 inside : {vec2(0.1f), vec2(0.5f), vec2(0.9f, 0.2f)})
        REQUIRE(grid.cell_of(grid.direction(cell, inside)) == cell);
  // The centre of the square is +z of the sphere, or the normal of a hemisphere. -z is at the corners.
  CHECK(direction_grid(3).cell_of({0.0f, 0.0f, 1.0f}) == 4u);
  CHECK(direction_grid(3, up).cell_of(up) == 4u);
  const std::size_t corner = direction_grid(3).cell_of({0.0f, 0.0f, -1.0f}).value();
  CHECK((corner == 0 || corner == 2 || corner == 6 || corner == 8));
  CHECK_FALSE(direction_grid(3, up).cell_of(-up));
  CHECK(direction_grid(8).solid_angle() == Approx(4.0f * render::pi / 64.0f));
  CHECK(direction_grid(8, up).solid_angle() == Approx(2.0f * render::pi / 64.0f));
}

TEST_CASE("inspect: cells have equal solid angle in a latitude-longitude picture", "[inspect]") {
  const int height = 512;
  const double rows = height;
  for (const direction_grid& grid : {direction_grid(4), direction_grid(4, vec3(0.0f, 1.0f, 0.0f))}) {
    image cells = render::make_image(4, 4);
    for (std::size_t i = 0; i < 16; ++i) cells.pixels[i] = vec3(float(i));
    const image picture = inspect::latitude_longitude(grid, cells, height, vec3(-1.0f));
    REQUIRE((picture.width == 2 * height && picture.height == height));
    std::vector<double> areas(17, 0.0);
    for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
      const double polar = render::pi * (double(i / (2 * height)) + 0.5) / rows;
      areas[std::size_t(picture.pixels[i].x + 1.0f)] +=
          std::sin(polar) * double(render::pi) * double(render::pi) / (rows * rows);
    }
    for (std::size_t cell = 1; cell < areas.size(); ++cell)
      CHECK(areas[cell] == Approx(double(grid.solid_angle())).epsilon(0.01));
    CHECK(sum_of(areas) == Approx(4.0 * double(render::pi)).epsilon(1e-4));
  }
}

TEST_CASE("inspect: a latitude-longitude picture has -z in its centre, +x right, +y up", "[inspect]") {
  check_close(inspect::direction_at({0.5f, 0.5f}), {0.0f, 0.0f, -1.0f});
  check_close(inspect::direction_at({0.75f, 0.5f}), {1.0f, 0.0f, 0.0f});
  check_close(inspect::direction_at({0.3f, 0.0f}), {0.0f, 1.0f, 0.0f});
  // One bright cell around +x is bright there and nowhere else.
  const direction_grid grid(9, vec3(1.0f, 0.0f, 0.0f));
  image cells = render::make_image(9, 9);
  cells.pixels[40] = vec3(1.0f);
  const image picture = inspect::latitude_longitude(grid, cells, 64, vec3(0.0f));
  CHECK(picture.pixels[32 * 128 + 96].x == 1.0f);
  for (std::size_t i = 0; i < picture.pixels.size(); ++i)
    if (picture.pixels[i].x == 1.0f)
      CHECK(inspect::direction_at({(float(i % 128) + 0.5f) / 128.0f, (float(i / 128) + 0.5f) / 64.0f}).x >
            0.95f);
}

TEST_CASE("inspect: divergences and correlations of known distributions are right", "[inspect]") {
  using inspect::correlation;
  using inspect::kl_divergence;
  const std::vector<double> p = inspect::normalised({1.0, 2.0, 3.0, 0.0}), q{0.25, 0.25, 0.25, 0.25};
  CHECK(p[2] == Approx(0.5));
  CHECK(kl_divergence(p, p) == 0.0);
  CHECK(kl_divergence(p, q) ==
        Approx(std::log(4.0) - (std::log(6.0) / 6.0 + std::log(3.0) / 3.0 + std::log(2.0) / 2.0)));
  CHECK(std::isinf(kl_divergence(q, p)));
  CHECK(correlation(p, p) == Approx(1.0));
  CHECK(correlation({1.0, 2.0, 3.0}, {3.0, 2.0, 1.0}) == Approx(-1.0));
  CHECK(correlation({1.0, 2.0, 1.0, 2.0}, {1.0, 1.0, 2.0, 2.0}) == Approx(0.0).margin(1e-12));
  CHECK(std::isnan(correlation(p, q)));
  CHECK(inspect::normalised({0.0, 0.0}) == std::vector<double>{0.0, 0.0});
  std::vector<double> fine(16, 0.0);
  fine[5] = 4.0;   // second row, second column: the upper left block
  fine[14] = 8.0;  // last row, third column: the lower right block
  CHECK(inspect::coarsened(fine, 2) == std::vector<double>{1.0, 0.0, 0.0, 2.0});
}

TEST_CASE("inspect: scales label powers of ten, and brighter colours mean more", "[inspect]") {
  const auto scale = inspect::colour_scale::logarithmic(30.0, "1/sr");
  CHECK(scale.labels() == std::vector<std::string>{"0.01", "0.1", "1", "10", "100"});
  CHECK(scale.colour(100.0) == vec3(1.0f));
  CHECK(scale.colour(0.001) == vec3(0.0f));
  CHECK(scale.colour(0.0) == vec3(0.0f));
  float last = -1.0f;
  for (const double value : {0.02, 0.1, 0.7, 5.0, 20.0, 90.0}) {
    const float here = wfpg::luminance(scale.colour(value));
    CHECK(here > last);
    last = here;
  }
  check_close(scale.bar().pixels.front(), scale.colour(0.01));
  check_close(scale.bar().pixels[511], scale.colour(100.0));
  CHECK(inspect::colour_scale::logarithmic(std::numeric_limits<double>::infinity(), "").labels().back() ==
        "1");
  CHECK(inspect::colour_scale::whole_numbers(2, "").labels() == std::vector<std::string>{"0", "1", "2"});
}

TEST_CASE("inspect: the program writes a self-contained page", "[inspect]") {
  temporary_folder folder;
  for (const std::string fields : {"kept", "transient"}) {
    const std::string output = folder.file(fields) + "/new";
    const outcome done = run({"cornell-box", "--pixel", "12,20", "--size", "24x24", "--spp", "3", "--fields",
                              fields, "--reference-spp", "2", "--histogram", "1000", "-o", output});
    INFO(done.log);
    REQUIRE(done.code == 0);
    CHECK(done.out == output + "/index.html\n");
    const std::string page = content_of(output + "/index.html");
    CHECK_FALSE(contains(page, "http"));
    const std::vector<std::string> pictures = embedded_in(page);
    CHECK(pictures.size() == 27);  // 8 maps in two projections, 6 camera pictures, 5 bars
    CHECK(std::count(pictures.begin(), pictures.end(), content_of(output + "/bar-0.png")) > 0);
    for (const std::string name : {"field-octahedral", "light-latlong", "picture", "octree-levels"}) {
      INFO(name);
      CHECK(std::count(pictures.begin(), pictures.end(), content_of(output + "/" + name + ".png")) > 0);
    }
    for (const std::string name :
         {"field", "reference", "product", "ideal", "sampler", "histogram", "light", "contribution"})
      for (const std::string projection : {"-octahedral", "-latlong"}) {
        INFO(name + projection);
        CHECK(std::filesystem::file_size(output + "/" + name + projection + ".png") > 100);
        const image values = render::read_exr(output + "/" + name + projection + ".exr");
        CHECK(values.width == values.height * (projection == "-latlong" ? 2 : 1));
      }
    for (const std::string name :
         {"picture", "octree-facing", "octree-turned", "octree-normals", "octree-bins", "octree-levels"})
      CHECK(std::filesystem::exists(output + "/" + name + ".png"));
    const nlohmann::json numbers = numbers_in(output);
    CHECK(numbers["fields"] == fields);
    CHECK(numbers["samples"] == 3);
    CHECK(numbers["pixel"] == nlohmann::json({12, 20}));
    CHECK(numbers["mixture_fraction"].get<double>() >= 0.5);
    CHECK(numbers["correlation"].is_number());
    CHECK(numbers["level"].get<int>() >= 3);
    CHECK(numbers["rays"].get<int>() >= 1);
  }
}

TEST_CASE("inspect: pixels without a field say so and have the octree's pictures", "[inspect]") {
  temporary_folder folder;
  std::ostringstream log;
  inspect::inspection asked;
  asked.learning = small(16, 3);
  asked.reference_spp = 2;
  asked.histogram = 100;
  asked.x = 8;
  const auto look = [&](render::material_kind kind, int y) {
    asked.y = y;
    asked.output = folder.file(std::to_string(y) + std::to_string(int(kind)));
    inspect::run(lit_floor(kind), asked, log);
    CHECK(std::filesystem::exists(asked.output / "octree-bins.png"));
    CHECK_FALSE(std::filesystem::exists(asked.output / "field-octahedral.png"));
    return numbers_in(asked.output.string());
  };
  CHECK(look(render::material_kind::lambert, 2)["hit"] == "nothing");
  CHECK(contains(log.str(), "warning: The pixel hits nothing"));
  CHECK(look(render::material_kind::mirror, 12)["hit"] == "a smooth mirror or glass");
  CHECK(contains(content_of((asked.output / "index.html").string()), "sampled by its BSDF alone"));
  // Without room for a field, the BSDF's directions are still shown.
  asked.learning.kept.budget_bytes = 0;
  const nlohmann::json bare = look(render::material_kind::lambert, 12);
  CHECK(bare["hit"] == "a surface");
  CHECK(bare["mixture_fraction"] == 0.0);
  CHECK(bare["correlation"].is_null());
  CHECK(std::filesystem::exists(asked.output / "sampler-octahedral.png"));
}

TEST_CASE("inspect: invalid arguments are named before anything is rendered", "[inspect]") {
  temporary_folder folder;
  const std::string output = folder.file("none");
  const auto error = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--size", "16x8", "--spp", "1", "-o", output});
    const outcome failed = run(std::move(arguments));
    CHECK(failed.code == 2);
    CHECK(failed.out.empty());
    CHECK_FALSE(std::filesystem::exists(output));
    return failed.log;
  };
  CHECK(contains(error({"cornell-box", "--pixel", "16,0"}), "pixel's x is 16, expected 0 to 15"));
  CHECK(contains(error({"cornell-box", "--pixel", "0,8"}), "pixel's y is 8, expected 0 to 7"));
  CHECK(contains(error({"cornell-box", "--pixel", "-1,0"}), "pixel's x is -1"));
  CHECK(contains(error({"cornell-box", "--pixel", "1"}), "--pixel is 1, expected X,Y"));
  CHECK(contains(error({"cornell-box"}), "--pixel is required"));
  CHECK(contains(error({"cornell-box", "--pixel", "0,0", "--method", "pt"}), "method is pt, expected wfpg"));
  CHECK(contains(error({"cornell-box", "--pixel", "0,0", "--device", "seq"}), "device is seq, expected cpu"));
  CHECK(contains(error({"cornell-box", "--pixel", "0,0", "--max-depth", "1"}), "max_depth is 1"));
  CHECK(contains(error({"nowhere", "--pixel", "0,0"}), "SCENE is nowhere"));
  CHECK(error({"cornell-box", "--pixel", "0,0", "--reference-spp", "1"}) ==
        "wfpg-inspect: --reference-spp: expected a whole number from 2 to 16777216, not 1; --help lists the "
        "options\n");
  CHECK(contains(error({"cornell-box", "--pixel", "0,0", "--histogram", "0"}),
                 "--histogram: expected a whole number from 1 to 1073741824, not 0"));
  CHECK(contains(error({"cornell-box", "--pixel", "0,0", "--vdb", ""}), "--vdb: expected a path"));
  CHECK(contains(error({"cornell-box", "--pixel", "0,0", "--fields", "transient", "--recast", "4"}),
                 "--recast requires --fields kept"));
  const std::string file = folder.write("file", "x");
  const outcome taken = run({"cornell-box", "--pixel", "0,0", "--size", "8x8", "--spp", "1", "-o", file});
  CHECK(taken.code == 2);
  CHECK(contains(taken.log, "wfpg-inspect: --output: " + file + " is no folder to write to: "));
  CHECK_FALSE(contains(taken.log, "learning"));
}

TEST_CASE("inspect: the octree is written as OpenVDB, or an error says why not", "[inspect]") {
  temporary_folder folder;
  const std::string vdb = folder.file("octree.vdb"), output = folder.file("page");
  const outcome done = run({"cornell-box", "--pixel", "0,0", "--size", "8x8", "--spp", "1", "--reference-spp",
                            "2", "--histogram", "10", "-o", output, "--vdb", vdb});
  if (done.code == 0) {
    const std::string bytes = content_of(vdb);
    CHECK(bytes.substr(0, 4) == std::string(" BDV"));
    for (const char* const grid : {"exitance_front", "exitance_back", "normal", "level"})
      CHECK(contains(bytes, grid));
    return;
  }
  CHECK(contains(done.log, "built without OpenVDB"));
  CHECK_FALSE(std::filesystem::exists(output));
}
