// The renderer guided by Open PGL, and the statistics of its field.
#include "app/render_impl.hpp"
#include "casters/embree_caster.hpp"
#include "tracer/openpgl_guider.hpp"

#include <filesystem>
#include <random>
#include <sstream>
#include <string>

namespace render {
namespace {

/// Bounds of all vertices, slightly enlarged, since rounding moves hits.
pgl_box3f enlarged_bounds(const scene& scene) {
  const wfpg::bounds3 box = bounds_of(scene);
  const vec3 more(1e-3f * glm::length(box.extent()));
  return {to_pgl(box.lower - more), to_pgl(box.upper + more)};
}

openpgl_options openpgl_options_of(const scene& scene, const render_options& options) {
  openpgl_options guided;
  if (options.method == sampling_method::openpgl_dqt)
    guided.directional = PGL_DIRECTIONAL_DISTRIBUTION_QUADTREE;
  guided.samples_per_leaf = options.samples_per_leaf;
  if (options.guide_fraction) guided.guide_fraction = *options.guide_fraction;
  guided.paths = static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height);
  guided.guided_depths = guided_depths(options);
  guided.max_depth = static_cast<std::size_t>(options.max_depth);
  guided.bounds = enlarged_bounds(scene);
  return guided;
}

/// Size of the file that the field writes, since its statistics leave out quadtrees' nodes. 0 if the
/// directory for temporary files has no room.
std::size_t stored_bytes(const openpgl::cpp::Field& field) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path path =
      fs::temp_directory_path(error) / ("wfpg-field-" + std::to_string(std::random_device()()));
  const std::uintmax_t bytes = !error && field.Store(path.string()) ? fs::file_size(path, error) : 0;
  fs::remove(path, error);
  return error ? 0 : static_cast<std::size_t>(bytes);
}

/// The number of leaves, from a table of two lines, one of names. 0 if there is no such column.
std::size_t regions_of(const openpgl::cpp::FieldStatistics& statistics) {
  std::istringstream names(statistics.HeaderCSVString()), values(statistics.ToCSVString());
  std::string name, value;
  while (std::getline(names, name, ',') && std::getline(values, value, ','))
    if (name.find("numCacheRegions") != std::string::npos) return std::stoul(value);
  return 0;
}

void report_openpgl(const openpgl_guider& guider, render_report& report) {
  const std::size_t segments = guider.paths().segment_bytes(), samples = guider.paths().sample_bytes();
  // A field without samples has no statistics.
  if (samples > 0) {
    report.persistent_bytes = stored_bytes(guider.field());
    report.used_bytes = report.persistent_bytes;
    report.regions = regions_of(guider.field().GetSurfaceStatistics());
  }
  report.transient_bytes = segments + samples;
  report.memory = {{"field", report.persistent_bytes}, {"segments", segments}, {"samples", samples}};
  for (const auto& [stage, seconds] : guider.seconds())
    report.seconds.emplace_back("guide " + stage, seconds);
}

}  // namespace

bool has_openpgl() {
  return true;
}

render_result render_with_openpgl(const scene& scene, const render_options& options,
                                  const progress_callback& progress) {
  const wfpg::exec::tbb exec;
  return render_by<embree_scene>(exec, scene, options, progress, [](const auto& job) {
    openpgl_guider guider(job.exec, openpgl_options_of(job.host, job.options));
    take_samples(job, guider);
    report_openpgl(guider, job.result.report);
  });
}

}  // namespace render
