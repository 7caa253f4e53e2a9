// Files of the cache.
#include "cache.hpp"

#include "app/output_files.hpp"

#include <ostream>
#include <stdexcept>
#include <utility>

namespace quality {

namespace fs = std::filesystem;

run_cache::run_cache(fs::path directory, std::ostream& log) : directory_(std::move(directory)), log_(log) {
  render::prepare_folder("--cache", directory_);
}

fs::path run_cache::path_of(const run_key& key, const char* extension) const {
  return directory_ / (key.label + "-" + key.hash() + extension);
}

bool run_cache::contains(const run_key& key) const {
  return fs::exists(path_of(key, ".json"));
}

cache_entry run_cache::load(const run_key& key) const {
  const json file = json::parse(content_of(path_of(key, ".json")));
  if (file.at("key") != key.content) throw std::runtime_error("is of another rendering");
  cache_entry entry{file.at("result"), std::nullopt};
  if (file.at("has_picture").get<bool>()) entry.picture = render::read_exr(picture_path(key).string());
  return entry;
}

void run_cache::store(const run_key& key, const cache_entry& entry) const {
  if (entry.picture) render::write_exr(picture_path(key).string(), *entry.picture);
  const json file{{"key", key.content}, {"has_picture", entry.picture.has_value()}, {"result", entry.result}};
  render::write_file(path_of(key, ".json").string(), file.dump(1) + "\n");
}

void run_cache::warn(const run_key& key, const std::string& reason) const {
  log_ << "wfpg-quality: warning: " << path_of(key, ".json").string()
       << " is damaged and is rendered again: " << reason << '\n';
}

}  // namespace quality
