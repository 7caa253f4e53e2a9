// Finished renderings in a directory: what an interrupted run has done is not done again.
#pragma once

#include "app/image_io.hpp"
#include "system.hpp"

#include <exception>
#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>

namespace quality {

/// What tells a rendering from all others, with a name for people.
struct run_key {
  std::string label;  ///< the beginning of the files' names
  json content;       ///< an object; all that the result depends on

  std::string hash() const { return hash_of(content.dump()); }
};

struct cache_entry {
  json result;
  std::optional<render::image> picture;
};

/// A JSON file a rendering, and an OpenEXR beside it where it has a picture. A file appears under its name
/// when it is complete; the JSON is last. One that is damaged is warned of and counts as absent.
class run_cache {
 public:
  /// Makes the directory. Warnings go to `log`, which outlives the cache. Throws std::invalid_argument where
  /// files cannot be made in it.
  run_cache(std::filesystem::path directory, std::ostream& log);

  /// Whether it looks finished; find may still see damage.
  bool contains(const run_key& key) const;

  /// `read(entry)` of a finished rendering. What `read` throws counts as damage.
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
