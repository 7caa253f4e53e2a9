// Kept fields: what cells remember, and which cells are cast again. Compares distributions with densities and
// brute force. Tests that threads and forms of casters do not change a bit. Slots are tested in
// test_field_store_slots.cpp.
#include "support/evaluate.hpp"
#include "support/fields.hpp"
#include "support/kept_fields.hpp"
#include "support/lit_box.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"
#include "support/statistics.hpp"
#include "support/threads.hpp"

#include <wfpg/guides/octree/field_store.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::cone_hit;
using wfpg::directional_field;
using wfpg::guide_view;
using wfpg::guiding_mode;

namespace {

constexpr guiding_mode modes[] = {guiding_mode::oriented, guiding_mode::plain};

float graded_light(std::uint32_t face, float u, float v) {
  return float(face) + u + 0.5f * v;
}
float turned_light(std::uint32_t face, float u, float v) {
  return 3.0f + float(5 - face) * v + u;
}

/// The radiance of every node's sides, read through hits and from the cache.
template <class Exec>
std::pair<std::vector<float>, std::vector<float>> read_both(const lit_box<Exec>& box,
                                                            const std::vector<cone_hit>& hits) {
  const wfpg::exitance_cache_view cache = box.cache.view();
  return {evaluate(box.exec, hits, [=] WFPG_HD(const cone_hit& hit) { return hit.radiance(cache); }),
          evaluate(box.exec, hits.size(), [=] WFPG_HD(std::size_t i) {
            return cache.read(static_cast<std::uint32_t>(i / 2), static_cast<std::uint32_t>(i % 2));
          })};
}

WFPG_TEST_CASE("field store: a hit remembers a node's side and follows the cache", "[field_store]") {
  lit_box<Exec> box(graded_light, 16);
  std::vector<cone_hit> hits;
  for (wfpg::node_id node = 0; node < box.tree.view().node_count(); ++node)
    for (std::uint32_t side : {0u, 1u}) hits.push_back(cone_hit::surface(node, side));
  const auto before = read_both(box, hits);
  CHECK(before.first == before.second);
  box.shine(turned_light);
  const auto after = read_both(box, hits);
  CHECK(after.first == after.second);
  CHECK(after.first != before.first);
  box.cache.clear(box.exec);
  CHECK(read_both(box, hits).first == std::vector<float>(hits.size(), 0.0f));
}

struct remember_environment {
  wfpg::exitance_cache_view cache;
  WFPG_HD float operator()(float radiance) const { return cone_hit::environment(radiance).radiance(cache); }
};

WFPG_TEST_CASE("field store: a hit remembers the environment, and invalid radiance as darkness",
               "[field_store]") {
  const lit_box<Exec> box(graded_light, 4);
  const wfpg::exitance_cache_view cache = box.cache.view();
  const auto remembered = [&](const std::vector<float>& radiance) {
    return evaluate(box.exec, radiance, remember_environment{cache});
  };
  const std::vector<float> light{0.0f, 1e-44f, 1e-30f, 0.3f, 7.0f, 1e30f};
  CHECK(remembered(light) == light);
  CHECK(remembered({3e38f}) == std::vector<float>{1e30f});
  CHECK(remembered({-0.0f, -1.0f, std::nanf(""), -std::nanf(""), INFINITY, -INFINITY}) ==
        std::vector<float>(6, 0.0f));
  CHECK(evaluate(box.exec, [=] WFPG_HD() { return cone_hit().radiance(cache); }) == 0.0f);
}

/// How often each cell is cast in `recast` successive refreshes.
std::vector<int> times_cast(std::uint32_t resolution, std::uint32_t recast, std::uint32_t first) {
  std::vector<int> times(resolution * resolution, 0);
  const std::uint32_t cones = wfpg::refresh_cones(resolution, recast);
  for (std::uint32_t refresh = first; refresh < first + recast; ++refresh)
    for (std::uint32_t cone = 0; cone < cones; ++cone)
      ++times.at(wfpg::refreshed_cell(cone, refresh, resolution, recast));
  return times;
}

}  // namespace

TEST_CASE("field store: `recast` successive refreshes cast every cell once", "[field_store]") {
  for (std::uint32_t recast : {1u, 3u, 8u, 16u, 32u})
    for (std::uint32_t resolution = 2; resolution <= 33; ++resolution) {
      const std::uint32_t cells = resolution * resolution;
      INFO("resolution " << resolution << ", one in " << recast);
      CHECK(wfpg::refresh_cones(resolution, recast) == (cells + recast - 1) / recast);
      for (std::uint32_t first : {1u, 2u, 1000u}) {
        const std::vector<int> times = times_cast(resolution, recast, first);
        const auto end_of_runs = times.begin() + (cells - cells % recast);
        CHECK(std::all_of(times.begin(), end_of_runs, [](int n) { return n == 1; }));
        CHECK(std::all_of(end_of_runs, times.end(),
                          [](int n) { return n >= 1; }));  // cells of the shorter last run
      }
    }
}

