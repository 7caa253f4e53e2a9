// Open PGL (Herholz and Dittebrandt, 2022) behind the guider's interface. It and wfpg share one loop, one
// treatment of BSDFs and one kind of mixture, and differ only in the guide. It runs on TBB, as Open PGL does.
#pragma once

#include "tracer/openpgl_paths.hpp"
#include "tracer/stage_clock.hpp"

#include <wfpg/host/wave.hpp>
#include <wfpg/sampling/mixture.hpp>

#include <type_traits>

namespace render {

/// Open PGL's distribution at one point, with the interface that wfpg::basic_guide_mixture needs. An empty
/// one guides nothing.
class openpgl_distribution {
 public:
  openpgl_distribution() = default;
  explicit openpgl_distribution(const openpgl::cpp::SurfaceSamplingDistribution& at) : at_(&at) {}

  bool empty() const { return at_ == nullptr; }
  /// That of wfpg's fields. Both know equally little of a BSDF's lobes, so both get equal fractions.
  static constexpr float resolved_alpha() { return wfpg::directional_field::resolved_alpha(); }

  vec3 sample(vec2 u, float& density) const {
    const vec3 direction = glm::normalize(from_pgl(at_->Sample({u.x, u.y})));
    // Not SamplePDF(): its density differs where rounding moves a direction to the next cell of a quadtree.
    density = pdf(direction);
    return direction;
  }
  float pdf(vec3 direction) const { return at_->PDF(to_pgl(direction)); }

 private:
  const openpgl::cpp::SurfaceSamplingDistribution* at_ = nullptr;
};

using openpgl_mixture = wfpg::basic_guide_mixture<openpgl_distribution>;

/// A field of Open PGL that any thread may query.
class openpgl_field_view {
 public:
  using distributions = ::tbb::enumerable_thread_specific<openpgl::cpp::SurfaceSamplingDistribution>;

  /// `workspace` has a distribution for each thread.
  openpgl_field_view(const openpgl::cpp::Field& field, distributions& workspace)
      : field_(&field), workspace_(&workspace) {}

  /// The distribution at a surface, valid until this thread's next call. Includes the cosine if the field
  /// supports it and light comes only from above the surface. Empty for delta BSDFs, and before the field has
  /// learnt.
  openpgl_distribution at(const wfpg::surface<bsdf>& s) const {
    if (s.bsdf.is_delta()) return {};
    openpgl::cpp::SurfaceSamplingDistribution& here = workspace_->local();
    float u = 0.0f;  // chooses among neighbours in a look-up of several
    if (!here.Init(field_, to_pgl(s.position), u)) return {};
    if (here.SupportsApplyCosineProduct() && !s.bsdf.transmits()) here.ApplyCosineProduct(to_pgl(s.normal));
    return openpgl_distribution(here);
  }

 private:
  const openpgl::cpp::Field* field_;
  distributions* workspace_;
};

/// Samples a direction for each ray, returns the density of its query from the same distribution, and records
/// the direction.
template <class Surfaces, class Random, class Queries>
struct sample_openpgl {
  openpgl_field_view field;
  float fraction;  // 0: the field is not used
  std::uint32_t depth;
  Surfaces surfaces;
  Random random;
  openpgl_recorder recorder;
  wfpg::array_view<wfpg::sampled_direction> directions;
  Queries queries;

  void operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    const wfpg::surface<bsdf> surface = surfaces(ray);
    directions[i] = {};
    openpgl_mixture mixture;
    if (surface.active) {
      if (fraction > 0.0f) mixture = {field.at(surface), fraction};
      directions[i] = mixture.sample(surface, random(ray, 0).x, random(ray, 1));
      recorder.drawn(surfaces.queue[ray], depth, surface, directions[i]);
    }
    if constexpr (!std::is_same_v<Queries, wfpg::no_queries>) {
      const vec3 direction = queries.query(ray);
      const bool asked = surface.active && direction != vec3(0.0f);
      queries.densities[i] = asked ? mixture.pdf(surface, direction) : 0.0f;
    }
  }
};

