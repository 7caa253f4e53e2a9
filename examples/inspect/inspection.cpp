// Learns, measures, and writes the results.
#include "inspection.hpp"

#include "app/option_names.hpp"
#include "app/output_files.hpp"
#include "app/progress_bar.hpp"
#include "both_ends_page.hpp"
#include "numbers.hpp"
#include "octree_pictures.hpp"
#include "octree_vdb.hpp"
#include "page.hpp"

#include <wfpg/base/error.hpp>

#include <algorithm>
#include <cmath>
#include <ostream>
#include <stdexcept>

namespace inspect {
namespace {

void check(const inspection& asked) {
  using wfpg::require;
  const render::render_options& options = asked.learning;
  const std::string& method = render::name_of(render::method_names(), options.method);
  const bool has_fields = render::is_wfpg(options.method);
  require(has_fields || render::is_bidirectional(options.method), "method", method,
          "wfpg or wfpg-product, which have fields to look at, or bpt, vcm, upbp or lt, which have photons");
  if (has_fields) require_fields(options);
  require(options.where == render::device::cpu, "device",
          render::name_of(render::device_names(), options.where), "cpu: paths are looked at in its memory");
  const auto range = [](int side) { return "0 to " + std::to_string(side - 1); };
  require(asked.x >= 0 && asked.x < options.width, "pixel's x", asked.x, range(options.width).c_str());
  require(asked.y >= 0 && asked.y < options.height, "pixel's y", asked.y, range(options.height).c_str());
  require(asked.reference_spp >= 2, "reference_spp", asked.reference_spp, "at least 2");
  require(asked.histogram >= 1, "histogram", asked.histogram, "at least 1");
  require(asked.sample >= 0 && (options.seconds > 0.0 || asked.sample <= options.spp), "sample", asked.sample,
          ("1 to " + std::to_string(options.spp)).c_str());
  if (!asked.vdb.empty()) require_vdb();
}

/// Makes the page's folder, and checks early that files can be written.
void check_files(const inspection& asked) {
  render::prepare_folder("--output", asked.output);
  render::check_outputs({{"--output", (asked.output / "index.html").string(), ""},
                         {"--output", (asked.output / "numbers.json").string(), ""},
                         {"--vdb", asked.vdb, ""}});
}

/// A progress bar for one stage.
class shown_progress {
 public:
  ~shown_progress() { bar_.finish(); }

  render::progress_callback callback() {
    return [this](const render::render_progress& p) { bar_.show(p); };
  }

 private:
  render::progress_bar bar_;
};

double greatest_of(const std::vector<double>& values) {
  return values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
}

/// Adds the picture so far, and the octree at its pixels.
void show_octree(const learnt_scene& learnt, const inspection& asked, const picture_folder& folder,
                 page& shown) {
  const render::image& rendered = learnt.rendering().picture;
  const auto write = [&](const std::string& name, const std::string& caption, const render::image& picture) {
    return folder.write(name, caption, marked(picture, asked.x, asked.y));
  };
  const exitance_pictures exitance = exitance_of(learnt);
  const auto radiance = colour_scale::logarithmic(exitance.greatest, "W/(m² sr), luminance");
  shown.sections.push_back({"The picture",
                            "What the guider learnt from; the frame is around the pixel.",
                            {},
                            {write("picture", "rendered", exposed(rendered, exposure_of(rendered)))}});
  shown.sections.push_back(
      {"Cached exitance",
       "Light that leaves the voxels, as cones read it. Blue: no data.",
       radiance,
       {write("octree-facing", "the sides toward the camera", coloured_exitance(exitance.facing, radiance)),
        write("octree-turned", "the other sides", coloured_exitance(exitance.turned, radiance))}});
  const auto levels =
      colour_scale::whole_numbers(std::max(1, int(learnt.cache().octree().depth())), "level, from the root");
  shown.sections.push_back(
      {"Voxels and bins",
       "Levels are by the scale, 0 the root. Blue, or black among bins: no bin.",
       levels,
       {write("octree-levels", "level of the bins' nodes", level_picture(learnt, levels)),
        write("octree-bins", "bins, each a colour at random", bin_picture(learnt)),
        write("octree-normals", "voxels' normals toward the camera, xyz as red, green, blue",
              normal_picture(learnt))}});
}

/// Two figures for each map of values, all on one scale.
struct map_section {
  const picture_folder& folder;
  section& shown;

