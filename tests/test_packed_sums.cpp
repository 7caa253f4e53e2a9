// Sums by key over ranks: any number of ranks has those of one queue with all values, and sends as many
// bytes.
#include "support/catch.hpp"
#include "support/policies.hpp"
#include "support/ranks.hpp"
#include "support/scenes.hpp"

#include <wfpg/exec/support/rank_counters.hpp>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <new>
#include <string>
#include <vector>

namespace {

using namespace wfpg_test;
using wfpg::vec2;

constexpr std::chrono::seconds limit(10);
constexpr std::size_t keys = 64 * 40 + 13;

struct keyed_value {
  std::uint32_t key;
  float value;  // negative: an entry that is dropped
};

/// Counts what it passes on.
class counting_communicator final : public wfpg::communicator {
 public:
  explicit counting_communicator(wfpg::communicator& to) : to_(to) {}
  std::uint32_t rank() const override { return to_.rank(); }
  std::uint32_t size() const override { return to_.size(); }
  void all_reduce_sum(wfpg::array_view<std::uint32_t> values) override {
    bytes += 4 * values.size();
    to_.all_reduce_sum(values);
  }
  void all_reduce_sum(wfpg::array_view<std::uint64_t> values) override {
    bytes += 8 * values.size();
    to_.all_reduce_sum(values);
  }
  void all_reduce_max(wfpg::array_view<std::uint32_t> values) override {
    bytes += 4 * values.size();
    to_.all_reduce_max(values);
  }
  void all_reduce_max(wfpg::array_view<std::uint64_t> values) override {
    bytes += 8 * values.size();
    to_.all_reduce_max(values);
  }
  void broadcast(wfpg::array_view<unsigned char> values, std::uint32_t root) override {
    bytes += values.size();
    to_.broadcast(values, root);
  }

  void all_reduce(wfpg::array_view<const wfpg::reduction> arrays) override {
    if (++calls == failing) throw std::bad_alloc();
    communicator::all_reduce(arrays);
  }

  std::size_t bytes = 0;
  std::size_t calls = 0;    // of all_reduce()
  std::size_t failing = 0;  // the call for which there is no memory, from 1; 0: none

