// The glTF loader. It reads valid files, and hostile files end in an error that names path and reason.
#include "app/image_io.hpp"
#include "scene/gltf_loader.hpp"
#include "support/catch.hpp"
#include "support/renderer_io.hpp"
#include "support/tiny_gltf.hpp"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace render_test;
using render::image;
using render::material_kind;

bool warns(const scene& s, const std::string& part) {
  for (const std::string& line : s.warnings)
    if (contains(line, part)) return true;
  return false;
}

}  // namespace

TEST_CASE("glTF: one triangle loads, embedded and binary", "[renderer][gltf]") {
  temporary_folder folder;
  const tiny_gltf tiny;
  for (const std::string& path : {folder.write("a.gltf", tiny.json()), folder.write("a.glb", tiny.glb())}) {
    const scene s = render::load_gltf(path);
    check_consistent(s);
    CHECK(s.name == "a");
    REQUIRE(s.triangles.size() == 1);
    CHECK(s.normals.empty());
    CHECK(s.uvs.empty());
    check_close(corner(s, 0, 1), {1, 0, 0});
    check_close(corner(s, 0, 2), {0, 1, 0});
    CHECK(warns(s, "camera"));
    // The default camera sees the triangle.
    const vec3 towards = glm::normalize(vec3(0.5f, 0.5f, 0.0f) - s.view.position);
    CHECK(glm::dot(towards, s.view.forward) > 0.99f);
  }
}

TEST_CASE("glTF: a buffer may be in a separate file", "[renderer][gltf]") {
  temporary_folder folder;
  const tiny_gltf tiny;
  std::string json = tiny.json();
  const std::size_t start = json.find("data:application");
  json.replace(start, json.find('"', start) - start, "beside.bin");
  const std::string path = folder.write("a.gltf", json);
  CHECK_THROWS_AS(render::load_gltf(path), std::runtime_error);
  folder.write("beside.bin", tiny.buffer);
  CHECK(render::load_gltf(path).triangles.size() == 1);
}

TEST_CASE("glTF: triangles may lack indices, and scenes may lack triangles", "[renderer][gltf]") {
  tiny_gltf tiny;
  tiny.with("meshes", R"([{"primitives": [{"attributes": {"POSITION": 0}}]}])");
  const scene s = tiny.load();
  check_consistent(s);
  REQUIRE(s.triangles.size() == 1);
  CHECK(s.materials[s.triangle_materials[0]].kind == material_kind::lambert);
  const scene empty = tiny.with("nodes", "[{}]").load();
  CHECK(empty.triangles.empty());
}

TEST_CASE("glTF: transforms of nested nodes are combined", "[renderer][gltf]") {
  const float half = std::sqrt(0.5f);
  tiny_gltf tiny;
  // The parent translates. The child turns by a right angle about z and then scales along its own x.
  tiny.with("nodes", R"([{"children": [1], "translation": [10, 20, 30]},
                         {"mesh": 0, "scale": [2, 1, 1], "rotation": [0, 0, )" +
                         std::to_string(half) + ", " + std::to_string(half) + "]}]");
  const scene s = tiny.load();
  REQUIRE(s.triangles.size() == 1);
  check_close(corner(s, 0, 0), {10, 20, 30});
  check_close(corner(s, 0, 1), {10, 22, 30});
  check_close(corner(s, 0, 2), {9, 20, 30});

  tiny.with("nodes", R"([{"mesh": 0, "matrix": [1,0,0,0, 0,0,1,0, 0,-1,0,0, 5,6,7,1]}])");
  const scene m = tiny.load();
  check_close(corner(m, 0, 1), {6, 6, 7});
  check_close(corner(m, 0, 2), {5, 6, 8});
}

TEST_CASE("glTF: a mirroring transform reverses the winding", "[renderer][gltf]") {
  tiny_gltf tiny;
  const scene plain = tiny.load();
  const scene mirrored = tiny.with("nodes", R"([{"mesh": 0, "scale": [-1, 1, 1]}])").load();
  check_close(face_normal(plain, 0), {0, 0, 1});
  check_close(face_normal(mirrored, 0), {0, 0, 1});
}

TEST_CASE("glTF: normals and texture coordinates are read", "[renderer][gltf]") {
  tiny_gltf tiny;
  // Three normals: a unit vector, an unnormalised one, and a zero one. The triangle's normal replaces the
  // zero one.
  tiny.buffer = raw<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}) + raw<float>({0, 0, 1, 3, 0, 3, 0, 0, 0}) +
                raw<std::uint8_t>({0, 255, 255, 0, 51, 51, 0, 0});
  tiny.with("bufferViews", R"([{"buffer": 0, "byteLength": 36},
                               {"buffer": 0, "byteOffset": 36, "byteLength": 36},
                               {"buffer": 0, "byteOffset": 72, "byteLength": 6}])");
  tiny.with("accessors", R"([{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
      {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3"},
      {"bufferView": 2, "componentType": 5121, "count": 3, "type": "VEC2", "normalized": true}])");
  tiny.with("meshes", R"([{"primitives": [
      {"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}}, {"attributes": {"POSITION": 0}}]}])");
  tiny.with("nodes", R"([{"mesh": 0, "scale": [1, 1, 2]}])");
  const scene s = tiny.load();
  check_consistent(s);
  REQUIRE(s.normals.size() == 6);
  check_close(s.normals[0], {0, 0, 1});
  check_close(s.normals[1], glm::normalize(vec3(1, 0, 0.5f)));
  check_close(s.normals[2], {0, 0, 1});
  check_close(s.normals[4], {0, 0, 1});
  REQUIRE(s.uvs.size() == 6);
  CHECK(s.uvs[0].y == Approx(1.0f));
  CHECK(s.uvs[2].x == Approx(0.2f));
}

