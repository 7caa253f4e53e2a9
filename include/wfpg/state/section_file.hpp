// Files of named sections, for state on disk.
// Numbers are little-endian.
// Each section has its length and a checksum.
// Files that are truncated, altered or of another kind are thus recognised, each with a message of its own.
//
//   file     magic (8 bytes), version (4), checksum of these 12 (4: the lower half), sections, of which the
//            last is named "end"
//   section  name (8, padded with zeros), length (8), checksum of these 16 (8), payload, its checksum (8)
//
// Source: the chunk layout of PNG (ISO/IEC 15948), with a version and longer checksums.
// Cost: O(bytes), one multiplication a byte for the checksum. All on the host.
// Memory: a section's payload at a time.
// Reading takes at most twice the bytes present, whatever lengths say.
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

/// Returns the 64-bit FNV-1a checksum of `bytes`.
/// Source: Fowler, Noll and Vo.
/// No single altered byte goes unnoticed.
/// It is no protection against intent.
/// `hash`: the checksum of the bytes before these; by default there are none.
inline std::uint64_t checksum(std::string_view bytes, std::uint64_t hash = 0xcbf29ce484222325ull) {
  for (const char byte : bytes) hash = (hash ^ static_cast<unsigned char>(byte)) * 0x100000001b3ull;
  return hash;
}

/// The unsigned integer type that has a number's size.
/// T is arithmetic, of 1, 2, 4 or 8 bytes, and not bool.
/// Other types do not compile: files hold numbers of one size on every host.
template <class T>
struct number_bits {
  static_assert(std::is_arithmetic_v<T> && !std::is_same_v<T, bool>, "files hold numbers of one size");
  /// Unsigned integer of sizeof(T) bytes.
  using type = std::conditional_t<
      sizeof(T) == 1, std::uint8_t,
      std::conditional_t<sizeof(T) == 2, std::uint16_t,
                         std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>>>;
};

/// Appends a number's bytes, the lowest first, on any host.
/// Floats go by their IEEE 754 bits.
template <class T>
void put_number(std::string& bytes, T value) {
  typename number_bits<T>::type bits;
  std::memcpy(&bits, &value, sizeof value);
  // Shifts do not depend on the host's byte order.
  char little[sizeof(T)];
  for (std::size_t i = 0; i < sizeof(T); ++i) little[i] = static_cast<char>(std::uint64_t(bits) >> 8 * i);
  bytes.append(little, sizeof(T));
}

/// Returns the number at the beginning of sizeof(T) bytes.
/// Inverse of put_number(); no alignment is needed.
template <class T>
T number_at(const char* bytes) {
  std::uint64_t word = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i)
    word |= std::uint64_t(static_cast<unsigned char>(bytes[i])) << 8 * i;
  // Narrowing drops nothing: only sizeof(T) bytes were read.
  const auto bits = static_cast<typename number_bits<T>::type>(word);
  T value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

/// What a file holds, and in which version of its layout.
/// Its strings must outlive readers and writers; literals do.
struct file_kind {
  std::string_view magic;  ///< exactly 8 bytes
  std::uint32_t version;   ///< written, and the only one that is read
  const char* name;        ///< for messages, with its article: "a guide file"
};

/// Collects the payload of a section in memory, number by number.
/// Amortised O(1) a number.
class section_writer {
 public:
  /// Appends a number.
  template <class T>
  void put(T value) {
    put_number(bytes_, value);
  }
  /// Appends x, y and z: 12 bytes.
  void put(vec3 v) {
    for (int i = 0; i < 3; ++i) put(v[i]);
  }
  /// Appends n numbers, without their count: a reader must know it.
  template <class T>
  void put_all(const T* values, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) put(values[i]);
  }
  /// Appends all elements of a vector, again without a count.
  template <class T>
  void put_all(const std::vector<T>& values) {
    put_all(values.data(), values.size());
  }
  /// Appends a length of 8 bytes and the text's bytes, in any encoding.
  /// It may contain zeros.
  void put_text(std::string_view text) {
    put(std::uint64_t(text.size()));
    bytes_ += text;
  }
  /// Returns the payload so far.
  /// Valid until the next call of put().
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// Writes a file's sections in their order.
/// Nothing is sought: any output stream will do.
/// A writer keeps no section: memory is that of the caller's section_writer.
class file_writer {
 public:
  /// Writes the head of the file: magic, version, checksum.
  /// `name` is what messages call the file.
  /// The stream must outlive the writer.
  /// Throws file_error where it takes no more.
  file_writer(std::ostream& out, const file_kind& kind, std::string name)
      : out_(out), name_(std::move(name)) {
    // 12 bytes, and 4 of their checksum.
    std::string head(kind.magic);
    put_number(head, kind.version);
    put_number(head, static_cast<std::uint32_t>(checksum(head)));
    write(head);
  }

