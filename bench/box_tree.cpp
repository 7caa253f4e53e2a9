// Building a tree over boxes, and finding photons with it.
#include "floors.hpp"
#include "photons.hpp"

#include <wfpg/light/box_tree.hpp>
#include <wfpg/light/photon_map.hpp>

namespace bench {
namespace {

struct sphere_boxes {
  wfpg::array_view<const vec3> centres;
  float radius;
  WFPG_HD wfpg::bounds3 operator()(std::size_t i) const { return {centres[i] - radius, centres[i] + radius}; }
};

struct random_codes {
  std::uint64_t* codes;
  WFPG_HD void operator()(std::size_t i) const { codes[i] = hash(5, i) >> 1; }
};

/// Builds a tree with one box a leaf. The floor sorts as many codes of 63 bits.
template <class Exec>
void building_boxes(benchmark::State& state) {
  const Exec exec;
  const auto n = static_cast<std::uint32_t>(1000 * state.range(0));
  const bool clustered = state.range(1) != 0;
  const auto centres = points_on(exec, n, 1, clustered, false);
  const sphere_boxes boxes{centres.view(), radius_for_ten(n, clustered)};
  const wfpg::buffer<std::uint64_t, Exec> codes(exec, n);
  exec.for_each(n, random_codes{codes.data()});
  const sort_of sort(exec, codes, 63, n);
  set_cpu_floor(state, "a sort of as many 63-bit keys");
  wfpg::box_tree<Exec> tree;
  compare(
      state, exec, [&] { tree.build(exec, n, boxes); }, sort);
  state.counters["bytes_a_box"] = static_cast<double>(tree.bytes()) / n;
}

/// Finds the photons around as many points. The floor reads the points, and each photon that is found.
template <class Exec>
void finding_photons(benchmark::State& state) {
  const Exec exec;
  const auto n = static_cast<std::uint32_t>(1000 * state.range(0));
  const bool clustered = state.range(1) != 0;
  const auto photons = points_on(exec, n, 1, clustered, false),
             points = points_on(exec, n, 2, clustered, true);
  wfpg::photon_map<Exec> map;
  map.build(exec, photons.view(), radius_for_ten(n, clustered));
  const wfpg::buffer<std::uint32_t, Exec> found(exec, n);
  const auto find = [&] { exec.for_each(n, count_photons{map.view(), points.view(), found.data()}); };
  find();
  const std::uint64_t pairs = sum_of(exec, found);
  const copy_of floor(exec, points.bytes() + pairs * (sizeof(vec3) + sizeof(std::uint32_t)));
  compare(state, exec, find, floor);
  state.counters["pairs_a_point"] = static_cast<double>(pairs) / n;
  state.counters["bytes_a_photon"] = static_cast<double>(map.bytes()) / n;
}

WFPG_BENCH_STAGE(building_boxes, {"thousands", "clustered"}, sizes::photons);
WFPG_BENCH_STAGE(finding_photons, {"thousands", "clustered"}, sizes::photons);

}  // namespace
}  // namespace bench
