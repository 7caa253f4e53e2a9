// When a guide rests: which samples are compared, what a gain decides, and where comparisons begin anew.
#include "support/catch.hpp"

#include <wfpg/guide/rest_schedule.hpp>

#include <cmath>
#include <cstdint>
#include <utility>
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
  gain.typical_unguided = value;
  gain.typical_guided = 1.0;
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

TEST_CASE("rest: samples 3, 4, 8, 16 and so on are measured, and count from the first unguided one",
          "[rest]") {
  const rest_schedule one(1.25f, 1), three(1.25f, 3);
  CHECK(samples_where(70, [&](std::uint32_t s) { return one.is_unguided(s); }) == numbers{1, 2, 5, 9});
  CHECK(samples_where(70, [&](std::uint32_t s) { return one.compares(s); }) == numbers{3, 4, 8, 16, 32, 64});
  CHECK(samples_where(70, [&](std::uint32_t s) { return three.is_unguided(s); }) == numbers{3, 4, 7, 11});
  CHECK(samples_where(70, [&](std::uint32_t s) { return three.compares(s); }) ==
        numbers{5, 6, 10, 18, 34, 66});
}

TEST_CASE("rest: with a least gain of 0, or without an unguided sample, nothing is measured", "[rest]") {
  for (const rest_schedule& never : {rest_schedule(), rest_schedule(0.0f, 1), rest_schedule(1.25f, 0)}) {
    CHECK(samples_where(70, [&](std::uint32_t s) {
            return never.compares(s) || never.is_unguided(s) || never.rests(s) || never.probes(s);
          }).empty());
    CHECK(never.weight() == 1.0f);
  }
}

TEST_CASE("rest: a guide that takes part in all paths leaves out none later, and one that rests neither",
          "[rest]") {
  for (const double gain : {0.5, 3.0}) {
    rest_schedule schedule(1.25f, 1);
    schedule.decide(4, gain_of(gain));
    CHECK(samples_where(70, [&](std::uint32_t s) { return schedule.is_unguided(s); }) == numbers{1, 2});
  }
  const rest_schedule schedule(1.25f, 1);
  numbers order;
  for (const std::uint32_t sample : {1u, 2u, 5u, 9u, 3u}) order.push_back(schedule.unguided_number(sample));
  CHECK(order == numbers{0, 1, 2, 3, 4});
}

TEST_CASE("rest: on CPUs less is asked for where triangles are many", "[rest]") {
  using wfpg::rest_constants;
  CHECK(rest_constants::cpu_least_gain(0) == 1.75f);  // not known
  CHECK(rest_constants::cpu_least_gain(12) == Approx(2.26f));
  CHECK(rest_constants::cpu_least_gain(30000) == Approx(1.325f));
  for (const std::size_t many : {std::size_t(600000), std::size_t(1) << 40})
    CHECK(rest_constants::cpu_least_gain(many) == rest_constants::gpu_least_gain);
}

TEST_CASE("rest: the least gain grows to the option's in 16 samples", "[rest]") {
  const rest_schedule schedule(1.25f, 1);
  CHECK(schedule.threshold(4) == Approx(1.0f + 0.25f / 4.0f));
  CHECK(schedule.threshold(8) == Approx(1.125f));
  CHECK(schedule.threshold(16) == Approx(1.25f));
  CHECK(schedule.threshold(1024) == Approx(1.25f));
}

/// The numbers of a gain without doubt: as gain_of(), with less noise.
guiding_gain calm_gain_of(double value) {
  guiding_gain gain = gain_of(value);
  gain.unguided_mean = gain.guided_mean = 10.0;
  return gain;
}

