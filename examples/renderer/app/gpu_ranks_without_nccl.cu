#include "app/gpu_ranks.hpp"

namespace render {

std::unique_ptr<wfpg::communicator> join_by_nccl(const wfpg::exec::cuda&, wfpg::communicator&, double) {
  return nullptr;
}

}  // namespace render