TEST_CASE("glTF: camera, resolution and environment are read", "[renderer][gltf]") {
  tiny_gltf tiny;
  tiny.with("nodes", R"([{"mesh": 0}, {"camera": 0, "matrix": [-1,0,0,0, 0,1,0,0, 0,0,-1,0, 1,2,3,1]}])");
  tiny.with("cameras", R"([{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}])");
  tiny.with("scenes", R"([{"nodes": [0, 1], "extras": {"resolution": [640, 360],
                           "environment": {"radiance": [1, 2.5, 3]}}}])");
  const scene s = tiny.load();
  CHECK(s.warnings.empty());
  check_close(s.view.position, {1, 2, 3});
  check_close(s.view.forward, {0, 0, 1});
  check_close(s.view.up, {0, 1, 0});
  CHECK(s.view.vertical_fov == Approx(0.5f));
  CHECK(s.width == 640);
  CHECK(s.height == 360);
  check_close(s.environment, {1.0f, 2.5f, 3.0f});

  tiny.with("scenes", R"([{"nodes": [0, 1], "extras": {"resolution": [0, "x"],
                           "environment": {"radiance": [1, -2]}}}])");
  const scene odd = tiny.load();
  CHECK(warns(odd, "resolution"));
  CHECK(warns(odd, "radiance"));
  check_close(odd.environment, vec3(0.0f));
}

TEST_CASE("glTF: materials become the renderer's", "[renderer][gltf]") {
  const auto read = [](const std::string& json) {
    return tiny_gltf().with("materials", "[" + json + "]").load().materials.at(0);
  };
  const auto conductor = read(R"({"pbrMetallicRoughness": {"metallicFactor": 1, "roughnessFactor": 0.5,
               "baseColorFactor": [0.9, 0.5, 0.1, 1]}})");
  CHECK(conductor.kind == material_kind::conductor);
  CHECK(conductor.alpha == Approx(0.25f));
  check_close(conductor.base_color, {0.9f, 0.5f, 0.1f});
  CHECK(read(R"({"pbrMetallicRoughness": {"metallicFactor": 1, "roughnessFactor": 0}})").kind ==
        material_kind::mirror);
  const auto plastic = read(R"({"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0},
                                "extensions": {"KHR_materials_ior": {"ior": 1.33}}})");
  CHECK(plastic.kind == material_kind::plastic);
  CHECK(plastic.alpha == Approx(0.01f));
  CHECK(plastic.ior == Approx(1.33f));
  CHECK(read(R"({"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.5},
                 "extensions": {"KHR_materials_specular": {"specularFactor": 0}}})")
            .kind == material_kind::lambert);
  CHECK(read(R"({"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 1}})").alpha == 1.0f);
  const auto lamp = read(R"({"emissiveFactor": [1, 0.5, 0],
                             "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 300}}})");
  check_close(lamp.emission, {300.0f, 150.0f, 0.0f}, 1e-3f);
}

