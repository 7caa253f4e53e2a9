// Files of sections as bytes. Takes them apart and joins them by their documented format, without the
// library's reader.
#pragma once

#include "support/catch.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace wfpg_test {

/// A section in a file's bytes.
struct section_place {
  std::string name;
  std::size_t head, payload, size;
};

/// The `n` bytes of a little-endian number.
inline std::uint64_t number_in(const std::string& bytes, std::size_t at, std::size_t n) {
  std::uint64_t value = 0;
  for (std::size_t i = n; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}
inline void set_number(std::string& bytes, std::size_t at, std::size_t n, std::uint64_t value) {
  for (std::size_t i = 0; i < n; ++i) bytes[at + i] = static_cast<char>(value >> 8 * i);
}

inline std::uint64_t fnv1a(const std::string& bytes) {
  std::uint64_t hash = 14695981039346656037ull;
  for (const char c : bytes) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 1099511628211ull;
  }
  return hash;
}

inline std::vector<section_place> sections_of(const std::string& bytes) {
  std::vector<section_place> places;
  for (std::size_t at = 16; at < bytes.size();) {
    const auto size = static_cast<std::size_t>(number_in(bytes, at + 8, 8));
    places.push_back({bytes.substr(at, 8).c_str(), at, at + 24, size});
    at += 24 + size + 8;
  }
  return places;
}

inline section_place section_of(const std::string& bytes, const std::string& name) {
  for (const section_place& place : sections_of(bytes))
    if (place.name == name) return place;
  FAIL("no section " << name);
  return {};
}

/// The same file with another payload in a section, and correct checksums.
inline std::string with_payload(const std::string& bytes, const std::string& name,
                                const std::string& payload) {
  const section_place place = section_of(bytes, name);
  std::string head = bytes.substr(place.head, 24), tail(8, '\0');
  set_number(head, 8, 8, payload.size());
  set_number(head, 16, 8, fnv1a(head.substr(0, 16)));
  set_number(tail, 0, 8, fnv1a(payload));
  return bytes.substr(0, place.head) + head + payload + tail + bytes.substr(place.payload + place.size + 8);
}

inline std::string payload_of(const std::string& bytes, const std::string& name) {
  const section_place place = section_of(bytes, name);
  return bytes.substr(place.payload, place.size);
}

/// The same file with another number in a section, `at` bytes from its beginning.
inline std::string with_number(const std::string& bytes, const std::string& name, std::size_t at,
                               std::size_t n, std::uint64_t value) {
  std::string payload = payload_of(bytes, name);
  set_number(payload, at, n, value);
  return with_payload(bytes, name, payload);
}

/// The same file of another version.
inline std::string with_version(std::string bytes, std::uint32_t version) {
  set_number(bytes, 8, 4, version);
  set_number(bytes, 12, 4, fnv1a(bytes.substr(0, 12)));
  return bytes;
}

}  // namespace wfpg_test
