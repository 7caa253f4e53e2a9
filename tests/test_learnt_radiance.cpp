// What fields learn. Means in 4 and in 2 bytes, exact sums of many threads in any order, dropped values. Also
// a field store whose fields turn toward light that paths found.
#include "support/evaluate.hpp"
#include "support/fields.hpp"
#include "support/kept_fields.hpp"
#include "support/policies.hpp"

#include <wfpg/guides/octree/learnt_radiance.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

using namespace wfpg_test;
using wfpg::learnt_mean;
using wfpg::mixed_with;
using wfpg::stochastic_mean16;

TEST_CASE("learnt mean: 255 values have a relative error of 2^-17 each", "[learnt_radiance]") {
  learnt_mean mean;
  CHECK(mean.count() == 0);
  double sum = 0.0;
  random_numbers random(1);
  for (std::uint32_t n = 1; n <= 255; ++n) {
    const double value = std::pow(10.0, 6.0 * static_cast<double>(random.unit()) - 3.0);
    sum += value;
    mean.add(value, 1);
    CHECK(mean.count() == n);
  }
  CHECK(std::abs(static_cast<double>(mean.mean()) / (sum / 255.0) - 1.0) < 255.0 / 0x1p17);
  learnt_mean at_once;
  at_once.add(sum, 255);
  CHECK(std::abs(static_cast<double>(at_once.mean()) / (sum / 255.0) - 1.0) < 1.0 / 0x1p17);
}

TEST_CASE("learnt mean: old values fade after 255 values", "[learnt_radiance]") {
  learnt_mean mean;
  mean.add(1000.0, 1000);
  CHECK(mean.mean() == 1.0f);
  CHECK(mean.count() == 255);
  for (int i = 0; i < 256; ++i) mean.add(3.0, 1);
  const double left = std::pow(255.0 / 256.0, 256.0);
  CHECK(std::abs(static_cast<double>(mean.mean()) - (3.0 - 2.0 * left)) < 0.01);
  for (int i = 0; i < 4000; ++i) mean.add(0.0, 1);
  CHECK(mean.mean() < 1e-5f);
}

TEST_CASE("learnt mean: zero, tiny and huge values keep their precision", "[learnt_radiance]") {
  learnt_mean mean;
  mean.add(0.0, 7);
  CHECK(mean.mean() == 0.0f);
  CHECK(mean.count() == 7);
  for (double value : {2e-38, 1e-30, 1.0, 1e30}) {
    learnt_mean one;
    one.add(value, 1);
    CHECK(std::abs(static_cast<double>(one.mean()) / value - 1.0) < 1.0 / 0x1p16);
  }
}

TEST_CASE("stochastic_mean16: representable means are exact", "[learnt_radiance]") {
  random_numbers random(2);
  for (std::uint32_t n : {1u, 2u, 3u, 4u, 6u, 8u, 12u, 16u, 24u, 32u, 48u, 64u, 96u, 128u, 192u})
    for (const double value : {0.0, 0x1p-63, 1.0, 1.5, 1.03125, 63.0, 0x1p63}) {
      stochastic_mean16 mean;
      CHECK(mean.count() == 0);
      CHECK(mean.mean() == 0.0f);
      mean.add(value * n, n, random.below(0xffffffffu));
      CHECK(static_cast<double>(mean.mean()) == value);
      CHECK(mean.count() == n);
    }
}

TEST_CASE("stochastic_mean16: values out of range become the nearest representable one",
          "[learnt_radiance]") {
  for (const std::uint32_t random : {0u, 0xffffffffu}) {
    stochastic_mean16 small, large;
    small.add(1e-30, 1, random);
    CHECK(small.mean() == 0.0f);
    large.add(1e30, 1, random);
    CHECK(large.mean() > 0x1.fp63f);
    CHECK(large.mean() < 0x1p64f);
    CHECK(large.count() == 1);
  }
}

TEST_CASE("stochastic_mean16: stochastic rounding is unbiased", "[learnt_radiance]") {
  random_numbers random(3);
  constexpr int trials = 20000;
  for (const std::uint32_t values : {5u, 20u, 60u, 100u}) {  // far below the largest count
    double means = 0.0, squares = 0.0, counts = 0.0, exact = 0.0;
    for (std::uint32_t i = 0; i < values; ++i) exact += (1.0 + i % 7) / values;
    for (int trial = 0; trial < trials; ++trial) {
      stochastic_mean16 mean;
      for (std::uint32_t i = 0; i < values; ++i) mean.add(1.0 + i % 7, 1, random.below(0xffffffffu));
      means += static_cast<double>(mean.mean()) / trials;
      squares += static_cast<double>(mean.mean() * mean.mean()) / trials;
      counts += static_cast<double>(mean.count()) / trials;
    }
    INFO(values << " values");
    const double deviation = std::sqrt(std::max(squares - means * means, 0.0) / trials);
    // Errors of counts change the weights of values. This changes the mean in second order only.
    CHECK(std::abs(means - exact) < 4.0 * deviation + 0.01 * exact);
    CHECK(std::abs(counts / values - 1.0) < 0.02);
  }
}

