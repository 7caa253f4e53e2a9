// A hint that kernels give a policy: their threads mostly wait for memory.
// Only the CUDA policy takes it, in loops over indices and over blocks.
// Wrappers of kernels pass it on, as index_list does.
//
//   struct merge_photons {
//     static constexpr bool waits_for_memory = true;
//     WFPG_HD void operator()(std::size_t i) const;
//   };
#pragma once

#include <type_traits>

namespace wfpg::detail {

/// Whether a functor says that it waits for memory: `static constexpr bool waits_for_memory = true`.
/// On a GPU its kernel then has fewer registers, so that more of its threads are resident and wait at once.
template <class F, class = void>
struct waits_for_memory : std::false_type {};
template <class F>
struct waits_for_memory<F, std::void_t<decltype(F::waits_for_memory)>>
    : std::bool_constant<F::waits_for_memory> {};

}  // namespace wfpg::detail
