// The interface between path_guider and a guide. A guide samples directions, and learns from the paths that
// follow them. kept_guide and transient_guide in guides/octree/ are two; docs/guides.md builds one step by
// step.
//
// A guide is a class `Guide` for an execution policy `Exec`. It derives from guide_base and has
//
//   1. options:     using options_type;  sampling_options, or what derives from it
//   2. a scene:     Guide(const Exec& exec, const Exec& working, triangle_mesh_view mesh,
//                         const options_type& options);
//                   `exec` allocates what the guide keeps. `working` allocates what every sample needs again:
//                   it retains freed memory. Scenes other than a mesh take further constructors.
//   3. a view:      view_type prepare(const sample_context<Exec>& at, const wave<Surfaces, Random>& w,
//                                     const Caster& caster);
//                   what a wave's rays sample from, as is_guide_view_v requires. Valid until the next call.
//   4. learning:    void learn(const sample_context<Exec>& at, path_recorder<Exec>& paths);
//                   reads the paths of a recorded sample (recorded_path), then clears them
//                   void update(const sample_context<Exec>& at);
//                   runs after learn(), and also after samples that are not recorded
//   5. memory:      std::vector<memory_part> memory() const;
//
// guide_base has defaults for parts 4 and 5, for guides that learn nothing, and for some further members.
// path_guider owns the samples, the recorder, the clocks and the checks. sampling/mixture.hpp mixes a guide
// with the BSDF.
//
// Source: the interface is wfpg's own. Cost: no call is virtual. Memory: none.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/exec/policy.hpp>
#include <wfpg/guide/sampling_options.hpp>
#include <wfpg/guide/statistics.hpp>
#include <wfpg/host/bsdf.hpp>
#include <wfpg/host/geometry.hpp>
#include <wfpg/host/ray_caster.hpp>
#include <wfpg/host/wave.hpp>
#include <wfpg/sampling/sampled_direction.hpp>

#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

namespace wfpg {

// In guide/path_recorder.hpp, which guides that read paths include.
template <class Exec>
class path_recorder;
// In host/recorded_runs.hpp, likewise.
struct recorded_runs;

/// The sample that a guide is called in. Valid during the call.
template <class Exec>
struct sample_context {
  /// Policy that runs the guide's loops. Its memory resource retains freed blocks for later samples.
  const Exec& exec;
  /// Number of the sample, counted from 1; 0 before the first. Samples that the guide rests in do not count.
  std::uint32_t number;
  std::uint32_t age;   ///< `number` counted from the last forget_light() on, from 1; at most `number`
  std::uint64_t seed;  ///< random seed that differs between samples
  /// False: rays must sample their BSDFs alone. So in unguided samples, and from guided_depths on.
  bool guided;
  bool recorded;       ///< whether paths of this sample are recorded: only then path_guider calls learn()
  stage_clock& clock;  ///< times stages of the guide's own; prepare, learn and update are timed already
  /// Paths that are guided, where `guided` is true. Rays of others sample their BSDFs.
  const recorded_runs& guided_paths;
  const recorded_runs& guided_next;  ///< what guided_paths is in the next sample, as far as it is known
};

/// What a guide wants recorded of paths. path_guider reads it once, after it has made the guide.
struct recording_needs {
  /// A recorded sample records one path in 2^fraction_shift. 0: all.
  std::uint32_t fraction_shift = 0;
  bool directions = false;  ///< record the arguments of scatter() and escape() too: 8 bytes a vertex more
  /// After warm-up, record one of every `sample_stride` samples, at random; at least 1. Ending an unrecorded
  /// sample costs next to nothing. On a GPU, most of the cost of recording does not depend on the number of
  /// paths.
  std::uint32_t sample_stride = 1;

  /// Samples of the warm-up, counted from the first one or from forget_light(). All of them are recorded.
  static constexpr std::uint32_t warm_up_samples = 32;
};

/// Returned by lights() of guides that do not choose lights. Converts to an empty view of any guide that
/// does, so that a kernel can be written for both.
struct no_light_choices {
  /// Returns a default View, which chooses nothing.
  template <class View>
  operator View() const {
    return {};
  }
};

/// Default members of a guide. A guide derives from it and hides those that it implements.
struct guide_base {
  using options_type = sampling_options;  ///< a guide with options of its own hides this

