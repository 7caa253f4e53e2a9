// A guide that learns incident radiance on a regular grid, by reinforcement learning. The grid has cells over
// the scene's bounds, and B² directions a cell. It samples directions by radiance times the cosine at the
// surface. It casts no rays, and of the geometry it reads only the bounds.
//
//   wfpg::sarsa_grid_options options;
//   options.max_paths = paths;
//   wfpg::path_guider<Exec, wfpg::sarsa_grid<Exec>> guider(exec, mesh, options);
//
// The product takes all BSDFs as diffuse, as in the paper. Their factor is then equal for all directions. The
// mixture leaves glossy parts to the BSDF (sampling/mixture.hpp). Surfaces that transmit sample by radiance
// alone. Nothing is guided before the end of the first step.
//
// Source: Kim & Kim, "Fast and Lightweight Path Guiding Algorithm on GPU", 2021, sections 2 and 3.
// Cost: the end of a step takes O(cells · normals · directions). Directions cost what sarsa_sampler says.
// Memory: 20 bytes a cell and direction, and 16 a cell and normal. In a sample 16 a cell and direction, 8 a
// value, the recorder's vertices, and with expected SARSA 4 bytes a path and depth.
#pragma once

#include <wfpg/exec/buffer.hpp>
#include <wfpg/guide/guide.hpp>
#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guide/rank_agreement.hpp>
#include <wfpg/guide/recorded_fraction.hpp>
#include <wfpg/guide/sample_rays.hpp>
#include <wfpg/guides/sarsa/detail/sarsa_learning.hpp>
#include <wfpg/guides/sarsa/options.hpp>
#include <wfpg/octree/voxelizer.hpp>
#include <wfpg/sampling/mixture.hpp>

#include <vector>

namespace wfpg {

/// View of a sarsa_grid for kernels, from which rays sample. Trivially copyable. Valid until the guider's
/// next call. mixture_view adds sample() and pdf().
class sarsa_grid_view : public mixture_view<sarsa_grid_view> {
 public:
  /// A view that guides nothing. distribution() and radiance() may not be called.
  sarsa_grid_view() = default;

  /// Whether a surface is guided. If not, its rays sample the BSDF alone. O(1).
  template <class Bsdf>
  WFPG_HD bool guides(const surface<Bsdf>& s) const {
    return fraction_ > 0.0f && can_be_guided(s);
  }

  /// Returns the mixture of grid and BSDF at a surface, for ray `ray` of the wave; the BSDF alone where the
  /// surface is not guided. O(1): a cell and a normal are looked up.
  template <class Bsdf>
  WFPG_HD basic_guide_mixture<detail::sarsa_distribution> mixture(std::uint32_t ray,
                                                                  const surface<Bsdf>& s) const {
    if (!guides(s)) return {};
    // scatter() hands the number on to learn(), which looks up the ray's integral by it.
    const std::uint32_t number = first_number_ == no_field ? no_field : first_number_ + ray;
    return {distribution(s.position, facing_normal(s), s.bsdf.transmits()), fraction_, number};
  }

  /// Returns the distribution of directions at a position, world space. `normal` points to the side that
  /// light comes from; it is of unit length. If the surface `transmits`, light comes from both sides
  /// and the distribution is that of radiance alone.
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

  /// Returns the radiance that arrives at a position from a unit direction, as known at the end of the last
  /// step: luminance, W/(m² sr). 0 where no path went. Positions beyond the bounds take the nearest cell.
  WFPG_HD float radiance(vec3 position, vec3 direction) const {
    return radiance_[detail::sarsa_table{cells_, radiance_, resolution_}.index(position, direction)];
  }

 private:
  template <class Exec>
  friend class sarsa_grid;

  // Positions to cells; normals to the lattice of the products; directions to B x B ones.
  detail::sarsa_cells cells_;
  detail::normal_lattice normals_;
  std::uint32_t resolution_ = 0;
  // Arrays by cell and direction: what is known, and what is sampled.
  const float* radiance_ = nullptr;
  const std::uint32_t* weights_ = nullptr;
  const std::uint32_t* sums_ = nullptr;  // of a cell: a grid_distribution
  // By normal and direction, and by cell and normal.
  const std::uint8_t* cosines_ = nullptr;
  const detail::sarsa_normaliser* normalisers_ = nullptr;
  sarsa_sampler sampler_ = sarsa_sampler::mixed_rejection;
  float fraction_ = 0.0f;  // 0: nothing is guided
  // Number of the wave's first ray among the rays of the sample, for expected SARSA; else no_field.
  std::uint32_t first_number_ = no_field;
};

/// A guide that learns radiance on a grid; path_guider calls its members. Movable, not copyable. It samples
/// the radiance of the last complete step, and meanwhile learns for the next.
template <class Exec>
class sarsa_grid : public guide_base {
 public:
  using options_type = sarsa_grid_options;  ///< resolutions, learning and sampling
  using view_type = sarsa_grid_view;        ///< what kernels sample from

