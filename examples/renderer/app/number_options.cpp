// Checks texts and, where CLI11 would read them otherwise, rewrites them.
#include "app/number_options.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <optional>
#include <string>

namespace render {
namespace {

constexpr std::uint64_t most_bytes = std::uint64_t(1) << 40;

/// The number of a text of decimal digits. Empty for other characters, no digits, or too many.
std::optional<std::uint64_t> digits_of(const std::string& text) {
  std::uint64_t value = 0;
  const char* const end = text.data() + text.size();
  const std::from_chars_result read = std::from_chars(text.data(), end, value);
  return read.ec == std::errc() && read.ptr == end ? std::optional<std::uint64_t>(value) : std::nullopt;
}

/// The number of a decimal fraction. Neither hexadecimal nor infinite nor NaN.
std::optional<double> fraction_of(const std::string& text) {
  if (text.empty() || text.find_first_not_of("0123456789+-.eE") != std::string::npos) return std::nullopt;
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return end == text.c_str() + text.size() ? std::optional<double>(value) : std::nullopt;
}

std::optional<std::uint64_t> bytes_of(const std::string& text) {
  const std::size_t digits = std::min(text.find_first_not_of("0123456789"), text.size());
  std::string unit = CLI::detail::to_lower(text.substr(digits));
  const std::string prefixes = "kmgt";
  const std::size_t prefix = unit.empty() ? std::string::npos : prefixes.find(unit[0]);
  const int shift = prefix == std::string::npos ? 0 : 10 * (static_cast<int>(prefix) + 1);
  if (shift > 0) unit.erase(0, 1);
  const bool is_unit = unit.empty() || unit == "b" || (shift > 0 && unit == "ib");
  const std::optional<std::uint64_t> value = digits_of(text.substr(0, digits));
  if (!is_unit || !value || *value > most_bytes >> shift) return std::nullopt;
  return *value << shift;
}

std::string shown(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

std::string range_name(std::uint64_t least, std::uint64_t most) {
  return std::to_string(least) + " to " + std::to_string(most);
}

/// `accept` returns the text that CLI11 reads, or nothing.
CLI::Validator validator(const std::string& expected, const std::string& help,
                         const std::function<std::optional<std::string>(const std::string&)>& accept) {
  return CLI::Validator(
      [=](std::string& text) -> std::string {
        const std::optional<std::string> accepted = accept(text);
        if (!accepted) return "expected " + expected + ", not " + (text.empty() ? "nothing" : text);
        text = *accepted;
        return {};
      },
      help);
}

CLI::Validator fraction(const std::string& range, const std::function<bool(double)>& is_in_range) {
  return validator("a number " + range, range, [=](const std::string& text) {
    const std::optional<double> value = fraction_of(text);
    return value && is_in_range(*value) ? std::optional<std::string>(text) : std::nullopt;
  });
}

}  // namespace

CLI::Validator whole_number(std::uint64_t least, std::uint64_t most) {
  const std::string range = range_name(least, most);
  return validator("a whole number from " + range, range, [=](const std::string& text) {
    const std::optional<std::uint64_t> value = digits_of(text);
    return value && *value >= least && *value <= most ? std::optional<std::string>(std::to_string(*value))
                                                      : std::nullopt;
  });
}

CLI::Validator power_of_two(std::uint64_t least, std::uint64_t most) {
  const std::string range = "a power of two from " + range_name(least, most);
  return validator(range, range, [=](const std::string& text) {
    const std::optional<std::uint64_t> value = digits_of(text);
    const bool is_power = value && *value > 0 && (*value & (*value - 1)) == 0;
    return is_power && *value >= least && *value <= most ? std::optional<std::string>(std::to_string(*value))
                                                         : std::nullopt;
  });
}

CLI::Validator number(double least, double most) {
  return fraction("from " + shown(least) + " to " + shown(most),
                  [=](double value) { return value >= least && value <= most; });
}

CLI::Validator positive_number(double most) {
  return fraction("above 0, up to " + shown(most),
                  [=](double value) { return value > 0.0 && value <= most; });
}

CLI::Validator byte_count() {
  return validator("bytes from 0 to 1TiB, such as 24MiB", "0 to 1TiB", [](const std::string& text) {
    const std::optional<std::uint64_t> value = bytes_of(text);
    return value ? std::optional<std::string>(std::to_string(*value)) : std::nullopt;
  });
}

CLI::Validator file_path() {
  return validator("a path", "", [](const std::string& text) {
    return text.empty() ? std::nullopt : std::optional<std::string>(text);
  });
}

}  // namespace render
