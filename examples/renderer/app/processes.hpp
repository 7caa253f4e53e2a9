// The processes that mpirun has started to render one picture.
#pragma once

#include <wfpg/ranks/communicator.hpp>

#include <memory>

namespace render {

/// Number of processes that mpirun or the like has started, as the environment says; 1 where it says nothing.
int started_processes();

class processes {
 public:
  /// Starts MPI. To be made once a process. Throws std::runtime_error where this was built without MPI.
  processes();
  processes(const processes&) = delete;
  processes& operator=(const processes&) = delete;
  /// Waits for all of them.
  ~processes();

  /// Joins all processes, and returns their ranks, of the host's memory. One process alone is one rank.
  /// Throws wfpg::rank_error where a process does not come within `seconds`; abort() then ends the others.
  wfpg::communicator& join(double seconds);
  /// Ends all processes at once, since others may wait for this one.
  [[noreturn]] void abort(int code);

 private:
  std::unique_ptr<wfpg::communicator> ranks_;
};

}  // namespace render
