// The page that compares pictures, and the program that writes it: what a browser finds in it, and faults.
#include "app/comparison_page.hpp"
#include "app/html.hpp"
#include "app/page_program.hpp"
#include "support/catch.hpp"
#include "support/command_lines.hpp"
#include "support/renderer_io.hpp"

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace render_test;
using nlohmann::json;
using render::image;

outcome run_page(const std::vector<std::string>& arguments) {
  return run_command(render::run_page_program, "wfpg-page", arguments);
}

/// A picture whose values all differ.
image ramp(int width, int height, float step = 0.125f) {
  image picture = render::make_image(width, height);
  for (std::size_t i = 0; i < picture.pixels.size(); ++i)
    for (int c = 0; c < 3; ++c) picture.pixels[i][c] = step * static_cast<float>(3 * i + std::size_t(c));
  return picture;
}

std::string decoded(const std::string& base64) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t word = 0, bits = 0;
  for (const char c : base64) {
    if (c == '=') break;
    word = word << 6 | static_cast<std::uint32_t>(digits.find(c));
    bits += 6;
    if (bits >= 8) bytes += static_cast<char>(word >> (bits -= 8) & 255u);
  }
  return bytes;
}

/// What the page's script reads.
json data_of(const std::string& page) {
  const std::string begin = "<script type=\"application/json\" id=\"data\">";
  const std::size_t at = page.find(begin) + begin.size();
  return json::parse(page.substr(at, page.find("</script>", at) - at));
}

/// Values of a picture of the page, as its script decodes them.
std::vector<float> values_of(const json& picture) {
  const std::string bytes = decoded(picture["halves"].get<std::string>());
  std::vector<float> values;
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    const int bits = static_cast<unsigned char>(bytes[i]) | static_cast<unsigned char>(bytes[i + 1]) << 8;
    const int exponent = bits >> 10 & 31, mantissa = bits & 1023;
    float value = std::ldexp(static_cast<float>(exponent > 0 ? 1024 + mantissa : mantissa),
                             (exponent > 0 ? exponent : 1) - 25);
    if (exponent == 31)
      value = mantissa > 0 ? std::numeric_limits<float>::quiet_NaN() : std::numeric_limits<float>::infinity();
    values.push_back((bits & 0x8000) != 0 ? -value : value);
  }
  return values;
}

template <class Call>
std::string refusal_of(const Call& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing was thrown";
}

}  // namespace

TEST_CASE("base64 and entities are as their standards have them", "[renderer][page]") {
  const std::vector<std::string> texts{"", "f", "fo", "foo", "foob", "\xff\xfe\xfd"};
  const std::vector<std::string> encoded{"", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "//79"};
  for (std::size_t i = 0; i < texts.size(); ++i) CHECK(render::base64(texts[i]) == encoded[i]);
  CHECK(render::escaped("a < b & \"c\"") == "a &lt; b &amp; &quot;c&quot;");
}

TEST_CASE("a page has all pictures in their order, and needs no other file", "[renderer][page]") {
  const std::string page = render::comparison_page(
      "two <scenes>",
      {{"first",
        {{"pt", ramp(5, 3)}, {"wfpg", ramp(5, 3, 0.25f), "error 1"}, {"</script>", ramp(5, 3, 0.5f)}}},
       {"second", {{"pt", ramp(2, 2)}, {"reference", ramp(2, 2)}}}});
  CHECK(contains(page, "<title>two &lt;scenes></title>"));
  for (const std::string outside : {"http", "src=", "href=", "@import", "url("})
    CHECK_FALSE(contains(page, outside));
  // The script asks for elements by names that the page has.
  std::size_t asked = 0;
  for (std::size_t at = page.find("by(\""); at != std::string::npos;
       at = page.find("by(\"", at + 1), ++asked) {
    const std::string id = page.substr(at + 4, page.find('"', at + 4) - at - 4);
    INFO(id);
    CHECK(contains(page, "id=\"" + id + "\""));
  }
  CHECK(asked > 10);
  const json data = data_of(page);
  CHECK(decoded(data["heat"].get<std::string>()).size() == 3 * 256);
  REQUIRE(data["comparisons"].size() == 2);
  const json& first = data["comparisons"][0];
  CHECK((first["scene"] == "first" && first["width"] == 5 && first["height"] == 3));
  REQUIRE(first["pictures"].size() == 3);
  CHECK(first["pictures"][1]["name"] == "wfpg");
  CHECK(first["pictures"][1]["note"] == "error 1");
  CHECK(first["pictures"][2]["name"] == "</script>");
  const std::vector<float> values = values_of(first["pictures"][1]);
  REQUIRE(values.size() == 45);
  for (std::size_t i = 0; i < values.size(); ++i) CHECK(values[i] == 0.25f * static_cast<float>(i));
  CHECK(data["comparisons"][1]["width"] == 2);
}

TEST_CASE("a page keeps what is not finite, and the sign and size of what is", "[renderer][page]") {
  image picture = render::make_image(2, 1);
  picture.pixels = {{std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e9f},
                    {-2.0f, 1e-6f, -1e9f}};
  const json data = data_of(render::comparison_page("t", {{"s", {{"a", picture}, {"b", picture}}}}));
  const std::vector<float> values = values_of(data["comparisons"][0]["pictures"][0]);
  REQUIRE(values.size() == 6);
  CHECK(std::isnan(values[0]));
  CHECK(std::isinf(values[1]));
  CHECK((values[2] == 65504.0f && values[3] == -2.0f && values[5] == -65504.0f));
  CHECK(values[4] == Approx(1e-6f).epsilon(0.05));
}