TEST_CASE("glTF: lights too bright for sums of floats are refused by name", "[renderer][gltf]") {
  const auto lamp = [](const std::string& strength) {
    tiny_gltf tiny;
    tiny.with("materials", R"([{}, {"name": "lamp", "emissiveFactor": [0, 1, 0.5],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": )" +
                               strength + "}}}]");
    return tiny;
  };
  CHECK(lamp("3e38").error() ==
        "material 1 ('lamp') has an emissiveFactor times emissiveStrength of 3e+38, at most 1e+15 is "
        "supported");
  CHECK(contains(lamp("1e308").error(), "of 1e+308"));
  CHECK(lamp("9e14").load().materials[1].emission.y == 9e14f);

  tiny_gltf sky;
  sky.with("scenes", R"([{"nodes": [0], "extras": {"environment": {"radiance": [0, 0, 3e38]}}}])");
  CHECK(sky.error() == "an extras.environment.radiance of 3e+38, at most 1e+15 is supported");

  tiny_gltf bulb;
  bulb.with("extensions", R"({"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 2e38}]}})");
  bulb.with("nodes", R"([{"mesh": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}])");
  CHECK(bulb.error() == "light 0 has an intensity of 2e+38, at most 1e+15 is supported");
}

TEST_CASE("glTF: transmissive materials become solid or thin", "[renderer][gltf]") {
  const auto read = [](const std::string& roughness, const std::string& extensions) {
    return tiny_gltf()
        .with("materials", R"([{"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": )" +
                               roughness + R"(}, "extensions": {)" + extensions + "}}]")
        .load()
        .materials.at(0);
  };
  const std::string clear = R"("KHR_materials_transmission": {"transmissionFactor": 1})";
  const std::string solid = R"(, "KHR_materials_volume": {"thicknessFactor": 1})";
  const auto glass = read("0", clear + solid + R"(, "KHR_materials_ior": {"ior": 1.7})");
  CHECK(glass.kind == material_kind::dielectric);
  CHECK(glass.ior == Approx(1.7f));
  CHECK(read("0", clear).kind == material_kind::thin_dielectric);
  const auto frosted = read("0.5", clear + solid);
  CHECK(frosted.kind == material_kind::rough_dielectric);
  CHECK(frosted.alpha == Approx(0.25f));
  CHECK(read("0.5", clear).kind == material_kind::thin_metallic_roughness);
  const auto half = read("0.5", R"("KHR_materials_transmission": {"transmissionFactor": 0.5})" + solid);
  CHECK(half.kind == material_kind::metallic_roughness);
  CHECK(half.transmission == 0.5f);
  const auto leaf = read("0.5", R"("KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 0.25,
                                   "diffuseTransmissionColorFactor": [0.1, 0.9, 0.2]})");
  CHECK(leaf.kind == material_kind::thin_metallic_roughness);
  CHECK(leaf.diffuse_transmission == 0.25f);
  check_close(leaf.transmitted_color, {0.1f, 0.9f, 0.2f});
  const auto dim = read("0.5", R"("KHR_materials_specular": {"specularFactor": 0.5})");
  CHECK(dim.kind == material_kind::metallic_roughness);
  CHECK(dim.specular == 0.5f);
  CHECK(read("0.5", R"("KHR_materials_ior": {"ior": 0})").ior > 100.0f);
}

TEST_CASE("glTF: a base colour texture becomes linear", "[renderer][gltf]") {
  temporary_folder folder;
  image picture = render::make_image(2, 1);
  picture.pixels = {vec3(0.25f, 0.0f, 1.0f), vec3(0.5f)};
  render::write_png(folder.file("t.png"), picture);
  const std::string bytes = content_of(folder.file("t.png"));
  tiny_gltf tiny;
  tiny.with("images", R"([{"uri": "data:image/png;base64,)" + base64(bytes) + R"("}])");
  tiny.with("textures", R"([{"source": 0}])");
  tiny.with("materials", R"([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}},
                             {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}])");
  const scene s = tiny.load();
  REQUIRE(s.textures.size() == 1);
  CHECK(s.materials[0].base_texture.index == 0);
  CHECK(s.materials[1].base_texture.index == 0);
  REQUIRE(s.textures[0].texels.size() == 2);
  check_close(vec3(s.textures[0].texels[0]), {0.25f, 0.0f, 1.0f}, 0.005f);
  check_close(vec3(s.textures[0].texels[1]), vec3(0.5f), 0.005f);

  tiny.with("images", R"([{"uri": "data:image/png;base64,)" + base64(bytes.substr(0, 50)) + R"("}])");
  CHECK(contains(tiny.error(), "image 0"));
  tiny.with("images", R"([{"uri": "nowhere.png"}])");
  CHECK(contains(tiny.error(), "nowhere.png"));
}

