// Files that are written whole, or are an error.
#pragma once

#include <fstream>
#include <stdexcept>
#include <string>

namespace render {

/// Throws std::runtime_error with the path where not all of it arrives, as on a full disk.
inline void write_whole_file(const std::string& path, const std::string& content) {
  std::ofstream file(path, std::ios::binary);
  file << content;
  file.close();
  if (!file) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace render
