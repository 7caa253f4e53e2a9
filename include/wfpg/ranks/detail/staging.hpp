// Host memory through which the values of a policy pass, for communicators that carry messages of the host.
// A policy may have a static staging_memory(), such as exec::cuda: memory that copies reach without a stop.
//
// Source: CUDA C++ Programming Guide, "Page-Locked Host Memory".
// Cost: that of the memory where it grows, which waits for the policy's work.
// Memory: the largest number of bytes that was asked for.
#pragma once

#include <cstddef>
#include <memory_resource>
#include <type_traits>
#include <utility>

namespace wfpg::detail {

/// Whether a policy names memory of the host that its copies prefer.
template <class Exec, class = void>
struct has_staging_memory : std::false_type {};
template <class Exec>
struct has_staging_memory<Exec, std::void_t<decltype(Exec::staging_memory())>> : std::true_type {};

/// Owns the memory. It waits for the policy's work at its end, so that a stream must outlive it. Copies from
/// it may still be under way when it is used again, since copies are ordered. Not copyable.
template <class Exec>
class staging {
 public:
  /// Without memory. `exec` is copied.
  explicit staging(const Exec& exec) : exec_(exec) {}
  staging(const staging&) = delete;
  staging& operator=(const staging&) = delete;
  /// Waits for copies from it. Errors are ignored, as destructors must not throw.
  ~staging() {
    try {
      release();
    } catch (...) {
    }
  }

  /// Gives the memory up for good, to messages that cannot be taken back.
  void give_up() {
    memory_ = nullptr;
    bytes_ = 0;
  }
  /// Returns room for `bytes` bytes, aligned for any number. What was there may be lost.
  /// Throws std::bad_alloc or the policy's error for memory.
  void* fit(std::size_t bytes) {
    if (bytes <= bytes_) return memory_;
    release();
    memory_ = resource()->allocate(bytes);
    bytes_ = bytes;
    return memory_;
  }

 private:
  // Where the memory comes from.
  static std::pmr::memory_resource* resource() {
    if constexpr (has_staging_memory<Exec>::value)
      return Exec::staging_memory();
    else
      return std::pmr::new_delete_resource();
  }
  // Gives the memory back, after the copies that read it.
  void release() {
    if (!memory_) return;
    void* const memory = std::exchange(memory_, nullptr);
    const std::size_t bytes = std::exchange(bytes_, 0);
    exec_.copy_to_host(nullptr, nullptr, 0);  // waits
    resource()->deallocate(memory, bytes);
  }

  Exec exec_;
  void* memory_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace wfpg::detail
