// wfpg-quality: measures methods' errors against references. Exit code 0, or 2 with a message on failure.
#include "program.hpp"

#include <iostream>

int main(int argc, char** argv) {
  return quality::run_program({argv + 1, argv + argc}, std::cout, std::cerr);
}