TEST_CASE("field store: the cones of a refresh are spread over rows and columns", "[field_store]") {
  for (std::uint32_t resolution : {24u, 32u, 48u})
    for (std::uint32_t recast : {2u, 4u, 8u, 16u, 32u})
      for (std::uint32_t refresh = 0; refresh < recast; ++refresh) {
        const std::uint32_t cones = wfpg::refresh_cones(resolution, recast);
        std::set<std::uint32_t> rows, columns;
        for (std::uint32_t cone = 0; cone < cones; ++cone) {
          const std::uint32_t cell = wfpg::refreshed_cell(cone, refresh, resolution, recast);
          rows.insert(cell / resolution);
          columns.insert(cell % resolution);
        }
        INFO("resolution " << resolution << ", one in " << recast << ", refresh " << refresh);
        CHECK(5 * rows.size() >= 2 * std::min(cones, resolution));
        CHECK(5 * columns.size() >= 2 * std::min(cones, resolution));
      }
}

TEST_CASE("field store: a refresh casts at least one cell", "[field_store]") {
  for (std::uint32_t recast : {1000u, 0x7fffffffu, 0xfffffdc1u, 0xffffffffu})
    CHECK(wfpg::refresh_cones(24, recast) == 1);
}

namespace {

/// Samples directions from a field.
struct draw_field {
  directional_field field;
  wfpg::array_view<drawn_direction> drawn;
  WFPG_HD void operator()(std::size_t i) const {
    drawn[i].direction = field.sample(hashed_numbers{99}(static_cast<std::uint32_t>(i), 0), drawn[i].pdf);
  }
};

struct field_pdf {
  directional_field field;
  WFPG_HD float operator()(vec3 direction) const { return field.pdf(direction); }
};

WFPG_TEST_CASE("field store: directions have the field's density, which integrates to one", "[field_store]") {
  constexpr std::size_t samples = 20000;
  chi_square_family family;
  int below = 0;
  for (guiding_mode mode : modes) {
    kept_box<Exec> box(slots_of(16, 500), mode);
    auto wave = wall_surfaces(300, 3);
    for (std::size_t i = 0; i < wave.size(); i += 5) wave[i].bsdf.kind = bsdf_kind::glass;
    guide_view view;
    for (int sample = 0; sample < 3; ++sample) view = box.whole_sample(wave);
    for (std::uint32_t ray : {0u, 1u, 7u, 10u}) {
      REQUIRE(guides(box.exec(), view, ray));
      const directional_field field = box.field_of(view, ray);
      CHECK(field.hemisphere() == (mode == guiding_mode::oriented && ray % 5 != 0));
      const wfpg::buffer<drawn_direction, Exec> drawn(box.exec(), samples);
      box.exec().for_each(samples, draw_field{field, drawn.view()});
      const std::vector<drawn_direction> directions = drawn.to_host(box.exec());
      for (const drawn_direction& d : directions)
        below += field.hemisphere() && glm::dot(d.direction, wave[ray].normal) < -1e-6f;
      sampler_check_options options;
      options.moments = ray == 0;
      const auto report = check_sampler(directions, densities_by{box.exec(), field_pdf{field}}, options);
      INFO("ray " << ray << ": " << report.message);
      CHECK(report);
      family.add(report.frequencies, "ray " + std::to_string(ray));
    }
  }
  CHECK(below == 0);
  INFO(family.message());
  CHECK(family.accepted());
}

/// Index of a direction's cell in a field's grid.
std::size_t cell_of(const directional_field& field, vec3 d) {
  const std::uint32_t n = field.grid().resolution();
  const vec2 uv = field.hemisphere() ? wfpg::hemisphere_to_square(wfpg::frame(field.normal()).to_local(d))
                                     : wfpg::sphere_to_square(d);
  const vec2 cell = glm::min(glm::floor(uv * float(n)), vec2(float(n - 1)));
  return std::size_t(cell.y) * n + std::size_t(cell.x);
}

/// What a cone sees of the box.
struct look_through {
  wfpg::exitance_cache_view cache;
  float solid_angle;
  WFPG_HD float operator()(const wfpg::ray& cone) const {
    const float distance = box_caster()(cone).distance;
    const wfpg::node_id leaf = cache.octree().nearest_leaf(cone.origin + distance * cone.direction);
    return cache.read(cache.octree().node_for_cone(leaf, distance, solid_angle), -cone.direction);
  }
};

/// The cached radiance that each cell sees, from logged cones. -1 where no cone looked.
template <class Exec>
std::vector<double> seen_through(const kept_box<Exec>& box, const directional_field& field) {
  const std::uint32_t n = field.grid().resolution();
  const std::vector<wfpg::ray> cones = box.log.cones();
  const auto radiance =
      evaluate(box.exec(), cones, look_through{box.box.cache.view(), field.cell_solid_angle()});
  std::vector<double> seen(std::size_t(n) * n, -1.0);
  for (std::size_t i = 0; i < cones.size(); ++i)
    seen[cell_of(field, cones[i].direction)] = double(radiance[i]);
  return seen;
}

/// The cosine at the centre of a cell over a hemisphere.
double central_cosine(std::size_t cell, std::uint32_t n) {
  const vec2 corner(float(cell % n), float(cell / n));
  return double(wfpg::square_to_hemisphere((corner + 0.5f) / float(n)).z);
}

template <class Exec>
double largest_error(const Exec& exec, const directional_field& field, std::vector<double> seen) {
  const std::uint32_t n = field.grid().resolution();
  if (field.hemisphere())
    for (std::size_t i = 0; i < seen.size(); ++i) seen[i] *= central_cosine(i, n);
  const double sum = std::accumulate(seen.begin(), seen.end(), 0.0);
  const std::vector<std::uint32_t> weights = cell_weights(exec, field.grid());
  const std::uint32_t total = std::accumulate(weights.begin(), weights.end(), 0u);
  double largest = 0.0;
  for (std::uint32_t i = 0; i < n * n; ++i)
    largest = std::max(largest, std::abs(double(weights[i]) / double(total) - seen[i] / sum));
  return largest;
}

WFPG_TEST_CASE("field store: fields equal brute force over the same cones, after light changes too",
               "[field_store]") {
  for (guiding_mode mode : modes) {
    kept_box<Exec> box(slots_of(12, 4), mode, 144 + 36);
    box.field = {0.0f, 0.0f, false};
    const auto wave = rays_at({0.3f, 0.0f, 0.6f}, {0, 1, 0}, 40);
    box.begin();
    directional_field field = box.field_of(box.prepare(wave), 0);
    CHECK(box.log.count() == 144);
    std::vector<double> seen = seen_through(box, field);
    CHECK(std::count(seen.begin(), seen.end(), -1.0) == 0);
    CHECK(largest_error(box.exec(), field, seen) < 1e-5);

    box.box.cache.clear(box.exec());
    box.box.shine(graded_light);
    box.begin();
    field = box.field_of(box.prepare(wave), 0);
    CHECK(box.log.count() == 144 + 36);
    seen = seen_through(box, field);  // later cones replace earlier ones
    CHECK(largest_error(box.exec(), field, seen) < 1e-5);
  }
}

WFPG_TEST_CASE("field store: a field keeps the frame of its first ray", "[field_store]") {
  kept_box<Exec> box(slots_of(12, 4), guiding_mode::oriented, 144 + 36);
  box.field = {0.0f, 0.0f, false};
  const vec3 place(0.3f, 0.0f, 0.6f), first = glm::normalize(vec3(0.2f, 1.0f, 0.3f));
  box.begin();
  CHECK(box.field_of(box.prepare(rays_at(place, first)), 0).normal() == first);
  for (const vec3 next : {vec3(0, 1, 0), glm::normalize(vec3(-0.6f, 1.0f, 0.1f))}) {
    box.begin();
    const directional_field field = box.field_of(box.prepare(rays_at(place, next)), 0);
    CHECK(field.normal() == first);
    int below = 0;
    for (const wfpg::ray& cone : box.log.cones()) below += glm::dot(cone.direction, first) < -1e-6f;
    CHECK(below == 0);
    if (next.x == 0.0f) CHECK(largest_error(box.exec(), field, seen_through(box, field)) < 1e-5);
  }
  box.store.invalidate_all(box.exec());
  CHECK(box.field_of(box.prepare(rays_at(place, {0, 1, 0})), 0).normal() == vec3(0, 1, 0));
}

WFPG_TEST_CASE("field store: successive refreshes cast each cell of a field once", "[field_store]") {
  kept_box<Exec> box(slots_of(8, 4, 4), guiding_mode::oriented, 4 * 16);
  const auto wave = rays_at({0.3f, 0.0f, 0.6f}, {0, 1, 0});
  box.begin();
  box.prepare(wave);
  box.log.take();
  directional_field field;
  for (int refresh = 0; refresh < 4; ++refresh) {
    box.begin();
    field = box.field_of(box.prepare(wave), 0);
  }
  REQUIRE(box.log.count() == 64);
  const std::vector<double> seen = seen_through(box, field);
  CHECK(std::count(seen.begin(), seen.end(), -1.0) == 0);
}

WFPG_TEST_CASE("field store: refreshes follow moving light without casting all cones", "[field_store]") {
  const auto moved = [](std::uint32_t face, float u, float v) {
    const vec3 p = face_point(face, u, v);
    return emitted({1.0f - p.x, p.y, 1.0f - p.z});
  };
  const vec3 to_old = glm::normalize(vec3(0.3f, 1.0f, 0.3f)),
             to_new = glm::normalize(vec3(-0.3f, 1.0f, -0.3f));
  kept_box<Exec> box(slots_of(16, 4, 16));
  const auto wave = rays_at({0.5f, 0.0f, 0.5f}, {0, 1, 0}, 10);
  box.begin();
  const auto pdfs = [&](const guide_view& view) {
    return evaluate(box.exec(), std::vector<vec3>{to_old, to_new}, field_pdf{box.field_of(view, 0)});
  };
  const std::vector<float> before = pdfs(box.prepare(wave));
  CHECK(before[0] > 20.0f * before[1]);
  box.box.cache.clear(box.exec());
  box.box.shine(moved);
  box.begin();
  CHECK(box.cones(wave) == 16);
  const std::vector<float> after = pdfs(box.prepare(wave));
  CHECK(after[1] > 20.0f * after[0]);
}

/// Counts of a store after samples of allocations, refreshes, refusals and evictions.
struct store_history {
  std::vector<std::uint64_t> fields;
  std::uint64_t allocated = 0, freed = 0, refreshed = 0, refused = 0;

