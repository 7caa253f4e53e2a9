// Checks how a host uses its guide, on the host's first samples. It finds what is valid input and yet makes a
// slow or a wrong picture:
//
//   wfpg::testing::host_checker<Exec> checker(exec, max_paths, max_depth);
//   ...                                                             // in kernels, with checker.view():
//   checker.scatter(path, depth, guide, mixture, step);             // beside recorder.scatter()
//   checker.query(path, depth, mixture, direction, bsdf_pdf, pdf);  // a direction of next-event estimation
//   checker.radiance(path, sum);                                    // when the path is over
//   ...
//   checker.end_sample(guider.recorder(), caster);                  // before guider.end_sample()
//   guider.end_sample();
//   ...
//   const wfpg::testing::check_report report = checker.report();    // after about four samples
//   if (!report) std::puts(report.message.c_str());
//
// Set least_gain = 0 meanwhile: a guide that rests leaves nothing to check.
// A default view ignores all calls, so that the calls may stay in a host's kernels.
// It throws out_of_memory, and std::invalid_argument for arguments out of range.
// Source: none; each check is a property that the library relies on.
// Cost: a call of a kernel evaluates the mixture again, and writes 36 bytes. The end of a sample copies all
// to the host, and looks at it in one thread: about 0.1 s for 2^20 vertices. Not for a frame's time.
// Memory: 44 bytes a vertex and 8 a path in the policy's memory, and 44 a recorded vertex. As much and 48
// bytes a path on the host.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guides/octree/guide_view.hpp>
#include <wfpg/sampling/mixture.hpp>
#include <wfpg/testing/check_report.hpp>
#include <wfpg/testing/detail/host_findings.hpp>
#include <wfpg/testing/detail/host_steps.hpp>

#include <cstddef>
#include <cstdint>
#include <string>

namespace wfpg::testing {

/// One step of a host's path: the direction that it took from a vertex, its densities, and its roulette.
struct host_step {
  /// Direction in which the path goes on: world space, unit length.
  vec3 wi{0.0f};
  /// The BSDF's own density of `wi`, of all lobes that are not delta. Of a delta lobe its probability.
  float bsdf_pdf = 0.0f;
  /// Density that the host divided by. Of a delta lobe the probability that it divided by.
  float pdf = 0.0f;
  /// The BSDF's own density at the mirrored outgoing direction, of all lobes that are not delta.
  float mirror_pdf = 0.0f;
  /// |cos| between outgoing direction and shading normal, in [0, 1]. It corrects `mirror_pdf`, which grows
  /// where paths arrive at a grazing angle.
  float cosine = 1.0f;
  /// Luminance of the path's throughput with this vertex's BSDF, before roulette.
  float throughput = 0.0f;
  /// Probability with which roulette by throughput lets the path go on.
  /// 1: there is no roulette here, or guided_survival() decides, which knows more.
  float survival = 1.0f;
  /// A delta lobe drew the direction.
  bool is_delta = false;
  /// The path goes on, and the host traces its next ray.
  bool goes_on = true;
};

/// Options of a host_checker: what the host does, and how strict the checks are.
struct host_check_options {
  /// Paths may end in a medium or below a surface, and nobody tells the recorder. Escapes are then not
  /// checked.
  bool media = false;
  /// Relative difference allowed between two densities, or two sums of radiance, of one thing. In (0, 1).
  float tolerance = 1.0e-3f;
  /// Fraction of vertices, queries or paths that a check may find wrong, in [0, 1).
  /// Edges of a field's cells and cracks between surfaces make a few.
  double exceptions = 0.01;
};

/// Logs what a host's kernels do, for host_checker. Trivially copyable.
/// A default view ignores all calls. So do paths and depths beyond the checker's.
/// Calls for one path come from one thread at a time.
class host_checker_view {
 public:
  /// Logs what the host did at a vertex. Call it beside path_recorder_view::scatter(), for delta lobes and in
  /// unguided samples too.
  ///
  /// `guide`: the view of the wave. `mixture`: what the host drew from; its `number` must be that of the
  /// field. A second call for one path and depth replaces the first. O(1).
  WFPG_HD void scatter(std::size_t path, std::uint32_t depth, const guide_view& guide,
                       const kernel_mixture& mixture, const host_step& step) const {
    if (path >= paths_ || depth >= depths_) return;
    wfpg::detail::logged_step& logged = steps_[depth * paths_ + path];
    logged.direction = step.wi;
    logged.pdf = step.pdf;
    logged.expected = step.is_delta ? mixture.delta_pdf(step.bsdf_pdf) : mixture.pdf(step.wi, step.bsdf_pdf);
    logged.scale = roulette_scale(step.bsdf_pdf, step.pdf);
    logged.throughput = step.throughput;
    logged.survival = step.survival;
    logged.flags =
        wfpg::detail::logged_step::is_logged | (step.goes_on ? wfpg::detail::logged_step::goes_on : 0u) |
        wfpg::detail::guiding_flags(guide.fields().info(mixture.number).is_built(), mixture,
                                    step.mirror_pdf * step.cosine, step.is_delta ? step.bsdf_pdf : 0.0f);
  }
  /// Logs the density that the host used for another direction at the vertex, as for a MIS weight.
  ///
  /// `direction`: world space, unit length. `bsdf_pdf`: the BSDF's own density there. `pdf`: the density that
  /// the host used. Of several calls for one path and depth, the one with the largest difference counts.
  WFPG_HD void query(std::size_t path, std::uint32_t depth, const kernel_mixture& mixture, vec3 direction,
                     float bsdf_pdf, float pdf) const {
    if (path >= paths_ || depth >= depths_) return;
    wfpg::detail::logged_query& logged = queries_[depth * paths_ + path];
    const wfpg::detail::logged_query asked{pdf, mixture.pdf(direction, bsdf_pdf)};
    if (!logged.is_logged() || wfpg::detail::difference(asked.pdf, asked.expected) >
                                   wfpg::detail::difference(logged.pdf, logged.expected))
      logged = asked;
  }
  /// Logs all that a path has brought to its pixel, before the picture's filter. The last call of a sample
  /// counts, so that a host may call it after each wave.
  ///
  /// Leave out what the recorder does not keep. This is light that the camera sees before the first recorded
  /// vertex. Where sampling_options::include_emission is unset, it is also the first vertex's own emission.
  WFPG_HD void radiance(std::size_t path, path_light sum) const {
    if (path < paths_) lights_[path] = {luminance(sum.rgb), 1u};
  }

