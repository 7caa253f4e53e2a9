#include "app/gpu_ranks.hpp"

#include <wfpg/ranks/nccl.hpp>

#include <cstring>

namespace render {

std::unique_ptr<wfpg::communicator> join_by_nccl(const wfpg::exec::cuda& exec, wfpg::communicator& ranks,
                                                 double seconds) {
  unsigned char bytes[sizeof(ncclUniqueId)] = {};
  ncclUniqueId id = {};
  if (ranks.rank() == 0) id = wfpg::make_nccl_id();
  std::memcpy(bytes, &id, sizeof(id));
  ranks.broadcast(wfpg::array_view<unsigned char>(bytes, sizeof(bytes)), 0);
  std::memcpy(&id, bytes, sizeof(id));
  return std::make_unique<wfpg::nccl_communicator<wfpg::exec::cuda>>(exec, ranks.rank(), ranks.size(), id,
                                                                     wfpg::nccl_options{seconds, &ranks});
}

}  // namespace render
