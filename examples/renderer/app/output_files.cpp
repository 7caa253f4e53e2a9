// The library's replace_file() writes the files.
#include "app/output_files.hpp"

#include <wfpg/state/section_file.hpp>

#include <algorithm>
#include <cctype>
#include <ostream>
#include <stdexcept>

namespace render {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& option, const std::string& reason) {
  throw std::invalid_argument(option + ": " + reason);
}

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

void check_extension(const named_file& output) {
  if (output.extension.empty() || lower_case(fs::path(output.path).extension().string()) == output.extension)
    return;
  const bool is_picture = output.extension == ".exr" || output.extension == ".png";
  refuse(output.option, "expected a name that ends in " + output.extension + ", not " + output.path +
                            (is_picture ? " (pictures are .exr by --output and .png by --png)" : ""));
}

/// The absolute name of the file behind links. It need not exist.
fs::path identity_of(const std::string& path) {
  std::error_code error;
  const fs::path known = fs::canonical(path, error);
  if (!error) return known;
  const fs::path file = fs::absolute(wfpg::file_behind(path), error);
  return fs::weakly_canonical(file.parent_path(), error) / file.filename();
}

void check_place(const named_file& output) {
  try {
    fs::remove(wfpg::make_partial(wfpg::file_behind(output.path), output.path));
  } catch (const std::exception& error) {
    refuse(output.option, reason_of(error));
  }
}

void check_distinct(const named_file& output, const named_file& other) {
  if (other.path.empty()) return;
  std::error_code error;
  if (identity_of(output.path) == identity_of(other.path) || fs::equivalent(output.path, other.path, error))
    refuse(output.option, output.path + " is the file of " + other.option + " too");
}

}  // namespace

void write_file(const std::string& path, const std::string& content) {
  wfpg::replace_file(path, [&](std::ostream& out) { out << content; });
}

void check_outputs(const std::vector<named_file>& outputs, const std::vector<named_file>& inputs) {
  for (auto output = outputs.begin(); output != outputs.end(); ++output) {
    if (output->path.empty()) continue;
    check_extension(*output);
    check_place(*output);
    for (auto other = outputs.begin(); other != output; ++other) check_distinct(*output, *other);
    for (const named_file& input : inputs) check_distinct(*output, input);
  }
}

void prepare_folder(const std::string& option, const fs::path& folder) {
  try {
    fs::create_directories(folder);
    fs::remove(wfpg::make_partial(folder / "output", folder.string()));
  } catch (const fs::filesystem_error& error) {
    refuse(option, folder.string() + " is no folder to write to: " + error.code().message());
  } catch (const std::exception& error) {
    refuse(option, reason_of(error));
  }
}

std::string reason_of(const std::exception& error) {
  std::string text = error.what();
  const std::string library = "wfpg: ";
  if (text.compare(0, library.size(), library) == 0) text.erase(0, library.size());
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

}  // namespace render
