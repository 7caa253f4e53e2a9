// Programs' command lines in tests.
#pragma once

#include "app/render_program.hpp"

#include <sstream>
#include <string>
#include <vector>

namespace render_test {

struct outcome {
  int code = 0;
  std::string out, log;
};

/// Runs a program's run_program() with the words of a command line.
template <class Program>
outcome run_command(const Program& program, const char* name, const std::vector<std::string>& arguments) {
  std::vector<const char*> argv{name};
  for (const std::string& argument : arguments) argv.push_back(argument.c_str());
  std::ostringstream out, log;
  const int code = program(static_cast<int>(argv.size()), argv.data(), out, log);
  return {code, out.str(), log.str()};
}

/// Runs wfpg-render.
inline outcome run_render(const std::vector<std::string>& arguments) {
  return run_command(render::run_program, "wfpg-render", arguments);
}

}  // namespace render_test
