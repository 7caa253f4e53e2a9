// Guiders that run at the same time on their own threads, as in a renderer of several pictures. Also one
// octree and cache that many threads read.
#include "support/catch.hpp"
#include "support/guiding.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/octree/svo_ray_caster.hpp>

#include <cstddef>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace {

using namespace wfpg_test;

#if defined(__CUDACC__)
constexpr std::size_t threads = 4, paths = 100;  // racecheck takes minutes for each guider
#else
constexpr std::size_t threads = 8, paths = 400;
#endif

/// Calls f(i) for each i below `threads`, each in its own thread. Rethrows an exception here.
template <class F>
void at_the_same_time(const F& f) {
  std::exception_ptr failure;
  std::mutex one_at_a_time;
  std::vector<std::thread> running;
  for (std::size_t i = 0; i < threads; ++i)
    running.emplace_back([&, i] {
      try {
        f(i);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(one_at_a_time);
        failure = std::current_exception();
      }
    });
  for (std::thread& thread : running) thread.join();
  if (failure) std::rethrow_exception(failure);
}

/// The picture of the i-th guider. All have other options; the first four have both values of each.
template <class Exec>
std::vector<float> picture_of(std::size_t i) {
  const Exec exec;
  const field_lifetime lifetime = lifetimes[i % 2];
  const auto mode = i / 2 % 2 == 0 ? wfpg::guiding_mode::oriented : wfpg::guiding_mode::plain;
  guider_options options = tracing_options(paths, mode, lifetime);
  options.product_resolution = unless_zero(std::uint32_t((i + i / 2 + i / 4) % 2 == 0 ? 0 : 4));
  options.octree_resolution = 16;
  options.seed = i;
  octree_guider<Exec> guider(exec, box_mesh<Exec>(exec).view(), options);
  return trace_paths(exec, guider, 3, paths, box_caster());
}

WFPG_TEST_CASE("path guider: guiders on several threads give the same directions as alone",
               "[path_guider][threads]") {
  std::vector<std::vector<float>> together(threads);
  at_the_same_time([&](std::size_t i) { together[i] = picture_of<Exec>(i); });
  for (std::size_t i = 0; i < threads; ++i) {
    INFO("guider " << i);
    CHECK(together[i] == picture_of<Exec>(i));
  }
}

#if !defined(__CUDACC__)
/// The cache's radiance along rays through the box.
std::vector<float> read_all(const wfpg::exitance_cache_view& cache) {
  std::vector<float> result;
  const wfpg::svo_ray_caster caster(cache.octree());
  random_numbers random(11);
  for (int i = 0; i < 2000; ++i) {
    wfpg::ray ray;
    ray.origin = random.point(0.2f, 0.8f);
    ray.direction = random.direction();
    const wfpg::ray_hit hit = caster(ray);
    result.push_back(hit.distance);
    const wfpg::node_id leaf = cache.octree().nearest_leaf(ray.origin + hit.distance * ray.direction);
    result.push_back(cache.read(leaf, -ray.direction));
  }
  return result;
}

WFPG_TEST_CASE("many threads may read one octree and cache", "[path_guider][threads]") {
  guided_box<Exec> box;
  box.learn();
  const wfpg::exitance_cache_view cache = box.guider.guide().cache();
  const std::vector<float> alone = read_all(cache);
  std::vector<std::vector<float>> together(threads);
  at_the_same_time([&](std::size_t i) { together[i] = read_all(cache); });
  for (const std::vector<float>& answers : together) CHECK(answers == alone);
  CHECK(std::count_if(alone.begin(), alone.end(), [](float x) { return x > 5.0f; }) > 10);
}
#endif

}  // namespace