  /// Writes a section of at most 8 characters' name, with its checksums.
  /// Throws file_error where the stream fails, as a full disk makes it.
  void section(std::string_view name, const section_writer& content) {
    // The name is padded with zeros to 8 bytes, or cut off.
    std::string head(name);
    head.resize(8, '\0');
    put_number(head, std::uint64_t(content.bytes().size()));
    put_number(head, checksum(head));
    write(head);
    write(content.bytes());
    // The payload's checksum comes last, so that a payload could be written as it is made.
    std::string tail;
    put_number(tail, checksum(content.bytes()));
    write(tail);
  }
  /// Writes the empty section "end".
  /// Without it, a reader reports a truncated file.
  /// It takes 32 bytes: head and checksum.
  void end() { section("end", {}); }

 private:
  /// Throws file_error where not all bytes were taken.
  void write(const std::string& bytes) {
    if (!out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size())))
      throw file_error(name_, "cannot be written");
  }

  /// Not owned.
  std::ostream& out_;
  std::string name_;
};

/// Reads the payload of a section in the order in which it was put.
/// Asking for more than is left throws file_error, and moves nothing.
class section_reader {
 public:
  /// `file`, `name`: for messages.
  /// `bytes`: the payload, already checked against its checksum.
  section_reader(std::string file, std::string_view name, std::string bytes)
      : file_(std::move(file)), name_(name), bytes_(std::move(bytes)) {}

  /// Returns the bytes that are not read yet.
  /// 0 at the end of the payload.
  std::size_t left() const { return bytes_.size() - at_; }

  /// Returns the next number.
  template <class T>
  T get() {
    // Checked before anything is read.
    require(left() >= sizeof(T), "is too short");
    at_ += sizeof(T);
    return number_at<T>(bytes_.data() + at_ - sizeof(T));
  }
  /// Returns the next three floats.
  /// Any bits are accepted: the caller tests ranges.
  /// They are read one after the other, as the order of a call's arguments is not defined.
  vec3 get_vec3() {
    const auto x = get<float>(), y = get<float>();
    return {x, y, get<float>()};
  }
  /// Returns the next n numbers.
  /// Their bytes are tested before memory is allocated.
  /// n = 0 gives an empty vector.
  template <class T>
  std::vector<T> get_all(std::size_t n) {
    // Divided rather than multiplied: n from a file must not overflow.
    require(n <= left() / sizeof(T), "is too short");
    std::vector<T> values(n);
    for (T& value : values) value = get<T>();
    return values;
  }
  /// Returns a text that put_text() wrote.
  /// Throws file_error where its length exceeds the rest of the payload.
  std::string get_text() {
    // A length from the file, tested before use.
    const auto size = get<std::uint64_t>();
    // A damaged length would otherwise reach past the payload.
    require(size <= left(), "is too short");
    at_ += static_cast<std::size_t>(size);
    return bytes_.substr(at_ - static_cast<std::size_t>(size), static_cast<std::size_t>(size));
  }
  /// Throws file_error unless the whole payload has been read.
  /// A payload that is too long comes from another layout.
  void end() const { require(left() == 0, "is too long"); }

  /// Throws file_error "section NAME WHAT" unless `holds`.
  void require(bool holds, const char* what) const {
    if (!holds) throw file_error(file_, "section " + name_ + " " + what);
  }

 private:
  std::string file_, name_, bytes_;
  /// Bytes that are read.
  std::size_t at_ = 0;
};

