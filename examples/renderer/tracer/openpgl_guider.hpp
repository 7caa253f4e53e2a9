// Open PGL (Herholz and Dittebrandt, 2022) behind the guider's interface, so that it and wfpg share one loop,
// one treatment of BSDFs, one kind of mixture, and differ in what they guide by. On TBB, as Open PGL is.
#pragma once

#include "tracer/openpgl_paths.hpp"
#include "tracer/stage_clock.hpp"

#include <wfpg/host/wave.hpp>
#include <wfpg/sampling/mixture.hpp>

#include <type_traits>

namespace render {

/// What a field of Open PGL draws from at one point, as wfpg::basic_guide_mixture wants it. An empty one
/// guides nothing.
class openpgl_distribution {
 public:
  openpgl_distribution() = default;
  explicit openpgl_distribution(const openpgl::cpp::SurfaceSamplingDistribution& at) : at_(&at) {}

  bool empty() const { return at_ == nullptr; }
  /// As wfpg's fields, which know as little of a BSDF's lobes: both are asked as often.
  static constexpr float resolved_alpha() { return wfpg::directional_field::resolved_alpha(); }

  vec3 sample(vec2 u, float& density) const {
    const vec3 direction = glm::normalize(from_pgl(at_->Sample({u.x, u.y})));
    // Not SamplePDF(): what that says differs where rounding moves a direction to the next cell of a
    // quadtree.
    density = pdf(direction);
    return direction;
  }
  float pdf(vec3 direction) const { return at_->PDF(to_pgl(direction)); }

 private:
  const openpgl::cpp::SurfaceSamplingDistribution* at_ = nullptr;
};

using openpgl_mixture = wfpg::basic_guide_mixture<openpgl_distribution>;

/// A field of Open PGL that can be asked from any thread.
class openpgl_field_view {
 public:
  using distributions = ::tbb::enumerable_thread_specific<openpgl::cpp::SurfaceSamplingDistribution>;

  /// `workspace`: a distribution a thread.
  openpgl_field_view(const openpgl::cpp::Field& field, distributions& workspace)
      : field_(&field), workspace_(&workspace) {}

  /// The distribution at a surface, valid until this thread's next call. Has the cosine in it where the field
  /// can do that and light comes from above the surface alone. Empty on delta BSDFs, and where nothing is
  /// learnt yet.
  openpgl_distribution at(const wfpg::surface<bsdf>& s) const {
    if (s.bsdf.is_delta()) return {};
    openpgl::cpp::SurfaceSamplingDistribution& here = workspace_->local();
    float u = 0.0f;  // chooses among neighbours, where a field is asked for them
    if (!here.Init(field_, to_pgl(s.position), u)) return {};
    if (here.SupportsApplyCosineProduct() && !s.bsdf.transmits()) here.ApplyCosineProduct(to_pgl(s.normal));
    return openpgl_distribution(here);
  }

 private:
  const openpgl::cpp::Field* field_;
  distributions* workspace_;
};

/// Draws a direction for each ray, gives the density of its query from the same distribution, and records
/// what was drawn.
template <class Surfaces, class Random, class Queries>
struct sample_openpgl {
  openpgl_field_view field;
  float fraction;  // 0: the field is not asked
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

/// What an openpgl_guider is made of.
struct openpgl_options {
  PGL_DIRECTIONAL_DISTRIBUTION_TYPE directional = PGL_DIRECTIONAL_DISTRIBUTION_PARALLAX_AWARE_VMM;
  std::size_t samples_per_leaf = 32000;       ///< a leaf that has had more is split
  float guide_fraction = 0.5f;                ///< of directions that are drawn from the field, in [0, 1]
  std::uint32_t guided_depths = 0xffffffffu;  ///< depths whose directions are, from 0 on
  std::size_t paths = 0;                      ///< of a sample
  std::size_t max_depth = 1;                  ///< vertices of a path
  pgl_box3f bounds{};                         ///< holds all vertices
};

/// A guider that trains a field of Open PGL on each sample, for the next ones: the first is not guided.
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
  /// By stage: "samples" makes them of paths, "train" fits the field to them, "query" draws directions.
  const named_seconds& seconds() const { return clock_.seconds(); }

 private:
  struct field_config {
    openpgl::cpp::FieldConfig config;
    explicit field_config(const openpgl_options& options) {
      // Deterministic: one seed, one picture.
      config.Init(PGL_SPATIAL_STRUCTURE_KDTREE, options.directional, true, options.samples_per_leaf);
      // The default, a random one of the four regions nearest, hides borders between regions and costs more
      // noise than that is worth: the nearest may lie on another wall.
      config.SetUseKnnLookup(false);
    }
  };

  // Of those that Open PGL is built with by default.
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
