// Ranks as GPUs of one process, a thread each, joined by NCCL. With one GPU there is one rank.
#include "cuda/shared_walls.hpp"
#include "support/catch.hpp"
#include "support/ranks.hpp"

#include <wfpg/exec/cuda.hpp>
#include <wfpg/exec/seq.hpp>
#include <wfpg/ranks/nccl.hpp>
#include <wfpg/ranks/single.hpp>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

namespace {

using wfpg::buffer;
using exec = wfpg::exec::cuda;
using nccl_communicator = wfpg::nccl_communicator<exec>;

std::uint64_t value_of(std::uint32_t rank, std::size_t i) {
  return 0x9e3779b97f4a7c15ull * (i + 1) * (rank + 1);
}

template <class T>
std::vector<T> values_of(std::uint32_t rank, std::size_t count) {
  std::vector<T> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<T>(value_of(rank, i));
  return values;
}

/// Whether there are several GPUs. Where there are not, says that the test is skipped.
bool has_several_devices() {
  int count = 0;
  wfpg::check_cuda(cudaGetDeviceCount(&count), "cudaGetDeviceCount");
  if (count < 2) WARN("skipped: it needs two GPUs");
  return count >= 2;
}

// Calls f(communicator, policy) of every GPU, a thread each, and returns what each throws.
template <class F>
std::vector<std::string> on_all_devices(const wfpg::nccl_options& options, const F& f) {
  int count = 0;
  wfpg::check_cuda(cudaGetDeviceCount(&count), "cudaGetDeviceCount");
  std::vector<wfpg::nccl_device<exec>> devices;
  for (int device = 0; device < count; ++device) {
    wfpg::check_cuda(cudaSetDevice(device), "cudaSetDevice");
    devices.push_back({device, exec()});
  }
  wfpg::check_cuda(cudaSetDevice(0), "cudaSetDevice");
  auto ranks = nccl_communicator::join_devices(devices, options);
  std::vector<std::string> errors(devices.size());
  std::vector<std::thread> threads;
  for (std::size_t rank = 0; rank < devices.size(); ++rank)
    threads.emplace_back([&, rank] {
      cudaSetDevice(devices[rank].device);
      try {
        f(*ranks[rank], devices[rank].exec);
        ranks[rank].reset();
      } catch (const std::exception& error) {
        errors[rank] = error.what();
      }
    });
  for (std::thread& thread : threads) thread.join();
  return errors;
}

template <class T>
bool sums_are_right(nccl_communicator& ranks, const exec& policy, std::size_t count) {
  const buffer<T, exec> values(policy, values_of<T>(ranks.rank(), count));
  ranks.all_reduce_sum(values.view());
  std::vector<T> sums(count, 0);
  for (std::uint32_t rank = 0; rank < ranks.size(); ++rank)
    for (std::size_t i = 0; i < count; ++i) sums[i] = static_cast<T>(sums[i] + value_of(rank, i));
  return values.to_host(policy) == sums;
}

bool maxima_are_right(nccl_communicator& ranks, const exec& policy, std::size_t count) {
  const buffer<std::uint32_t, exec> values(policy, values_of<std::uint32_t>(ranks.rank(), count));
  ranks.all_reduce_max(values.view());
  std::vector<std::uint32_t> most(count, 0);
  for (std::uint32_t rank = 0; rank < ranks.size(); ++rank)
    for (std::size_t i = 0; i < count; ++i)
      most[i] = std::max(most[i], static_cast<std::uint32_t>(value_of(rank, i)));
  return values.to_host(policy) == most;
}

// Arrays of all kinds in one call.
bool several_are_right(nccl_communicator& ranks, const exec& policy, std::size_t count) {
  const std::uint32_t all = ranks.size() * (ranks.size() - 1) / 2, last = ranks.size() - 1;
  const buffer<std::uint32_t, exec> sum32(policy, std::vector<std::uint32_t>(count, ranks.rank())),
      max32(policy, std::vector<std::uint32_t>(1, ranks.rank()));
  const buffer<std::uint64_t, exec> sum64(policy, std::vector<std::uint64_t>(count, ranks.rank())),
      max64(policy, std::vector<std::uint64_t>(1, ranks.rank()));
  const wfpg::reduction arrays[] = {wfpg::reduction::sum(sum32.view()), wfpg::reduction::max(max32.view()),
                                    wfpg::reduction::sum(sum64.view()), wfpg::reduction::max(max64.view())};
  ranks.all_reduce({arrays, 4});
  return sum32.to_host(policy) == std::vector<std::uint32_t>(count, all) &&
         sum64.to_host(policy) == std::vector<std::uint64_t>(count, all) &&
         max32.to_host(policy)[0] == last && max64.to_host(policy)[0] == last;
}

bool bytes_are_right(nccl_communicator& ranks, const exec& policy, std::size_t count) {
  const std::uint32_t root = ranks.size() - 1;
  const buffer<unsigned char, exec> bytes(policy, values_of<unsigned char>(ranks.rank(), count));
  ranks.broadcast(bytes.view(), root);
  return bytes.to_host(policy) == values_of<unsigned char>(root, count);
}

}  // namespace

