// OptiX as the batch ray caster of the renderer and of the guider, on the CUDA policy.
#pragma once

#include "casters/optix_tracer.hpp"
#include "scene/device_scene.hpp"

#include <wfpg/base/math.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/cuda.hpp>

#include <cstdint>
#include <memory>
#include <vector>

namespace render {

/// Casts batches of rays in device memory, ordered on the policy's stream. Does not wait. Hits are inside
/// (t_min, t_max), from zero on. A ray that is not finite misses. Trivially copyable. Valid while its
/// optix_scene lives. `hits` and `hidden` have one element a ray.
class optix_caster {
 public:
  optix_caster(const optix_tracer& tracer, float environment) : tracer_(&tracer), environment_(environment) {}

  void intersect(const wfpg::exec::cuda& exec, wfpg::array_view<const wfpg::ray> rays,
                 wfpg::array_view<triangle_hit> hits) const {
    launch(exec, optix_query::intersect, rays, hits.data());
  }

  /// Writes 1 if anything is hit inside (t_min, t_max), else 0.
  void occluded(const wfpg::exec::cuda& exec, wfpg::array_view<const wfpg::ray> rays,
                wfpg::array_view<std::uint32_t> hidden) const {
    launch(exec, optix_query::occluded, rays, hidden.data());
  }

  /// The guider's interface: distance, or the environment's luminance.
  void cast(const wfpg::exec::cuda& exec, wfpg::array_view<const wfpg::ray> rays,
            wfpg::array_view<wfpg::ray_hit> hits) const {
    launch(exec, optix_query::cast, rays, hits.data());
  }

 private:
  template <class T>
  void launch(const wfpg::exec::cuda& exec, optix_query query, wfpg::array_view<const wfpg::ray> rays,
              T* answers) const {
    for (std::size_t first = 0; first < rays.size(); first += optix_tracer::max_rays) {
      const std::size_t count = wfpg::min(rays.size() - first, optix_tracer::max_rays);
      // Each launch has its own parameters, allocated, copied and freed in the stream's order. The vector may
      // be destroyed at once, since a copy from pageable memory has been read when the call returns.
      const std::vector<optix_parameters> one{
          {rays.data() + first, answers + first, environment_, tracer_->tree()}};
      const wfpg::buffer<optix_parameters, wfpg::exec::cuda> parameters(exec, one);
      tracer_->launch(exec.stream(), query, parameters.data(), count);
    }
  }

  const optix_tracer* tracer_;
  float environment_;
};

namespace detail {

/// A position that is not finite becomes the origin.
struct make_finite {
  wfpg::array_view<const vec3> positions;
  vec3* result;
  WFPG_HD void operator()(std::size_t i) const {
    result[i] = wfpg::is_finite(positions[i]) ? positions[i] : vec3(0.0f);
  }
};

/// A triangle with a corner that is not finite or missing collapses, so that no ray hits it.
struct collapse_invalid {
  wfpg::array_view<const vec3> positions;
  wfpg::array_view<const uvec3> triangles;
  uvec3* result;
  WFPG_HD bool valid(std::uint32_t corner) const {
    return corner < positions.size() && wfpg::is_finite(positions[corner]);
  }
  WFPG_HD void operator()(std::size_t i) const {
    const uvec3 t = triangles[i];
    result[i] = valid(t.x) && valid(t.y) && valid(t.z) ? t : uvec3(0u);
  }
};

}  // namespace detail

/// Owns OptiX's pipeline and acceleration structure of a mesh.
class optix_scene {
 public:
  /// Builds on the policy's device and waits. Positions and triangles are device memory and not read later.
  /// Degenerate triangles, and those with corners that are not finite or missing, are never hit.
  /// `environment` is the luminance of rays that miss, W/(m² sr). The policy's stream and memory must outlive
  /// this. Throws wfpg::out_of_memory, wfpg::cuda_error, and std::runtime_error that names what OptiX needs.
  optix_scene(const wfpg::exec::cuda& exec, wfpg::array_view<const vec3> positions,
              wfpg::array_view<const uvec3> triangles, float environment)
      : environment_(environment) {
    if (positions.empty()) triangles = {};
    const wfpg::buffer<vec3, wfpg::exec::cuda> finite(exec, positions.size());
    exec.for_each(positions.size(), detail::make_finite{positions, finite.data()});
    const wfpg::buffer<uvec3, wfpg::exec::cuda> valid(exec, triangles.size());
    exec.for_each(triangles.size(), detail::collapse_invalid{positions, triangles, valid.data()});
    tracer_ = std::make_unique<optix_tracer>(exec.stream(), exec.resource(), finite.view(), valid.view());
  }

  optix_caster caster() const { return {*tracer_, environment_}; }

  /// Bytes of device memory that it keeps.
  std::size_t bytes() const { return tracer_->bytes(); }

 private:
  std::unique_ptr<const optix_tracer> tracer_;
  float environment_;
};

}  // namespace render
