// wfpg-render as a function, for the program and its tests.
#pragma once

#include <iosfwd>

namespace render {

/// Reads the command line, renders, and writes what was asked for. The error against a reference goes to
/// `out`; warnings, and errors of one line each, to `log`; progress to stderr. 0; 2 on failure; 3 where
/// SIGINT or SIGTERM, which it handles from then on, ended it.
int run_program(int argc, const char* const* argv, std::ostream& out, std::ostream& log);

}  // namespace render
