// Joins the processes of an MPI job.
// Ranks may lie on one machine or on many.
// It needs an MPI 3 and its C interface alone.
// The CMake target wfpg::mpi brings both.
//
// Values pass through host memory, piece by piece: page-locked where the policy has such.
// Any MPI serves any policy, also an MPI that knows nothing of GPUs.
// Messages that are still in flight after a failure point to no memory of a guider.
//
// Source: the MPI 3.1 standard, sections 5.12 (non-blocking collectives) and 8.3 (errors).
// Cost: two collectives a call, one of 32 bytes that checks that ranks agree; two copies of the values.
// Memory: one piece on the host, 4 MiB unless options say otherwise.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/ranks/communicator.hpp>
#include <wfpg/ranks/detail/same_call.hpp>
#include <wfpg/ranks/detail/staging.hpp>

#include <mpi.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>

namespace wfpg {

/// Options of mpi_communicator.
/// All ranks must have the same.
struct mpi_options {
  /// Seconds after which a rank that waits for others throws rank_error, in (0, 1e6].
  /// A rank waits from the end of its own part of a sample on.
  /// So this must exceed the time that ranks differ by.
  double seconds = 30.0;
  /// Largest message, bytes, 64 to 2^30.
  /// More values are sent one piece after the other.
  /// Any number of values may be sent, also more than MPI's limit of 2^31.
  std::size_t piece_bytes = std::size_t(4) << 20;
};

namespace detail {

/// Throws rank_error that names the failed function of MPI.
/// `code`: what it returned.
inline void check_mpi(int code, const char* function) {
  if (code == MPI_SUCCESS) return;
  char text[MPI_MAX_ERROR_STRING + 1] = {};
  int length = 0;
  MPI_Error_string(code, text, &length);
  throw rank_error(std::string(function) + " failed: " + text +
                   "; another rank has probably ended, see its messages");
}

/// Throws rank_error unless MPI can be used now.
/// MPI itself would end the process.
inline void require_mpi() {
  int begun = 0, ended = 0;
  MPI_Initialized(&begun);
  MPI_Finalized(&ended);
  if (!begun) throw rank_error("MPI is not initialised: call MPI_Init before making an mpi_communicator");
  if (ended) throw rank_error("MPI has ended: make an mpi_communicator before MPI_Finalize");
}

}  // namespace detail

/// The ranks of an MPI communicator.
/// Exec is the policy in whose memory arrays lie, whose stream must outlive this.
/// One of a CPU policy serves all CPU policies, whose memory is the host's.
///
/// After rank_error, further calls throw at once.
/// MPI_Finalize may then wait without end.
/// So a host reports the error, and ends the process by MPI_Abort.
///
/// Open MPI, MPICH and their kin differ in what a lost process does.
/// Some end the whole job by themselves, before the time limit.
/// One thread at a time may call.
/// MPI needs MPI_THREAD_FUNNELED where that is always the thread that initialised it.
/// Else it needs MPI_THREAD_SERIALIZED.
template <class Exec>
class mpi_communicator final : public communicator {
 public:
  /// Joins the ranks of `ranks`, which all must make one.
  /// `ranks` is MPI_COMM_WORLD where all processes of a job render one picture.
  /// A part of them that MPI_Comm_split made serves as well.
  /// A duplicate of `ranks` carries the messages, so that they mix with no others.
  /// `exec` is copied.
  /// Throws rank_error where MPI is not initialised, or has ended.
  /// Throws rank_error where a rank does not come within the time limit.
  /// Throws std::invalid_argument for options out of range.
  /// Cost: one duplication, a few messages a rank.
  mpi_communicator(const Exec& exec, MPI_Comm ranks, const mpi_options& options = {})
      : exec_(exec), piece_(exec), options_(options) {
    require(options.seconds > 0.0 && options.seconds <= 1.0e6, "seconds", options.seconds,
            "above 0, up to 1e6");
    require(options.piece_bytes >= 64 && options.piece_bytes <= std::size_t(1) << 30, "piece_bytes",
            options.piece_bytes, "64 to 2^30");
    detail::require_mpi();
    int rank = 0, size = 0;
    detail::check_mpi(MPI_Comm_rank(ranks, &rank), "MPI_Comm_rank");
    detail::check_mpi(MPI_Comm_size(ranks, &size), "MPI_Comm_size");
    rank_ = static_cast<std::uint32_t>(rank);
    size_ = static_cast<std::uint32_t>(size);
    messages_ = std::make_unique<message_memory>();
    piece_.fit(options.piece_bytes);
    // A duplication that does not block, so that it has a time limit, too.
    MPI_Request request = MPI_REQUEST_NULL;
    start(MPI_Comm_idup(ranks, &messages_->ranks, &request), "MPI_Comm_idup");
    wait(request, "the constructor");
    // Errors become exceptions. By default, MPI ends the process.
    start(MPI_Comm_set_errhandler(messages_->ranks, MPI_ERRORS_RETURN), "MPI_Comm_set_errhandler");
  }
  /// Not copyable: ranks are joined once.
  mpi_communicator(const mpi_communicator&) = delete;
  mpi_communicator& operator=(const mpi_communicator&) = delete;
  /// Frees the duplicate.
  /// MPI completes messages of earlier calls first.
  /// Leaves it and its messages where a call has failed, or where MPI has ended.
  ~mpi_communicator() override {
    int ended = 0;
    MPI_Finalized(&ended);
    if (messages_ && !ended) MPI_Comm_free(&messages_->ranks);
  }

