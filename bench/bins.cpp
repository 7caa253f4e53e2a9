// Binning a wave of rays: from the leaf look-up to the bins' offsets.
#include "floors.hpp"
#include "guide.hpp"

#include <wfpg/bins/spatial_binner.hpp>

namespace bench {
namespace {

/// The rays of a wave as the binner reads them.
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

/// A wave's rays after some bounces. The floor sorts as many 21-bit keys.
template <class Exec>
void binning(benchmark::State& state) {
  const Exec exec;
  const guide_of_room<Exec> guide(exec, static_cast<std::uint32_t>(state.range(0)));
  const auto points = points_after(exec, static_cast<int>(state.range(1)));
  wfpg::spatial_binner<Exec> binner(exec, guide.octree.view(), {}, pixels);
  const wfpg::buffer<std::uint32_t, Exec> keys(exec, pixels);
  exec.for_each(pixels, random_keys{keys.view()});
  const sort_of sort(exec, keys, 21, pixels);
  set_cpu_floor(state, "a sort of as many 21-bit keys");
  wfpg::bins_view bins;
  compare(
      state, exec,
      [&] {
        bins = binner.bin(exec, pixels, stored_rays{wfpg::array_view<const room_point>(points.view())});
      },
      sort);
  state.counters["bins"] = wfpg::read_element(exec, bins.count);
}

WFPG_BENCH_STAGE(binning, {"resolution", "bounces"}, sizes::binning);

}  // namespace
}  // namespace bench
