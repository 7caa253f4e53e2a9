// Strips of crops and of error maps, with the methods in order from the left. Plots of means over seeds.
#include "scene_files.hpp"

#include "pictures.hpp"

#include <map>

namespace quality {
namespace {

constexpr int gap = 4;  // pixels
constexpr int least_side = 256;
constexpr int first_seed = 1;

/// Sums over seeds of a rendering's values after some samples.
struct sums {
  double error = 0.0, seconds = 0.0;
  int seeds = 0;
};

/// Sums by number of samples, for one method and budget.
std::map<int, sums> sums_of(const std::vector<measured_run>& runs, std::size_t method, std::size_t budget,
                            double render::image_error::*measure) {
  std::map<int, sums> result;
  for (const measured_run& run : runs) {
    if (run.method != method || run.budget != budget) continue;
    for (const error_point& p : run.record.points) {
      sums& at = result[p.samples];
      at.error += p.error.*measure;
      at.seconds += p.seconds;
      ++at.seeds;
    }
  }
  return result;
}

/// The budget of the plots' curves: the one that takes longest.
std::size_t longest_budget(const std::vector<measured_run>& runs) {
  std::size_t longest = 0;
  double seconds = -1.0;
  for (const measured_run& run : runs)
    if (run.record.cost.seconds > seconds) {
      seconds = run.record.cost.seconds;
      longest = run.budget;
    }
  return longest;
}

render::curve curve_of(const std::string& name, const std::vector<double>& errors, double noise,
                       bool is_squared) {
  render::curve curve{name, {}};
  for (std::size_t i = 0; i < errors.size(); ++i)
    curve.points.emplace_back(double(i + 1), without_noise(errors[i], noise, is_squared));
  return curve;
}

}  // namespace

scene_files::scene_files(const settings& given, const scene_choice& scene, const quality::reference& truth)
    : given_(given),
      scene_(scene),
      truth_(truth),
      reference_{path(name("reference.exr")),
                 {path(name("reference-path-tracing.exr")), path(name("reference-guided.exr"))}},
      exposure_(given.exposure > 0.0f ? given.exposure : exposure_for(truth.picture)) {
  render::write_exr(reference_.picture.string(), truth.picture);
  for (std::size_t half = 0; half < 2; ++half)
    render::write_exr(reference_.halves[half].string(), truth.halves[half]);
}

std::string scene_files::name(const std::string& what) const {
  return file_name_of(scene_.title) + "-" + what;
}

std::vector<render::image> scene_files::pictures_of(const std::vector<measured_run>& runs,
                                                    std::size_t budget) const {
  std::vector<render::image> pictures(given_.methods.size());
  for (const measured_run& run : runs)
    if (run.budget == budget && run.seed == first_seed)
      pictures[run.method] = render::read_exr(run.picture.string());
  return pictures;
}

window scene_files::crop_window(const std::vector<measured_run>& runs) const {
  const int width = truth_.picture.width, height = truth_.picture.height;
  if (given_.crop) return *given_.crop;
  const render::image picture = pictures_of(runs, 0)[baseline_of(given_.methods)];
  return worst_window(render::reinhard_errors(picture, truth_.picture), width, height);
}

json scene_files::write(const std::vector<measured_run>& runs,
                        const std::vector<single_samples>& single) const {
  const window crop = crop_window(runs);
  json files{{"reference", name("reference.png")},
             {"crop", {crop.left, crop.top, crop.width, crop.height}},
             {"pictures", json::array()}};
  render::write_png(path(name("reference.png")).string(),
                    enlarged_to(framed(truth_.picture, crop, exposure_), least_side), exposure_);
  for (std::size_t b = 0; b < given_.budgets.size(); ++b)
    files["pictures"].push_back(write_pictures(runs, b, crop));
  files["plots"] = write_plots(runs);
  files["single_samples"] = write_single_samples(single);
  return files;
}

json scene_files::write_pictures(const std::vector<measured_run>& runs, std::size_t budget,
                                 const window& crop) const {
  const std::string begin = file_name_of(title_of(given_.budgets[budget]));
  const std::string crops = name(begin + "-crops.png"), maps = name(begin + "-errors.png");
  const int width = truth_.picture.width, height = truth_.picture.height;
  std::vector<render::image> pictures = pictures_of(runs, budget);
  const double greatest =
      shown_greatest(render::reinhard_errors(pictures[baseline_of(given_.methods)], truth_.picture));
  std::vector<render::image> map_row, crop_row;
  for (const render::image& picture : pictures)
    map_row.push_back(enlarged_to(
        error_map(render::reinhard_errors(picture, truth_.picture), width, height, greatest), least_side));
  const auto crop_of = [&crop](const render::image& picture) {
    return render::cropped(picture, crop.left, crop.top, crop.width, crop.height);
  };
  const float exposure = given_.exposure > 0.0f ? given_.exposure : exposure_for(crop_of(truth_.picture));
  pictures.push_back(truth_.picture);
  for (const render::image& picture : pictures) {
    crop_row.push_back(enlarged_to(crop_of(picture), least_side));
    // Exposure comes first, since the gaps are white already.
    for (render::vec3& pixel : crop_row.back().pixels) pixel *= exposure;
  }
  render::write_png(path(crops).string(), render::side_by_side(crop_row, gap));
  render::write_png(path(maps).string(), render::side_by_side(map_row, gap));
  return {{"crops", crops}, {"errors", maps}};
}

std::string scene_files::write_plot(const std::string& what, const render::plot& drawn) const {
  render::write_svg(path(name(what)).string(), drawn);
  return name(what);
}

json scene_files::write_plots(const std::vector<measured_run>& runs) const {
  const std::size_t budget = longest_budget(runs);
  json files = json::array();
  for (const measure& m : measures) {
    render::plot by_samples{scene_.title, "samples", m.title, {}},
        by_seconds{scene_.title, "seconds", m.title, {}};
    const double noise = truth_.noise.*m.value;
    for (std::size_t i = 0; i < given_.methods.size(); ++i) {
      render::curve over_samples{given_.methods[i].name, {}}, over_seconds = over_samples;
      for (const auto& [samples, sum] : sums_of(runs, i, budget, m.value)) {
        // With a budget in seconds, not all seeds reach the last sample counts.
        if (sum.seeds != given_.seeds) continue;
        const double error = without_noise(sum.error / sum.seeds, noise, m.is_squared);
        over_samples.points.emplace_back(samples, error);
        over_seconds.points.emplace_back(sum.seconds / sum.seeds, error);
      }
      by_samples.curves.push_back(std::move(over_samples));
      by_seconds.curves.push_back(std::move(over_seconds));
    }
    files.push_back(json::array({write_plot(m.name + std::string("-samples.svg"), by_samples),
                                 write_plot(m.name + std::string("-seconds.svg"), by_seconds)}));
  }
  return files;
}

json scene_files::write_single_samples(const std::vector<single_samples>& single) const {
  json files = json::array();
  for (const measure& m : measures) {
    if (single.empty()) break;
    const double noise = truth_.noise.*m.value;
    json row = json::array();
    render::plot alone{scene_.title + ", each sample alone", "sample", m.title, {}};
    for (std::size_t i = 0; i < single.size(); ++i)
      alone.curves.push_back(
          curve_of(given_.methods[i].name, single[i].alone.by_measure.at(m.name), noise, m.is_squared));
    row.push_back(write_plot(std::string(m.name) + "-each-sample.svg", alone));
    for (std::size_t i = 0; i < single.size(); ++i) {
      const std::string& method = given_.methods[i].name;
      render::plot combined{scene_.title + ", " + method + ", combined", "samples", m.title, {}};
      for (const auto& [combination, series] : single[i].combined)
        combined.curves.push_back(curve_of(combination, series.by_measure.at(m.name), noise, m.is_squared));
      if (!combined.curves.empty())
        row.push_back(
            write_plot(std::string(m.name) + "-combined-" + file_name_of(method) + ".svg", combined));
    }
    files.push_back(row);
  }
  return files;
}

}  // namespace quality
