// Memory that runs out. Every allocation of a constructor, of a sample and of a load fails in its turn. The
// call throws, nothing leaks, and the guider stays usable. Also memory that is not zero.
#include "support/catch.hpp"
#include "support/failing_resource.hpp"
#include "support/guiding.hpp"
#include "support/poisoning_resource.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"
#include "support/stepwise_samples.hpp"

#include <wfpg/guide_file.hpp>

#include <cstdint>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace wfpg_test;
using wfpg::sampled_direction;

WFPG_TEST_CASE("path guider: each allocation of its constructor may fail", "[path_guider][memory]") {
  const box_mesh<Exec> mesh{Exec()};
  std::size_t covered = 0;
  for_each_stepwise_options([&](const guider_options& options) {
    failing_resource resource;
    const Exec exec = Exec().with_resource(&resource);
    covered += fail_at_each(resource, [&] { const octree_guider<Exec> guider(exec, mesh.view(), options); });
  });
  CHECK(covered > 4 * 30);
  print_failed(covered);
}

/// What happens to a sample after one of its steps threw.
enum class afterwards { again, next_sample };

/// Runs some samples of which the k-th allocation fails, and returns the directions. `failed_step` is the
/// step that threw.
template <class Exec, class Guide>
std::vector<sampled_direction> sample_with_fault(wfpg::path_guider<Exec, Guide>& guider,
                                                 failing_resource& resource, std::size_t k, afterwards then,
                                                 int& failed_step) {
  stepwise_samples<Exec, Guide> samples(guider);
  failed_step = -1;
  resource.fail_at(k);
  for (std::uint32_t sample = 0; sample < 4; ++sample) {
    samples.start(sample);
    for (int step = 0; step < samples.steps; ++step) {
      if (!runs_out(resource, [&] { samples.step(step); })) continue;
      REQUIRE(failed_step < 0);
      failed_step = step;
      if (then == afterwards::next_sample) break;
      samples.step(step);
    }
  }
  resource.fail_at(0);
  return samples.drawn();
}

/// Fails at each allocation of some samples. Returns the number of allocations.
template <class Exec>
std::size_t fail_in_samples(const guider_options& options, const box_mesh<Exec>& mesh, afterwards then) {
  int failed_step = -1;
  failing_resource unfailing;
  octree_guider<Exec> sound(Exec().with_resource(&unfailing), mesh.view(), options);
  const auto expected = sample_with_fault(sound, unfailing, 0, then, failed_step);
  for (std::size_t k = 1;; ++k) {
    failing_resource resource;
    {
      octree_guider<Exec> guider(Exec().with_resource(&resource), mesh.view(), options);
      const auto drawn = sample_with_fault(guider, resource, k, then, failed_step);
      INFO("allocation " << k << ", step " << failed_step);
      // A repeated wave counts its rays again, which moves kept fields.
      const bool is_alike = failed_step < 0 || failed_step == stepwise_samples<Exec>::begin ||
                            failed_step == stepwise_samples<Exec>::end ||
                            options.fields == field_lifetime::transient;
      if (then == afterwards::again && is_alike) CHECK(same_draws(drawn, expected));
      check_guides(guider);
    }
    CHECK(resource.live() == 0);
    if (failed_step < 0) return k - 1;
  }
}

WFPG_TEST_CASE("path guider: each allocation of a sample may fail, and a repeated call works",
               "[path_guider][memory]") {
  const box_mesh<Exec> mesh{Exec()};
  std::size_t covered = 0;
  for_each_stepwise_options([&](const guider_options& options) {
    covered += fail_in_samples<Exec>(options, mesh, afterwards::again);
  });
  CHECK(covered > 10);
  print_failed(covered);
}

WFPG_TEST_CASE("path guider: each allocation of a sample may fail, and the next sample works",
               "[path_guider][memory]") {
  const box_mesh<Exec> mesh{Exec()};
  std::size_t covered = 0;
  for_each_stepwise_options([&](const guider_options& options) {
    covered += fail_in_samples<Exec>(options, mesh, afterwards::next_sample);
  });
  CHECK(covered > 10);
  print_failed(covered);
}

WFPG_TEST_CASE("each allocation of load_guide() may fail", "[guide_file][memory]") {
  const box_mesh<Exec> mesh{Exec()};
  std::size_t covered = 0;
  for_each_stepwise_options([&](const guider_options& options) {
    with_own_options(options, [&](const auto& own) {
      using guide = wfpg::octree_guide_for<Exec, std::decay_t<decltype(own)>>;
      wfpg::path_guider<Exec, guide> guider(Exec(), mesh.view(), own);
      int failed_step;
      failing_resource unused;
      sample_with_fault(guider, unused, 0, afterwards::again, failed_step);
      std::ostringstream out;
      wfpg::save_guide(guider, out);

      failing_resource resource;
      const Exec exec = Exec().with_resource(&resource);
      covered += fail_at_each(resource, [&] {
        std::istringstream in(out.str());
        auto loaded = wfpg::load_guide(exec, in, own);
        check_guides(loaded);
      });
    });
  });
  CHECK(covered > 4 * 30);
  print_failed(covered);
}

/// A host's arena that throws its own exception.
class throwing_resource : public failing_resource {
  [[noreturn]] void refuse() const override { throw std::length_error("the arena is full"); }
};

WFPG_TEST_CASE("path guider: exceptions of a memory resource reach the caller unchanged",
               "[path_guider][memory]") {
  const box_mesh<Exec> mesh{Exec()};
  throwing_resource resource;
  const Exec exec = Exec().with_resource(&resource);
  const guider_options options = stepwise_options(field_lifetime::kept, 0);
  for (const std::size_t k : {1, 2, 7, 20}) {
    resource.fail_at(k);
    CHECK_THROWS_AS((octree_guider<Exec>(exec, mesh.view(), options)), std::length_error);
    CHECK(resource.live() == 0);
  }
}

/// The bytes of a guide after some samples.
template <class Exec>
std::string guide_with(unsigned char poison, field_lifetime lifetime) {
  poisoning_resource<Exec> resource(poison);
  constexpr std::size_t paths = 300;
  guider_options options = tracing_options(paths, wfpg::guiding_mode::oriented, lifetime);
  options.product_resolution = 4;
  options.lights.weights = {1.0f, 2.0f};
  const Exec exec = Exec().with_resource(&resource);
  return with_own_options(options, [&](const auto& own) {
    using guide = wfpg::octree_guide_for<Exec, std::decay_t<decltype(own)>>;
    wfpg::path_guider<Exec, guide> guider(exec, box_mesh<Exec>(exec).view(), own);
    trace_paths(exec, guider, 4, paths, box_caster());
    std::ostringstream out;
    wfpg::save_guide(guider, out);
    return out.str();
  });
}

WFPG_TEST_CASE("a guider reads only memory that it has written", "[path_guider][memory]") {
  for (const field_lifetime lifetime : lifetimes) {
    INFO(name_of(lifetime));
    const std::string zeros = guide_with<Exec>(0x00, lifetime);
    CHECK((guide_with<Exec>(0xcd, lifetime) == zeros));
    CHECK((guide_with<Exec>(0xff, lifetime) == zeros));
  }
}

}  // namespace
