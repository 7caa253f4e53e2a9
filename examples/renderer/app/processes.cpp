// What the environment says of other processes, with MPI or without.
#include "app/processes.hpp"

#include <algorithm>
#include <cstdlib>

namespace render {

int started_processes() {
  int most = 1;
  // Open MPI's mpirun; MPICH's and its kin's, and Slurm's where it starts MPI processes.
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"})
    if (const char* const size = std::getenv(name)) most = std::max(most, std::atoi(size));
  return most;
}

}  // namespace render
