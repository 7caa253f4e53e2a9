// Joins GPUs by NCCL, each a rank with its own CUDA policy.
// GPUs may lie in one machine or in many, in one process or in many.
// Values stay in device memory.
// NCCL gives each rank a GPU of its own; for ranks that share a GPU there is ranks/threads.hpp.
// It asks for NCCL 2.18 or later.
// The CMake target wfpg::nccl brings its header and library.
//
// Source: NCCL's user guide, "Creating a communicator with options" and "Fault tolerance".
// Cost: two collectives a call, one of 32 bytes that checks that ranks agree.
// The first is the host's where options name its communicator, which takes less time.
// The host waits for each of them, since a kernel that waits for a lost rank never ends.
//
// Ranks join by a communicator that does not block, so that one that does not come is an error.
// Calls are those of a second one, which blocks.
// NCCL begins a thread for each call of one that does not, which takes longer than most calls.
// docs/ranks.md has the times of both.
// NCCL_COMM_BLOCKING in the environment overrules it: with 1, ranks that join have no time limit.
//
// Memory: NCCL's own, and 32 bytes on the device and on the host.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/ranks/communicator.hpp>
#include <wfpg/ranks/detail/nccl_calls.hpp>
#include <wfpg/ranks/detail/same_call.hpp>

#include <cuda_runtime_api.h>
#include <nccl.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace wfpg {

/// Options of nccl_communicator.
/// All ranks must have the same `seconds`, and all of them a `host` or none.
struct nccl_options {
  /// Seconds after which a rank that waits for others throws rank_error, in (0, 1e6].
  /// Work of the rank's own stream does not count.
  double seconds = 30.0;
  /// Ranks of the host's memory, of the same rank and size, by which calls are compared; null: NCCL compares
  /// them. thread_communicator for GPUs of one process, or mpi_communicator. It must outlive the
  /// communicator, and its time limit counts in calls.
  communicator* host = nullptr;
};

/// A GPU that takes part, for join_devices().
/// The policy was made while that GPU was current.
template <class Exec>
struct nccl_device {
  int device = 0;  ///< the runtime's number of the GPU
  Exec exec;       ///< the policy on a stream of that GPU
};

/// Returns what all ranks of a new communicator must be given.
/// One rank makes it.
/// The host brings its bytes to the others, by MPI for example.
/// It serves one communicator.
/// Throws rank_error.
inline ncclUniqueId make_nccl_id() {
  ncclUniqueId id;
  detail::check_nccl(ncclGetUniqueId(&id), "ncclGetUniqueId");
  return id;
}

/// The ranks of an NCCL communicator.
/// Exec is a policy that has a stream(), such as exec::cuda.
/// Arrays lie in device memory, of the GPU whose stream the policy has.
/// That GPU must be current in all calls, as for the policy.
///
/// One process with all GPUs of a machine calls join_devices().
/// One process a GPU, with MPI between them:
///
///   ncclUniqueId id = {};
///   if (rank == 0) id = wfpg::make_nccl_id();
///   MPI_Bcast(&id, sizeof id, MPI_BYTE, 0, MPI_COMM_WORLD);
///   cudaSetDevice(device);
///   const wfpg::exec::cuda exec;
///   wfpg::nccl_communicator<wfpg::exec::cuda> ranks(exec, rank, size, id);
///
/// Joining connects the GPUs for arrays of all sizes, and takes 16 MiB of device memory meanwhile.
///
/// After rank_error, further calls throw at once.
/// NCCL's work on the stream is aborted, so that the stream can be used.
/// The guider's own arrays may then hold sums of some ranks.
///
/// One thread at a time may call one rank's communicator.
/// Ranks of one process need a thread each, since calls wait for the other ranks.
template <class Exec>
class nccl_communicator final : public communicator {
 public:
  /// Joins ranks 0 to size - 1, which all must make one with the same `id`.
  /// Throws rank_error where a rank does not come within the time limit.
  /// NCCL may wait longer for one that ends between joining and its first call.
  /// Throws std::invalid_argument where `rank` is not less than `size`, or for options out of range.
  nccl_communicator(const Exec& exec, std::uint32_t rank, std::uint32_t size, const ncclUniqueId& id,
                    const nccl_options& options = {})
      : exec_(exec), options_(options), rank_(rank), size_(size) {
    require(rank < size, "rank", rank, "less than the number of ranks");
    require(options.seconds > 0.0 && options.seconds <= 1.0e6, "seconds", options.seconds,
            "above 0, up to 1e6");
    require(!options.host || (options.host->rank() == rank && options.host->size() == size), "host",
            options.host ? options.host->rank() : 0, "the rank and size of this communicator");
    try {
      begin(id);
      wait_to_join("ncclCommInitRankConfig");
      begin_calls();
      wait_to_join("ncclCommSplit");
      meet();
      connect();
    } catch (...) {
      // The destructor must not wait for ranks that have not joined.
      abandon();
      throw;
    }
  }
  /// Not copyable: ranks are joined once.
  nccl_communicator(const nccl_communicator&) = delete;
  nccl_communicator& operator=(const nccl_communicator&) = delete;
  /// Leaves the communicator.
  /// Other ranks are waited for, no longer than the time limit.
  /// After an exception nobody is waited for, nor are ranks of join_devices().
  ~nccl_communicator() override {
    if (!ranks_) return;
    try {
      if (std::uncaught_exceptions() > exceptions_)
        abandon();
      else if (!is_of_one_thread_)
        meet();
      if (ranks_) ncclCommDestroy(std::exchange(ranks_, nullptr));
    } catch (...) {
      // Destructors must not throw.
    }
    abandon();
  }

