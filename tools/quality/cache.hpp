// Finished renderings in a directory, so that an interrupted run does not repeat them.
#pragma once

#include "app/image_io.hpp"
#include "system.hpp"

#include <exception>
#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>

namespace quality {

/// Identifies a rendering, with a name for people.
struct run_key {
  std::string label;  ///< prefix of the files' names
  json content;       ///< an object; all that the result depends on

  std::string hash() const { return hash_of(content.dump()); }
};

struct cache_entry {
  json result;
  std::optional<render::image> picture;
};

/// Stores a JSON file per rendering, and an OpenEXR if it has a picture. A file gets its name when it is
/// complete, the JSON last. A damaged rendering causes a warning and counts as absent.
class run_cache {
 public:
  /// Makes the directory. Warnings go to `log`, which must outlive the cache. Throws std::invalid_argument if
  /// files cannot be made in it.
  run_cache(std::filesystem::path directory, std::ostream& log);

  /// Whether a rendering looks finished. find() may still find damage.
  bool contains(const run_key& key) const;

  /// Returns `read(entry)` of a finished rendering. An exception of `read` counts as damage.
  template <class Read>
  auto find(const run_key& key, const Read& read) const
      -> std::optional<decltype(read(std::declval<cache_entry&>()))> {
    if (!contains(key)) return std::nullopt;
    try {
      cache_entry entry = load(key);
      return read(entry);
    } catch (const std::exception& reason) {
      warn(key, reason.what());
      return std::nullopt;
    }
  }

  /// Throws std::runtime_error that names the path.
  void store(const run_key& key, const cache_entry& entry) const;

  std::filesystem::path picture_path(const run_key& key) const { return path_of(key, ".exr"); }

 private:
  std::filesystem::path path_of(const run_key& key, const char* extension) const;
  cache_entry load(const run_key& key) const;
  void warn(const run_key& key, const std::string& reason) const;

  std::filesystem::path directory_;
  std::ostream& log_;
};

}  // namespace quality
