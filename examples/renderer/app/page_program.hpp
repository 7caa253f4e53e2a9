// wfpg-page as a function, for the program and its tests.
#pragma once

#include <iosfwd>

namespace render {

/// Reads the command line, compares pictures in a page, and prints the page's name on `out`. Errors of one
/// line go to `log`. Returns 0, or 2 on failure.
int run_page_program(int argc, const char* const* argv, std::ostream& out, std::ostream& log);

}  // namespace render
