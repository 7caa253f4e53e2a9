// The facade: guides the paths of a wavefront path tracer. A renderer includes this header and one of exec/.
// Directions come from a Guide (guide/guide.hpp); the default is kept_guide. A sample, from the renderer's
// side:
//
//   guider.begin_sample();
//   for (std::uint32_t depth = 0; depth < max_depth; ++depth) {
//     trace(...);              // the renderer's; records vertices in guider.recorder()
//     guider.sample_directions(wfpg::wave{depth, n, surfaces, random}, caster, directions);
//     shade(...);              // the renderer's; records radiance
//   }
//   guider.end_sample();
//
// A policy is one of exec::cuda, tbb, omp and seq; arrays of the renderer lie in memory that it can reach. A
// guider is made so, for a picture that is rendered as one wave:
//
//   wfpg::kept_guide_options options;
//   options.max_paths = pixels;
//   wfpg::path_guider<Exec> guider(exec, mesh, options);
//
// Source: Yalçıner & Akyüz, "Path Guiding for Wavefront Path Tracing", 2024, Algorithm 1.
// Cost: the guide's, and on the device one kernel a wave that samples directions, unless the guide does.
// Memory: the guide's, the recorder's (path_recorder.hpp), and scratch memory that samples use again.
#pragma once

#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/policy.hpp>
#include <wfpg/exec/support/rank_counters.hpp>
#include <wfpg/guide/guide.hpp>
#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guide/rank_agreement.hpp>
#include <wfpg/guide/recorded_surfaces.hpp>
#include <wfpg/guide/rest_schedule.hpp>
#include <wfpg/guide/sample_rays.hpp>
#include <wfpg/guide/statistics.hpp>
#include <wfpg/guides/octree/kept_guide.hpp>
#include <wfpg/host/ray_caster.hpp>
#include <wfpg/host/wave.hpp>
#include <wfpg/version.hpp>

#include <memory>
#include <utility>
#include <vector>

namespace wfpg {

/// Guides the paths of a wavefront path tracer over one scene. `Exec` is an execution policy: where loops run
/// and memory lies. Movable, not copyable. One thread at a time may call it. An exception leaves it usable.
/// Once a sample had the largest waves, samples allocate nothing more from the policy.
///
/// In each sample call begin_sample(), then sample_directions() or prepare() for each wave, then
/// end_sample(). Call invalidate(), invalidate_all() and forget_light() between samples. Reruns with the same
/// policy, options and waves sample the same directions.
///
/// `Guide` has the five parts that guide/guide.hpp lists. Where one is missing, the compiler's message says
/// which.
template <class Exec, class Guide = kept_guide<Exec>>
class path_guider {
 public:
  static_assert(exec::detail::require_policy<Exec>());
  static_assert(detail::require_guide<Guide, Exec>());

  /// The guide's options, derived from sampling_options: kept_guide_options by default.
  using options_type = typename Guide::options_type;
  /// What kernels sample from, trivially copyable: guide_view for the octree's guides.
  using view_type = typename Guide::view_type;

  /// Makes a guider over triangles, world space. `mesh` refers to the policy's memory, and only the
  /// constructor reads it. The policy's memory resource must outlive the guider. Throws std::invalid_argument
  /// for options out of range, and out_of_memory. With options.ranks all ranks make one, and it throws
  /// rank_error where their scenes, options or parts of the paths do not fit together.
  path_guider(const Exec& exec, triangle_mesh_view mesh, const options_type& options = {})
      : path_guider(in_scene{}, exec, mesh, options) {}

  /// Makes a guider over another scene that the guide's constructor takes. The octree's guides take
  /// voxel_fragments<Exec>: those of geometry that is not triangles, or of hit points
  /// (fragments_from_hits). irradiance_records takes a lit_scene. Throws as the constructor over
  /// triangles.
  template <class Scene, class = std::enable_if_t<std::is_constructible_v<Guide, const Exec&, const Exec&,
                                                                          Scene, const options_type&>>>
  path_guider(const Exec& exec, Scene&& scene, const options_type& options = {})
      : path_guider(in_scene{}, exec, std::forward<Scene>(scene), options) {}

  /// Move constructor. The moved-from guider may only be assigned to or destroyed.
  path_guider(path_guider&& other) = default;
  /// Move assignment. Frees all memory that this guider held; `other` may then only be assigned to or
  /// destroyed.
  path_guider& operator=(path_guider&& other);

  /// Begins a sample of one or more waves. Clears recorded paths that end_sample() has not learnt from. If it
  /// throws, call it again: it begins the sample of that number.
  void begin_sample();

