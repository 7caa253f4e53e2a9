// Loops that fail to start, as a launch on a device may. Each loop of a sample fails in its turn, and the
// guider stays usable. What guiding gains is measured as without the fault. The policy's loops fail on
// request.
#include "support/catch.hpp"
#include "support/guiding.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"
#include "support/stepwise_samples.hpp"
#include "support/wall_paths.hpp"

#include <wfpg/base/error.hpp>
#include <wfpg/exec/cpu_policy.hpp>

#include <thrust/system/cpp/execution_policy.h>

#include <cstddef>
#include <vector>

namespace {

using namespace wfpg_test;

/// Counts loops since fail_loop(), and knows which one fails.
struct loop_count {
  std::size_t begun = 0, fails_at = 0;

  void fail_loop(std::size_t k) {
    begun = 0;
    fails_at = k;
  }
  bool failed() const { return fails_at > 0 && begun >= fails_at; }
};

/// The serial policy, except that the k-th loop throws before it starts.
class failing_policy : public wfpg::exec::cpu_policy<failing_policy, 8> {
 public:
  explicit failing_policy(wfpg::memory_resource* resource = nullptr) : cpu_policy(resource) {}
  explicit failing_policy(loop_count& loops) : cpu_policy(nullptr), loops_(&loops) {}

  auto thrust() const { return ::thrust::cpp::par(wfpg::resource_allocator<char>(resource())); }
  int concurrency() const { return 1; }

  template <class F>
  void parallel(std::size_t n, std::size_t, const F& f) const {
    if (loops_ && ++loops_->begun == loops_->fails_at)
      throw wfpg::device_error(1, "fails on request", "parallel");
    if (n > 0) f(0, n, 0);
  }

 private:
  loop_count* loops_ = nullptr;  // null: no loop fails
};

static_assert(wfpg::exec::is_execution_policy_v<failing_policy>);

/// What happens to a sample after one of its steps threw.
enum class afterwards { again, next_sample };

/// Runs some samples of which the k-th loop fails. `failed_step` is the step that threw.
std::vector<wfpg::sampled_direction> sample_with_fault(octree_guider<failing_policy>& guider,
                                                       loop_count& loops, std::size_t k, afterwards then,
                                                       int& failed_step) {
  stepwise_samples<failing_policy> samples(guider);
  failed_step = -1;
  loops.fail_loop(k);
  for (std::uint32_t sample = 0; sample < 4; ++sample) {
    samples.start(sample);
    for (int step = 0; step < samples.steps; ++step) try {
        samples.step(step);
      } catch (const wfpg::device_error&) {
        CHECK(failed_step < 0);
        failed_step = step;
        if (then == afterwards::next_sample) break;
        samples.step(step);
      }
  }
  CHECK(loops.failed() == (failed_step >= 0));
  loops.fail_loop(0);
  return samples.drawn();
}

/// Fails at each loop of some samples. Returns the number of loops.
std::size_t fail_in_samples(const guider_options& options, afterwards then) {
  const box_mesh<failing_policy> mesh{failing_policy()};
  std::vector<wfpg::sampled_direction> expected;
  for (std::size_t k = 0;; ++k) {
    int failed_step;
    loop_count loops;
    octree_guider<failing_policy> guider(failing_policy(loops), mesh.view(), options);
    const auto drawn = sample_with_fault(guider, loops, k, then, failed_step);
    if (k == 0) expected = drawn;
    INFO("loop " << k << ", step " << failed_step);
    // A repeated wave counts its rays again, which moves kept fields.
    const bool is_alike = failed_step < 0 || failed_step == stepwise_samples<failing_policy>::begin ||
                          failed_step == stepwise_samples<failing_policy>::end ||
                          options.fields == field_lifetime::transient;
    if (then == afterwards::again && is_alike) CHECK(same_draws(drawn, expected));
    check_guides(guider);
    if (k > 0 && failed_step < 0) return k - 1;
  }
}

TEST_CASE("path guider: each loop of a sample may fail, and a repeated call works", "[path_guider]") {
  std::size_t covered = 0;
  for_each_stepwise_options(
      [&](const guider_options& options) { covered += fail_in_samples(options, afterwards::again); });
  CHECK(covered > 4 * 50);
  SUCCEED(covered << " loops");
}

TEST_CASE("path guider: each loop of a sample may fail while bins adapt to few slots", "[path_guider]") {
  guider_options options = stepwise_options(field_lifetime::kept, 0);
  options.kept.budget_bytes /= 2;
  CHECK(fail_in_samples(options, afterwards::again) > 50);
}

TEST_CASE("path guider: each loop of a sample may fail, and the next sample works", "[path_guider]") {
  std::size_t covered = 0;
  for_each_stepwise_options(
      [&](const guider_options& options) { covered += fail_in_samples(options, afterwards::next_sample); });
  CHECK(covered > 4 * 50);
  SUCCEED(covered << " loops");
}

/// The gain after four samples, of which the k-th loop fails and its call is repeated. Sets `failed` where
/// there are so many loops.
wfpg::guiding_gain gain_with_fault(std::size_t k, bool& failed) {
  const failing_policy host;
  loop_count loops;
  wfpg::path_guider<failing_policy> guider(failing_policy(loops), box_mesh<failing_policy>(host).view(),
                                           rest_options());
  const auto repeated = [&](const auto& call) {
    try {
      call();
    } catch (const wfpg::device_error&) {
      call();
    }
  };
  loops.fail_loop(k);
  for (std::uint32_t sample = 1; sample <= 4; ++sample) {
    repeated([&] { guider.begin_sample(); });
    host.for_each(wall_path::count, record_wall_paths{guider.recorder(), sample, 0.4f, 0});
    repeated([&] { guider.end_sample(); });
  }
  failed = loops.failed();
  return guider.statistics().gain;
}

TEST_CASE("path guider: each loop of samples that are compared may fail, and the gain stays the same",
          "[path_guider][rest]") {
  bool failed;
  const wfpg::guiding_gain expected = gain_with_fault(0, failed);
  REQUIRE(expected.is_known());
  std::size_t loops = 0;
  for (std::size_t k = 1;; ++k) {
    const wfpg::guiding_gain found = gain_with_fault(k, failed);
    if (!failed) break;
    INFO("loop " << k);
    ++loops;
    CHECK(found.paths == expected.paths);
    CHECK(found.unguided_mean == expected.unguided_mean);
    CHECK(found.unguided_variance == expected.unguided_variance);
    CHECK(found.guided_variance == expected.guided_variance);
    CHECK(found.typical_error == expected.typical_error);
  }
  CHECK(loops > 20);
}

}  // namespace
