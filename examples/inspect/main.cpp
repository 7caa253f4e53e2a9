// wfpg-inspect: shows why a pixel is noisy. Exit code 0, or 2 with a message on failure.
#include "program.hpp"

#include <iostream>

int main(int argc, char** argv) {
  return inspect::run_program(argc, argv, std::cout, std::cerr);
}
