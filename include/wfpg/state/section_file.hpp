// Files of named sections, for state on disk: numbers are little-endian, and each section has its length and
// a checksum, so that what is truncated, altered or foreign is told apart. Reading takes no more memory than
// twice the bytes that are there, whatever lengths say.
//
//   file     magic (8 bytes), version (4), checksum of these 12 (4: the lower half), sections, of which the
//            last is named "end"
//   section  name (8, padded with zeros), length (8), checksum of these 16 (8), payload, its checksum (8)
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/types.hpp>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <istream>
#include <ostream>
#include <random>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

namespace wfpg {

/// FNV-1a of 64 bits (Fowler, Noll and Vo): no single altered byte goes unnoticed. `hash`: of the bytes
/// before these.
inline std::uint64_t checksum(std::string_view bytes, std::uint64_t hash = 0xcbf29ce484222325ull) {
  for (const char byte : bytes) hash = (hash ^ static_cast<unsigned char>(byte)) * 0x100000001b3ull;
  return hash;
}

/// A number's bits as an unsigned integer of its size.
template <class T>
struct number_bits {
  static_assert(std::is_arithmetic_v<T> && !std::is_same_v<T, bool>, "files hold numbers of one size");
  using type = std::conditional_t<
      sizeof(T) == 1, std::uint8_t,
      std::conditional_t<sizeof(T) == 2, std::uint16_t,
                         std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>>>;
};

/// Appends a number.
template <class T>
void put_number(std::string& bytes, T value) {
  typename number_bits<T>::type bits;
  std::memcpy(&bits, &value, sizeof value);
  char little[sizeof(T)];
  for (std::size_t i = 0; i < sizeof(T); ++i) little[i] = static_cast<char>(std::uint64_t(bits) >> 8 * i);
  bytes.append(little, sizeof(T));
}

/// The number at the beginning of sizeof(T) bytes.
template <class T>
T number_at(const char* bytes) {
  std::uint64_t word = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i)
    word |= std::uint64_t(static_cast<unsigned char>(bytes[i])) << 8 * i;
  const auto bits = static_cast<typename number_bits<T>::type>(word);
  T value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

/// What a file is of.
struct file_kind {
  std::string_view magic;  ///< 8 bytes
  std::uint32_t version;   ///< that is written, and the newest that is read
  const char* name;        ///< "a guide file"
};

/// The payload of a section, number by number.
class section_writer {
 public:
  template <class T>
  void put(T value) {
    put_number(bytes_, value);
  }
  void put(vec3 v) {
    for (int i = 0; i < 3; ++i) put(v[i]);
  }
  template <class T>
  void put_all(const T* values, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) put(values[i]);
  }
  template <class T>
  void put_all(const std::vector<T>& values) {
    put_all(values.data(), values.size());
  }
  /// A length and so many bytes.
  void put_text(std::string_view text) {
    put(std::uint64_t(text.size()));
    bytes_ += text;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// Writes a file's sections in their order. `name` is what errors call it.
class file_writer {
 public:
  file_writer(std::ostream& out, const file_kind& kind, std::string name)
      : out_(out), name_(std::move(name)) {
    std::string head(kind.magic);
    put_number(head, kind.version);
    put_number(head, static_cast<std::uint32_t>(checksum(head)));
    write(head);
  }

  /// Throws file_error where the stream takes no more.
  void section(std::string_view name, const section_writer& content) {
    std::string head(name);
    head.resize(8, '\0');
    put_number(head, std::uint64_t(content.bytes().size()));
    put_number(head, checksum(head));
    write(head);
    write(content.bytes());
    std::string tail;
    put_number(tail, checksum(content.bytes()));
    write(tail);
  }
  void end() { section("end", {}); }

 private:
  void write(const std::string& bytes) {
    if (!out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size())))
      throw file_error(name_, "cannot be written");
  }

  std::ostream& out_;
  std::string name_;
};

/// The payload of a section, in the order in which it was put. What it asks for and is not there throws
/// file_error.
class section_reader {
 public:
  section_reader(std::string file, std::string_view name, std::string bytes)
      : file_(std::move(file)), name_(name), bytes_(std::move(bytes)) {}

  std::size_t left() const { return bytes_.size() - at_; }

  template <class T>
  T get() {
    require(left() >= sizeof(T), "is too short");
    at_ += sizeof(T);
    return number_at<T>(bytes_.data() + at_ - sizeof(T));
  }
  vec3 get_vec3() {
    const auto x = get<float>(), y = get<float>();
    return {x, y, get<float>()};
  }
  template <class T>
  std::vector<T> get_all(std::size_t n) {
    require(n <= left() / sizeof(T), "is too short");
    std::vector<T> values(n);
    for (T& value : values) value = get<T>();
    return values;
  }
  std::string get_text() {
    const auto size = get<std::uint64_t>();
    require(size <= left(), "is too short");
    at_ += static_cast<std::size_t>(size);
    return bytes_.substr(at_ - static_cast<std::size_t>(size), static_cast<std::size_t>(size));
  }
  /// All has been read.
  void end() const { require(left() == 0, "is too long"); }

  /// Throws file_error "section NAME WHAT" unless `holds`.
  void require(bool holds, const char* what) const {
    if (!holds) throw file_error(file_, "section " + name_ + " " + what);
  }

 private:
  std::string file_, name_, bytes_;
  std::size_t at_ = 0;
};

