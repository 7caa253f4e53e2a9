// Renders a scene with chosen options on a chosen device, and says what it cost.
#pragma once

#include "app/image_io.hpp"
#include "app/methods.hpp"
#include "tracer/stage_clock.hpp"
#include "tracer/technique_set.hpp"

#include <wfpg/guide/statistics.hpp>
#include <wfpg/guides/octree/options.hpp>
#include <wfpg/guides/records/options.hpp>
#include <wfpg/guides/sarsa/options.hpp>
#include <wfpg/sampling/sample_combiner.hpp>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace wfpg {
class communicator;
}

namespace render {

enum class guiding { oriented, plain };
enum class fields { kept, transient };
/// How fields' cones find light: by the scene's ray caster, or through the octree alone, by rays or as cones.
enum class cones { scene, march, trace };
/// What the octree is built from: the scene's triangles, rays that the scene's caster casts, or the hits of
/// the first sample, which is then not guided.
enum class octree_source { triangles, caster, samples };
enum class checkpoint_times {
  none,
  powers_of_two,
  all
};                                                 ///< after samples 1, 2, 4, 8, ... and the last; all
enum class device { cpu, omp, seq, cuda, optix };  ///< TBB, OpenMP, one thread, a GPU, and with OptiX

/// How ranks share a picture: the pixels of each sample, or several samples that end together.
enum class rank_split { tiles, samples };

inline constexpr int largest_side = 32768;  ///< pixels
inline constexpr std::int64_t most_pixels = std::int64_t(1) << 28;
inline constexpr int largest_depth = 1024;  ///< segments of a path

struct render_options {
  sampling_method method = sampling_method::wfpg;
  guiding mode = guiding::oriented;
  fields lifetime = fields::kept;
  cones through = cones::scene;
  octree_source octree = octree_source::triangles;
  device where = device::cpu;
  std::vector<int> devices;  ///< numbers of GPUs of cuda or optix; several share the picture; none: the first
  int spp = 64;              ///< samples a pixel, positive; not used where `seconds` is
  double seconds = 0.0;  ///< time for samples, building not counted; the last may use more; 0: spp decides
  int width = 0;  ///< pixels, both positive, at most `largest_side`, and `most_pixels` together; 0 x 0: the
                  ///< scene's own
  int height = 0;
  int max_depth = 0;       ///< segments of a path, positive; 0: the scene's own
  int roulette_depth = 3;  ///< Russian roulette ends no path before this vertex, from 0; 1 to 2^30
  bool nee = true;         ///< next-event estimation toward area lights, with MIS
  std::uint64_t seed = 0;
  std::uint32_t octree_resolution =
      wfpg::kept_guide_options().octree_resolution;  ///< voxels a side, a power of two
  std::uint32_t field_resolution =
      wfpg::transient_guide_options()
          .field_resolution;  ///< cells a side of transient fields at the first vertex
  wfpg::kept_field_options kept;
  std::size_t caster_buffer =
      wfpg::kept_guide_options().caster_buffer_bytes;  ///< bytes of cones in flight to OptiX
  std::uint32_t product_resolution = 8;                ///< blocks a side of products, 4, 8 or 16
  wfpg::binning_options binning;
  /// Target deposits per leaf in a sample that is recorded. Unset: all paths of all samples are recorded.
  std::optional<std::uint32_t> deposits_per_leaf = wfpg::kept_guide_options().deposits_per_leaf;
  /// Fraction of directions drawn from the guide, in (0, 1]. Unset: the method's own default.
  std::optional<float> guide_fraction;
  /// Gain below which a guide of wfpg or wfpg-product rests, at least 1; 0: it never rests. Unset: what suits
  /// the device.
  std::optional<float> least_gain;
  /// Of a path, from its first vertex on, at least 1; with next-event estimation never the last of several.
  std::uint32_t guided_depths = wfpg::sampling_options().guided_depths;
  std::uint32_t light_groups = 32;  ///< that guided paths learn to choose lights from, in [1, 255]
  /// Of bpt, vcm and upbp; nee decides on next-event estimation, too. Unset: the method's own.
  std::optional<technique_set> techniques;
  wfpg::bidirectional_options light;         ///< of paths from both ends: budget, radii, beam paths
  bool technique_pictures = false;           ///< the result has a picture a technique
  std::uint32_t samples_per_leaf = 32000;    ///< after which Open PGL's field splits a leaf, 8 to 2^30
  wfpg::sarsa_grid_options sarsa;            ///< its own; what every guide is told follows from the others
  wfpg::irradiance_records_options records;  ///< likewise
  checkpoint_times checkpoints = checkpoint_times::none;  ///< when to keep the picture so far
  /// Unset: inverse_variance for guides that measure their gain, pt_linear for others that learn. All alike
  /// for path tracing, records, and with a guide that was loaded.
  std::optional<wfpg::sample_combination> combine;
  std::string load_guide;               ///< guide file, of the same scene, to begin with; empty: none
  std::string resume;                   ///< state file of the rendering to go on with; empty: none
  bool keep_guide = false;              ///< the result has the guide
  bool keep_state = false;              ///< the result has what `resume` takes
  std::optional<rank_split> split;      ///< unset: one rank renders alone
  int samples_a_wave = 24;              ///< of each pixel, where ranks share samples
  double rank_seconds = 30.0;           ///< for which a rank waits for others
  wfpg::communicator* ranks = nullptr;  ///< that share the picture, of the host's memory; null: one rank
  wfpg::communicator* policy_ranks =
      nullptr;                       ///< the same ranks, of the policy's memory; where `ranks` is not null
  std::function<bool()> is_stopped;  ///< asked after each sample: true ends the rendering; may be empty
};

/// Bins of one depth, means over the samples that were guided; of kept fields, those made or refreshed.
struct bin_report {
  double count = 0.0;
  double mean_rays = 0.0;
};

/// Kept fields.
struct slot_report {
  std::uint32_t capacity = 0;  ///< that the budget holds; 0: fields are transient
  std::uint32_t live = 0;      ///< at the end
  std::size_t live_bytes = 0;
  double allocated = 0.0;  ///< a guided sample
  double freed = 0.0;      ///< a guided sample
  double refreshed = 0.0;  ///< a guided sample
};

/// What a guide found out about its worth.
struct rest_report {
  std::uint32_t rested = 0;  ///< samples in which the guide rested
  wfpg::guiding_gain gain;   ///< of the last comparison
};

struct octree_report {
  std::uint32_t resolution = 0;
  std::size_t nodes = 0;
  std::size_t leaves = 0;
  double bytes_per_node = 0.0;  ///< of octree and cache
  double build_seconds = 0.0;
};

/// Irradiance records, as of their last build.
struct records_report {
  std::uint32_t builds = 0;  ///< 0: there are none
  double build_seconds = 0.0;
  std::uint64_t rays = 0;
  std::uint64_t cones = 0;
  std::uint32_t records = 0;
  std::uint32_t objects = 0, lights = 0, directly_lit = 0;  ///< voxels by their tag
};

struct render_report {
  std::string scene, method, device;
  int spp = 0;                 ///< rendered, before a rendering went on too; times are since then
  std::uint64_t segments = 0;  ///< rays that paths were extended by
  /// Of them, those that hit a surface that emits toward them or left for an environment that does, the
  /// camera's among them; over the number of paths.
  double light_hits_per_path = 0.0;
  double total_seconds = 0.0;  ///< from building to the last sample
  named_seconds seconds;       ///< by stage; "guide ..." are parts of "directions" and of "update"
  std::vector<std::pair<std::string, std::size_t>> memory;  ///< the guider's bytes, by part
  std::size_t persistent_bytes = 0;                         ///< allocated
  std::size_t used_bytes = 0;                               ///< of them, without slots that hold no field
  std::size_t transient_bytes = 0;
  octree_report octree;
  std::vector<bin_report> bins;  ///< by depth
  slot_report slots;
  records_report records;
  rest_report rest;
  std::size_t regions = 0;             ///< of Open PGL's field
  std::size_t light_vertex_bytes = 0;  ///< memory of light paths, of maps over them, of joins and splats
  /// Vertices of light paths that had no memory. The picture lacks their light.
  std::uint64_t dropped_light_vertices = 0;
  std::uint64_t surplus_beams = 0;  ///< photon beams beyond the most media on a segment
  double cones_per_segment = 0.0;
};

/// How a method of paths from both ends finds light.
inline technique_set techniques_of(const render_options& options) {
  if (options.method == sampling_method::lt) return light_tracing();
  const technique_set own = options.method == sampling_method::upbp  ? points_beams_and_paths()
                            : options.method == sampling_method::vcm ? connection_and_merging()
                                                                     : technique_set();
  return options.techniques.value_or(own);
}

/// Their light paths. Precondition: sizes are positive.
inline wfpg::bidirectional_options light_options_of(const render_options& options) {
  const std::size_t pixels =
      static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height);
  return light_options(options.light, techniques_of(options), pixels,
                       static_cast<std::uint32_t>(options.max_depth));
}