  void add(const std::string& name, const std::string& caption, const direction_grid& cells,
           const render::image& values) const {
    const auto figures = folder.write_cells(name, caption, cells, values, *shown.scale);
    shown.figures.insert(shown.figures.end(), figures.begin(), figures.end());
  }
};

section densities(const findings& found, const picture_folder& folder) {
  double greatest = 0.0;
  for (const auto* values : {&found.field, &found.reference, &found.product, &found.ideal, &found.sampler})
    greatest = std::max(greatest, greatest_of(*values));
  section shown{"Densities",
                "Each is a density of directions, on one scale. Squares are the cells of the field's own "
                "frame; beside them is the world, its middle -z, its right +x, its upper edge +y. Grey: not "
                "in the field.",
                colour_scale::logarithmic(greatest, "1/sr"),
                {}};
  const map_section maps{folder, shown};
  const auto add = [&](const std::string& name, const std::string& caption,
                       const std::vector<double>& values) {
    if (!values.empty()) maps.add(name, caption, found.cells, grey_cells(values));
  };
  add("field", "the field", found.field);
  add("reference", "what it should be: light that arrives, with the cosine where the field has it",
      found.reference);
  add("product", "the field times the BSDF", found.product);
  add("ideal", "what samples should be drawn from: light that arrives times the BSDF", found.ideal);
  add("sampler", "what they are drawn from: the pdf of the mixture", found.sampler);
  add("histogram", "samples of the mixture, counted", found.counted.density);
  return shown;
}

section light(const findings& found, const picture_folder& folder) {
  double greatest = 0.0;
  for (const vec3& pixel : found.arriving.pixels)
    greatest = std::max(greatest, double(wfpg::luminance(pixel)));
  section shown{"Light that arrives",
                "Path traced in each direction, in smaller cells than the field's.",
                colour_scale::logarithmic(greatest, "W/(m² sr), luminance"),
                {}};
  map_section{folder, shown}.add("light", "incident radiance", found.fine_cells, found.arriving);
  return shown;
}

section contributions(const findings& found, const picture_folder& folder) {
  section shown{
      "Where noise comes from",
      "What a sample brings that goes there, over the mean of all samples: 1 everywhere would be no "
      "noise; bright cells are fireflies. Without next-event estimation, which takes its share of "
      "light that comes straight from lamps.",
      colour_scale::logarithmic(greatest_of(found.contributions), "times the mean"),
      {}};
  map_section{folder, shown}.add("contribution", "contribution of a sample", found.fine_cells,
                                 grey_cells(found.contributions));
  return shown;
}

void show_directions(const learnt_scene& learnt, const inspection& asked, std::uint32_t pixel, page& shown,
                     json& numbers) {
  finding_options options;
  options.reference_spp = asked.reference_spp;
  options.histogram = asked.histogram;
  options.field_resolution = int(asked.learning.kept.resolution);
  shown_progress progress;
  const findings found = find(learnt, pixel, options, progress.callback());
  const picture_folder folder(asked.output);
  numbers.update(numbers_of(found, {learnt.fields(), pixel, learnt.hits()[pixel].surface}));
  const auto first = shown.sections.begin();
  shown.sections.insert(first,
                        {densities(found, folder), contributions(found, folder), light(found, folder)});
}

/// Why a pixel shows less than most. Empty if it does not.
std::string note_of(const learnt_scene& learnt, std::uint32_t pixel) {
  switch (kind_of(learnt, pixel)) {
    case pixel_kind::nothing:
      return "The pixel hits nothing: there is no field to look at.";
    case pixel_kind::delta:
      return "The pixel hits a smooth mirror or glass, which is sampled by its BSDF alone: no field is used.";
    default:
      return learnt.fields().guides(pixel) ? "" : "The pixel has no field: its BSDF alone draws samples.";
  }
}

void write_numbers(const picture_folder& folder, const json& numbers) {
  render::write_file((folder.path() / "numbers.json").string(), numbers.dump(2) + '\n');
}

page page_of(const render::scene& scene, const inspection& asked) {
  page shown;
  shown.title = scene.name + ", pixel " + std::to_string(asked.x) + ", " + std::to_string(asked.y);
  return shown;
}

std::size_t pixel_of(const inspection& asked) {
  return std::size_t(asked.y) * std::size_t(asked.learning.width) + std::size_t(asked.x);
}

void add_note(const std::string& note, page& shown, std::ostream& log) {
  if (note.empty()) return;
  log << "wfpg-inspect: warning: " << note << '\n';
  shown.notes.push_back(note);
}

void finish(const picture_folder& folder, const json& numbers, page& shown) {
  shown.numbers = rows_of(numbers);
  write_numbers(folder, numbers);
  write_page(folder, shown);
}

void inspect_fields(const render::scene& scene, const inspection& asked, std::ostream& log) {
  log << "wfpg-inspect: learning\n";
  const learnt_scene learnt(scene, asked.learning, shown_progress().callback());
  const auto pixel = static_cast<std::uint32_t>(pixel_of(asked));

  const picture_folder folder(asked.output);
  page shown = page_of(scene, asked);
  json numbers{{"scene", scene.name},
               {"method", render::name_of(render::method_names(), asked.learning.method)},
               {"fields", asked.learning.lifetime == render::fields::kept ? "kept" : "transient"}};
  numbers.update(numbers_of_place(learnt, pixel));
  show_octree(learnt, asked, folder, shown);
  add_note(note_of(learnt, pixel), shown, log);
  if (kind_of(learnt, pixel) == pixel_kind::surface) {
    log << "wfpg-inspect: tracing the reference\n";
    show_directions(learnt, asked, pixel, shown, numbers);
  }
  if (!asked.vdb.empty()) write_vdb(learnt, asked.vdb);
  finish(folder, numbers, shown);
}

void inspect_both_ends(const render::scene& scene, const inspection& asked, std::ostream& log) {
  log << "wfpg-inspect: rendering\n";
  const both_ends found =
      look_at(scene, asked.learning, {pixel_of(asked), asked.sample}, shown_progress().callback());

  const picture_folder folder(asked.output);
  page shown = page_of(scene, asked);
  json numbers{{"scene", scene.name},
               {"method", render::name_of(render::method_names(), asked.learning.method)},
               {"techniques", render::names_of(render::techniques_of(asked.learning))},
               {"pixel", {asked.x, asked.y}}};
  numbers.update(numbers_of_both_ends(found));
  if (found.dropped > 0)
    add_note(std::to_string(found.dropped) +
                 " vertices and beams of light paths had no memory, and their light is missing; raise "
                 "--light-memory.",
             shown, log);
  show_both_ends(found, asked.x, asked.y, scene.view.up, folder, shown);
  finish(folder, numbers, shown);
}

}  // namespace

void run(const render::scene& scene, const inspection& asked_of, std::ostream& log) {
  inspection asked = asked_of;
  asked.learning = render::completed(scene, asked.learning);
  check(asked);
  check_files(asked);
  if (render::is_bidirectional(asked.learning.method))
    inspect_both_ends(scene, asked, log);
  else
    inspect_fields(scene, asked, log);
}

}  // namespace inspect
