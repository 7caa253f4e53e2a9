// render_on for any policy: builds what a rendering needs, takes samples until the budget is spent, reports.
#pragma once

#include "app/guider_report.hpp"
#include "app/ranks.hpp"
#include "app/render.hpp"
#include "app/render_state.hpp"
#include "app/sample_budget.hpp"
#include "app/saved_guider.hpp"
#include "casters/octree_cones.hpp"
#include "tracer/bidirectional.hpp"
#include "tracer/collecting_guider.hpp"
#include "tracer/records_scene.hpp"
#include "tracer/unguided.hpp"
#include "tracer/volume_tracer.hpp"
#include "tracer/wavefront.hpp"

#include <wfpg/guides/octree/transient_guide.hpp>
#include <wfpg/guides/records/irradiance_records.hpp>
#include <wfpg/guides/sarsa/sarsa_grid.hpp>
#include <wfpg/octree/fragments_from_caster.hpp>
#include <wfpg/path_guider.hpp>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace render {

/// Whether a wave of the samples [before, after) ends with a checkpoint. A wave may pass a power of two.
inline bool is_kept(checkpoint_times times, int before, int after, bool is_last) {
  const bool has_power_of_two = (before ^ after) > before;  // the highest bit has changed
  return times == checkpoint_times::all ||
         (times == checkpoint_times::powers_of_two && (has_power_of_two || is_last));
}

/// The sample before which a rendering ends by its number of samples.
inline std::uint32_t end_of_samples(const render_options& options) {
  return options.seconds > 0.0 ? 0xffffffffu : static_cast<std::uint32_t>(options.spp);
}

/// The samples of one rendering, from those that the report has on, whatever their directions come from.
/// Those of a wave have one weight.
template <class Tracer, class Guider>
void take_samples(Tracer& tracer, Guider& guider, const pinhole& camera, const render_options& options,
                  const progress_callback& progress, render_result& result) {
  sample_budget budget(options, result.report.spp);
  const std::uint32_t wave_samples = samples_of_wave(options), end = end_of_samples(options);
  for (bool is_last = agree(options.ranks, {budget.is_spent(), false}).is_spent; !is_last;) {
    const auto sample = static_cast<std::uint32_t>(budget.samples());
    const float weight = wfpg::sample_weight(combination_of(options), sample / wave_samples + 1);
    tracer.render_sample(guider, camera, sample, weight);
    budget.count(static_cast<int>(std::min(wave_samples, end - sample)));
    const bool is_spent = budget.is_spent();
    const wave_end ends =
        agree(options.ranks, {is_spent, !is_spent && options.is_stopped && options.is_stopped()});
    result.is_stopped = ends.is_stopped && !ends.is_spent;
    is_last = ends.is_spent || ends.is_stopped;
    if (is_kept(options.checkpoints, static_cast<int>(sample), budget.samples(), is_last)) {
      const double seconds = budget.seconds();
      const stopwatch keeping;
      result.checkpoints.push_back(
          {budget.samples(), seconds, {options.width, options.height, tracer.film().picture()}});
      budget.leave_out(keeping.seconds());
    }
    if (progress) progress(budget.progress());
  }
  result.report.spp = budget.samples();
}

/// Of a path's depths those that are guided. The last direction, where it is not the first, finds emitters
/// alone: where next-event estimation finds them too, it is left to the BSDF.
inline std::uint32_t guided_depths(const render_options& options) {
  const auto all_but_last = static_cast<std::uint32_t>(std::max(options.max_depth - 2, 1));
  return options.nee ? std::min(options.guided_depths, all_but_last) : options.guided_depths;
}

/// What every tracer is told.
inline tracer_settings tracer_settings_of(const render_options& options) {
  tracer_settings settings;
  settings.width = options.width;
  settings.height = options.height;
  settings.max_depth = static_cast<std::uint32_t>(options.max_depth);
  settings.seed = options.seed;
  settings.roulette_depth = static_cast<std::uint32_t>(options.roulette_depth);
  settings.techniques = techniques_of(options);
  settings.light = options.light;
  settings.technique_pictures = options.technique_pictures;
  settings.weighs_by_gain = combination_of(options) == wfpg::sample_combination::inverse_variance;
  settings.share = share_of(options);
  settings.end = end_of_samples(options);
  settings.ranks = options.policy_ranks;
  return settings;
}

/// What every guide is told.
inline wfpg::sampling_options sampling_options_of(const render_options& options) {
  wfpg::sampling_options guided;
  guided.guide_fraction = options.guide_fraction;
  guided.guided_depths = guided_depths(options);
  guided.unguided_samples = wfpg::unguided_samples(combination_of(options));
  guided.seed = options.seed;
  const wave_share share = share_of(options);
  guided.max_paths = share.count;
  guided.ranks = options.policy_ranks;
  guided.first_path = share.first;
  guided.all_paths = share.all_paths();
  guided.max_depth = static_cast<std::uint32_t>(options.max_depth);
  return guided;
}

