// wfpg-kernels: renders with a host that has kernels, queues and a spectrum of its own. Exit code 0, or 2
// with a message on failure.
#include "program.hpp"

#include <iostream>

int main(int argc, char** argv) {
  return kernels::run_program(argc, argv, std::cout, std::cerr);
}