  /// Samples the next directions of a wave's rays: makes or refreshes fields, then writes directions[ray].
  ///
  /// `w` has the rays' surfaces and random numbers, and their depth, which statistics count by. `directions`
  /// must have an element for each ray; inactive rays get the technique `none` and the density 0.
  /// `caster` is the renderer's ray caster, inline or batch (ray_caster.hpp). `queries` asks for the density
  /// of one further direction a ray, as next-event estimation needs it for MIS. Throws std::invalid_argument
  /// where the wave exceeds max_rays or an output is smaller than the wave, and what the caster throws. Rays
  /// of unguided samples, and from guided_depths on, sample their BSDFs.
  template <class Surfaces, class Random, class Caster, class Queries = no_queries>
  void sample_directions(const wave<Surfaces, Random>& w, const Caster& caster,
                         array_view<sampled_direction> directions, const Queries& queries = {});

  /// First half of sample_directions(): makes or refreshes the wave's fields and returns a view of them. The
  /// renderer's own kernels sample from it, with the ray's index in the wave. It is valid until the next call
  /// of the guider. `w.random` is not read. Kept fields cost no more memory so. Transient fields all stay in
  /// memory: 4 (F² + F) bytes a bin of the wave with most bins, and half more. The call then waits for the
  /// number of bins. Throws as sample_directions() does.
  template <class Surfaces, class Random, class Caster>
  view_type prepare(const wave<Surfaces, Random>& w, const Caster& caster);

  /// Prepares the wave of the vertices that the recorder heard of at `depth`: those that were told with
  /// normal and transmits. The host gives no surfaces, and the view takes the index of a path for that of a
  /// ray. These vertices are then forgotten, so that a later pass of the sample may have a wave of the same
  /// depth. Throws std::invalid_argument where sampling_options::records_waves is not set, and as the other
  /// prepare(). A guide that evaluates BSDFs to prepare, such as the SARSA grid's, does not compile.
  ///
  /// Tell the recorder of a hit in the kernel that finds it. Paths that were not told of at this depth are
  /// not guided. Cost: that of the other prepare(), and 8 bytes a path: the wave is read, and then forgotten.
  template <class Caster>
  view_type prepare(std::uint32_t depth, const Caster& caster);

  /// Ends the sample: the guide learns from the recorded paths, if this sample is recorded, and updates
  /// itself. What it learns changes directions from the next sample on, or later: a guide may wait for the
  /// end of a step of several samples.
  void end_sample();

  /// Geometry moved inside `bounds`, world space, which hold its old and its new place. Kept fields that may
  /// see it are cast anew when they are next used. The octree and its cache keep the old geometry; make a new
  /// guider to change them.
  /// A guide that rests wakes up.
  void invalidate(const bounds3& bounds) {
    guide_.invalidate(exec_, bounds);
    compare_anew();
  }
  /// Geometry moved anywhere: every kept field is cast anew when it is next used. A guide that rests wakes
  /// up.
  void invalidate_all() {
    guide_.invalidate_all(exec_);
    compare_anew();
  }
  /// Lights moved: the guide forgets all radiance that it learnt. Kept fields take up the change without
  /// being cast anew. As at the beginning, the next unguided_samples are not guided, and the next 32 samples
  /// are all recorded. A guide that rests wakes up. A host that calls it after each sample guides none, since
  /// nothing is known.
  void forget_light() {
    guide_.forget_light(exec_);
    warm_up_end_ = samples_ - rests_.rested() + recording_needs::warm_up_samples;
    compare_anew();
  }
  /// The camera moved, or samples differ from those before for another reason. A guide that rests wakes up,
  /// and is compared anew. Another one guides all paths from then on, and is not compared again. O(1).
  void compare_anew() {
    rests_.restart(samples_);
    gain_ = {};
  }

  /// Returns the view with which the renderer's kernels record their paths. It is valid for the current
  /// sample. A path_recorder_view, or a no_path_recorder for a guide that reads no paths.
  auto recorder() const {
    if constexpr (Guide::records_paths)
      return recorder_.view();
    else
      return no_path_recorder{};
  }
  /// Returns the view that chooses lights for next-event estimation, valid for the current sample. A
  /// light_guide_view, or no_light_choices for a guide that does not choose lights. Choices are by weight
  /// alone where they rest with the guide, since they gain little: rest_constants::light_gain.
  auto lights() const {
    if constexpr (Guide::measures_gain)
      return lights_rest_now_ ? guide_.resting_lights() : guide_.lights();
    else
      return guide_.lights();
  }