  /// Whether the guide has nothing to guide with, as over a scene without surface. No sample is guided then.
  bool empty() const { return false; }
  /// What path_guider is to record: every path of every sample, without directions.
  recording_needs recording() const { return {}; }
  /// Whether the guide reads paths. If false, path_guider::recorder() returns a no_path_recorder, at no cost.
  static constexpr bool records_paths = true;
  /// View that chooses lights for next-event estimation. This one leaves the choice to the renderer.
  no_light_choices lights() const { return {}; }
  /// Runs before the waves of each sample.
  template <class Exec>
  void begin_sample(const sample_context<Exec>&) {}
  /// Runs after the waves of a recorded sample. A guide that learns reads the paths here and clears them.
  template <class Exec>
  void learn(const sample_context<Exec>&, path_recorder<Exec>&) {}
  /// Runs at the end of each sample, after learn() where that is called.
  template <class Exec>
  void update(const sample_context<Exec>&) {}
  /// Geometry moved inside the bounds, world space. A guide that keeps what rays saw drops the part in there.
  template <class Exec>
  void invalidate(const Exec&, const bounds3&) {}
  /// Geometry moved anywhere. A guide that keeps what rays saw drops all of it.
  template <class Exec>
  void invalidate_all(const Exec&) {}
  /// Lights moved. A guide that keeps radiance forgets it.
  template <class Exec>
  void forget_light(const Exec&) {}
  /// Adds the guide's numbers to path_guider::statistics(). May wait for the device.
  template <class Exec>
  void report(const Exec&, guider_statistics&) const {}
  /// Parts of the guide's memory, for path_guider::memory(). This base holds none.
  std::vector<memory_part> memory() const { return {}; }

  /// Whether the guide compares guided samples with unguided ones, so that it can rest. It then has
  ///   bool measures() const;                        whether it does under its options
  ///   std::uint32_t rarer() const;                  log2 of the recorded paths of which one is compared
  ///   guiding_gain keep_unguided(const Exec&, const path_recorder<Exec>&, const recorded_runs& compared,
  ///                              std::uint32_t number);  of the unguided sample, from 0
  ///   guiding_gain gain(const Exec&, const path_recorder<Exec>&, const recorded_runs& compared);
  ///   auto resting_lights() const;                  lights() of samples in which nothing is learnt
  /// and a default view_type guides no ray. keep_unguided() runs before learn() after an unguided sample, and
  /// gain() after others that are compared. Of number 1, keep_unguided() returns paths, unguided_mean and
  /// typical_unguided of a gain, and of others no paths. With ranks, both return what all ranks agree on.
  static constexpr bool measures_gain = false;
  /// Runs in place of begin_sample() before a sample that the guide rests in, but for its choices of lights.
  template <class Exec>
  void begin_rest(const sample_context<Exec>&) {}
  /// Runs in place of learn() and update() after a sample that began with begin_rest().
  template <class Exec>
  void end_rest(const sample_context<Exec>&) {}

  /// Whether ranks can share a sample: sampling_options::ranks. The guide then exchanges all that its state
  /// depends on, in the calls that all ranks make. It has
  ///   void agree(const Exec&, agreed_items&) const;   adds what has to be equal on all ranks
  static constexpr bool joins_ranks = false;

