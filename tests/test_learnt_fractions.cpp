// What fields learn of their fraction of guided directions. Against the fraction that has the least
// divergence, found by search; in any order of threads; in any unit of light; by recorded paths.
#include "support/cached_scene.hpp"
#include "support/catch.hpp"
#include "support/evaluate.hpp"
#include "support/policies.hpp"

#include <wfpg/guides/octree/deposit_paths.hpp>
#include <wfpg/guides/octree/learnt_fractions.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

using wfpg::field_fractions;
using wfpg::fraction_constants;
using wfpg::guide_share;

namespace {

using namespace wfpg_test;

constexpr int bins = 8;
using density = std::array<double, bins>;

/// A guide, a BSDF and the light that a surface reflects, over eight equally large bins of directions.
struct situation {
  density guide, bsdf, light;
};

/// Where the light is partly the guide's, partly the BSDF's. None of them is in proportion to it.
const std::vector<situation> situations{
    {{4, 2, 1, 1, 0, 0, 0, 0}, {1, 1, 1, 1, 1, 1, 1, 1}, {5, 2, 1, 1, 1, 1, 1, 1}},
    {{1, 2, 3, 1, 1, 0, 0, 0}, {0, 1, 2, 3, 2, 1, 0, 0}, {0, 2, 9, 5, 3, 1, 0, 0}},
    {{8, 0, 0, 0, 0, 0, 0, 1}, {0, 0, 1, 2, 2, 1, 1, 1}, {3, 0, 2, 4, 4, 2, 2, 2}}};

density normalised(density of_bins) {
  double sum = 0.0;
  for (const double x : of_bins) sum += x;
  for (double& x : of_bins) x /= sum;
  return of_bins;
}

/// The fraction, times `kept`, whose mixture has the least divergence from the light.
double best_fraction(const situation& s, double kept) {
  double best = 0.0, least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= 2000; ++i) {
    const double fraction =
        fraction_constants::least + (fraction_constants::most - fraction_constants::least) * i / 2000.0;
    double divergence = 0.0;
    for (std::size_t b = 0; b < bins; ++b) {
      const double p = fraction * kept * s.guide[b] + (1.0 - fraction * kept) * s.bsdf[b];
      if (s.light[b] > 0.0) divergence -= s.light[b] * std::log(p);
    }
    if (divergence < least) {
      least = divergence;
      best = fraction;
    }
  }
  return best;
}

struct brought_light {
  float brought;
  guide_share share;
};

/// Directions of a mixture, with what each brings over its density. `off`: a factor of the shares.
std::vector<brought_light> directions_of(const situation& s, double fraction, double kept, double scale,
                                         random_numbers& random, std::size_t n, double off = 1.0) {
  std::vector<brought_light> result;
  for (std::size_t i = 0; i < n; ++i) {
    const density& drawn = static_cast<double>(random.unit()) < fraction * kept ? s.guide : s.bsdf;
    double u = static_cast<double>(random.unit());
    std::size_t b = 0;
    while (b + 1 < bins && u >= drawn[b]) u -= drawn[b++];
    const double of_guide = fraction * kept * s.guide[b];
    const double p = of_guide + (1.0 - fraction * kept) * s.bsdf[b];
    if (!(p > 0.0)) continue;
    result.push_back({static_cast<float>(scale * s.light[b] / p),
                      guide_share::of(static_cast<float>(off * of_guide), static_cast<float>(p),
                                      static_cast<float>(kept))});
  }
  return result;
}

/// Learns for some samples of 1024 directions each, and returns the last fraction.
double learnt_fraction(const situation& s, double kept, double scale, double off = 1.0, int samples = 600) {
  random_numbers random(7);
  field_fractions learning;
  learning.first = 0.7f;
  const std::uint32_t kind = kept < static_cast<double>(guide_share::least_smooth) ? 1 : 0;
  float fraction = learning.first;
  for (int sample = 0; sample < samples; ++sample) {
    for (const brought_light& d :
         directions_of(s, static_cast<double>(fraction), kept, scale, random, 1024, off))
      learning.add(d.brought, d.share);
    fraction = learning.learn(kind, fraction);
  }
  return static_cast<double>(fraction);
}

}  // namespace

TEST_CASE("fractions: they become those of the least divergence", "[learnt_fractions]") {
  for (situation s : situations) {
    s.guide = normalised(s.guide);
    s.bsdf = normalised(s.bsdf);
    s.light = normalised(s.light);
    for (const double kept : {1.0, 0.5}) {
      const double best = best_fraction(s, kept), found = learnt_fraction(s, kept, 1.0);
      CAPTURE(kept, best, found);
      CHECK(std::abs(found - best) < 0.03);
      // Shares that are a tenth too small lead elsewhere, where the best fraction is not at a bound.
      if (best < 0.8 && best > 0.2) CHECK(std::abs(learnt_fraction(s, kept, 1.0, 0.9) - best) > 0.03);
    }
  }
}

