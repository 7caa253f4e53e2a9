// A scene with a guider that has learnt from some samples, and what its camera sees: the point that each
// pixel's middle hits, its field, its bin. Light that arrives at such a point is traced by brute force.
#pragma once

#include "app/render.hpp"
#include "directions.hpp"
#include "scene/device_scene.hpp"

#include <wfpg/guides/octree/guide_view.hpp>
#include <wfpg/octree/exitance_cache.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace inspect {

/// Of a pixel without a bin.
inline constexpr std::uint32_t no_bin = 0xffffffffu;

/// Bytes that guiding takes.
struct guide_bytes {
  std::size_t field = 0;  ///< of one field
  std::size_t persistent = 0, transient = 0;
};

/// Two pictures of the same light from independent samples, a pixel for each cell; W/(m² sr).
struct incident_light {
  render::image first, second;

  /// The mean of both.
  render::image mean() const;
};

/// Throws std::invalid_argument where the method is not guided by fields, the device is not the CPU, or paths
/// end where the camera looks.
void require_fields(const render::render_options& options);

/// Runs on exec::tbb, with Embree.
class learnt_scene {
 public:
  /// Renders as options say, which are complete. Throws as render::render and require_fields() do. The
  /// scene outlives this.
  learnt_scene(const render::scene& scene, const render::render_options& options,
               const render::progress_callback& progress);
  learnt_scene(const learnt_scene&) = delete;
  learnt_scene& operator=(const learnt_scene&) = delete;
  ~learnt_scene();

  /// What was rendered meanwhile, and what it cost.
  const render::render_result& rendering() const;
  /// A pixel: what its middle hits; not active where that is nothing.
  const std::vector<render::hit_surface>& hits() const;
  /// The fields that the next sample has for these hits; a ray is a pixel.
  const wfpg::guide_view& fields() const;
  /// A pixel: node · orientations + orientation of its field's bin, or no_bin.
  const std::vector<std::uint32_t>& bins() const;
  /// What light leaves each node of the octree.
  wfpg::exitance_cache_view cache() const;
  guide_bytes bytes() const;

  /// Light that arrives at a hit from each of the grid's cells, by path tracing without a guide: `samples` >
  /// 1 paths a cell, half of them for either picture. Paths have as many segments as those of the rendering
  /// have left there.
  incident_light arriving(const render::hit_surface& at, const direction_grid& cells, int samples,
                          const render::progress_callback& progress) const;

 private:
  struct state;
  std::unique_ptr<state> state_;
};

}  // namespace inspect
