// What the library throws from host calls. Nothing is printed and nothing ends the process.
#pragma once

#include <wfpg/base/math.hpp>

#include <cstddef>
#include <new>
#include <sstream>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace wfpg {

/// A memory resource could not give what was asked for. The message names the bytes.
class out_of_memory : public std::runtime_error {
 public:
  /// `bytes` were asked for.
  explicit out_of_memory(std::size_t bytes)
      : std::runtime_error("wfpg: out of memory: " + std::to_string(bytes) + " bytes were asked for"),
        bytes_(bytes) {}
  /// The bytes that were asked for.
  std::size_t bytes() const noexcept { return bytes_; }

 private:
  std::size_t bytes_;
};

/// A call of a device's runtime failed: CUDA's are cuda_error, of exec/cuda.hpp; those of a host's own caster
/// may be this. The message names code, text and call.
class device_error : public std::runtime_error {
 public:
  /// The runtime's code and text, and the name of the call.
  device_error(int code, const std::string& text, const std::string& call)
      : std::runtime_error("wfpg: " + call + ": " + text + " (code " + std::to_string(code) + ")"),
        code_(code) {}
  /// The runtime's code.
  int code() const noexcept { return code_; }

 private:
  int code_;
};

/// A file of saved state cannot be read or written, or is not what it should be. The message names the file
/// and says what is wrong with it, and where.
class file_error : public std::runtime_error {
 public:
  /// "wfpg: NAME REASON".
  file_error(const std::string& name, const std::string& reason)
      : std::runtime_error("wfpg: " + name + " " + reason) {}
};

/// Throws std::invalid_argument "wfpg: NAME is VALUE, expected WHAT" unless `holds`, and for numbers that are
/// not finite, of which a compiler may take any comparison to hold.
template <class T>
void require(bool holds, const char* name, const T& value, const char* expected) {
  if constexpr (std::is_floating_point_v<T>) holds = holds && is_finite(value);
  if (holds) return;
  std::ostringstream text;
  text << "wfpg: " << name << " is " << value << ", expected " << expected;
  throw std::invalid_argument(text.str());
}

}  // namespace wfpg
