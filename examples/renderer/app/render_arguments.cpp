// Options of the command line, by CLI11.
#include "app/render_arguments.hpp"

#include "app/image_io.hpp"
#include "app/number_options.hpp"
#include "app/option_names.hpp"
#include "scene/builtin_scenes.hpp"
#include "scene/gltf_loader.hpp"

#include <CLI/CLI.hpp>

#include <cstdint>
#include <cstdio>
#include <limits>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace render {
namespace {

// The library's limits.
constexpr std::uint64_t largest_octree = 4096, largest_level = 12;
constexpr std::uint64_t largest_count = std::numeric_limits<std::uint32_t>::max();
constexpr double longest_seconds = 1.0e9;

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

/// An option that a value of 0 unsets.
template <class T>
CLI::Option* add_unless_zero(CLI::App& app, const std::string& name, std::optional<T>& to,
                             const std::string& help) {
  const auto assign = [&to](const T& value) { to = value != T(0) ? std::optional<T>(value) : std::nullopt; };
  return app.add_option_function<T>(name, assign, help);
}

/// A help text with the option's default: the value that it has before the command line is read. Bytes in
/// whole MiB as such.
template <class T>
std::string with_default(const std::string& what, const T& value) {
  std::ostringstream text;
  text << what << " (default: ";
  constexpr std::size_t mebibyte = std::size_t(1) << 20;
  if constexpr (std::is_same_v<T, std::size_t>) {
    if (value % mebibyte == 0 && value > 0) return text << value / mebibyte << "MiB)", text.str();
  }
  text << value << ')';
  return text.str();
}

void parse_size(const std::string& text, render_options& options) {
  char end = 0;
  const bool is_size = std::sscanf(text.c_str(), "%9dx%9d%c", &options.width, &options.height, &end) == 2 &&
                       text.find_first_not_of("0123456789x") == std::string::npos;
  const auto fits = [](int side) { return side >= 1 && side <= largest_side; };
  if (!is_size || !fits(options.width) || !fits(options.height) ||
      std::int64_t(options.width) * options.height > most_pixels)
    throw CLI::ValidationError("--size", "expected WIDTHxHEIGHT, such as 640x360, each from 1 to " +
                                             std::to_string(largest_side) + " and 2^28 pixels at most, not " +
                                             text);
}

/// A device's name, and after a colon the numbers of GPUs.
void parse_device(const std::string& text, render_options& options) {
  const std::size_t colon = text.find(':');
  const auto named = device_names().find(text.substr(0, colon));
  const bool is_known = named != device_names().end();
  std::vector<int> numbers;
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  std::size_t at = colon == std::string::npos ? text.size() : colon + 1;
  bool is_list = colon == std::string::npos || at < text.size();
  while (is_list && at < text.size()) {
    std::size_t end = at;
    while (end < text.size() && is_digit(text[end])) ++end;
    is_list =
        end > at && end - at <= 3 && (end == text.size() || (text[end] == ',' && end + 1 < text.size()));
    if (is_list) numbers.push_back(std::stoi(text.substr(at, end - at)));
    at = end + 1;
  }
  const bool has_gpus = is_known && (named->second == device::cuda || named->second == device::optix);
  if (!is_known || !is_list || (!numbers.empty() && !has_gpus))
    throw CLI::ValidationError("--device",
                               "expected cpu, omp, seq, cuda or optix, or GPUs by their numbers, such "
                               "as cuda:0,1, not " +
                                   text);
  options.where = named->second;
  options.devices = std::move(numbers);
}

void add_sarsa_options(CLI::App& app, wfpg::sarsa_grid_options& options) {
  add_choice<wfpg::sarsa_update>(app, "--sarsa-update", options.update, sarsa_update_names(),
                                 "what directions are taught: SARSA's targets (default), those of all "
                                 "directions, or what paths gather");
  add_choice<wfpg::sarsa_sampler>(app, "--sarsa-sampler", options.sampler, sarsa_sampler_names(),
                                  "inversion over the sphere or hemisphere, rejection, or that mixed with "
                                  "uniform directions (default)");
  app.add_option("--sarsa-resolution", options.resolution,
                 with_default("cells along each side of the scene", options.resolution))
      ->transform(whole_number(1, 64));
  app.add_option(
         "--sarsa-directions", options.direction_resolution,
         with_default("directions along the side of a cell's square, even", options.direction_resolution))
      ->transform(whole_number(2, 64));
  app.add_option("--sarsa-step", options.step,
                 with_default("samples after which what was learnt is used", options.step))
      ->transform(whole_number(1, largest_count));
  app.add_option("--sarsa-learning-rate", options.learning_rate,
                 with_default("what a new value counts for; 0: as each before", options.learning_rate))
      ->transform(number(0.0, 1.0));
}

void add_records_options(CLI::App& app, wfpg::irradiance_records_options& options) {
  app.add_option("--records-octree", options.octree_resolution,
                 with_default("voxels a side that records look at", options.octree_resolution))
      ->transform(power_of_two(1, largest_octree));
  app.add_option("--records-level", options.record_level,
                 with_default("octree level of records", options.record_level))
      ->transform(whole_number(0, largest_level));
  app.add_option("--records-rays", options.emitter_rays,
                 with_default("rays from emitters, which find what is lit directly", options.emitter_rays))
      ->transform(whole_number(1, std::uint64_t(1) << 31));
  app.add_option("--records-cones", options.cones_per_direction,
                 with_default("of each direction", options.cones_per_direction))
      ->transform(whole_number(1, 256));
  app.add_option("--records-albedo", options.albedo, with_default("of what emitters light", options.albedo))
      ->transform(number(0.0, 1.0));
}

/// Options that have an effect only where others are chosen so.
struct requirement {
  std::vector<const char*> options;
  std::string what;
  bool (*holds)(const render_options&);
};

/// Whether a technique is one of the method's.
template <technique by>
bool uses(const render_options& options) {
  return is_bidirectional(options.method) && techniques_of(options).has(by);
}

const std::vector<requirement>& requirements() {
  using options = const render_options&;
  static const std::vector<requirement> all = {
      {{"--guiding", "--fields", "--octree-resolution", "--field-resolution", "--slot-resolution", "--recast",
        "--learn", "--light-groups", "--field-budget", "--rays-per-bin", "--min-bin-level",
        "--deposits-per-leaf", "--least-gain", "--cones", "--octree", "--caster-buffer", "--load-guide",
        "--save-guide"},
       "--method wfpg or wfpg-product",
       [](options o) { return is_wfpg(o.method); }},
      {{"--field-resolution"},
       "--fields transient",
       [](options o) { return o.lifetime == fields::transient; }},
      {{"--slot-resolution", "--recast", "--learn", "--field-budget"},
       "--fields kept",
       [](options o) { return o.lifetime == fields::kept; }},
      {{"--fog"},
       "--method " + names_of_methods(&method_properties::has_media),
       [](options o) { return properties_of(o.method).has_media; }},
      {{"--product-resolution"},
       "--method wfpg-product",
       [](options o) { return o.method == sampling_method::wfpg_product; }},
      {{"--samples-per-leaf"},
       "--method openpgl-vmm or openpgl-dqt",
       [](options o) { return is_openpgl(o.method); }},
      {{"--caster-buffer"}, "--device optix", [](options o) { return o.where == device::optix; }},
      {{"--caster-buffer"}, "--cones scene", [](options o) { return o.through == cones::scene; }},
      {{"--octree"},
       "--cones scene, or another source than samples",
       [](options o) { return o.octree != octree_source::samples || o.through == cones::scene; }},
      {{"--guide-fraction"}, "a --method that guides", [](options o) { return is_guided(o.method); }},
      {{"--techniques"}, "--method bpt, vcm or upbp", [](options o) { return chooses_techniques(o.method); }},
      {{"--technique-pictures", "--light-memory"},
       "--method bpt, vcm, upbp or lt",
       [](options o) { return is_bidirectional(o.method); }},
      {{"--radius"}, "--method vcm or upbp, or surf among --techniques", uses<technique::surf>},
      {{"--radius-alpha"},
       "--method vcm or upbp, or merges among --techniques",
       [](options o) { return is_bidirectional(o.method) && techniques_of(o).merges(); }},
      {{"--volume-radius"},
       "--method upbp, or pp3d, pb2d or bb1d among --techniques",
       [](options o) { return is_bidirectional(o.method) && techniques_of(o).merges_in_media(); }},
      {{"--dense-photons"},
       "--method vcm or upbp, or surf or pp3d among --techniques",
       [](options o) { return is_bidirectional(o.method) && techniques_of(o).merges_at_points(); }},
      {{"--beam-paths"}, "--method upbp, or bb1d among --techniques", uses<technique::bb1d>},
      {{"--beam-point-paths"}, "--method upbp, or pb2d among --techniques", uses<technique::pb2d>},
      {{"--guided-depths"},
       "--method wfpg, wfpg-product, sarsa or records",
       [](options o) { return is_guided(o.method) && !is_openpgl(o.method); }},
      {{"--save-state", "--resume"},
       "--method " + names_of_methods(&method_properties::can_be_saved),
       [](options o) { return properties_of(o.method).can_be_saved; }},
      {{"--samples-a-wave"}, "--split samples", [](options o) { return o.split == rank_split::samples; }},
      {{"--device"},
       "--split tiles or samples, for several GPUs",
       [](options o) { return o.devices.size() < 2 || o.split.has_value(); }},
      {{"--rank-seconds"}, "--split", [](options o) { return o.split.has_value(); }},
      {{"--split"},
       "--method " + names_of_methods(&method_properties::can_be_split),
       [](options o) { return properties_of(o.method).can_be_split; }},
      {{"--split"},
       "--octree triangles or caster",
       [](options o) { return o.octree != octree_source::samples; }},
      {{"--save-state", "--resume"},
       "--split tiles, or none",
       [](options o) { return o.split != rank_split::samples; }},
      {{"--sarsa-update", "--sarsa-sampler", "--sarsa-resolution", "--sarsa-directions", "--sarsa-step",
        "--sarsa-learning-rate"},
       "--method sarsa",
       [](options o) { return o.method == sampling_method::sarsa; }},
      {{"--records-octree", "--records-level", "--records-rays", "--records-cones", "--records-albedo"},
       "--method records",
       [](options o) { return o.method == sampling_method::records; }}};
  return all;
}

}  // namespace