TEST_CASE("glTF: metallic-roughness textures, samplers and texture transforms are read", "[renderer][gltf]") {
  temporary_folder folder;
  image picture = render::make_image(1, 1);
  picture.pixels = {vec3(render::srgb_to_linear(0.2f), render::srgb_to_linear(0.4f), 1.0f)};
  render::write_png(folder.file("t.png"), picture);
  tiny_gltf tiny;
  tiny.with("images",
            R"([{"uri": "data:image/png;base64,)" + base64(content_of(folder.file("t.png"))) + R"("}])");
  tiny.with("samplers", R"([{"wrapS": 33071, "wrapT": 33648}])");
  tiny.with("textures", R"([{"source": 0, "sampler": 0}])");
  tiny.with("materials", R"([{"pbrMetallicRoughness": {
      "baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": {
          "offset": [0.5, 0.25], "rotation": 1.5707963267948966, "scale": [2, 3]}}},
      "metallicRoughnessTexture": {"index": 0}}}])");
  const scene s = tiny.load();
  CHECK(s.warnings.size() == 1);  // of the default camera
  REQUIRE(s.textures.size() == 2);
  const render::material& m = s.materials[0];
  CHECK(m.kind == material_kind::metallic_roughness);
  CHECK(s.textures[0].wrap_u == render::texture_wrap::clamp_to_edge);
  CHECK(s.textures[0].wrap_v == render::texture_wrap::mirrored_repeat);
  check_close(vec3(s.textures[std::size_t(m.base_texture.index)].texels[0]), picture.pixels[0], 0.005f);
  check_close(vec3(s.textures[std::size_t(m.metallic_roughness_texture.index)].texels[0]), {0.2f, 0.4f, 1.0f},
              0.005f);
  // The extension's own matrices: a quarter turn maps (u, v) to (v, -u).
  const render::vec2 place = m.base_texture.transformed({0.1f, 0.2f});
  CHECK(place.x == Approx(0.5f + 3.0f * 0.2f));
  CHECK(place.y == Approx(0.25f - 2.0f * 0.1f));

  tiny.with("samplers", R"([{"wrapS": 7}])");
  CHECK(contains(tiny.error(), "wrap mode"));
  tiny.with("samplers", "[]");
  CHECK(contains(tiny.error(), "sampler 0"));
}

TEST_CASE("glTF: punctual lights are read", "[renderer][gltf]") {
  tiny_gltf tiny;
  tiny.with("extensions", R"({"KHR_lights_punctual": {"lights": [
      {"type": "spot", "intensity": 5, "color": [1, 0.5, 0], "spot": {"outerConeAngle": 0.5}},
      {"type": "directional"}, {"type": "point", "range": 3}]}})");
  tiny.with("nodes", R"([{"mesh": 0, "children": [1, 2, 3], "translation": [1, 2, 3]},
      {"extensions": {"KHR_lights_punctual": {"light": 0}}, "rotation": [0, 0.7071067811865475, 0, 0.7071067811865476]},
      {"extensions": {"KHR_lights_punctual": {"light": 1}}},
      {"extensions": {"KHR_lights_punctual": {"light": 2}}}])");
  const scene s = tiny.load();
  REQUIRE(s.punctual_lights.size() == 3);
  CHECK(s.punctual_lights[0].kind == render::punctual_kind::spot);
  check_close(s.punctual_lights[0].position, {1, 2, 3});
  check_close(s.punctual_lights[0].direction, {-1, 0, 0});
  check_close(s.punctual_lights[0].intensity, {5, 2.5f, 0});
  CHECK(s.punctual_lights[0].cos_outer == Approx(std::cos(0.5f)));
  CHECK(s.punctual_lights[1].kind == render::punctual_kind::directional);
  check_close(s.punctual_lights[1].direction, {0, 0, -1});
  CHECK(warns(s, "range"));
  tiny.with("nodes", R"([{"extensions": {"KHR_lights_punctual": {"light": 3}}}])");
  CHECK(contains(tiny.error(), "light 3"));
}

TEST_CASE("glTF: volumes absorb, and emission has textures", "[renderer][gltf]") {
  temporary_folder folder;
  render::write_png(folder.file("t.png"), render::make_image(1, 1));
  tiny_gltf tiny;
  tiny.with("images",
            R"([{"uri": "data:image/png;base64,)" + base64(content_of(folder.file("t.png"))) + R"("}])");
  tiny.with("textures", R"([{"source": 0}])");
  tiny.with("materials", R"([{"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}},
      {"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0}, "extensions": {
        "KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_volume":
          {"thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [1, 0.5, 0.25]}}}])");
  const scene s = tiny.load();
  CHECK(s.materials[0].emission_texture.index == 0);
  check_close(s.materials[1].absorption, {0.0f, std::log(2.0f) / 2.0f, std::log(4.0f) / 2.0f});
}

