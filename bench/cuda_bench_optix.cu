// Millions of rays a second that OptiX casts on a GPU: the cones of bins, each a whole sphere of directions
// from one point in the order of its field's cells, and the same rays in random order; among small triangles
// that fill the unit cube, and in an empty box. Medians of 20 launches by CUDA's events.
#include "optix_caster.hpp"

#include <wfpg/octahedral_map.hpp>

#include <thrust/iterator/counting_iterator.h>
#include <thrust/transform_reduce.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <vector>

namespace {

using cuda_policy = wfpg::exec::cuda;
using wfpg::uvec3;
using wfpg::vec2;
using wfpg::vec3;
using wfpg::detail::hash;
using wfpg::detail::unit_vec2;

constexpr std::uint32_t bins = 2048, resolution = 128, cells = resolution * resolution;
constexpr std::uint32_t ray_count = bins * cells;  // a power of two, for `shuffled`
constexpr int launches = 20;

struct mesh {
  std::vector<vec3> positions;
  std::vector<uvec3> triangles;

  void add(vec3 a, vec3 b, vec3 c) {
    const auto first = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), {a, b, c});
    triangles.push_back({first, first + 1, first + 2});
  }
};

WFPG_HD vec3 random_point(std::uint64_t stream, std::uint64_t i) {
  const vec2 xy = unit_vec2(hash(hash(stream, 0), i));
  return {xy.x, xy.y, unit_vec2(hash(hash(stream, 1), i)).x};
}

WFPG_HD vec3 random_direction(std::uint64_t stream, std::uint64_t i) {
  return wfpg::square_to_sphere(unit_vec2(hash(hash(stream, 2), i)));
}

/// Equilateral triangles of edge `edge`, whose first corners are in the unit cube.
mesh small_triangles(std::uint32_t n, float edge) {
  mesh result;
  for (std::uint32_t i = 0; i < n; ++i) {
    const vec3 a = random_point(1, i), along = random_direction(1, i);
    const vec3 aside = glm::normalize(glm::cross(along, random_direction(2, i)));
    result.add(a, a + edge * along, a + edge * (0.5f * along + 0.8660254f * aside));
  }
  return result;
}

mesh empty_box() {
  mesh result;
  for (int axis = 0; axis < 3; ++axis)
    for (const float side : {0.0f, 1.0f}) {
      vec3 corner(0.0f), u(0.0f), v(0.0f);
      corner[axis] = side;
      u[(axis + 1) % 3] = v[(axis + 2) % 3] = 1.0f;
      result.add(corner, corner + u, corner + u + v);
      result.add(corner, corner + u + v, corner + v);
    }
  return result;
}

/// A permutation of the rays' indices.
WFPG_HD std::uint32_t shuffled(std::uint32_t i) {
  for (int round = 0; round < 3; ++round) {
    i = i * 0x9e3779b1u % ray_count;
    i ^= i >> 13;
  }
  return i;
}

struct make_ray {
  wfpg::ray* rays;
  bool in_order;

  WFPG_HD void operator()(std::size_t thread) const {
    const auto written = static_cast<std::uint32_t>(thread);
    const std::uint32_t i = in_order ? written : shuffled(written), cell = i % cells;
    const vec2 jitter = unit_vec2(hash(3, i));
    const vec2 square(static_cast<float>(cell % resolution) + jitter.x,
                      static_cast<float>(cell / resolution) + jitter.y);
    rays[written] = {0.05f + 0.9f * random_point(4, i / cells), 0.0f,
                     wfpg::square_to_sphere(square / static_cast<float>(resolution)), 3.0e38f};
  }
};

class stopwatch {
 public:
  stopwatch() {
    cudaEventCreate(&begin_);
    cudaEventCreate(&end_);
  }
  stopwatch(const stopwatch&) = delete;
  ~stopwatch() {
    cudaEventDestroy(begin_);
    cudaEventDestroy(end_);
  }

  template <class F>
  float milliseconds(const F& work) {
    cudaEventRecord(begin_);
    work();
    cudaEventRecord(end_);
    cudaEventSynchronize(end_);
    float result = 0.0f;
    cudaEventElapsedTime(&result, begin_, end_);
    return result;
  }

 private:
  cudaEvent_t begin_{}, end_{};
};

template <class F>
double mrays_a_second(const F& work) {
  stopwatch watch;
  for (int i = 0; i < 3; ++i) watch.milliseconds(work);
  std::vector<float> times(launches);
  for (float& time : times) time = watch.milliseconds(work);
  std::nth_element(times.begin(), times.begin() + launches / 2, times.end());
  return ray_count * 1.0e-3 / times[launches / 2];
}

struct hit_count {
  const wfpg::ray_hit* hits;
  __host__ __device__ std::uint32_t operator()(std::uint32_t i) const { return hits[i].is_hit(); }
};

void measure(const cuda_policy& exec, const char* name, const mesh& host) {
  const wfpg::buffer<vec3, cuda_policy> positions(exec, host.positions);
  const wfpg::buffer<uvec3, cuda_policy> triangles(exec, host.triangles);
  const wfpg::buffer<wfpg::ray, cuda_policy> rays(exec, ray_count);
  const wfpg::buffer<wfpg::ray_hit, cuda_policy> distances(exec, ray_count);
  const wfpg::buffer<render::triangle_hit, cuda_policy> hits(exec, ray_count);
  const wfpg::buffer<std::uint32_t, cuda_policy> hidden(exec, ray_count);
  stopwatch watch;
  std::unique_ptr<render::optix_scene> scene;
  const float built = watch.milliseconds(
      [&] { scene = std::make_unique<render::optix_scene>(exec, positions.view(), triangles.view(), 0.0f); });
  const render::optix_caster caster = scene->caster();
  std::printf("%s: %zu triangles, made in %.1f ms, %.1f MB\n", name, host.triangles.size(), built,
              static_cast<double>(scene->bytes()) * 1.0e-6);
  for (const bool in_order : {true, false}) {
    exec.for_each(ray_count, make_ray{rays.data(), in_order});
    const double cast = mrays_a_second([&] { caster.cast(exec, rays.view(), distances.view()); });
    const double intersect = mrays_a_second([&] { caster.intersect(exec, rays.view(), hits.view()); });
    const double occluded = mrays_a_second([&] { caster.occluded(exec, rays.view(), hidden.view()); });
    const auto first = thrust::make_counting_iterator(0u);
    const std::uint32_t hit = thrust::transform_reduce(exec.thrust(), first, first + ray_count,
                                                       hit_count{distances.data()}, 0u, thrust::plus<>());
    std::printf("  %-10s cast %8.1f  intersect %8.1f  occluded %8.1f Mrays/s, %.1f%% hit\n",
                in_order ? "coherent" : "incoherent", cast, intersect, occluded, 100.0 * hit / ray_count);
  }
}

}  // namespace

int main() {
  try {
    const cuda_policy exec;
    measure(exec, "empty box", empty_box());
    measure(exec, "edge 0.02", small_triangles(100000, 0.02f));
    measure(exec, "edge 0.01", small_triangles(1000000, 0.01f));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
