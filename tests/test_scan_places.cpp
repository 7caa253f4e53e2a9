// Places of elements, compared with sums that are added in order.
#include "support/catch.hpp"
#include "support/policies.hpp"

#include <wfpg/base/math.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/scan_places.hpp>

#include <thrust/iterator/counting_iterator.h>
#include <thrust/iterator/transform_iterator.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace {

using namespace wfpg_test;

struct random_count {
  WFPG_HD std::uint32_t operator()(std::size_t i) const {
    return static_cast<std::uint32_t>(wfpg::hash(5, static_cast<std::uint32_t>(i)) % 4);
  }
};

struct note_place {
  wfpg::array_view<std::uint32_t> places, calls;
  WFPG_HD void operator()(std::size_t i, std::uint32_t place) const {
    places[i] = place;
    ++calls[i];
  }
};

}  // namespace

WFPG_TEST_CASE("each element gets the sum of the counts before it, once", "[scan_places]") {
  const Exec exec;
  for (const std::size_t n : {std::size_t(0), std::size_t(1), std::size_t(1000), std::size_t(300001)}) {
    std::vector<std::uint32_t> counts(n), expected(n);
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i < n; ++i) {
      counts[i] = random_count()(i);
      expected[i] = sum;
      sum += counts[i];
    }
    const wfpg::buffer<std::uint32_t, Exec> of_counts(exec, counts);
    const auto made =
        ::thrust::make_transform_iterator(::thrust::counting_iterator<std::size_t>(0), random_count());
    const auto check = [&](const auto& iterator) {
      // One element more, so that there is memory where n is 0.
      const std::vector<std::uint32_t> zeros(n + 1, 0);
      const wfpg::buffer<std::uint32_t, Exec> places(exec, zeros), calls(exec, zeros);
      wfpg::scan_places(exec, n, iterator, note_place{places.view(), calls.view()});
      std::vector<std::uint32_t> found = places.to_host(exec), called = calls.to_host(exec);
      CHECK(called.back() == 0);
      found.pop_back();
      called.pop_back();
      CHECK(found == expected);
      CHECK(called == std::vector<std::uint32_t>(n, 1));
    };
    check(of_counts.data());
    check(made);
  }
}