TEST_CASE("glTF: alpha masks are read", "[renderer][gltf]") {
  tiny_gltf tiny;
  const scene s = tiny.with("materials", R"([{"alphaMode": "MASK", "pbrMetallicRoughness":
      {"baseColorFactor": [1, 1, 1, 0.25]}}, {"alphaCutoff": 0.3, "alphaMode": "MASK"}, {}])")
                      .load();
  CHECK(s.materials[0].opacity == 0.25f);
  CHECK(s.materials[0].alpha_cutoff == 0.5f);
  CHECK(s.materials[1].alpha_cutoff == Approx(0.3f));
  CHECK(s.materials[2].alpha_cutoff == 0.0f);
}

TEST_CASE("glTF: each unsupported feature causes one warning", "[renderer][gltf]") {
  tiny_gltf tiny;
  tiny.with("meshes", R"([{"primitives": [{"attributes": {"POSITION": 0}, "mode": 1},
                                          {"attributes": {"POSITION": 0}, "mode": 0}]}])");
  tiny.with("materials", R"([{"alphaMode": "BLEND"}, {"alphaMode": "BLEND"}])");
  const scene s = tiny.load();
  CHECK(s.triangles.empty());
  int lines = 0;
  for (const std::string& line : s.warnings) lines += contains(line, "alpha") || contains(line, "points");
  CHECK(lines == 2);
}

TEST_CASE("glTF: unread extensions and their textures cause warnings", "[renderer][gltf]") {
  tiny_gltf tiny;
  tiny.with("extensionsUsed", R"(["EXT_mesh_gpu_instancing", "KHR_materials_transmission"])");
  tiny.with("materials", R"([{"extensions": {"KHR_materials_transmission":
      {"transmissionFactor": 0.5, "transmissionTexture": {"index": 0}}}}])");
  const std::vector<std::string> warnings = tiny.load().warnings;
  const auto lines_with = [&](const char* text) {
    int lines = 0;
    for (const std::string& line : warnings) lines += contains(line, text);
    return lines;
  };
  CHECK(lines_with("extension EXT_mesh_gpu_instancing is not supported") == 1);
  CHECK(lines_with("transmissionTexture is not supported") == 1);
  CHECK(lines_with("KHR_materials_transmission") == 0);
}

