// Ranks whose arrays lie in a GPU's memory. Where each rank has a GPU of its own, they sum there by NCCL.
// Without NCCL, or where ranks share a GPU, sums pass through the host's memory.
#pragma once

#include "app/render.hpp"

#include <wfpg/exec/cuda.hpp>
#include <wfpg/ranks/communicator.hpp>

#include <memory>
#include <vector>

namespace render {

/// Returns the ranks joined by NCCL, or null where this build has no NCCL. `ranks`: of the host's memory.
/// They are waited for up to `seconds`. Throws wfpg::rank_error where one does not come.
std::unique_ptr<wfpg::communicator> join_by_nccl(const wfpg::exec::cuda& exec, wfpg::communicator& ranks,
                                                 double seconds);

/// Ranks that copy arrays to the host's memory, sum there, and copy them back.
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