  /// The guide, to look at what it learnt.
  const Guide& guide() const { return guide_; }
  /// The options that the constructor got. An unset max_rays is replaced by max_paths.
  const options_type& options() const { return options_; }
  /// Whether the current sample is guided: unguided_samples are over, the guide is not empty, and it does not
  /// rest.
  bool guided() const { return is_guided(samples_); }
  /// Whether the guide rests in the current sample, since guiding gained too little, or noise was little.
  bool resting() const { return rests_now_; }
  /// Whether the guide probes in the current sample, since it is not known whether guiding pays. Then few
  /// paths are recorded and guided: those that are compared.
  bool probing() const { return probes_now_; }
  /// The paths that the guide takes part in, in the current sample: all, or a few while it probes or rests.
  /// Others are not recorded, nor guided where surfaces tell their paths. A renderer may leave them out of
  /// its waves, and sample their BSDFs itself. Their lights are chosen and deposited as ever. max_paths
  /// counts them, too. Where the guide rests, all may be left out: see resting().
  recorded_runs guided_paths() const { return probes_now_ || rests_now_ ? compared_ : all_paths; }
  /// Weight that the current sample should have in the picture, from 1 to rest_constants::largest_weight.
  /// Guided samples have less variance than others, by the gain of the comparisons before. The best weights
  /// are inverse to the variance. 1 for samples that are not guided, or that probe.
  ///
  /// A weight depends on earlier samples, not on its own. So the weighted mean has a bias, which falls with
  /// the number of compared paths, and with the number of samples. Pictures without weights have none, and
  /// more noise.
  float sample_weight() const { return guided() && !probes_now_ ? weight_ : 1.0f; }

  /// Returns counts and times since construction; see statistics.hpp. Waits for the work before it, so that
  /// calling it for each sample slows a device down. `dropped_vertices` and `deposits` tell of calls out of
  /// range: look at them when guiding does not help.
  WFPG_COLD guider_statistics statistics() const;
  /// Returns the bytes of each part that it holds in the policy's memory. Does not wait.
  WFPG_COLD memory_report memory() const;

 private:
  friend struct detail::state_access;
  // A part of the paths that is the whole.
  static constexpr recorded_runs all_paths{};
  // Tells the private constructor from the public ones, which take any scene.
  struct in_scene {};

  // Members are made in their order below: the guide needs the policy that allocates from working memory, and
  // the recorder needs to know what the guide wants recorded.
  template <class Scene>
  path_guider(in_scene, const Exec& exec, Scene&& scene, const options_type& options)
      : options_(completed(options)),
        working_memory_(std::make_unique<retaining_resource>(exec.resource())),
        exec_(exec.with_resource(working_memory_.get())),
        guide_(exec, exec_, std::forward<Scene>(scene), options_),
        needs_(guide_.recording()),
        recorder_(exec_, {Guide::records_paths ? options_.max_paths : 0, options_.max_depth,
                          options_.include_emission, needs_.fraction_shift, needs_.directions,
                          Guide::records_paths && options_.records_waves, options_.silent_escapes,
                          static_cast<std::uint32_t>(options_.first_path)}),
        shared_counters_(exec_, options_.ranks ? recorder_.counters().size() : 0) {
    require(needs_.sample_stride >= 1, "sample_stride", needs_.sample_stride, "at least 1");
    const float least = least_gain<std::decay_t<Scene>>(scene);
    if (options_.ranks) join_ranks(least);
    if constexpr (Guide::measures_gain) {
      if (!guide_.measures()) return;
      rests_ = rest_schedule(least, options_.unguided_samples);
      compared_ = {needs_.fraction_shift, static_cast<std::uint32_t>(seed_of(0)), guide_.rarer(),
                   static_cast<std::uint32_t>(options_.first_path)};
    }
  }

  /// Gain below which guiding does not pay: the option, or what suits policy and scene. A CPU policy's blocks
  /// have one warp.
  template <class Scene>
  float least_gain(const Scene& scene) const {
    if (options_.least_gain) return *options_.least_gain;
    if (Exec::warps_per_block > 1) return rest_constants::gpu_least_gain;
    if constexpr (std::is_same_v<Scene, triangle_mesh_view>)
      return rest_constants::cpu_least_gain(scene.triangles.size());
    else
      return rest_constants::cpu_least_gain(0);
  }

