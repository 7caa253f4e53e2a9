// wfpg-quality without its main: what it does, for tests too.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace quality {

/// Runs the program with its arguments, its name not among them. Help goes to `out`, progress, warnings and
/// errors to `log`. Returns 0, or 2 after a message.
int run_program(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& log);

}  // namespace quality
