// Records of host_checker: logged in kernels, or read from the recorder. Structs have no padding, which would
// be memory that nobody wrote.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guide/recorded_path.hpp>
#include <wfpg/host/bsdf.hpp>
#include <wfpg/sampling/mixture.hpp>
#include <wfpg/sampling/roulette.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace wfpg::detail {

/// What a host did at a vertex. All zero: nothing was logged.
struct logged_step {
  // Flags. in_full: the mixture has the guide's full fraction. narrow, delta: a narrow lobe, or the delta
  // lobe that drew the direction, should leave it less.
  static constexpr std::uint32_t is_logged = 1, goes_on = 2, delta = 4, guided = 8, in_full = 16, narrow = 32;

  vec3 direction;
  float pdf, expected;  ///< the host's density, and the mixture's
  float scale;          ///< roulette_scale() of this vertex alone
  float throughput, survival;
  std::uint32_t flags;

  bool has(std::uint32_t flag) const { return (flags & flag) != 0; }
};

/// Density of a query. All zero: none was logged.
struct logged_query {
  float pdf, expected;
  WFPG_HD bool is_logged() const { return float_bits(pdf) != 0 || float_bits(expected) != 0; }
};

/// What a path brought to its pixel, luminance. All zero: nothing was logged.
struct logged_light {
  float sum;
  std::uint32_t is_logged;
};

/// Relative difference of two numbers that are at least 0. At least 1 where one of them is something else.
WFPG_HD inline float difference(float a, float b) {
  const bool sound = is_finite(a) && is_finite(b) && a >= 0.0f && b >= 0.0f;
  if (!sound) return 2.0f;
  const float larger = max(a, b);
  return larger > 0.0f ? fabsf(a - b) / larger : 0.0f;
}

// A lobe is narrow where the guide should keep less than this of its fraction. That is a GGX roughness below
// 0.37 where fields resolve 0.5.
inline constexpr float narrow_lobe_part = 2.0f / 3.0f;
// A delta lobe that draws at least this part of the BSDF's samples should leave the guide less, too.
inline constexpr float large_delta_lobe = 0.25f;
// Hosts know alpha better than one density tells. A narrow part of 1/1000 of the samples leaves less than
// this.
inline constexpr float full_fraction = 1.0f - 1.0e-4f;

/// Flags of a step's mixture. `guided`: it has a field.
/// `mirror_pdf`: of the BSDF at normal incidence. `delta`: probability of the delta lobe that drew, or 0.
WFPG_HD inline std::uint32_t guiding_flags(bool guided, const kernel_mixture& mixture, float mirror_pdf,
                                           float delta) {
  if (!guided) return 0;
  const float part = guided_fraction(1.0f, glossy_part::unknown(mirror_pdf), mixture.field.resolved_alpha());
  return logged_step::guided | (part < narrow_lobe_part ? logged_step::narrow : 0u) |
         (delta >= large_delta_lobe ? logged_step::delta : 0u) |
         (mixture.kept >= full_fraction ? logged_step::in_full : 0u);
}

/// A vertex of a recorded path, for the host.
struct checked_vertex {
  // Flags: it is a surface and not a gap; scatter() was called.
  static constexpr std::uint32_t is_surface = 1, has_scattered = 2;

  vec3 position, outgoing, scattered;
  float contribution;  ///< luminance
  std::uint32_t flags;

  bool has(std::uint32_t flag) const { return (flags & flag) != 0; }
};

/// A recorded path, for the host. All bits set: there is no such path.
struct checked_path {
  std::uint32_t path, surfaces, vertices;
};

/// Kernel: copies a path from the recorder, if it is recorded.
struct read_recorded_path {
  path_recorder_view recorder;
  array_view<checked_path> paths;
  array_view<checked_vertex> vertices;  ///< of one path side by side

  WFPG_HD void operator()(std::size_t path) const {
    std::uint32_t place;
    if (!recorder.has_place(path, place)) return;
    const recorded_path recorded(recorder, place);
    paths[place] = {static_cast<std::uint32_t>(path), recorded.surfaces(), recorded.vertices()};
    for (std::uint32_t depth = 0; depth < recorded.vertices(); ++depth) {
      checked_vertex v{vec3(0.0f), vec3(0.0f), vec3(0.0f), luminance(recorded.contribution(depth)), 0};
      if (depth < recorded.surfaces() && !recorded.is_gap(depth)) {
        v.position = recorded.position(depth);
        v.outgoing = recorded.outgoing(depth);
        v.flags = checked_vertex::is_surface;
        if (recorder.records_directions() && recorded.has_scattered(depth)) {
          v.scattered = recorded.direction(depth);
          v.flags |= checked_vertex::has_scattered;
        }
      }
      vertices[std::size_t(place) * recorder.max_depth() + depth] = v;
    }
  }
};

}  // namespace wfpg::detail