TEST_CASE("rest: a guide takes part in few paths until it is known whether guiding pays", "[rest]") {
  rest_schedule schedule(2.0f, 1);
  schedule.decide(3, calm_gain_of(0.1));  // too early to decide
  CHECK(samples_where(20, [&](std::uint32_t s) { return schedule.probes(s); }).size() == 20);
  schedule.decide(4, calm_gain_of(1.9));  // above 1.25 and below 2
  CHECK(schedule.probes(5));
  schedule.decide(8, calm_gain_of(1.6));
  CHECK(schedule.probes(9));
  schedule.decide(16, calm_gain_of(2.05));
  CHECK(samples_where(40, [&](std::uint32_t s) { return schedule.probes(s) || schedule.rests(s); }).empty());
  schedule.decide(32, calm_gain_of(2.1));
  CHECK(samples_where(40, [&](std::uint32_t s) { return schedule.probes(s) || schedule.rests(s); }).empty());

  rest_schedule sure(2.0f, 1);
  sure.decide(4, calm_gain_of(2.1));
  CHECK(!sure.probes(5));
  sure.decide(8, calm_gain_of(1.9));  // once it takes part in all paths, it goes on so
  CHECK(!sure.probes(9));
  sure.decide(16, calm_gain_of(1.9));
  CHECK(sure.resting());

  rest_schedule again(2.0f, 1);
  again.decide(4, calm_gain_of(0.5));
  CHECK(again.resting());
  again.decide(8, calm_gain_of(1.9));
  CHECK(again.probes(9));
}

/// As calm_gain_of(), with a variance of `noise` times the square of the mean.
guiding_gain noisy_gain_of(double value, double noise) {
  guiding_gain gain = calm_gain_of(value);
  gain.typical_guided = gain.typical_guided * noise / gain.typical_unguided;
  gain.typical_unguided = noise;
  gain.unguided_mean = gain.guided_mean = 1.0;
  return gain;
}

/// As calm_gain_of(), with an error of its logarithm.
guiding_gain doubtful_gain_of(double value, double error) {
  guiding_gain gain = calm_gain_of(value);
  gain.typical_error = error;
  return gain;
}

TEST_CASE("rest: a gain in doubt guides few paths, and none from sample 8 on", "[rest]") {
  const double lowered = std::exp(-0.6);  // by an error of 0.3
  const auto taken_part = [](std::uint32_t sample, const guiding_gain& gain, double before = 0.0) {
    rest_schedule schedule(2.0f, 1);
    if (before > 0.0) schedule.decide(4, calm_gain_of(before));
    schedule.decide(sample, gain);
    return schedule.resting() ? 0 : schedule.probes(sample + 1) ? 1 : 2;
  };
  for (const std::uint32_t sample : {4u, 8u, 16u, 64u}) {
    INFO("sample " << sample);
    const int in_doubt = sample < 8 ? 1 : 0;
    for (const double before : {0.0, 3.0}) {  // also where all paths were guided
      CHECK(taken_part(sample, doubtful_gain_of(2.01 / lowered, 0.3), before) == 2);
      CHECK(taken_part(sample, doubtful_gain_of(2.0, 0.4), before) == in_doubt);
      CHECK(taken_part(sample, doubtful_gain_of(2.01, 0.15), before) == 2);
    }
    CHECK(taken_part(sample, doubtful_gain_of(1.99 / lowered, 0.3)) == (sample < 16 ? 1 : 0));
    CHECK(taken_part(sample, doubtful_gain_of(0.9, 0.9)) == 0);
  }
  guiding_gain little_light = noisy_gain_of(1.0, 60.0);  // few paths do not measure it
  little_light.typical_error = 0.9;
  CHECK(taken_part(16, little_light) == 2);
  CHECK(doubtful_gain_of(2.0, 0.2).mean_with(doubtful_gain_of(2.0, 0.4)).typical_error == Approx(0.3));
}

TEST_CASE("rest: a guide rests between comparisons, and only where its gain is known and too small",
          "[rest]") {
  rest_schedule schedule(1.25f, 1);
  schedule.decide(8, gain_of(1.05));
  CHECK(samples_where(40, [&](std::uint32_t s) { return s > 8 && !schedule.rests(s); }) == numbers{16, 32});
  CHECK(samples_where(40, [&](std::uint32_t s) { return s > 8 && schedule.probes(s); }) == numbers{16, 32});
  for (std::uint32_t sample = 9; sample <= 16; ++sample) schedule.count(sample);
  CHECK(schedule.rested() == 7);
  schedule.decide(16, calm_gain_of(1.26));
  CHECK(!schedule.resting());
  schedule.decide(32, calm_gain_of(1.24));
  CHECK(schedule.resting());

  guiding_gain few = gain_of(0.5), dark = gain_of(0.5);
  few.paths = guiding_gain::least_paths - 1;
  dark.unguided_mean = 0.92;  // unguided paths miss light: their variance lies there
  for (const guiding_gain& unknown : {few, dark, guiding_gain()}) {
    schedule.decide(64, gain_of(0.5));
    REQUIRE(schedule.resting());
    schedule.decide(64, unknown);
    CHECK(!schedule.resting());
    CHECK(!schedule.probes(65));
  }
  guiding_gain by_chance = gain_of(0.5);
  by_chance.unguided_mean = 0.94;  // of 4096 paths, as likely as not
  CHECK(by_chance.is_known());
  by_chance.paths *= 100;
  CHECK(!by_chance.is_known());
}

