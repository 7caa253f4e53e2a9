// Casting rays, behind an interface: what answers them is private to it.
#pragma once

#include "device.hpp"
#include "scene/device_scene.hpp"

#include <utility>

namespace kernels {

using render::triangle_hit;
using wfpg::ray;

/// Answers rays in batches. Pointers are to the device's memory, and have n elements.
template <class Device>
class geometry {
 public:
  virtual ~geometry() = default;
  /// Finds each ray's first hit.
  virtual void trace(const ray* rays, std::size_t n, triangle_hit* hits) const = 0;
  /// Finds whether anything lies inside (t_min, t_max) of each ray; a ray with t_max = 0 is not asked.
  virtual void occluded(const ray* rays, std::size_t n, std::uint32_t* hidden) const = 0;
};

template <class Caster>
struct trace_rays {
  Caster caster;
  const ray* rays;
  triangle_hit* hits;

  KERNELS_BOTH void operator()(std::size_t i) const { hits[i] = caster.intersect(rays[i]); }
};

template <class Caster>
struct find_occluded {
  Caster caster;
  const ray* rays;
  std::uint32_t* hidden;

  KERNELS_BOTH void operator()(std::size_t i) const {
    hidden[i] = rays[i].t_max > 0.0f && caster.occluded(rays[i]) ? 1u : 0u;
  }
};

/// Geometry of an acceleration structure of the renderer's: an embree_scene or a bvh_scene.
template <class Device, class Accelerated>
class accelerated_geometry : public geometry<Device> {
 public:
  accelerated_geometry(const render::scene& host, const render::scene_view& arrays)
      : accelerated_(typename Device::policy(), host, arrays) {}

  void trace(const ray* rays, std::size_t n, triangle_hit* hits) const override {
    launch<Device>(n, trace_rays<caster>{accelerated_.caster(), rays, hits});
  }
  void occluded(const ray* rays, std::size_t n, std::uint32_t* hidden) const override {
    launch<Device>(n, find_occluded<caster>{accelerated_.caster(), rays, hidden});
  }

 private:
  using caster = decltype(std::declval<const Accelerated&>().caster());

  Accelerated accelerated_;
};

}  // namespace kernels
