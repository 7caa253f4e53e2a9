// Takes a rendering's samples, then one of them again with a recorder.
#include "both_ends.hpp"

#include "app/render_impl.hpp"
#include "casters/embree_caster.hpp"

#include <wfpg/base/error.hpp>
#include <wfpg/exec/tbb.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace inspect {
namespace {

using render::technique;
using exec_policy = wfpg::exec::tbb;
using caster_type = decltype(std::declval<const render::embree_scene&>().caster());
using tracer_type = render::observed_bidirectional_tracer<exec_policy, caster_type, merge_recorder>;

constexpr bool merges(technique by) {
  return by == technique::surf || by == technique::pp3d || by == technique::pb2d || by == technique::bb1d;
}

/// Sums samples. Source of the variance: Welford 1962.
class sample_sum {
 public:
  void add(glm::dvec3 value) {
    const double luminance = double(wfpg::luminance(vec3(value)));
    ++found_.samples;
    sum_ += value;
    const double away = luminance - mean_;
    mean_ += away / found_.samples;
    squares_ += away * (luminance - mean_);
    lit_ += luminance > 0.0;
    if (!(luminance > found_.greatest)) return;
    found_.greatest = luminance;
    found_.brightest = found_.samples;
  }
  sample_statistics result() const {
    sample_statistics all = found_;
    if (all.samples == 0) return all;
    all.mean = vec3(sum_ / double(all.samples));
    all.variance = all.samples > 1 ? squares_ / (all.samples - 1) : 0.0;
    all.lit = double(lit_) / all.samples;
    return all;
  }

 private:
  sample_statistics found_;
  glm::dvec3 sum_{0.0};
  double mean_ = 0.0, squares_ = 0.0;
  int lit_ = 0;
};

/// A tracer for take_samples() that sums a pixel after each sample.
class summed_pixel {
 public:
  summed_pixel(tracer_type& tracer, render::technique_set techniques, std::size_t pixel)
      : tracer_(tracer), pixel_(pixel) {
    for (int i = 0; i < render::technique_count; ++i)
      if (techniques.has(technique(i))) by_.push_back({technique(i), {}, {}});
  }

  void render_sample(render::no_guide none, const render::pinhole& camera, std::uint32_t sample,
                     float weight) {
    tracer_.render_sample(none, camera, sample, weight);
    glm::dvec3 all(0.0), merged(0.0);
    for (sums& s : by_) {
      const render::technique_sum found = tracer_.found_by(s.by, pixel_);
      s.weighted.add(found.weighted);
      s.plain.add(found.plain);
      all += glm::dvec3(found.weighted);
      if (merges(s.by)) merged += glm::dvec3(found.weighted);
    }
    all_.add(all);
    merged_.add(merged);
  }
  const render::path_film<exec_policy>& film() const { return tracer_.film(); }

  /// The sample to which merges bring most, else the brightest, else the first. From 1.
  int most_merged() const {
    const int merged = merged_.result().brightest;
    return std::max(merged > 0 ? merged : all_.result().brightest, 1);
  }
  void report(both_ends& found) const {
    found.all = all_.result();
    const double luminance = double(wfpg::luminance(found.all.mean));
    for (const sums& s : by_) {
      technique_findings t;
      t.by = s.by;
      t.weighted = s.weighted.result();
      t.plain = s.plain.result().mean;
      if (luminance > 0.0) t.share = double(wfpg::luminance(t.weighted.mean)) / luminance;
      found.techniques.push_back(t);
    }
  }

 private:
  struct sums {
    technique by;
    sample_sum weighted, plain;
  };

  tracer_type& tracer_;
  std::size_t pixel_;
  std::vector<sums> by_;
  sample_sum all_, merged_;
};

float radius_in(const wfpg::merge_radii& radii, technique by) {
  switch (by) {
    case technique::surf:
      return radii.surface;
    case technique::pp3d:
      return radii.volume;
    case technique::pb2d:
      return radii.beam_points;
    default:
      return radii.beams;
  }
}

int dimension_of(technique by) {
  return by == technique::pp3d ? 3 : by == technique::bb1d ? 1 : 2;
}

/// A scene, and a tracer of it.
struct observed_scene {
  observed_scene(const render::scene& scene, const render::render_options& options, std::size_t pixel)
      : geometry(exec, scene),
        lights(exec, scene, 1),
        accelerated(exec, scene, geometry.view()),
        camera(scene.view, options.width, options.height),
        record{pixel, false, {}},
        tracer(exec, render::tracer_settings_of(options), {geometry.view(), lights.view(), options.nee},
               accelerated.caster(), merge_recorder(record)) {}