TEST_CASE("rest: in much noise least_gain less 0.3 is enough, within 0.95 to 1.15", "[rest]") {
  const auto taken_part = [](float least_gain, double gain) {
    rest_schedule schedule(least_gain, 1);
    schedule.decide(16, noisy_gain_of(gain, 10.0));
    return schedule.resting() ? 0 : schedule.probes(17) ? 1 : 2;
  };
  for (const auto& [least_gain, enough] : std::vector<std::pair<float, double>>{
           {1.0f, 0.95}, {1.1f, 0.95}, {1.25f, 0.95}, {1.4f, 1.1}, {1.7f, 1.15}, {2.5f, 1.15}}) {
    INFO("least gain " << least_gain);
    CHECK(taken_part(least_gain, enough + 0.01) == 2);
    CHECK(taken_part(least_gain, enough - 0.01) == 1);
    CHECK(taken_part(least_gain, enough - 0.06) == 0);
  }
}

TEST_CASE("rest: the more noise, the less is asked for, from 1.25 times the square of the mean on",
          "[rest]") {
  const auto enough = [](float least_gain, double noise) {
    return rest_schedule(least_gain, 1).enough(noise);
  };
  for (const double little : {0.0, 0.5, 1.25}) CHECK(enough(2.0f, little) == 2.0f);
  CHECK(enough(2.0f, 1.5625) == Approx(1.6f));
  CHECK(enough(2.0f, 2.0) == Approx(1.25f));
  for (const double much : {2.5, 10.0, 50.0}) CHECK(enough(2.0f, much) == Approx(1.15f));
  CHECK(enough(1.25f, 1.5625) == Approx(1.0f));
  CHECK(enough(1.25f, 2.0) == Approx(0.95f));
  CHECK(enough(2.0f, 51.0) == Approx(0.95f));

  rest_schedule guides(2.0f, 1), probes(2.0f, 1), rests(2.0f, 1);
  guides.decide(16, noisy_gain_of(1.61, 1.5625));
  CHECK(!guides.guides_few(17));
  probes.decide(16, noisy_gain_of(1.57, 1.5625));
  CHECK(probes.probes(17));
  rests.decide(16, noisy_gain_of(1.54, 1.5625));
  CHECK(rests.resting());
  // At first guides still learn: no more is asked for than without noise.
  rest_schedule learns(2.0f, 1), gains_little(2.0f, 1);
  learns.decide(4, noisy_gain_of(1.26, 1.5625));
  CHECK(learns.probes(5));
  gains_little.decide(4, noisy_gain_of(1.24, 1.5625));
  CHECK(gains_little.resting());
}

/// What unguided paths of this noise show.
guiding_gain unguided_of(double noise) {
  guiding_gain gain;
  gain.paths = guiding_gain::least_paths;
  gain.unguided_mean = 0.5;
  gain.typical_unguided = 0.25 * noise;
  return gain;
}

