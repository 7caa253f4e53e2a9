// State files.
#include "app/render_state.hpp"

#include "app/option_names.hpp"
#include "scene/scene_checksum.hpp"

#include <wfpg/base/math.hpp>
#include <wfpg/ranks/communicator.hpp>
#include <wfpg/state/section_file.hpp>
#include <wfpg/version.hpp>

#include <cstdio>
#include <sstream>
#include <utility>

namespace render {
namespace {

using wfpg::section_reader;
using wfpg::section_writer;

constexpr wfpg::file_kind state_file_kind{{"\x89wfpgR\n\x1a", 8}, 1, "a rendering's state file"};

/// What decides a picture's bits: names as errors say them, and values.
using named_values = std::vector<std::pair<std::string, std::string>>;

std::string hexadecimal(std::uint64_t value) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
  return text;
}

void add_guider_values(const render_options& o, named_values& values) {
  using std::to_string;
  char fraction[32], gain[32];
  std::snprintf(fraction, sizeof fraction, "%.9g", static_cast<double>(o.guide_fraction.value_or(0.0f)));
  std::snprintf(gain, sizeof gain, "%.9g", static_cast<double>(o.least_gain.value_or(-1.0f)));
  values.insert(values.end(), {{"--guiding", o.mode == guiding::plain ? "plain" : "oriented"},
                               {"--fields", o.lifetime == fields::kept ? "kept" : "transient"},
                               {"--cones", name_of(cones_names(), o.through)},
                               {"--octree-resolution", to_string(o.octree_resolution)},
                               {"--rays-per-bin", to_string(o.binning.rays_per_bin)},
                               {"--min-bin-level", to_string(o.binning.min_level)},
                               {"--deposits-per-leaf", to_string(o.deposits_per_leaf.value_or(0))},
                               {"--guide-fraction", fraction},
                               {"--guided-depths", to_string(o.guided_depths)}});
  // Only where it is not the default: state files without it stay valid.
  if (o.octree != octree_source::triangles)
    values.emplace_back("--octree", name_of(octree_names(), o.octree));
  if (o.lifetime == fields::kept)
    values.insert(values.end(), {{"--slot-resolution", to_string(o.kept.resolution)},
                                 {"--recast", to_string(o.kept.recast)},
                                 {"--learn", o.kept.learn ? "on" : "off"},
                                 {"--field-budget", to_string(o.kept.budget_bytes)}});
  else
    values.emplace_back("--field-resolution", to_string(o.field_resolution));
  if (o.method == sampling_method::wfpg_product)
    values.emplace_back("--product-resolution", to_string(o.product_resolution));
  if (o.nee) values.emplace_back("--light-groups", to_string(o.light_groups));
  if (is_wfpg(o.method)) values.emplace_back("--least-gain", gain);
}

named_values values_of(const render_options& o) {
  named_values values = {{"--size", std::to_string(o.width) + "x" + std::to_string(o.height)},
                         {"--max-depth", std::to_string(o.max_depth)},
                         {"--roulette-depth", std::to_string(o.roulette_depth)},
                         {"--seed", std::to_string(o.seed)},
                         {"--nee", o.nee ? "on" : "off"},
                         {"--method", name_of(method_names(), o.method)},
                         {"--combine", name_of(combination_names(), combination_of(o))}};
  if (is_bidirectional(o.method)) {
    const technique_set techniques = techniques_of(o);
    values.emplace_back("--techniques", names_of(techniques));
    values.emplace_back("--light-memory", std::to_string(o.light.budget_bytes));
    if (techniques.has(technique::surf))
      values.emplace_back("--radius", std::to_string(o.light.surface_radius));
    if (techniques.merges()) values.emplace_back("--radius-alpha", std::to_string(o.light.radius_alpha));
    if (techniques.merges_at_points())
      values.emplace_back("--dense-photons", std::to_string(o.light.dense_photons));
    if (techniques.merges_in_media())
      values.emplace_back("--volume-radius", std::to_string(o.light.volume_radius));
    const wfpg::bidirectional_options light = light_options_of(o);
    if (light.beams) values.emplace_back("--beam-paths", std::to_string(light.count_beam_paths()));
    if (light.beam_points && light.count_beam_point_paths() < light.paths)
      values.emplace_back("--beam-point-paths", std::to_string(light.count_beam_point_paths()));
  }
  if (is_guided(o.method)) add_guider_values(o, values);
  return values;
}

section_writer options_to_bytes(const scene& scene, const render_options& options) {
  section_writer bytes;
  bytes.put_text(scene.name);
  bytes.put(checksum_of(scene));
  for (const auto& [option, value] : values_of(options)) {
    bytes.put_text(option);
    bytes.put_text(value);
  }
  return bytes;
}

void check_options(section_reader bytes, const std::string& name, const scene& scene,
                   const render_options& options) {
  const std::string saved_scene = bytes.get_text();
  const auto saved_checksum = bytes.get<std::uint64_t>(), checksum = checksum_of(scene);
  if (saved_checksum != checksum)
    throw wfpg::file_error(name, "was rendered of scene " + saved_scene + " with checksum " +
                                     hexadecimal(saved_checksum) + ", not of " + scene.name + " with " +
                                     hexadecimal(checksum));
  for (const auto& [option, value] : values_of(options)) {
    bytes.require(bytes.get_text() == option, "has other options than this wfpg-render");
    const std::string saved = bytes.get_text();
    if (saved != value)
      throw wfpg::file_error(name, "was rendered with " + option + " " + saved + ", not " + value);
  }
  bytes.end();
}

section_writer film_to_bytes(const render_state& state) {
  section_writer bytes;
  bytes.put(static_cast<std::uint32_t>(state.samples));
  bytes.put(state.film.weight);
  bytes.put(state.film.segments);
  bytes.put(state.film.light_hits);
  for (const glm::dvec3& sum : state.film.sums)
    for (int c = 0; c < 3; ++c) bytes.put(sum[c]);
  return bytes;
}

void restore_film(section_reader bytes, std::size_t pixels, render_state& state) {
  const auto samples = bytes.get<std::uint32_t>();
  bytes.require(samples >= 1 && samples <= 1u << 30, "has a number of samples out of range");
  state.samples = static_cast<int>(samples);
  state.film.weight = bytes.get<double>();
  bytes.require(state.film.weight >= 0.0 && state.film.weight <= 1e30, "has a weight out of range");
  state.film.segments = bytes.get<std::uint64_t>();
  state.film.light_hits = bytes.get<std::uint64_t>();
  const std::vector<double> sums = bytes.get_all<double>(3 * pixels);
  bytes.end();
  state.film.sums.resize(pixels);
  for (std::size_t i = 0; i < pixels; ++i)
    state.film.sums[i] = {sums[3 * i], sums[3 * i + 1], sums[3 * i + 2]};
}

}  // namespace

