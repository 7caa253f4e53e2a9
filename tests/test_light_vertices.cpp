// Stored vertices of light paths, compared with a list that is filled in order.
#include "support/catch.hpp"
#include "support/evaluate.hpp"
#include "support/failing_resource.hpp"
#include "support/policies.hpp"

#include <wfpg/base/math.hpp>
#include <wfpg/light/light_vertices.hpp>

#include <cstdint>
#include <stdexcept>
#include <vector>

namespace {

using namespace wfpg_test;

struct test_vertex {
  std::uint32_t path, depth;
};

/// How many vertices paths store at which depth: none in a third of the cases, else up to `most`.
struct random_paths {
  std::uint32_t seed;
  std::uint32_t most = 1;
  WFPG_HD std::uint32_t keeps(std::size_t path, std::uint32_t depth) const {
    const std::uint64_t random = wfpg::hash(seed + depth, path);
    return random % 3 == 0 ? 0u : 1u + static_cast<std::uint32_t>(random / 3 % most);
  }
};

struct choose_paths {
  random_paths what;
  std::uint32_t depth;
  wfpg::array_view<std::uint32_t> keeps;
  WFPG_HD void operator()(std::size_t path) const { keeps[path] = what.keeps(path, depth); }
};

struct store_vertices {
  random_paths what;
  wfpg::light_vertices_view<test_vertex> vertices;
  std::uint32_t depth;
  WFPG_HD void operator()(std::size_t path) const {
    for (std::uint32_t k = 0; k < what.keeps(path, depth) && vertices.has_place(path, k); ++k)
      vertices.write(path, {static_cast<std::uint32_t>(path), depth}, k);
  }
};

template <class Exec>
void store_all(const Exec& exec, wfpg::light_vertices<Exec, test_vertex>& vertices, const random_paths& what,
               std::uint32_t depths) {
  vertices.begin(exec);
  const std::size_t paths = vertices.view().paths();
  const wfpg::buffer<std::uint32_t, Exec> keeps(exec, paths);
  for (std::uint32_t depth = 0; depth < depths; ++depth) {
    exec.for_each(paths, choose_paths{what, depth, keeps.view()});
    vertices.reserve(exec, keeps.view());
    exec.for_each(paths, store_vertices{what, vertices.view(), depth});
  }
}

constexpr std::uint32_t none = wfpg::light_vertices_view<test_vertex>::none;

/// One stored vertex as a view shows it.
struct stored_vertex {
  std::uint32_t path, depth, previous;
};
bool operator==(const stored_vertex& a, const stored_vertex& b) {
  return a.path == b.path && a.depth == b.depth && a.previous == b.previous;
}

struct read_vertex {
  wfpg::light_vertices_view<test_vertex> vertices;
  WFPG_HD stored_vertex operator()(std::size_t i) const {
    const auto index = static_cast<std::uint32_t>(i);
    const bool same_path = vertices.path(index) == vertices[index].path;
    return {same_path ? vertices.path(index) : none, vertices[index].depth, vertices.previous(index)};
  }
};

struct read_last {
  wfpg::light_vertices_view<test_vertex> vertices;
  WFPG_HD std::uint32_t operator()(std::size_t path) const { return vertices.last(path); }
};

/// What is to be stored.
struct expected_vertices {
  std::vector<stored_vertex> all;
  std::vector<std::uint32_t> last;
  std::uint32_t dropped = 0;

  expected_vertices(const random_paths& what, std::size_t paths, std::uint32_t depths, std::size_t capacity)
      : last(paths, none) {
    for (std::uint32_t depth = 0; depth < depths; ++depth) {
      for (std::uint32_t path = 0; path < paths; ++path) {
        for (std::uint32_t k = 0; k < what.keeps(path, depth); ++k) {
          if (all.size() == capacity) {
            ++dropped;
            continue;
          }
          all.push_back({path, depth, last[path]});
          last[path] = static_cast<std::uint32_t>(all.size() - 1);
        }
      }
    }
  }
};

}  // namespace

WFPG_TEST_CASE("light vertices lie in the order of depths and paths", "[light_vertices]") {
  const Exec exec;
  constexpr std::uint32_t depths = 5;
  for (const std::size_t paths : {std::size_t(1), std::size_t(3), std::size_t(4000)}) {
    for (const std::size_t room : {std::size_t(1), paths, paths * depths}) {
      const std::size_t bytes = room * (sizeof(test_vertex) + 2 * sizeof(std::uint32_t));
      wfpg::light_vertices<Exec, test_vertex> vertices(exec, {paths, bytes, depths});
      REQUIRE(vertices.capacity() == room);
      // Each iteration forgets the one before. In the third, paths keep several vertices at a time.
      for (const std::uint32_t seed : {1u, 2u, 3u}) {
        const random_paths what{seed, seed == 3 ? 4u : 1u};
        store_all(exec, vertices, what, depths);
        const expected_vertices expected(what, paths, depths, room);
        REQUIRE(vertices.size(exec) == expected.all.size());
        CHECK(vertices.dropped(exec) == expected.dropped);
        CHECK(evaluate(exec, expected.all.size(), read_vertex{vertices.view()}) == expected.all);
        CHECK(evaluate(exec, paths, read_last{vertices.view()}) == expected.last);
      }
    }
  }
}

WFPG_TEST_CASE("light vertices have no more memory than their budget or all paths need", "[light_vertices]") {
  const Exec exec;
  using vertices = wfpg::light_vertices<Exec, test_vertex>;
  constexpr std::size_t vertex_bytes = sizeof(test_vertex) + 2 * sizeof(std::uint32_t);
  constexpr std::size_t paths = 100, others = paths * 2 * sizeof(std::uint32_t);
  for (const std::size_t budget : {vertex_bytes, 50 * vertex_bytes + 1, std::size_t(1) << 40}) {
    const vertices stored(exec, {paths, budget, 4});
    CHECK(stored.bytes() <= glm::min(budget, 4 * paths * vertex_bytes) + others + 12);
  }
}

TEST_CASE("light vertices' options have ranges", "[light_vertices]") {
  const host_policy exec;
  using vertices = wfpg::light_vertices<host_policy, test_vertex>;
  CHECK_THROWS_AS(vertices(exec, {0xffffffffull, 1000, 1}), std::invalid_argument);
  CHECK_THROWS_AS(vertices(exec, {1, 1000, 0}), std::invalid_argument);
  CHECK_THROWS_AS(vertices(exec, {1, 11, 1}), std::invalid_argument);
  vertices stored(exec, {2, 1000, 1});
  const wfpg::buffer<std::uint32_t, host_policy> too_few(exec, 1);
  CHECK_THROWS_AS(stored.reserve(exec, too_few.view()), std::invalid_argument);
}

WFPG_TEST_CASE("light vertices free what they have where memory runs out", "[light_vertices]") {
  failing_resource resource;
  const Exec exec = Exec().with_resource(&resource);
  const std::size_t failures = fail_at_each(resource, [&] {
    wfpg::light_vertices<Exec, test_vertex> vertices(exec, {50, 1 << 20, 2});
    store_all(exec, vertices, random_paths{1}, 2);
  });
  CHECK(failures >= 5);
  CHECK(resource.live() == 0);
}
