// Embree 3 as the ray caster of the renderer and of the guider.
#pragma once

#include "device_scene.hpp"

#include <wfpg/ray_caster.hpp>

#include <embree3/rtcore.h>

#include <memory>

namespace render {

/// Casts rays, from any thread. Trivially copyable; valid while the embree_scene it is from lives.
class embree_caster {
 public:
  embree_caster(RTCScene scene, float environment) : scene_(scene), environment_(environment) {}

  /// The guider's form: distance, or the environment's luminance.
  wfpg::ray_hit operator()(const wfpg::ray& ray) const {
    const RTCRayHit found = cast(ray);
    if (found.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {-1.0f, environment_};
    return {found.ray.tfar, 0.0f};
  }

  triangle_hit intersect(const wfpg::ray& ray) const {
    const RTCRayHit found = cast(ray);
    if (found.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
    return {found.hit.primID, found.hit.u, found.hit.v};
  }

  /// True where anything lies inside (t_min, t_max).
  bool occluded(const wfpg::ray& ray) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay shadow = convert(ray);
    rtcOccluded1(scene_, &context, &shadow);
    return shadow.tfar < 0.0f;
  }

 private:
  static RTCRay convert(const wfpg::ray& ray) {
    RTCRay result{};
    result.org_x = ray.origin.x;
    result.org_y = ray.origin.y;
    result.org_z = ray.origin.z;
    result.tnear = ray.t_min;
    result.dir_x = ray.direction.x;
    result.dir_y = ray.direction.y;
    result.dir_z = ray.direction.z;
    result.tfar = ray.t_max;
    result.mask = 0xffffffffu;
    return result;
  }

  RTCRayHit cast(const wfpg::ray& ray) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit result{};
    result.ray = convert(ray);
    result.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene_, &context, &result);
    return result;
  }

  RTCScene scene_;
  float environment_;
};

/// Owns Embree's device and acceleration structure.
class embree_scene {
 public:
  static constexpr const char* name = "embree";

  /// Builds with all the machine's threads. Throws std::runtime_error where Embree fails.
  explicit embree_scene(const scene& host);
  template <class Exec>
  embree_scene(const Exec&, const scene& host, const scene_view&) : embree_scene(host) {}

  embree_caster caster() const { return {scene_.get(), environment_}; }

 private:
  struct release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };

  std::unique_ptr<RTCDeviceTy, release> device_;
  std::unique_ptr<RTCSceneTy, release> scene_;
  float environment_ = 0.0f;
};

}  // namespace render
