// What an execution policy is. Algorithms are templates over one and mention no backend; the policies are
// exec/seq.hpp, exec/omp.hpp, exec/tbb.hpp and exec/cuda.hpp.
//
// A policy is a small copyable object that answers five questions:
//
//   1. where memory comes from:  memory_resource* resource() const;
//                                Exec with_resource(memory_resource*) const;
//                                void copy_to_host(void* to, const void* from, std::size_t bytes) const;
//                                void copy_from_host(void* to, const void* from, std::size_t bytes) const;
//                                void fill_bytes(void* to, unsigned char value, std::size_t bytes) const;
//   2. who sorts and scans:      auto thrust() const;  a Thrust policy whose temporaries come from resource()
//                                void sort_pairs(n, bits, const K* keys, const V* values, K* sorted_keys,
//                                                V* sorted_values) const;
//                                stable; the low `bits` bits of the unsigned keys are in their order
//   3. a loop over indices:      void for_each(n, f) const;  f(i), in no order; f is a functor with a const
//                                operator() that the device can call
//   4. a loop in steps:          void for_each_run(n, f) const;  f(run): indices that go through f's steps
//                                together, a warp's on a GPU, up to 32 on a CPU (detail/cpu_policy.hpp says
//                                what a run offers)
//   5. a loop over blocks:       void for_each_block(n, scratch_bytes, f) const;  f(block, i), where `block`
//                                is a team of threads with fast scratch memory (detail/cpu_block.hpp says
//                                what a block and its warps offer)
//
// n is a std::size_t, or, but of runs, a device_count where only the device knows it. Calls are ordered: one
// sees what the one before it wrote. `Exec::warp_width` is the number of lanes of a warp, 8, 16 or 32, and
// `Exec::warps_per_block` that of the warps of a block.
#pragma once

#include <wfpg/base/config.hpp>
#include <wfpg/base/types.hpp>

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <type_traits>
#include <utility>

namespace wfpg {

/// Where a policy's memory comes from; a renderer passes its own arena as one of these. For a device policy
/// the resource hands out device memory.
using memory_resource = std::pmr::memory_resource;

/// Execution policies.
namespace exec {

/// A number of elements that a kernel computed: *value, and at most `capacity`. The host does not read it.
struct device_count {
  const std::uint32_t* value = nullptr;  ///< in the policy's memory
  std::size_t capacity = 0;              ///< what it is at most

  /// The number, read where it lies.
  WFPG_HD std::size_t get() const { return *value < capacity ? *value : capacity; }
};

namespace detail {

template <class Exec, class = void>
struct is_execution_policy : std::false_type {};

template <class Exec>
struct is_execution_policy<Exec, std::void_t<decltype(std::declval<const Exec&>().resource()),
                                             decltype(std::declval<const Exec&>().with_resource(nullptr)),
                                             decltype(std::declval<const Exec&>().thrust()),
                                             decltype(Exec::warp_width), decltype(Exec::warps_per_block)>>
    : std::true_type {};

}  // namespace detail

/// True where `Exec` has what an execution policy needs.
template <class Exec>
inline constexpr bool is_execution_policy_v = detail::is_execution_policy<Exec>::value;

}  // namespace exec
}  // namespace wfpg