  /// Returns this process' rank in the duplicate, which is that in `ranks`.
  std::uint32_t rank() const override { return rank_; }
  /// Returns the number of processes.
  std::uint32_t size() const override { return size_; }
  /// Sums 32-bit values; a piece on the host at a time.
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
  /// Reduces several arrays, and checks once that ranks agree.
  /// Throws rank_error likewise.
  void all_reduce(array_view<const reduction> arrays) override {
    const detail::rank_call call = detail::rank_call::of(arrays);
    require_same(call);
    for (const reduction& one : arrays) reduce_one(one, detail::name_of(call.function));
  }
  /// Sends the bytes of the rank `root` to all others.
  /// Throws rank_error likewise.
  /// Throws std::invalid_argument where no rank has the number `root`.
  void broadcast(array_view<unsigned char> bytes, std::uint32_t root) override {
    require(root < size_, "root", root, "less than the number of ranks");
    const detail::rank_call call{detail::rank_function::broadcast, bytes.size(), root};
    require_same(call);
    in_pieces(bytes, [&](void* piece, int count) {
      MPI_Request request = MPI_REQUEST_NULL;
      start(MPI_Ibcast(piece, count, MPI_BYTE, static_cast<int>(root), messages_->ranks, &request),
            "MPI_Ibcast");
      wait(request, detail::name_of(call.function));
    });
  }

 private:
  /// What a pending message points to.
  /// MPI cannot take back a collective.
  /// So this memory is never freed after a failure.
  struct message_memory {
    /// The duplicate.
    MPI_Comm ranks = MPI_COMM_NULL;
    /// What ranks compare before each exchange.
    std::uint64_t call[detail::rank_call::word_count] = {};
  };

  /// Reduces one array.
  void reduce(const reduction& one) { all_reduce(array_view<const reduction>(&one, 1)); }
  /// Reduces values in the policy's memory. Ranks agree that they do.
  /// `doing`: the function that was called, for messages.
  void reduce_one(const reduction& one, const char* doing) {
    const MPI_Op operation = one.is_sum() ? MPI_SUM : MPI_MAX;
    if (one.is_short())
      reduce_in_pieces(static_cast<std::uint32_t*>(one.values), one.count, MPI_UINT32_T, operation, doing);
    else
      reduce_in_pieces(static_cast<std::uint64_t*>(one.values), one.count, MPI_UINT64_T, operation, doing);
  }
  /// As above, of values of a type that both languages know.
  template <class T>
  void reduce_in_pieces(T* values, std::size_t count, MPI_Datatype type, MPI_Op operation,
                        const char* doing) {
    in_pieces(array_view<T>(values, count),
              [&](void* piece, int n) { reduce_on_host(piece, n, type, operation, doing); });
  }

