// Building the guide of a scene: voxelization, and the octree with its cache.
#include "room.hpp"

#include <wfpg/octree/exitance_cache.hpp>

#include <cub/device/device_radix_sort.cuh>

#include <memory>

namespace bench {
namespace {

/// CUB's radix sort of some voxels' codes with an index each, as many bits as the codes have.
class sort_of_codes {
 public:
  sort_of_codes(const exec_policy& exec, const wfpg::buffer<wfpg::morton_code, exec_policy>& codes, int bits)
      : exec_(exec),
        codes_(codes),
        bits_(bits),
        sorted_(exec, codes.size()),
        values_(exec, codes.size()),
        sorted_values_(exec, codes.size()) {
    sort(nullptr, bytes_);
    storage_ = {exec, bytes_};
  }
  void operator()() const {
    std::size_t bytes = bytes_;
    sort(storage_.data(), bytes);
  }

 private:
  void sort(void* storage, std::size_t& bytes) const {
    wfpg::check_cuda(
        cub::DeviceRadixSort::SortPairs(storage, bytes, codes_.data(), sorted_.data(), values_.data(),
                                        sorted_values_.data(), codes_.size(), 0, bits_, exec_.stream()),
        "cub::DeviceRadixSort::SortPairs");
  }

  exec_policy exec_;
  const wfpg::buffer<wfpg::morton_code, exec_policy>& codes_;
  int bits_;
  wfpg::buffer<wfpg::morton_code, exec_policy> sorted_;
  wfpg::buffer<std::uint32_t, exec_policy> values_, sorted_values_;
  wfpg::buffer<unsigned char, exec_policy> storage_;
  std::size_t bytes_ = 0;
};

template <class T>
void copy(const exec_policy& exec, const wfpg::buffer<T, exec_policy>& from,
          const wfpg::buffer<T, exec_policy>& to) {
  wfpg::check_cuda(
      cudaMemcpyAsync(to.data(), from.data(), from.bytes(), cudaMemcpyDeviceToDevice, exec.stream()),
      "cudaMemcpyAsync");
}

/// A million triangles at 512³; the floor writes the fragments and sorts them.
void voxelization(benchmark::State& state) {
  const exec_policy exec;
  const room_mesh mesh(exec, static_cast<int>(state.range(0)) * 1000);
  const auto resolution = static_cast<std::uint32_t>(state.range(1));
  int depth = 0;
  while (1u << depth < resolution) ++depth;
  const wfpg::voxel_fragments<exec_policy> found = wfpg::voxelize(exec, mesh.view(), resolution);
  const wfpg::voxel_fragments<exec_policy> written(exec, found.size());
  const sort_of_codes sort(exec, found.codes, 3 * depth);
  state.counters["fragments"] = static_cast<double>(found.size());
  compare(
      state, exec, [&] { wfpg::voxelize(exec, mesh.view(), resolution); },
      [&] {
        copy(exec, found.codes, written.codes);
        copy(exec, found.surfaces, written.surfaces);
        sort();
      });
}

/// Points on a sphere, in no order.
struct scatter {
  wfpg::array_view<wfpg::surface_fragment> samples;
  WFPG_HD void operator()(std::size_t i) const {
    const vec3 d = wfpg::square_to_sphere(wfpg::unit_vec2(wfpg::hash(5, i)));
    samples[i] = {vec3(0.5f) + 0.5f * d, d, 1.0f};
  }
};

/// Ten million fragments at 1024³, from the sort to the finished cache; the floor is the sort.
void octree_and_cache(benchmark::State& state) {
  const exec_policy exec;
  const auto n = static_cast<std::size_t>(state.range(0)) * 1000;
  const auto resolution = static_cast<std::uint32_t>(state.range(1));
  int depth = 0;
  while (1u << depth < resolution) ++depth;
  const wfpg::buffer<wfpg::surface_fragment, exec_policy> samples(exec, n);
  exec.for_each(n, scatter{samples.view()});
  const auto given = wfpg::fragments_from_samples(
      exec, wfpg::array_view<const wfpg::surface_fragment>(samples.view()), resolution);
  wfpg::voxel_fragments<exec_policy> fragments(exec, given.size());
  fragments.grid = given.grid;
  const sort_of_codes sort(exec, given.codes, 3 * depth);
  std::unique_ptr<wfpg::sparse_voxel_octree<exec_policy>> tree;
  std::unique_ptr<wfpg::exitance_cache<exec_policy>> cache;
  compare(
      state, exec,
      [&] {
        tree = std::make_unique<wfpg::sparse_voxel_octree<exec_policy>>(exec, fragments);
        cache = std::make_unique<wfpg::exitance_cache<exec_policy>>(exec, *tree, fragments, 0);
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

BENCHMARK(voxelization)->ArgNames({"thousands", "resolution"})->Args({1000, 512})->Apply(as_stage);
BENCHMARK(octree_and_cache)->ArgNames({"thousands", "resolution"})->Args({10000, 1024})->Apply(as_stage);

}  // namespace
}  // namespace bench
