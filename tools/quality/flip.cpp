// Runs the script flip.py, which the build embeds, and reads its answer.
#include "flip.hpp"

#include "app/output_files.hpp"
#include "system.hpp"

#include <unistd.h>

#include <string>

namespace quality {

extern const char* const flip_script;

namespace {

namespace fs = std::filesystem;

/// Quotes a path for a POSIX shell.
std::string quoted(const fs::path& path) {
  std::string result = "'";
  for (const char c : path.string()) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

/// Temporary files that are deleted at its end.
class exchange {
 public:
  explicit exchange(const fs::path& folder)
      : stem_((folder / ("flip-" + std::to_string(getpid()))).string()) {}
  ~exchange() {
    std::error_code ignored;
    for (const char* const extension : {".py", ".pairs.json", ".errors.json"})
      fs::remove(file(extension), ignored);
  }
  exchange(const exchange&) = delete;
  exchange& operator=(const exchange&) = delete;

  fs::path file(const char* extension) const { return stem_ + extension; }

 private:
  std::string stem_;
};

}  // namespace

std::optional<std::vector<std::optional<double>>> flip_errors(
    const std::vector<std::pair<fs::path, fs::path>>& pairs, const fs::path& folder) {
  const exchange files(folder);
  json list = json::array();
  for (const auto& [reference, test] : pairs)
    list.push_back({fs::absolute(reference).string(), fs::absolute(test).string()});
  render::write_file(files.file(".py").string(), flip_script);
  render::write_file(files.file(".pairs.json").string(), list.dump());
  if (!output_of("python3 " + quoted(files.file(".py")) + " " + quoted(files.file(".pairs.json")) + " " +
                 quoted(files.file(".errors.json"))))
    return std::nullopt;
  std::vector<std::optional<double>> errors;
  for (const json& error : json::parse(content_of(files.file(".errors.json"))))
    errors.push_back(error.is_null() ? std::optional<double>() : std::optional<double>(error.get<double>()));
  return errors;
}

}  // namespace quality
