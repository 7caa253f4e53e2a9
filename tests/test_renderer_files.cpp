// Files that the renderer's programs write. They are checked before any work, and replaced as a whole or not
// at all.
#include "app/image_io.hpp"
#include "app/output_files.hpp"
#include "app/plot.hpp"
#include "app/stats_json.hpp"
#include "support/catch.hpp"
#include "support/command_lines.hpp"
#include "support/file_size_limit.hpp"
#include "support/renderer_io.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace {

using namespace render_test;
using strings = std::vector<std::string>;
namespace fs = std::filesystem;

render::image noise(int side) {
  render::image picture = render::make_image(side, side);
  for (std::size_t i = 0; i < picture.pixels.size(); ++i)
    picture.pixels[i] = vec3(float(i * 2654435761u % 65521u) / 65521.0f, 1.0f / float(i + 1), 0.5f);
  return picture;
}

/// The error of wfpg-render for a scene that does not exist. Errors of other files come first.
std::string complaint_of(strings arguments) {
  arguments.insert(arguments.begin(), "nowhere.glb");
  const outcome refused = run_render(std::move(arguments));
  CHECK(refused.code == 2);
  CHECK(refused.out.empty());
  CHECK(std::count(refused.log.begin(), refused.log.end(), '\n') == 1);
  return refused.log;
}

/// Drops a superuser's rights while it lives, since permissions do not bind them.
class ordinary_user {
 public:
  ordinary_user() {
    if (before_ == 0) is_set_ = seteuid(65534) == 0;
  }
  ~ordinary_user() {
    if (is_set_) is_set_ = seteuid(before_) != 0;
  }
  ordinary_user(const ordinary_user&) = delete;
  ordinary_user& operator=(const ordinary_user&) = delete;

 private:
  uid_t before_ = geteuid();
  bool is_set_ = false;
};

}  // namespace

TEST_CASE("each output is checked before the scene is loaded", "[renderer][files]") {
  const temporary_folder folder;
  fs::create_directory(folder.file("folder.exr"));
  REQUIRE(mkfifo(folder.file("fifo").c_str(), 0600) == 0);
  for (const std::string option :
       {"--output", "--png", "--stats", "--save-guide", "--save-state", "--resume"}) {
    const std::string end = option == "--output" ? ".exr" : option == "--png" ? ".png" : "";
    const auto complaint = [&](const std::string& path) {
      return complaint_of({"--reference", "other.exr", option, path});
    };
    const std::string missing = folder.file("none/a" + end);
    CHECK(complaint(missing) ==
          "wfpg-render: " + option + ": " + missing + " cannot be written: No such file or directory\n");
    fs::create_directories(folder.file("is" + end));
    CHECK(complaint(folder.file("is" + end)) ==
          "wfpg-render: " + option + ": " + folder.file("is" + end) + " is there and is not a file\n");
    const std::string fifo = folder.file("fifo" + end);
    if (!end.empty()) fs::create_symlink("fifo", fifo);
    CHECK(complaint(fifo) == "wfpg-render: " + option + ": " + fifo + " is there and is not a file\n");
  }
  CHECK(files_in(folder) == 7);  // no file is left behind
}

TEST_CASE("an unwritable folder is found before the scene is loaded", "[renderer][files]") {
  const temporary_folder folder;
  fs::permissions(folder.path(), fs::perms::owner_read | fs::perms::owner_exec | fs::perms::others_read |
                                     fs::perms::others_exec);
  std::string said;
  {
    const ordinary_user user;
    said = complaint_of({"--stats", folder.file("a.json")});
  }
  fs::permissions(folder.path(), fs::perms::owner_all);
  CHECK(said == "wfpg-render: --stats: " + folder.file("a.json") + " cannot be written: Permission denied\n");
}

TEST_CASE("pictures of techniques are files, and their folder is checked", "[renderer][files]") {
  const temporary_folder folder;
  const std::string begin = folder.file("by-");
  CHECK(complaint_of({"--method", "lt", "--technique-pictures", folder.file("none/by-")}) ==
        "wfpg-render: --technique-pictures: " + folder.file("none/by-hits.exr") +
            " cannot be written: No such file or directory\n");
  const outcome done = run_render(
      {"cornell-box", "--method", "lt", "--size", "8x8", "--spp", "1", "--technique-pictures", begin});
  CHECK(done.code == 0);
  for (const char* name : {"hits", "hits-unweighted", "splat", "splat-unweighted"})
    CHECK(render::read_exr(begin + name + ".exr").width == 8);
  CHECK_FALSE(fs::exists(begin + "nee.exr"));
}

TEST_CASE("unknown picture formats are refused, and the known ones are named", "[renderer][files]") {
  const temporary_folder folder;
  for (const std::string name : {"a.jpg", "a", "a.exr.gz", ".exr"})
    CHECK(complaint_of({"-o", folder.file(name)}) ==
          "wfpg-render: --output: expected a name that ends in .exr, not " + folder.file(name) +
              " (pictures are .exr by --output and .png by --png)\n");
  CHECK(contains(complaint_of({"--png", folder.file("a.exr")}), "--png: expected a name that ends in .png"));
  CHECK(contains(complaint_of({"-o", folder.file("A.EXR")}), "nowhere.glb"));
  CHECK(files_in(folder) == 0);
}

