#include "app/gpu_ranks.hpp"

#include <wfpg/ranks/single.hpp>

#include <algorithm>
#include <cstring>
#include <utility>

namespace render {
namespace {

using gpu_name = std::pair<std::uint64_t, std::uint64_t>;

/// Whether the current GPU is this rank's alone.
bool has_own_gpu(wfpg::communicator& ranks) {
  int device = 0;
  cudaDeviceProp properties = {};
  wfpg::check_cuda(cudaGetDevice(&device), "cudaGetDevice");
  wfpg::check_cuda(cudaGetDeviceProperties(&properties, device), "cudaGetDeviceProperties");
  std::vector<std::uint64_t> words(2 * std::size_t(ranks.size()), 0);
  std::uint64_t* const own = &words[2 * std::size_t(ranks.rank())];
  static_assert(sizeof(properties.uuid) == 2 * sizeof(*own), "a GPU's name is two words");
  std::memcpy(own, &properties.uuid, sizeof(properties.uuid));
  ranks.all_reduce_sum(wfpg::array_view<std::uint64_t>(words.data(), words.size()));
  std::vector<gpu_name> names;
  for (std::size_t i = 0; i < words.size(); i += 2) names.emplace_back(words[i], words[i + 1]);
  std::sort(names.begin(), names.end());
  return std::adjacent_find(names.begin(), names.end()) == names.end();
}

std::unique_ptr<wfpg::communicator> join(const wfpg::exec::cuda& exec, wfpg::communicator& ranks,
                                         double seconds) {
  if (ranks.size() == 1) return std::make_unique<wfpg::single_rank>();
  std::unique_ptr<wfpg::communicator> joined;
  if (has_own_gpu(ranks)) joined = join_by_nccl(exec, ranks, seconds);
  if (!joined) joined = std::make_unique<staged_communicator>(exec, ranks);
  return joined;
}

}  // namespace

gpu_options::gpu_options(const wfpg::exec::cuda& exec, const render_options& options) : options_(options) {
  if (!options.ranks) return;
  ranks_ = join(exec, *options.ranks, options.rank_seconds);
  options_.policy_ranks = ranks_.get();
}

}  // namespace render
