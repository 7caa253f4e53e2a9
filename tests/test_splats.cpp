// Splats, compared with sums in the order of places.
#include "support/catch.hpp"
#include "support/evaluate.hpp"
#include "support/failing_resource.hpp"
#include "support/policies.hpp"

#include <wfpg/base/math.hpp>
#include <wfpg/light/splats.hpp>

#include <cstdint>
#include <stdexcept>
#include <vector>

namespace {

using namespace wfpg_test;
using wfpg::vec3;

/// What a place leaves: a pixel of `pixels` and a value, or nothing.
struct random_splats {
  std::uint32_t pixels, seed;

  WFPG_HD bool is_empty(std::size_t place) const { return wfpg::hash(seed, place) % 5 == 0; }
  WFPG_HD std::uint32_t pixel(std::size_t place) const {
    // A third of all go to one pixel.
    const auto bits = static_cast<std::uint32_t>(wfpg::hash(seed + 1, place));
    return bits % 3 == 0 ? pixels - 1 : bits % pixels;
  }
  WFPG_HD vec3 value(std::size_t place) const {
    const auto unit = [&](std::uint32_t k) {
      return wfpg::unit_float(static_cast<std::uint32_t>(wfpg::hash(seed + 2 + k, place)));
    };
    return {unit(0), 10.0f * unit(1), 1e-3f * unit(2)};
  }
};

struct leave_splats {
  wfpg::splat_view splats;
  random_splats what;
  WFPG_HD void operator()(std::size_t place) const {
    if (what.is_empty(place))
      splats.skip(place);
    else
      splats.add(place, what.pixel(place), what.value(place));
  }
};

std::vector<vec3> expected_sums(const random_splats& what, std::size_t places, float scale) {
  std::vector<vec3> sums(what.pixels, vec3(0.0f));
  for (std::size_t place = 0; place < places; ++place)
    if (!what.is_empty(place)) sums[what.pixel(place)] += what.value(place);
  for (vec3& sum : sums) sum *= scale;
  return sums;
}

template <class Exec>
std::vector<vec3> sums_of(const Exec& exec, wfpg::splats<Exec>& splats, const random_splats& what,
                          float scale) {
  exec.for_each(splats.view().size(), leave_splats{splats.view(), what});
  wfpg::buffer<vec3, Exec> picture(exec, std::vector<vec3>(what.pixels, vec3(0.0f)));
  splats.add_to(exec, picture.view(), scale);
  return picture.to_host(exec);
}

}  // namespace

WFPG_TEST_CASE("splats are added to their pixels in the order of places", "[splats]") {
  const Exec exec;
  for (const std::uint32_t pixels : {1u, 7u, 256u, 1000u}) {
    for (const std::size_t places : {std::size_t(0), std::size_t(1), std::size_t(5000)}) {
      wfpg::splats<Exec> splats(exec, places, pixels);
      for (const std::uint32_t seed : {1u, 2u}) {
        const random_splats what{pixels, seed};
        // Powers of two scale without rounding.
        const std::vector<vec3> found = sums_of(exec, splats, what, 0.25f),
                                expected = expected_sums(what, places, 0.25f);
        CHECK(found == expected);
      }
    }
  }
}

WFPG_TEST_CASE("places are empty at first and after their splats were added", "[splats]") {
  const Exec exec;
  const random_splats what{16, 3};
  wfpg::splats<Exec> splats(exec, 100, what.pixels);
  wfpg::buffer<vec3, Exec> picture(exec, std::vector<vec3>(what.pixels, vec3(1.0f)));
  splats.add_to(exec, picture.view(), 1.0f);
  CHECK(picture.to_host(exec) == std::vector<vec3>(what.pixels, vec3(1.0f)));
  sums_of(exec, splats, what, 1.0f);
  splats.add_to(exec, picture.view(), 1.0f);
  CHECK(picture.to_host(exec) == std::vector<vec3>(what.pixels, vec3(1.0f)));
}

WFPG_TEST_CASE("splats of the first places are added alone", "[splats]") {
  const Exec exec;
  const random_splats what{16, 4};
  wfpg::splats<Exec> splats(exec, 100, what.pixels);
  for (const std::size_t n : {std::size_t(100), std::size_t(37), std::size_t(0)}) {
    exec.for_each(n, leave_splats{splats.view(), what});
    wfpg::buffer<vec3, Exec> picture(exec, std::vector<vec3>(what.pixels, vec3(0.0f)));
    splats.add_to(exec, picture.view(), 0.5f, n);
    CHECK(picture.to_host(exec) == expected_sums(what, n, 0.5f));
  }
}

TEST_CASE("splats need a picture", "[splats]") {
  const host_policy exec;
  using splats = wfpg::splats<host_policy>;
  CHECK_THROWS_AS(splats(exec, 1, 0), std::invalid_argument);
  CHECK_THROWS_AS(splats(exec, 1, 0xffffffffull), std::invalid_argument);
  CHECK_THROWS_AS(splats(exec, 0xffffffffull, 1), std::invalid_argument);
}
