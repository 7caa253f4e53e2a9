// wfpg-render's command lines in tests.
#pragma once

#include "render_program.hpp"

#include <sstream>
#include <string>
#include <vector>

namespace render_test {

struct outcome {
  int code = 0;
  std::string out, log;
};

/// Runs wfpg-render with a command line's words.
inline outcome run_render(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "wfpg-render");
  std::vector<const char*> argv;
  for (const std::string& argument : arguments) argv.push_back(argument.c_str());
  std::ostringstream out, log;
  const int code = render::run_program(static_cast<int>(argv.size()), argv.data(), out, log);
  return {code, out.str(), log.str()};
}

}  // namespace render_test