TEST_CASE("stochastic_mean16: old values fade after 192 values", "[learnt_radiance]") {
  random_numbers random(4);
  stochastic_mean16 mean;
  mean.add(1000.0, 1000, 0);
  CHECK(mean.mean() == 1.0f);
  CHECK(mean.count() == 192);
  for (int i = 0; i < 2000; ++i) mean.add(3.0, 1, random.below(0xffffffffu));
  CHECK(mean.mean() == Approx(3.0f).epsilon(0.05));
  for (int i = 0; i < 20000; ++i) mean.add(0.0, 1, random.below(0xffffffffu));
  CHECK(mean.mean() < 1e-5f);
}

TEST_CASE("a cone counts as several values beside a mean", "[learnt_radiance]") {
  stochastic_mean16 mean;
  CHECK(mixed_with(mean, 5.0f, 1.0f) == 5.0f);
  mean.add(6.0, 3, 0);
  CHECK(mixed_with(mean, 6.0f, 1.0f) == 3.0f);
  CHECK(mixed_with(mean, 4.0f, 3.0f) == 3.0f);
}

namespace {

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
const vec3 up(0.0f, 0.0f, 1.0f);

/// Fields over hemispheres above z, of 2 x 2 cells, and the values deposited in them.
template <class Exec>
struct deposited_fields {
  static constexpr std::uint32_t cells = 4;

  Exec exec;
  wfpg::buffer<wfpg::resident_field, Exec> fields;
  wfpg::detail::value_queue<Exec> queue;

  deposited_fields(std::size_t count, std::size_t capacity)
      : fields(exec, std::vector<wfpg::resident_field>(count, {up, 0.7f})),
        queue(exec, capacity, count * cells) {}

