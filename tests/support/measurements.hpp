// Shared by the tests of wfpg-quality: its options, and the files that it writes.
#pragma once

#include "settings.hpp"
#include "support/temporary_folder.hpp"

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

namespace render_test {

using strings = std::vector<std::string>;

inline quality::settings parsed(strings arguments) {
  arguments.insert(arguments.end(), {"--output", "out"});
  std::ostringstream out;
  return quality::parse_settings(arguments, out).value();
}

/// Files of the cache whose names begin with `begin`.
inline std::vector<std::filesystem::path> cached(const wfpg_test::temporary_folder& folder,
                                                 const std::string& begin, const std::string& extension) {
  std::vector<std::filesystem::path> found;
  for (const auto& entry : std::filesystem::directory_iterator(folder.file("cache")))
    if (entry.path().filename().string().rfind(begin, 0) == 0 && entry.path().extension() == extension)
      found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace render_test
