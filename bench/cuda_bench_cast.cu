// Rays a second of the renderer's hierarchy on a GPU: bins of coherent cones, as guiding casts them, and rays
// in all directions from everywhere, among small random triangles in the unit cube and in an empty box; and
// what building it takes. Arguments: triangles in thousands (0: the box alone), triangles of a leaf at most.
#include "bvh_scene.hpp"

#include <wfpg/detail/math.hpp>
#include <wfpg/exec/cuda.hpp>
#include <wfpg/octahedral_map.hpp>

#include <benchmark/benchmark.h>

#include <cmath>
#include <random>
#include <vector>

namespace {

using exec_policy = wfpg::exec::cuda;
using wfpg::vec3;

constexpr std::uint32_t bins = 2048, cells_a_side = 128, rays_a_bin = cells_a_side * cells_a_side;
constexpr std::size_t rays = std::size_t(bins) * rays_a_bin;

/// Seconds of the stream's work between its making and elapsed().
class event_timer {
 public:
  explicit event_timer(const exec_policy& exec) : stream_(exec.stream()) {
    cudaEventCreate(&begin_);
    cudaEventCreate(&end_);
    cudaEventRecord(begin_, stream_);
  }
  event_timer(const event_timer&) = delete;
  ~event_timer() {
    cudaEventDestroy(begin_);
    cudaEventDestroy(end_);
  }
  double elapsed() const {
    float milliseconds = 0.0f;
    cudaEventRecord(end_, stream_);
    cudaEventSynchronize(end_);
    cudaEventElapsedTime(&milliseconds, begin_, end_);
    return 1e-3 * static_cast<double>(milliseconds);
  }

 private:
  cudaStream_t stream_;
  cudaEvent_t begin_ = nullptr, end_ = nullptr;
};

struct mesh {
  wfpg::buffer<vec3, exec_policy> positions;
  wfpg::buffer<wfpg::uvec3, exec_policy> triangles;

  wfpg::triangle_mesh_view view() const { return {positions.view(), triangles.view()}; }
};

/// Triangles whose total area does not depend on their number, or the faces of the unit cube.
mesh make_mesh(const exec_policy& exec, int thousands) {
  std::vector<vec3> positions;
  std::mt19937 engine(1);
  std::uniform_real_distribution<float> unit(0.0f, 1.0f);
  const auto point = [&] {
    const float x = unit(engine), y = unit(engine);
    return vec3(x, y, unit(engine));
  };
  const float size = 0.02f * std::sqrt(100.0f / static_cast<float>(thousands));
  for (int i = 0; i < 1000 * thousands; ++i) {
    const vec3 centre = point();
    for (int corner = 0; corner < 3; ++corner) positions.push_back(centre + size * (point() - 0.5f));
  }
  for (int face = 0; face < 6 && thousands == 0; ++face)
    for (const int corner : {0, 1, 2, 0, 2, 3}) {
      vec3 p(0.0f);
      p[face / 2] = face % 2 ? 1.0f : 0.0f;
      p[(face / 2 + 1) % 3] = corner == 1 || corner == 2 ? 1.0f : 0.0f;
      p[(face / 2 + 2) % 3] = corner >= 2 ? 1.0f : 0.0f;
      positions.push_back(p);
    }
  std::vector<wfpg::uvec3> triangles;
  for (std::uint32_t i = 0; i < positions.size(); i += 3) triangles.push_back({i, i + 1, i + 2});
  return {wfpg::buffer<vec3, exec_policy>(exec, positions),
          wfpg::buffer<wfpg::uvec3, exec_policy>(exec, triangles)};
}

WFPG_HD vec3 random_point(std::uint64_t seed) {
  const wfpg::vec2 xy = wfpg::detail::unit_vec2(wfpg::detail::hash(seed, 0));
  return {xy.x, xy.y, wfpg::detail::unit_vec2(wfpg::detail::hash(seed, 1)).x};
}

/// The cones of a bin in the order of its grid over the sphere.
struct cone_of_bin {
  WFPG_HD wfpg::ray operator()(std::size_t i) const {
    const auto cell = static_cast<std::uint32_t>(i % rays_a_bin);
    const wfpg::vec2 corner(cell % cells_a_side, cell / cells_a_side);
    wfpg::ray ray;
    ray.origin = random_point(i / rays_a_bin);
    ray.direction = wfpg::square_to_sphere((corner + 0.5f) / static_cast<float>(cells_a_side));
    return ray;
  }
};

struct any_ray {
  WFPG_HD wfpg::ray operator()(std::size_t i) const {
    wfpg::ray ray;
    ray.origin = random_point(i);
    ray.direction = wfpg::square_to_sphere(wfpg::detail::unit_vec2(wfpg::detail::hash(i, 2)));
    return ray;
  }
};

template <class Rays>
struct cast_rays {
  render::bvh_caster caster;
  Rays rays;
  wfpg::array_view<wfpg::ray_hit> hits;
  WFPG_HD void operator()(std::size_t i) const { hits[i] = caster(rays(i)); }
};

template <class Rays>
void cast(benchmark::State& state) {
  const exec_policy exec;
  const mesh triangles = make_mesh(exec, static_cast<int>(state.range(0)));
  const render::bvh_scene<exec_policy> scene(exec, triangles.view(), 0.0f,
                                             {static_cast<std::uint32_t>(state.range(1))});
  const wfpg::buffer<wfpg::ray_hit, exec_policy> hits(exec, rays);
  const cast_rays<Rays> kernel{scene.caster(), Rays{}, hits.view()};
  exec.for_each(rays, kernel);
  for (auto _ : state) {
    const event_timer timer(exec);
    exec.for_each(rays, kernel);
    state.SetIterationTime(timer.elapsed());
  }
  std::size_t found = 0;
  for (const wfpg::ray_hit& hit : hits.to_host(exec, rays / 64)) found += hit.is_hit();
  state.counters["Mrays/s"] = benchmark::Counter(1e-6 * rays, benchmark::Counter::kIsIterationInvariantRate);
  state.counters["hits"] = static_cast<double>(found) / (rays / 64);
}

void build(benchmark::State& state) {
  const exec_policy exec;
  const mesh triangles = make_mesh(exec, static_cast<int>(state.range(0)));
  std::size_t bytes = 0;
  for (auto _ : state) {
    const event_timer timer(exec);
    const render::bvh_scene<exec_policy> scene(exec, triangles.view(), 0.0f,
                                               {static_cast<std::uint32_t>(state.range(1))});
    state.SetIterationTime(timer.elapsed());
    bytes = scene.bytes();
  }
  state.counters["bytes_per_triangle"] = static_cast<double>(bytes) / triangles.triangles.size();
}

void sizes(benchmark::internal::Benchmark* b) {
  for (const int thousands : {100, 1000, 0})
    for (const int leaf : {1, 4}) b->Args({thousands, leaf});
}

BENCHMARK_TEMPLATE(cast, cone_of_bin)->Apply(sizes)->Unit(benchmark::kMillisecond)->UseManualTime();
BENCHMARK_TEMPLATE(cast, any_ray)->Apply(sizes)->Unit(benchmark::kMillisecond)->UseManualTime();
BENCHMARK(build)->Args({100, 1})->Args({1000, 1})->Unit(benchmark::kMillisecond)->UseManualTime();

}  // namespace

BENCHMARK_MAIN();
