// Building the guide of a scene: voxelization, and the octree with its cache.
#include "floors.hpp"
#include "room.hpp"

#include <wfpg/octree/exitance_cache.hpp>

#include <memory>

namespace bench {
namespace {

/// Levels of an octree with leaves of this resolution.
int levels_of(std::uint32_t resolution) {
  int levels = 0;
  while (1u << levels < resolution) ++levels;
  return levels;
}

/// Voxelizes the room's triangles, a million at 512³ on a GPU. The floor writes the fragments and sorts them.
template <class Exec>
void voxelization(benchmark::State& state) {
  const Exec exec;
  const room_mesh<Exec> mesh(exec, static_cast<int>(state.range(0)) * 1000);
  const auto resolution = static_cast<std::uint32_t>(state.range(1));
  const wfpg::voxel_fragments<Exec> found = wfpg::voxelize(exec, mesh.view(), resolution);
  const wfpg::voxel_fragments<Exec> written(exec, found.size());
  const sort_of sort(exec, found.codes, 3 * levels_of(resolution), found.codes.size());
  state.counters["fragments"] = static_cast<double>(found.size());
  compare(
      state, exec, [&] { wfpg::voxelize(exec, mesh.view(), resolution); },
      [&] {
        copy(exec, found.codes, written.codes);
        copy(exec, found.surfaces, written.surfaces);
        sort();
      });
}

/// Points on a sphere, unordered.
struct scatter {
  wfpg::array_view<wfpg::surface_fragment> samples;
  WFPG_HD void operator()(std::size_t i) const {
    const vec3 d = wfpg::square_to_sphere(wfpg::unit_vec2(wfpg::hash(5, i)));
    samples[i] = {vec3(0.5f) + 0.5f * d, d, 1.0f};
  }
};

/// Builds octree and cache from unsorted fragments, ten million at 1024³ on a GPU. The floor is the sort.
template <class Exec>
void octree_and_cache(benchmark::State& state) {
  const Exec exec;
  const auto n = static_cast<std::size_t>(state.range(0)) * 1000;
  const auto resolution = static_cast<std::uint32_t>(state.range(1));
  const wfpg::buffer<wfpg::surface_fragment, Exec> samples(exec, n);
  exec.for_each(n, scatter{samples.view()});
  const auto given = wfpg::fragments_from_samples(
      exec, wfpg::array_view<const wfpg::surface_fragment>(samples.view()), resolution);
  wfpg::voxel_fragments<Exec> fragments(exec, given.size());
  fragments.grid = given.grid;
  const sort_of sort(exec, given.codes, 3 * levels_of(resolution), given.codes.size());
  set_cpu_floor(state, "a sort of the codes");
  std::unique_ptr<wfpg::sparse_voxel_octree<Exec>> tree;
  std::unique_ptr<wfpg::exitance_cache<Exec>> cache;
  compare(
      state, exec,
      [&] {
        tree = std::make_unique<wfpg::sparse_voxel_octree<Exec>>(exec, fragments);
        cache = std::make_unique<wfpg::exitance_cache<Exec>>(exec, *tree, fragments, 0);
      },
      sort,
      [&] {
        cache.reset();
        tree.reset();
        copy(exec, given.codes, fragments.codes);
        copy(exec, given.surfaces, fragments.surfaces);
      });
  state.counters["nodes"] = tree->node_count();
  state.counters["leaves"] = tree->leaf_count();
}

WFPG_BENCH_STAGE(voxelization, {"thousands", "resolution"}, sizes::voxelization);
WFPG_BENCH_STAGE(octree_and_cache, {"thousands", "resolution"}, sizes::octree_and_cache);

}  // namespace
}  // namespace bench
