// wfpg-render: renders a scene with or without guiding. SIGINT and SIGTERM end it after the sample in flight,
// with its picture and state. Exit code 0, 2 with a message on failure, or 3 after an interruption.
#include "app/render_program.hpp"

#include <iostream>

int main(int argc, char** argv) {
  return render::run_program(argc, argv, std::cout, std::cerr);
}
