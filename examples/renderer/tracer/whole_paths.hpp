// Path tracing on CPUs: each path goes from its first vertex to its end in one kernel.
// Source: the loop of a megakernel, as against a wavefront's (Laine, Karras, Aila 2013); GPUs need the
// latter.
#pragma once

#include "tracer/path_kernels.hpp"

#include <wfpg/guide/sample_rays.hpp>
#include <wfpg/host/recorded_runs.hpp>

#include <cstddef>
#include <type_traits>

namespace render {

/// The stages of paths that no guide samples. `Queries` is wfpg::density_queries, or wfpg::no_queries without
/// next-event estimation.
template <class Caster, class Queries>
struct path_stages {
  static constexpr bool has_queries = !std::is_same_v<Queries, wfpg::no_queries>;

  trace_paths<inline_answers<Caster>, wfpg::no_path_recorder> trace;
  query_lights<inline_answers<Caster>> query;
  wfpg::sample_bsdf<wfpg::sample_ray<queued_surfaces, queued_random, Queries>> sample;
  shade_paths<wfpg::no_path_recorder> shade;

  /// Goes through the stages of all depths, until the path ends.
  void follow(std::size_t path, wave_position at) {
    for (; at.depth < at.max_depth; ++at.depth) {
      trace.at = query.at = shade.at = at;
      trace(path);
      if (!trace.paths[path].active) return;
      if constexpr (has_queries) query(path);
      sample.sampler.random.first_dimension = at.first_dimension() + dimension::direction;
      sample(path);
      shade(path);
      if (!trace.paths[path].active) return;
    }
  }
};

/// Follows each path of a run by itself. Each path then computes what it does in a wave, from the same random
/// numbers, so that the picture has the same bits where compilers do not contract products and sums. A path's
/// state stays in a CPU's nearest cache, there is no sort, and threads wait for each other once a sample.
template <class Caster, class Queries>
struct follow_paths {
  path_stages<Caster, Queries> stages;
  bool all = true;                    ///< follows all paths
  wfpg::recorded_runs left_out = {};  ///< otherwise none of these

  template <class Run>
  [[gnu::flatten]] void operator()(const Run& run) const {
    path_stages<Caster, Queries> s = stages;
    const wave_position at = s.trace.at;
    // Said again, so that the compiler leaves out look-ups in queues.
    s.trace.queue.all = s.query.queue.all = s.shade.queue.all = true;
    s.sample.sampler.surfaces.queue.all = s.sample.sampler.random.queue.all = true;
    run.for_each([&](std::size_t path, int) {
      if (all || !left_out.includes(static_cast<std::uint32_t>(path))) s.follow(path, at);
    });
  }
};

}  // namespace render