  /// Throws rank_error unless all ranks make this call.
  /// MPI does not check that: it may wait without end, or mix values up.
  void require_same(const detail::rank_call& call) {
    if (!messages_) throw rank_error("the communicator is of no more use, since an earlier call has failed");
    call.write(messages_->call);
    reduce_on_host(messages_->call, int(detail::rank_call::word_count), MPI_UINT64_T, MPI_MAX,
                   detail::name_of(call.function));
    if (call.agrees(messages_->call)) return;
    // Ranks are no longer in step, so that later calls must fail, too.
    call.require_same(abandon().call, rank_);
  }

  /// Replaces values by what exchange(piece, count) makes of them on the host, piece by piece.
  /// The copy to the host waits for the policy's work.
  /// That from the host is ordered before the policy's later work.
  template <class T, class Exchange>
  void in_pieces(array_view<T> values, const Exchange& exchange) {
    const std::size_t most =
        options_.piece_bytes / sizeof(std::uint64_t) * (sizeof(std::uint64_t) / sizeof(T));
    void* const piece = piece_.fit(options_.piece_bytes);
    for (std::size_t first = 0; first < values.size(); first += most) {
      const std::size_t count = std::min(most, values.size() - first);
      exec_.copy_to_host(piece, values.data() + first, count * sizeof(T));
      exchange(piece, static_cast<int>(count));
      exec_.copy_from_host(values.data() + first, piece, count * sizeof(T));
    }
  }

  /// Reduces values on the host in place, and waits.
  /// `doing`: the function that was called, for messages.
  void reduce_on_host(void* values, int count, MPI_Datatype type, MPI_Op operation, const char* doing) {
    MPI_Request request = MPI_REQUEST_NULL;
    start(MPI_Iallreduce(MPI_IN_PLACE, values, count, type, operation, messages_->ranks, &request),
          "MPI_Iallreduce");
    wait(request, doing);
  }

  /// Throws rank_error where a function of MPI failed, and gives the duplicate up.
  void start(int code, const char* function) {
    if (code != MPI_SUCCESS) abandon();
    detail::check_mpi(code, function);
  }

  /// Waits until a request is done.
  /// Throws rank_error after the time limit.
  /// Spins for a millisecond, since ranks that are equally fast answer in less.
  /// Then sleeps between looks, so that the core is free for other ranks' threads.
  void wait(MPI_Request& request, const char* doing) {
    using clock = std::chrono::steady_clock;
    const clock::time_point begin = clock::now();
    for (;;) {
      int is_done = 0;
      start(MPI_Test(&request, &is_done, MPI_STATUS_IGNORE), "MPI_Test");
      if (is_done) return;
      const double waited = std::chrono::duration<double>(clock::now() - begin).count();
      if (waited > options_.seconds) {
        abandon();
        throw detail::late_error(rank_, doing, options_.seconds);
      }
      if (waited < 1.0e-3)
        std::this_thread::yield();
      else
        std::this_thread::sleep_for(std::chrono::microseconds(50));
    }
  }

  /// Gives up the messages in flight, and returns their memory, which stays.
  /// Later calls see that there is none.
  message_memory& abandon() {
    piece_.give_up();
    return *messages_.release();
  }

  /// The policy whose copies reach the values.
  Exec exec_;
  /// Values on their way, of any type.
  detail::staging<Exec> piece_;
  /// As given; ranks are not asked whether they have the same.
  mpi_options options_;
  std::uint32_t rank_ = 0, size_ = 0;
  /// Null after a failure.
  std::unique_ptr<message_memory> messages_;
};

}  // namespace wfpg
