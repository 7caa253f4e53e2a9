// Files are replaced as a whole: by several processes, through links, on a full disk.
#include "support/catch.hpp"
#include "support/temporary_folder.hpp"

#include <wfpg/state/section_file.hpp>

#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <ostream>
#include <stdexcept>
#include <string>

namespace {

using namespace wfpg_test;
using wfpg::replace_file;
namespace fs = std::filesystem;

void replace_by(const std::string& path, const std::string& bytes) {
  replace_file(path, [&](std::ostream& out) { out << bytes; });
}

/// The error message if a file cannot be replaced.
std::string refusal_of(const std::string& path) {
  try {
    replace_by(path, "new");
  } catch (const wfpg::file_error& error) {
    return error.what();
  }
  return "";
}

TEST_CASE("a file is replaced and keeps its permissions", "[replace_file]") {
  const temporary_folder folder;
  const std::string path = folder.write("a", "old");
  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write);
  replace_by(path, "new");
  CHECK(content_of(path) == "new");
  CHECK(fs::status(path).permissions() == (fs::perms::owner_read | fs::perms::owner_write));
  CHECK(files_in(folder) == 1);
}

TEST_CASE("a writer that throws leaves the old file", "[replace_file]") {
  const temporary_folder folder;
  const std::string path = folder.write("a", "old");
  const auto fail = [](std::ostream& out) {
    out << "half";
    throw std::runtime_error("fails on request");
  };
  CHECK_THROWS_AS(replace_file(path, fail), std::runtime_error);
  CHECK(content_of(path) == "old");
  CHECK(files_in(folder) == 1);
}

TEST_CASE("a file that does not fit leaves the old one", "[replace_file]") {
  const temporary_folder folder;
  const std::string path = folder.write("a", "old");
  const pid_t child = fork();
  if (child == 0) {
    const rlimit small{1000, 1000};  // bytes of a file
    std::signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &small);
    try {
      replace_by(path, std::string(100000, 'x'));
    } catch (const wfpg::file_error&) {
      _exit(0);
    }
    _exit(1);
  }
  int status = -1;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(WEXITSTATUS(status) == 0);
  CHECK(content_of(path) == "old");
  CHECK(files_in(folder) == 1);
}

TEST_CASE("several processes may replace one file at the same time", "[replace_file]") {
  const temporary_folder folder;
  const std::string path = folder.file("a");
  constexpr int processes = 4, rounds = 50;
  for (int p = 0; p < processes; ++p) {
    if (fork() != 0) continue;
    int failed = 0;
    for (int round = 0; round < rounds; ++round) {
      try {
        replace_by(path, std::string(20000, static_cast<char>('a' + p)));
      } catch (const wfpg::file_error&) {
        ++failed;
      }
    }
    _exit(failed);
  }
  for (int p = 0; p < processes; ++p) {
    int status = -1;
    wait(&status);
    CHECK(WEXITSTATUS(status) == 0);
  }
  const std::string bytes = content_of(path);
  CHECK(bytes == std::string(20000, bytes.at(0)));
  CHECK(files_in(folder) == 1);
}

TEST_CASE("links stay links, and their targets are replaced", "[replace_file]") {
  const temporary_folder folder;
  fs::create_directory(folder.file("in"));
  const std::string target = folder.write("in/target", "old"), link = folder.file("link");
  fs::create_symlink("in/target", link);
  replace_by(link, "new");
  CHECK(fs::is_symlink(link));
  CHECK(content_of(target) == "new");

  fs::create_symlink("in/later", folder.file("dangling"));
  replace_by(folder.file("dangling"), "made");
  CHECK(fs::is_symlink(folder.file("dangling")));
  CHECK(content_of(folder.file("in/later")) == "made");

  fs::create_symlink("round", folder.file("round"));
  CHECK(refusal_of(folder.file("round")) ==
        "wfpg: " + folder.file("round") + " is a symbolic link that leads nowhere");
}

TEST_CASE("folders, pipes and devices are refused and left alone", "[replace_file]") {
  const temporary_folder folder;
  const std::string fifo = folder.file("fifo");
  REQUIRE(mkfifo(fifo.c_str(), 0600) == 0);
  for (const std::string& path : {fifo, folder.file(""), std::string("/dev/null")})
    CHECK(refusal_of(path) == "wfpg: " + path + " is there and is not a file");
  CHECK(fs::is_fifo(fifo));
  CHECK(refusal_of(folder.file("none/a")) ==
        "wfpg: " + folder.file("none/a") + " cannot be written: No such file or directory");
}

}  // namespace