 private:
  // The owner of the memory, which sets what follows.
  template <class Exec>
  friend class host_checker;

  std::size_t paths_ = 0;
  std::uint32_t depths_ = 0;
  // Steps and queries of one depth lie side by side.
  wfpg::detail::logged_step* steps_ = nullptr;
  wfpg::detail::logged_query* queries_ = nullptr;
  wfpg::detail::logged_light* lights_ = nullptr;
};

/// Checks how a host uses its guide. Each of these has a line of the report, or several:
///
///   roulette     where the guide chose a path's directions, roulette ends it no sooner. Vertices are
///                compared with others of their depth and of their throughput without a guide
///   narrow       a BSDF with a narrow lobe, or with a delta lobe of a quarter of its samples or more, does
///                not get the guide's full fraction
///   escapes      where the next ray of a path misses, the recorder knows that the path escaped. With
///                sampling_options::silent_escapes, scatter() is told of no direction of a path that ended
///   radiance     a path's recorded contributions add up to what it brought to its pixel
///   directions   scatter(), `outgoing` of vertex() and host_step::wi are the directions between vertices
///   densities    the host's densities, of directions and of queries, are those of the mixture
///
/// Escapes, radiance and directions are compared for recorded paths alone. Escapes and directions need a
/// guide that learns from them, as the octree's do.
/// Roulette needs 100 vertices of each kind, and others at least 8 that are wrong: give it a few samples.
/// A lobe is narrow where it should leave the guide less than 2/3 of its fraction: GGX roughness below 0.37.
/// A host that leaves the guide anything less than the full fraction is believed, since it may know more.
///
/// Movable, not copyable. The policy's memory must outlive it.
template <class Exec>
class host_checker {
 public:
  /// A checker for a host of at most `max_paths` paths in a sample, in [1, 2^32 - 1).
  /// `max_depth`: number of the host's waves in a sample, in [1, 1024]. The last one's directions are not
  /// traced.
  /// Throws std::invalid_argument and out_of_memory.
  host_checker(const Exec& exec, std::size_t max_paths, std::uint32_t max_depth,
               const host_check_options& options = {});

  /// View for kernels. Valid as long as this checker.
  host_checker_view view() const { return view_; }

  /// Compares what the sample logged with what the recorder has, and clears the log.
  /// Call it before path_guider::end_sample(), which clears the recorder. Waits for the work before it.
  /// `recorder`: path_guider::recorder() of this sample. `caster`: the host's, inline or batch.
  /// Throws std::invalid_argument where the recorder has room for more paths than this checker.
  template <class Caster>
  void end_sample(const path_recorder_view& recorder, const Caster& caster);
  /// Forgets what the sample logged so far. For hosts that throw a sample away and begin it again.
  void clear();

  /// Returns a sentence for each check that failed in the samples so far, one a line.
  check_report report() const { return {findings_.report()}; }
  /// Returns a sentence where guiding does not pay, which is no fault; else nothing.
  ///
  /// It compares variances of pixels, of values c / (1 + c), between guided and unguided samples. A path's
  /// index is that of its pixel, and radiance() is called for it. Two samples of each kind are needed, so set
  /// sampling_options::unguided_samples to 2 or more. It speaks from one standard error on: a few dozen
  /// samples make that small. Time does not count.
  std::string note() const { return findings_.note(); }

 private:
  Exec exec_;
  buffer<wfpg::detail::logged_step, Exec> steps_;
  buffer<wfpg::detail::logged_query, Exec> queries_;
  buffer<wfpg::detail::logged_light, Exec> lights_;
  host_checker_view view_;
  wfpg::detail::host_findings findings_;
};

}  // namespace wfpg::testing

#include <wfpg/testing/detail/check_host_impl.hpp>