inline wfpg::sarsa_grid_options sarsa_options_of(const render_options& options) {
  wfpg::sarsa_grid_options guided = options.sarsa;
  static_cast<wfpg::sampling_options&>(guided) = sampling_options_of(options);
  return guided;
}

inline wfpg::irradiance_records_options records_options_of(const scene& host, const render_options& options) {
  wfpg::irradiance_records_options guided = options.records;
  static_cast<wfpg::sampling_options&>(guided) = sampling_options_of(options);
  // Next-event estimation finds emitters, if not behind smooth surfaces.
  guided.include_emission = !options.nee || has_smooth_surfaces(host);
  return guided;
}

/// What both of the octree's guides are told. `shares`: of the groups of lights that there are to choose
/// from.
inline wfpg::octree_guide_options octree_options_of(const render_options& options,
                                                    const std::vector<float>& shares) {
  wfpg::octree_guide_options guided;
  static_cast<wfpg::sampling_options&>(guided) = sampling_options_of(options);
  guided.octree_resolution = options.octree_resolution;
  guided.caster_buffer_bytes = options.caster_buffer;
  if (options.nee && shares.size() > 1) guided.lights.weights = shares;
  if (options.method == sampling_method::wfpg_product) guided.product_resolution = options.product_resolution;
  guided.binning = options.binning;
  guided.deposits_per_leaf = options.deposits_per_leaf;
  guided.least_gain = options.least_gain;
  guided.mode = options.mode == guiding::plain ? wfpg::guiding_mode::plain : wfpg::guiding_mode::oriented;
  return guided;
}

/// What kept_guide is told.
inline wfpg::kept_guide_options kept_options_of(const render_options& options,
                                                const std::vector<float>& shares) {
  wfpg::kept_guide_options guided;
  static_cast<wfpg::octree_guide_options&>(guided) = octree_options_of(options, shares);
  guided.kept = options.kept;
  // With next-event estimation emission is worth its MIS weight, which fields that learn find out.
  guided.include_emission = !options.nee || options.kept.learn;
  return guided;
}

/// What transient_guide is told.
inline wfpg::transient_guide_options transient_options_of(const render_options& options,
                                                          const std::vector<float>& shares) {
  wfpg::transient_guide_options guided;
  static_cast<wfpg::octree_guide_options&>(guided) = octree_options_of(options, shares);
  guided.field_resolution = options.field_resolution;
  guided.include_emission = !options.nee;
  return guided;
}

/// The state that a rendering goes on from; none where options name no file. Throws std::invalid_argument
/// where it has more samples than it is to have.
inline render_state begin_state(const scene& scene, const render_options& options) {
  if (options.resume.empty()) return {};
  render_state state = read_state(options.resume, scene, options);
  if (options.seconds <= 0.0)
    wfpg::require(state.samples <= options.spp, "spp", options.spp,
                  "no fewer than the rendering to go on with has");
  return state;
}

/// What a method takes its samples with. Everything lives as long as render_by runs.
template <class Exec, class Caster, class Tracer = path_tracer<Exec, Caster>>
struct sampling_job {
  const Exec& exec;
  const scene& host;
  const render_options& options;
  const progress_callback& progress;
  Tracer& tracer;
  const scene_view& geometry;
  const light_distribution<Exec>& lights;
  const pinhole& camera;
  stage_clock& building;  ///< a method adds the time to build its guide
  render_result& result;  ///< a method adds samples, its guide and what it reports

  wfpg::triangle_mesh_view mesh() const { return {geometry.positions, geometry.triangles}; }
};

/// A job's samples with directions from `guider`.
template <class Job, class Guider>
void take_samples(const Job& job, Guider& guider) {
  take_samples(job.tracer, guider, job.camera, job.options, job.progress, job.result);
}