TEST_CASE("pictures that cannot be compared are refused by their names", "[renderer][page]") {
  const auto page_of = [](const std::vector<render::named_picture>& pictures) {
    return refusal_of([&] { render::comparison_page("t", {{"ajar", pictures}}); });
  };
  CHECK(refusal_of([] { render::comparison_page("t", {}); }) == "there are no pictures to compare");
  CHECK(contains(page_of({{"a", ramp(2, 2)}}), "ajar has 1 pictures"));
  const std::string sizes = page_of({{"wide", ramp(4, 2)}, {"b", ramp(2, 2)}, {"r", ramp(2, 2)}});
  CHECK(sizes == "wide has 4 x 2 pixels, and r has 2 x 2: only equal sizes are compared");
  CHECK(contains(page_of({{"b", ramp(2, 4)}, {"r", ramp(2, 2)}}), "2 x 4"));
  CHECK(contains(page_of({{"a", ramp(2, 2)}, {"b", ramp(2, 2)}, {"a", ramp(2, 2)}}), "called a"));
}

TEST_CASE("wfpg-page reads OpenEXR and PNG, and tells errors", "[renderer][page]") {
  temporary_folder folder;
  render::write_exr(folder.file("pt.exr"), ramp(4, 3, 0.03f));
  render::write_exr(folder.file("reference.exr"), ramp(4, 3, 0.02f));
  render::write_png(folder.file("shown.png"), ramp(4, 3, 0.02f));
  const outcome done =
      run_page({"path tracing=" + folder.file("pt.exr"), folder.file("shown.png"),
                folder.file("reference.exr"), "-o", folder.file("page.html"), "--title", "ajar"});
  INFO(done.log);
  REQUIRE(done.code == 0);
  CHECK(contains(done.out, folder.file("page.html")));
  const json pictures = data_of(content_of(folder.file("page.html")))["comparisons"][0]["pictures"];
  REQUIRE(pictures.size() == 3);
  CHECK(pictures[0]["name"] == "path tracing");
  CHECK(pictures[1]["name"] == "shown");
  CHECK(contains(pictures[0]["note"].get<std::string>(), "MSE"));
  CHECK_FALSE(contains(pictures[2]["note"].get<std::string>(), "MSE"));
  const std::vector<float> png = values_of(pictures[1]), exr = values_of(pictures[2]);
  for (std::size_t i = 0; i < png.size(); ++i) CHECK(png[i] == Approx(exr[i]).margin(0.006));
}

TEST_CASE("wfpg-page finds faults before it reads a picture", "[renderer][page]") {
  temporary_folder folder;
  const std::string noise = folder.write("noise.exr", "noise"), page = folder.file("page.html");
  const auto said_of = [](const std::vector<std::string>& arguments) {
    const outcome done = run_page(arguments);
    CHECK(done.code == 2);
    CHECK(done.out.empty());
    CHECK(done.log.rfind("wfpg-page: ", 0) == 0);
    return done.log;
  };
  CHECK(contains(said_of({noise, folder.file("no.exr"), "-o", page}), "no.exr: cannot be opened"));
  CHECK(contains(said_of({noise, folder.path().string(), "-o", page}), "cannot be opened"));
  CHECK(contains(said_of({noise, noise, "-o", folder.file("no/page.html")}), "--output: "));
  CHECK(contains(said_of({noise, noise, "-o", folder.file("page.png")}), "ends in .html"));
  CHECK(contains(said_of({noise, noise}), "--output"));
  CHECK(contains(said_of({"=" + noise, noise, "-o", page}), "expected FILE or NAME=FILE"));
  CHECK(contains(said_of({"-o", page}), "PICTURES"));
  const std::string as_page = folder.write("a.html", "");
  CHECK(contains(said_of({"it=" + as_page, noise, "-o", as_page}), "is the file of the picture it too"));

  // Then pictures are read.
  CHECK(contains(said_of({noise, noise, "-o", page}), noise + ": "));
  CHECK(contains(said_of({as_page, noise, "-o", page}), "ends in .exr or .png"));
  CHECK(contains(said_of({folder.write("noise.png", "noise"), noise, "-o", page}), "cannot be decoded"));
  render::write_png(folder.file("whole.png"), ramp(64, 64));
  const std::string whole = content_of(folder.file("whole.png"));
  CHECK(contains(said_of({folder.write("cut.png", whole.substr(0, whole.size() / 2)), noise, "-o", page}),
                 "cut.png: "));
  render::write_exr(folder.file("a.exr"), ramp(4, 3));
  render::write_exr(folder.file("b.exr"), ramp(3, 4));
  CHECK(contains(said_of({folder.file("a.exr"), folder.file("b.exr"), "-o", page}), "a has 4 x 3 pixels"));
  CHECK(contains(said_of({folder.file("a.exr"), folder.file("a.exr"), "-o", page}), "NAME=FILE"));
  CHECK(contains(said_of({noise, "-o", page}), "PICTURES: At least 2 required"));
  CHECK_FALSE(std::filesystem::exists(page));
}
