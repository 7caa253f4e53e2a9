// Both of the octree's guides in one type that chooses at run time. A test runs with each of them.
#pragma once

#include "support/unset.hpp"

#include <wfpg/guides/octree/kept_guide.hpp>
#include <wfpg/guides/octree/transient_guide.hpp>
#include <wfpg/path_guider.hpp>

#include <cstdint>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace wfpg_test {

/// Which of the octree's guides.
enum class field_lifetime : std::uint8_t { kept, transient };

/// Options of both guides.
struct guider_options : wfpg::kept_guide_options {
  field_lifetime fields = field_lifetime::kept;
  std::uint32_t field_resolution = wfpg::transient_guide_options().field_resolution;
  std::uint32_t min_field_resolution = wfpg::transient_guide_options().min_field_resolution;

  wfpg::transient_guide_options transient() const {
    wfpg::transient_guide_options options;
    static_cast<wfpg::octree_guide_options&>(options) = *this;
    options.field_resolution = field_resolution;
    options.min_field_resolution = min_field_resolution;
    return options;
  }
};

/// A guide that is a kept_guide or a transient_guide, depending on its options.
template <class Exec>
class either_guide : public wfpg::guide_base {
  using kept = wfpg::kept_guide<Exec>;
  using transient = wfpg::transient_guide<Exec>;
  template <class T>
  using context = wfpg::sample_context<T>;

 public:
  using options_type = guider_options;
  using view_type = wfpg::guide_view;
  static constexpr bool samples_waves = true;

  either_guide(const Exec& exec, const Exec& working, wfpg::triangle_mesh_view mesh,
               const guider_options& options)
      : guide_(make(exec, working, mesh, options)) {}
  either_guide(const Exec& exec, const Exec& working, wfpg::voxel_fragments<Exec> fragments,
               const guider_options& options)
      : guide_(make(exec, working, std::move(fragments), options)) {}

  bool empty() const {
    return visit([](const auto& g) { return g.empty(); });
  }
  wfpg::recording_needs recording() const {
    return visit([](const auto& g) { return g.recording(); });
  }
  void begin_sample(const context<Exec>& at) {
    visit([&](auto& g) { g.begin_sample(at); });
  }
  template <class Surfaces, class Random, class Caster>
  wfpg::guide_view prepare(const context<Exec>& at, const wfpg::wave<Surfaces, Random>& w,
                           const Caster& caster) {
    return visit([&](auto& g) { return g.prepare(at, w, caster); });
  }
  template <class Surfaces, class Random, class Caster, class Sampler>
  void sample_wave(const context<Exec>& at, const wfpg::wave<Surfaces, Random>& w, const Caster& caster,
                   const Sampler& sampler) {
    visit([&](auto& g) { g.sample_wave(at, w, caster, sampler); });
  }
  void learn(const context<Exec>& at, wfpg::path_recorder<Exec>& paths) {
    visit([&](auto& g) { g.learn(at, paths); });
  }
  void update(const context<Exec>& at) {
    visit([&](auto& g) { g.update(at); });
  }
  void invalidate(const Exec& exec, const wfpg::bounds3& bounds) {
    visit([&](auto& g) { g.invalidate(exec, bounds); });
  }
  void invalidate_all(const Exec& exec) {
    visit([&](auto& g) { g.invalidate_all(exec); });
  }
  void forget_light(const Exec& exec) {
    visit([&](auto& g) { g.forget_light(exec); });
  }
  wfpg::light_guide_view lights() const {
    return visit([](const auto& g) { return g.lights(); });
  }
  void report(const Exec& exec, wfpg::guider_statistics& statistics) const {
    visit([&](const auto& g) { g.report(exec, statistics); });
  }
  std::vector<wfpg::memory_part> memory() const {
    return visit([](const auto& g) { return g.memory(); });
  }

  wfpg::exitance_cache_view cache() const {
    return visit([](const auto& g) { return g.cache(); });
  }
  const wfpg::sparse_voxel_octree<Exec>& octree() const {
    return visit([](const auto& g) -> const wfpg::sparse_voxel_octree<Exec>& { return g.octree(); });
  }
  /// Empty for transient fields, as is field_keys().
  wfpg::learnt_radiance_view learnt() const {
    const kept* const k = std::get_if<kept>(&guide_);
    return k ? k->learnt() : wfpg::learnt_radiance_view();
  }
  std::vector<std::uint32_t> field_keys(const Exec& exec) const {
    const kept* const k = std::get_if<kept>(&guide_);
    return k ? k->field_keys(exec) : std::vector<std::uint32_t>();
  }
  /// Precondition: fields are transient.
  std::uint32_t field_resolution(std::uint32_t depth) const {
    return std::get<transient>(guide_).field_resolution(depth);
  }

 private:
  using either = std::variant<kept, transient>;

  template <class Scene>
  static either make(const Exec& exec, const Exec& working, Scene&& scene, const guider_options& options) {
    if (options.fields == field_lifetime::kept)
      return either(std::in_place_type<kept>, exec, working, std::forward<Scene>(scene), options);
    return either(std::in_place_type<transient>, exec, working, std::forward<Scene>(scene),
                  options.transient());
  }
  template <class F>
  decltype(auto) visit(const F& f) {
    return std::visit(f, guide_);
  }
  template <class F>
  decltype(auto) visit(const F& f) const {
    return std::visit(f, guide_);
  }

  either guide_;
};

/// Calls f(options) with the options of the chosen guide.
template <class F>
decltype(auto) with_own_options(const guider_options& options, const F& f) {
  if (options.fields == field_lifetime::kept) return f(static_cast<const wfpg::kept_guide_options&>(options));
  return f(options.transient());
}

/// A guider with the field lifetime of its options.
template <class Exec>
using octree_guider = wfpg::path_guider<Exec, either_guide<Exec>>;

}  // namespace wfpg_test