TEST_CASE("fractions: the unit of light does not matter", "[learnt_fractions]") {
  situation s = situations[1];
  s.guide = normalised(s.guide);
  s.bsdf = normalised(s.bsdf);
  const double found = learnt_fraction(s, 1.0, 1.0, 1.0, 40);
  for (const double unit : {1e-20, 1e-6, 1e20}) {
    CAPTURE(unit);
    CHECK(std::abs(learnt_fraction(s, 1.0, unit, 1.0, 40) - found) < 1e-3);
  }
}

TEST_CASE("fractions: few directions change them little, and no light nothing", "[learnt_fractions]") {
  field_fractions learning;
  learning.first = 0.7f;
  const guide_share none = guide_share::of(0.0f, 1.0f, 1.0f), all = guide_share::of(1.0f, 1.0f, 1.0f);
  CHECK(learning.learn(0, 0.7f) == 0.7f);
  learning.add(0.0f, none);
  CHECK(learning.learn(0, 0.7f) == 0.7f);
  // Of the first light the scale alone is learnt.
  learning.add(1.0f, none);
  CHECK(learning.learn(0, 0.7f) == 0.7f);
  learning.add(1.0f, none);
  CHECK(learning.learn(0, 0.7f) == Approx(0.7f * 32.0f / 33.0f));
  // A direction of another kind of surface, of an unknown share, or that is no number.
  learning.add(1.0f, guide_share::of(0.5f, 1.0f, 0.5f));
  learning.add(1.0f, {});
  learning.add(std::numeric_limits<float>::quiet_NaN(), all);
  learning.add(std::numeric_limits<float>::infinity(), all);
  learning.add(-1.0f, all);
  CHECK(learning.learn(0, 0.65f) == 0.65f);
  // However much is learnt, both techniques stay.
  for (const guide_share share : {none, all}) {
    float fraction = 0.7f;
    for (int sample = 0; sample < 200; ++sample) {
      for (int i = 0; i < 100; ++i) learning.add(1.0f, share);
      fraction = learning.learn(0, fraction);
    }
    const bool guided = share.steps() > 0;
    CHECK(fraction == Approx(guided ? fraction_constants::most : fraction_constants::least).margin(0.01));
  }
}

TEST_CASE("fractions: one bright direction is soon forgotten", "[learnt_fractions]") {
  situation s = situations[1];
  s.guide = normalised(s.guide);
  s.bsdf = normalised(s.bsdf);
  random_numbers random(3);
  field_fractions learning;
  learning.first = 0.7f;
  learning.add(1e6f, guide_share::of(0.0f, 1.0f, 1.0f));  // it sets the first scale
  float fraction = learning.learn(0, 0.7f);
  for (int sample = 0; sample < 600; ++sample) {
    for (const brought_light& d : directions_of(s, static_cast<double>(fraction), 1.0, 1.0, random, 1024))
      learning.add(d.brought, d.share);
    fraction = learning.learn(0, fraction);
  }
  CHECK(std::abs(static_cast<double>(fraction) - best_fraction(s, 1.0)) < 0.03);
}

TEST_CASE("fractions: shares are stored in steps", "[learnt_fractions]") {
  CHECK(!guide_share().is_known());
  CHECK(!guide_share::of(1.0f, 0.0f, 1.0f).is_known());
  CHECK(!guide_share::of(0.0f, 1.0f, 0.0f).is_known());  // a lobe too narrow to be guided
  for (int i = 0; i <= 100; ++i) {
    const float share = static_cast<float>(i) / 100.0f;
    const guide_share smooth = guide_share::of(3.0f * share, 3.0f, 1.0f);
    CHECK(smooth.is_known());
    CHECK(!smooth.is_narrow());
    CHECK(std::abs(static_cast<float>(smooth.steps()) / guide_share::smooth_steps - share) <=
          0.5f / 126.0f + 1e-6f);
    const guide_share narrow = guide_share::of(0.25f * share, 1.0f, 0.25f);
    CHECK(narrow.is_known());
    CHECK(narrow.is_narrow());
    CHECK(std::abs(static_cast<float>(narrow.steps()) / guide_share::narrow_steps - share) <=
          0.5f / 31.0f + 1e-6f);
  }
  // A share of all directions on a surface that leaves the guide a quarter.
  CHECK(guide_share::of(1.0f, 1.0f, 0.25f).steps() == 4 * guide_share::narrow_steps);
}