/// Reads a file's sections in their order, and checks what can be checked without knowing what is in them.
class file_reader {
 public:
  /// Throws file_error where the stream is no file of this kind, or a newer one.
  file_reader(std::istream& in, const file_kind& kind, std::string name) : in_(in), name_(std::move(name)) {
    std::string head;
    fetch(head, 16);
    const std::size_t known = std::min(head.size(), kind.magic.size());
    if (head.empty() || head.compare(0, known, kind.magic.substr(0, known)) != 0)
      fail(std::string("is not ") + kind.name);
    require_all(head, 16, "its head");
    if (number_at<std::uint32_t>(&head[12]) !=
        static_cast<std::uint32_t>(checksum(std::string_view(head).substr(0, 12))))
      fail("is altered: the checksum of its head differs");
    const auto version = number_at<std::uint32_t>(&head[8]);
    if (version != kind.version)
      fail("is of version " + std::to_string(version) + ", expected " + std::to_string(kind.version) +
           (version > kind.version ? " or older: a newer wfpg wrote it" : ""));
  }

  /// The section that comes next, whose name has at most 8 characters. Throws file_error.
  section_reader section(std::string_view name) {
    const std::string what = "section " + std::string(name);
    std::string expected(name), head, tail, bytes;
    expected.resize(8, '\0');
    fetch(head, 24);
    require_all(head, 24, "the head of " + what);
    if (number_at<std::uint64_t>(&head[16]) != checksum(std::string_view(head).substr(0, 16)))
      fail("is altered: the checksum of the head of " + what + " differs");
    if (head.compare(0, 8, expected) != 0) fail("has no " + what + " where it belongs");
    const auto size = number_at<std::uint64_t>(&head[8]);
    fetch(bytes, size);
    require_all(bytes, size, what);
    fetch(tail, 8);
    require_all(tail, 8, "the checksum of " + what);
    if (number_at<std::uint64_t>(tail.data()) != checksum(bytes))
      fail("is altered: the checksum of " + what + " differs");
    return {name_, name, std::move(bytes)};
  }
  void end() { section("end").end(); }

  [[noreturn]] void fail(const std::string& reason) const { throw file_error(name_, reason); }

 private:
  // In pieces, so that a length that is wrong asks for no more memory than there are bytes.
  void fetch(std::string& bytes, std::uint64_t size) {
    constexpr std::uint64_t piece = 1 << 20;
    while (bytes.size() < size && in_) {
      const std::size_t before = bytes.size();
      bytes.resize(before + static_cast<std::size_t>(std::min(piece, size - before)));
      in_.read(&bytes[before], static_cast<std::streamsize>(bytes.size() - before));
      bytes.resize(before + static_cast<std::size_t>(in_.gcount()));
    }
    read_ += bytes.size();
  }
  void require_all(const std::string& bytes, std::uint64_t size, const std::string& what) const {
    if (bytes.size() < size)
      fail("is truncated at byte " + std::to_string(read_) + ", in " + what + ", which has " +
           std::to_string(size) + " bytes");
  }

  std::istream& in_;
  std::string name_;
  std::uint64_t read_ = 0;
};

/// The file that a path names, through symbolic links, which may dangle. Throws file_error where links go
/// round and where something that is no regular file is there.
inline std::filesystem::path file_behind(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path file = path;
  for (int links = 0; fs::is_symlink(fs::symlink_status(file, error)); ++links) {
    if (links == 40) throw file_error(path, "is a symbolic link that leads nowhere");
    file = file.parent_path() / fs::read_symlink(file, error);
  }
  if (fs::exists(file, error) && !fs::is_regular_file(file, error))
    throw file_error(path, "is there and is not a file");
  return file;
}

/// Makes an empty file beside another, under a name that no other process has. Throws file_error.
inline std::filesystem::path make_partial(const std::filesystem::path& file, const std::string& name) {
  std::random_device random;
  for (int tries = 0; tries < 100; ++tries) {
    std::filesystem::path partial = file;
    partial += "." + std::to_string(random()) + ".partial";
    if (std::FILE* const made = std::fopen(partial.c_str(), "wbx")) {  // fails where it is there
      std::fclose(made);
      return partial;
    }
    if (errno != EEXIST) break;
  }
  throw file_error(name, std::string("cannot be written: ") + std::strerror(errno));
}

/// Replaces a file by what `write(std::ostream&)` writes: whoever opens it finds the old one or all of the
/// new one. The new one is written under a name of its own beside it, keeps the old one's permissions, and
/// symbolic links stay links. Throws file_error; what `write` throws.
template <class Write>
void replace_file(const std::string& path, const Write& write) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path file = file_behind(path), partial = make_partial(file, path);
  try {
    std::ofstream out(partial, std::ios::binary);
    if (!out) throw file_error(path, "cannot be written");
    write(out);
    out.close();
    if (!out) throw file_error(path, "cannot be written: the disk may be full");
    const fs::file_status old = fs::status(file, error);
    if (fs::exists(old)) fs::permissions(partial, old.permissions(), error);
    fs::rename(partial, file, error);
    if (error) throw file_error(path, "cannot be written: " + error.message());
  } catch (...) {
    fs::remove(partial, error);
    throw;
  }
}

/// Opens a file and has it read by `read(std::istream&)`, which is to leave nothing of it. Throws file_error;
/// what `read` throws.
template <class Read>
auto read_file(const std::string& path, const Read& read) {
  std::ifstream in(path, std::ios::binary);
  std::error_code error;
  if (!in || std::filesystem::is_directory(path, error)) throw file_error(path, "cannot be opened");
  auto result = read(in);
  if (in.peek() != std::istream::traits_type::eof()) throw file_error(path, "goes on after its end");
  return result;
}

}  // namespace wfpg
