// Sums a value over the processes of an MPI job: one, where mpirun has not started it.
#include <wfpg/exec/seq.hpp>
#include <wfpg/ranks/mpi.hpp>

#include <cstdio>

int main() {
  MPI_Init(nullptr, nullptr);
  std::uint32_t value = 1;
  {
    wfpg::mpi_communicator<wfpg::exec::seq> ranks(wfpg::exec::seq(), MPI_COMM_WORLD);
    ranks.all_reduce_sum(wfpg::array_view<std::uint32_t>(&value, 1));
    std::printf("%u of %u ranks\n", value, ranks.size());
    value -= ranks.size();
  }
  MPI_Finalize();
  return value == 0 ? 0 : 1;
}