void report_in_one_line(CLI::App& app, const std::string& program) {
  app.failure_message([program](const CLI::App*, const CLI::Error& error) {
    return program + ": " + error.what() + "; --help lists the options\n";
  });
}

void add_scene_options(CLI::App& app, scene_arguments& given) {
  app.add_option("SCENE", given.name, "a .glb or .gltf file, or one of: " + listed_builtin_scenes())
      ->required();
  app.add_option("--environment", given.environment,
                 "light from all directions, OpenEXR or .hdr, equirectangular (default: the scene's)")
      ->transform(file_path());
}

void add_method_options(CLI::App& app, render_options& options) {
  add_choice<sampling_method>(app, "--method", options.method, method_names(),
                              "path tracing; that of scenes with media; bidirectional path tracing; that and "
                              "merging of vertices; that and points and beams in media; light tracing; "
                              "guided by fields (default), or by their products with BSDFs; by "
                              "a grid that learns by SARSA; by irradiance records that are made before the "
                              "first path; by Open PGL's mixtures of lobes or quadtrees");
  add_choice<guiding>(app, "--guiding", options.mode,
                      {{"oriented", guiding::oriented}, {"plain", guiding::plain}},
                      "bins by position and normal (default), or by position alone");
  add_choice<fields>(app, "--fields", options.lifetime,
                     {{"kept", fields::kept}, {"transient", fields::transient}},
                     "kept across depths and samples (default), or made anew each time");
  add_choice<cones>(app, "--cones", options.through, cones_names(),
                    "cones of fields find light by rays through the scene (default), by rays through the "
                    "octree, or as cones through it");
  add_choice<octree_source>(app, "--octree", options.octree, octree_names(),
                            "built from triangles (default), from rays of the scene's caster, or from the "
                            "first sample's hits");
  add_choice<wfpg::sample_combination>(
      app, "--combine", options.combine, combination_names(),
      "how samples add up (default: inverse-variance, as the guide measures it; pt-linear for guides that "
      "measure nothing; constant for methods that do not learn, and with --load-guide)");
}