  /// Returns the communicators of GPUs of this process, all of them, in the order of `devices`.
  /// Each is then for a thread of its own.
  /// The current GPU stays what it was.
  /// Throws rank_error, device_error, or std::invalid_argument where there is no GPU, or for options.host.
  static std::vector<std::unique_ptr<nccl_communicator>> join_devices(
      const std::vector<nccl_device<Exec>>& devices, const nccl_options& options = {}) {
    require(!devices.empty(), "devices", devices.size(), "one or more");
    require(!options.host, "host", "a communicator", "null here, since each rank needs its own");
    // Before any rank waits for another.
    const detail::device_keeper keeper;
    for (const nccl_device<Exec>& one : devices)
      detail::check_runtime(cudaSetDevice(one.device), "cudaSetDevice");
    const ncclUniqueId id = make_nccl_id();
    std::vector<std::unique_ptr<nccl_communicator>> all(devices.size());
    std::vector<std::exception_ptr> errors(devices.size());
    // Each call of joining waits for all ranks.
    {
      detail::joined_threads threads;
      for (std::size_t rank = 0; rank < devices.size(); ++rank)
        threads.begin([&, rank] {
          try {
            detail::check_runtime(cudaSetDevice(devices[rank].device), "cudaSetDevice");
            all[rank] =
                std::make_unique<nccl_communicator>(devices[rank].exec, static_cast<std::uint32_t>(rank),
                                                    static_cast<std::uint32_t>(devices.size()), id, options);
            all[rank]->is_of_one_thread_ = true;
          } catch (...) {
            errors[rank] = std::current_exception();
          }
        });
    }
    detail::rethrow_cause(errors);
    return all;
  }

  /// Returns the number of this GPU, as it was given.
  std::uint32_t rank() const override { return rank_; }
  /// Returns the number of GPUs.
  std::uint32_t size() const override { return size_; }
  /// Sums 32-bit values in device memory.
  /// Throws rank_error where a rank is late, is lost, or calls with another number of values.
  void all_reduce_sum(array_view<std::uint32_t> values) override { reduce(reduction::sum(values)); }
  /// Sums 64-bit values.
  /// Throws rank_error likewise.
  void all_reduce_sum(array_view<std::uint64_t> values) override { reduce(reduction::sum(values)); }
  /// Takes the largest values of 32 bits.
  /// Throws rank_error likewise.
  void all_reduce_max(array_view<std::uint32_t> values) override { reduce(reduction::max(values)); }
  /// Takes the largest values of 64 bits.
  /// Throws rank_error likewise.
  void all_reduce_max(array_view<std::uint64_t> values) override { reduce(reduction::max(values)); }
  /// Reduces several arrays as one group of NCCL's calls.
  /// Throws rank_error likewise.
  void all_reduce(array_view<const reduction> arrays) override {
    exchange(detail::rank_call::of(arrays), [&] { return begin_group(arrays); });
  }
  /// Sends the bytes of the rank `root` to all others.
  /// Throws rank_error likewise.
  /// Throws std::invalid_argument where no rank has the number `root`.
  void broadcast(array_view<unsigned char> bytes, std::uint32_t root) override {
    require(root < size_, "root", root, "less than the number of ranks");
    exchange({detail::rank_function::broadcast, bytes.size(), root}, [&] {
      return ncclBroadcast(bytes.data(), bytes.data(), bytes.size(), ncclUint8, static_cast<int>(root),
                           ranks_, exec_.stream());
    });
  }

