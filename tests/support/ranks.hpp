// Ranks as threads of a test.
#pragma once

#include <wfpg/ranks/threads.hpp>

#include <chrono>
#include <cstdint>
#include <exception>
#include <string>
#include <thread>
#include <vector>

namespace wfpg_test {

/// Runs f(communicator) in n threads, and returns what each of them threw: "" for nothing. Arrays lie in the
/// memory of Exec.
template <class Exec, class F>
std::vector<std::string> run_ranks(std::uint32_t n, std::chrono::milliseconds limit, const F& f) {
  wfpg::thread_ranks ranks(n, limit);
  std::vector<std::string> errors(n);
  std::vector<std::thread> threads;
  for (std::uint32_t r = 0; r < n; ++r)
    threads.emplace_back([&, r] {
      try {
        wfpg::thread_communicator<Exec> here(Exec(), ranks, r);
        f(static_cast<wfpg::communicator&>(here));
      } catch (const std::exception& error) {
        errors[r] = error.what();
      }
    });
  for (std::thread& thread : threads) thread.join();
  return errors;
}

}  // namespace wfpg_test
