// Files for readers that take a path.
#pragma once

#include "require.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <string>
#include <string_view>

namespace wfpg_fuzz {

/// A file in memory, with a path that other code can open.
class memory_file {
 public:
  memory_file() : descriptor_(memfd_create("input", 0)) { require(descriptor_ >= 0, "no file in memory"); }

  std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }
  void hold(std::string_view bytes) const {
    require(ftruncate(descriptor_, 0) == 0, "the file cannot be emptied");
    require(pwrite(descriptor_, bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size()),
            "the file cannot be written");
  }

 private:
  int descriptor_;
};

}  // namespace wfpg_fuzz