 private:
  /// Begins to join the other ranks, and returns at once.
  void begin(const ncclUniqueId& id) {
    ncclConfig_t config = NCCL_CONFIG_INITIALIZER;
    config.blocking = 0;
    require_taken(
        ncclCommInitRankConfig(&joined_, static_cast<int>(size_), id, static_cast<int>(rank_), &config),
        "ncclCommInitRankConfig");
  }
  /// Begins to make ranks_ of joined_, and returns at once.
  /// Precondition: all ranks have joined.
  void begin_calls() {
    ncclConfig_t config = NCCL_CONFIG_INITIALIZER;
    config.blocking = 1;
    require_taken(ncclCommSplit(joined_, 0, static_cast<int>(rank_), &ranks_, &config), "ncclCommSplit");
  }

  /// Throws rank_error where NCCL has not taken a call of ranks_.
  /// The communicator is then of no more use.
  /// Waits where NCCL has yet to put it on the stream, as NCCL_COMM_BLOCKING=0 in the environment has it do.
  /// `begun`: the call's result.
  void require_begun(ncclResult_t begun, const char* doing) {
    require_taken(begun, doing);
    if (begun == ncclInProgress) wait(ranks_, doing, [] { return true; });
  }
  /// As above, without waiting.
  void require_taken(ncclResult_t begun, const char* doing) {
    if (begun != ncclSuccess && begun != ncclInProgress) abandon();
    detail::check_nccl(begun, doing);
  }

  /// Reduces one array in device memory.
  /// Throws rank_error.
  void reduce(const reduction& one) { all_reduce(array_view<const reduction>(&one, 1)); }
  /// Puts the collectives of arrays on the stream, and returns NCCL's result.
  ncclResult_t begin_group(array_view<const reduction> arrays) {
    detail::nccl_group group;
    for (const reduction& one : arrays) {
      if (one.count == 0) continue;  // it may have no address
      const ncclResult_t taken = begin_one(one);
      if (taken != ncclSuccess && taken != ncclInProgress) return taken;
    }
    return group.finish();
  }
  /// Puts the collective of one array on the stream, and returns NCCL's result.
  ncclResult_t begin_one(const reduction& one) {
    return ncclAllReduce(one.values, one.values, one.count, one.is_short() ? ncclUint32 : ncclUint64,
                         one.is_sum() ? ncclSum : ncclMax, ranks_, exec_.stream());
  }

  /// Waits for all ranks, and exchanges no values.
  /// Throws rank_error where one does not come.
  void meet() {
    exchange(meeting, [] { return ncclSuccess; });
  }
  /// Connects the GPUs as arrays of all sizes need it, by summing some.
  /// NCCL connects them in the first call of a size, which takes long, and where it may wait without a limit.
  /// Throws rank_error, and device_error where memory ran out.
  void connect() {
    const detail::connecting_words words;
    for (const std::size_t count : detail::connecting_words::counts)
      reduce(reduction::sum(words.first(count)));
  }

  /// Makes a call with all ranks, and waits for it.
  /// `begin` puts the collective of its values on the stream.
  /// Throws rank_error unless all ranks make this call.
  /// NCCL does not check that: its kernels may wait without end.
  template <class Begin>
  void exchange(const detail::rank_call& call, const Begin& begin) {
    if (!ranks_) throw rank_error("the communicator is of no more use, since an earlier call has failed");
    const char* const doing = detail::name_of(call.function);
    // The rank's own work comes first, so that the time limit is for the others alone.
    detail::check_runtime(cudaStreamSynchronize(exec_.stream()), "cudaStreamSynchronize");
    if (options_.host)
      require_same_by_host(call);
    else
      require_same_by_nccl(call);
    // All ranks have come. NCCL connects them in the first calls of a size, and would wait in them.
    if (call.count == 0) return;
    require_begun(begin(), doing);
    wait_for_stream(doing);
  }

