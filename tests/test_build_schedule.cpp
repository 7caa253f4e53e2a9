// The schedule of kept fields' builds: which waves build, which fields are due, which rays are counted.
#include "support/catch.hpp"

#include <wfpg/guides/octree/build_schedule.hpp>

#include <cstdint>
#include <set>
#include <vector>

namespace {

using wfpg::build_schedule;
using constants = wfpg::build_schedule_constants;

/// Begins samples until `sample` has begun.
build_schedule schedule_in(std::uint32_t sample, std::size_t max_rays = 1000, std::uint32_t leaves = 1000) {
  build_schedule schedule(max_rays, leaves);
  for (std::uint32_t s = 1; s <= sample; ++s) {
    schedule.begin_sample(s, s);
    schedule.count_sample();
  }
  return schedule;
}

/// Indices of the first 24 waves that build in a sample.
std::vector<std::uint32_t> building_waves(build_schedule schedule) {
  std::vector<std::uint32_t> waves;
  for (std::uint32_t wave = 0; wave < 24; ++wave) {
    CHECK(schedule.wave() == wave);
    if (schedule.builds_in_wave()) waves.push_back(wave);
    schedule.end_wave();
  }
  return waves;
}

TEST_CASE("build schedule: once all paths are guided, bins are chosen and may shrink as at the beginning",
          "[build_schedule]") {
  build_schedule schedule;
  for (std::uint32_t sample = 1; sample <= 20; ++sample) schedule.begin_sample(sample, sample);
  schedule.begin_anew();
  CHECK(schedule.before() == 20);
  std::vector<std::uint32_t> chosen;
  for (std::uint32_t sample = 21; sample <= 60; ++sample) {
    schedule.begin_sample(sample, sample);
    CHECK(schedule.age() == sample - 20);
    if (schedule.chooses_bins()) chosen.push_back(sample);
    if (sample <= 28) CHECK(schedule.counts_rays());
  }
  CHECK(chosen == std::vector<std::uint32_t>{21, 22, 24, 28, 36, 52});
  build_schedule restored;
  CHECK(restored.restore(60, 30, 40, 20));
  CHECK(restored.age() == 40);
  CHECK(!restored.restore(60, 30, 40, 61));
}

TEST_CASE("build schedule: where few paths take part, more of their rays are counted", "[build_schedule]") {
  build_schedule schedule(1u << 20, 1u << 12);  // 256 rays a leaf
  schedule.begin_sample(3, 3);
  CHECK(schedule.counted().stride == 32);
  CHECK(schedule.counted(2).stride == 8);
  CHECK(schedule.counted(9).stride == 1);
  CHECK(schedule.counted(9).includes(7));
}

}  // namespace

TEST_CASE("build schedule: every wave builds during warm-up, then one in eight", "[build_schedule]") {
  CHECK(building_waves(schedule_in(1)).size() == 24);
  CHECK(building_waves(schedule_in(32)).size() == 24);
  CHECK((building_waves(schedule_in(33)) == std::vector<std::uint32_t>{7, 15, 23}));
  CHECK((building_waves(schedule_in(40)) == std::vector<std::uint32_t>{0, 8, 16}));
}

TEST_CASE("build schedule: waves build for four samples after bins or geometry change", "[build_schedule]") {
  build_schedule schedule = schedule_in(64);
  schedule.expect_builds(constants::busy_samples);
  for (std::uint32_t s = 65; s <= 68; ++s) {
    schedule.begin_sample(s, s);
    CHECK(building_waves(schedule).size() == 24);
  }
  schedule.begin_sample(69, 69);
  CHECK(building_waves(schedule).size() == 3);
  schedule.expect_builds(constants::invalidated_samples);
  schedule.expect_builds(1);  // never shortens the period
  CHECK(schedule.busy_until() == 69 + 32);
}

TEST_CASE("build schedule: bin sizes are adapted after samples 1, 2, 4, 8, ...", "[build_schedule]") {
  CHECK_FALSE(build_schedule().chooses_bins());
  std::set<std::uint32_t> chosen;
  for (std::uint32_t s = 1; s <= 100; ++s)
    if (schedule_in(s).chooses_bins()) chosen.insert(s);
  CHECK((chosen == std::set<std::uint32_t>{1, 2, 4, 8, 16, 32, 64}));
}

TEST_CASE("build schedule: rays are counted in all samples, then every 4th, then every 16th",
          "[build_schedule]") {
  std::set<std::uint32_t> counted;
  for (std::uint32_t s = 1; s <= 64; ++s)
    if (schedule_in(s).counts_rays()) counted.insert(s);
  CHECK((counted == std::set<std::uint32_t>{1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 28, 32, 48, 64}));
  CHECK(schedule_in(64).counted_samples() == 16);
  CHECK(schedule_in(63).counted().stride == 0);
  CHECK_FALSE(schedule_in(63).counted().includes(0));
}

TEST_CASE("build schedule: large waves count one ray per stride, others in each sample", "[build_schedule]") {
  CHECK(schedule_in(1, 8000, 1000).counted().stride == 1);
  CHECK(schedule_in(1, 8001, 1000).counted().stride == 2);
  CHECK(schedule_in(1, 32004, 1000).counted().stride == 8);
  CHECK(schedule_in(1, 100000000, 1000).counted().stride == 32);
  std::set<std::size_t> first;
  for (std::uint32_t s = 1; s <= 4; ++s) {
    const wfpg::counted_rays rays = schedule_in(s, 16002, 1000).counted();
    CHECK(rays.stride == 4);
    int n = 0;
    for (std::size_t ray = 0; ray < 400; ++ray) n += rays.includes(ray) ? 1 : 0;
    CHECK(n == 100);
    first.insert(rays.first);
  }
  CHECK(first.size() == 4);
}

TEST_CASE("build schedule: a new field is due, and again after a fraction of the samples",
          "[build_schedule]") {
  CHECK(build_schedule::is_due(5, 5, 0, 5));
  CHECK_FALSE(build_schedule::is_due(5, 5, 1, 5));
  CHECK(build_schedule::is_due(8, 8, 1, 7));  // after an eighth of the samples
  CHECK_FALSE(build_schedule::is_due(16, 16, 1, 15));
  CHECK(build_schedule::is_due(16, 16, 1, 14));
  CHECK(build_schedule::is_due(32, 32, 3, 28));
  CHECK_FALSE(build_schedule::is_due(33, 33, 3, 28));  // after a quarter, once warmed up
  CHECK(build_schedule::is_due(36, 36, 3, 27));
  CHECK_FALSE(build_schedule::is_due(100, 100, 3, 76));
  CHECK(build_schedule::is_due(100, 100, 3, 75));
  // After light was forgotten fields are due as in the first samples.
  CHECK(build_schedule::is_due(100, 1, 3, 99));
  CHECK(build_schedule::is_due(107, 8, 3, 106));
  CHECK_FALSE(build_schedule::is_due(115, 16, 3, 114));
  CHECK(build_schedule::is_due(115, 16, 3, 113));
  CHECK_FALSE(build_schedule::is_due(115, 16, 3, 115));
}

TEST_CASE("build schedule: a valid saved state is accepted, an invalid one is refused", "[build_schedule]") {
  build_schedule schedule(1000, 1000);
  CHECK(schedule.restore(64, 16, 68, 0));
  CHECK(schedule.sample() == 64);
  CHECK(schedule.counted_samples() == 16);
  CHECK(schedule.busy_until() == 68);
  CHECK_FALSE(build_schedule().restore(10, 11, 12, 0));
  CHECK_FALSE(build_schedule().restore(10, 5, 43, 0));
}