/// How the samples of these options are combined.
inline wfpg::sample_combination combination_of(const render_options& options) {
  using wfpg::sample_combination;
  if (options.combine) return *options.combine;
  if (!properties_of(options.method).learns || !options.load_guide.empty())
    return sample_combination::constant;
  const bool measures = is_wfpg(options.method) && options.octree != octree_source::samples &&
                        options.least_gain.value_or(1.0f) > 0.0f;
  return measures ? sample_combination::inverse_variance : sample_combination::pt_linear;
}

/// Samples of a picture that has weight: more than one wave where the first wave is discarded.
inline int least_samples(const render_options& options) {
  const int wave = options.split == rank_split::samples ? options.samples_a_wave : 1;
  return combination_of(options) == wfpg::sample_combination::discard_first ? wave + 1 : 1;
}

/// A picture on the way.
struct checkpoint {
  int samples = 0;
  double seconds = 0.0;  ///< of samples so far; what keeping pictures takes is left out
  image picture;
};

/// What one technique found, with its weights and without.
struct technique_images {
  technique by;
  image weighted, plain;
};

struct render_result {
  image picture;
  std::vector<technique_images> by_technique;  ///< where options ask for them
  std::vector<checkpoint> checkpoints;         ///< where options ask for them
  render_report report;
  bool is_stopped = false;  ///< before its budget was spent
  std::string guide;        ///< a guide file's bytes, where options ask for them
  std::string state;        ///< a state file's bytes, where options ask for them
};

