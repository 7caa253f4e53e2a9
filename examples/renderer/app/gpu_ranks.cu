#include "app/gpu_ranks.hpp"

#include <wfpg/ranks/single.hpp>

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

namespace render {
namespace {

// Ranks that copy arrays to the host's memory, sum there, and copy them back.
class staged_communicator final : public wfpg::communicator {
 public:
  /// `ranks`: of the host's memory. They outlive this.
  staged_communicator(const wfpg::exec::cuda& exec, wfpg::communicator& ranks) : exec_(exec), ranks_(ranks) {}

  std::uint32_t rank() const override { return ranks_.rank(); }
  std::uint32_t size() const override { return ranks_.size(); }
  void all_reduce_sum(wfpg::array_view<std::uint32_t> values) override {
    on_host(values, [&](auto host) { ranks_.all_reduce_sum(host); });
  }
  void all_reduce_sum(wfpg::array_view<std::uint64_t> values) override {
    on_host(values, [&](auto host) { ranks_.all_reduce_sum(host); });
  }
  void all_reduce_max(wfpg::array_view<std::uint32_t> values) override {
    on_host(values, [&](auto host) { ranks_.all_reduce_max(host); });
  }
  void all_reduce_max(wfpg::array_view<std::uint64_t> values) override {
    on_host(values, [&](auto host) { ranks_.all_reduce_max(host); });
  }
  void broadcast(wfpg::array_view<unsigned char> bytes, std::uint32_t root) override {
    on_host(bytes, [&](auto host) { ranks_.broadcast(host, root); });
  }

 private:
  template <class T, class Call>
  void on_host(wfpg::array_view<T> values, const Call& call) {
    std::vector<T> host(values.size());
    exec_.copy_to_host(host.data(), values.data(), host.size() * sizeof(T));
    call(wfpg::array_view<T>(host.data(), host.size()));
    exec_.copy_from_host(values.data(), host.data(), host.size() * sizeof(T));
  }

  wfpg::exec::cuda exec_;
  wfpg::communicator& ranks_;
};

using gpu_name = std::pair<std::uint64_t, std::uint64_t>;

/// Whether all ranks have different GPUs.
bool have_own_gpus(wfpg::communicator& ranks) {
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
  if (have_own_gpus(ranks)) joined = join_by_nccl(exec, ranks, seconds);
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