TEST_CASE("glTF: hostile files end in an error", "[renderer][gltf][hostile]") {
  SECTION("the file is missing") {
    CHECK_THROWS_AS(render::load_gltf("/nonexistent/no.glb"), std::runtime_error);
    CHECK_THROWS_AS(render::load_gltf("/"), std::runtime_error);
  }
  SECTION("the file is empty, noise, or of a wrong version") {
    CHECK(contains(tiny_gltf::error_of(""), "empty"));
    tiny_gltf::error_of("not json");
    tiny_gltf::error_of("{}");
    tiny_gltf::error_of("[1, 2]");
    CHECK(contains(tiny_gltf().with("asset", R"({"version": "1.0"})").error(), "version"));
    CHECK(contains(tiny_gltf().with("extras", std::string(5000, '[') + std::string(5000, ']')).error(),
                   "nests"));
  }
  SECTION("the file is truncated at any byte") {
    const std::string glb = tiny_gltf().glb(), json = tiny_gltf().json();
    for (std::size_t size = 0; size < glb.size(); ++size)
      CHECK(tiny_gltf::error_of(glb.substr(0, size)) != "nothing was thrown");
    for (std::size_t size = 0; size < json.size(); size += 7)
      CHECK(tiny_gltf::error_of(json.substr(0, size)) != "nothing was thrown");
  }
  SECTION("a GLB chunk exceeds the file") {
    std::string glb = tiny_gltf().glb();
    const std::uint32_t huge = 0xfffffff0u;
    std::memcpy(&glb[12], &huge, 4);
    CHECK(contains(tiny_gltf::error_of(glb), "chunk"));
    std::string last = tiny_gltf().glb();
    const std::uint32_t more = std::uint32_t(tiny_gltf().buffer.size()) + 8;
    std::memcpy(&last[last.size() - tiny_gltf().buffer.size() - 8], &more, 4);
    CHECK(contains(tiny_gltf::error_of(last), "chunk"));
  }
  SECTION("a vertex index is out of range") {
    tiny_gltf tiny;
    tiny.buffer[36] = 3;
    CHECK(contains(tiny.error(), "index 3"));
  }
  SECTION("accessors exceed their buffer view, and views their buffer") {
    const std::string indices = R"({"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}])";
    for (const char* bad : {R"("count": 4)", R"("count": 3, "byteOffset": 4)", R"("count": 2000000000)",
                            R"("count": 3, "byteOffset": 2000000000)", R"("count": -1)"})
      CHECK(tiny_gltf()
                .with("accessors", R"([{"bufferView": 0, "componentType": 5126, "type": "VEC3", )" +
                                       std::string(bad) + "}, " + indices)
                .error() != "nothing was thrown");
    for (const char* bad : {R"("byteLength": 4000)", R"("byteLength": 36, "byteOffset": 4000)",
                            R"("byteLength": 36, "byteStride": 16)", R"("byteLength": 36, "byteStride": 4)"})
      CHECK(tiny_gltf()
                .with("bufferViews", R"([{"buffer": 0, )" + std::string(bad) +
                                         R"(}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}])")
                .error() != "nothing was thrown");
    CHECK(tiny_gltf()
              .with("bufferViews", R"([{"buffer": 7, "byteLength": 36}, {"buffer": 0, "byteLength": 6}])")
              .error() != "nothing was thrown");
  }
  SECTION("component types and types are wrong") {
    const std::string positions = R"([{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},)";
    const std::string indices = R"({"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}])";
    CHECK(contains(tiny_gltf()
                       .with("accessors", positions + R"({"bufferView": 1, "componentType": 5126, "count": 1,
                                                           "type": "SCALAR"}])")
                       .error(),
                   "component type"));
    CHECK(contains(tiny_gltf()
                       .with("accessors", R"([{"bufferView": 0, "componentType": 5126, "count": 3,
                                               "type": "VEC2"},)" +
                                              indices)
                       .error(),
                   "wrong type"));
  }
  SECTION("references have no target") {
    for (const auto& [part, json] : std::vector<std::pair<std::string, std::string>>{
             {"scene", "5"},
             {"scenes", R"([{"nodes": [3]}])"},
             {"nodes", R"([{"mesh": 9}])"},
             {"nodes", R"([{"camera": 0}])"},
             {"nodes", R"([{"children": [-4]}])"},
             {"meshes", R"([{"primitives": [{"attributes": {"POSITION": 8}}]}])"},
             {"meshes", R"([{"primitives": [{"attributes": {"POSITION": 0}, "indices": 8}]}])"},
             {"meshes", R"([{"primitives": [{"attributes": {"POSITION": 0}, "material": 8}]}])"},
             {"meshes", R"([{"primitives": [{"attributes": {}}]}])"},
             {"materials", R"([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 4}}}])"},
             {"extensionsRequired", R"(["KHR_draco_mesh_compression"])"}}) {
      INFO(part << " = " << json);
      CHECK(tiny_gltf().with(part, json).error() != "nothing was thrown");
    }
  }
  SECTION("no camera sees the scene, or a camera sees nothing") {
    tiny_gltf huge;
    huge.buffer.replace(0, 36, raw<float>({0, 0, 0, 3e38f, 0, 0, 0, 3e38f, 0}));
    CHECK(contains(huge.error(), "too large"));
    tiny_gltf narrow;
    narrow.with("cameras", R"([{"type": "perspective", "perspective": {"yfov": 1e-60, "znear": 0.1}}])");
    CHECK(contains(narrow.with("nodes", R"([{"mesh": 0, "camera": 0}])").error(), "yfov"));
  }
  SECTION("node graphs are not trees") {
    CHECK(contains(tiny_gltf().with("nodes", R"([{"children": [0]}])").error(), "twice"));
    CHECK(contains(tiny_gltf().with("nodes", R"([{"children": [1]}, {"children": [0]}])").error(), "twice"));
    CHECK(contains(tiny_gltf().with("nodes", R"([{"children": [1, 1]}, {"mesh": 0}])").error(), "twice"));
  }
  SECTION("a hierarchy of a hundred thousand levels loads") {
    std::string nodes = "[";
    for (int i = 1; i < 100000; ++i) nodes += R"({"children": [)" + std::to_string(i) + "]},";
    CHECK(tiny_gltf().with("nodes", nodes + R"({"mesh": 0}])").load().triangles.size() == 1);
  }
  SECTION("transforms and positions are not finite") {
    CHECK(tiny_gltf().with("nodes", R"([{"mesh": 0, "matrix": [1, 2, 3]}])").error() != "nothing was thrown");
    CHECK(contains(tiny_gltf().with("nodes", R"([{"mesh": 0, "scale": [1e300, 1, 1]}])").error(), "finite"));
    tiny_gltf tiny;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    std::memcpy(&tiny.buffer[12], &nan, 4);
    CHECK(contains(tiny.error(), "finite"));
  }
  SECTION("an image's buffer view exceeds the buffer") {
    tiny_gltf tiny;
    tiny.with("bufferViews", R"([{"buffer": 0, "byteLength": 36},
        {"buffer": 0, "byteOffset": 36, "byteLength": 6}, {"buffer": 0, "byteOffset": 900, "byteLength": 900}])");
    tiny.with("images", R"([{"bufferView": 2, "mimeType": "image/png"}])")
        .with("textures", R"([{"source": 0}])");
    tiny.with("materials", R"([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}])");
    CHECK(contains(tiny.error(), "leaves its buffer"));
  }
}