TEST_CASE("rest: in little noise a guide waits for two million paths, at most 28 samples", "[rest]") {
  const auto begins_at = [](double noise, std::size_t paths, std::uint32_t sample = 2) {
    rest_schedule schedule(1.25f, 1);
    schedule.see_unguided(sample, unguided_of(noise), paths);
    return schedule.unguided_sample();
  };
  CHECK(begins_at(1.24, 10000) == 29);
  CHECK(begins_at(1.26, 10000) == 1);
  CHECK(begins_at(0.0, 1u << 18) == 9);
  CHECK(begins_at(0.0, (1u << 18) + 1) == 9);
  CHECK(begins_at(0.0, (1u << 18) - 1) == 10);
  CHECK(begins_at(0.0, 1u << 19) == 5);
  CHECK(begins_at(0.0, 1u << 20) == 1);  // two samples have as many paths
  CHECK(begins_at(0.0, std::size_t(1) << 40) == 1);
  CHECK(begins_at(0.0, 10000, 1) == 1);
  guiding_gain few = unguided_of(0.5);
  --few.paths;
  guiding_gain dark = unguided_of(0.5), no_number = dark;
  dark.unguided_mean = dark.typical_unguided = 0.0;  // light was not found yet
  no_number.typical_unguided = std::nan("");
  for (const guiding_gain& unknown : {few, dark, no_number}) {
    rest_schedule schedule(1.25f, 1);
    schedule.see_unguided(2, unknown, 10000);
    CHECK(!schedule.resting());
  }

  rest_schedule schedule(1.25f, 1);
  schedule.see_unguided(2, unguided_of(0.5), 10000);
  CHECK(schedule.weight() == 1.0f);
  CHECK(samples_where(70, [&](std::uint32_t s) { return s > 2 && !schedule.rests(s); }) ==
        numbers{29, 30, 31, 32, 36, 44, 60});
  CHECK(samples_where(70, [&](std::uint32_t s) { return s > 2 && schedule.probes(s); }) ==
        numbers{29, 30, 31, 32, 36, 44, 60});
  CHECK(samples_where(70, [&](std::uint32_t s) { return schedule.is_unguided(s); }) == numbers{1, 2, 29, 30});
  CHECK(!schedule.rests(2));
  schedule.see_unguided(30, unguided_of(0.5), 10000);  // it waits once
  CHECK(schedule.unguided_sample() == 29);
  schedule.decide(32, calm_gain_of(3.0));
  CHECK(!schedule.guides_few(33));

  rest_schedule late(1.25f, 29);  // more samples were made than it would wait for
  late.see_unguided(30, unguided_of(0.5), 10000);
  CHECK(!late.resting());
}

TEST_CASE("rest: choices of lights rest where they gain little, or where little noise is left", "[rest]") {
  const auto waits = [](double noise) {
    rest_schedule schedule(1.25f, 1);
    schedule.see_unguided(2, unguided_of(noise), 10000);
    return schedule;
  };
  CHECK(waits(0.24).lights_rest({}));
  CHECK(!waits(0.26).lights_rest({}));
  const auto rest_after = [&](double first, double learnt, double gain) {
    rest_schedule schedule = waits(first);
    schedule.see_unguided(30, unguided_of(learnt), 10000);
    schedule.decide(32, gain_of(gain));
    return schedule.lights_rest(gain_of(gain));
  };
  // Half of what was seen first was without what was learnt: 0.9 is the mean of 1.0 and 0.8.
  CHECK(!rest_after(0.901, 0.8, 1.0));
  CHECK(rest_after(0.899, 0.8, 1.0));
  CHECK(!rest_after(0.899, 0.8, 1.01));
  CHECK(rest_after(0.8, 0.9, 1.24));   // they lost by chance alone
  CHECK(rest_after(0.24, 0.1, 1.24));  // they rested meanwhile
  CHECK(!rest_after(0.24, 0.1, 1.26));
  // With more unguided samples, choices of lights had learnt before both: 1.25 is the whole ratio.
  for (const auto& [first, rests] :
       {std::pair(0.901, true), std::pair(0.999, true), std::pair(1.001, false)}) {
    rest_schedule late(1.25f, 2);
    late.see_unguided(3, unguided_of(first), 10000);
    late.see_unguided(30, unguided_of(0.8), 10000);
    CHECK(late.lights_rest(gain_of(1.0)) == rests);
  }
  const rest_schedule never_waited(1.25f, 1);
  CHECK(never_waited.lights_rest(gain_of(1.24)));
  CHECK(!never_waited.lights_rest(gain_of(1.26)));

  rest_schedule forgets = waits(1.0);
  forgets.see_unguided(30, unguided_of(0.5), 10000);
  forgets.restart(31);
  CHECK(forgets.lights_rest(gain_of(1.24)));
}

