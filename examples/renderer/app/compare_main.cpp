// wfpg-compare: prints the error of a picture against a reference. Exit code 0, or 2 with a message on
// failure.
#include "app/image_io.hpp"
#include "app/metrics.hpp"
#include "app/render_arguments.hpp"
#include "app/stats_json.hpp"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <cstdio>
#include <exception>
#include <iostream>
#include <string>

namespace {

constexpr int failure = 2;

void print_table(const render::image_error& error) {
  std::printf("mse             %.6e\n", error.mse);
  std::printf("relmse          %.6e\n", error.relmse);
  std::printf("relmse trimmed  %.6e   (worst 0.1%% of the pixels dropped)\n", error.relmse_trimmed);
  std::printf("relmse robust   %.6e   (worst 0.01%% dropped, which are %.1f%% of the sum)\n",
              error.relmse_robust, 100.0 * error.worst_share);
  std::printf("mse reinhard    %.6e   (after c / (1 + c))\n", error.mse_reinhard);
  std::printf("mae             %.6e\n", error.mae);
  std::printf("smape           %.6e\n", error.smape);
  if (error.non_finite > 0)
    std::printf("pixels with NaN or infinity: %zu, each counted as infinitely wrong\n", error.non_finite);
}

}  // namespace

int main(int argc, char** argv) {
  std::string test, reference;
  bool json = false;
  CLI::App app{"Prints the error of a picture against a reference of the same size."};
  render::report_in_one_line(app, "wfpg-compare");
  app.add_option("A", test, "the picture to judge, OpenEXR")->required();
  app.add_option("REF", reference, "the reference, OpenEXR")->required();
  app.add_flag("--json", json, "print one JSON object; an infinite error is null");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : failure;
  }
  try {
    const render::image_error error = render::compare(render::read_exr(test), render::read_exr(reference));
    if (json)
      std::cout << render::to_json(error).dump(2) << '\n';
    else
      print_table(error);
  } catch (const std::exception& error) {
    std::cerr << "wfpg-compare: " << error.what() << '\n';
    return failure;
  }
  return 0;
}