void add_bidirectional_options(CLI::App& app, render_options& options) {
  const auto parse = [&options](const std::string& names) {
    try {
      options.techniques = techniques_of(names);
    } catch (const std::invalid_argument& error) {
      throw CLI::ValidationError("--techniques", error.what());
    }
  };
  app.add_option_function<std::string>(
         "--techniques", parse,
         "how bpt, vcm and upbp find light: hits of lights, light samples, connections of paths, light paths "
         "that the camera sees, merges on surfaces, merges in media of points, of points with beams, of "
         "beams; names with + between them (default of upbp: " +
             names_of(points_beams_and_paths()) + "; of vcm: without the last three; of bpt: without merges)")
      ->type_name("NAMES");
  app.add_option("--light-memory", options.light.budget_bytes,
                 with_default("memory of light paths' vertices, and as much of their beams",
                              options.light.budget_bytes))
      ->transform(byte_count());
  app.add_option("--radius", options.light.surface_radius,
                 with_default("of the first sample's merges on surfaces, over the scene's radius",
                              options.light.surface_radius))
      ->transform(positive_number(1.0));
  app.add_option("--volume-radius", options.light.volume_radius,
                 with_default("the same, of merges in media", options.light.volume_radius))
      ->transform(positive_number(1.0));
  app.add_option(
         "--dense-photons", options.light.dense_photons,
         with_default("about how many photons a merge at a point finds at most; of more, some count for "
                      "all",
                      options.light.dense_photons))
      ->transform(whole_number(1, 1 << 30));
  app.add_option("--beam-paths", options.light.beam_paths,
                 "light paths of a sample that leave beams (default: one in 64, at most 512)")
      ->transform(whole_number(1, 1 << 30));
  app.add_option("--beam-point-paths", options.light.beam_point_paths,
                 "light paths whose vertices merge with camera beams (default: all, at most 16384)")
      ->transform(whole_number(1, 1 << 30));
  app.add_option("--radius-alpha", options.light.radius_alpha,
                 with_default("radii shrink as the sample's number to the power (this - 1) / D, for merges "
                              "in D dimensions; 1: not at all",
                              options.light.radius_alpha))
      ->transform(positive_number(1.0));
}

