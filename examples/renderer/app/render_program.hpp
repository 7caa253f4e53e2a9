// wfpg-render as a function, for the program and its tests.
#pragma once

#include <iosfwd>

namespace render {

/// Reads the command line, renders, and writes the requested files. The error against a reference goes to
/// `out`, warnings and errors of one line each to `log`, progress to stderr. Handles SIGINT and SIGTERM from
/// then on. Returns 0, 2 on failure, or 3 if a signal ended it.
int run_program(int argc, const char* const* argv, std::ostream& out, std::ostream& log);

}  // namespace render
