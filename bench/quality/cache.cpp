// Files of the cache.
#include "cache.hpp"

#include <unistd.h>

#include <ostream>
#include <stdexcept>
#include <utility>

namespace quality {

namespace fs = std::filesystem;

run_cache::run_cache(fs::path directory, std::ostream& log) : directory_(std::move(directory)), log_(log) {
  fs::create_directories(directory_);
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
  if (entry.picture) {
    const fs::path unfinished = picture_path(key).string() + ".part" + std::to_string(getpid());
    render::write_exr(unfinished.string(), *entry.picture);
    fs::rename(unfinished, picture_path(key));
  }
  const json file{{"key", key.content}, {"has_picture", entry.picture.has_value()}, {"result", entry.result}};
  write_whole(path_of(key, ".json"), file.dump(1) + "\n");
}

void run_cache::warn(const run_key& key, const std::string& reason) const {
  log_ << "wfpg-quality: warning: " << path_of(key, ".json").string()
       << " is damaged and is rendered again: " << reason << '\n';
}

}  // namespace quality
