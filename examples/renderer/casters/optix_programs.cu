// OptiX's device programs, one for each query of a batch of rays. Traversal leaves its answer in the hit
// object. No programs for hits and misses and no payload are needed.
#include "casters/optix_parameters.hpp"
#include "scene/device_scene.hpp"

#include <wfpg/base/math.hpp>

#include <optix.h>

extern "C" {
__constant__ render::optix_parameters parameters;
}

namespace {

/// Whether the ray hits anything inside (t_min, t_max). The hit object then has the hit.
__device__ __forceinline__ bool hits(const wfpg::ray& ray, unsigned flags) {
  using wfpg::is_finite;
  // OptiX's behaviour is undefined for numbers that are not finite and for negative distances.
  const float t_min = fmaxf(ray.t_min, 0.0f), t_max = fminf(ray.t_max, wfpg::ray().t_max);
  const bool in_order = ray.t_min < ray.t_max && t_min < t_max;
  if (!in_order || !is_finite(ray.origin) || !is_finite(ray.direction)) return false;
  optixTraverse(parameters.tree, make_float3(ray.origin.x, ray.origin.y, ray.origin.z),
                make_float3(ray.direction.x, ray.direction.y, ray.direction.z), t_min, t_max, 0.0f,
                OptixVisibilityMask(255), flags, 0, 0, 0);
  return optixHitObjectIsHit();
}

template <class T>
__device__ __forceinline__ T& answer(unsigned i) {
  return static_cast<T*>(parameters.answers)[i];
}

}  // namespace

extern "C" __global__ void __raygen__intersect() {
  const unsigned i = optixGetLaunchIndex().x;
  render::triangle_hit found;
  if (hits(parameters.rays[i], OPTIX_RAY_FLAG_DISABLE_ANYHIT))
    found = {optixHitObjectGetPrimitiveIndex(), __uint_as_float(optixHitObjectGetAttribute_0()),
             __uint_as_float(optixHitObjectGetAttribute_1())};
  answer<render::triangle_hit>(i) = found;
}

extern "C" __global__ void __raygen__occluded() {
  const unsigned i = optixGetLaunchIndex().x;
  const unsigned flags = OPTIX_RAY_FLAG_TERMINATE_ON_FIRST_HIT | OPTIX_RAY_FLAG_DISABLE_ANYHIT |
                         OPTIX_RAY_FLAG_DISABLE_CLOSESTHIT;
  answer<std::uint32_t>(i) = hits(parameters.rays[i], flags) ? 1u : 0u;
}

extern "C" __global__ void __raygen__cast() {
  const unsigned i = optixGetLaunchIndex().x;
  wfpg::ray_hit found{-1.0f, parameters.environment};
  if (hits(parameters.rays[i], OPTIX_RAY_FLAG_DISABLE_ANYHIT)) found = {optixHitObjectGetRayTmax(), 0.0f};
  answer<wfpg::ray_hit>(i) = found;
}