/// Reads a file's sections in their order.
/// Checks what does not need the sections' meaning: order, names, lengths, checksums.
class file_reader {
 public:
  /// Reads and checks the head of the file.
  /// `name` is what messages call the file.
  /// Throws file_error where the stream holds another kind of file, or another version.
  /// The stream must outlive the reader.
  file_reader(std::istream& in, const file_kind& kind, std::string name) : in_(in), name_(std::move(name)) {
    std::string head;
    fetch(head, 16);
    // A file shorter than its magic is truncated, not foreign, if what is there agrees.
    const std::size_t known = std::min(head.size(), kind.magic.size());
    if (head.empty() || head.compare(0, known, kind.magic.substr(0, known)) != 0)
      fail(std::string("is not ") + kind.name);
    require_all(head, 16, "its head");
    // Only then is the version to be trusted.
    if (number_at<std::uint32_t>(&head[12]) !=
        static_cast<std::uint32_t>(checksum(std::string_view(head).substr(0, 12))))
      fail("is altered: the checksum of its head differs");
    // One version is read: older layouts are not converted.
    const auto version = number_at<std::uint32_t>(&head[8]);
    if (version != kind.version)
      fail("is of version " + std::to_string(version) + ", expected " + std::to_string(kind.version) +
           (version > kind.version ? " or older: a newer wfpg wrote it" : ""));
  }

  /// Returns the next section, whose name has at most 8 characters.
  /// Throws file_error where it is missing, truncated or altered.
  section_reader section(std::string_view name) {
    // Names the section in messages.
    const std::string what = "section " + std::string(name);
    std::string expected(name), head, tail, bytes;
    expected.resize(8, '\0');
    fetch(head, 24);
    require_all(head, 24, "the head of " + what);
    // The head has a checksum of its own, so that no damaged length is used.
    if (number_at<std::uint64_t>(&head[16]) != checksum(std::string_view(head).substr(0, 16)))
      fail("is altered: the checksum of the head of " + what + " differs");
    // The order of sections is part of the version.
    if (head.compare(0, 8, expected) != 0) fail("has no " + what + " where it belongs");
    // From here on the length is what the writer wrote.
    const auto size = number_at<std::uint64_t>(&head[8]);
    fetch(bytes, size);
    require_all(bytes, size, what);
    fetch(tail, 8);
    require_all(tail, 8, "the checksum of " + what);
    const auto of_bytes = number_at<std::uint64_t>(tail.data());
    if (of_bytes != checksum(bytes)) fail("is altered: the checksum of " + what + " differs");
    checksums_ = checksum(tail, checksums_);
    return {name_, name, std::move(bytes)};
  }
  /// Reads the section "end".
  /// Throws file_error where another one follows, or where it is not empty.
  void end() { section("end").end(); }
  /// Returns a number that stands for all sections read so far.
  /// Equal for equal sections; for others it differs, but for one chance in 2⁶⁴.
  std::uint64_t checksums() const { return checksums_; }

  /// Throws file_error "wfpg: FILE REASON".
  /// Callers use it for contents that contradict each other.
  [[noreturn]] void fail(const std::string& reason) const { throw file_error(name_, reason); }

 private:
  // Reads up to `size` bytes, in pieces of 1 MiB.
  // A length that is wrong thus asks for no more memory than there are bytes.
  void fetch(std::string& bytes, std::uint64_t size) {
    constexpr std::uint64_t piece = 1 << 20;
    // Ends early where the stream does: require_all() then reports it.
    while (bytes.size() < size && in_) {
      // A string grows to at most twice its size: hence the bound of memory.
      const std::size_t before = bytes.size();
      bytes.resize(before + static_cast<std::size_t>(std::min(piece, size - before)));
      in_.read(&bytes[before], static_cast<std::streamsize>(bytes.size() - before));
      bytes.resize(before + static_cast<std::size_t>(in_.gcount()));
    }
    // Heads, payloads and checksums all count, so that messages name a place in the file.
    read_ += bytes.size();
  }
  /// Throws file_error with the place and the section where fewer than `size` bytes came.
  void require_all(const std::string& bytes, std::uint64_t size, const std::string& what) const {
    if (bytes.size() < size)
      fail("is truncated at byte " + std::to_string(read_) + ", in " + what + ", which has " +
           std::to_string(size) + " bytes");
  }

