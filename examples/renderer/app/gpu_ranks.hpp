// Ranks whose arrays lie in a GPU's memory. Where each rank has a GPU of its own, they sum there by NCCL.
// Without NCCL, or where ranks share a GPU, sums pass through the host's memory.
#pragma once

#include "app/render.hpp"

#include <wfpg/exec/cuda.hpp>
#include <wfpg/ranks/communicator.hpp>

#include <memory>

namespace render {

/// Returns the ranks joined by NCCL, or null where this build has no NCCL. `ranks`: of the host's memory.
/// They are waited for up to `seconds`. Throws wfpg::rank_error where one does not come.
std::unique_ptr<wfpg::communicator> join_by_nccl(const wfpg::exec::cuda& exec, wfpg::communicator& ranks,
                                                 double seconds);

/// Options whose ranks take arrays of the current GPU's memory.
class gpu_options {
 public:
  /// Joins the ranks of the options, if there are any. Throws wfpg::rank_error where one does not come.
  gpu_options(const wfpg::exec::cuda& exec, const render_options& options);
  // Options refer to its ranks.
  gpu_options(const gpu_options&) = delete;
  gpu_options& operator=(const gpu_options&) = delete;

  const render_options& get() const { return options_; }

 private:
  render_options options_;
  std::unique_ptr<wfpg::communicator> ranks_;
};

}  // namespace render
