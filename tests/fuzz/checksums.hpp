// Corrects the checksums in files of sections, so that fuzzers reach the code behind them.
#pragma once

#include <wfpg/guide_file.hpp>
#include <wfpg/state/section_file.hpp>

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>

namespace wfpg_fuzz {

template <class T>
void set_number(std::string& bytes, std::size_t at, T value) {
  std::string number;
  wfpg::put_number(number, value);
  bytes.replace(at, sizeof(T), number);
}

/// The same bytes with correct checksums, also of a guide file inside of a section.
inline std::string with_checksums(std::string bytes) {
  using wfpg::checksum;
  if (bytes.size() < 16) return bytes;
  const auto sum = [&bytes](std::size_t first, std::size_t n) {
    return checksum(std::string_view(bytes).substr(first, n));
  };
  set_number(bytes, 12, static_cast<std::uint32_t>(sum(0, 12)));
  for (std::size_t at = 16; bytes.size() - at >= 32;) {
    const auto said = wfpg::number_at<std::uint64_t>(&bytes[at + 8]);
    const std::size_t size = static_cast<std::size_t>(std::min<std::uint64_t>(said, bytes.size() - at - 32));
    const std::size_t inner = at + 24 + 8;  // after the length of a text
    if (size > 8 && bytes.compare(inner, 8, wfpg::detail::guide_file_kind.magic) == 0)
      bytes.replace(inner, size - 8, with_checksums(bytes.substr(inner, size - 8)));
    set_number(bytes, at + 16, sum(at, 16));
    set_number(bytes, at + 24 + size, sum(at + 24, size));
    at += size + 32;
  }
  return bytes;
}

}  // namespace wfpg_fuzz
