// Files and folders that programs write: files are replaced whole, and paths are checked before any work.
#pragma once

#include <exception>
#include <filesystem>
#include <string>
#include <vector>

namespace render {

/// A file that an option names.
struct named_file {
  std::string option;     ///< as messages call it, such as "--stats"
  std::string path;       ///< empty: the option is not given
  std::string extension;  ///< that the name must have, such as ".exr", in either case; empty: any
};

/// Replaces a file by one with this content, or leaves it as it is. Throws wfpg::file_error.
void write_file(const std::string& path, const std::string& content);

/// Checks that all outputs can be written. Throws std::invalid_argument, one line that names option and path,
/// where a folder is missing or cannot be written to, where something that is no regular file is there, where
/// the extension is another, and where an output names the same file as another output or an input. Makes and
/// removes an empty file beside each output.
void check_outputs(const std::vector<named_file>& outputs, const std::vector<named_file>& inputs = {});

/// Makes a folder where there is none, and checks that files can be made in it. Throws std::invalid_argument,
/// one line that names option and path.
void prepare_folder(const std::string& option, const std::filesystem::path& folder);

/// What an exception says, in one line and without the library's name in front.
std::string reason_of(const std::exception& error);

}  // namespace render