TEST_CASE("rest: a guide that waits is saved, restored and woken up", "[rest]") {
  rest_schedule schedule(1.25f, 1);
  schedule.see_unguided(2, unguided_of(0.5), 10000);
  const rest_schedule::state state = schedule.saved();
  rest_schedule restored(1.25f, 1);
  REQUIRE(restored.restore(10, state));
  CHECK(samples_where(70, [&](std::uint32_t s) { return restored.rests(s) != schedule.rests(s); }).empty());
  restored.see_unguided(30, unguided_of(0.3), 10000);
  CHECK(restored.saved().light_gain == Approx(2.0 * 0.5 / 0.3 - 1.0));

  const auto refused = [&](void (*change)(rest_schedule::state&)) {
    rest_schedule::state changed = state;
    change(changed);
    return !rest_schedule(1.25f, 1).restore(10, changed);
  };
  CHECK(!refused([](rest_schedule::state&) {}));
  CHECK(refused([](rest_schedule::state& s) { s.unguided = 30; }));
  CHECK(refused([](rest_schedule::state& s) { s.unguided = 3; }));
  CHECK(refused([](rest_schedule::state& s) { s.first_unguided = 0; }));
  CHECK(refused([](rest_schedule::state& s) { s.first_unguided = 10; }));
  CHECK(refused([](rest_schedule::state& s) { s.first_noise = 1.25f; }));
  CHECK(refused([](rest_schedule::state& s) { s.unguided = 0; }));
  CHECK(refused([](rest_schedule::state& s) { s.first_noise = -1.0f; }));
  CHECK(refused([](rest_schedule::state& s) { s.first_noise = std::nanf(""); }));
  CHECK(refused([](rest_schedule::state& s) { s.light_gain = 0.5f; }));
  CHECK(refused([](rest_schedule::state& s) { s.light_gain = std::nanf(""); }));

  schedule.restart(10);
  CHECK(schedule.unguided_sample() == 11);
  CHECK(!schedule.resting());
}

TEST_CASE("rest: where few paths find light, a gain of about 1 is enough to go on", "[rest]") {
  const auto gain_in_little_light = [](double value) { return noisy_gain_of(value, 60.0); };
  for (const std::uint32_t sample : {4u, 32u}) {
    rest_schedule calm(2.0f, 1), noisy(2.0f, 1), unsure(2.0f, 1), worse(2.0f, 1);
    calm.decide(sample, calm_gain_of(1.2));
    CHECK(calm.resting());
    noisy.decide(sample, gain_in_little_light(0.96));
    CHECK(!noisy.resting());
    CHECK(!noisy.probes(sample + 1));
    unsure.decide(sample, gain_in_little_light(0.93));
    CHECK(unsure.probes(sample + 1));
    worse.decide(sample, gain_in_little_light(0.88));
    CHECK(worse.resting());
  }
}

TEST_CASE("rest: longer paths have to gain more, and bright ones decide nothing", "[rest]") {
  guiding_gain bright = calm_gain_of(1.1);
  bright.unguided_variance *= 100.0;
  CHECK(bright.typical_value() == Approx(1.1));
  for (const std::uint32_t sample : {4u, 32u}) {
    rest_schedule unmoved(2.5f, 1);
    unmoved.decide(sample, bright);
    CHECK(unmoved.resting());
  }
  guiding_gain longer = calm_gain_of(3.0);
  longer.unguided_vertices = 2.0;
  longer.guided_vertices = 3.0;
  CHECK(longer.value() == Approx(3.0));
  CHECK(longer.typical_value() == Approx(2.0));
  rest_schedule schedule(2.5f, 1);
  schedule.decide(32, longer);
  CHECK(schedule.resting());
}

TEST_CASE("rest: a guided sample weighs as much as its gain, from 1 to 16", "[rest]") {
  rest_schedule schedule(1.25f, 1);
  CHECK(schedule.weight() == 1.0f);
  for (const auto& [gain, weight] : {std::pair(3.0, 3.0f), std::pair(0.5, 1.0f), std::pair(100.0, 16.0f)}) {
    schedule.decide(4, gain_of(gain));
    CHECK(schedule.weight() == Approx(weight));
  }
  guiding_gain missed = gain_of(2.0);
  missed.unguided_mean = 0.5;
  schedule.decide(4, missed);
  CHECK(schedule.weight() == 4.0f);
  missed.unguided_mean = 0.85;  // by chance, may be
  schedule.decide(4, missed);
  CHECK(schedule.weight() == Approx(2.0f));
  schedule.decide(4, gain_of(3.0));
  guiding_gain few = gain_of(7.0);
  few.paths = 10;
  schedule.decide(4, few);
  CHECK(schedule.weight() == 1.0f);
}