  /// Whether the guide samples a whole wave in one call:
  ///   void sample_wave(const sample_context<Exec>&, const wave<Surfaces, Random>&, const Caster&, const
  ///   Sampler&);
  /// The octree's guide needs it for transient fields: these are gone once their rays are sampled.
  static constexpr bool samples_waves = false;
};

namespace detail {

// Stand-ins for the renderer's types, which the traits below ask a guide with. They are never called.
struct trait_bsdf {
  WFPG_HD float eval(vec3, vec3) const { return 0.0f; }
  WFPG_HD float pdf(vec3, vec3) const { return 0.0f; }
  WFPG_HD bsdf_sample sample(vec3, vec2) const { return {}; }
  WFPG_HD bool is_delta() const { return false; }
  WFPG_HD bool transmits() const { return false; }
};
struct trait_surfaces {
  WFPG_HD surface<trait_bsdf> operator()(std::uint32_t) const { return {}; }
};
struct trait_random {
  WFPG_HD vec2 operator()(std::uint32_t, std::uint32_t) const { return vec2(0.0f); }
};
struct trait_caster {
  WFPG_HD ray_hit operator()(const ray&) const { return {}; }
};
using trait_wave = wave<trait_surfaces, trait_random>;

// Each trait is false where an expression does not compile, so that require_guide() can name the part.

// Whether View is trivially copyable and has `sample` and `pdf`: is_guide_view_v.
template <class View, class = void>
struct is_guide_view : std::false_type {};
template <class View>
struct is_guide_view<
    View, std::void_t<decltype(sampled_direction(std::declval<const View&>().sample(
                          std::uint32_t(0), std::declval<const surface<trait_bsdf>&>(), 0.0f, vec2()))),
                      decltype(float(std::declval<const View&>().pdf(
                          std::uint32_t(0), std::declval<const surface<trait_bsdf>&>(), vec3())))>>
    : std::is_trivially_copyable<View> {};

// Part 1 of a guide: options_type derives from sampling_options.
template <class Guide, class Exec, class = void>
struct has_guide_options : std::false_type {};
template <class Guide, class Exec>
struct has_guide_options<Guide, Exec, std::void_t<typename Guide::options_type>>
    : std::is_base_of<sampling_options, typename Guide::options_type> {};

// Part 2: it can be made from a mesh.
template <class Guide, class Exec, class = void>
struct knows_mesh : std::false_type {};
template <class Guide, class Exec>
struct knows_mesh<Guide, Exec, std::void_t<typename Guide::options_type>>
    : std::is_constructible<Guide, const Exec&, const Exec&, triangle_mesh_view,
                            const typename Guide::options_type&> {};

// Part 3: prepare() returns a view for a wave.
template <class Guide, class Exec, class = void>
struct prepares_view : std::false_type {};
template <class Guide, class Exec>
struct prepares_view<
    Guide, Exec,
    std::void_t<typename Guide::view_type, decltype(typename Guide::view_type(std::declval<Guide&>().prepare(
                                               std::declval<const sample_context<Exec>&>(),
                                               std::declval<const trait_wave&>(), trait_caster())))>>
    : is_guide_view<typename Guide::view_type> {};

// Parts 4 and 5: learn(), update() and memory(), with guide_base as a base class.
template <class Guide, class Exec, class = void>
struct learns_paths : std::false_type {};
template <class Guide, class Exec>
struct learns_paths<
    Guide, Exec,
    std::void_t<decltype(std::declval<Guide&>().learn(std::declval<const sample_context<Exec>&>(),
                                                      std::declval<path_recorder<Exec>&>())),
                decltype(std::declval<Guide&>().update(std::declval<const sample_context<Exec>&>())),
                decltype(std::vector<memory_part>(std::declval<const Guide&>().memory()))>>
    : std::is_base_of<guide_base, Guide> {};

/// Fails to compile where Guide lacks a part. The message says which, and with which signature.
template <class Guide, class Exec>
constexpr bool require_guide() {
  static_assert(has_guide_options<Guide, Exec>::value,
                "Guide: needs `using options_type`, which derives from wfpg::sampling_options");
  static_assert(knows_mesh<Guide, Exec>::value,
                "Guide: needs a constructor of (const Exec&, const Exec& working, triangle_mesh_view, const "
                "options_type&)");
  static_assert(prepares_view<Guide, Exec>::value,
                "Guide: needs `using view_type`, which is_guide_view_v asks for, and view_type "
                "prepare(const sample_context<Exec>&, const wave<Surfaces, Random>&, const Caster&)");
  static_assert(learns_paths<Guide, Exec>::value,
                "Guide: needs learn(const sample_context<Exec>&, path_recorder<Exec>&), "
                "update(const sample_context<Exec>&) and memory(), which wfpg::guide_base has");
  return true;
}

}  // namespace detail

// clang-format off
/// True if View samples directions for the rays of a wave. It is trivially copyable: kernels take it by value.
///   sampled_direction sample(std::uint32_t ray, const surface<Bsdf>& s, float u_technique, vec2 u) const;
///   float pdf(std::uint32_t ray, const surface<Bsdf>& s, vec3 direction) const;
/// `u_technique` is in [0,1) and `u` in [0,1)². `pdf` is the density of `sample`, per steradian, of the whole
/// mixture. basic_guide_mixture mixes a distribution of directions with the surface's BSDF. A view that
/// derives from mixture_view implements only `mixture`, which returns such a mixture.
template <class View>
inline constexpr bool is_guide_view_v = detail::is_guide_view<View>::value;
// clang-format on

/// True if path_guider<Exec, Guide> compiles: Guide has all five parts. For tests and SFINAE; path_guider
/// itself names the part that is missing.
template <class Guide, class Exec>
inline constexpr bool is_guide_v =
    detail::has_guide_options<Guide, Exec>::value&& detail::knows_mesh<Guide, Exec>::value&&
        detail::prepares_view<Guide, Exec>::value&& detail::learns_paths<Guide, Exec>::value;

}  // namespace wfpg
