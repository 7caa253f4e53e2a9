// Replaces processes_mpi.cpp in builds without MPI.
#include "app/processes.hpp"

#include <cstdlib>
#include <stdexcept>

namespace render {

processes::processes() {
  throw std::runtime_error(
      "--split: this program was built without MPI; install one, such as libopenmpi-dev and openmpi-bin, "
      "configure with -DWFPG_MPI=ON and build again");
}

processes::~processes() = default;

wfpg::communicator& processes::join(double) {
  return *ranks_;
}

void processes::abort(int code) {
  std::_Exit(code);
}

}  // namespace render
