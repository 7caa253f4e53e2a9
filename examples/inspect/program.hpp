// wfpg-inspect as a function, for the program and its tests.
#pragma once

#include <iosfwd>

namespace inspect {

/// Reads the command line, inspects, and prints the page's name on `out`. Progress, warnings and errors go to
/// `log`. Returns 0, or 2 on failure.
int run_program(int argc, const char* const* argv, std::ostream& out, std::ostream& log);

}  // namespace inspect