 private:
  wfpg::communicator& to_;
};

/// A key's result of take().
struct taken_sum {
  double sum;
  std::uint32_t count;
  bool operator==(const taken_sum& other) const { return sum == other.sum && count == other.count; }
};

/// A rank's sums: taken twice, so that the second time finds what the first left.
std::vector<taken_sum> sums_of(const std::vector<keyed_value>& all, std::uint32_t rank, std::uint32_t ranks,
                               wfpg::communicator* joins) {
  const one_policy exec;
  // Parts of unequal size; that of rank 0 may be empty.
  const auto begin = [&](std::size_t r) {
    return all.begin() + static_cast<std::ptrdiff_t>(all.size() * r * r / (ranks * ranks));
  };
  const std::vector<keyed_value> own(begin(rank), begin(rank + 1));
  const wfpg::buffer<keyed_value, one_policy> values(exec, own);
  wfpg::detail::value_queue<one_policy> queue(exec, all.size() + 1, keys, joins);
  const wfpg::buffer<taken_sum, one_policy> taken(exec, keys);
  for (int turn = 0; turn < 2; ++turn) {
    const wfpg::detail::value_queue_view view = queue.view();
    const wfpg::array_view<keyed_value> from = values.view();
    const wfpg::array_view<taken_sum> to = taken.view();
    exec.for_each(own.size(), [=] WFPG_HD(std::size_t i) {
      const std::uint32_t entry = view.reserve(1);
      if (from[i].value < 0.0f)
        view.drop(entry);
      else
        view.write(entry, from[i].key, from[i].value);
    });
    queue.sum(exec);
    exec.for_each(keys, [=] WFPG_HD(std::size_t key) {
      to[key].sum = 0.0;
      to[key].count = view.take(key, to[key].sum);
    });
    queue.end_takes(exec);
  }
  return taken.to_host(exec);
}

/// Checks any number of ranks, and returns the bytes that each sends a turn.
std::size_t check_ranks(const std::vector<keyed_value>& all) {
  const std::vector<taken_sum> alone = sums_of(all, 0, 1, nullptr);
  std::size_t bytes = 0;
  for (const std::uint32_t n : {1u, 2u, 3u, 8u}) {
    CAPTURE(n);
    std::vector<std::size_t> sent(n);
    std::vector<std::vector<taken_sum>> found(n);
    const std::vector<std::string> errors = run_ranks<one_policy>(n, limit, [&](wfpg::communicator& ranks) {
      counting_communicator counting(ranks);
      found[ranks.rank()] = sums_of(all, ranks.rank(), n, &counting);
      sent[ranks.rank()] = counting.bytes / 2;
    });
    CHECK(errors == std::vector<std::string>(n));
    for (const std::vector<taken_sum>& of_rank : found) CHECK((of_rank == alone));
    if (n == 2) bytes = sent[0];
    if (n >= 2) CHECK(sent == std::vector<std::size_t>(n, bytes));
  }
  return bytes;
}

/// Values of which many keys have none, one or several, over forty orders of magnitude.
std::vector<keyed_value> scattered_values(std::size_t n) {
  std::vector<keyed_value> values;
  for (std::uint32_t i = 0; i < n; ++i) {
    const hashed_numbers numbers{i};
    const vec2 u = numbers(0, 0), v = numbers(0, 1);
    const auto key = static_cast<std::uint32_t>(static_cast<float>(keys) * u.x * (v.x < 0.5f ? 1.0f : u.x));
    const float value = u.y < 0.1f ? 0.0f : std::exp(46.0f * v.y - 23.0f);
    values.push_back({key, v.x < 0.05f ? -1.0f : value});
  }
  return values;
}

/// What a rank has of an exchange of three queues and two arrays.
struct exchanged {
  std::vector<taken_sum> taken;     // of the first and last key of each queue
  std::vector<std::uint32_t> sums;  // of the arrays
  std::size_t takes = 0;            // results that were read: the sum, and the largest value times 100
  std::size_t calls = 0, calls_after_two = 0;

