// Hits that kernels collect, and the box around most of them.
#include "support/policies.hpp"

#include <wfpg/octree/surface_collector.hpp>
#include <wfpg/octree/voxelizer.hpp>

#include <limits>
#include <stdexcept>
#include <vector>

using namespace wfpg_test;
using wfpg::bounds3;
using wfpg::surface_fragment;
using wfpg::vec3;

/// Types in kernels need names, for CUDA compilers.
namespace collector_test {

/// Writes every second slot, and `beyond` calls past the last one.
struct add_hits {
  wfpg::surface_collector_view collector;
  WFPG_HD void operator()(std::size_t i) const {
    const float x = static_cast<float>(i);
    if (i % 2 == 0) collector.add(i, {x, 2.0f * x, 1.0f}, {0.0f, 0.0f, 1.0f});
  }
};

}  // namespace collector_test

namespace {

using collector_test::add_hits;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

WFPG_TEST_CASE("a collector returns its hits in the order of slots", "[surface_collector]") {
  const Exec exec;
  const wfpg::surface_collector<Exec> collector(exec, 1000);
  CHECK(collector.capacity() == 1000);
  CHECK(collector.view().capacity() == 1000);
  CHECK(collector.samples(exec).size() == 0);
  exec.for_each(1010, add_hits{collector.view()});
  const std::vector<surface_fragment> hits = collector.samples(exec).to_host(exec);
  REQUIRE(hits.size() == 500);
  bool ordered = true;
  for (std::size_t i = 0; i < hits.size(); ++i)
    ordered = ordered && hits[i].position == vec3(float(2 * i), float(4 * i), 1.0f) && hits[i].area == 1.0f &&
              hits[i].normal == vec3(0.0f, 0.0f, 1.0f);
  CHECK(ordered);
  CHECK(collector.dropped(exec) == 5);
}

WFPG_TEST_CASE("a view without slots ignores all calls", "[surface_collector]") {
  const Exec exec;
  exec.for_each(10, add_hits{{}});
  const wfpg::surface_collector<Exec> none(exec, 0);
  exec.for_each(10, add_hits{none.view()});
  CHECK(none.samples(exec).size() == 0);
  CHECK(none.dropped(exec) == 0);
}

template <class Exec>
bounds3 box_of(const Exec& exec, const std::vector<surface_fragment>& samples, float outliers) {
  const wfpg::buffer<surface_fragment, Exec> device(exec, samples);
  return wfpg::bounds_of_samples(exec, const_view(device), outliers);
}

/// Hits in the unit cube, whose corners are among them, and `far` hits far away on all sides.
std::vector<surface_fragment> cube_and_far(int far) {
  random_numbers random(5);
  std::vector<surface_fragment> samples;
  for (int i = 0; i < 2000; ++i) samples.push_back({random.point(0.0f, 1.0f)});
  samples.push_back({vec3(0.0f)});
  samples.push_back({vec3(1.0f)});
  for (int i = 0; i < far; ++i) samples.push_back({(i % 2 ? 1.0e6f : -1.0e6f) * random.direction()});
  shuffle(samples, random);
  return samples;
}

WFPG_TEST_CASE("bounds of samples leave out what is far away, and nothing near", "[surface_collector]") {
  const Exec exec;
  for (const int far : {0, 1, 15}) {
    const bounds3 box = box_of(exec, cube_and_far(far), 0.01f);
    INFO(far << " far");
    CHECK(box.lower == vec3(0.0f));
    CHECK(box.upper == vec3(1.0f));
  }
  const bounds3 all = box_of(exec, cube_and_far(15), 0.0f);
  CHECK(all.lower.x < -1.0e4f);
  CHECK(all.upper.x > 1.0e4f);
}

WFPG_TEST_CASE("bounds of samples leave out positions that are not valid", "[surface_collector]") {
  const Exec exec;
  std::vector<surface_fragment> samples = {{vec3(nan, 0.0f, 0.0f)}, {vec3(0.0f, 2.0e15f, 0.0f)}};
  CHECK(box_of(exec, samples, 0.01f).empty());
  CHECK(box_of(exec, {}, 0.01f).empty());
  samples.push_back({vec3(3.0f)});
  const bounds3 point = box_of(exec, samples, 0.01f);
  CHECK(point.lower == vec3(3.0f));
  CHECK(point.upper == vec3(3.0f));
  for (const float bad : {-0.1f, 0.5f, 1.0f, nan})
    CHECK_THROWS_AS(box_of(exec, samples, bad), std::invalid_argument);
}

WFPG_TEST_CASE("fragments of collected hits count what they skip", "[surface_collector]") {
  const Exec exec;
  std::vector<surface_fragment> samples = cube_and_far(15);
  samples.push_back({vec3(0.5f, nan, 0.5f)});
  samples.push_back({vec3(0.5f), vec3(0.0f)});
  const wfpg::buffer<surface_fragment, Exec> device(exec, samples);
  const bounds3 box = wfpg::bounds_of_samples(exec, const_view(device));
  const auto fragments = wfpg::fragments_from_samples(exec, const_view(device), 16, box);
  CHECK(fragments.size() == 2002);
  CHECK(fragments.report.out_of_range == 15);
  CHECK(fragments.report.non_finite == 1);
  CHECK(fragments.report.degenerate == 1);
  CHECK(fragments.grid.voxel_size() < 0.1f);
}

}  // namespace
