// A guide that is a regular grid: cells over the scene's bounds, directions of each, and the radiance that
// arrives along them, learnt as reinforcement learning does (Kim & Kim, "Fast and Lightweight Path Guiding
// Algorithm on GPU", 2021). It casts no ray and needs no geometry but bounds; directions are drawn from
// radiance times the cosine at the surface, above it.
//
//   wfpg::sarsa_grid_options options;
//   options.max_paths = paths;
//   wfpg::path_guider<Exec, wfpg::sarsa_grid<Exec>> guider(exec, mesh, options);
//
// BSDFs are in the products as the paper has them: as diffuse ones, whose factor is the same for all
// directions; of others the glossy part is left to the BSDF (mis.hpp). Surfaces that transmit draw from the
// radiance alone. Until the first step ends nothing guides.
//
// Memory: 20 bytes a cell's direction and 16 of a cell and normal; in a sample 16 a direction, 8 a value, the
// recorder's vertices, and of expected SARSA 4 a path and depth. A step's end: O(cells · normals ·
// directions).
#pragma once

#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/guide/guide.hpp>
#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guide/recorded_fraction.hpp>
#include <wfpg/guide/sample_rays.hpp>
#include <wfpg/guides/sarsa/detail/sarsa_learning.hpp>
#include <wfpg/guides/sarsa/options.hpp>
#include <wfpg/octree/voxelizer.hpp>
#include <wfpg/sampling/mixture.hpp>

#include <thrust/fill.h>

#include <vector>

namespace wfpg {

/// What a sarsa_grid's rays draw from. Trivially copyable; holds until the guider's next call.
class sarsa_grid_view : public mixture_view<sarsa_grid_view> {
 public:
  sarsa_grid_view() = default;

  /// Whether a surface is guided; without it is its BSDF's.
  template <class Bsdf>
  WFPG_HD bool guides(const surface<Bsdf>& s) const {
    return fraction_ > 0.0f && can_be_guided(s);
  }

  /// The mixture at a surface; of one that is not guided, the BSDF alone.
  template <class Bsdf>
  WFPG_HD basic_guide_mixture<detail::sarsa_distribution> mixture(std::uint32_t ray,
                                                                  const surface<Bsdf>& s) const {
    if (!guides(s)) return {};
    const std::uint32_t number = first_number_ == no_field ? no_field : first_number_ + ray;
    return {distribution(s.position, facing_normal(s), s.bsdf.transmits()), fraction_, number};
  }

  /// What is drawn at a place with a normal on the side of the light; where light comes from both sides, from
  /// the radiance alone.
  WFPG_HD detail::sarsa_distribution distribution(vec3 position, vec3 normal, bool transmits) const {
    const std::uint32_t cell = cells_.index(position), n = resolution_ * resolution_;
    const detail::sarsa_cell from{sums_ + std::size_t(cell) * grid_distribution::words(resolution_),
                                  weights_ + std::size_t(cell) * n, resolution_};
    if (transmits || sampler_ == sarsa_sampler::sphere_inversion) return detail::sarsa_distribution(from);
    const std::uint32_t lattice = normals_.index(glm::normalize(normal));
    return {from,
            {from, cosines_ + std::size_t(lattice) * n,
             normalisers_[std::size_t(cell) * normals_.size() + lattice], normal},
            sampler_};
  }

  /// Radiance that is known to arrive at a place along a unit direction, luminance, W/(m² sr); 0 where
  /// nothing is. As of the last step.
  WFPG_HD float radiance(vec3 position, vec3 direction) const {
    return radiance_[detail::sarsa_table{cells_, radiance_, resolution_}.index(position, direction)];
  }

 private:
  template <class Exec>
  friend class sarsa_grid;

  detail::sarsa_cells cells_;
  detail::normal_lattice normals_;
  std::uint32_t resolution_ = 0;
  const float* radiance_ = nullptr;
  const std::uint32_t* weights_ = nullptr;
  const std::uint32_t* sums_ = nullptr;
  const std::uint8_t* cosines_ = nullptr;
  const detail::sarsa_normaliser* normalisers_ = nullptr;
  sarsa_sampler sampler_ = sarsa_sampler::mixed_rejection;
  float fraction_ = 0.0f;
  std::uint32_t first_number_ = no_field;  // of the wave's rays, where directions are numbered
};

/// A guide as guide.hpp describes them. Movable, not copyable.
template <class Exec>
class sarsa_grid : public guide_base {
 public:
  using options_type = sarsa_grid_options;  ///< what it can be told
  using view_type = sarsa_grid_view;        ///< what kernels draw from

  /// Over the bounds of triangles, read only here. Throws std::invalid_argument for options out of range,
  /// out_of_memory.
  sarsa_grid(const Exec& exec, const Exec& working, triangle_mesh_view mesh,
             const sarsa_grid_options& options)
      : sarsa_grid(exec, working, detail::bounds_of(exec, mesh), options) {}
  /// Over bounds, world space; what lies beyond belongs to the cells at its faces.
  sarsa_grid(const Exec& exec, const Exec& working, const bounds3& bounds, const sarsa_grid_options& options);

  /// Directions, and of many paths a part.
  recording_needs recording() const { return recorded().needs(true); }

  /// Before the waves of a sample.
  void begin_sample(const guide_sample<Exec>&) { numbered_ = 0; }
  /// What the wave's rays draw from.
  template <class Surfaces, class Random, class Caster>
  sarsa_grid_view prepare(const guide_sample<Exec>& at, const wave<Surfaces, Random>& w, const Caster&);
  /// Sums a value for each direction of the paths.
  void learn(const guide_sample<Exec>& at, path_recorder<Exec>& paths);
  /// Uses what was learnt, after the last sample of a step.
  void update(const guide_sample<Exec>& at) {
    if (at.number % options_.step == 0) publish(at.exec);
  }
  /// Forgets all light.
  void forget_light(const Exec& exec);

  /// The view of the last step, that all rays have: for those who look at what was learnt.
  sarsa_grid_view view() const { return view_; }
  /// Radiance and normalisers; what a sample needs.
  std::vector<memory_part> memory() const;

 private:
  static const sarsa_grid_options& checked(const sarsa_grid_options& options);
  std::size_t directions() const {
    return std::size_t(view_.cells_.size()) * options_.direction_resolution * options_.direction_resolution;
  }
  detail::recorded_fraction recorded() const {
    return {options_, std::uint64_t(options_.values_per_direction) * directions()};
  }
  bool expects() const { return options_.update == sarsa_update::expected_sarsa; }
  detail::sarsa_table table() const { return {view_.cells_, radiance_.data(), view_.resolution_}; }
  void publish(const Exec& exec);

  sarsa_grid_options options_;
  sarsa_grid_view view_;
  buffer<detail::direction_mean, Exec> means_;
  buffer<float, Exec> radiance_;
  buffer<std::uint32_t, Exec> weights_, sums_;
  buffer<std::uint8_t, Exec> cosines_;
  buffer<std::uint32_t, Exec> opposites_;
  buffer<detail::sarsa_normaliser, Exec> normalisers_;
  detail::value_queue<Exec> queue_;
  buffer<float, Exec> expected_;  // a number of a direction of this sample
  std::size_t numbered_ = 0;
};

}  // namespace wfpg

#include <wfpg/guides/sarsa/detail/sarsa_grid_impl.hpp>
