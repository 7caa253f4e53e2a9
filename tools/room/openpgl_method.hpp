// Open PGL in the analytic room, with the origins and random numbers of wfpg's paths. Its first sample draws
// from the cosine, and all others half and half from its field and the cosine.
#pragma once

#include "places.hpp"
#include "wfpg_method.hpp"

#include <openpgl/cpp/OpenPGL.h>

#include <vector>

namespace room {

inline pgl_vec3f to_pgl(vec3 v) {
  return {v.x, v.y, v.z};
}

/// A field of Open PGL, which learns from paths of its own.
class openpgl_method {
 public:
  /// `samples_a_leaf`: larger leaves are split.
  openpgl_method(const wall_light& light, std::size_t paths, PGL_DIRECTIONAL_DISTRIBUTION_TYPE directional,
                 std::size_t samples_a_leaf)
      : light_(light), paths_(paths), field_(&device_, field_config(directional, samples_a_leaf).config) {
    field_.SetSceneBounds({{-0.01f, -0.01f, -0.01f}, {1.01f, 1.01f, 1.01f}});
  }

  /// Makes and learns the paths of one sample.
  void train(std::uint64_t seed) {
    const path_numbers numbers{seed};
    openpgl::cpp::SurfaceSamplingDistribution here(&field_);
    for (std::uint32_t path = 0; path < paths_; ++path) {
      const wall_point from = numbers.origin(path);
      const vec3 normal = normal_of(from.wall);
      const lambert bsdf{normal};
      const vec2 technique = numbers(path, 0), u = numbers(path, 1);
      const bool guides = find(here, from);
      const vec3 direction =
          guides && technique.x < 0.5f ? from_pgl(here.Sample({u.x, u.y})) : bsdf.sample(normal, u).direction;
      if (!(glm::dot(direction, normal) > 0.0f)) continue;
      const float cosine = bsdf.pdf(normal, direction);
      const float pdf = guides ? 0.5f * (here.PDF(to_pgl(direction)) + cosine) : cosine;
      const wall_point at = hit_from(from, direction);
      openpgl::cpp::SampleData sample{};
      sample.position = {from.position.x, from.position.y, from.position.z};
      sample.direction = to_pgl(direction);
      sample.weight = light_.radiance(at) / pdf;
      sample.pdf = pdf;
      sample.distance = glm::distance(at.position, from.position);
      storage_.AddSample(sample);
    }
    field_.Update(storage_);
    storage_.Clear();
  }
  /// Variances at places. `unguided` becomes the number of places that the field does not know.
  variances measure_at(const std::vector<wall_point>& places, std::size_t& unguided) {
    unguided = 0;
    openpgl::cpp::SurfaceSamplingDistribution here(&field_);
    std::size_t last = ~std::size_t(0);
    bool guides = false;
    return measure(light_, places, [&](std::size_t i, vec3 direction) {
      if (i != last) {
        guides = find(here, places[i]);
        unguided += guides ? 0 : 1;
        last = i;
      }
      const vec3 normal = normal_of(places[i].wall);
      return guides ? here.PDF(to_pgl(direction)) : lambert{normal}.pdf(normal, direction);
    });
  }

 private:
  struct field_config {
    openpgl::cpp::FieldConfig config;
    field_config(PGL_DIRECTIONAL_DISTRIBUTION_TYPE directional, std::size_t samples_a_leaf) {
      config.Init(PGL_SPATIAL_STRUCTURE_KDTREE, directional, true, samples_a_leaf);
      config.SetUseKnnLookup(false);  // the nearest regions may be on other walls
    }
  };

  static vec3 from_pgl(pgl_vec3f v) { return glm::normalize(vec3(v.x, v.y, v.z)); }
  bool find(openpgl::cpp::SurfaceSamplingDistribution& here, const wall_point& at) const {
    float u = 0.0f;  // chooses among neighbours in a look-up of several
    if (!here.Init(&field_, to_pgl(at.position), u)) return false;
    if (here.SupportsApplyCosineProduct()) here.ApplyCosineProduct(to_pgl(normal_of(at.wall)));
    return true;
  }

  wall_light light_;
  std::size_t paths_;
  openpgl::cpp::Device device_{PGL_DEVICE_TYPE_CPU_8};
  openpgl::cpp::Field field_;
  openpgl::cpp::SampleStorage storage_;
};

}  // namespace room