  wfpg::learnt_radiance_view view() const {
    return {const_view<wfpg::resident_field>(fields), 2, queue.view()};
  }
  /// Mean and count of every cell.
  std::vector<stochastic_mean16> means() {
    queue.sum(exec);
    const wfpg::buffer<stochastic_mean16, Exec> means(exec,
                                                      std::vector<stochastic_mean16>(fields.size() * cells));
    exec.for_each_block(fields.size(), 0, wfpg::detail::fold_learnt{1, cells, queue.view(), means.data()});
    queue.end_takes(exec);
    return means.to_host(exec);
  }
};

/// Thread i's value, over twenty orders of magnitude, and its field.
WFPG_HD float deposited_value(std::uint32_t i) {
  const float u = hashed_numbers{5}(i, 0).x;
  return std::exp(46.0f * u - 23.0f);
}
WFPG_HD std::uint32_t deposited_field(std::uint32_t i) {
  return (i * 2654435761u) >> 29;
}

WFPG_TEST_CASE("learnt radiance: means of many threads' values do not depend on the order",
               "[learnt_radiance]") {
  constexpr std::uint32_t threads = 5000, fields = 8;
  std::vector<stochastic_mean16> first;
  for (const bool backwards : {false, true}) {
    deposited_fields<Exec> deposited(fields, threads);
    const wfpg::learnt_radiance_view view = deposited.view();
    deposited.exec.for_each(threads, [=] WFPG_HD(std::size_t thread) {
      const auto n = static_cast<std::uint32_t>(thread);
      const std::uint32_t i = backwards ? threads - 1 - n : n;
      view.deposit(deposited_field(i), up, deposited_value(i));
    });
    const std::vector<stochastic_mean16> means = deposited.means();
    for (std::uint32_t field = 0; field < fields; ++field) {
      double sum = 0.0, count = 0.0;
      for (std::uint32_t i = 0; i < threads; ++i)
        if (deposited_field(i) == field) {
          sum += static_cast<double>(deposited_value(i));
          count += 1.0;
        }
      double mean = 0.0;
      for (std::uint32_t cell = 0; cell < 4; ++cell)
        mean += static_cast<double>(means[4 * field + cell].mean());
      CHECK(std::abs(mean / (sum / count) - 1.0) < 1.0 / 32);
    }
    if (backwards)
      CHECK(std::memcmp(first.data(), means.data(), means.size() * sizeof(stochastic_mean16)) == 0);
    first = means;
  }
}

WFPG_TEST_CASE("learnt radiance: invalid values, and values without a field, are dropped",
               "[learnt_radiance]") {
  deposited_fields<Exec> deposited(2, 10);
  const wfpg::learnt_radiance_view view = deposited.view();
  CHECK(!view.empty());
  CHECK(wfpg::learnt_radiance_view().empty());
  deposited.exec.for_each(1, [=] WFPG_HD(std::size_t) {
    view.deposit(0, up, not_a_number);
    view.deposit(0, up, -1.0f);
    view.deposit(0, up, 1.0f / 0.0f);
    view.deposit(0, vec3(not_a_number), 1.0f);
    view.deposit(0, -up, 1.0f);
    view.deposit(2, up, 1.0f);
    view.deposit(wfpg::no_field, up, 1.0f);
    view.deposit(0, up, 2.0f);
    view.deposit(1, up, 4.0f);
    view.deposit(0, up, -0.0f);
    view.deposit(1, up, 5.0f);  // one too many
  });
  const std::vector<stochastic_mean16> means = deposited.means();
  std::uint32_t counts[2] = {0, 0};
  float sums[2] = {0.0f, 0.0f};
  for (std::uint32_t i = 0; i < 8; ++i) {
    counts[i / 4] += means[i].count();
    sums[i / 4] += means[i].mean();
  }
  CHECK(counts[0] == 2);
  CHECK(sums[0] == 1.0f);
  CHECK(counts[1] == 1);
  CHECK(sums[1] == 4.0f);
}

WFPG_TEST_CASE("learnt radiance: values beside far brighter ones are learnt", "[learnt_radiance]") {
  // The cells of 300 fields: the first 128 fields share the unit of their sums.
  deposited_fields<Exec> deposited(300, 1000);
  const wfpg::learnt_radiance_view view = deposited.view();
  const auto mean_of = [&](std::uint32_t field) {
    const std::vector<stochastic_mean16> means = deposited.means();
    double sum = 0.0;
    for (std::uint32_t cell = 0; cell < 4; ++cell) sum += static_cast<double>(means[4 * field + cell].mean());
    return sum;
  };
  deposited.exec.for_each(1, [=] WFPG_HD(std::size_t) {
    view.deposit(0, up, 1.0e4f);
    view.deposit(1, up, 1.0e-4f);
  });
  CHECK(mean_of(1) == Approx(1.0e-4).epsilon(1.0 / 32));
  // Infinite light in practice, which would hide others. Fields further away have their own unit.
  deposited.exec.for_each(1, [=] WFPG_HD(std::size_t) {
    view.deposit(0, up, 3.0e38f);
    view.deposit(200, up, 1.0e-4f);
  });
  CHECK(mean_of(200) == Approx(1.0e-4).epsilon(1.0 / 32));
  deposited.exec.for_each(1, [=] WFPG_HD(std::size_t) { view.deposit(0, up, 3.0e38f); });
  CHECK(mean_of(0) > 0x1.fp63);  // the largest mean
  // Dark values alone count, too.
  deposited.exec.for_each(1, [=] WFPG_HD(std::size_t) { view.deposit(290, up, 0.0f); });
  std::uint32_t counts = 0;
  for (const stochastic_mean16& mean : deposited.means()) counts += mean.count();
  CHECK(counts == 1);
  // Sums that are not taken, as where a fold fails, are forgotten once their keys' group has new values.
  // In the next unit this one would be 0.6 of the value below.
  deposited.exec.for_each(1, [=] WFPG_HD(std::size_t) { view.deposit(1, up, 0x1p40f); });
  deposited.queue.sum(deposited.exec);
  // The unit of a sample's sums does not stay for the next one.
  deposited.exec.for_each(1, [=] WFPG_HD(std::size_t) { view.deposit(1, up, 1.0e-4f); });
  CHECK(mean_of(1) == Approx(1.0e-4).epsilon(1.0 / 32));
}

/// Deposits one value in one call, and three in several.
template <class Exec>
void deposit_values(const Exec& exec, const wfpg::learnt_radiance_view& view) {
  exec.for_each(100, [=] WFPG_HD(std::size_t) {
    view.deposit(0, up, 1.0f);
    const std::uint32_t first = view.reserve(3);
    for (std::uint32_t i = 0; i < 3; ++i) view.write(first + i, i, up, 1.0f);
  });
}

WFPG_TEST_CASE("learnt radiance: an empty view drops all deposits", "[learnt_radiance]") {
  const Exec exec;
  deposit_values(exec, {});
  auto options = slots_of(16, 10, 4, false);
  const kept_box<Exec> does_not_learn(options, wfpg::guiding_mode::oriented, 0, 1000);
  CHECK(does_not_learn.store.learnt().empty());
  deposit_values(exec, does_not_learn.store.learnt());
  options = slots_of(16, 10, 4, true);
  const kept_box<Exec> no_room(options);  // for values
  CHECK(no_room.store.learnt().empty());
  deposit_values(exec, no_room.store.learnt());
}

/// The fraction of a field's directions in the cell around a direction.
template <class Exec>
double fraction_around(const kept_box<Exec>& box, const wfpg::guide_view& view, vec3 direction) {
  const std::vector<float> fraction = evaluate(box.exec(), std::size_t(1), [=] WFPG_HD(std::size_t) {
    const wfpg::directional_field field = view.mixture(0).field;
    return field.pdf(direction) * field.cell_solid_angle();
  });
  return static_cast<double>(fraction[0]);
}

WFPG_TEST_CASE("learnt radiance: a field turns toward light that paths found, and forgets",
               "[learnt_radiance]") {
  kept_box<Exec> box(slots_of(16, 100, 4, true), wfpg::guiding_mode::oriented, 0, 1000);
  box.box.cache.clear(box.exec());  // cones see nothing
  box.field.filter_alpha = 0.0f;
  const auto wave = rays_at({0.5f, 0.5f, 0.0f}, up, 20);
  const vec3 lit = glm::normalize(vec3(0.4f, 0.3f, 0.8f));
  wfpg::guide_view view = box.whole_sample(wave);
  CHECK(fraction_around(box, view, lit) == Approx(1.0 / 256.0).epsilon(1e-4));
  box.begin();
  view = box.prepare_all(wave);
  const wfpg::learnt_radiance_view learnt = box.store.learnt();
  box.exec().for_each(50, [=] WFPG_HD(std::size_t) {
    const std::uint32_t field = view.mixture(0).number;
    learnt.deposit(field, lit, 4.0f);
    learnt.deposit(field, up, 0.0f);
  });
  box.end();
  view = box.whole_sample(wave);
  CHECK(fraction_around(box, view, lit) > 0.98);  // except for the floor
  CHECK(fraction_around(box, view, up) < 0.001);
  box.store.forget(box.exec());
  CHECK(fraction_around(box, box.whole_sample(wave), lit) == Approx(1.0 / 256.0).epsilon(1e-4));
}

WFPG_TEST_CASE("learnt radiance: deposits wait for the end of a sample that learns", "[learnt_radiance]") {
  kept_box<Exec> box(slots_of(16, 100, 4, true), wfpg::guiding_mode::oriented, 0, 1000);
  box.box.cache.clear(box.exec());
  box.field.filter_alpha = 0.0f;
  const auto wave = rays_at({0.5f, 0.5f, 0.0f}, up, 20);
  box.whole_sample(wave);
  box.begin();
  const wfpg::guide_view view = box.prepare_all(wave);
  const wfpg::learnt_radiance_view learnt = box.store.learnt();
  box.exec().for_each(50, [=] WFPG_HD(std::size_t) { learnt.deposit(view.mixture(0).number, up, 4.0f); });
  box.store.end_sample(box.exec(), false);
  CHECK(fraction_around(box, box.whole_sample(wave), up) == Approx(1.0 / 256.0).epsilon(1e-4));
  CHECK(fraction_around(box, box.whole_sample(wave), up) > 0.98);
}

WFPG_TEST_CASE("learnt radiance: cones count beside it, and a field cast anew forgets", "[learnt_radiance]") {
  auto options = slots_of(16, 100, 4, true);
  options.cone_samples = 10.0f;
  kept_box<Exec> box(options, wfpg::guiding_mode::oriented, 0, 1000);
  box.field.filter_alpha = 0.0f;
  const auto wave = rays_at({0.5f, 0.5f, 0.0f}, up, 20);
  box.whole_sample(wave);
  box.begin();
  wfpg::guide_view view = box.prepare_all(wave);
  const double before = fraction_around(box, view, up);
  const wfpg::learnt_radiance_view learnt = box.store.learnt();
  box.exec().for_each(5, [=] WFPG_HD(std::size_t) { learnt.deposit(view.mixture(0).number, up, 1000.0f); });
  box.end();
  const double after = fraction_around(box, box.whole_sample(wave), up);
  CHECK(after > before);
  CHECK(after > 0.9);
  box.store.invalidate_all(box.exec());
  CHECK(fraction_around(box, box.whole_sample(wave), up) == Approx(before).epsilon(0.3));
}

}  // namespace

TEST_CASE("learnt radiance: cone_samples must be positive and finite", "[learnt_radiance]") {
  for (float samples : {0.0f, -1.0f, not_a_number, std::numeric_limits<float>::infinity()}) {
    auto options = slots_of(16, 10, 4, true);
    options.cone_samples = samples;
    CHECK_THROWS_AS((kept_box<one_policy>(options)), std::invalid_argument);
  }
}
