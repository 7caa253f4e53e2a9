// The sizes of the benchmarks' problems on each kind of machine.
#pragma once

#include <cstdint>

namespace bench {

/// An argument of a stage. Each row has two.
using argument = std::int64_t;

/// GPUs. Results in bench/results/ have these sizes.
struct gpu_sizes {
  static constexpr int warm_up = 3, iterations = 20;

  // The room, and the rays of a wave in it.
  static constexpr std::uint32_t width = 1920, height = 1080;
  static constexpr int room_triangles = 100000;

  static constexpr argument voxelization[][2] = {{1000, 512}};        // thousands of triangles, resolution
  static constexpr argument octree_and_cache[][2] = {{10000, 1024}};  // thousands of fragments, resolution
  static constexpr argument binning[][2] = {{256, 0}, {256, 2}};      // resolution, bounces
  // Resolution, percentage of the paths in one leaf.
  static constexpr argument depositing[][2] = {{128, 0}, {256, 0}, {128, 10}};

  // Transient fields: bins, cells along an edge, the octree's resolution.
  static constexpr std::uint32_t field_count = 2048, field_size = 128, field_octree = 256;

  // Kept fields: due slots, cells along an edge, the octree's resolution.
  static constexpr std::uint32_t slot_count = 4096, slot_size = 24, slot_octree = 128;
  static constexpr int kept_samples = 17;  // fields learn from them before a wave is measured

  // Casting: points, cells along an edge of their directions. Then thousands of triangles, and whether rays
  // are in order.
  static constexpr std::uint32_t cast_points = 2048, cast_size = 128;
  static constexpr argument casting[][2] = {{100, 1}, {100, 0}, {1000, 1}, {1000, 0}, {0, 1}};

  static constexpr argument photons[][2] = {{2000, 0}, {2000, 1}};  // thousands, whether most lie in a corner

  // Connections among how many thousands of triangles. Then whether surfaces are coated, and the vertices
  // before each end.
  static constexpr std::uint32_t connections = 1u << 22, connection_thousands = 100;
  static constexpr argument connecting[][2] = {{0, 1}, {0, 32}, {1, 1}};

  // Pixels of a bidirectional iteration. Then whether the scene is mirror-balls, not caustic-pool, and
  // whether vertices are merged.
  static constexpr int iteration_width = 1920, iteration_height = 1080;
  static constexpr argument iteration[][2] = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
};

/// CPUs. All iterations of a stage take about two seconds on one core.
struct cpu_sizes {
  static constexpr int warm_up = 1, iterations = 5;

  static constexpr std::uint32_t width = 224, height = 126;
  static constexpr int room_triangles = 20000;

  static constexpr argument voxelization[][2] = {{100, 128}};
  static constexpr argument octree_and_cache[][2] = {{200, 128}};
  static constexpr argument binning[][2] = {{64, 0}, {64, 2}};
  static constexpr argument depositing[][2] = {{64, 0}, {64, 10}};

  static constexpr std::uint32_t field_count = 32, field_size = 64, field_octree = 64;
  static constexpr std::uint32_t slot_count = 256, slot_size = 24, slot_octree = 64;
  static constexpr int kept_samples = 9;

  static constexpr std::uint32_t cast_points = 4, cast_size = 128;
  static constexpr argument casting[][2] = {{20, 1}, {20, 0}, {0, 1}};

  static constexpr argument photons[][2] = {{100, 0}, {100, 1}};

  static constexpr std::uint32_t connections = 1u << 16, connection_thousands = 20;
  static constexpr argument connecting[][2] = {{0, 1}, {0, 32}, {1, 1}};

  static constexpr int iteration_width = 96, iteration_height = 54;
  static constexpr argument iteration[][2] = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
};

#if defined(__CUDACC__)
using sizes = gpu_sizes;
#else
using sizes = cpu_sizes;
#endif

}  // namespace bench
