// A guider's state to and from a guide file: the facade's own counters around the sections of its guide.
#pragma once

#include <wfpg/detail/guide_sections.hpp>
#include <wfpg/path_guider.hpp>

#include <array>

namespace wfpg::detail {

/// To and from the members of a path_guider that a guide file holds.
struct state_access {
  template <class Exec, class Guide>
  static section_writer counts_to_bytes(const path_guider<Exec, Guide>& guider) {
    section_writer bytes;
    bytes.put(guider.samples_);
    bytes.put(guider.warm_up_end_);
    put_rests(guider, bytes);
    guide_sections::put_build(guider.guide_, bytes);
    bytes.put(guider.recorder_.dropped(guider.exec_));
    guide_sections::put_depths(guider.exec_, guider.guide_, bytes);
    return bytes;
  }

  /// Options that decide which paths are compared, and when: where one differs, a loaded guide never rests.
  template <class Exec, class Guide>
  static std::uint32_t comparison_key(const path_guider<Exec, Guide>& guider) {
    const auto& o = guider.options_;
    std::uint64_t key = hash(0, all_paths_of(o));
    key = hash(key, o.max_depth);
    key = hash(key, o.deposits_per_leaf.value_or(0));
    key = hash(key, o.seed);
    key = hash(key, o.unguided_samples);
    const float unset = Exec::warps_per_block > 1 ? 0.25f : 0.5f;  // the kinds of policies differ
    const float least = guider.guide_.measures() ? o.least_gain.value_or(unset) : -1.0f;
    return static_cast<std::uint32_t>(hash(key, float_bits(least)));
  }
  template <class Exec, class Guide>
  static void put_rests(const path_guider<Exec, Guide>& guider, section_writer& bytes) {
    bytes.put(comparison_key(guider));
    const rest_schedule::state state = guider.rests_.saved();
    bytes.put(state.unguided);
    bytes.put(state.rested);
    bytes.put(state.takes_part);
    bytes.put(state.weight);
    bytes.put(state.least_gain);
    bytes.put(state.first_unguided);
    bytes.put(state.first_noise);
    bytes.put(state.light_gain);
    put_gain(guider.gain_, bytes);
  }
  // The numbers of a gain, in the order of the file. `Gain`: guiding_gain, const or not.
  template <class Gain>
  static auto numbers_of(Gain& gain) {
    return std::array{&gain.unguided_mean,     &gain.guided_mean,      &gain.unguided_variance,
                      &gain.guided_variance,   &gain.typical_unguided, &gain.typical_guided,
                      &gain.unguided_vertices, &gain.guided_vertices,  &gain.typical_error};
  }
  static void put_gain(const guiding_gain& gain, section_writer& bytes) {
    bytes.put(gain.paths);
    for (const double* const value : numbers_of(gain)) bytes.put(*value);
  }
  static guiding_gain take_gain(section_reader& bytes) {
    guiding_gain gain;
    gain.paths = bytes.get<std::uint64_t>();
    for (double* const value : numbers_of(gain)) {
      *value = bytes.get<double>();
      bytes.require(is_finite(*value) && *value >= 0.0 && *value <= 1.0e30, "has a gain out of range");
    }
    return gain;
  }
  template <class Exec, class Guide>
  static void take_rests(section_reader& bytes, path_guider<Exec, Guide>& guider) {
    const auto key = bytes.get<std::uint32_t>();
    rest_schedule::state state;
    state.unguided = bytes.get<std::uint32_t>();
    state.rested = bytes.get<std::uint32_t>();
    state.takes_part = bytes.get<std::uint32_t>();
    state.weight = bytes.get<float>();
    state.least_gain = bytes.get<float>();
    state.first_unguided = bytes.get<std::uint32_t>();
    state.first_noise = bytes.get<float>();
    state.light_gain = bytes.get<float>();
    const guiding_gain gain = take_gain(bytes);
    bytes.require(state.rested <= guider.samples_, "rests in samples that are to come");
    if (key != comparison_key(guider)) return guider.rests_.restore_other(state.rested);
    bytes.require(guider.rests_.restore(guider.samples_, state), "has rests that no guider has");
    guider.rests_now_ = guider.rests_.rests(guider.samples_);
    guider.gain_ = gain;
    guider.lights_rest_now_ = guider.rests_now_ && guider.rests_.lights_rest(gain);
  }

  template <class Exec, class Guide>
  static void restore_counts(section_reader bytes, path_guider<Exec, Guide>& guider) {
    guider.samples_ = bytes.get<std::uint32_t>();
    bytes.require(guider.samples_ < 0x80000000u, "has samples without end");
    guider.warm_up_end_ = bytes.get<std::uint32_t>();
    take_rests(bytes, guider);
    bytes.require(
        guider.warm_up_end_ >= recording_needs::warm_up_samples &&
            guider.warm_up_end_ <= guider.number_of(guider.samples_) + recording_needs::warm_up_samples,
        "warms up until after samples that are to come");
    guide_sections::take_build(bytes, guider.guide_);
    const auto dropped = bytes.get<std::uint32_t>();
    guide_sections::take_depths(guider.exec_, bytes, guider.guide_);
    guider.exec_.copy_from_host(guider.recorder_.counters_.data(), &dropped, sizeof dropped);
    guider.shared_counters_.restart(guider.exec_,
                                    counters_in_a_row<std::uint32_t>{guider.recorder_.counters().data()});
  }

  template <class Exec, class Guide>
  static void save(const path_guider<Exec, Guide>& guider, file_writer& file) {
    const Exec& exec = guider.exec_;
    file.section("options", options_to_bytes(guider.options_, guider.guide_.octree().resolution()));
    guide_sections::save_scene(exec, guider.guide_, file);
    file.section("counts", counts_to_bytes(guider));
    guide_sections::save_fields(exec, guider.guide_, file);
    guide_sections::save_lights(exec, guider.guide_, file);
    guide_sections::save_paths(exec, guider.guide_, file);
    file.end();
  }

  /// `mesh`: what the octree must be of; null where that is not known.
  template <class Guide, class Exec>
  static path_guider<Exec, Guide> load(const Exec& exec, file_reader& file,
                                       const typename Guide::options_type& options,
                                       const triangle_mesh_view* mesh) {
    check_options(file, options);
    voxel_fragments<Exec> fragments =
        fragments_from_bytes(exec, file.section("octree"), options.octree_resolution);
    if (mesh && !is_octree_of(exec, fragments, voxelize(exec, *mesh, options.octree_resolution)))
      file.fail("is of another scene: its octree is not that of the triangles");
    path_guider<Exec, Guide> guider(exec, std::move(fragments), options);
    guide_sections::load_scene(guider.exec_, file, guider.guide_);
    restore_counts(file.section("counts"), guider);
    guide_sections::load_fields(guider.exec_, file, guider.number_of(guider.samples_), guider.guide_);
    guide_sections::load_lights(guider.exec_, file, guider.guide_);
    guide_sections::load_paths(guider.exec_, file, guider.guide_);
    file.end();
    if (options.ranks) {
      agreed_items items;
      items.add("the guide that they load", file.checksums());
      items.check(guider.exec_, *options.ranks);
    }
    return guider;
  }
};

}  // namespace wfpg::detail
