// Ranks as threads of one process: what their calls return, and how they fail.
#include "support/catch.hpp"
#include "support/policies.hpp"
#include "support/ranks.hpp"

#include <wfpg/exec/buffer.hpp>
#include <wfpg/ranks/single.hpp>
#include <wfpg/ranks/threads.hpp>

#include <chrono>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

namespace {

using namespace wfpg_test;

template <class T>
wfpg::array_view<T> view_of(std::vector<T>& values) {
  return {values.data(), values.size()};
}

constexpr std::chrono::milliseconds soon(100), later(30000);

}  // namespace

TEST_CASE("threads reduce sums and maxima, and broadcast", "[ranks_threads]") {
  for (const std::uint32_t n : {1u, 2u, 3u, 8u}) {
    CAPTURE(n);
    std::vector<std::uint32_t> wrong(n, 0);
    const std::vector<std::string> errors = run_ranks<host_policy>(n, later, [&](wfpg::communicator& ranks) {
      const std::uint32_t r = ranks.rank();
      for (std::uint32_t turn = 0; turn < 50; ++turn) {
        std::vector<std::uint32_t> sum32{r + turn, 0xffffffffu}, max32{r * turn, 7u};
        std::vector<std::uint64_t> sum64{std::uint64_t(r) << 40}, max64{std::uint64_t(r) << 40, 1}, none;
        std::vector<unsigned char> bytes(3, static_cast<unsigned char>(r));
        ranks.all_reduce_sum(view_of(sum32));
        ranks.all_reduce_sum(view_of(sum64));
        ranks.all_reduce_max(view_of(max32));
        ranks.all_reduce_max(view_of(max64));
        ranks.all_reduce_sum(view_of(none));
        std::vector<std::uint32_t> also_sum32{r}, also_max32{r};
        std::vector<std::uint64_t> also_sum64{r}, also_max64{r};
        const wfpg::reduction all_of[] = {
            wfpg::reduction::sum(view_of(also_sum32)), wfpg::reduction::max(view_of(also_max64)),
            wfpg::reduction::sum(view_of(also_sum64)), wfpg::reduction::max(view_of(also_max32)),
            wfpg::reduction::sum(view_of(none))};
        ranks.all_reduce({all_of, 5});
        ranks.broadcast(view_of(bytes), turn % n);
        const std::uint32_t all = n * (n - 1) / 2;
        if (sum32 != std::vector<std::uint32_t>{all + n * turn, 0u - n} ||
            sum64 != std::vector<std::uint64_t>{std::uint64_t(all) << 40} ||
            max32 != std::vector<std::uint32_t>{(n - 1) * turn, 7u} ||
            max64 != std::vector<std::uint64_t>{std::uint64_t(n - 1) << 40, 1} || also_sum32[0] != all ||
            also_sum64[0] != all || also_max32[0] != n - 1 || also_max64[0] != n - 1 ||
            bytes != std::vector<unsigned char>(3, static_cast<unsigned char>(turn % n)))
          ++wrong[r];
      }
    });
    CHECK(wrong == std::vector<std::uint32_t>(n, 0));
    CHECK(errors == std::vector<std::string>(n));
  }
}

TEST_CASE("threads reduce arrays in the policy's memory", "[ranks_threads]") {
  const one_policy exec;
  wfpg::thread_ranks ranks(2);
  std::vector<std::uint32_t> found[2];
  std::vector<std::thread> threads;
  for (std::uint32_t r = 0; r < 2; ++r)
    threads.emplace_back([&, r] {
      const one_policy here_exec;
      wfpg::thread_communicator<one_policy> here(here_exec, ranks, r);
      const wfpg::buffer<std::uint32_t, one_policy> values(here_exec, std::vector<std::uint32_t>{r + 1, 5});
      here.all_reduce_sum(values.view());
      found[r] = values.to_host(here_exec);
    });
  for (std::thread& thread : threads) thread.join();
  for (const std::vector<std::uint32_t>& values : found) CHECK(values == std::vector<std::uint32_t>{3, 10});
}

TEST_CASE("ranks that are late, end, or differ are errors of all ranks", "[ranks_threads]") {
  using wfpg::communicator;
  const auto all_say = [](const std::vector<std::string>& errors, const std::string& words) {
    for (const std::string& error : errors) {
      CAPTURE(error, words);
      CHECK(error.find(words) != std::string::npos);
    }
  };
  all_say(run_ranks<host_policy>(3, soon,
                                 [&](communicator& ranks) {
                                   std::vector<std::uint32_t> values{1};
                                   if (ranks.rank() == 1) std::this_thread::sleep_for(5 * soon);
                                   ranks.all_reduce_sum(view_of(values));
                                 }),
          "did not come within 100 ms");
  const std::vector<std::string> ended = run_ranks<host_policy>(3, later, [&](communicator& ranks) {
    std::vector<std::uint32_t> values{1};
    ranks.all_reduce_sum(view_of(values));
    if (ranks.rank() != 2) ranks.all_reduce_sum(view_of(values));
  });
  CHECK(ended[0].find("rank 2 has ended") != std::string::npos);
  CHECK(ended[1] == ended[0]);
  CHECK(ended[2].empty());
  all_say(run_ranks<host_policy>(2, later,
                                 [&](communicator& ranks) {
                                   std::vector<std::uint32_t> values(1 + ranks.rank());
                                   ranks.all_reduce_sum(view_of(values));
                                 }),
          "all ranks must have the same options");
  all_say(run_ranks<host_policy>(2, later,
                                 [&](communicator& ranks) {
                                   std::vector<std::uint32_t> values(2);
                                   if (ranks.rank() == 0)
                                     ranks.all_reduce_sum(view_of(values));
                                   else
                                     ranks.all_reduce_max(view_of(values));
                                 }),
          "maximum of 32 bits of 8 bytes");
}

TEST_CASE("ranks that are none, or are made twice, are refused", "[ranks_threads]") {
  using here = wfpg::thread_communicator<host_policy>;
  wfpg::thread_ranks ranks(2, later);
  CHECK_THROWS_AS(here(host_policy(), ranks, 2), std::invalid_argument);
  here first(host_policy(), ranks, 0), again(host_policy(), ranks, 0);
  const auto error_of = [](here& rank) {
    std::vector<std::uint32_t> values{1};
    try {
      rank.all_reduce_sum(view_of(values));
    } catch (const wfpg::rank_error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  std::string error;
  std::thread waits([&] { error = error_of(first); });
  CHECK(error_of(again).find("rank 0 has two communicators") != std::string::npos);
  waits.join();
  CHECK(error.find("rank 0 has two communicators") != std::string::npos);
}

TEST_CASE("a single rank has the values of all ranks", "[ranks_threads]") {
  wfpg::single_rank ranks;
  std::vector<std::uint32_t> values{1, 2};
  std::vector<std::uint64_t> wide{3};
  ranks.all_reduce_sum(view_of(values));
  ranks.all_reduce_max(view_of(values));
  ranks.all_reduce_sum(view_of(wide));
  ranks.all_reduce_max(view_of(wide));
  CHECK(values == std::vector<std::uint32_t>{1, 2});
  CHECK(wide == std::vector<std::uint64_t>{3});
  CHECK(ranks.rank() == 0);
  CHECK(ranks.size() == 1);
}
