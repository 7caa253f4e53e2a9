// The processes that mpirun has started to render one picture.
#pragma once

#include <wfpg/ranks/communicator.hpp>

#include <memory>

namespace render {

class processes {
 public:
  /// Joins them. One process alone is one rank. To be made once a process. Throws std::runtime_error where
  /// this was built without MPI, wfpg::rank_error where a process does not come within `seconds`.
  explicit processes(double seconds);
  processes(const processes&) = delete;
  processes& operator=(const processes&) = delete;
  /// Waits for all of them.
  ~processes();

  /// Of the host's memory.
  wfpg::communicator& ranks() { return *ranks_; }
  /// Ends all processes at once, since others may wait for this one.
  [[noreturn]] void abort(int code);

 private:
  std::unique_ptr<wfpg::communicator> ranks_;
};

}  // namespace render
