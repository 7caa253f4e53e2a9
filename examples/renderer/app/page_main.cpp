// wfpg-page: writes a page that compares pictures with a slider. Exit code 0, or 2 with a message on failure.
#include "app/page_program.hpp"

#include <iostream>

int main(int argc, char** argv) {
  return render::run_page_program(argc, argv, std::cout, std::cerr);
}
