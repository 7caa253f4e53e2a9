// When a guide rests: which samples are compared, what a gain decides, and where comparisons begin anew.
#include "support/catch.hpp"

#include <wfpg/guide/rest_schedule.hpp>

#include <cstdint>
#include <optional>
#include <vector>

using wfpg::guiding_gain;
using wfpg::rest_schedule;

namespace {

/// A gain that is known.
guiding_gain gain_of(double value) {
  guiding_gain gain;
  gain.paths = 4096;
  gain.unguided_mean = gain.guided_mean = 1.0;
  gain.unguided_variance = value;
  gain.guided_variance = 1.0;
  return gain;
}

/// Numbers of the first `n` samples for which f(sample) is true.
template <class F>
std::vector<std::uint32_t> samples_where(std::uint32_t n, const F& f) {
  std::vector<std::uint32_t> found;
  for (std::uint32_t sample = 1; sample <= n; ++sample)
    if (f(sample)) found.push_back(sample);
  return found;
}

using numbers = std::vector<std::uint32_t>;

TEST_CASE("rest: samples 3, 4, 8, 16 and so on are measured, and count from the unguided one", "[rest]") {
  const rest_schedule one(1.25f, 1), three(1.25f, 3);
  CHECK(samples_where(70, [&](std::uint32_t s) { return one.is_unguided(s); }) == numbers{1});
  CHECK(samples_where(70, [&](std::uint32_t s) { return one.compares(s); }) == numbers{3, 4, 8, 16, 32, 64});
  CHECK(samples_where(70, [&](std::uint32_t s) { return three.is_unguided(s); }) == numbers{3});
  CHECK(samples_where(70, [&](std::uint32_t s) { return three.compares(s); }) ==
        numbers{5, 6, 10, 18, 34, 66});
}

TEST_CASE("rest: without the option, or without an unguided sample, nothing is measured", "[rest]") {
  for (const rest_schedule& never :
       {rest_schedule(), rest_schedule(std::nullopt, 1), rest_schedule(1.25f, 0)}) {
    CHECK(samples_where(70, [&](std::uint32_t s) {
            return never.compares(s) || never.is_unguided(s);
          }).empty());
    CHECK(samples_where(70, [&](std::uint32_t s) { return never.rests(s); }).empty());
  }
}

TEST_CASE("rest: the least gain grows to the option's in 32 samples", "[rest]") {
  const rest_schedule schedule(1.25f, 1);
  CHECK(schedule.threshold(4) == Approx(1.0f + 0.25f / 8.0f));
  CHECK(schedule.threshold(16) == Approx(1.125f));
  CHECK(schedule.threshold(32) == Approx(1.25f));
  CHECK(schedule.threshold(1024) == Approx(1.25f));
}

TEST_CASE("rest: a guide rests between comparisons, and only where its gain is known and too small",
          "[rest]") {
  rest_schedule schedule(1.25f, 1);
  schedule.decide(8, gain_of(1.05));
  CHECK(samples_where(40, [&](std::uint32_t s) { return s > 8 && !schedule.rests(s); }) == numbers{16, 32});
  for (std::uint32_t sample = 9; sample <= 16; ++sample) schedule.count(sample);
  CHECK(schedule.rested() == 7);
  schedule.decide(16, gain_of(1.13));
  CHECK(!schedule.resting());
  schedule.decide(32, gain_of(1.13));
  CHECK(schedule.resting());

  guiding_gain few = gain_of(0.5), dark = gain_of(0.5), bright = gain_of(0.5);
  few.paths = 4095;
  dark.unguided_mean = 0.94;    // unguided paths miss light: their variance lies there
  bright.cut_off_mean = 0.011;  // it lies in few and bright paths, and the guide finds it by others
  bright.guided_cut_off_mean = 0.005;
  guiding_gain brightest = bright;
  brightest.cut_off_mean = brightest.guided_cut_off_mean = 0.11;  // too much to know anything
  for (const guiding_gain& unknown : {few, dark, bright, brightest, guiding_gain()}) {
    schedule.decide(64, gain_of(0.5));
    REQUIRE(schedule.resting());
    schedule.decide(64, unknown);
    CHECK(!schedule.resting());
  }
}

TEST_CASE("rest: gains are known where guided paths are as bright as others", "[rest]") {
  guiding_gain bright = gain_of(0.5);
  bright.cut_off_mean = 0.09;
  bright.guided_cut_off_mean = 0.044;
  CHECK(!bright.is_known());
  bright.guided_cut_off_mean = 0.046;
  CHECK(bright.is_known());
}

TEST_CASE("rest: gains have bounds where variances are 0", "[rest]") {
  guiding_gain gain = gain_of(3.0);
  CHECK(gain.value() == 3.0);
  gain.guided_variance = 0.0;
  CHECK(gain.value() == 1.0e6);
  gain.unguided_variance = 0.0;
  CHECK(gain.value() == 1.0);
}

TEST_CASE("rest: after light or geometry moved a guide that rests begins again, another one goes on",
          "[rest]") {
  rest_schedule resting(1.25f, 1), guiding(1.25f, 1);
  resting.decide(8, gain_of(0.9));
  resting.restart(20);
  guiding.restart(20);
  CHECK(samples_where(60, [&](std::uint32_t s) { return resting.is_unguided(s); }) == numbers{21});
  CHECK(samples_where(60, [&](std::uint32_t s) { return resting.compares(s); }) ==
        numbers{23, 24, 28, 36, 52});
  CHECK(samples_where(60, [&](std::uint32_t s) { return resting.rests(s); }).empty());
  CHECK(samples_where(60, [&](std::uint32_t s) { return guiding.compares(s) || guiding.rests(s); }).empty());
}

TEST_CASE("rest: what moves before the unguided sample changes nothing", "[rest]") {
  rest_schedule schedule(1.25f, 2);
  schedule.restart(0);
  schedule.restart(1);
  CHECK(samples_where(20, [&](std::uint32_t s) { return schedule.compares(s); }) == numbers{4, 5, 9, 17});
  schedule.restart(2);
  CHECK(samples_where(20, [&](std::uint32_t s) { return schedule.compares(s); }).empty());
}

TEST_CASE("rest: comparisons are at most 512 samples apart", "[rest]") {
  const rest_schedule schedule(1.25f, 1);
  const numbers late = samples_where(2100, [&](std::uint32_t s) { return s > 200 && schedule.compares(s); });
  CHECK(late == numbers{256, 512, 1024, 1536, 2048});
}

TEST_CASE("rest: a state that no schedule has is refused", "[rest]") {
  rest_schedule schedule(1.25f, 1);
  CHECK(schedule.restore(20, 1, 12, true));
  CHECK(schedule.rests(21));
  CHECK(!schedule.restore(20, 1, 21, true));
  CHECK(!schedule.restore(20, 22, 3, false));
  CHECK(!schedule.restore(20, 0, 3, true));
  CHECK(rest_schedule(1.25f, 3).restore(1, 3, 0, false));  // before the unguided sample
  CHECK(rest_schedule(1.25f, 1).restore(20, 21, 3, false));
}

}  // namespace