  bool operator==(const store_history& other) const {
    return fields == other.fields && allocated == other.allocated && freed == other.freed &&
           refreshed == other.refreshed && refused == other.refused;
  }
};

constexpr std::size_t inline_cones = ~std::size_t(0);

/// From an inline caster, or from a batch caster with a buffer of so many bytes.
template <class Exec>
store_history history(std::size_t buffer_bytes = inline_cones, batch_box_caster::log* log = nullptr) {
  wfpg::kept_field_options options = slots_of(8, 90);
  options.idle_samples = 2;
  options.max_wave_cones = 40 * 64;
  kept_box<Exec> box(options);
  store_history result;
  for (std::uint32_t sample = 0; sample < 6; ++sample) {
    box.begin();
    for (std::uint32_t depth = 0; depth < 3; ++depth) {
      auto wave = wall_surfaces(600, sample / 3);
      for (std::size_t i = depth; i < wave.size(); i += 7) wave[i].bsdf.kind = bsdf_kind::glass;
      const guide_view view = buffer_bytes == inline_cones
                                  ? box.prepare(wave)
                                  : box.prepare(wave, batch_box_caster{{}, log}, buffer_bytes);
      const auto bits = field_bits(box.exec(), view, wave.size());
      result.fields.insert(result.fields.end(), bits.begin(), bits.end());
    }
    box.end();
    result.refused += box.counts().refused;
  }
  result.allocated = box.counts().allocated;
  result.freed = box.counts().freed;
  result.refreshed = box.counts().refreshed;
  return result;
}

WFPG_TEST_CASE("field store: any number of threads gives the same bits", "[field_store]") {
  const store_history first = history<Exec>();
  CHECK(first.allocated > 90);
  CHECK(first.freed > 0);
  CHECK(first.refreshed > 50);
  CHECK(first.refused > 0);
  with_threads([&](const std::string& threads) {
    INFO(threads);
    CHECK(history<Exec>() == first);
  });
}

WFPG_TEST_CASE("field store: both forms of casters and any buffer size give the same bits", "[field_store]") {
  const store_history in_place = history<Exec>();
  std::size_t rays = 0;
  for (std::size_t bytes : {std::size_t(0), std::size_t(5 * 64 * 40), std::size_t(1) << 22}) {
    batch_box_caster::log log;
    CHECK(history<Exec>(bytes, &log) == in_place);
    if (bytes == 0) CHECK(log.largest == 64);
    if (bytes == 0) CHECK(log.calls > 90);
    if (bytes > 1000000) CHECK(log.calls <= 2 * 6 * 3);
    if (bytes > 0) CHECK(log.rays == rays);
    rays = log.rays;
  }
}

}  // namespace

#if defined(WFPG_TEST_SEVERAL_POLICIES)
TEST_CASE("field store: policies of one warp width give the same bits", "[field_store]") {
  check_equal_on_backends([] { return history<one_policy>(); });
  check_equal_on_backends([] { return history<basic_chosen<8>>(); });
}
#endif