  /// A grid over the bounds of the triangles, which only the constructor reads. `exec` allocates the grid,
  /// `working` what samples need. Throws std::invalid_argument for options out of range, and out_of_memory.
  sarsa_grid(const Exec& exec, const Exec& working, triangle_mesh_view mesh,
             const sarsa_grid_options& options)
      : sarsa_grid(exec, working, detail::bounds_of(exec, mesh), options) {}
  /// A grid over `bounds`, world space. Positions beyond belong to the cells at the bounds' faces. If the
  /// bounds are empty, all positions belong to the first cell.
  sarsa_grid(const Exec& exec, const Exec& working, const bounds3& bounds, const sarsa_grid_options& options);

  /// Ranks that share a sample learn equal means. They exchange 8 bytes a value of a recorded sample, or 16 a
  /// direction of the grid where that is less. Expected SARSA is refused: its numbers depend on waves.
  static constexpr bool joins_ranks = true;
  /// Adds the bounds and the options that decide what is learnt, for ranks to compare.
  void agree(const Exec&, agreed_items& items) const;

  /// Vertices and directions, of a fraction of the paths that values_per_direction sets.
  recording_needs recording() const { return recorded().needs(true); }

  /// Resets the numbers that expected SARSA gives to the rays of a sample.
  void begin_sample(const sample_context<Exec>&) { numbered_ = 0; }
  /// Returns the view of the last step. Launches nothing, except that expected SARSA integrates the known
  /// radiance at each ray of a recorded sample, which evaluates B² BSDFs.
  template <class Surfaces, class Random, class Caster>
  sarsa_grid_view prepare(const sample_context<Exec>& at, const wave<Surfaces, Random>& w, const Caster&);
  /// Computes a value for each direction of the recorded paths and moves the means toward them. Clears
  /// `paths`. O(vertices + cells · directions).
  void learn(const sample_context<Exec>& at, path_recorder<Exec>& paths);
  /// Ends a step after the last of its `step` samples: publishes the means, so that rays sample them.
  void update(const sample_context<Exec>& at) {
    if (at.number % options_.step == 0) publish(at.exec);
  }
  /// Forgets all radiance. Nothing is guided before the next step ends.
  void forget_light(const Exec& exec);

  /// The view of the last step, for looking at what was learnt.
  sarsa_grid_view view() const { return view_; }
  /// Two parts that are kept, "radiance" and "normalisers", and "values", which a sample needs.
  std::vector<memory_part> memory() const;

 private:
  /// Throws std::invalid_argument for options out of range.
  static const sarsa_grid_options& checked(const sarsa_grid_options& options);
  /// Directions of all cells.
  std::size_t directions() const {
    return std::size_t(view_.cells_.size()) * options_.direction_resolution * options_.direction_resolution;
  }
  /// How many values a sample is to have, and so how many vertices.
  detail::recorded_fraction recorded() const {
    return {options_, std::uint64_t(options_.values_per_direction.value_or(0)) * directions()};
  }
  /// Whether each ray's integral of the known radiance is computed before it is sampled.
  bool expects() const { return options_.update == sarsa_update::expected_sarsa; }
  /// The known radiance, for learning.
  detail::sarsa_table table() const { return {view_.cells_, radiance_.data(), view_.resolution_}; }
  /// Makes distributions and normalisers from the means, and starts to guide.
  void publish(const Exec& exec);

  sarsa_grid_options options_;
  sarsa_grid_view view_;
  buffer<detail::direction_mean, Exec> means_;  // of a cell and direction, as learnt so far
  // What the view's pointers of these names point to.
  buffer<float, Exec> radiance_;
  buffer<std::uint32_t, Exec> weights_, sums_;
  buffer<std::uint8_t, Exec> cosines_;
  buffer<std::uint32_t, Exec> opposites_;  // of a direction
  buffer<detail::sarsa_normaliser, Exec> normalisers_;
  detail::value_queue<Exec> queue_;
  buffer<float, Exec> expected_;  // by number of a ray in this sample
  std::size_t numbered_ = 0;      // rays of this sample so far
};

}  // namespace wfpg

#include <wfpg/guides/sarsa/detail/sarsa_grid_impl.hpp>
