// wfpg-quality without its main(), for tests too.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace quality {

/// Runs the program with its arguments, without its name. Help goes to `out`, progress, warnings and errors
/// to `log`. Returns 0, or 2 after a message.
int run_program(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& log);

}  // namespace quality
