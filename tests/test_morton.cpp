// Morton codes: round trips, the order of bits, and the octree's prefix property.
#include "support/catch.hpp"
#include "support/policies.hpp"

#include <wfpg/base/morton.hpp>

#include <cstdint>
#include <vector>

namespace {

using namespace wfpg_test;
using wfpg::morton_code;
using wfpg::uvec3;

constexpr std::uint32_t largest = (1u << 21) - 1;

/// The definition, bit by bit.
morton_code interleaved(uvec3 p) {
  morton_code code = 0;
  for (int bit = 0; bit < 21; ++bit)
    for (int axis = 0; axis < 3; ++axis) code |= morton_code(p[axis] >> bit & 1u) << (3 * bit + axis);
  return code;
}

std::vector<uvec3> coordinates() {
  std::vector<uvec3> points;
  for (const std::uint32_t x : {0u, 1u, 1023u, 1024u, largest})
    for (const std::uint32_t y : {0u, 2u, 4095u, largest})
      for (const std::uint32_t z : {0u, 5u, 65536u, largest}) points.push_back({x, y, z});
  for (int axis = 0; axis < 3; ++axis)
    for (int bit = 0; bit < 21; ++bit) {
      points.push_back(uvec3(0u));
      points.back()[axis] = 1u << bit;
    }
  random_numbers random(1);
  while (points.size() < 5000)
    points.push_back({random.below(largest + 1), random.below(largest + 1), random.below(largest + 1)});
  return points;
}

WFPG_TEST_CASE("a point's Morton code round trips", "[morton]") {
  const Exec exec;
  const std::vector<uvec3> points = coordinates();
  const wfpg::buffer<uvec3, Exec> device_points(exec, points), decoded(exec, points.size());
  const wfpg::buffer<morton_code, Exec> codes(exec, points.size());
  const auto p = device_points.view(), d = decoded.view();
  const auto c = codes.view();
  exec.for_each(points.size(), [=] WFPG_HD(std::size_t i) {
    c[i] = wfpg::morton_encode(p[i]);
    d[i] = wfpg::morton_decode(c[i]);
  });
  CHECK((decoded.to_host(exec) == points));
  std::vector<morton_code> expected;
  for (const uvec3 p : points) expected.push_back(interleaved(p));
  CHECK((codes.to_host(exec) == expected));
}

TEST_CASE("every bit of a Morton code round trips", "[morton]") {
  for (int bit = 0; bit < 63; ++bit) {
    const morton_code code = morton_code(1) << bit;
    REQUIRE(wfpg::morton_encode(wfpg::morton_decode(code)) == code);
  }
  const morton_code all = (morton_code(1) << 63) - 1;
  CHECK(wfpg::morton_encode(uvec3(largest)) == all);
  CHECK((wfpg::morton_decode(all) == uvec3(largest)));
  CHECK(wfpg::morton_encode({1, 0, 0}) == 1);
  CHECK(wfpg::morton_encode({0, 1, 0}) == 2);
  CHECK(wfpg::morton_encode({0, 0, 1}) == 4);
}

TEST_CASE("higher bits of a coordinate are ignored", "[morton]") {
  CHECK(wfpg::morton_encode({0xffe00003u, 1u << 21, 1u << 31}) == wfpg::morton_encode({3, 0, 0}));
}

TEST_CASE("a code without its last three bits is the parent voxel's", "[morton]") {
  for (const uvec3 p : coordinates())
    for (int levels = 0; levels < 21; levels += 5)
      REQUIRE(wfpg::morton_encode(p) >> (3 * levels) == wfpg::morton_encode(p >> uvec3(levels)));
}

}  // namespace