  exec_policy exec;
  render::device_scene<exec_policy> geometry;
  render::light_distribution<exec_policy> lights;
  render::embree_scene accelerated;
  render::pinhole camera;
  merge_recorder::record record;
  tracer_type tracer;
};

/// Adds distances and places to a photon that the kernels found near.
found_photon completed(const near_photon& near, tracer_type& tracer, const both_ends& found) {
  found_photon p;
  p.near = near;
  p.radius = found.radius_of(near.where.by);
  const std::uint32_t segments = near.where.segments;
  const path_step& step = found.path.steps[segments - 1];
  if (near.where.by == technique::bb1d) {
    const render::light_beam& light = tracer.photons().beams()[near.where.at.index];
    p.point = step.begin + near.where.at.t_camera * step.direction;
    p.photon = light.beam.origin + near.where.at.t_light * light.beam.direction;
    p.light_segments = light.segments;
    p.flux = light.throughput;
  } else {
    const render::subpath_vertex& light = tracer.photons().vertices()[near.where.at.index];
    p.point =
        near.where.by == technique::pb2d ? step.begin + near.where.at.t_camera * step.direction : step.end;
    p.photon = light.at.position;
    p.light_segments = light.segments;
    p.flux = light.throughput;
  }
  p.distance = glm::length(p.photon - p.point);
  return p;
}

stored_photons stored_in(tracer_type& tracer) {
  stored_photons all;
  const auto stored = tracer.photons().vertices();
  if (stored.paths() > 0) {
    for (std::uint32_t i = 0; i < stored.size(); ++i)
      (stored[i].in_medium() ? all.in_media : all.on_surfaces).push_back(stored[i].at.position);
  }
  const auto beams = tracer.photons().beams();
  if (beams.paths() > 0) {
    for (std::uint32_t i = 0; i < beams.size(); ++i) all.beams.push_back(beams[i].beam);
  }
  return all;
}

void add_radii(const observed_scene& in, const render::technique_set& on, both_ends& found) {
  const auto radii = [&](int sample) {
    return in.tracer.radii_of(in.camera, static_cast<std::uint32_t>(sample - 1));
  };
  for (const technique by : {technique::surf, technique::pp3d, technique::pb2d, technique::bb1d})
    if (on.has(by))
      found.radii.push_back({by, dimension_of(by), radius_in(radii(1), by), radius_in(radii(found.shown), by),
                             radius_in(radii(found.samples), by)});
}

/// Takes the sample that is shown again, with the recorder.
void record_sample(observed_scene& in, both_ends& found) {
  in.record.is_on = true;
  in.tracer.render_sample(render::no_guide(), in.camera, static_cast<std::uint32_t>(found.shown - 1), 0.0f);
  found.path = in.record.path;
  for (technique_findings& t : found.techniques) t.in_sample = in.tracer.found_by(t.by, in.record.pixel);
  for (const near_photon& near : found.path.near) found.photons.push_back(completed(near, in.tracer, found));
  found.stored = stored_in(in.tracer);
  if (found.path.steps.empty() || found.path.steps[0].at == arrival::nothing) return;
  const path_step& first = found.path.steps[0];
  found.pixel_width = glm::length(first.end - first.begin) / std::sqrt(in.camera.pdf(first.direction));
}

}  // namespace

float both_ends::radius_of(technique by) const {
  for (const shrinking_radius& r : radii)
    if (r.by == by) return r.shown;
  return 0.0f;
}

float both_ends::nearest_to(const path_step& step) const {
  float nearest = std::numeric_limits<float>::infinity();
  for (const vec3 p : step.at == arrival::medium ? stored.in_media : stored.on_surfaces)
    nearest = std::min(nearest, glm::length(p - step.end));
  return nearest;
}

both_ends look_at(const render::scene& scene, const render::render_options& given, const pixel_request& asked,
                  const render::progress_callback& progress) {
  render::render_options options = given;
  options.technique_pictures = true;
  const render::technique_set on = render::techniques_of(options);
  observed_scene in(scene, options, asked.pixel);
  render::render_result result;
  summed_pixel pixel(in.tracer, render::pictured(on), asked.pixel);
  render::no_guide none;
  render::take_samples(pixel, none, in.camera, options, progress, result);

  both_ends found;
  found.samples = result.report.spp;
  wfpg::require(asked.sample >= 0 && asked.sample <= found.samples, "sample", asked.sample,
                ("1 to " + std::to_string(found.samples)).c_str());
  found.shown = asked.sample > 0 ? asked.sample : pixel.most_merged();
  found.picture = {options.width, options.height, in.tracer.film().picture()};
  for (render::technique_picture& p : in.tracer.technique_pictures())
    found.by_technique.push_back({p.by,
                                  {options.width, options.height, std::move(p.weighted)},
                                  {options.width, options.height, std::move(p.plain)}});
  found.dropped = in.tracer.dropped();
  pixel.report(found);
  add_radii(in, on, found);
  record_sample(in, found);
  return found;
}

}  // namespace inspect
