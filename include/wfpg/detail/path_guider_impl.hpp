// Implementation of path_guider.hpp.
#pragma once

#include <wfpg/path_guider.hpp>

namespace wfpg {

// Moves this guider's members to a local one first, which destroys them as a whole. The memory resource must
// outlive its buffers. Assigning member by member would free the resource before them.
template <class Exec, class Guide>
path_guider<Exec, Guide>& path_guider<Exec, Guide>::operator=(path_guider&& other) {
  if (this == &other) return *this;
  const path_guider old(std::move(*this));
  options_ = std::move(other.options_);
  clock_ = other.clock_;
  working_memory_ = std::move(other.working_memory_);
  exec_ = other.exec_;
  guide_ = std::move(other.guide_);
  needs_ = other.needs_;
  recorder_ = std::move(other.recorder_);
  shared_counters_ = std::move(other.shared_counters_);
  rests_ = other.rests_;
  samples_ = other.samples_;
  warm_up_end_ = other.warm_up_end_;
  recorded_ = other.recorded_;
  rests_now_ = other.rests_now_;
  lights_rest_now_ = other.lights_rest_now_;
  probes_now_ = other.probes_now_;
  weight_ = other.weight_;
  measured_ = other.measured_;
  gain_ = other.gain_;
  compared_ = other.compared_;
  return *this;
}

// The version first: others may have other items.
template <class Exec, class Guide>
void path_guider<Exec, Guide>::join_ranks(float least_gain) {
  agreed_items version;
  version.add("the version of wfpg",
              std::uint64_t(1000000 * WFPG_VERSION_MAJOR + 1000 * WFPG_VERSION_MINOR + WFPG_VERSION_PATCH));
  version.check(exec_, *options_.ranks);
  agreed_items items;
  items.add("the kind of policy", std::uint64_t(Exec::warps_per_block > 1));
  detail::add_options(items, options_);
  items.add("least_gain, or the number of triangles", least_gain);
  if constexpr (Guide::joins_ranks) guide_.agree(exec_, items);
  items.check(exec_, *options_.ranks);
  detail::require_all_paths(exec_, options_);
}

// Three numbers decide which paths are recorded: the sample's number, the seed, and the end of the warm-up. A
// guide file has them all but the seed. So a loaded guider with the saved one's seed records the paths that
// the saved one would have recorded.
template <class Exec, class Guide>
void path_guider<Exec, Guide>::begin_sample() {
  const std::uint32_t sample = samples_ + 1;
  rests_now_ = rests_.rests(sample);
  probes_now_ = rests_.probes(sample);
  weight_ = rests_.weight();
  const bool is_measured = probes_now_ || rests_.is_unguided(sample) || rests_.compares(sample);
  recorded_ = !rests_now_ && (is_measured || is_recorded(number_of(sample)));
  // Samples that are compared record the same paths, and those that probe record no others.
  const std::uint64_t chosen = is_measured ? seed_of(0) : seed_of(sample);
  recorder_.begin_sample(exec_, static_cast<std::uint32_t>(chosen), recorded_,
                         probes_now_ ? compared_.rarer : 0);
  lights_rest_now_ = rests_now_ && rests_.lights_rest(gain_);
  if (!rests_now_)
    guide_.begin_sample(at(sample));
  else if (!lights_rest_now_)
    guide_.begin_rest(at(sample));
  measured_ = false;
  samples_ = sample;  // last, with the count: a call that threw is made again for the same sample
  rests_.count(sample);
}

// The guide reads and clears the recorder. A sample that is not recorded has nothing to learn from, but the
// guide may still have values of earlier samples to publish.
template <class Exec, class Guide>
void path_guider<Exec, Guide>::end_sample() {
  if (recorded_) {
    // The stage ends with this block, before the next one begins.
    const auto timed = clock_.time(stage::record);
    recorder_.close_paths(exec_);
    measure();
    guide_.learn(now(), recorder_);
  }
  const auto timed = clock_.time(stage::cache);
  if (!rests_now_)
    guide_.update(now());
  else if (!lights_rest_now_)
    guide_.end_rest(now());
  if (!options_.ranks) return;
  detail::rank_exchange<Exec> all(*options_.ranks);
  shared_counters_.add_to(exec_, all, detail::counters_in_a_row<std::uint32_t>{recorder_.counters().data()});
  all.run(exec_);
}

// Runs before the guide learns, so that the cache does not have the paths that are measured. Once a sample:
// an end_sample() that threw is called again, and would compare the sample with itself.
template <class Exec, class Guide>
void path_guider<Exec, Guide>::measure() {
  if constexpr (Guide::measures_gain) {
    if (measured_ || guide_.empty()) return;
    if (rests_.is_unguided(samples_)) {
      const std::uint32_t number = rests_.unguided_number(samples_);
      const guiding_gain unguided = guide_.keep_unguided(exec_, recorder_, compared_, number);
      rests_.see_unguided(samples_, unguided, detail::all_paths_of(options_));
    } else if (rests_.compares(samples_) && is_guided(samples_)) {
      gain_ = guide_.gain(exec_, recorder_, compared_).mean_with(gain_);
      rests_.decide(samples_, gain_);
    }
    measured_ = true;
  }
}

// Checks what prepare() and sample_directions() have in common. The latter checks `Random` and its outputs,
// too.
template <class Exec, class Guide>
template <class Surfaces, class Random, class Caster>
void path_guider<Exec, Guide>::check(const wave<Surfaces, Random>& w, const Caster&) const {
  static_assert(is_surfaces_v<Surfaces>,
                "surfaces: needs wfpg::surface<Bsdf> operator()(std::uint32_t) const");
  static_assert(is_ray_caster_v<Caster, Exec>,
                "caster: needs ray_hit operator()(const ray&) const, or cast(exec, rays, hits) const");
  require(w.ray_count <= *options_.max_rays, "ray_count", w.ray_count, "at most max_rays");
}

// Checks sizes on the host before it launches anything. There are three ways to sample a wave: by the guide's
// own kernels, from its view, or from BSDFs alone. The last is chosen on the host, so that unguided waves run
// a kernel without the guide's code.
template <class Exec, class Guide>
template <class Surfaces, class Random, class Caster, class Queries>
void path_guider<Exec, Guide>::sample_directions(const wave<Surfaces, Random>& w, const Caster& caster,
                                                 array_view<sampled_direction> directions,
                                                 const Queries& queries) {
  check(w, caster);
  static_assert(is_bsdf_v<bsdf_of_t<Surfaces>>,
                "the BSDF needs eval, pdf, sample, is_delta and transmits, all const");
  static_assert(is_random_v<Random>, "random: needs vec2 operator()(std::uint32_t, std::uint32_t) const");
  require(directions.size() >= w.ray_count, "size of directions", directions.size(), "ray_count or more");
  if constexpr (!std::is_same_v<Queries, no_queries>)
    require(queries.densities.size() >= w.ray_count, "size of densities", queries.densities.size(),
            "ray_count or more");

  // The sampler samples one ray from any mixture. A guide with `samples_waves` calls it in its own kernels.
  const sample_ray<Surfaces, Random, Queries> sampler{w.surfaces, w.random, queries, directions};
  if (rests_now_) {
    const auto timed = clock_.time(stage::sample);
    exec_.for_each(w.ray_count, sample_bsdf<decltype(sampler)>{sampler, {}});
    return;
  }
  if constexpr (Guide::samples_waves)
    guide_.sample_wave(now(w.depth), w, caster, sampler);
  else {
    const view_type view = prepare(w, caster);
    const auto timed = clock_.time(stage::sample);
    if (now(w.depth).guided)
      exec_.for_each(w.ray_count, sample_guide_view<decltype(sampler), view_type>{sampler, view});
    else
      exec_.for_each(w.ray_count, sample_bsdf<decltype(sampler)>{sampler, {}});
  }
}

// Counts as the stage "fields"; the guide may time stages of its own inside, such as "bin".
template <class Exec, class Guide>
template <class Surfaces, class Random, class Caster>
typename path_guider<Exec, Guide>::view_type path_guider<Exec, Guide>::prepare(
    const wave<Surfaces, Random>& w, const Caster& caster) {
  check(w, caster);
  if constexpr (Guide::measures_gain)
    if (rests_now_) return {};
  const auto timed = clock_.time(stage::fields);
  return guide_.prepare(now(w.depth), w, caster);
}

// A wave of as many rays as there are paths, so that a ray's index is its path's. Rays may be inactive: that
// costs 4 bytes each. A vertex is used once, since a stale one would make fields that no ray samples.
template <class Exec, class Guide>
template <class Caster>
typename path_guider<Exec, Guide>::view_type path_guider<Exec, Guide>::prepare(std::uint32_t depth,
                                                                               const Caster& caster) {
  static_assert(Guide::records_paths, "Guide: prepare(depth, caster) needs a guide that reads paths");
  // Without it the recorder has no place for vertices, and every wave would be empty.
  require(options_.records_waves, "records_waves", "false",
          "true, for prepare(depth, caster) to know the wave");
  wave_recorder<Exec>& vertices = recorder_.wave();
  const auto view = prepare(
      wave<recorded_surfaces, no_random>{
          depth, vertices.paths(), recorded_surfaces{vertices.states(), vertices.places(), depth}, {}},
      caster);
  vertices.forget(exec_, depth);
  return view;
}

// Fills in the facade's own counts. The guide adds those of its fields and its cache in report().
template <class Exec, class Guide>
guider_statistics path_guider<Exec, Guide>::statistics() const {
  guider_statistics result;
  result.samples = samples_;
  // Counted from unguided_samples on: the guide is empty in all samples or in none.
  const bool begun = samples_ > options_.unguided_samples && !guide_.empty();
  const std::uint32_t after = begun ? samples_ - options_.unguided_samples : 0;
  result.guided_samples = after - min(after, rests_.rested());
  result.rested_samples = rests_.rested();
  result.gain = gain_;
  result.dropped_vertices = recorder_.dropped(exec_);
  result.path_gaps = recorder_.gaps(exec_);
  result.seconds = clock_.report();
  guide_.report(exec_, result);
  return result;
}

// Two parts beside the guide's. "paths" is the recorder; "scratch" is retained memory that no buffer uses
// now.
template <class Exec, class Guide>
memory_report path_guider<Exec, Guide>::memory() const {
  memory_report report{guide_.memory()};
  report.parts.push_back({"paths", recorder_.bytes() + shared_counters_.bytes(), false});
  report.parts.push_back({"scratch", working_memory_->bytes() - working_memory_->used_bytes(), false});
  return report;
}

}  // namespace wfpg
