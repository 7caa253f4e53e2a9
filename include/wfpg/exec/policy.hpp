// The concept of an execution policy, which every algorithm of the library takes as a template argument.
// Algorithms mention no backend.
// The policies are exec/seq.hpp, exec/omp.hpp, exec/tbb.hpp and exec/cuda.hpp.
//
// A policy is a small copyable object that answers five questions:
//
//   1. where memory comes from:  memory_resource* resource() const;
//                                Exec with_resource(memory_resource*) const;
//                                void copy_to_host(void* to, const void* from, std::size_t bytes) const;
//                                void copy_from_host(void* to, const void* from, std::size_t bytes) const;
//                                void fill_bytes(void* to, unsigned char value, std::size_t bytes) const;
//      and where ranks that share a sample pass values through the host, optionally
//                                static memory_resource* staging_memory();
//   2. who sorts and scans:      auto thrust() const;  a Thrust policy whose temporaries come from resource()
//                                void sort_pairs(n, bits, const K* keys, const V* values, K* sorted_keys,
//                                                V* sorted_values) const;
//                                stable; the low `bits` bits of the unsigned keys are in their order
//   3. a loop over indices:      void for_each(n, f) const;  f(i), in no order; f is a functor with a const
//                                operator() that the device can call. Where f has a static constexpr bool
//                                waits_for_memory that is true, more of its threads may be resident on a
//                                GPU; so in a loop over blocks, but not in a loop in steps
//   4. a loop in steps:          void for_each_run(n, f) const;  f(run): indices that go through f's steps
//                                together, a warp's on a GPU, up to 32 on a CPU (exec/cpu_policy.hpp says
//                                what a run offers)
//   5. a loop over blocks:       void for_each_block(n, scratch_bytes, f) const;  f(block, i), where `block`
//                                is a team of threads with fast scratch memory (exec/support/cpu_block.hpp
//                                says what a block and its warps offer)
//
// n is a std::size_t. for_each() and for_each_block() also take a device_count, which only the device knows.
// Calls are ordered: a call sees what the calls before it wrote.
// `Exec::warp_width` is the number of lanes of a warp: 8, 16 or 32.
// `Exec::warps_per_block` is the number of warps of a block.
// Cost and memory: those of the policy; nothing is virtual.
#pragma once

#include <wfpg/base/config.hpp>
#include <wfpg/base/types.hpp>

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <type_traits>
#include <utility>

namespace wfpg {

/// The source of a policy's memory. A renderer passes its own arena as one of these.
/// For a device policy, the resource hands out device memory, ordered on the policy's stream.
using memory_resource = std::pmr::memory_resource;

/// Execution policies.
namespace exec {

/// A number of elements that an earlier kernel computed. The host never reads it, so it never waits for it.
struct device_count {
  const std::uint32_t* value = nullptr;  ///< address in the policy's memory; must not be null
  std::size_t capacity = 0;              ///< upper bound: larger values count as this

  /// Returns min(*value, capacity). To be called where the policy's memory can be read.
  WFPG_HD std::size_t get() const { return *value < capacity ? *value : capacity; }
};

namespace detail {

/// A loop body of each kind: of indices, of runs, and of blocks.
/// It is never called: the traits ask only whether loops take it.
struct trait_body {
  /// f(i), or f(run).
  template <class T>
  WFPG_HD void operator()(const T&) const {}
  /// f(block, i), of the block's own type.
  template <class Block>
  WFPG_HD void operator()(Block&, std::size_t) const {}
};

/// Question 1: memory, and copies of bytes between a host and the policy.
template <class Exec, class = void>
struct has_memory : std::false_type {};
template <class Exec>
struct has_memory<
    Exec, std::void_t<decltype(static_cast<memory_resource*>(std::declval<const Exec&>().resource())),
                      decltype(std::declval<const Exec&>().with_resource(nullptr)),
                      decltype(std::declval<const Exec&>().copy_to_host(nullptr, nullptr, std::size_t())),
                      decltype(std::declval<const Exec&>().copy_from_host(nullptr, nullptr, std::size_t())),
                      decltype(std::declval<const Exec&>().fill_bytes(nullptr, 0, std::size_t()))>>
    : std::true_type {};

/// Question 2: a Thrust policy, and a stable sort of pairs.
template <class Exec, class = void>
struct sorts : std::false_type {};
template <class Exec>
struct sorts<Exec, std::void_t<decltype(std::declval<const Exec&>().thrust()),
                               decltype(std::declval<const Exec&>().sort_pairs(
                                   std::size_t(), 0, std::declval<const std::uint32_t*>(),
                                   std::declval<const std::uint32_t*>(), std::declval<std::uint32_t*>(),
                                   std::declval<std::uint32_t*>()))>> : std::true_type {};

/// Question 3: a loop over indices, whose number the host or the device knows.
template <class Exec, class = void>
struct loops_over_indices : std::false_type {};
template <class Exec>
struct loops_over_indices<
    Exec, std::void_t<decltype(std::declval<const Exec&>().for_each(std::size_t(), trait_body())),
                      decltype(std::declval<const Exec&>().for_each(device_count(), trait_body()))>>
    : std::true_type {};

/// Question 4: a loop over runs of indices, a run a warp.
template <class Exec, class = void>
struct loops_over_runs : std::false_type {};
template <class Exec>
struct loops_over_runs<
    Exec, std::void_t<decltype(std::declval<const Exec&>().for_each_run(std::size_t(), trait_body()))>>
    : std::true_type {};

/// Question 5: a loop over blocks of threads with scratch memory.
template <class Exec, class = void>
struct loops_over_blocks : std::false_type {};
template <class Exec>
struct loops_over_blocks<
    Exec,
    std::void_t<
        typename Exec::block, decltype(int(Exec::warp_width)), decltype(int(Exec::warps_per_block)),
        decltype(std::declval<const Exec&>().for_each_block(std::size_t(), std::size_t(), trait_body())),
        decltype(std::declval<const Exec&>().for_each_block(device_count(), std::size_t(), trait_body()))>>
    : std::true_type {};

/// Asserts that Exec is a policy. Each part that is missing is an error of one sentence.
/// Returns true, so that it can stand in a static_assert.
template <class Exec>
constexpr bool require_policy() {
  static_assert(has_memory<Exec>::value,
                "Exec: needs resource(), with_resource(), copy_to_host(), copy_from_host() and fill_bytes()");
  static_assert(sorts<Exec>::value, "Exec: needs thrust() and sort_pairs()");
  static_assert(loops_over_indices<Exec>::value,
                "Exec: needs for_each(n, f), of a std::size_t and of a device_count");
  static_assert(loops_over_runs<Exec>::value, "Exec: needs for_each_run(n, f)");
  static_assert(
      loops_over_blocks<Exec>::value,
      "Exec: needs block, warp_width, warps_per_block and for_each_block(n, scratch_bytes, f), of a "
      "std::size_t and of a device_count");
  return true;
}

}  // namespace detail

/// True where `Exec` has all members of an execution policy. Their behaviour is for tests to find out.
template <class Exec>
inline constexpr bool is_execution_policy_v =
    detail::has_memory<Exec>::value&& detail::sorts<Exec>::value&& detail::loops_over_indices<Exec>::value&&
        detail::loops_over_runs<Exec>::value&& detail::loops_over_blocks<Exec>::value;

}  // namespace exec
}  // namespace wfpg
