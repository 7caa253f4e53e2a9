// The execution policies of tests, and a test case for each. WFPG_TEST_CASE defines one test per backend,
// named "NAME - tbb32" and tagged [tbb][w32]. A CUDA compiler makes the CUDA policy's tests from
// the same sources, named "NAME - cuda" and tagged [cuda].
//
// The tests share one type, whose backend each chooses (support/chosen_policy.hpp). Warps have 32 lanes, as
// users have. Tests of the policies themselves define WFPG_TEST_EACH_WIDTH first, and get a type each.
// WFPG_TEST_POLICY and WFPG_TEST_WIDTH choose one real policy for all other tests: sanitizers and -ffast-math
// do so, with narrow warps too. WFPG_TEST_SEVERAL_POLICIES is defined if seq, omp and tbb are tested side by
// side.
#pragma once

#include "support/catch.hpp"

#if defined(WFPG_TEST_EACH_WIDTH)
#undef WFPG_TEST_POLICY
#endif
#if defined(__CUDACC__)
#include <wfpg/exec/cuda.hpp>
#include <wfpg/exec/seq.hpp>
#else
#if !defined(WFPG_TEST_POLICY)
#define WFPG_TEST_SEVERAL_POLICIES
#endif
#include "support/chosen_policy.hpp"
#endif
#include <wfpg/exec/buffer.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

#define WFPG_TEST_JOIN_(a, b) a##b
#define WFPG_TEST_JOIN(a, b) WFPG_TEST_JOIN_(a, b)

#define WFPG_TEST_ONE(function, name, tags, policy, width) WFPG_TEST_ONE_(function, name, tags, policy, width)
#define WFPG_TEST_ONE_(function, name, tags, policy, width)                 \
  TEST_CASE(name " - " #policy #width, tags "[" #policy "][w" #width "]") { \
    function<wfpg::exec::basic_##policy<width>>();                          \
  }
#if defined(__CUDACC__)
#define WFPG_TEST_POLICIES(function, name, tags) \
  TEST_CASE(name " - cuda", tags "[cuda]") {     \
    function<wfpg::exec::cuda>();                \
  }
#elif defined(WFPG_TEST_EACH_WIDTH)
#define WFPG_TEST_POLICIES(function, name, tags) \
  WFPG_TEST_ONE(function, name, tags, seq, 8)    \
  WFPG_TEST_ONE(function, name, tags, seq, 16)   \
  WFPG_TEST_ONE(function, name, tags, seq, 32)   \
  WFPG_TEST_ONE(function, name, tags, omp, 32)   \
  WFPG_TEST_ONE(function, name, tags, tbb, 32)
#elif defined(WFPG_TEST_POLICY)
#define WFPG_TEST_POLICIES(function, name, tags) \
  WFPG_TEST_ONE(function, name, tags, WFPG_TEST_POLICY, WFPG_TEST_WIDTH)
#else
#define WFPG_TEST_CHOSEN(function, name, tags, policy)            \
  TEST_CASE(name " - " #policy "32", tags "[" #policy "][w32]") { \
    const backend_choice choice(backend::policy);                 \
    function<basic_chosen<32>>();                                 \
  }
#define WFPG_TEST_POLICIES(function, name, tags) \
  WFPG_TEST_CHOSEN(function, name, tags, seq)    \
  WFPG_TEST_CHOSEN(function, name, tags, omp)    \
  WFPG_TEST_CHOSEN(function, name, tags, tbb)
#endif

#define WFPG_TEST_CASE_(function, name, tags) \
  template <class Exec>                       \
  void function();                            \
  WFPG_TEST_POLICIES(function, name, tags)    \
  template <class Exec>                       \
  void function()

/// Defines a test case on every policy. Its body uses the policy as `Exec`. Use it in an anonymous namespace.
#define WFPG_TEST_CASE(name, tags) WFPG_TEST_CASE_(WFPG_TEST_JOIN(policy_test_, __LINE__), name, tags)

namespace wfpg_test {

#if defined(__CUDACC__)
/// The policy of tests that need only one.
using one_policy = wfpg::exec::cuda;
/// A policy whose memory the host can read.
using host_policy = wfpg::exec::seq;
/// Whether loops run in the host's threads. Only then may they throw and take scratch memory from the
/// resource.
constexpr bool loops_on_host = false;
#else
#if defined(WFPG_TEST_POLICY)
using one_policy = wfpg::exec::WFPG_TEST_JOIN(basic_, WFPG_TEST_POLICY)<WFPG_TEST_WIDTH>;
#else
using one_policy = basic_chosen<32>;
#endif
using host_policy = one_policy;
constexpr bool loops_on_host = true;
#endif

/// Whether a host's compiler may reorder floating-point operations.
#if defined(__FAST_MATH__)
constexpr bool fast_math = true;
#else
constexpr bool fast_math = false;
#endif

/// Whether equal floating-point operations give equal bits everywhere. Not if the compiler fuses or reorders
/// them depending on their context.
constexpr bool same_operations_same_bits = loops_on_host && !fast_math;

/// Whether two kernels got the same number from the same floating-point operations, exactly or nearly.
WFPG_HD inline bool alike(float a, float b) {
  return same_operations_same_bits ? a == b : std::fabs(a - b) <= 2.0e-6f * std::fabs(b);
}
WFPG_HD inline bool alike(wfpg::vec3 a, wfpg::vec3 b) {
  return same_operations_same_bits ? a == b : glm::distance(a, b) <= 2.0e-6f * glm::length(b);
}

/// The memory resource of a policy without a given one.
inline wfpg::memory_resource* default_resource() {
#if defined(__CUDACC__)
  static const wfpg::exec::cuda exec;
  return exec.resource();
#else
  return std::pmr::get_default_resource();
#endif
}

/// Copies the elements of a view from the policy's memory to the host.
template <class Exec, class T>
std::vector<std::remove_const_t<T>> to_host(const Exec& exec, wfpg::array_view<T> view) {
  std::vector<std::remove_const_t<T>> host(view.size());
  exec.copy_to_host(host.data(), view.data(), view.size() * sizeof(T));
  return host;
}

/// A view of const elements.
template <class T, class Exec>
wfpg::array_view<const T> const_view(const wfpg::buffer<T, Exec>& buffer) {
  return buffer.view();
}

/// Reproducible random numbers that are equal on every platform.
class random_numbers {
 public:
  explicit random_numbers(std::uint64_t seed) : state_(seed) {}

  std::uint64_t bits() {  // SplitMix64
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15ull;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
  }
  /// In [0, n).
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>((bits() >> 32) * n >> 32); }
  /// In [0, 1).
  float unit() { return static_cast<float>(bits() >> 40) * 0x1p-24f; }
  float between(float low, float high) { return low + (high - low) * unit(); }
  wfpg::vec3 point(float low, float high) {
    const float x = between(low, high), y = between(low, high);
    return {x, y, between(low, high)};
  }
  wfpg::vec3 direction() {
    for (;;) {
      const wfpg::vec3 p = point(-1.0f, 1.0f);
      const float square = glm::dot(p, p);
      if (square > 1.0e-4f && square <= 1.0f) return glm::normalize(p);
    }
  }

 private:
  std::uint64_t state_;
};

template <class T>
void shuffle(std::vector<T>& values, random_numbers& random) {
  for (std::size_t i = values.size(); i > 1; --i)
    std::swap(values[i - 1], values[random.below(static_cast<std::uint32_t>(i))]);
}

}  // namespace wfpg_test
