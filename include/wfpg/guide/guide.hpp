// What path_guider needs of a guide: where directions come from, and what learns from the paths that they
// make. octree_guide.hpp is the paper's; docs/guides.md walks through one of one's own.
//
// A guide is a class `Guide` for a policy `Exec` that derives from guide_base and has
//
//   1. options:     using options_type;  sampling_options, or what derives from it
//   2. a scene:     Guide(const Exec& exec, const Exec& working, triangle_mesh_view mesh,
//                         const options_type& options);
//                   `exec` is for what a guide keeps; `working` keeps memory that is given back to it, for
//                   what every sample needs again. Other scenes than a mesh are constructors beside this one.
//   3. a view:      view_type prepare(const guide_sample<Exec>& at, const wave<Surfaces, Random>& w,
//                                     const Caster& caster);
//                   what a wave's rays draw from, with `sample` and `pdf`: is_guide_view_v says how. It holds
//                   until the next call.
//   4. what learns: void learn(const guide_sample<Exec>& at, path_recorder<Exec>& paths);
//                   the paths of a sample that is recorded (recorded_path), which it clears
//                   void update(const guide_sample<Exec>& at);
//                   after that, and also where nothing is recorded
//   5. memory:      std::vector<memory_part> memory() const;
//
// The last two have what they need of a guide that learns nothing from guide_base, and so have the members
// that are there for the octree's sake. Samples, the recorder and its memory, clocks and checks are the
// facade's, mixtures with the BSDF mis.hpp's. No call is virtual.
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

template <class Exec>
class path_recorder;  // guide/path_recorder.hpp

/// The sample that a guide is called in. Valid during the call.
template <class Exec>
struct guide_sample {
  const Exec& exec;      ///< runs its loops; its memory keeps what is given back
  std::uint32_t number;  ///< of the sample, from 1; 0 before the first
  std::uint64_t seed;    ///< of the sample
  bool guided;  ///< false: directions are to be their BSDFs'; in the first samples, and beyond guided_depths
  bool recorded;       ///< whether its paths are: only then is learn() called
  stage_clock& clock;  ///< for stages of the guide's own; prepare, learn and update are timed
};

/// What a guide wants recorded of paths.
struct recording_needs {
  std::uint32_t share_shift = 0;  ///< of 2^share_shift paths one, in samples that are recorded
  bool directions = false;        ///< what scatter() and escape() tell, too
  /// Once means have settled, of so many samples one is recorded, drawn at random; at least 1. The others
  /// cost next to nothing to end: most of what that costs a GPU does not depend on how many paths there are.
  std::uint32_t settled_turns = 1;

  /// Samples after the beginning, or after forget_light(), that means take to settle.
  static constexpr std::uint32_t settling_samples = 32;
};

/// Returned by lights() of guides that do not choose lights. Converts to an empty view of a guide that does,
/// for kernels that are written for both.
struct no_light_choices {
  /// An empty view.
  template <class View>
  operator View() const {
    return {};
  }
};

/// What guides have that do not say otherwise: a guide derives from it, and hides what it does by itself.
struct guide_base {
  using options_type = sampling_options;  ///< no options of its own

  /// Whether it never guides.
  bool empty() const { return false; }
  /// All vertices of all paths.
  recording_needs recording() const { return {}; }
  /// Whether there is anything to record: where not, path_guider::recorder() gives one that costs nothing.
  static constexpr bool records_paths = true;
  /// Which lights next-event estimation is to ask: no choice is learnt.
  no_light_choices lights() const { return {}; }
  /// Before the waves of a sample.
  template <class Exec>
  void begin_sample(const guide_sample<Exec>&) {}
  /// After the waves of a sample that is recorded: learns nothing.
  template <class Exec>
  void learn(const guide_sample<Exec>&, path_recorder<Exec>&) {}
  /// After the waves of each sample, and what was learnt from it.
  template <class Exec>
  void update(const guide_sample<Exec>&) {}
  /// Geometry moved inside the bounds: nothing is kept that could be out of date.
  template <class Exec>
  void invalidate(const Exec&, const bounds3&) {}
  /// Geometry moved anywhere.
  template <class Exec>
  void invalidate_all(const Exec&) {}
  /// Lights moved: nothing is kept that could be out of date.
  template <class Exec>
  void forget_light(const Exec&) {}
  /// Adds nothing to what a guider tells.
  template <class Exec>
  void report(const Exec&, guider_statistics&) const {}
  /// Nothing.
  std::vector<memory_part> memory() const { return {}; }

