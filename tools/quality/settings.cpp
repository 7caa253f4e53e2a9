// The command line and its presets.
#include "settings.hpp"

#include "app/number_options.hpp"
#include "app/render_arguments.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <functional>
#include <map>
#include <ostream>
#include <set>
#include <stdexcept>

namespace quality {
namespace {

namespace fs = std::filesystem;

/// Values of options that are not given.
struct preset {
  std::vector<std::string> scenes, methods;
  std::vector<int> spp;
  int seeds, reference_spp;
  const char* size;  ///< empty: the scene's own
};

const std::vector<std::string> builtin_scenes = {"cornell-enclosed --nee off", "ajar",       "thin-wall",
                                                 "glossy-room --nee off",      "many-lamps", "cornell-box"};

const std::map<std::string, preset> presets = {
    {"quick", {builtin_scenes, {"pt", "wfpg", "wfpg-product"}, {64}, 2, 1024, "104x104"}},
    {"standard",
     {builtin_scenes,
      {"pt", "wfpg", "wfpg-product", "wfpg-transient-oriented", "wfpg-transient-plain"},
      {64, 256},
      3,
      8192,
      ""}},
    {"paper",
     {{"cornell-box", "cornell-enclosed", "ajar"},
      {"pt", "paper", "paper-product", "wfpg"},
      {64},
      3,
      8192,
      ""}}};

/// Yalçıner & Akyüz 2024: octree and bins of table 4, fields of table 1, combination of section 3.7.
const std::string paper_arguments =
    "--guiding plain --fields transient --octree-resolution 128 --min-bin-level 5 --rays-per-bin 512 "
    "--field-resolution 128 --combine pt-first";

const std::vector<method> known_methods = {
    {"wfpg-transient-oriented", "--method wfpg --fields transient --guiding oriented"},
    {"wfpg-transient-plain", "--method wfpg --fields transient --guiding plain"},
    {"paper", "--method wfpg " + paper_arguments},
    {"paper-product", "--method wfpg-product --product-resolution 8 " + paper_arguments}};

/// Larger seeds are those of references.
constexpr int most_seeds = 1000000;

/// The options of the command line.
struct given_arguments {
  std::string preset = "standard";
  std::vector<std::string> scenes, methods, definitions;
  std::vector<int> spp;
  std::vector<double> seconds;
  int seeds = 0, reference_spp = 0, reference_chunk = 256, per_sample = 0;
  float exposure = 0.0f;
  std::string crop, output, cache = "wfpg-quality-cache";
  render::render_options base;
};

void add_measured(CLI::App& app, given_arguments& given) {
  std::vector<std::string> names;
  for (const auto& known : presets) names.push_back(known.first);
  app.add_option(
         "--preset", given.preset,
         "what holds where nothing else is given: quick, minutes on two cores; standard (default); paper, "
         "the paper's parameters")
      ->check(CLI::IsMember(names));
  app.add_option(
      "--scenes", given.scenes,
      "names of built-in scenes (" + render::listed_builtin_scenes() +
          ") and .glb or .gltf files; one with options is quoted: \"ajar --nee off\", which may be --nee, "
          "--size, --max-depth, --roulette-depth and --environment");
  std::string listed = "pt, wfpg, wfpg-product";
  for (const method& known : known_methods) listed += ", " + known.name;
  app.add_option("--methods", given.methods,
                 "names of --method's below, of wfpg-render's --method, or of: " + listed)
      ->delimiter(',');
  app.add_option("--method", given.definitions,
                 "NAME=OPTIONS, measured too: a name for options of wfpg-render's, such as "
                 "small=\"--method wfpg --slot-resolution 16\"; several times. A --seed here is added to "
                 "each rendering's, which are 1, 2, ...: for random numbers of the method's own")
      ->type_name("NAME=OPTIONS")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  app.add_option("--spp", given.spp, "samples a pixel, a list")
      ->delimiter(',')
      ->transform(render::whole_number(1, 1 << 30));
  app.add_option("--seconds", given.seconds, "budgets in seconds, a list; with --spp both")
      ->delimiter(',')
      ->transform(render::positive_number(1.0e9));
  app.add_option("--seeds", given.seeds, "renderings of each, of other random numbers")
      ->transform(render::whole_number(1, most_seeds));
  app.add_option("--per-sample", given.per_sample,
                 "measure each of the first N samples alone too, and each --combine of wfpg-render; N "
                 "pictures in memory")
      ->transform(render::whole_number(2, 1 << 20));
}

void add_references_and_files(CLI::App& app, given_arguments& given) {
  app.add_option("--reference-spp", given.reference_spp,
                 "samples of a reference, half by path tracing and half guided")
      ->transform(render::whole_number(2, 1 << 30));
  app.add_option("--reference-chunk", given.reference_chunk,
                 "samples after which a reference in the making is saved (default: 256)")
      ->transform(render::whole_number(1, 1 << 30));
  app.add_option("--output", given.output, "directory of results.json, results.md, pictures and plots")
      ->transform(render::file_path())
      ->required();
  app.add_option(
         "--cache", given.cache,
         "directory of references and finished runs, which a rerun reads (default: wfpg-quality-cache)")
      ->transform(render::file_path());
  app.add_option("--crop", given.crop,
                 "LEFT,TOP,WIDTHxHEIGHT of crops (default: where pt's error is greatest)");
  app.add_option("--exposure", given.exposure, "multiplies pictures' values (default: from the reference)")
      ->transform(render::positive_number(1.0e30));
}

window parse_window(const std::string& text) {
  window w;
  char end = 0;
  const bool is_window =
      std::sscanf(text.c_str(), "%6d,%6d,%6dx%6d%c", &w.left, &w.top, &w.width, &w.height, &end) == 4 &&
      text.find_first_not_of("0123456789,x") == std::string::npos;
  if (!is_window || w.width == 0 || w.height == 0)
    throw std::invalid_argument("--crop is " + text +
                                ", expected LEFT,TOP,WIDTHxHEIGHT within the picture, such as 16,32,64x64");
  return w;
}

/// Parses a text of options alone, then calls `check`. Errors name the origin of the text.
void parse_part(
    CLI::App& app, const std::string& what, const std::string& text,
    const std::function<void()>& check = [] {}) {
  app.set_help_flag();
  try {
    app.parse(text);
    check();
  } catch (const CLI::ParseError& error) {
    throw std::invalid_argument(what + " \"" + text + "\": " + error.what());
  }
}

scene_choice parse_scene(const std::string& text, const render::render_options& base) {
  scene_choice scene{text, text, "", base};
  if (!fs::is_regular_file(text)) {
    CLI::App app;
    app.add_option("SCENE", scene.source)->required();
    app.add_option("--environment", scene.environment)->transform(render::file_path());
    render::add_nee_option(app, scene.options);
    render::add_picture_options(app, scene.options);
    parse_part(app, "scene", text);
  }
  const std::size_t folders = scene.source.find_last_of('/');
  const std::size_t at = scene.title.find(scene.source);
  if (folders != std::string::npos && at != std::string::npos) scene.title.erase(at, folders + 1);
  return scene;
}

std::vector<scene_choice> parse_scenes(const std::vector<std::string>& texts,
                                       const render::render_options& base) {
  std::vector<scene_choice> scenes;
  std::set<std::string> names;
  for (const std::string& text : texts) {
    scenes.push_back(parse_scene(text, base));
    if (!names.insert(file_name_of(scenes.back().title)).second)
      throw std::invalid_argument("two scenes would be called " + file_name_of(scenes.back().title));
  }
  return scenes;
}

method parse_definition(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string name = text.substr(0, equals);
  const auto is_letter = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string("-_.+").find(c) != std::string::npos;
  };
  if (equals == std::string::npos || name.empty() || !std::all_of(name.begin(), name.end(), is_letter))
    throw std::invalid_argument("--method is " + text +
                                ", expected NAME=OPTIONS with a name of letters, digits and -_.+");
  return {name, text.substr(equals + 1)};
}

method find_method(const std::string& name, const std::vector<method>& defined) {
  for (const std::vector<method>* const list : {&defined, &known_methods})
    for (const method& candidate : *list)
      if (candidate.name == name) return candidate;
  return {name, "--method " + name};
}

/// Named methods first, then those that are defined but not named.
std::vector<method> parse_methods(const std::vector<std::string>& names,
                                  const std::vector<std::string>& texts) {
  std::vector<method> defined, methods;
  const auto add = [&methods](const method& added) {
    for (const method& other : methods)
      if (other.name == added.name) throw std::invalid_argument("two methods are called " + added.name);
    methods.push_back(added);
  };
  for (const std::string& text : texts) defined.push_back(parse_definition(text));
  for (const std::string& name : names) add(find_method(name, defined));
  for (const method& one : defined)
    if (std::find(names.begin(), names.end(), one.name) == names.end()) add(one);
  return methods;
}

std::string quoted(const std::vector<std::string>& arguments) {
  std::string result = "wfpg-quality";
  for (const std::string& a : arguments)
    result += a.find_first_of(" \"'$\\*") == std::string::npos && !a.empty() ? " " + a : " \"" + a + "\"";
  return result;
}

/// Two budgets of one name would write the same files.
void check_budgets(const settings& given) {
  std::set<std::string> names;
  for (const budget& allowed : given.budgets)
    if (!names.insert(title_of(allowed)).second)
      throw std::invalid_argument("two budgets are " + title_of(allowed));
  const int half = given.reference_spp - given.reference_spp / 2;
  if ((half - 1) / given.reference_chunk >= most_seeds)
    throw std::invalid_argument("--reference-chunk: expected at least " +
                                std::to_string((half - 1) / most_seeds + 1) + " for --reference-spp " +
                                std::to_string(given.reference_spp) + ", not " +
                                std::to_string(given.reference_chunk));
}

settings completed(given_arguments given) {
  const preset& defaults = presets.at(given.preset);
  settings result;
  result.preset = given.preset;
  if (given.base.width == 0 && *defaults.size != '\0') {
    CLI::App app;
    render::add_picture_options(app, given.base);
    parse_part(app, "preset", std::string("--size ") + defaults.size);
  }
  result.scenes = parse_scenes(given.scenes.empty() ? defaults.scenes : given.scenes, given.base);
  // Own methods are measured beside path tracing if no others are named.
  const bool is_own = given.methods.empty() && !given.definitions.empty();
  result.methods = parse_methods(is_own                  ? std::vector<std::string>{"pt"}
                                 : given.methods.empty() ? defaults.methods
                                                         : given.methods,
                                 given.definitions);
  if (given.spp.empty() && given.seconds.empty()) given.spp = defaults.spp;
  for (const int spp : given.spp) result.budgets.push_back({spp, 0.0});
  for (const double seconds : given.seconds) result.budgets.push_back({0, seconds});
  result.seeds = given.seeds > 0 ? given.seeds : defaults.seeds;
  result.reference_spp = given.reference_spp > 0 ? given.reference_spp : defaults.reference_spp;
  result.reference_chunk = given.reference_chunk;
  result.per_sample = given.per_sample;
  result.exposure = given.exposure;
  if (!given.crop.empty()) result.crop = parse_window(given.crop);
  result.output = given.output;
  result.cache = given.cache;
  for (const scene_choice& scene : result.scenes)
    for (const method& sampled : result.methods)
      if (options_of(scene, sampled).seed + static_cast<std::uint64_t>(result.seeds) > most_seeds)
        throw std::invalid_argument("method " + sampled.name + ": --seed and --seeds are more than " +
                                    std::to_string(most_seeds) + " together");
  check_budgets(result);
  return result;
}

}  // namespace

