// Counts what the ranks of a program reduce by MPI, and what it costs: a library for LD_PRELOAD, see
// measure.py. Before each reduction ranks meet at a barrier. Its seconds are those of waiting; the
// reduction's are its own.
//
// Each rank writes a line a reduction to the file CALLS_OUT.RANK: sum or max and the bits of a value, bytes,
// and then seconds: CPU of the reduction, CPU of waiting, CPU of the process until here, and the monotonic
// clock.
#include <mpi.h>
#include <sched.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

namespace {

double seconds(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1.0e-9 * static_cast<double>(now.tv_nsec);
}

// The file of this rank; null where none is wanted.
std::FILE* out() {
  static std::FILE* const file = [] {
    const char* const name = std::getenv("CALLS_OUT");
    int rank = 0;
    PMPI_Comm_rank(MPI_COMM_WORLD, &rank);
    return name ? std::fopen((std::string(name) + '.' + std::to_string(rank)).c_str(), "w") : nullptr;
  }();
  return file;
}

// The reduction in flight: wfpg has one at a time.
struct {
  int bytes = 0;  // 0: none
  double cpu = 0.0, waited = 0.0;
} reduction;

}  // namespace

extern "C" {

int MPI_Iallreduce(const void* from, void* to, int count, MPI_Datatype type, MPI_Op operation, MPI_Comm ranks,
                   MPI_Request* request) {
  if (!out()) return PMPI_Iallreduce(from, to, count, type, operation, ranks, request);
  const double begin = seconds(CLOCK_THREAD_CPUTIME_ID);
  MPI_Request barrier;
  PMPI_Ibarrier(ranks, &barrier);
  for (int is_done = 0; !is_done; sched_yield()) PMPI_Test(&barrier, &is_done, MPI_STATUS_IGNORE);
  int size = 0;
  PMPI_Type_size(type, &size);
  reduction.bytes = size * count;
  std::fprintf(out(), "%s%d %d ", operation == MPI_SUM ? "sum" : "max", 8 * size, size * count);
  reduction.cpu = seconds(CLOCK_THREAD_CPUTIME_ID);
  reduction.waited = reduction.cpu - begin;
  return PMPI_Iallreduce(from, to, count, type, operation, ranks, request);
}

int MPI_Test(MPI_Request* request, int* is_done, MPI_Status* status) {
  const int code = PMPI_Test(request, is_done, status);
  if (*is_done && reduction.bytes > 0) {
    std::fprintf(out(), "%.7f %.7f %.7f %.7f\n", seconds(CLOCK_THREAD_CPUTIME_ID) - reduction.cpu,
                 reduction.waited, seconds(CLOCK_PROCESS_CPUTIME_ID), seconds(CLOCK_MONOTONIC));
    reduction.bytes = 0;
  }
  return code;
}

int MPI_Finalize() {
  if (out()) std::fclose(out());
  return PMPI_Finalize();
}

}  // extern "C"