TEST_CASE("rest: a mean of gains is that of its variances, and begins with the first", "[rest]") {
  const guiding_gain first = gain_of(6.0), second = gain_of(2.0);
  CHECK(first.mean_with({}).value() == Approx(6.0));
  CHECK(second.mean_with(first).value() == Approx(4.0));
  CHECK(second.mean_with(first).paths == second.paths);
  CHECK(second.mean_with(second.mean_with(first)).value() == Approx(3.0));
  CHECK(second.mean_with(first).typical_value() == Approx(4.0));
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
  rest_schedule resting(1.25f, 1), probing(1.25f, 1), guiding(1.25f, 1);
  resting.decide(8, gain_of(0.9));
  guiding.decide(8, gain_of(3.0));
  CHECK(guiding.weight() == 3.0f);
  for (rest_schedule* s : {&resting, &probing, &guiding}) s->restart(20);
  CHECK(samples_where(60, [&](std::uint32_t s) { return resting.is_unguided(s); }) ==
        numbers{21, 22, 25, 29});
  CHECK(samples_where(60, [&](std::uint32_t s) { return resting.compares(s); }) ==
        numbers{23, 24, 28, 36, 52});
  CHECK(samples_where(60, [&](std::uint32_t s) {
          return resting.rests(s) || (s > 20) != resting.probes(s);
        }).empty());
  for (const rest_schedule& on : {probing, guiding}) {
    CHECK(samples_where(60, [&](std::uint32_t s) { return on.compares(s) || on.guides_few(s); }).empty());
    CHECK(on.weight() == 1.0f);  // of what was forgotten
  }
}

TEST_CASE("rest: a host that moves something after each sample has a guide that takes part in all paths",
          "[rest]") {
  rest_schedule schedule(1.25f, 1);
  for (std::uint32_t sample = 1; sample <= 20; ++sample) schedule.restart(sample);
  CHECK(samples_where(60, [&](std::uint32_t s) { return s > 1 && schedule.guides_few(s); }).empty());
  schedule = rest_schedule(1.25f, 1);
  schedule.decide(8, gain_of(0.9));
  for (std::uint32_t sample = 9; sample <= 20; ++sample) schedule.restart(sample);
  CHECK(samples_where(60, [&](std::uint32_t s) { return s > 20 && schedule.guides_few(s); }).empty());
}

TEST_CASE("rest: what moves before the unguided sample changes nothing, and no sample before it records few",
          "[rest]") {
  rest_schedule schedule(1.25f, 2);
  CHECK(samples_where(20, [&](std::uint32_t s) { return !schedule.probes(s); }) == numbers{1});
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
  using state = rest_schedule::state;
  CHECK(schedule.restore(20, state{1, 12, 0, 2.0f, 3.0f}));
  CHECK(schedule.rests(21));
  CHECK(schedule.weight() == 2.0f);
  CHECK(schedule.threshold(32) == 3.0f);
  const state kept = schedule.saved();
  CHECK((kept.unguided == 1 && kept.rested == 12 && kept.takes_part == 0 && kept.weight == 2.0f));
  CHECK(schedule.restore(20, state{1, 12, 1, 1.0f}));
  CHECK(schedule.probes(21));
  for (const state& wrong :
       {state{1, 21, 0, 1.0f}, state{0, 2, 0, 1.0f}, state{23, 2, 2, 1.0f}, state{0, 2, 1, 1.0f},
        state{1, 2, 3, 1.0f}, state{1, 2, 2, 0.5f}, state{1, 2, 2, 17.0f}, state{1, 2, 2, std::nanf("")},
        state{1, 2, 2, 1.0f, 0.5f}, state{1, 2, 2, 1.0f, std::nanf("")}})
    CHECK(!schedule.restore(20, wrong));
  CHECK(rest_schedule(1.25f, 3).restore(1, state{3, 0, 1, 1.0f}));  // before the unguided sample
  CHECK(rest_schedule(1.25f, 1).restore(20, state{21, 3, 1, 1.0f}));
}

}  // namespace
