// Hashes, files, processes, the machine.
#include "system.hpp"

#include <wfpg/version.hpp>

#include <sys/utsname.h>

#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <thread>

namespace quality {
namespace {

/// The first line of /proc/cpuinfo that names the model. Empty if there is none.
std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.rfind("model name", 0) == 0 && line.find(": ") != std::string::npos)
      return line.substr(line.find(": ") + 2);
  return "";
}

std::string system_name() {
  utsname names{};
  return uname(&names) == 0 ? std::string(names.sysname) + " " + names.release + " " + names.machine : "";
}

std::string without_newline(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

/// Queried once.
std::string gpu_and_driver() {
  static const std::string names = without_newline(
      output_of("nvidia-smi --query-gpu=name,driver_version --format=csv,noheader 2>/dev/null").value_or(""));
  return names;
}

}  // namespace

std::string version() {
  return std::to_string(WFPG_VERSION_MAJOR) + "." + std::to_string(WFPG_VERSION_MINOR) + "." +
         std::to_string(WFPG_VERSION_PATCH);
}

std::string hash_of(const std::string& bytes) {
  std::uint64_t hash = 14695981039346656037u;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
  return text;
}

std::string content_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path.string() + ": cannot be opened");
  std::string content((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (file.bad()) throw std::runtime_error(path.string() + ": cannot be read");
  return content;
}

std::optional<std::string> output_of(const std::string& command) {
  std::FILE* const pipe = popen(command.c_str(), "r");
  if (!pipe) return std::nullopt;
  std::string output;
  char part[4096];
  for (std::size_t size; (size = std::fread(part, 1, sizeof part, pipe)) > 0;) output.append(part, size);
  return pclose(pipe) == 0 ? std::optional<std::string>(output) : std::nullopt;
}

std::string program_hash() {
  static const std::string hash = [] {
    try {
      return hash_of(content_of("/proc/self/exe"));
    } catch (const std::runtime_error&) {
      return version();
    }
  }();
  return hash;
}

json machine(bool with_gpu) {
  json result{{"processor", processor()},
              {"threads", std::thread::hardware_concurrency()},
              {"system", system_name()},
              {"compiler", __VERSION__}};
  if (with_gpu) result["gpu_and_driver"] = gpu_and_driver();
  return result;
}

}  // namespace quality