  /// Checks the options that all guides have, and sets max_rays. The guide checks its own. Runs before any
  /// memory is allocated.
  static options_type completed(options_type options) {
    detail::require_valid(static_cast<const sampling_options&>(options));
    require(!options.ranks || Guide::joins_ranks, "ranks", "set", "null: ranks cannot share this guide");
    if (!options.max_rays) options.max_rays = options.max_paths;
    require(!options.ranks || *options.max_rays <= options.max_paths, "max_rays", *options.max_rays,
            "at most max_paths where ranks share a sample");
    return options;
  }
  /// Checks that all ranks learn the same guide, and rest below the same gain.
  WFPG_COLD void join_ranks(float least_gain);
  /// Fails to compile where the renderer's types lack what they need; throws where the wave is too large.
  template <class Surfaces, class Random, class Caster>
  void check(const wave<Surfaces, Random>& w, const Caster& caster) const;
  /// Random seed of a sample; all that the guider draws for the sample follows from it.
  std::uint64_t seed_of(std::uint32_t sample) const { return hash(options_.seed, sample); }
  /// Whether the guide takes part in a sample, counted from 1.
  bool is_guided(std::uint32_t sample) const {
    return age_of(sample) > options_.unguided_samples && !guide_.empty() && !rests_now_ &&
           !rests_.is_unguided(sample);
  }
  /// Number of a sample among those that the guide takes part in. Where it rests, that of the one before.
  std::uint32_t number_of(std::uint32_t sample) const { return sample - rests_.rested(); }
  /// number_of() a sample, counted from the last forget_light() on.
  std::uint32_t age_of(std::uint32_t sample) const {
    return number_of(sample) + recording_needs::warm_up_samples - warm_up_end_;
  }
  /// All samples of the warm-up, then one of every `sample_stride`, at random. A fixed one could fall in step
  /// with a period of the renderer's, such as that of its tiles. `sample`: its number_of().
  bool is_recorded(std::uint32_t sample) const {
    const std::uint32_t stride = needs_.sample_stride, round = (sample - 1) / stride;
    return sample <= warm_up_end_ || (sample - 1) % stride == hash(~options_.seed, round) % stride;
  }
  /// Context of a sample, for the guide's calls. It refers to members of this guider.
  sample_context<Exec> at(std::uint32_t sample) {
    // A sample that rests, and has not begun, is not counted yet.
    const std::uint32_t uncounted = rests_now_ && sample > samples_ ? 1 : 0;
    return {exec_,
            number_of(sample) - uncounted,
            age_of(sample) - uncounted,
            seed_of(sample),
            is_guided(sample),
            recorded_,
            clock_,
            guided_paths(sample),
            guided_paths(sample + 1)};
  }
  /// Paths that a sample guides, if it guides any.
  const recorded_runs& guided_paths(std::uint32_t sample) const {
    return rests_.guides_few(sample) ? compared_ : all_paths;
  }
  /// Keeps the recorded paths of an unguided sample, or compares those of a guided one with them.
  void measure();
  /// Context of the current sample.
  sample_context<Exec> now() { return at(samples_); }
  /// Context of a wave of the current sample: it is not guided from guided_depths on.
  sample_context<Exec> now(std::uint32_t depth) {
    sample_context<Exec> result = now();
    result.guided = result.guided && depth < options_.guided_depths;
    return result;
  }

  options_type options_;  // with max_rays set
  stage_clock clock_;     // statistics() reports its times
  // Retains freed memory, so that samples do not allocate. Declared before those whose buffers it holds,
  // which it must outlive. On the heap, since they refer to it when the guider has moved.
  std::unique_ptr<retaining_resource> working_memory_;
  Exec exec_;                     // the caller's policy, but it allocates from working_memory_
  Guide guide_;                   // keeps its learnt state in the caller's policy
  recording_needs needs_;         // of the guide, asked once
  path_recorder<Exec> recorder_;  // of no paths where the guide reads none
  detail::rank_counters<Exec, std::uint32_t> shared_counters_;  // of the recorder, with ranks
  // A guide file holds the first three. begin_sample() sets those of the current sample, and end_sample()
  // measured_ and gain_.
  rest_schedule rests_;
  std::uint32_t samples_ = 0;                                     // number of the current sample
  std::uint32_t warm_up_end_ = recording_needs::warm_up_samples;  // the last sample of the warm-up
  bool recorded_ = true;                                          // the current sample
  bool rests_now_ = false;                                        // the current sample
  bool lights_rest_now_ = false;                                  // the current sample
  bool probes_now_ = false;                                       // the current sample
  float weight_ = 1.0f;                                           // the current sample, if it is guided
  bool measured_ = false;                                         // the current sample, in end_sample()
  guiding_gain gain_;                                             // mean of those that were measured
  recorded_runs compared_;                                        // paths that are compared
};

}  // namespace wfpg

#include <wfpg/detail/path_guider_impl.hpp>
