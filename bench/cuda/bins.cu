// Binning a wave of rays: from the leaf look-up to the bins' offsets.
#include "guide.hpp"

#include <wfpg/bins/spatial_binner.hpp>

#include <cub/device/device_radix_sort.cuh>

namespace bench {
namespace {

/// The rays of a wave, as the binner wants them.
struct stored_rays {
  wfpg::array_view<const room_point> points;
  WFPG_HD wfpg::ray_to_bin operator()(std::size_t i) const {
    return {points[i].position, wfpg::dominant_axis(points[i].normal), true};
  }
};

struct random_keys {
  wfpg::array_view<std::uint32_t> keys;
  WFPG_HD void operator()(std::size_t i) const {
    keys[i] = static_cast<std::uint32_t>(wfpg::hash(3, i)) & 0x1fffffu;
  }
};

/// 1920 x 1080 rays after some bounces in an octree of 256³; the floor is CUB's sort of as many 21-bit keys.
void binning(benchmark::State& state) {
  const exec_policy exec;
  const guide_of_room guide(exec, static_cast<std::uint32_t>(state.range(0)));
  const auto points = points_after(exec, static_cast<int>(state.range(1)));
  wfpg::spatial_binner<exec_policy> binner(exec, guide.octree.view(), {}, pixels);
  const wfpg::buffer<std::uint32_t, exec_policy> keys(exec, pixels), values(exec, pixels),
      sorted(exec, pixels), sorted_values(exec, pixels);
  exec.for_each(pixels, random_keys{keys.view()});
  std::size_t bytes = 0;
  const auto sort = [&](void* storage) {
    wfpg::check_cuda(
        cub::DeviceRadixSort::SortPairs(storage, bytes, keys.data(), sorted.data(), values.data(),
                                        sorted_values.data(), pixels, 0, 21, exec.stream()),
        "cub::DeviceRadixSort::SortPairs");
  };
  sort(nullptr);
  const wfpg::buffer<unsigned char, exec_policy> storage(exec, bytes);
  wfpg::bins_view bins;
  compare(
      state, exec,
      [&] {
        bins = binner.bin(exec, pixels, stored_rays{wfpg::array_view<const room_point>(points.view())});
      },
      [&] { sort(storage.data()); });
  state.counters["bins"] = wfpg::read_element(exec, bins.count);
}

BENCHMARK(binning)->ArgNames({"resolution", "bounces"})->Args({256, 0})->Args({256, 2})->Apply(as_stage);

}  // namespace
}  // namespace bench