std::uint64_t checksum_of(const scene& scene, const render_options& o) {
  section_writer bytes = options_to_bytes(scene, o);
  for (const int version : {WFPG_VERSION_MAJOR, WFPG_VERSION_MINOR, WFPG_VERSION_PATCH})
    bytes.put(static_cast<std::uint32_t>(version));
  bytes.put(static_cast<std::uint32_t>(o.spp));
  bytes.put(o.seconds);
  // CPU policies give equal bits. GPUs give others.
  const bool is_gpu = o.where == device::cuda || o.where == device::optix;
  bytes.put(static_cast<std::uint32_t>(is_gpu ? o.where : device::cpu));
  bytes.put(static_cast<std::uint32_t>(o.split.value_or(rank_split::tiles)));
  bytes.put(static_cast<std::uint32_t>(o.samples_a_wave));
  bytes.put(static_cast<std::uint32_t>(o.checkpoints));
  // All ranks take part where a guide or a state is saved.
  bytes.put(static_cast<std::uint32_t>(o.keep_guide) << 1 | static_cast<std::uint32_t>(o.keep_state));
  bytes.put(o.ranks->size());
  return wfpg::checksum(bytes.bytes());
}

std::string state_bytes(const scene& scene, const render_options& options, const render_state& state) {
  std::ostringstream out;
  wfpg::file_writer file(out, state_file_kind, "the state");
  section_writer guide;
  guide.put_text(state.guide);
  file.section("options", options_to_bytes(scene, options));
  file.section("film", film_to_bytes(state));
  file.section("guide", guide);
  file.end();
  return out.str();
}

render_state read_state(std::istream& in, const std::string& name, const scene& scene,
                        const render_options& options) {
  wfpg::file_reader file(in, state_file_kind, name);
  check_options(file.section("options"), name, scene, options);
  render_state state;
  restore_film(file.section("film"), std::size_t(options.width) * std::size_t(options.height), state);
  section_reader guide = file.section("guide");
  state.guide = guide.get_text();
  guide.end();
  file.end();
  return state;
}

render_state read_state(const std::string& path, const scene& scene, const render_options& options) {
  return wfpg::read_file(path, [&](std::istream& in) { return read_state(in, path, scene, options); });
}

}  // namespace render
