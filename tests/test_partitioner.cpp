// The partitioner, compared with std::stable_sort.
#include "support/catch.hpp"
#include "support/evaluate.hpp"
#include "support/policies.hpp"

#include <wfpg/bins/partitioner.hpp>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <stdexcept>
#include <vector>

namespace {

using namespace wfpg_test;
using indices = std::vector<std::uint32_t>;

constexpr std::uint32_t excluded = 0xffffffffu;

/// The expected partition: included indices by key, the begin of each group and the end of the last.
struct expected_partition {
  indices permutation, offsets, keys;
};

expected_partition sorted_stably(const indices& keys) {
  expected_partition expected;
  indices all(keys.size());
  std::iota(all.begin(), all.end(), 0u);
  std::stable_sort(all.begin(), all.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
  for (const std::uint32_t i : all) {
    if (keys[i] == excluded) continue;
    if (expected.keys.empty() || expected.keys.back() != keys[i]) {
      expected.keys.push_back(keys[i]);
      expected.offsets.push_back(static_cast<std::uint32_t>(expected.permutation.size()));
    }
    expected.permutation.push_back(i);
  }
  expected.offsets.push_back(static_cast<std::uint32_t>(expected.permutation.size()));
  return expected;
}

/// A group as a view reports it.
struct group_record {
  std::uint32_t key, begin, size;
};

template <class Exec>
void check_partition(const Exec& exec, wfpg::partitioner<Exec>& partitioner, const indices& keys) {
  const wfpg::buffer<std::uint32_t, Exec> device_keys(exec, keys);
  const wfpg::partition_view view = partitioner.partition(exec, device_keys.view());
  const expected_partition expected = sorted_stably(keys);

  const std::uint32_t groups = wfpg::read_element(exec, view.count);
  REQUIRE(groups == expected.keys.size());
  indices permutation = to_host(exec, view.permutation);
  indices everyone = permutation;
  std::sort(everyone.begin(), everyone.end());
  bool is_permutation = everyone.size() == keys.size();
  for (std::uint32_t i = 0; i < everyone.size(); ++i) is_permutation &= everyone[i] == i;
  CHECK(is_permutation);

  permutation.resize(expected.permutation.size());
  CHECK((permutation == expected.permutation));
  CHECK((to_host(exec, view.offsets.subview(0, groups + 1)) == expected.offsets));
  const indices prefix = to_host(exec, view.group_prefix);
  std::size_t wrong = 0;
  const auto described = evaluate(exec, groups, [=] WFPG_HD(std::size_t group) {
    return group_record{view.key(group), view.begin(group), view.size(group)};
  });
  for (std::uint32_t group = 0; group < groups; ++group) {
    wrong += described[group].key != expected.keys[group];
    wrong += described[group].begin != expected.offsets[group];
    wrong += described[group].size != expected.offsets[group + 1] - expected.offsets[group];
    for (std::uint32_t i = expected.offsets[group]; i < expected.offsets[group + 1]; ++i)
      wrong += prefix[i] != group + 1;
  }
  CHECK(wrong == 0);
  CHECK((device_keys.to_host(exec) == keys));
}

indices random_keys(std::size_t n, std::uint32_t range, float excluded_part, std::uint64_t seed) {
  random_numbers random(seed);
  indices keys(n);
  for (std::uint32_t& key : keys) key = random.unit() < excluded_part ? excluded : random.below(range);
  return keys;
}

WFPG_TEST_CASE("partition equals a stable sort", "[partitioner]") {
  const Exec exec;
  wfpg::partitioner<Exec> partitioner(exec, 20000);
  for (const std::uint32_t range : {1u, 2u, 7u, 1000u, 0xfffffffeu})
    for (const float excluded_part : {0.0f, 0.3f, 0.999f})
      check_partition(exec, partitioner, random_keys(20000, range, excluded_part, range));
  check_partition(exec, partitioner, random_keys(3, 2, 0.0f, 5));
}

WFPG_TEST_CASE("partitions are right in edge cases", "[partitioner]") {
  const Exec exec;
  wfpg::partitioner<Exec> partitioner(exec, 1000);
  check_partition(exec, partitioner, {});
  check_partition(exec, partitioner, {excluded});
  check_partition(exec, partitioner, indices(1000, excluded));
  check_partition(exec, partitioner, {0});
  check_partition(exec, partitioner, {0xfffffffeu});
  check_partition(exec, partitioner, indices(1000, 42));
  indices descending(1000);
  for (std::uint32_t i = 0; i < 1000; ++i) descending[i] = 999 - i;
  check_partition(exec, partitioner, descending);
  check_partition(exec, partitioner, {excluded, 3, excluded, 3, 0xfffffffeu, 0, excluded});
  check_partition(exec, partitioner, {});

  wfpg::partitioner<Exec> nothing(exec, 0);
  check_partition(exec, nothing, {});
}

WFPG_TEST_CASE("a partition beyond the capacity is refused and leaves the partitioner usable",
               "[partitioner]") {
  const Exec exec;
  wfpg::partitioner<Exec> partitioner(exec, 10);
  const wfpg::buffer<std::uint32_t, Exec> keys(exec, indices(11, 1));
  CHECK_THROWS_AS(partitioner.partition(exec, keys.view()), std::invalid_argument);
  check_partition(exec, partitioner, {4, 4, 1, 4, 0});
  CHECK_THROWS_AS((wfpg::partitioner<Exec>(exec, 0xffffffffu)), std::invalid_argument);
}

WFPG_TEST_CASE("a partitioner takes 16 bytes an index", "[partitioner]") {
  const Exec exec;
  CHECK(wfpg::partitioner<Exec>(exec, 100000).bytes() <= 16u * 100000u + 64u);
}

}  // namespace