std::string title_of(const budget& given) {
  if (given.spp > 0) return std::to_string(given.spp) + (given.spp == 1 ? " sample" : " samples");
  char text[32];
  std::snprintf(text, sizeof text, "%g s", given.seconds);
  return text;
}

std::string file_name_of(const std::string& text) {
  std::string result;
  for (const char c : text) {
    const bool is_plain =
        std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '_' || c == '+';
    if (is_plain) result += c;
    if (!is_plain && !result.empty() && result.back() != '-') result += '-';
  }
  return result;
}

std::optional<settings> parse_settings(const std::vector<std::string>& arguments, std::ostream& out) {
  given_arguments given;
  CLI::App app{"Measures how far methods' pictures are from references, at equal samples or equal time.",
               "wfpg-quality"};
  add_measured(app, given);
  render::add_nee_option(app, given.base);
  render::add_picture_options(app, given.base);
  render::add_device_option(app, given.base);
  add_references_and_files(app, given);
  try {
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::CallForHelp&) {
    out << app.help();
    return std::nullopt;
  }
  settings result = completed(std::move(given));
  result.command = quoted(arguments);
  return result;
}

render::render_options options_of(const scene_choice& scene, const method& sampled) {
  render::render_options options = scene.options;
  CLI::App app;
  render::add_method_options(app, options);
  render::add_guider_options(app, options);
  render::add_nee_option(app, options);
  render::add_device_option(app, options);
  app.add_option("--seed", options.seed)->transform(render::whole_number(0, most_seeds - 1));
  parse_part(app, "method " + sampled.name, sampled.arguments,
             [&] { render::check_render_options(app, options); });
  return options;
}

}  // namespace quality
