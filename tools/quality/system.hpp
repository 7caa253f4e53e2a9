// What the machine and its files tell: hashes, other programs' output, and where results were measured.
#pragma once

#include <nlohmann/json.hpp>

#include <filesystem>
#include <optional>
#include <string>

namespace quality {

using json = nlohmann::ordered_json;

/// 64 bits (FNV-1a) as 16 hexadecimal digits: tells contents apart, no protection against forgery.
std::string hash_of(const std::string& bytes);

/// All bytes of a file. Throws std::runtime_error that names the path.
std::string content_of(const std::filesystem::path& path);

/// What a shell command prints, or nothing where it fails.
std::optional<std::string> output_of(const std::string& command);

/// The library's, such as 0.1.0.
std::string version();

/// The hash of this program's own file, or the library's version where that cannot be read: programs of
/// different code measure anew.
std::string program_hash();

/// Processor, threads, system and compiler; with `with_gpu` the GPU and its driver.
json machine(bool with_gpu);

}  // namespace quality
