// Exceptions of host calls, and require(), which checks arguments.
// The library reports errors only by exceptions: it prints nothing and never ends the process.
// Arguments out of range throw std::invalid_argument, which names the argument, its value and its range.
// Cost and memory: a check costs one comparison. Text is made only where an exception is thrown.
#pragma once

#include <wfpg/base/math.hpp>

#include <cstddef>
#include <cstdio>
#include <new>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace wfpg {

/// Thrown where a memory resource cannot allocate.
/// The message names the bytes requested.
/// What the failed call would have filled stays unallocated; memory from before the call stays valid.
class out_of_memory : public std::runtime_error {
 public:
  /// `bytes`: the size of the request that failed.
  WFPG_COLD explicit out_of_memory(std::size_t bytes)
      : std::runtime_error("wfpg: out of memory: " + std::to_string(bytes) + " bytes were asked for"),
        bytes_(bytes) {}
  /// Returns the size of the failed request, bytes.
  std::size_t bytes() const noexcept { return bytes_; }

 private:
  std::size_t bytes_;
};

/// Thrown where a call of a device's runtime failed.
/// The CUDA policy throws cuda_error (exec/cuda.hpp), which derives from it.
/// A host may throw it from its own ray caster.
/// The message names the call, and the error's text and code.
class device_error : public std::runtime_error {
 public:
  /// `code`, `text`: the runtime's error code and its description. `call`: the name of the failed function.
  device_error(int code, const std::string& text, const std::string& call)
      : std::runtime_error("wfpg: " + call + ": " + text + " (code " + std::to_string(code) + ")"),
        code_(code) {}
  /// Returns the runtime's error code, such as a cudaError_t.
  int code() const noexcept { return code_; }

 private:
  int code_;
};

/// Thrown where saved state cannot be read or written, or where a file is damaged or of another kind.
/// The message names the file, what is wrong, and in which section.
/// It derives from std::runtime_error, as the others here do.
class file_error : public std::runtime_error {
 public:
  /// The message becomes "wfpg: NAME REASON".
  /// `name`: a path, or what the caller named its stream. `reason`: "is truncated at byte 12", for example.
  file_error(const std::string& name, const std::string& reason)
      : std::runtime_error("wfpg: " + name + " " + reason) {}
};

namespace detail {

/// Throws the error of require(): "wfpg: NAME is VALUE, expected EXPECTED".
/// Each kind of value has one. They are apart from require(), which is inlined, so that callers stay small.
[[noreturn]] WFPG_COLD inline void refuse(const char* name, const std::string& value, const char* expected) {
  throw std::invalid_argument(std::string("wfpg: ") + name + " is " + value + ", expected " + expected);
}
/// Refuses an integer, which is shown in full.
[[noreturn]] WFPG_COLD inline void refuse(const char* name, unsigned long long value, const char* expected) {
  refuse(name, std::to_string(value), expected);
}
/// Refuses a signed integer.
[[noreturn]] WFPG_COLD inline void refuse(const char* name, long long value, const char* expected) {
  refuse(name, std::to_string(value), expected);
}
/// Refuses another number, which is shown with six digits.
/// No stream is used: <sstream> is slow to compile, and this header is in every other.
/// A number that is not finite reads "nan", "inf" or "-inf", as a stream would write it.
[[noreturn]] WFPG_COLD inline void refuse(const char* name, double value, const char* expected) {
  char text[32];  // "-1.23457e-308" and the end
  std::snprintf(text, sizeof text, "%g", value);
  refuse(name, std::string(text), expected);
}

/// The kinds of value that refuse() takes.
template <class T>
using refused_as = std::conditional_t<
    !std::is_arithmetic_v<T>, const T&,
    std::conditional_t<!std::is_integral_v<T>, double,
                       std::conditional_t<std::is_signed_v<T>, long long, unsigned long long>>>;

}  // namespace detail

/// Throws std::invalid_argument "wfpg: NAME is VALUE, expected WHAT" unless `holds`.
/// A floating-point `value` that is NaN or infinite also throws, whatever `holds` says.
/// It is tested by its bits: with -ffast-math, a compiler may assume that any comparison with NaN is true.
/// `value`: a number or a std::string. It is turned into text only where the call throws.
/// `name`, `expected`: parts of the message, null-terminated. For host code; kernels check nothing.
template <class T>
void require(bool holds, const char* name, const T& value, const char* expected) {
  if constexpr (std::is_floating_point_v<T>) holds = holds && is_finite(value);
  if (!holds) detail::refuse(name, static_cast<detail::refused_as<T>>(value), expected);
}

}  // namespace wfpg
