// Embree, version 3 or 4, as the ray caster of the renderer and of the guider.
#pragma once

#include "casters/cut_outs.hpp"

#include <wfpg/host/ray_caster.hpp>

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <cstddef>
#include <cstring>
#include <memory>

namespace render {

/// Casts rays, from any thread. Trivially copyable. Valid while its embree_scene lives.
class embree_caster {
 public:
  embree_caster(RTCScene scene, const scene_view* cut_outs, const environment_view& environment)
      : scene_(scene), cut_outs_(cut_outs), environment_(environment) {}

  /// The guider's interface: distance, or the environment's luminance.
  wfpg::ray_hit operator()(const wfpg::ray& ray) const {
    const hit found = nearest(ray);
    if (!found.triangle.is_hit()) return {-1.0f, wfpg::luminance(environment_.radiance(ray.direction))};
    return {found.distance, 0.0f};
  }

  // Inline, as cast_through_cut_outs() is.
  [[gnu::always_inline]] triangle_hit intersect(const wfpg::ray& ray) const { return nearest(ray).triangle; }

  /// Whether anything is hit inside (t_min, t_max).
  bool occluded(const wfpg::ray& ray) const {
    if (cut_outs_) return nearest(ray).triangle.is_hit();
    RTCRay shadow{};
    write(ray, shadow);
    ask(rtcOccluded1, shadow);
    return shadow.tfar < 0.0f;
  }

 private:
  struct hit {
    triangle_hit triangle;
    float distance = 0.0f;
  };

  [[gnu::always_inline]] hit nearest(const wfpg::ray& ray) const {
    return cast_through_cut_outs(cut_outs_, ray, [this](const wfpg::ray& r) { return cast(r); });
  }

  /// Writes a ray whose other members are 0. Embree reads it in pieces of 16 bytes, and so it is written. A
  /// read of several smaller stores would wait until all earlier ones have reached the cache.
  static void write(const wfpg::ray& ray, RTCRay& result) {
    using four_floats = float __attribute__((vector_size(16)));
    static_assert(offsetof(RTCRay, tnear) == 12 && offsetof(RTCRay, dir_x) == 16 &&
                  offsetof(RTCRay, time) == 28);
    const four_floats pieces[2] = {{ray.origin.x, ray.origin.y, ray.origin.z, ray.t_min},
                                   {ray.direction.x, ray.direction.y, ray.direction.z, 0.0f}};
    std::memcpy(&result, pieces, sizeof pieces);
    result.tfar = ray.t_max;
    result.mask = 0xffffffffu;
  }

  /// Calls Embree with default arguments, which version 3 needs explicitly.
  template <class Call, class Ray>
  void ask(Call call, Ray& ray) const {
#if RTC_VERSION_MAJOR >= 4
    call(scene_, &ray, nullptr);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    call(scene_, &context, &ray);
#endif
  }

  hit cast(const wfpg::ray& ray) const {
    RTCRayHit result{};
    write(ray, result.ray);
    result.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    ask(rtcIntersect1, result);
    if (result.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
    return {{result.hit.primID, result.hit.u, result.hit.v}, result.ray.tfar};
  }

  RTCScene scene_;
  const scene_view* cut_outs_;
  environment_view environment_;
};

/// Owns Embree's device and acceleration structure.
class embree_scene {
 public:
  static constexpr const char* name = "embree";

  /// Builds with all the machine's threads. Throws std::runtime_error if Embree fails. Precondition: the
  /// scene has neither holes nor a sky.
  explicit embree_scene(const scene& host);
  /// Builds a scene that may have holes and a sky. `arrays` are the scene's, in host memory, and must outlive
  /// this.
  template <class Exec>
  embree_scene(const Exec&, const scene& host, const scene_view& arrays) : embree_scene(host) {
    environment_ = arrays.environment;
    if (has_cut_outs(host)) cut_outs_ = std::make_unique<const scene_view>(arrays);
  }

  embree_caster caster() const { return {scene_.get(), cut_outs_.get(), environment_}; }

 private:
  struct release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };

  std::unique_ptr<RTCDeviceTy, release> device_;
  std::unique_ptr<RTCSceneTy, release> scene_;
  std::unique_ptr<const scene_view> cut_outs_;
  environment_view environment_;
};

}  // namespace render