/// Options of an openpgl_guider.
struct openpgl_options {
  PGL_DIRECTIONAL_DISTRIBUTION_TYPE directional = PGL_DIRECTIONAL_DISTRIBUTION_PARALLAX_AWARE_VMM;
  std::size_t samples_per_leaf = 32000;       ///< larger leaves are split
  float guide_fraction = 0.5f;                ///< of directions that the field samples, in [0, 1]
  std::uint32_t guided_depths = 0xffffffffu;  ///< depths that the field guides, from 0 on
  std::size_t paths = 0;                      ///< of a sample
  std::size_t max_depth = 1;                  ///< vertices of a path
  pgl_box3f bounds{};                         ///< holds all vertices
};

/// A guider that trains a field of Open PGL on each sample, for the next samples. The first one is not
/// guided.
class openpgl_guider {
 public:
  openpgl_guider(const wfpg::exec::tbb& exec, const openpgl_options& options)
      : exec_(exec),
        guide_fraction_(options.guide_fraction),
        guided_depths_(options.guided_depths),
        device_(widest_device()),
        field_(&device_, field_config(options).config),
        distributions_(&field_),
        paths_(options.paths, options.max_depth) {
    field_.SetSceneBounds(options.bounds);
  }

  void begin_sample() { paths_.clear(); }
  void end_sample() {
    clock_.measure("samples", [&] { paths_.make_samples(exec_); });
    clock_.measure("train", [&] { field_.UpdateSurface(paths_.samples()); });
  }
  const openpgl_recorder& recorder() const { return paths_.recorder(); }
  wfpg::light_guide_view lights() const { return {}; }
  float sample_weight() const { return 1.0f; }

  template <class Wave, class Caster, class Queries = wfpg::no_queries>
  void sample_directions(const Wave& wave, const Caster&,
                         wfpg::array_view<wfpg::sampled_direction> directions, const Queries& queries = {}) {
    clock_.measure("query", [&] {
      exec_.for_each(wave.ray_count, sample_openpgl<decltype(wave.surfaces), decltype(wave.random), Queries>{
                                         {field_, distributions_},
                                         wave.depth < guided_depths_ ? guide_fraction_ : 0.0f,
                                         wave.depth,
                                         wave.surfaces,
                                         wave.random,
                                         paths_.recorder(),
                                         directions,
                                         queries});
    });
  }

  const openpgl::cpp::Field& field() const { return field_; }
  openpgl_field_view view() { return {field_, distributions_}; }
  const openpgl_paths& paths() const { return paths_; }
  /// By stage: "samples" makes them from paths, "train" fits the field, "query" samples directions.
  const named_seconds& seconds() const { return clock_.seconds(); }

 private:
  struct field_config {
    openpgl::cpp::FieldConfig config;
    explicit field_config(const openpgl_options& options) {
      // Deterministic: one seed, one picture.
      config.Init(PGL_SPATIAL_STRUCTURE_KDTREE, options.directional, true, options.samples_per_leaf);
      // The default chooses one of the four nearest regions at random. This hides borders between regions,
      // but adds more noise than it saves: the nearest region may be on another wall.
      config.SetUseKnnLookup(false);
    }
  };

  // The widest of Open PGL's default devices.
  static PGL_DEVICE_TYPE widest_device() {
#if defined(__x86_64__) && defined(__GNUC__)
    return __builtin_cpu_supports("avx2") ? PGL_DEVICE_TYPE_CPU_8 : PGL_DEVICE_TYPE_CPU_4;
#else
    return PGL_DEVICE_TYPE_CPU_4;
#endif
  }

  wfpg::exec::tbb exec_;
  float guide_fraction_;
  std::uint32_t guided_depths_;
  openpgl::cpp::Device device_;
  openpgl::cpp::Field field_;
  openpgl_field_view::distributions distributions_;
  openpgl_paths paths_;
  stage_clock clock_;
};

}  // namespace render