void add_device_option(CLI::App& app, render_options& options) {
  app.add_option_function<std::string>(
         "--device", [&options](const std::string& text) { parse_device(text, options); },
         "TBB (cpu, default), OpenMP (omp), one thread (seq), or a GPU (cuda, optix); cuda:0,1 has the "
         "GPUs of these numbers share the picture, as --split says")
      ->type_name("NAME");
}

void add_rank_options(CLI::App& app, render_options& options) {
  add_choice<rank_split>(
      app, "--split", options.split, {{"tiles", rank_split::tiles}, {"samples", rank_split::samples}},
      "processes that mpirun starts share the pixels of each sample, or several samples; the "
      "picture has the same bytes for any number of them");
  app.add_option(
         "--samples-a-wave", options.samples_a_wave,
         with_default("samples that end together, which --split samples shares", options.samples_a_wave))
      ->transform(whole_number(1, 1 << 16));
  app.add_option("--rank-seconds", options.rank_seconds,
                 with_default("for which a process waits for others", options.rank_seconds))
      ->transform(positive_number(1.0e6));
}

void add_nee_option(CLI::App& app, render_options& options) {
  add_choice<bool>(app, "--nee", options.nee, {{"on", true}, {"off", false}},
                   "next-event estimation toward area lights (default: on)");
}

void add_budget_options(CLI::App& app, render_options& options) {
  CLI::Option* const spp = app.add_option("--spp", options.spp, with_default("samples a pixel", options.spp))
                               ->transform(whole_number(1, 1 << 30));
  app.add_option("--seconds", options.seconds, "render for so long instead")
      ->transform(positive_number(longest_seconds))
      ->excludes(spp);
  app.add_option("--seed", options.seed, with_default("of the random numbers", options.seed))
      ->transform(whole_number(0, std::numeric_limits<std::uint64_t>::max()));
}

void add_picture_options(CLI::App& app, render_options& options) {
  app.add_option_function<std::string>(
      "--size", [&options](const std::string& text) { parse_size(text, options); },
      "picture, WIDTHxHEIGHT (default: the scene's)");
  app.add_option("--max-depth", options.max_depth, "segments of a path (default: the scene's)")
      ->transform(whole_number(1, largest_depth));
  app.add_option("--roulette-depth", options.roulette_depth,
                 with_default("vertex before which Russian roulette ends no path; the first hit is 0",
                              options.roulette_depth))
      ->transform(whole_number(1, 1 << 30));
}