TEST_CASE("glTF: fields of a wrong type or sign are named", "[renderer][gltf][hostile]") {
  struct refusal {
    std::string part, json, message;
  };
  const std::string index = ", expected a whole number from 0 to 2^31 - 1",
                    size = ", expected a whole number from 0 to 2^53",
                    numbers = ", expected a list of numbers",
                    indices = ", expected a list of whole numbers from 0 to 2^31 - 1",
                    number = ", expected a number", objects = ", expected a list of objects";
  const auto view = [](const std::string& fields) {
    return R"([{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6, )" + fields +
           "}]";
  };
  const auto accessor = [](const std::string& fields) {
    return R"([{"bufferView": 0, "componentType": 5126, "type": "VEC3", )" + fields +
           R"(}, {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}])";
  };
  const auto primitive = [](const std::string& fields) {
    return R"([{"primitives": [{"attributes": {"POSITION": 0}, )" + fields + "}]}]";
  };
  for (const refusal& one : std::vector<refusal>{
           {"bufferViews", view(R"("byteOffset": -36)"), "bufferViews[1].byteOffset is -36" + size},
           {"bufferViews", view(R"("byteOffset": 36.5)"), "bufferViews[1].byteOffset is 36.5" + size},
           {"bufferViews", view(R"("byteLength": -6)"), "bufferViews[1].byteLength is -6" + size},
           {"bufferViews", view(R"("byteStride": "2")"), "bufferViews[1].byteStride is \"2\"" + size},
           {"bufferViews", view(R"("buffer": -1)"), "bufferViews[1].buffer is -1" + index},
           {"bufferViews", view(R"("buffer": 4294967296)"), "bufferViews[1].buffer is 4294967296" + index},
           {"bufferViews", R"({"0": {"buffer": 0}})", "bufferViews is {\"0\":{\"buffer\":0}}" + objects},
           {"bufferViews", "[7]", "bufferViews is [7]" + objects},
           {"accessors", accessor(R"("count": -3)"), "accessors[0].count is -3" + size},
           {"accessors", accessor(R"("count": 3, "byteOffset": -4)"), "accessors[0].byteOffset is -4" + size},
           {"accessors", accessor(R"("count": 3, "byteOffset": null)"),
            "accessors[0].byteOffset is null" + size},
           {"scene", "-1", "scene is -1" + index},
           {"scenes", R"([{"nodes": 0}])", "scenes[0].nodes is 0" + indices},
           {"nodes", R"([{"mesh": -1}])", "nodes[0].mesh is -1" + index},
           {"nodes", R"([{"mesh": 0.0}])", "nodes[0].mesh is 0.0" + index},
           {"nodes", R"([{"mesh": true}])", "nodes[0].mesh is true" + index},
           {"nodes", R"([{"mesh": 0, "children": [-1]}])", "nodes[0].children is [-1]" + indices},
           {"nodes", R"([{"mesh": 0, "translation": ["a", 2, 3]}])",
            "nodes[0].translation is [\"a\",2,3]" + numbers},
           {"nodes", R"([{"mesh": 0, "translation": 5}])", "nodes[0].translation is 5" + numbers},
           {"nodes", R"([{"mesh": 0, "rotation": [0, 0, null, 1]}])",
            "nodes[0].rotation is [0,0,null,1]" + numbers},
           {"nodes", R"([{"mesh": 0, "scale": [[1], 1, 1]}])", "nodes[0].scale is [[1],1,1]" + numbers},
           {"nodes", R"([{"mesh": 0, "extensions": {"KHR_lights_punctual": {"light": -1}}}])",
            "nodes[0].extensions.KHR_lights_punctual.light is -1" + index},
           {"meshes", primitive(R"("indices": -1)"), "meshes[0].primitives[0].indices is -1" + index},
           {"meshes", primitive(R"("material": -1)"), "meshes[0].primitives[0].material is -1" + index},
           {"meshes", primitive(R"("mode": "4")"), "meshes[0].primitives[0].mode is \"4\"" + index},
           {"meshes", R"([{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": -1}}]}])",
            "meshes[0].primitives[0].NORMAL is -1" + index},
           {"meshes", R"([{"primitives": {}}])", "meshes[0].primitives is {}" + objects},
           {"materials", R"([{"emissiveFactor": ["1", 1, 1]}])",
            "materials[0].emissiveFactor is [\"1\",1,1]" + numbers},
           {"materials", R"([{"pbrMetallicRoughness": {"roughnessFactor": "0.5"}}])",
            "materials[0].pbrMetallicRoughness.roughnessFactor is \"0.5\"" + number},
           {"materials", R"([{"pbrMetallicRoughness": {"baseColorTexture": {"index": -1}}}])",
            "materials[0].pbrMetallicRoughness.baseColorTexture.index is -1" + index},
           {"materials", R"([{"extensions": {"KHR_materials_ior": {"ior": "1.5"}}}])",
            "materials[0].extensions.KHR_materials_ior.ior is \"1.5\"" + number},
           {"cameras", R"([{"type": "perspective", "perspective": {"yfov": "1", "znear": 0.1}}])",
            "cameras[0].perspective.yfov is \"1\"" + number},
           {"textures", R"([{"source": -1}])", "textures[0].source is -1" + index},
           {"extensions", R"({"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": "1"}]}})",
            "extensions.KHR_lights_punctual.lights[0].intensity is \"1\"" + number}}) {
    CHECK(tiny_gltf().with(one.part, one.json).error() == one.message);
  }
  // Extras may have any content.
  CHECK(tiny_gltf().with("extras", R"({"index": -1})").load().triangles.size() == 1);
  CHECK(
      tiny_gltf().with("materials", R"([{"extras": {"index": -1, "scale": "a"}}])").load().triangles.size() ==
      1);
}