WFPG_TEST_CASE("fractions: sums do not depend on the order of threads", "[learnt_fractions]") {
  const Exec exec{};
  const auto sums_of = [&](std::uint32_t factor) {
    const wfpg::buffer<field_fractions, Exec> learning(exec, std::vector<field_fractions>(1));
    field_fractions* const to = learning.data();
    for (int sample = 0; sample < 2; ++sample) {
      exec.for_each(std::size_t(1) << 12, [=] WFPG_HD(std::size_t at) {
        // An odd factor permutes the numbers.
        const std::uint32_t i = static_cast<std::uint32_t>(at) * factor & 0xfffu;
        const float u = static_cast<float>(wfpg::hash32(i, 5) >> 8) * 0x1p-24f;
        to->add(1.0f / (0.001f + u), wfpg::guide_share::of(u * u, u, i % 2 == 0 ? 1.0f : 0.3f));
      });
      if (sample == 0)
        exec.for_each(1, [=] WFPG_HD(std::size_t) {
          to->learn(0, 0.7f);
          to->learn(1, 0.7f);
        });
    }
    return learning.to_host(exec)[0];
  };
  const field_fractions one = sums_of(1), other = sums_of(2654435761u);
  for (int kind : {0, 1}) {
    CHECK(one.sums[kind].count == 2048);
    CHECK(one.sums[kind].light > 0);
    CHECK(one.sums[kind].light == other.sums[kind].light);
    CHECK(one.sums[kind].guided == other.sums[kind].guided);
    CHECK(one.sums[kind].largest == other.sums[kind].largest);
  }
}

WFPG_TEST_CASE("fractions: recorded paths tell what each direction brought", "[learnt_fractions]") {
  const wfpg::vec3 up(0.0f, 0.0f, 1.0f);
  cached_scene<Exec> scene(fragments_in_grid<Exec>({{{0, 0, 0}, up, 1.0f}}), 100);
  const Exec& exec = scene.exec;
  wfpg::path_recorder<Exec> recorder(exec, {1, 8, true, 0, /*directions=*/true});
  const wfpg::buffer<wfpg::resident_field, Exec> fields(exec, std::vector<wfpg::resident_field>(4));
  const wfpg::buffer<field_fractions, Exec> learning(exec, std::vector<field_fractions>(4));
  wfpg::detail::value_queue<Exec> queue(exec, 10, 16);
  const wfpg::path_recorder_view paths = recorder.view();
  // Field 1 sends the path to a surface that brings light, through half of the throughput; field 2 sends it
  // on to a gap. A direction to a gap teaches nothing, nor does one without a share.
  exec.for_each(1, [=] WFPG_HD(std::size_t) {
    paths.vertex(0, 0, wfpg::vec3(0.5f), up, wfpg::vec3(1.0f));
    paths.scatter(0, 0, up, 1, guide_share::of(0.5f, 1.0f, 1.0f));
    paths.vertex(0, 1, wfpg::vec3(0.5f), up, wfpg::vec3(0.5f));
    paths.radiance(0, 1, wfpg::vec3(2.0f));
    paths.scatter(0, 1, up, 2, guide_share::of(0.25f, 1.0f, 0.5f));
    paths.vertex(0, 2, wfpg::vec3(0.5f), up, wfpg::vec3(0.25f));
    paths.scatter(0, 2, up, 3);
    paths.vertex(0, 3, wfpg::vec3(0.5f), up, wfpg::vec3(0.25f));
    paths.scatter(0, 3, up, 0, guide_share::of(0.25f, 1.0f, 1.0f));
    paths.vertex(0, 5, wfpg::vec3(0.5f), up, wfpg::vec3(0.25f));
    paths.radiance(0, 5, wfpg::vec3(3.0f));
  });
  const wfpg::learnt_radiance_view learnt{const_view<wfpg::resident_field>(fields), 2, queue.view(),
                                          learning.data()};
  wfpg::deposit_paths(exec, recorder, scene.view(), learnt);
  const std::vector<field_fractions> found = learning.to_host(exec);
  CHECK(found[0].sums[0].count + found[0].sums[1].count == 0);
  CHECK(found[1].sums[0].count == 1);
  CHECK(wfpg::bits_float(found[1].sums[0].largest) == Approx(2.0f + 3.0f));
  CHECK(found[1].sums[1].count == 0);
  CHECK(found[2].sums[0].count == 0);
  CHECK(found[2].sums[1].count == 1);
  CHECK(wfpg::bits_float(found[2].sums[1].largest) == Approx(3.0f / 0.5f));
  CHECK(found[3].sums[0].count + found[3].sums[1].count == 0);
}
