// Tables in GitHub's Markdown.
#include "markdown.hpp"

#include "summary.hpp"

#include <cstdio>

namespace quality {
namespace {

std::string formatted(const char* format, double value) {
  char text[48];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

/// "1.2e-03 ± 4e-05", with a mark if the reference's noise is large.
std::string error_cell(const json& error) {
  if (error["mean"].is_null()) return "hidden \\*";
  std::string cell = formatted("%.3g", error["mean"]);
  if (!error["deviation"].is_null()) cell += " ± " + formatted("%.1g", error["deviation"]);
  return error["noise_is_large"].get<bool>() ? cell + " \\*" : cell;
}

std::string ratio_cell(const json& error) {
  if (error["ratio"].is_null()) return "";
  std::string cell = formatted("%.2f", error["ratio"]);
  if (!error["ratio_standard_error"].is_null())
    cell += " ± " + formatted("%.2f", error["ratio_standard_error"]);
  return cell;
}

std::string equal_time_cell(const json& error) {
  return error.contains("equal_time_ratio") ? formatted("%.2f", error["equal_time_ratio"]) : "";
}

using row = std::vector<std::string>;

std::string line_of(const row& cells) {
  std::string line = "|";
  for (const std::string& cell : cells) line += " " + cell + " |";
  return line + "\n";
}

row header(bool has_flip) {
  row cells{"method", "samples", "seconds"};
  for (const measure& m : measures) {
    cells.insert(cells.end(), {m.title, "gain"});
    if (m.is_squared) cells.emplace_back("equal time");
    if (m.name == std::string("relmse_robust")) cells.emplace_back("share of the worst 0.01%");
  }
  if (has_flip) cells.insert(cells.end(), {"HDR-FLIP", "gain"});
  cells.insert(cells.end(), {"million segments", "MiB kept", "of them in use", "MiB in flight",
                             "cones a segment", "light hits a path"});
  return cells;
}

row cells_of(const json& method) {
  constexpr double mebibyte = 1024.0 * 1024.0;
  row cells{method["method"], formatted("%.4g", method["samples"]["mean"]),
            formatted("%.3g", method["seconds"]["mean"])};
  const json& errors = method["errors"];
  for (const measure& m : measures) {
    const json& error = errors[m.name];
    cells.insert(cells.end(), {error_cell(error), ratio_cell(error)});
    if (m.is_squared) cells.push_back(equal_time_cell(error));
    if (m.name == std::string("relmse_robust"))
      cells.push_back(formatted("%.1f%%", 100.0 * double(method["worst_share"])));
  }
  if (errors.contains("flip"))
    cells.insert(cells.end(), {error_cell(errors["flip"]), ratio_cell(errors["flip"])});
  cells.push_back(formatted("%.3g", 1e-6 * double(method["segments"])));
  cells.push_back(formatted("%.2f", double(method["persistent_bytes"]) / mebibyte));
  cells.push_back(formatted("%.2f", double(method["used_bytes"]) / mebibyte));
  cells.push_back(formatted("%.2f", double(method["transient_bytes"]) / mebibyte));
  cells.push_back(formatted("%.2f", method["cones_per_segment"]));
  cells.push_back(formatted("%.3g", method["light_hits_per_path"]));
  return cells;
}

std::string table_of(const json& budget) {
  const row head = header(budget["methods"][0]["errors"].contains("flip"));
  std::string table = line_of(head) + line_of(row(head.size(), "---"));
  for (const json& method : budget["methods"]) table += line_of(cells_of(method));
  return table;
}

/// Whether means agree, if there are enough seeds.
std::string agreement_of(const json& budget) {
  std::string text;
  for (const json& method : budget["methods"]) {
    if (!method.contains("tiles")) continue;
    const json& tiles = method["tiles"];
    text += line_of({method["method"], std::to_string(tiles["count"].get<std::size_t>()),
                     std::to_string(tiles["beyond_4"].get<std::size_t>()), formatted("%.2f", tiles["worst"]),
                     formatted("%.3f", tiles["mean_square"])});
  }
  if (text.empty()) return "";
  const row head{"mean of", "tiles", "\\|z\\| of 4 or more", "farthest z", "mean of z²"};
  return "\n" + line_of(head) + line_of(row(head.size(), "---")) + text;
}

std::string picture(const std::string& text, const std::string& file) {
  return "![" + text + "](" + file + ")\n";
}

std::string non_finite_warning(const json& budget) {
  std::string text;
  for (const json& method : budget["methods"])
    if (method["non_finite_pixels"].get<double>() > 0.0)
      text += "\n" + method["method"].get<std::string>() + " has pixels that are NaN or infinite, " +
              formatted("%.3g", method["non_finite_pixels"]) + " a picture: its error is infinite.\n";
  return text;
}

/// Errors after all samples, by combination of samples. They include the reference's noise.
std::string combinations_of(const json& single) {
  std::string table;
  for (const auto& [method, samples] : single.items())
    for (const auto& [combination, series] : samples["combined"].items()) {
      row cells{method, combination};
      for (const measure& m : measures) cells.push_back(formatted("%.3g", series[m.name].back()));
      table += line_of(cells);
    }
  if (table.empty()) return "";
  row head{"method", "combination"};
  for (const measure& m : measures) head.emplace_back(m.title);
  return "All samples combined; errors contain the reference's noise.\n\n" + line_of(head) +
         line_of(row(head.size(), "---")) + table + "\n";
}

std::string describe(const json& scene) {
  const json& reference = scene["reference"];
  std::string text =
      std::to_string(scene["width"].get<int>()) + " x " + std::to_string(scene["height"].get<int>()) +
      " pixels, depth " + std::to_string(scene["max_depth"].get<int>()) + ", roulette from vertex " +
      std::to_string(scene["roulette_depth"].get<int>()) + ", next-event estimation " +
      (scene["nee"].get<bool>() ? "on" : "off") +
      ". Reference: " + std::to_string(reference["samples"].get<int>()) + " samples; its own noise: ";
  for (const measure& m : measures)
    text += (&m == measures.data() ? "" : ", ") + std::string(m.title) + " " +
            formatted("%.2g", reference["noise"][m.name]);
  if (!reference["flip_noise"].is_null()) text += ", HDR-FLIP " + formatted("%.2g", reference["flip_noise"]);
  text += ".";
  if (reference["noise"]["non_finite"].get<std::size_t>() > 0)
    text += " The reference has pixels that are NaN or infinite: all errors are infinite.";
  return text;
}

std::string section_of(const json& scene, const std::string& methods) {
  const std::string title = scene["scene"];
  std::string text = "## " + title + "\n\n" + describe(scene) + "\n\n";
  const json& files = scene["files"];
  text += picture(title + ", reference and crop", files["reference"]) + "\n";
  for (std::size_t b = 0; b < scene["summary"].size(); ++b) {
    const json& budget = scene["summary"][b];
    const std::string name = budget["budget"];
    text += "### " + title + ", " + name + "\n\n" + table_of(budget) + non_finite_warning(budget) +
            agreement_of(budget);
    text += "\nFrom the left: " + methods + ", reference.\n\n" +
            picture("crops", files["pictures"][b]["crops"]) + "\n";
    text += "Squared error after c / (1 + c), from the left: " + methods + ".\n\n" +
            picture("error maps", files["pictures"][b]["errors"]) + "\n";
  }
  text += combinations_of(scene["single_samples"]);
  for (const char* const kind : {"plots", "single_samples"})
    for (const json& row : files[kind]) {
      for (const json& file : row) text += picture(file, file);
      text += "\n";
    }
  return text;
}

std::string introduction(const json& results) {
  std::string text = "# Errors against references\n\n    " + results["command"].get<std::string>() +
                     "\n\nwfpg " + results["version"].get<std::string>() + ", " +
                     results["machine"]["processor"].get<std::string>() + ", " +
                     std::to_string(results["machine"]["threads"].get<unsigned>()) + " threads.";
  if (results["machine"].contains("gpu_and_driver"))
    text += " " + results["machine"]["gpu_and_driver"].get<std::string>() + ".";
  text +=
      "\n\nErrors are means over " + std::to_string(results["seeds"].get<int>()) +
      " seeds, squared ones less the reference's noise. After ± is the standard deviation of one picture's "
      "error, of "
      "gains the standard error. A gain is the error of " +
      results["baseline"].get<std::string>() +
      " over the method's; at equal time, multiplied by the ratio of their seconds, as variance falls with "
      "samples. \\* marks an error of which the reference's noise is more than a tenth; one that it exceeds "
      "is "
      "hidden. Seconds are of samples, without building. With 20 seeds or more, z is how many standard "
      "errors "
      "means are from the baseline's in tiles of 4 x 4 pixels.\n\n";
  for (const json& method : results["methods"])
    text += "- " + method["name"].get<std::string>() + ": `" + method["arguments"].get<std::string>() + "`\n";
  return text + "\n";
}

}  // namespace

std::string markdown_of(const json& results) {
  std::string methods;
  for (const json& method : results["methods"])
    methods += (methods.empty() ? "" : ", ") + method["name"].get<std::string>();
  std::string text = introduction(results);
  for (const json& scene : results["scenes"]) text += section_of(scene, methods);
  return text;
}

}  // namespace quality
