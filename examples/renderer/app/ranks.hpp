// Several ranks that render one picture: how they share its waves, and how they agree.
#pragma once

#include "app/render.hpp"
#include "scene/scene.hpp"
#include "tracer/wave_share.hpp"

#include <wfpg/ranks/communicator.hpp>

namespace render {

/// Samples of a pixel in one wave: what the ranks share.
inline std::uint32_t samples_of_wave(const render_options& options) {
  return options.split == rank_split::samples ? static_cast<std::uint32_t>(options.samples_a_wave) : 1u;
}

/// This rank's part of each wave. Precondition: options are complete.
inline wave_share share_of(const render_options& options) {
  const std::size_t pixels =
      static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height);
  if (!options.ranks) return wave_share::all_of(pixels);
  return wave_share::part_of(pixels, samples_of_wave(options), options.ranks->rank(), options.ranks->size());
}

/// Whether and why a rank ends the rendering after a wave.
struct wave_end {
  bool is_spent, is_stopped;
};

/// All ranks end where one of them does.
inline wave_end agree(wfpg::communicator* ranks, wave_end own) {
  if (!ranks) return own;
  std::uint32_t flags[2] = {own.is_spent, own.is_stopped};
  ranks->all_reduce_max(wfpg::array_view<std::uint32_t>(flags, 2));
  return {flags[0] != 0, flags[1] != 0};
}

/// Throws std::invalid_argument for options that ranks cannot share; the message names what. `options` are
/// complete, but for that.
void require_shared(const render_options& options);

/// Throws wfpg::rank_error where another rank has another scene, other options, another kind of device, or
/// resumes or loads other bytes. Throws wfpg::file_error where a file cannot be read.
void require_same_rendering(const scene& scene, const render_options& options);

}  // namespace render
