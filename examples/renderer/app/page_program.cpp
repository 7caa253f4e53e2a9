// From names of pictures to a page.
#include "app/page_program.hpp"

#include "app/comparison_page.hpp"
#include "app/metrics.hpp"
#include "app/number_options.hpp"
#include "app/output_files.hpp"
#include "app/render_arguments.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <ostream>
#include <stdexcept>
#include <string>
#include <vector>

namespace render {
namespace {

constexpr int failure = 2;

struct arguments {
  std::vector<std::string> pictures;
  std::string output, title = "Pictures side by side";
};

/// A picture's file, and its name on the page.
struct source {
  std::string name, path;
};

/// NAME=FILE, or FILE, which is called as the file without its folder and ending. A file of that whole name
/// counts first.
source parsed(const std::string& text) {
  const std::size_t at = text.find('=');
  if (at == std::string::npos || std::filesystem::exists(text))
    return {std::filesystem::path(text).stem().string(), text};
  if (at == 0 || at + 1 == text.size())
    throw CLI::ValidationError("a picture is " + text + ", expected FILE or NAME=FILE");
  return {text.substr(0, at), text.substr(at + 1)};
}

/// All pictures can be opened, and the page can be written: told before any is read.
void check_files(const std::vector<source>& sources, const std::string& output) {
  std::vector<named_file> inputs;
  for (const source& s : sources) {
    inputs.push_back({"the picture " + s.name, s.path, ""});
    if (!std::filesystem::is_regular_file(s.path) || !std::ifstream(s.path))
      throw std::runtime_error(s.path + ": cannot be opened");
  }
  check_outputs({{"--output", output, ".html"}}, inputs);
}

/// The errors that wfpg-compare prints, in few words.
std::string note_on(const image& picture, const image& reference) {
  const image_error error = compare(picture, reference);
  char text[96];
  std::snprintf(text, sizeof text, "MSE after c / (1 + c): %.3g; relative MSE: %.3g", error.mse_reinhard,
                error.relmse_robust);
  return text;
}

void write_page(const arguments& given) {
  std::vector<source> sources;
  for (const std::string& text : given.pictures) sources.push_back(parsed(text));
  check_files(sources, given.output);
  comparison shown{"the page", {}};
  for (const source& s : sources) shown.pictures.push_back({s.name, read_picture(s.path)});
  require_comparable(shown);
  named_picture& reference = shown.pictures.back();
  for (named_picture& p : shown.pictures)
    p.note = &p == &reference ? "errors are measured against this" : note_on(p.picture, reference.picture);
  write_file(given.output, comparison_page(given.title, {shown}));
}

}  // namespace

int run_page_program(int argc, const char* const* argv, std::ostream& out, std::ostream& log) {
  arguments given;
  CLI::App app{"Writes a page that compares pictures with a slider. A browser opens it from disk."};
  report_in_one_line(app, "wfpg-page");
  app.add_option("PICTURES", given.pictures,
                 "OpenEXR or PNG, FILE or NAME=FILE, at least two of one size; the last is the reference")
      ->required()
      ->expected(2, 1 << 16);
  app.add_option("-o,--output", given.output, "the page, .html")->required()->transform(file_path());
  app.add_option("--title", given.title, "the page's title");
  try {
    app.parse(argc, argv);
    write_page(given);
  } catch (const CLI::ParseError& error) {
    return app.exit(error, out, log) == 0 ? 0 : failure;
  } catch (const std::exception& error) {
    log << "wfpg-page: " << reason_of(error) << '\n';
    return failure;
  }
  out << given.output << ": open it in a browser\n";
  return 0;
}

}  // namespace render
