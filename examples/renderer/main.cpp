// wfpg-render: renders a scene with or without guiding. Exit code 0, or 2 with a message on failure.
#include "builtin_scenes.hpp"
#include "gltf_loader.hpp"
#include "progress_bar.hpp"
#include "render.hpp"
#include "stats_json.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <iostream>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

constexpr int failure = 2;

struct arguments {
  std::string scene, environment, size, output, png, stats, reference;
  float exposure = 1.0f;  // of the PNG
  render::render_options options;
};

// CLI11's own checked transformer accepts the numbers behind the names too; names are all that is documented.
template <class T, class Value>
CLI::Option* add_choice(CLI::App& app, const std::string& name, Value& value,
                        const std::map<std::string, T>& choices, const std::string& help) {
  std::vector<std::string> names;
  for (const auto& choice : choices) names.push_back(choice.first);
  return app
      .add_option_function<std::string>(
          name, [&value, choices](const std::string& chosen) { value = choices.at(chosen); }, help)
      ->check(CLI::IsMember(names))
      ->type_name("NAME");
}

void add_method_options(CLI::App& app, render::render_options& options) {
  using render::device;
  using render::fields;
  using render::guiding;
  using render::sampling_method;
  using combine = wfpg::sample_combination;
  add_choice<sampling_method>(app, "--method", options.method,
                              {{"pt", sampling_method::pt},
                               {"wfpg", sampling_method::wfpg},
                               {"wfpg-product", sampling_method::wfpg_product},
                               {"openpgl-vmm", sampling_method::openpgl_vmm},
                               {"openpgl-dqt", sampling_method::openpgl_dqt}},
                              "path tracing; guided by fields (default), or by their products with BSDFs; by "
                              "Open PGL's mixtures of lobes or quadtrees");
  add_choice<guiding>(app, "--guiding", options.mode,
                      {{"oriented", guiding::oriented}, {"plain", guiding::plain}},
                      "bins by position and normal (default), or by position alone");
  add_choice<fields>(app, "--fields", options.lifetime,
                     {{"kept", fields::kept}, {"transient", fields::transient}},
                     "kept across depths and samples (default), or made anew each time");
  add_choice<device>(app, "--device", options.where,
                     {{"cpu", device::cpu},
                      {"omp", device::omp},
                      {"seq", device::seq},
                      {"cuda", device::cuda},
                      {"optix", device::optix}},
                     "TBB (default), OpenMP, one thread, or a GPU");
  add_choice<bool>(app, "--nee", options.nee, {{"on", true}, {"off", false}},
                   "next-event estimation toward area lights (default: on)");
  add_choice<combine>(app, "--combine", options.combine,
                      {{"pt-linear", combine::pt_linear},
                       {"pt-first", combine::pt_first},
                       {"constant", combine::constant},
                       {"linear", combine::linear},
                       {"quadratic", combine::quadratic},
                       {"one-two", combine::one_two},
                       {"discard-first", combine::discard_first}},
                      "how samples add up (default: pt-linear; constant for pt)");
}

void add_budget_options(CLI::App& app, arguments& given) {
  render::render_options& options = given.options;
  CLI::Option* const spp =
      app.add_option("--spp", options.spp, "samples a pixel (default: 64)")->check(CLI::Range(1, 1 << 30));
  app.add_option("--seconds", options.seconds, "render for so long instead")
      ->check(CLI::PositiveNumber)
      ->excludes(spp);
  app.add_option("--size", given.size, "picture, WIDTHxHEIGHT (default: the scene's)");
  app.add_option("--max-depth", options.max_depth, "segments of a path (default: the scene's)")
      ->check(CLI::Range(1, 1 << 30));
  app.add_option("--seed", options.seed, "of the random numbers (default: 0)");
}

void add_guider_options(CLI::App& app, render::render_options& options) {
  app.add_option("--octree-resolution", options.octree_resolution,
                 "voxels a side, a power of two (default: 128)");
  app.add_option("--field-resolution", options.field_resolution,
                 "cells a side of transient fields at the first vertex (default: 32)");
  app.add_option("--slot-resolution", options.slot_resolution, "cells a side of kept fields (default: 24)");
  app.add_option("--recast", options.recast, "a refresh casts one cone in so many again (default: 8)")
      ->check(CLI::Range(1, 1 << 20));
  app.add_option("--field-budget", options.field_budget, "memory of kept fields, such as 16MiB (the default)")
      ->transform(CLI::AsSizeValue(false));
  app.add_option("--product-resolution", options.product_resolution,
                 "blocks a side of wfpg-product's products: 4, 8 or 16 (default: 8)")
      ->check(CLI::IsMember({4, 8, 16}));
  app.add_option("--rays-per-bin", options.rays_per_bin, "rays that a bin should have (default: 64)");
  app.add_option("--min-bin-level", options.min_bin_level, "octree level of the largest bins (default: 3)");
  app.add_option("--guide-fraction", options.guide_fraction,
                 "samples drawn from fields (default: the mode's)")
      ->check(CLI::Range(0.0, 1.0));
  app.add_option("--samples-per-leaf", options.samples_per_leaf,
                 "after which Open PGL splits a leaf of its field (default: 32000)")
      ->check(CLI::Range(8, 1 << 30));
}