  /// Whether it draws the directions of a whole wave by itself:
  ///   void serve(const guide_sample<Exec>&, const wave<Surfaces, Random>&, const Caster&, const Serve&);
  /// as the octree's does, whose transient fields are gone when their rays are served.
  static constexpr bool serves_waves = false;
};

namespace detail {

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

template <class View, class = void>
struct is_guide_view : std::false_type {};
template <class View>
struct is_guide_view<
    View, std::void_t<decltype(sampled_direction(std::declval<const View&>().sample(
                          std::uint32_t(0), std::declval<const surface<trait_bsdf>&>(), 0.0f, vec2()))),
                      decltype(float(std::declval<const View&>().pdf(
                          std::uint32_t(0), std::declval<const surface<trait_bsdf>&>(), vec3())))>>
    : std::is_trivially_copyable<View> {};

template <class Guide, class Exec, class = void>
struct has_guide_options : std::false_type {};
template <class Guide, class Exec>
struct has_guide_options<Guide, Exec, std::void_t<typename Guide::options_type>>
    : std::is_base_of<sampling_options, typename Guide::options_type> {};

template <class Guide, class Exec, class = void>
struct knows_mesh : std::false_type {};
template <class Guide, class Exec>
struct knows_mesh<Guide, Exec, std::void_t<typename Guide::options_type>>
    : std::is_constructible<Guide, const Exec&, const Exec&, triangle_mesh_view,
                            const typename Guide::options_type&> {};

template <class Guide, class Exec, class = void>
struct prepares_view : std::false_type {};
template <class Guide, class Exec>
struct prepares_view<
    Guide, Exec,
    std::void_t<typename Guide::view_type, decltype(typename Guide::view_type(std::declval<Guide&>().prepare(
                                               std::declval<const guide_sample<Exec>&>(),
                                               std::declval<const trait_wave&>(), trait_caster())))>>
    : is_guide_view<typename Guide::view_type> {};

template <class Guide, class Exec, class = void>
struct learns_paths : std::false_type {};
template <class Guide, class Exec>
struct learns_paths<
    Guide, Exec,
    std::void_t<decltype(std::declval<Guide&>().learn(std::declval<const guide_sample<Exec>&>(),
                                                      std::declval<path_recorder<Exec>&>())),
                decltype(std::declval<Guide&>().update(std::declval<const guide_sample<Exec>&>())),
                decltype(std::vector<memory_part>(std::declval<const Guide&>().memory()))>>
    : std::is_base_of<guide_base, Guide> {};

/// A guide as path_guider asks for it; what is missing is the error.
template <class Guide, class Exec>
constexpr bool require_guide() {
  static_assert(has_guide_options<Guide, Exec>::value,
                "Guide: needs `using options_type`, which derives from wfpg::sampling_options");
  static_assert(knows_mesh<Guide, Exec>::value,
                "Guide: needs a constructor of (const Exec&, const Exec& working, triangle_mesh_view, const "
                "options_type&)");
  static_assert(prepares_view<Guide, Exec>::value,
                "Guide: needs `using view_type`, which is_guide_view_v asks for, and view_type "
                "prepare(const guide_sample<Exec>&, const wave<Surfaces, Random>&, const Caster&)");
  static_assert(learns_paths<Guide, Exec>::value,
                "Guide: needs learn(const guide_sample<Exec>&, path_recorder<Exec>&), "
                "update(const guide_sample<Exec>&) and memory(), which wfpg::guide_base has");
  return true;
}

}  // namespace detail

// clang-format off
/// True where View, trivially copyable, draws directions for the rays of a wave; kernels take it by value:
///   sampled_direction sample(std::uint32_t ray, const surface<Bsdf>& s, float u_technique, vec2 u) const;
///   float pdf(std::uint32_t ray, const surface<Bsdf>& s, vec3 direction) const;
/// `pdf` is the density of `sample`, per steradian, all that it mixes included: basic_guide_mixture
/// (mis.hpp) mixes a distribution of directions and the surface's BSDF so, and mixture_view asks for that alone.
template <class View>
inline constexpr bool is_guide_view_v = detail::is_guide_view<View>::value;
// clang-format on

/// True where path_guider<Exec, Guide> can be.
template <class Guide, class Exec>
inline constexpr bool is_guide_v =
    detail::has_guide_options<Guide, Exec>::value&& detail::knows_mesh<Guide, Exec>::value&&
        detail::prepares_view<Guide, Exec>::value&& detail::learns_paths<Guide, Exec>::value;

}  // namespace wfpg