  std::istream& in_;
  std::string name_;
  /// Bytes read so far, for messages.
  std::uint64_t read_ = 0;
  std::uint64_t checksums_ = 0;
};

/// Returns the file that a path names, through at most 40 symbolic links.
/// The file need not exist.
/// Throws file_error for a cycle of links, and where a folder, device or other special file is there.
inline std::filesystem::path file_behind(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path file = path;
  // 40 links, as Linux allows.
  for (int links = 0; fs::is_symlink(fs::symlink_status(file, error)); ++links) {
    // Either a cycle, or a chain that the system would refuse too.
    if (links == 40) throw file_error(path, "is a symbolic link that leads nowhere");
    // A relative target starts at the link's folder; an absolute one replaces the path.
    file = file.parent_path() / fs::read_symlink(file, error);
  }
  // Renaming over a device would replace the device.
  if (fs::exists(file, error) && !fs::is_regular_file(file, error))
    throw file_error(path, "is there and is not a file");
  return file;
}

/// Creates an empty file beside another, under a new name: FILE.NUMBER.partial.
/// No other process gets that name, since creation fails where the file exists. 100 names are tried.
/// Throws file_error where none can be created, with the system's reason.
inline std::filesystem::path make_partial(const std::filesystem::path& file, const std::string& name) {
  // Not for secrecy: only so that processes seldom try one name.
  std::random_device random;
  for (int tries = 0; tries < 100; ++tries) {
    std::filesystem::path partial = file;
    partial += "." + std::to_string(random()) + ".partial";
    // "x" makes creation exclusive.
    if (std::FILE* const made = std::fopen(partial.c_str(), "wbx")) {
      std::fclose(made);
      return partial;
    }
    // Another error, such as a missing folder, will not go away.
    if (errno != EEXIST) break;
  }
  throw file_error(name, std::string("cannot be written: ") + std::strerror(errno));
}

/// Replaces a file by what `write(std::ostream&)` writes.
/// Whoever opens it finds either the old file or the whole new one.
/// The new file is written beside the old one and then renamed, which POSIX makes atomic.
/// It keeps the old one's permissions.
/// Symbolic links stay links.
/// It does not wait for the disk: a loss of power soon after may lose the new contents.
/// Throws file_error, or what `write` throws.
/// The old file then stays, and the partial one is removed.
template <class Write>
void replace_file(const std::string& path, const Write& write) {
  namespace fs = std::filesystem;
  std::error_code error;
  // The file behind the links is replaced, not the links.
  const fs::path file = file_behind(path), partial = make_partial(file, path);
  try {
    // The empty file is there already: opening it truncates nothing of value.
    std::ofstream out(partial, std::ios::binary);
    if (!out) throw file_error(path, "cannot be written");
    // What it throws leaves the old file untouched.
    write(out);
    // Closing flushes the last bytes, and may find the disk full.
    out.close();
    if (!out) throw file_error(path, "cannot be written: the disk may be full");
    // A file that is new has the permissions that the system gives.
    const fs::file_status old = fs::status(file, error);
    if (fs::exists(old)) fs::permissions(partial, old.permissions(), error);
    // Both lie in one folder, and so in one file system.
    fs::rename(partial, file, error);
    if (error) throw file_error(path, "cannot be written: " + error.message());
  } catch (...) {
    // Its own failure is ignored: the first error is the one to report.
    fs::remove(partial, error);
    throw;
  }
}

/// Opens a file, returns what `read(std::istream&)` returns, and closes it.
/// `read` must leave no byte unread.
/// Throws file_error, or what `read` throws.
template <class Read>
auto read_file(const std::string& path, const Read& read) {
  std::ifstream in(path, std::ios::binary);
  std::error_code error;
  // Some systems open a folder as a stream, and fail only at the first read.
  if (!in || std::filesystem::is_directory(path, error)) throw file_error(path, "cannot be opened");
  // Its result must be movable.
  auto result = read(in);
  // Bytes after the last section are a sign of damage.
  if (in.peek() != std::istream::traits_type::eof()) throw file_error(path, "goes on after its end");
  return result;
}

}  // namespace wfpg
