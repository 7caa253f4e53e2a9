// State files of any bytes: a rendering that resumes, or an error that names the file. A second interruption
// changes nothing. Each input is read as it is, and again with correct checksums.
#include "app/render.hpp"
#include "checksums.hpp"
#include "memory_file.hpp"
#include "require.hpp"
#include "scene/scene.hpp"

#include <wfpg/base/error.hpp>

#include <tbb/global_control.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>

namespace {

using namespace render;
using wfpg_fuzz::require;

/// Two lamps over a floor.
scene make_scene() {
  scene world;
  const auto add = [&world](vec3 corner, vec3 a, vec3 b, std::uint32_t material) {
    const auto first = static_cast<std::uint32_t>(world.positions.size());
    world.positions.insert(world.positions.end(), {corner, corner + a, corner + b});
    world.triangles.push_back({first, first + 1, first + 2});
    world.triangle_materials.push_back(material);
  };
  world.materials.resize(2);
  world.materials[1].emission = vec3(3.0f);
  add({-2.0f, 0.0f, -2.0f}, {0.0f, 0.0f, 4.0f}, {4.0f, 0.0f, 0.0f}, 0);
  add({-1.0f, 1.0f, -1.0f}, {0.5f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.5f}, 1);
  add({0.0f, 1.0f, -1.0f}, {0.5f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.5f}, 1);
  world.view.position = {-0.5f, 0.8f, 1.0f};
  world.view.forward = {0.0f, -0.6f, -0.8f};
  return world;
}

/// The options that the seeds were rendered with, if their names are in the file.
render_options options_of(const std::string& bytes) {
  const auto has = [&bytes](const char* text) { return bytes.find(text) != std::string::npos; };
  render_options options;
  options.method = has("--product-resolution") ? sampling_method::wfpg_product
                   : has("--guiding")          ? sampling_method::wfpg
                                               : sampling_method::pt;
  options.mode = has("plain") ? guiding::plain : guiding::oriented;
  options.lifetime = has("transient") ? fields::transient : fields::kept;
  options.nee = has("--light-groups");
  options.width = options.height = 4;
  options.max_depth = 3;
  options.spp = 5;
  options.octree_resolution = 4;
  options.field_resolution = options.kept.resolution = options.product_resolution = 4;
  options.kept.budget_bytes = 2048;
  options.binning.min_level = 1;
  options.binning.rays_per_bin = 2;
  options.light_groups = 2;
  options.keep_state = true;
  return options;
}

/// Resumes a state, to the end or for one sample.
render_result go_on(const std::string& state, render_options options, bool is_whole) {
  static const scene world = make_scene();
  static const wfpg_fuzz::memory_file file;
  // Several threads would take longer for these few paths.
  static const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  file.hold(state);
  options.resume = file.path();
  if (!is_whole) options.is_stopped = [] { return true; };
  try {
    return render::render(world, options, {});
  } catch (const wfpg::file_error& error) {
    require(std::string(error.what()).rfind("wfpg: " + options.resume, 0) == 0, "errors name the file");
    throw;
  }
}

bool same_bits(const image& a, const image& b) {
  return std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(vec3)) == 0;
}

void read(const std::string& bytes) {
  const render_options options = options_of(bytes);
  try {
    const render_result whole = go_on(bytes, options, true);
    require(std::isfinite(whole.report.cones_per_segment), "what is reported is finite");
    const render_result rest = go_on(go_on(bytes, options, false).state, options, true);
    require(same_bits(rest.picture, whole.picture) && rest.state == whole.state,
            "interruptions make no difference");
  } catch (const wfpg::file_error&) {
  } catch (const std::invalid_argument& error) {
    require(std::string(error.what()).find("spp") != std::string::npos,
            "what is refused is too many samples");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  read(bytes);
  read(wfpg_fuzz::with_checksums(bytes));
  return 0;
}