  bool operator==(const exchanged& other) const {
    return taken == other.taken && sums == other.sums && takes == other.takes && calls == other.calls &&
           calls_after_two == other.calls_after_two;
  }
};

/// Queues a value of each of `n` keys, and with `twice` another of key 0.
void queue_ones(const one_policy& exec, const wfpg::detail::value_queue_view& view, std::size_t n,
                bool twice) {
  exec.for_each(n + (twice ? 1 : 0), [=] WFPG_HD(std::size_t i) {
    view.write(view.reserve(1), static_cast<std::uint32_t>(i % n), 1.0f);
  });
}
/// Takes the first and last of `n` keys.
void take_two(const one_policy& exec, const wfpg::detail::value_queue_view& view, std::size_t n,
              std::vector<taken_sum>& to) {
  const wfpg::buffer<taken_sum, one_policy> taken(exec, 2);
  const wfpg::array_view<taken_sum> two = taken.view();
  exec.for_each(2, [=] WFPG_HD(std::size_t i) {
    two[i].sum = 0.0;
    two[i].count = view.take(i * (n - 1), two[i].sum);
  });
  for (const taken_sum& one : taken.to_host(exec)) to.push_back(one);
}

exchanged exchange_of(wfpg::communicator& joins) {
  constexpr std::size_t few[] = {5, 700, 9};  // keys of the queues; the last one has no values
  const one_policy exec;
  const std::uint32_t rank = joins.rank();
  counting_communicator counting(joins);
  std::vector<wfpg::detail::value_queue<one_policy>> queues;
  for (const std::size_t n : few) queues.emplace_back(exec, 2 * n, n, &counting);
  for (std::size_t q = 0; q < 2; ++q) queue_ones(exec, queues[q].view(), few[q], rank == 0);
  const wfpg::buffer<std::uint32_t, one_policy> sum(exec, std::vector<std::uint32_t>{rank + 1}),
      most(exec, std::vector<std::uint32_t>{rank + 1});

  exchanged result;
  wfpg::detail::rank_exchange<one_policy> all(counting);
  for (wfpg::detail::value_queue<one_policy>& queue : queues) all.add(queue);
  all.add(wfpg::reduction::sum(sum.view()), [&] { result.takes += sum.to_host(exec)[0]; });
  all.add(wfpg::reduction::max(most.view()), [&] { result.takes += 100 * most.to_host(exec)[0]; });
  all.run(exec);
  for (wfpg::detail::value_queue<one_policy>& queue : queues) queue.sum(exec);
  result.calls = counting.calls;
  result.sums = {sum.to_host(exec)[0], most.to_host(exec)[0]};
  for (std::size_t q = 0; q < 3; ++q) take_two(exec, queues[q].view(), few[q], result.taken);
  // What was summed ahead counts once.
  queues[2].sum(exec);
  result.calls_after_two = counting.calls;
  return result;
}

/// Counts, queues a value, and ends a sample; once more where memory runs out in between.
void count_and_exchange(const one_policy& exec, counting_communicator& ranks, std::uint32_t n,
                        const wfpg::buffer<std::uint32_t, one_policy>& counter,
                        wfpg::detail::rank_counters<one_policy, std::uint32_t>& shared,
                        wfpg::detail::value_queue<one_policy>& queue) {
  std::uint32_t* const at = counter.data();
  exec.for_each(1, [=] WFPG_HD(std::size_t) { *at += n; });
  queue_ones(exec, queue.view(), 1, false);
  for (bool again = true; again;) {
    wfpg::detail::rank_exchange<one_policy> all(ranks);
    all.add(queue);
    shared.add_to(exec, all, wfpg::detail::counters_in_a_row<std::uint32_t>{at});
    again = false;
    try {
      all.run(exec);
    } catch (const std::bad_alloc&) {
      again = true;
    }
  }
}

/// A counter to which each rank adds 10 and then 1, where the first call of the second exchange passes and
/// its call `failing` does not.
std::uint32_t count_twice(wfpg::communicator& joins, std::size_t failing) {
  const one_policy exec;
  counting_communicator ranks(joins);
  const wfpg::buffer<std::uint32_t, one_policy> counter(exec, std::vector<std::uint32_t>{0});
  wfpg::detail::rank_counters<one_policy, std::uint32_t> shared(exec, 1);
  wfpg::detail::value_queue<one_policy> queue(exec, 8, 8, &ranks);
  count_and_exchange(exec, ranks, 10, counter, shared, queue);
  ranks.failing = failing > 0 ? ranks.calls + failing : 0;
  count_and_exchange(exec, ranks, 1, counter, shared, queue);
  return counter.to_host(exec)[0];
}

}  // namespace

TEST_CASE("any number of ranks has the sums of one queue", "[packed_sums]") {
  // Nothing, few values, about one a key, and many.
  for (const std::size_t n : {0u, 1u, 40u, 2500u, 20000u}) {
    CAPTURE(n);
    check_ranks(scattered_values(n));
  }
  // A key has all values of its block. Their number needs one bit more where it is a power of two.
  for (const std::uint32_t n : {2u, 3u, 4u, 65535u, 65536u}) {
    CAPTURE(n);
    std::vector<keyed_value> values(n, {77, 1.5f});
    values.push_back({64 * 40 + 12, 1.0e-42f});  // the last key, subnormal
    values.push_back({64 * 40, 3.0e38f});
    check_ranks(values);
  }
}

TEST_CASE("ranks send few bytes a value", "[packed_sums]") {
  constexpr std::size_t of_each = 8 + 4 * (keys / 512 + 1) + 4 * (keys / 64 + 1);  // without any value
  CHECK(check_ranks(scattered_values(0)) == 8);
  CHECK(check_ranks({{5, 1.0f}}) == of_each + 8 + 8);
  const std::size_t values = 2500;
  CHECK(check_ranks(scattered_values(values)) < of_each + 6 * values);
  // Many values of a key are one sum.
  CHECK(check_ranks(scattered_values(20000)) < of_each + 10 * keys);
}