/// Where a rendering is; given after every sample.
struct render_progress {
  int samples = 0;        ///< done
  double fraction = 0.0;  ///< of the budget, in [0, 1]
  double seconds = 0.0;   ///< since rendering began
  double begun = 0.0;     ///< fraction that a rendering which goes on had before
};
using progress_callback = std::function<void(const render_progress&)>;

/// Options with the scene's own size and depth where they name none. Throws std::invalid_argument for options
/// that cannot be right; the message names what.
render_options completed(const scene& scene, render_options options);

/// Renders on options.where. Throws std::invalid_argument for options or scenes that cannot be right; the
/// message names what; std::runtime_error where the device cannot be used; wfpg::file_error where a file to
/// begin with is not one, or not this rendering's. `progress` may be empty.
render_result render(const scene& scene, const render_options& options, const progress_callback& progress);

/// Renders on a policy, whatever options.where says, with the ray caster of an Accelerated, which is made
/// from the policy, the scene and its arrays there. render_impl.hpp defines it. Throws std::invalid_argument
/// for Open PGL's methods.
template <class Accelerated, class Exec>
render_result render_on(const Exec& exec, const scene& scene, const render_options& options,
                        const progress_callback& progress);

/// Renders on CPUs with Embree: by TBB, by OpenMP, and on one thread. The last two throw std::runtime_error
/// where this was built for TBB alone.
render_result render_on_tbb(const scene& scene, const render_options& options,
                            const progress_callback& progress);
render_result render_on_omp(const scene& scene, const render_options& options,
                            const progress_callback& progress);
render_result render_on_seq(const scene& scene, const render_options& options,
                            const progress_callback& progress);

/// The same on a GPU, with rays cast by the renderer's own hierarchy or by OptiX. Throws std::runtime_error
/// where there is none, or where this was built without.
render_result render_on_cuda(const scene& scene, const render_options& options,
                             const progress_callback& progress);
render_result render_on_optix(const scene& scene, const render_options& options,
                              const progress_callback& progress);

/// The same on exec::tbb, guided by Open PGL. Throws std::runtime_error where this was built without.
render_result render_with_openpgl(const scene& scene, const render_options& options,
                                  const progress_callback& progress);

/// False where this was built without Open PGL.
bool has_openpgl();

}  // namespace render