TEST_CASE("glTF: files outside of the scene's folder are not read", "[renderer][gltf][hostile]") {
  const temporary_folder folder;
  std::filesystem::create_directories(folder.file("scene/textures"));
  const tiny_gltf tiny;
  folder.write("x.bin", tiny.buffer);
  folder.write("scene/textures/a b.bin", tiny.buffer);
  const auto loaded = [&](const std::string& uri) -> std::string {
    std::string json = tiny.json();
    const std::size_t start = json.find("data:application");
    json.replace(start, json.find('"', start) - start, uri);
    const std::string path = folder.write("scene/a.gltf", json);
    try {
      const scene s = render::load_gltf(path);
      CHECK(s.triangles.size() == 1);
    } catch (const std::runtime_error& error) {
      CHECK(contains(error.what(), path + ": buffers[0].uri is \""));
      return error.what();
    }
    return "";
  };
  for (const std::string& uri :
       {std::string("../x.bin"), std::string("textures/../../x.bin"), std::string("%2e%2e/x.bin"),
        std::string("..%2Fx.bin"), folder.file("x.bin"), "file://" + folder.file("x.bin")})
    CHECK(contains(loaded(uri), "expected a file in the scene's folder"));
  for (const std::string uri : {"none.bin", "textures", "", "x.bin"})
    CHECK(contains(loaded(uri), "expected a file that is there, in the scene's folder"));
  // Files in the working directory are not read either.
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  CHECK(contains(loaded("x.bin"), "expected a file that is there"));
  std::filesystem::current_path(before);
  CHECK(loaded("textures/a%20b.bin") == "");
  CHECK(loaded("textures/../textures/a b.bin") == "");

  const std::string image = tiny_gltf().with("images", R"([{"uri": "../a.png"}])").error();
  CHECK(image == "images[0].uri is \"../a.png\", expected a file in the scene's folder");
}

TEST_CASE("glTF: a mesh that emits and has no triangles is an error", "[renderer][gltf][hostile]") {
  tiny_gltf tiny;
  tiny.with("accessors", R"([{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
                             {"bufferView": 1, "componentType": 5123, "count": 0, "type": "SCALAR"}])");
  CHECK(tiny.load().triangles.empty());
  tiny.with("materials", R"([{"emissiveFactor": [1, 1, 1]}])");
  CHECK(tiny.error() == "mesh 0 emits light and has no triangles");
  tiny.with("nodes", "[{}]");  // which is not in the scene
  CHECK(tiny.load().triangles.empty());
}