  /// Throws rank_error unless all ranks make this call, as the host's ranks find.
  void require_same_by_host(const detail::rank_call& call) {
    try {
      call.write(words_.host());
      options_.host->all_reduce_max({words_.host(), detail::rank_call::word_count});
    } catch (...) {
      abandon();
      throw;
    }
    require_same(call);
  }
  /// As above, by NCCL.
  void require_same_by_nccl(const detail::rank_call& call) {
    call.write(words_.host());
    words_.send(exec_.stream());
    require_begun(compare_words(), detail::name_of(call.function));
    words_.take(exec_.stream());
    wait_for_stream(detail::name_of(call.function));
    require_same(call);
  }

  /// Puts on the stream the collective of the words that ranks compare: their maxima.
  /// Returns NCCL's result.
  /// Precondition: the words were sent.
  ncclResult_t compare_words() {
    return ncclAllReduce(words_.device(), words_.device(), detail::rank_call::word_count, ncclUint64, ncclMax,
                         ranks_, exec_.stream());
  }

  /// Throws rank_error unless all ranks make this call.
  /// Precondition: the host has the maxima of all ranks' words.
  void require_same(const detail::rank_call& call) {
    if (call.agrees(words_.host())) return;
    // Ranks are no longer in step, so that later calls must fail, too.
    abandon();
    call.require_same(words_.host(), rank_);
  }

  /// Waits until all that is on the stream is done, collectives among it.
  /// Throws rank_error where they take longer than the time limit.
  void wait_for_stream(const char* doing) {
    detail::check_runtime(cudaEventRecord(done_.get(), exec_.stream()), "cudaEventRecord");
    wait(ranks_, doing, [&] {
      const cudaError_t code = cudaEventQuery(done_.get());
      if (code != cudaErrorNotReady) detail::check_runtime(code, doing);
      return code == cudaSuccess;
    });
  }

  /// Waits until NCCL has done what joined_ was asked for.
  void wait_to_join(const char* doing) {
    wait(joined_, doing, [] { return true; });
  }

  /// Waits until NCCL has no work of `ranks` on the host, and is_done() returns true.
  /// Throws rank_error after the time limit, or where NCCL reports an error.
  /// Such errors are a network's, or a rank's that has aborted.
  /// Looks without pause, since a pause is as long as a small exchange.
  template <class Done>
  void wait(ncclComm_t ranks, const char* doing, const Done& is_done) {
    using clock = std::chrono::steady_clock;
    const clock::time_point begin = clock::now();
    for (;;) {
      ncclResult_t state = ncclSuccess;
      const ncclResult_t asked = ncclCommGetAsyncError(ranks, &state);
      const ncclResult_t found = asked != ncclSuccess ? asked : state;
      if (found == ncclSuccess && is_done()) return;
      if (found != ncclSuccess && found != ncclInProgress) {
        abandon();
        detail::check_nccl(found, doing);
      }
      const double waited = std::chrono::duration<double>(clock::now() - begin).count();
      if (waited > options_.seconds) {
        abandon();
        throw detail::late_error(rank_, doing, options_.seconds);
      }
      std::this_thread::yield();
    }
  }

  /// Ends NCCL's kernels on the stream, if any wait there.
  /// Frees both communicators.
  /// Later calls see that there is no communicator.
  /// Does nothing where there is none.
  void abandon() {
    if (ranks_) ncclCommAbort(std::exchange(ranks_, nullptr));
    if (joined_) ncclCommAbort(std::exchange(joined_, nullptr));
    // joined_ may have been about to write it.
    if (ranks_) ncclCommAbort(std::exchange(ranks_, nullptr));
  }

  /// The policy on whose stream the collectives are.
  Exec exec_;
  /// The call that ranks make in meet().
  static constexpr detail::rank_call meeting{detail::rank_function::meeting, 0};

  /// As given; ranks are not asked whether they have the same.
  nccl_options options_;
  std::uint32_t rank_ = 0, size_ = 0;
  /// Whether join_devices() made all ranks, so that one thread may destroy them.
  bool is_of_one_thread_ = false;
  /// Exceptions in flight when this was made.
  /// More of them in the destructor mean that the rank gives up.
  int exceptions_ = std::uncaught_exceptions();
  /// The words that ranks compare before each exchange.
  detail::rank_words words_;
  /// Comes after all that is on the stream; recorded anew for each wait.
  detail::cuda_event done_;
  /// Does not block, and has no calls.
  /// It must live as long as any rank makes calls: those of ranks_ hang without it.
  /// Null after a failure.
  ncclComm_t joined_ = nullptr;
  /// Of all calls.
  /// Null after a failure.
  ncclComm_t ranks_ = nullptr;
};

}  // namespace wfpg
