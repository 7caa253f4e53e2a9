// A scene with a guider that has learnt from some samples, and the camera's view. Each pixel's centre has a
// hit point, a field and a bin. Incident light at such a point is traced by brute force.
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

/// Bin of a pixel without one.
inline constexpr std::uint32_t no_bin = 0xffffffffu;

/// Memory of the guide.
struct guide_bytes {
  std::size_t field = 0;  ///< of one field
  std::size_t persistent = 0, transient = 0;
};

/// Two pictures of the same light from independent samples, a pixel per cell. W/(m² sr).
struct incident_light {
  render::image first, second;

  /// The mean of both.
  render::image mean() const;
};

/// Throws std::invalid_argument if the method has no fields, the device is not the CPU, or paths end at the
/// camera's hits.
void require_fields(const render::render_options& options);

/// Runs on exec::tbb, with Embree.
class learnt_scene {
 public:
  /// Renders with `options`, which must be complete. Throws as render::render and require_fields() do. The
  /// scene must outlive this.
  learnt_scene(const render::scene& scene, const render::render_options& options,
               const render::progress_callback& progress);
  learnt_scene(const learnt_scene&) = delete;
  learnt_scene& operator=(const learnt_scene&) = delete;
  ~learnt_scene();

  /// The picture rendered so far, and its cost.
  const render::render_result& rendering() const;
  /// Hits of the pixels' centres. Not active if a ray hits nothing.
  const std::vector<render::hit_surface>& hits() const;
  /// The fields of these hits in the next sample. A ray is a pixel.
  const wfpg::guide_view& fields() const;
  /// Per pixel: node · orientations + orientation of its field's bin, or no_bin.
  const std::vector<std::uint32_t>& bins() const;
  /// The radiance that leaves each node of the octree.
  wfpg::exitance_cache_view cache() const;
  guide_bytes bytes() const;

  /// Incident light at a hit from each of the grid's cells, by path tracing without a guide. Each cell gets
  /// `samples` > 1 paths, half of them for each picture. Paths have as many segments as the rendering's have
  /// left there.
  incident_light arriving(const render::hit_surface& at, const direction_grid& cells, int samples,
                          const render::progress_callback& progress) const;

 private:
  struct state;
  std::unique_ptr<state> state_;
};

}  // namespace inspect
