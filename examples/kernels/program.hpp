// wfpg-kernels as a function, for the program and its tests.
#pragma once

#include <iosfwd>

namespace kernels {

/// Reads the command line, renders, and writes the requested files. The error against a reference goes to
/// `out`, messages of one line each to `log`, progress to stderr. Returns 0, or 2 on failure.
int run_program(int argc, const char* const* argv, std::ostream& out, std::ostream& log);

}  // namespace kernels
