// Floors of stages: copies of memory, and sorts of as many keys.
#pragma once

#include "timing.hpp"

#if defined(__CUDACC__)
#include <cub/device/device_radix_sort.cuh>
#endif

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace bench {

#if defined(__CUDACC__)
inline void copy_bytes(const wfpg::exec::cuda& exec, const void* from, void* to, std::size_t bytes) {
  wfpg::check_cuda(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToDevice, exec.stream()),
                   "cudaMemcpyAsync");
}
#else
/// Copies a page of 4 KiB.
struct copy_page {
  static constexpr std::size_t page = 4096;
  const unsigned char* from;
  unsigned char* to;
  std::size_t bytes;
  void operator()(std::size_t i) const {
    std::memcpy(to + i * page, from + i * page, std::min(page, bytes - i * page));
  }
};

template <class Exec>
void copy_bytes(const Exec& exec, const void* from, void* to, std::size_t bytes) {
  exec.for_each((bytes + copy_page::page - 1) / copy_page::page,
                copy_page{static_cast<const unsigned char*>(from), static_cast<unsigned char*>(to), bytes});
}
#endif

template <class T, class Exec>
void copy(const Exec& exec, const wfpg::buffer<T, Exec>& from, const wfpg::buffer<T, Exec>& to) {
  copy_bytes(exec, from.data(), to.data(), from.bytes());
}

/// A copy that reads and writes `bytes` in total.
template <class Exec>
class copy_of {
 public:
  copy_of(const Exec& exec, std::size_t bytes) : exec_(exec), from_(exec, bytes / 2), to_(exec, bytes / 2) {
    exec.fill_bytes(from_.data(), 0, from_.bytes());  // the system does not read unwritten pages from memory
  }
  void operator()() const { copy(exec_, from_, to_); }

 private:
  Exec exec_;
  wfpg::buffer<unsigned char, Exec> from_, to_;
};

/// Sorts n keys by their low bits, with an index each: CUB's radix sort on a GPU, the policy's sort on CPUs.
template <class Exec, class Key, class Count>
class sort_of {
 public:
  sort_of(const Exec& exec, const wfpg::buffer<Key, Exec>& keys, int bits, Count n)
      : exec_(exec),
        keys_(keys),
        bits_(bits),
        n_(n),
        sorted_(exec, n),
        values_(exec, n),
        sorted_values_(exec, n) {
    exec.fill_bytes(values_.data(), 0, values_.bytes());
#if defined(__CUDACC__)
    std::size_t bytes = 0;
    sort(nullptr, bytes);
    storage_ = {exec, bytes};
#endif
  }

  void operator()() const {
#if defined(__CUDACC__)
    std::size_t bytes = storage_.size();
    sort(storage_.data(), bytes);
#else
    exec_.sort_pairs(n_, bits_, keys_.data(), values_.data(), sorted_.data(), sorted_values_.data());
#endif
  }

 private:
#if defined(__CUDACC__)
  void sort(void* storage, std::size_t& bytes) const {
    wfpg::check_cuda(
        cub::DeviceRadixSort::SortPairs(storage, bytes, keys_.data(), sorted_.data(), values_.data(),
                                        sorted_values_.data(), n_, 0, bits_, exec_.stream()),
        "cub::DeviceRadixSort::SortPairs");
  }
#endif

  Exec exec_;
  const wfpg::buffer<Key, Exec>& keys_;
  int bits_;
  Count n_;
  wfpg::buffer<Key, Exec> sorted_;
  wfpg::buffer<std::uint32_t, Exec> values_, sorted_values_;
#if defined(__CUDACC__)
  wfpg::buffer<unsigned char, Exec> storage_;
#endif
};

}  // namespace bench
