// What is measured, from the command line: scenes x methods x budgets x seeds.
#pragma once

#include "app/render.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace quality {

/// A way to sample, given by wfpg-render's options.
struct method {
  std::string name;       ///< letters, digits, and -_.+
  std::string arguments;  ///< such as "--method wfpg --slot-resolution 16"
};

/// What one rendering may use. One of the two is positive.
struct budget {
  int spp = 0;
  double seconds = 0.0;
};

/// A scene, and the options that all its renderings share.
struct scene_choice {
  std::string title;   ///< as given, such as "ajar --nee off"; a file's name has no folders
  std::string source;  ///< a built-in scene's name, or a path
  std::string environment;
  render::render_options options;  ///< with size, depth, next-event estimation and device
};

/// In pixels, from the picture's upper left corner.
struct window {
  int left = 0, top = 0, width = 0, height = 0;
};

struct settings {
  std::string preset;
  std::vector<scene_choice> scenes;
  std::vector<method> methods;
  std::vector<budget> budgets;
  int seeds = 0;            ///< positive; 1, 2, ... are measured
  int reference_spp = 0;    ///< of both halves together, at least 2
  int reference_chunk = 0;  ///< samples after which a reference is saved
  int per_sample = 0;       ///< samples whose variance is measured one by one, 0 or at least 2
  float exposure = 0.0f;    ///< of pictures; 0: from the visible part of the reference
  std::optional<window> crop;
  std::filesystem::path output, cache;
  std::string command;
};

/// "64 samples", "2.5 s".
std::string title_of(const budget& given);

/// For file names: `text` with single hyphens in place of all but letters, digits and dots.
std::string file_name_of(const std::string& text);

/// Parses a program's arguments, without its name. If help is asked for, prints it to `out` and returns
/// nothing. Throws CLI::ParseError or std::invalid_argument for invalid arguments.
std::optional<settings> parse_settings(const std::vector<std::string>& arguments, std::ostream& out);

/// A scene's options, overridden by a method's. Throws as parse_settings().
render::render_options options_of(const scene_choice& scene, const method& sampled);

}  // namespace quality
