// Checks that must hold for every input of a fuzzer.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace wfpg_fuzz {

/// Ends the program with a message unless `holds`.
inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "%s\n", what);
  std::abort();
}

}  // namespace wfpg_fuzz