TEST_CASE("blocks of as many values as there may be fill lanes of 32 bits", "[packed_sums]") {
  using wfpg::detail::pending_values;
  constexpr std::size_t few = 64 + 3;  // a whole block, and a part of one
  constexpr std::uint32_t ranks = 4, most = 1u << 31;
  // Each rank has a part of all counts; the last value of a block is one rank's.
  std::vector<pending_values> all(few);
  all[0] = {0x123456789abcdef0u, most - 2};
  all[1] = {0xffffffull << 20, 1};
  all[63] = {0xabcdefull, 1};
  all[65] = {~0ull >> 1, 2 * ranks};
  std::vector<std::vector<pending_values>> found(ranks);
  const std::vector<std::string> errors = run_ranks<one_policy>(ranks, limit, [&](wfpg::communicator& joins) {
    const std::uint32_t rank = joins.rank();
    const auto part = [rank](auto whole) {
      const auto share = static_cast<decltype(whole)>(whole / ranks);
      return static_cast<decltype(whole)>(rank == 0 ? whole - (ranks - 1) * share : share);
    };
    std::vector<pending_values> own(few);
    for (std::size_t key : {std::size_t(0), std::size_t(65)})
      own[key] = {part(all[key].sum), part(all[key].count)};
    if (rank == 2) own[1] = all[1];
    if (rank == 3) own[63] = all[63];
    const one_policy exec;
    const wfpg::buffer<pending_values, one_policy> pending(exec, own);
    // A second queue of other keys, which has the first three alone.
    const wfpg::buffer<pending_values, one_policy> others(
        exec, std::vector<pending_values>(own.begin(), own.begin() + 3));
    wfpg::detail::packed_sums<one_policy> packed(exec, few), packed_others(exec, 3);
    std::vector<wfpg::detail::sums_to_pack<one_policy>> both{{&packed, pending.view(), {}},
                                                             {&packed_others, others.view(), {}}};
    wfpg::detail::packed_sums<one_policy>::reduce(exec, joins, both);
    found[rank] = pending.to_host(exec);
    for (const pending_values& one : others.to_host(exec)) found[rank].push_back(one);
  });
  for (std::size_t key = 0; key < 3; ++key) all.push_back(all[key]);
  CHECK(errors == std::vector<std::string>(ranks));
  for (const std::vector<pending_values>& of_rank : found)
    for (std::size_t key = 0; key < all.size(); ++key) {
      CAPTURE(key);
      CHECK(of_rank[key].sum == all[key].sum);
      CHECK(of_rank[key].count == all[key].count);
    }
}

TEST_CASE("Several queues and arrays take five reductions, and have the sums of all ranks", "[packed_sums]") {
  constexpr std::uint32_t ranks = 3;
  std::vector<exchanged> found(ranks);
  const std::vector<std::string> errors = run_ranks<one_policy>(
      ranks, limit, [&](wfpg::communicator& joins) { found[joins.rank()] = exchange_of(joins); });
  CHECK(errors == std::vector<std::string>(ranks));
  // Keys have a value of each rank, and key 0 has two of rank 0.
  const exchanged expected{{{4.0, 4}, {3.0, 3}, {4.0, 4}, {3.0, 3}, {0.0, 0}, {0.0, 0}}, {6, 3}, 306, 5, 6};
  for (const exchanged& of_rank : found) CHECK((of_rank == expected));
}

TEST_CASE("Counters count once where an exchange is made again", "[packed_sums]") {
  constexpr std::uint32_t ranks = 2;
  for (const std::size_t failing : {0u, 1u, 2u, 4u}) {
    CAPTURE(failing);
    std::vector<std::uint32_t> found(ranks);
    const std::vector<std::string> errors = run_ranks<one_policy>(
        ranks, limit, [&](wfpg::communicator& joins) { found[joins.rank()] = count_twice(joins, failing); });
    CHECK(errors == std::vector<std::string>(ranks));
    CHECK(found == std::vector<std::uint32_t>{22, 22});
  }
}