TEST_CASE("NCCL: sums, maxima and broadcasts are those of all GPUs", "[ranks][nccl]") {
  const std::vector<std::string> errors =
      on_all_devices({}, [](nccl_communicator& ranks, const exec& policy) {
        for (std::size_t count : {std::size_t(0), std::size_t(1), std::size_t(1000), std::size_t(3000000)}) {
          if (!sums_are_right<std::uint32_t>(ranks, policy, count)) throw std::runtime_error("32-bit sums");
          if (!sums_are_right<std::uint64_t>(ranks, policy, count)) throw std::runtime_error("64-bit sums");
          if (!maxima_are_right(ranks, policy, count)) throw std::runtime_error("maxima");
          if (!bytes_are_right(ranks, policy, count)) throw std::runtime_error("bytes");
          if (!several_are_right(ranks, policy, count)) throw std::runtime_error("several arrays");
        }
      });
  for (const std::string& error : errors) CHECK(error.empty());
}

TEST_CASE("NCCL: ranks of the host find a GPU that disagrees, or ends", "[ranks][nccl]") {
  if (!has_several_devices()) return;
  const std::string last_one = GENERATE("agrees", "disagrees", "ends");
  constexpr std::uint32_t size = 2;
  const ncclUniqueId id = wfpg::make_nccl_id();
  const auto errors =
      wfpg_test::run_ranks<wfpg::exec::seq>(size, std::chrono::seconds(10), [&](wfpg::communicator& host) {
        wfpg::check_cuda(cudaSetDevice(static_cast<int>(host.rank())), "cudaSetDevice");
        const exec policy;
        nccl_communicator ranks(policy, host.rank(), size, id, {10.0, &host});
        if (!several_are_right(ranks, policy, 1000)) throw std::runtime_error("several arrays");
        const bool is_last = host.rank() + 1 == size;
        if (is_last && last_one == "ends") throw std::runtime_error("the last one ends");
        if (!sums_are_right<std::uint32_t>(ranks, policy, is_last && last_one == "disagrees" ? 6 : 5))
          throw std::runtime_error("32-bit sums");
      });
  if (last_one == "agrees") CHECK(errors == std::vector<std::string>(size));
  if (last_one == "disagrees") CHECK_THAT(errors[0], WFPG_TEST_CONTAINS("with 5 values, ranks have 5 to 6"));
  if (last_one == "ends") CHECK_THAT(errors[0], WFPG_TEST_CONTAINS("rank 1 has ended"));
}

TEST_CASE("NCCL: a late GPU, or one that disagrees, is an error on the others", "[ranks][nccl]") {
  if (!has_several_devices()) return;
  const bool is_late = GENERATE(false, true);
  const std::vector<std::string> errors =
      on_all_devices({1.0}, [&](nccl_communicator& ranks, const exec& policy) {
        const bool is_last = ranks.rank() + 1 == ranks.size();
        if (is_last && is_late) return std::this_thread::sleep_for(std::chrono::seconds(3));
        sums_are_right<std::uint32_t>(ranks, policy, is_last ? 6 : 5);
      });
  CHECK_THAT(errors[0], WFPG_TEST_CONTAINS(is_late ? "rank 0 waited 1 s in all_reduce_sum"
                                                   : "with 5 values, ranks have 5 to 6"));
}

TEST_CASE("NCCL: GPUs learn the guide of one", "[ranks][nccl]") {
  if (!has_several_devices()) return;
  constexpr std::uint32_t rays = 3000;
  const exec policy;
  wfpg::single_rank alone;
  const std::string expected = wfpg_test::learnt_by_ranks(policy, alone, rays);
  CHECK(expected.size() > 1000);
  const std::vector<std::string> errors = on_all_devices({}, [&](nccl_communicator& ranks, const exec& own) {
    if (wfpg_test::learnt_by_ranks(own, ranks, rays) != expected) throw std::runtime_error("other bytes");
  });
  for (const std::string& error : errors) CHECK(error.empty());
}

TEST_CASE("NCCL: one thread may destroy all communicators of a process", "[ranks][nccl]") {
  if (!has_several_devices()) return;
  cudaSetDevice(0);
  const exec first;
  cudaSetDevice(1);
  const exec second;
  const auto begin = std::chrono::steady_clock::now();
  nccl_communicator::join_devices({{0, first}, {1, second}}).clear();
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(20));
  int current = 0;
  cudaGetDevice(&current);
  CHECK(current == 1);
  // A GPU that there is not is found before any rank joins.
  CHECK_THROWS_AS(nccl_communicator::join_devices({{0, first}, {1000, second}}), wfpg::device_error);
  CHECK(nccl_communicator::join_devices({{0, first}, {1, second}}).size() == 2);
  cudaSetDevice(0);
}