/// Builds what a rendering needs, has its samples taken by a Tracer, and reports. `take` does so with
/// directions from where it likes:
///   void operator()(const sampling_job<Exec, Caster, Tracer<Exec, Caster>>&) const;
template <class Accelerated, template <class, class> class Tracer = path_tracer, class Exec, class Take>
render_result render_by(const Exec& exec, const scene& scene, const render_options& options,
                        const progress_callback& progress, const Take& take) {
  const stopwatch total;
  stage_clock building;
  render_result result;
  render_report& report = result.report;

  const device_scene<Exec> geometry(exec, scene);
  // Groups are for who learns to choose between them.
  const light_distribution<Exec> lights(exec, scene, is_wfpg(options.method) ? options.light_groups : 1);
  std::unique_ptr<const Accelerated> accelerated;
  building.measure(Accelerated::name,
                   [&] { accelerated = std::make_unique<const Accelerated>(exec, scene, geometry.view()); });
  using caster_type = decltype(accelerated->caster());
  Tracer<Exec, caster_type> tracer(exec, tracer_settings_of(options),
                                   {geometry.view(), lights.view(), options.nee}, accelerated->caster());
  const pinhole camera(scene.view, options.width, options.height);
  const render_state before = begin_state(scene, options);
  if (before.samples > 0) tracer.film().restore(before.film);
  report.spp = before.samples;
  result.guide = before.guide;
  const scene_view view = geometry.view();
  take(sampling_job<Exec, caster_type, Tracer<Exec, caster_type>>{exec, scene, options, progress, tracer,
                                                                  view, lights, camera, building, result});
  report.segments = tracer.film().segments();
  const double paths = double(report.spp) * double(options.width) * double(options.height);
  report.light_hits_per_path = static_cast<double>(tracer.film().light_hits()) / paths;
  if (options.keep_state)
    result.state = state_bytes(scene, options, {report.spp, tracer.film().state(), result.guide});
  result.picture = {options.width, options.height, tracer.film().picture()};
  report.seconds.insert(report.seconds.begin(), tracer.seconds().begin(), tracer.seconds().end());
  report.seconds.insert(report.seconds.begin(), building.seconds().begin(), building.seconds().end());
  report.total_seconds = total.seconds();
  return result;
}

template <class Exec, class Caster>
void trace_unguided(const sampling_job<Exec, Caster>& job) {
  unguided<Exec> guider(job.exec);
  take_samples(job, guider);
}

/// The guider of a job before its first sample. Its octree is that of a guide file, or is made of triangles
/// or of what rays find, as the options say.
template <class Exec, class Caster, class Options>
auto begin_guider(const sampling_job<Exec, Caster>& job, const Options& guided) {
  const auto begin = [&](const auto& from) {
    return begin_guider(job.exec, job.host, from, guided, job.options, job.result.guide);
  };
  if (job.options.octree == octree_source::triangles) return begin([&] { return job.mesh(); });
  wfpg::caster_fragments_options cast;
  cast.octree_resolution = guided.octree_resolution;
  cast.seed = job.options.seed;
  return begin(
      [&] { return wfpg::fragments_from_caster(job.exec, job.tracer.caster(), bounds_of(job.host), cast); });
}

/// Guides by an octree of the first sample's hits, which is not guided.
template <class Exec, class Caster, class Options>
void guide_by_samples(const sampling_job<Exec, Caster>& job, const Options& guided) {
  using guider_type = wfpg::path_guider<Exec, wfpg::octree_guide_for<Exec, Options>>;
  collecting_guider<Exec, guider_type> guider(job.exec, tagged(job.host, job.options, guided));
  take_samples(job, guider);
  report_guider(guider.guider(), job.tracer.film().segments(), job.result.report);
  job.result.guide = saved_guide(guider.guider(), job.options);
}

/// Guides by the octree, with kept or transient fields as the type of `guided` says.
template <class Exec, class Caster, class Options>
void guide_by_fields(const sampling_job<Exec, Caster>& job, const Options& guided) {
  const render_options& options = job.options;
  render_report& report = job.result.report;
  if (options.octree == octree_source::samples && options.resume.empty() && options.load_guide.empty())
    return guide_by_samples(job, guided);
  const stopwatch build;
  auto guider = begin_guider(job, guided);
  report.octree.build_seconds = build.seconds();
  job.building.add("octree", report.octree.build_seconds);
  // A guide that is loaded has counted another rendering's, one of a state this one's.
  const wfpg::guider_statistics before =
      options.load_guide.empty() ? wfpg::guider_statistics() : guider.statistics();
  if (options.through == cones::scene) {
    take_samples(job, guider);
  } else {
    octree_cone_guider<Exec, decltype(guider)> with_cones(job.exec, guider, job.geometry.environment,
                                                          options.through);
    take_samples(job, with_cones);
  }
  report_guider(guider, job.tracer.film().segments(), report, before);
  job.result.guide = saved_guide(guider, options);
}

template <class Exec, class Caster>
void guide_by_octree(const sampling_job<Exec, Caster>& job) {
  if (job.options.lifetime == fields::kept)
    guide_by_fields(job, kept_options_of(job.options, job.lights.shares()));
  else
    guide_by_fields(job, transient_options_of(job.options, job.lights.shares()));
}

