// Processes joined by MPI.
#include "app/processes.hpp"

#include <wfpg/exec/seq.hpp>
#include <wfpg/ranks/mpi.hpp>

#include <cstdlib>

namespace render {

processes::processes() {
  // Policies have threads, which leave MPI alone.
  int provided = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
}

wfpg::communicator& processes::join(double seconds) {
  wfpg::mpi_options options;
  options.seconds = seconds;
  ranks_ =
      std::make_unique<wfpg::mpi_communicator<wfpg::exec::seq>>(wfpg::exec::seq(), MPI_COMM_WORLD, options);
  return *ranks_;
}

processes::~processes() {
  ranks_.reset();
  MPI_Finalize();
}

void processes::abort(int code) {
  MPI_Abort(MPI_COMM_WORLD, code);
  std::_Exit(code);
}

}  // namespace render
