// The machine and its files: hashes, other programs' output, and where results were measured.
#pragma once

#include <nlohmann/json.hpp>

#include <filesystem>
#include <optional>
#include <string>

namespace quality {

using json = nlohmann::ordered_json;

/// 64 bits (FNV-1a) as 16 hexadecimal digits. It identifies contents and does not protect against forgery.
std::string hash_of(const std::string& bytes);

/// All bytes of a file. Throws std::runtime_error that names the path.
std::string content_of(const std::filesystem::path& path);

/// The output of a shell command, or nothing if it fails.
std::optional<std::string> output_of(const std::string& command);

/// The library's version, such as 0.2.0.
std::string version();

/// The hash of this program's own file, or the library's version if it cannot be read. Programs of different
/// code measure again.
std::string program_hash();

/// Processor, threads, system and compiler. With `with_gpu` also the GPU and its driver.
json machine(bool with_gpu);

}  // namespace quality