template <class Exec, class Caster>
void guide_by_sarsa(const sampling_job<Exec, Caster>& job) {
  wfpg::path_guider<Exec, wfpg::sarsa_grid<Exec>> guider(job.exec, job.mesh(), sarsa_options_of(job.options));
  take_samples(job, guider);
  report_any_guider(guider, job.result.report);
}

/// Throws for a method whose kernels trace rays themselves, where the caster is one of batches.
[[noreturn]] inline void refuse_batches(sampling_method method) {
  throw std::runtime_error(std::string("--device optix does not support --method ") +
                           properties_of(method).name + "; --device cuda does");
}

/// Throws std::runtime_error for a caster of batches: records ask the tracer's caster in kernels what is
/// smooth.
template <class Exec, class Caster>
void guide_by_records(const sampling_job<Exec, Caster>& job) {
  if constexpr (wfpg::is_inline_caster_v<Caster>) {
    using smooth = smooth_surfaces<Caster>;
    const wfpg::buffer<wfpg::emitting_triangle, Exec> emitters(job.exec, emitters_of(job.host));
    const wfpg::lit_scene<smooth> lit{job.mesh(), emitters.view(), {job.tracer.caster(), job.geometry}};
    wfpg::path_guider<Exec, wfpg::irradiance_records<Exec, smooth>> guider(
        job.exec, lit, records_options_of(job.host, job.options));
    take_samples(job, guider);
    report_records(guider, job.tracer.film().segments(), job.result.report);
  } else {
    refuse_batches(job.options.method);
  }
}

/// Takes a job's samples by its method. Throws std::invalid_argument for Open PGL's methods, which run on TBB
/// alone.
template <class Exec, class Caster>
void take_by_method(const sampling_job<Exec, Caster>& job) {
  struct method_function {
    sampling_method method;
    void (*take)(const sampling_job<Exec, Caster>&);
  };
  static constexpr method_function functions[] = {
      {sampling_method::pt, trace_unguided<Exec, Caster>},
      {sampling_method::wfpg, guide_by_octree<Exec, Caster>},
      {sampling_method::wfpg_product, guide_by_octree<Exec, Caster>},
      {sampling_method::sarsa, guide_by_sarsa<Exec, Caster>},
      {sampling_method::records, guide_by_records<Exec, Caster>},
  };
  for (const method_function& row : functions)
    if (row.method == job.options.method) return row.take(job);
  throw std::invalid_argument(std::string("method is ") + properties_of(job.options.method).name +
                              ", expected one that runs on any policy");
}

/// What a tracer has beside its film.
template <class Tracer>
void take_more(const Tracer&, const render_options&, render_result&) {}
template <class Exec, class Caster>
void take_more(const bidirectional_tracer<Exec, Caster>& tracer, const render_options& options,
               render_result& result) {
  result.report.light_vertex_bytes = tracer.light_bytes();
  result.report.dropped_light_vertices = tracer.dropped();
  result.report.surplus_beams = tracer.surplus_beams();
  for (technique_picture& found : tracer.technique_pictures())
    result.by_technique.push_back({found.by,
                                   {options.width, options.height, std::move(found.weighted)},
                                   {options.width, options.height, std::move(found.plain)}});
}

/// Renders by a tracer that has no guide. Its kernels trace all rays. Throws std::runtime_error for a caster
/// of batches.
template <class Accelerated, template <class, class> class Tracer, class Exec>
render_result render_without_guide(const Exec& exec, const scene& scene, const render_options& options,
                                   const progress_callback& progress) {
  using caster_type = decltype(std::declval<const Accelerated&>().caster());
  if constexpr (wfpg::is_inline_caster_v<caster_type>)
    return render_by<Accelerated, Tracer>(exec, scene, options, progress, [](const auto& job) {
      no_guide none;
      take_samples(job, none);
      take_more(job.tracer, job.options, job.result);
    });
  else
    refuse_batches(options.method);
}

/// Renders through media, or from both ends. A policy's source may leave it to another, so that both compile
/// at once.
template <class Accelerated, class Exec>
render_result render_in_kernels(const Exec& exec, const scene& scene, const render_options& options,
                                const progress_callback& progress) {
  if (options.method == sampling_method::vpt)
    return render_without_guide<Accelerated, volume_tracer>(exec, scene, options, progress);
  return render_without_guide<Accelerated, bidirectional_tracer>(exec, scene, options, progress);
}

template <class Accelerated, class Exec>
render_result render_on(const Exec& exec, const scene& scene, const render_options& options,
                        const progress_callback& progress) {
  if (options.method == sampling_method::vpt || is_bidirectional(options.method))
    return render_in_kernels<Accelerated>(exec, scene, options, progress);
  return render_by<Accelerated>(exec, scene, options, progress, [](const auto& job) { take_by_method(job); });
}

}  // namespace render
