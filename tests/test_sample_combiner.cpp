// The ways to combine samples, tested sample by sample.
#include "support/catch.hpp"

#include <wfpg/sampling/sample_combiner.hpp>

#include <cstdint>
#include <vector>

namespace {

std::vector<float> weights(wfpg::sample_combination combination) {
  std::vector<float> result;
  for (std::uint32_t i = 1; i <= 8; ++i) result.push_back(wfpg::sample_weight(combination, i));
  return result;
}

}  // namespace

TEST_CASE("sample combiner: weights of the first eight samples are right", "[sample_combiner]") {
  using wfpg::sample_combination;
  using sequence = std::vector<float>;
  CHECK(weights(sample_combination::constant) == sequence{1, 1, 1, 1, 1, 1, 1, 1});
  CHECK(weights(sample_combination::linear) == sequence{1, 2, 3, 4, 5, 5, 5, 5});
  CHECK(weights(sample_combination::quadratic) == sequence{1, 4, 9, 16, 25, 25, 25, 25});
  CHECK(weights(sample_combination::one_two) == sequence{1, 2, 2, 2, 2, 2, 2, 2});
  CHECK(weights(sample_combination::discard_first) == sequence{0, 1, 1, 1, 1, 1, 1, 1});
  CHECK(weights(sample_combination::pt_first) == sequence{1, 1, 1, 1, 1, 1, 1, 1});
  CHECK(weights(sample_combination::pt_linear) == sequence{1, 2, 3, 4, 5, 5, 5, 5});
  CHECK(weights(sample_combination::inverse_variance) == sequence{1, 1, 1, 1, 1, 1, 1, 1});
}

TEST_CASE("sample combiner: weights stay bounded", "[sample_combiner]") {
  using wfpg::sample_combination;
  CHECK(wfpg::sample_weight(sample_combination::linear, 0xffffffffu) == 5.0f);
  CHECK(wfpg::sample_weight(sample_combination::quadratic, 0xffffffffu) == 25.0f);
}

TEST_CASE("sample combiner: combinations that begin with path tracing want an unguided sample",
          "[sample_combiner]") {
  using wfpg::sample_combination;
  for (sample_combination c :
       {sample_combination::constant, sample_combination::linear, sample_combination::quadratic,
        sample_combination::one_two, sample_combination::discard_first})
    CHECK(wfpg::unguided_samples(c) == 0);
  for (sample_combination c :
       {sample_combination::pt_first, sample_combination::pt_linear, sample_combination::inverse_variance})
    CHECK(wfpg::unguided_samples(c) == 1);
}