void add_guider_options(CLI::App& app, render_options& options) {
  app.add_option("--octree-resolution", options.octree_resolution,
                 with_default("voxels a side", options.octree_resolution))
      ->transform(power_of_two(1, largest_octree));
  app.add_option(
         "--field-resolution", options.field_resolution,
         with_default("cells a side of transient fields at the first vertex", options.field_resolution))
      ->transform(whole_number(2, 128));
  app.add_option("--slot-resolution", options.kept.resolution,
                 with_default("cells a side of kept fields", options.kept.resolution))
      ->transform(whole_number(2, 128));
  app.add_option("--recast", options.kept.recast,
                 with_default("a refresh casts one cone in so many again", options.kept.recast))
      ->transform(whole_number(1, 1 << 20));
  add_choice<bool>(app, "--learn", options.kept.learn, {{"on", true}, {"off", false}},
                   "kept fields learn from paths, beside their cones (default: on)");
  app.add_option("--light-groups", options.light_groups,
                 with_default("lights are chosen from so many groups as is learnt; 1: by power",
                              options.light_groups))
      ->transform(whole_number(1, 255));
  app.add_option("--field-budget", options.kept.budget_bytes,
                 with_default("memory of kept fields", options.kept.budget_bytes))
      ->transform(byte_count());
  app.add_option("--caster-buffer", options.caster_buffer,
                 with_default("memory of cones in flight to OptiX", options.caster_buffer))
      ->transform(byte_count());
  app.add_option(
         "--product-resolution", options.product_resolution,
         with_default("blocks a side of wfpg-product's products: 4, 8 or 16", options.product_resolution))
      ->transform(whole_number(4, 16))
      ->check(CLI::IsMember({4, 8, 16}));
  app.add_option("--rays-per-bin", options.binning.rays_per_bin,
                 with_default("rays that a bin should have", options.binning.rays_per_bin))
      ->transform(whole_number(1, largest_count));
  app.add_option("--min-bin-level", options.binning.min_level,
                 with_default("octree level of the largest bins", options.binning.min_level))
      ->transform(whole_number(0, largest_level));
  add_unless_zero(app, "--deposits-per-leaf", options.deposits_per_leaf,
                  with_default("deposits a leaf of the octree in a sample that is recorded; 0: all, in each",
                               *options.deposits_per_leaf))
      ->transform(whole_number(0, largest_count));
  app.add_option("--least-gain", options.least_gain,
                 "guides rest where they lower the variance by less than this factor, at least 1; 0: they "
                 "never rest (default: 1.25 on GPUs, 1.75 on CPUs)")
      ->transform(number(0.0, 1.0e6));
  add_unless_zero(app, "--guide-fraction", options.guide_fraction,
                  "fraction of directions drawn from the guide (default: learnt where fields learn, else the "
                  "mode's; as 0)")
      ->transform(number(0.0, 1.0));
  app.add_option(
         "--guided-depths", options.guided_depths,
         "so many vertices of a path are guided, the first ones (default: all; with --nee on never the "
         "last of several, whose direction finds emitters alone)")
      ->transform(whole_number(1, largest_count));
  app.add_option("--samples-per-leaf", options.samples_per_leaf,
                 with_default("after which Open PGL splits a leaf of its field", options.samples_per_leaf))
      ->transform(whole_number(8, 1 << 30));
  add_sarsa_options(app, options.sarsa);
  add_records_options(app, options.records);
}

void check_render_options(const CLI::App& app, const render_options& options) {
  const auto is_given = [&app](const char* name) {
    const CLI::Option* const option = app.get_option_no_throw(name);
    return option != nullptr && option->count() > 0;
  };
  for (const requirement& required : requirements())
    for (const char* const name : required.options)
      if (is_given(name) && !required.holds(options)) throw CLI::RequiresError(name, required.what);
  // A scene's or a preset's --nee is not the command line's.
  if (is_given("--light-groups") && is_given("--nee") && !options.nee)
    throw CLI::RequiresError("--light-groups", "--nee on");
  const std::string method = "--method " + name_of(method_names(), options.method);
  if (is_openpgl(options.method) && options.where != device::cpu)
    throw CLI::RequiresError(method, "--device cpu");
  if (properties_of(options.method).asks_inline && options.where == device::optix)
    throw CLI::RequiresError(method, "a --device other than optix");
}

std::string listed_builtin_scenes() {
  return CLI::detail::join(builtin_scene_names(), ", ");
}

scene load_scene(const std::string& name) {
  if (is_builtin_scene(name)) return make_builtin_scene(name);
  const std::size_t dot = name.rfind('.');
  const std::string extension = dot == std::string::npos ? "" : name.substr(dot);
  if (extension == ".glb" || extension == ".gltf") return load_gltf(name);
  throw std::invalid_argument("SCENE is " + name + ", expected a .glb or .gltf file or one of " +
                              listed_builtin_scenes());
}

scene load_scene(const scene_arguments& given, const render_options& options, const std::string& program,
                 std::ostream& log) {
  scene scene = load_scene(given.name);
  if (!given.environment.empty()) scene.sky = read_environment(given.environment);
  const std::string begin = program + ": warning: ";
  for (const std::string& warning : scene.warnings) log << begin << warning << '\n';
  if (!scene.punctual_lights.empty() && !options.nee)
    log << begin << "point, spot and directional lights are lost with --nee off\n";
  if (is_dark(scene)) log << begin << "the scene has no light: the picture is black\n";
  return scene;
}

bool is_dark(const scene& scene) {
  for (const material& m : scene.materials)
    if (m.emission != vec3(0.0f)) return false;
  return scene.punctual_lights.empty() && scene.sky.texels.empty() && scene.environment == vec3(0.0f);
}

}  // namespace render
