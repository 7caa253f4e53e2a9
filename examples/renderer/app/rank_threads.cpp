#include "app/rank_threads.hpp"

#include <wfpg/exec/seq.hpp>
#include <wfpg/ranks/threads.hpp>

#include <chrono>
#include <exception>
#include <mutex>
#include <thread>

namespace render {

render_result render_by_threads(const scene& scene, const std::vector<render_options>& options,
                                const progress_callback& progress) {
  const std::chrono::duration<double> limit(options.front().rank_seconds);
  wfpg::thread_ranks ranks(static_cast<std::uint32_t>(options.size()),
                           std::chrono::duration_cast<std::chrono::milliseconds>(limit));
  std::vector<render_result> results(options.size());
  std::exception_ptr first_error;
  std::mutex guard;
  const auto run = [&](std::size_t rank) {
    // It ends with this function, so that other ranks do not wait for one that has failed.
    wfpg::thread_communicator<wfpg::exec::seq> own(wfpg::exec::seq(), ranks,
                                                   static_cast<std::uint32_t>(rank));
    try {
      render_options shared = options[rank];
      shared.ranks = &own;
      results[rank] = render(scene, shared, rank == 0 ? progress : progress_callback());
    } catch (...) {
      const std::lock_guard<std::mutex> lock(guard);
      if (!first_error) first_error = std::current_exception();
    }
  };
  std::vector<std::thread> threads;
  for (std::size_t rank = 0; rank < options.size(); ++rank) threads.emplace_back(run, rank);
  for (std::thread& thread : threads) thread.join();
  if (first_error) std::rethrow_exception(first_error);
  return std::move(results.front());
}

render_result render_on_devices(const scene& scene, const render_options& options,
                                const progress_callback& progress) {
  std::vector<render_options> all;
  for (const int device : options.devices) {
    all.push_back(options);
    all.back().devices = {device};
  }
  return render_by_threads(scene, all, progress);
}

}  // namespace render
