// Devices that the host's kernels run on: one thread, TBB's threads, or a GPU. A device has
//   array<T>        an array in its memory: of a size, of a std::vector, or empty
//   thrust()        Thrust's policy for it
//   policy          the execution policy of the renderer's scene, and of the guide
#pragma once

#include <wfpg/exec/seq.hpp>
#if defined(__CUDACC__)
#include <wfpg/exec/cuda.hpp>
#else
#include <wfpg/exec/tbb.hpp>
#endif

#include <thrust/copy.h>
#include <thrust/for_each.h>
#include <thrust/iterator/counting_iterator.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#if defined(__CUDACC__)
#include <thrust/device_vector.h>
#define KERNELS_BOTH __host__ __device__
#else
#define KERNELS_BOTH
#endif

namespace kernels {

struct serial {
  using policy = wfpg::exec::seq;
  template <class T>
  using array = std::vector<T>;
  static auto thrust() { return ::thrust::cpp::par; }
};

#if !defined(__CUDACC__)
struct tbb_threads {
  using policy = wfpg::exec::tbb;
  template <class T>
  using array = std::vector<T>;
  static auto thrust() { return ::thrust::tbb::par; }
};
#else
struct gpu {
  using policy = wfpg::exec::cuda;
  template <class T>
  using array = ::thrust::device_vector<T>;
  static auto thrust() { return ::thrust::cuda::par; }
};
#endif

/// Calls kernel(i) for each i in [0, n), and waits. Throws thrust::system_error where a GPU fails.
template <class Device, class Kernel>
void launch(std::size_t n, const Kernel& kernel) {
  ::thrust::for_each_n(Device::thrust(), ::thrust::counting_iterator<std::size_t>(0), n, kernel);
}

/// The address of an array's first element, for kernels.
template <class Array>
auto address(Array& array) {
  return ::thrust::raw_pointer_cast(array.data());
}

/// Writes the indices in [0, n) for which `wanted` is true, in order, and returns their number.
template <class Device, class Wanted>
std::size_t select(std::size_t n, const Wanted& wanted, std::uint32_t* indices) {
  const ::thrust::counting_iterator<std::uint32_t> first(0u);
  const auto last = first + static_cast<std::ptrdiff_t>(n);
  return static_cast<std::size_t>(::thrust::copy_if(Device::thrust(), first, last, indices, wanted) -
                                  indices);
}

}  // namespace kernels