TEST_CASE("outputs and inputs must be different files", "[renderer][files]") {
  const temporary_folder folder;
  fs::create_symlink("real.exr", folder.file("link.exr"));
  fs::create_directory(folder.file("in"));
  fs::create_directory_symlink("in", folder.file("same"));
  const auto is_one = [&](const strings& arguments, const std::string& other) {
    return contains(complaint_of(arguments), "is the file of " + other + " too");
  };
  CHECK(is_one({"--stats", folder.file("a"), "--save-state", folder.file("a")}, "--stats"));
  CHECK(is_one({"--stats", folder.file("in/a"), "--save-state", folder.file("in/../in/./a")}, "--stats"));
  CHECK(is_one({"--stats", folder.file("in/a"), "--save-guide", folder.file("same/a")}, "--stats"));
  CHECK(is_one({"-o", folder.file("link.exr"), "--stats", folder.file("real.exr")}, "--output"));
  CHECK(is_one({"-o", folder.file("real.exr"), "--reference", folder.file("link.exr")}, "--reference"));
  CHECK(is_one({"-o", folder.file("a.exr"), "--environment", folder.file("a.exr")}, "--environment"));
  CHECK(is_one({"--stats", folder.file("a"), "--resume", folder.file("a")}, "--stats"));
  folder.write("one.exr", "x");
  fs::create_hard_link(folder.file("one.exr"), folder.file("two.exr"));
  CHECK(is_one({"-o", folder.file("one.exr"), "--stats", folder.file("two.exr")}, "--output"));
  // A resumed rendering may replace the state that it resumes.
  CHECK(contains(complaint_of({"--resume", folder.file("state"), "--save-state", folder.file("state")}),
                 "nowhere.glb"));
  CHECK(contains(complaint_of({"--stats", folder.file("a"), "-o", folder.file("a.exr")}), "nowhere.glb"));
}

TEST_CASE("a reference of another size is found before the first sample", "[renderer][files]") {
  const temporary_folder folder;
  const std::string truth = folder.file("truth.exr");
  render::write_exr(truth, noise(6));
  const strings small{
      "cornell-box", "--method",          "pt", "--spp", "1", "--size", "6x6", "--reference", truth,
      "--stats",     folder.file("stats")};
  const outcome done = run_render(small);
  CHECK(done.code == 0);
  CHECK(contains(done.out, "mse "));
  CHECK(fs::remove(folder.file("stats")));
  strings other = small;
  other[6] = "4x6";
  const outcome refused = run_render(other);
  CHECK(refused.code == 2);
  CHECK(refused.out.empty());
  CHECK(refused.log ==
        "wfpg-render: --reference: " + truth + " has 6 x 6 pixels, the picture will have 4 x 6\n");
  CHECK_FALSE(fs::exists(folder.file("stats")));
}

TEST_CASE("a file that does not fit leaves the old one, with every writer", "[renderer][files]") {
  const temporary_folder folder;
  const render::image picture = noise(48);
  const render::plot drawn{"t", "x", "y", {{"a", {{1.0, 0.1}, {2.0, 0.05}}}}};
  render::render_report report;
  report.scene = std::string(2000, 'x');
  const std::vector<std::function<void(const std::string&)>> writers = {
      [&](const std::string& path) { render::write_exr(path, picture); },
      [&](const std::string& path) { render::write_png(path, picture); },
      [&](const std::string& path) { render::write_svg(path, drawn); },
      [&](const std::string& path) { render::write_stats(path, report, std::nullopt); },
      [&](const std::string& path) { render::write_file(path, std::string(100000, 'x')); }};
  for (const auto& write : writers) {
    const std::string path = folder.write("file", "old");
    std::string said;
    {
      const wfpg_test::file_size_limit full(1000);
      try {
        write(path);
      } catch (const std::runtime_error& error) {
        said = error.what();
      }
    }
    CHECK(said == "wfpg: " + path + " cannot be written: the disk may be full");
    CHECK(content_of(path) == "old");
    CHECK(files_in(folder) == 1);
    write(path);
    CHECK(content_of(path).size() > 1000);
  }
}

TEST_CASE("on a full disk old files stay, and each failed output is named", "[renderer][files]") {
  const temporary_folder folder;
  const std::string output = folder.write("a.exr", "old"), png = folder.write("a.png", "old"),
                    state = folder.write("state", "old"), stats = folder.file("stats");
  outcome failed;
  {
    const wfpg_test::file_size_limit full(2000);
    failed = run_render({"cornell-box", "--method", "pt", "--spp", "1", "--size", "48x48", "-o", output,
                         "--png", png, "--save-state", state, "--stats", stats});
  }
  CHECK(failed.code == 2);
  CHECK(std::count(failed.log.begin(), failed.log.end(), '\n') == 3);
  for (const std::string& path : {output, png, state}) {
    CHECK(contains(failed.log, "wfpg-render: " + path + " cannot be written: the disk may be full\n"));
    CHECK(content_of(path) == "old");
  }
  CHECK(contains(content_of(stats), "\"spp\": 1"));  // files that fit are written
  CHECK(files_in(folder) == 4);
}

TEST_CASE("folders of outputs are created, or the error names their fault", "[renderer][files]") {
  const temporary_folder folder;
  const auto said = [](const std::string& path) -> std::string {
    try {
      render::prepare_folder("--output", path);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  CHECK(said(folder.file("a/b")) == "");
  CHECK(said(folder.file("a/b")) == "");
  CHECK(fs::is_empty(folder.file("a/b")));
  const std::string file = folder.write("file", "x");
  for (const std::string& path : {file, file + "/a"}) {
    INFO(said(path));
    CHECK(contains(said(path), "--output: " + path + " is no folder to write to: "));
  }
  fs::permissions(folder.file("a"), fs::perms::owner_read | fs::perms::owner_exec | fs::perms::others_exec);
  {
    const ordinary_user user;
    CHECK(contains(said(folder.file("a")), "Permission denied"));
    CHECK(contains(said(folder.file("a/c")), "Permission denied"));
  }
  fs::permissions(folder.file("a"), fs::perms::owner_all);
}
