// Files and folders that programs write. Files are replaced as a whole, and paths are checked before any
// work.
#pragma once

#include <exception>
#include <filesystem>
#include <string>
#include <vector>

namespace render {

/// A file that an option names.
struct named_file {
  std::string option;     ///< as in messages, such as "--stats"
  std::string path;       ///< empty: the option is not given
  std::string extension;  ///< that the name must have, such as ".exr", in either case; empty: any
};

/// Replaces a file by this content, or leaves it unchanged. Throws wfpg::file_error.
void write_file(const std::string& path, const std::string& content);

/// Checks that all outputs can be written. Makes and removes an empty file beside each output. Throws
/// std::invalid_argument, one line that names option and path. Reasons are a folder that is missing or cannot
/// be written to, something that is not a regular file, and another extension. Others are an output that
/// names the same file as another output or an input.
void check_outputs(const std::vector<named_file>& outputs, const std::vector<named_file>& inputs = {});

/// Makes a folder if there is none, and checks that files can be made in it. Throws std::invalid_argument,
/// one line that names option and path.
void prepare_folder(const std::string& option, const std::filesystem::path& folder);

/// An exception's message in one line, without the library's name in front.
std::string reason_of(const std::exception& error);

}  // namespace render