void add_file_options(CLI::App& app, arguments& given) {
  app.add_option("SCENE", given.scene,
                 "a .glb or .gltf file, or one of: " + CLI::detail::join(render::builtin_scene_names(), ", "))
      ->required();
  app.add_option("--environment", given.environment,
                 "light from all directions, OpenEXR or .hdr, equirectangular (default: the scene's)");
  app.add_option("-o,--output", given.output, "picture, OpenEXR");
  app.add_option("--png", given.png, "picture, sRGB PNG");
  app.add_option("--exposure", given.exposure, "multiplies the PNG's values (default: 1)")
      ->check(CLI::PositiveNumber)
      ->needs("--png");
  app.add_option("--stats", given.stats, "what it cost, JSON");
  app.add_option("--reference", given.reference, "picture to print the error against, OpenEXR");
}

void parse_size(const std::string& text, render::render_options& options) {
  char end = 0;
  if (std::sscanf(text.c_str(), "%5dx%5d%c", &options.width, &options.height, &end) != 2 ||
      options.width <= 0 || options.height <= 0)
    throw std::invalid_argument("--size is " + text + ", expected WIDTHxHEIGHT, such as 640x360");
}

render::scene load_scene(const std::string& name) {
  if (render::is_builtin_scene(name)) return render::make_builtin_scene(name);
  const std::size_t dot = name.rfind('.');
  const std::string extension = dot == std::string::npos ? "" : name.substr(dot);
  if (extension == ".glb" || extension == ".gltf") return render::load_gltf(name);
  throw std::invalid_argument("SCENE is " + name + ", expected a .glb or .gltf file or one of " +
                              CLI::detail::join(render::builtin_scene_names(), ", "));
}

bool is_dark(const render::scene& scene) {
  for (const render::material& m : scene.materials)
    if (m.emission != render::vec3(0.0f)) return false;
  return scene.punctual_lights.empty() && scene.sky.texels.empty() && scene.environment == render::vec3(0.0f);
}

void print_error(const render::image_error& error) {
  std::printf("mse %.6e  relmse %.6e  relmse trimmed %.6e  mse reinhard %.6e\n", error.mse, error.relmse,
              error.relmse_trimmed, error.mse_reinhard);
}

void run(arguments& given) {
  if (!given.size.empty()) parse_size(given.size, given.options);
  render::scene scene = load_scene(given.scene);
  if (!given.environment.empty()) scene.sky = render::read_environment(given.environment);
  for (const std::string& warning : scene.warnings) std::cerr << "wfpg-render: warning: " << warning << '\n';
  if (!scene.punctual_lights.empty() && !given.options.nee)
    std::cerr << "wfpg-render: warning: point, spot and directional lights are lost with --nee off\n";
  if (is_dark(scene)) std::cerr << "wfpg-render: warning: the scene has no light: the picture is black\n";
  // Read before rendering, so that a wrong path costs no time.
  std::optional<render::image> reference;
  if (!given.reference.empty()) reference = render::read_exr(given.reference);

  render::progress_bar bar;
  const render::render_result result =
      render::render(scene, given.options, [&bar](const render::render_progress& p) { bar.show(p); });
  bar.finish();
  if (!given.output.empty()) render::write_exr(given.output, result.picture);
  if (!given.png.empty()) render::write_png(given.png, result.picture, given.exposure);
  std::optional<render::image_error> error;
  if (reference) error = render::compare(result.picture, *reference);
  if (error) print_error(*error);
  if (!given.stats.empty()) render::write_stats(given.stats, result.report, error);
}

}  // namespace

int main(int argc, char** argv) {
  arguments given;
  CLI::App app{"Renders a scene by wavefront path tracing, with or without path guiding."};
  add_file_options(app, given);
  add_method_options(app, given.options);
  add_budget_options(app, given);
  add_guider_options(app, given.options);
  try {
    app.parse(argc, argv);
    if (given.output.empty() && given.png.empty() && given.stats.empty() && given.reference.empty())
      throw CLI::RequiredError("one of -o, --png, --stats, --reference");
    if (app.count("--product-resolution") > 0 &&
        given.options.method != render::sampling_method::wfpg_product)
      throw CLI::RequiresError("--product-resolution", "--method wfpg-product");
    if (app.count("--samples-per-leaf") > 0 && !render::is_openpgl(given.options.method))
      throw CLI::RequiresError("--samples-per-leaf", "--method openpgl-vmm or openpgl-dqt");
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : failure;
  }
  try {
    run(given);
  } catch (const std::exception& error) {
    std::cerr << "wfpg-render: " << error.what() << '\n';
    return failure;
  }
  return 0;
}
