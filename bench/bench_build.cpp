// Building the guide of a mesh of a million triangles: voxelization, octree, normals and cache, each by
// itself. Arguments: octree resolution, triangles in thousands.
#include <wfpg/exec/tbb.hpp>
#include <wfpg/octree/exitance_cache.hpp>

#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

namespace {

using exec_policy = wfpg::exec::tbb;

struct mesh {
  wfpg::buffer<wfpg::vec3, exec_policy> positions;
  wfpg::buffer<wfpg::uvec3, exec_policy> triangles;

  wfpg::triangle_mesh_view view() const { return {positions.view(), triangles.view()}; }
};

// A wavy sphere in rings and segments, with two triangles a cell, and six walls of two triangles each around
// it.
mesh make_mesh(const exec_policy& exec, int triangle_count) {
  const int rings = static_cast<int>(std::sqrt(triangle_count / 4.0));
  const int segments = 2 * rings;
  std::vector<wfpg::vec3> positions;
  std::vector<wfpg::uvec3> triangles;
  for (int i = 0; i <= rings; ++i)
    for (int j = 0; j < segments; ++j) {
      const float theta = 3.14159265f * static_cast<float>(i) / static_cast<float>(rings);
      const float phi = 6.2831853f * static_cast<float>(j) / static_cast<float>(segments);
      const float radius = 0.8f + 0.05f * std::sin(12.0f * theta) * std::cos(15.0f * phi);
      positions.push_back(radius * wfpg::vec3(std::sin(theta) * std::cos(phi), std::cos(theta),
                                              std::sin(theta) * std::sin(phi)));
    }
  const auto vertex = [&](int i, int j) { return static_cast<std::uint32_t>(i * segments + j % segments); };
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < segments; ++j) {
      triangles.push_back({vertex(i, j), vertex(i, j + 1), vertex(i + 1, j)});
      triangles.push_back({vertex(i, j + 1), vertex(i + 1, j + 1), vertex(i + 1, j)});
    }
  for (int face = 0; face < 6; ++face) {
    const auto first = static_cast<std::uint32_t>(positions.size());
    for (int corner = 0; corner < 4; ++corner) {
      wfpg::vec3 p;
      p[face / 2] = face % 2 ? 1.0f : -1.0f;
      p[(face / 2 + 1) % 3] = corner == 1 || corner == 2 ? 1.0f : -1.0f;
      p[(face / 2 + 2) % 3] = corner >= 2 ? 1.0f : -1.0f;
      positions.push_back(p);
    }
    triangles.push_back({first, first + 1, first + 2});
    triangles.push_back({first, first + 2, first + 3});
  }
  return {wfpg::buffer<wfpg::vec3, exec_policy>(exec, positions),
          wfpg::buffer<wfpg::uvec3, exec_policy>(exec, triangles)};
}

void voxelization(benchmark::State& state) {
  const exec_policy exec;
  const mesh triangles = make_mesh(exec, static_cast<int>(state.range(1)) * 1000);
  const auto resolution = static_cast<std::uint32_t>(state.range(0));
  std::size_t fragments = 0;
  for (auto _ : state) fragments = wfpg::voxelize(exec, triangles.view(), resolution).size();
  state.counters["triangles"] = static_cast<double>(triangles.triangles.size());
  state.counters["fragments"] = static_cast<double>(fragments);
}

void octree(benchmark::State& state) {
  const exec_policy exec;
  const mesh triangles = make_mesh(exec, static_cast<int>(state.range(1)) * 1000);
  const auto resolution = static_cast<std::uint32_t>(state.range(0));
  std::size_t nodes = 0;
  for (auto _ : state) {
    state.PauseTiming();
    auto fragments = wfpg::voxelize(exec, triangles.view(), resolution);
    state.ResumeTiming();
    nodes = wfpg::sparse_voxel_octree<exec_policy>(exec, fragments).node_count();
  }
  state.counters["nodes"] = static_cast<double>(nodes);
}

void cache(benchmark::State& state) {
  const exec_policy exec;
  const mesh triangles = make_mesh(exec, static_cast<int>(state.range(1)) * 1000);
  auto fragments = wfpg::voxelize(exec, triangles.view(), static_cast<std::uint32_t>(state.range(0)));
  const wfpg::sparse_voxel_octree<exec_policy> tree(exec, fragments);
  double bytes = 0.0;
  for (auto _ : state) {
    const wfpg::exitance_cache<exec_policy> made(exec, tree, fragments, 0);
    bytes = static_cast<double>(made.persistent_bytes() + tree.bytes());
  }
  state.counters["bytes_per_node"] = bytes / tree.node_count();
}

BENCHMARK(voxelization)->Args({128, 1000})->Args({512, 1000})->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(octree)->Args({128, 1000})->Args({512, 1000})->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(cache)->Args({128, 1000})->Args({512, 1000})->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace

BENCHMARK_MAIN();
