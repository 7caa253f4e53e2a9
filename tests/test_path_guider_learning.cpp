// A guider's fields in a renderer. Tests where cones start, which field learns from a direction, and that
// unguided rays count for bins.
#include "support/evaluate.hpp"
#include "support/guiding.hpp"
#include "support/kept_fields.hpp"
#include "support/kinds_of_guiding.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/path_guider.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::guiding_mode;
using wfpg::sampled_direction;
using wfpg::sampling_technique;

namespace {

/// Batch caster that returns the box's hits and logs all cones.
struct batch_noting_caster {
  std::vector<wfpg::ray>* cones;

  template <class Exec>
  void cast(const Exec& exec, wfpg::array_view<const wfpg::ray> rays,
            wfpg::array_view<wfpg::ray_hit> hits) const {
    const std::vector<wfpg::ray> host = to_host(exec, rays);
    cones->insert(cones->end(), host.begin(), host.end());
    exec.for_each(rays.size(), [=] WFPG_HD(std::size_t i) { hits[i] = box_caster()(rays[i]); });
  }
};

/// A ray's surface, and the side on which its cones must start.
struct surface_and_side {
  test_surface surface;
  vec3 off;
};

/// Surfaces on the floor and on a wall, seen from either side. Some have another shading normal, some no
/// geometric normal.
std::vector<surface_and_side> surfaces_to_leave() {
  const vec3 shading = glm::normalize(vec3(0.3f, 1.0f, 0.2f));
  const vec3 floor_up(0, 1, 0), wall(-1, 0, 0);
  std::vector<surface_and_side> all{{make_surface({0.4f, 0, 0.7f}, floor_up, floor_up), floor_up},
                                    {make_surface({0.01f, 0, 0.02f}, floor_up, floor_up), floor_up},
                                    {make_surface({0.4f, 0, 0.7f}, floor_up, -floor_up), -floor_up},
                                    {make_surface({1, 0.3f, 0.6f}, wall, wall), wall}};
  test_surface s = make_surface({0.6f, 0, 0.2f}, shading, floor_up);
  s.geometric_normal = floor_up;
  all.push_back({s, floor_up});
  s.geometric_normal = vec3(std::numeric_limits<float>::quiet_NaN());
  all.push_back({s, shading});
  return all;
}

/// Counts cones that do not start off the surface by 1/1000 of a voxel or 1/10,000 of its coordinates.
std::size_t started_elsewhere(const std::vector<wfpg::ray>& cones, const surface_and_side& from,
                              float voxel) {
  const vec3 p = glm::abs(from.surface.position);
  const float off = std::max(1.0e-3f * voxel, 1.0e-4f * std::max({p.x, p.y, p.z}));
  const vec3 origin = from.surface.position + off * from.off;
  std::size_t n = 0;
  for (const wfpg::ray& cone : cones) n += !(glm::distance(cone.origin, origin) < 0.01f * off);
  return n;
}

WFPG_TEST_CASE("path guider: cones start off the surface, on the side that it is seen from",
               "[path_guider]") {
  for (const guider_options& options : kinds_of_guiding())
    for (const surface_and_side& from : surfaces_to_leave()) {
      INFO(describe(options) << ", surface at " << from.surface.position.x << ", " << from.surface.position.y
                             << ", " << from.surface.position.z);
      guided_box<Exec> inlined(options), batched(options);
      const float voxel = inlined.guider.guide().octree().view().grid().voxel_size();
      cone_log<Exec> log(inlined.exec, 2000);
      std::vector<wfpg::ray> batch;
      const std::vector<test_surface> wave(5, from.surface);
      for (int sample = 0; sample < 2; ++sample) {  // the second refreshes kept fields
        inlined.guider.begin_sample();
        inlined.sample(wave, log.caster());
        batched.guider.begin_sample();
        batched.sample(wave, batch_noting_caster{&batch});
      }
      const std::vector<wfpg::ray> cones = log.cones();
      CHECK(cones.size() == log.count());
      CHECK(cones.size() > 256);
      CHECK(batch.size() == cones.size());
      CHECK(started_elsewhere(cones, from, voxel) == 0);
      CHECK(started_elsewhere(batch, from, voxel) == 0);
    }
}

/// How a renderer samples a direction.
enum class drawn_by : std::uint32_t {
  sample_directions,  ///< the guider samples a wave
  view,               ///< a kernel samples from the view, with its surface
  field               ///< a kernel samples from the field alone
};

struct draw_from_view {
  wfpg::guide_view view;
  stored_surfaces surfaces;
  hashed_numbers random;
  drawn_by form;
  wfpg::array_view<sampled_direction> directions;
  WFPG_HD void operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    if (form == drawn_by::view)
      directions[i] = view.sample(ray, surfaces(ray), random(ray, 0).x, random(ray, 1));
    else if (view.guides(ray))
      directions[i] = view.sample(ray, random(ray, 1));
  }
};

/// The environment lights the floor from x > 0, and the ceiling from x < 0.
WFPG_HD bool is_lit(const test_surface& s, vec3 direction) {
  return (direction.x > 0.0f) == (s.normal.y > 0.0f);
}

/// Paths that leave the scene at once. Records those that `technique` sampled.
struct record_paths {
  wfpg::path_recorder_view recorder;
  stored_surfaces surfaces;
  wfpg::array_view<const sampled_direction> directions;
  sampling_technique technique;
  WFPG_HD void operator()(std::size_t path) const {
    const test_surface s = surfaces(static_cast<std::uint32_t>(path));
    const sampled_direction& d = directions[path];
    if (d.technique != technique) return;
    recorder.vertex(path, 0, s.position, s.outgoing, vec3(1.0f));
    recorder.scatter(path, 0, d);
    recorder.escape(path, 1, vec3(1.0f));
    recorder.emission(path, 1, vec3(is_lit(s, d.direction) ? 1.0f : 0.0f));
  }
};

/// Whether a direction of a ray's field is lit, for `count` rays in turn.
struct is_draw_lit {
  wfpg::guide_view view;
  stored_surfaces surfaces;
  std::uint32_t rays;
  WFPG_HD bool operator()(std::size_t i) const {
    const std::uint32_t ray = static_cast<std::uint32_t>(i) % rays;
    return view.guides(ray) && is_lit(surfaces(ray), view.mixture(ray).field.sample(hashed_numbers{9}(
                                                         static_cast<std::uint32_t>(i), 0)));
  }
};

/// The lit fraction of the fields' directions after eight samples. Each sample records the directions that
/// `technique` sampled.
template <class Exec>
double lit_fraction(std::uint32_t products, drawn_by form, sampling_technique technique) {
  constexpr std::size_t rays = 1000;
  guider_options options = box_options();
  options.product_resolution = unless_zero(products);
  options.max_paths = rays;
  options.max_rays = rays;
  options.max_depth = 2;
  options.deposit_capacity.reset();
  options.deposits_per_leaf.reset();  // all paths are recorded
  options.binning.min_level = 5;      // one field per place from the beginning
  guided_box<Exec> box(options);
  std::vector<test_surface> surfaces;
  for (std::size_t i = 0; i < rays; ++i) {
    const float y = float(i % 2);
    const vec3 normal(0.0f, 1.0f - 2.0f * y, 0.0f);
    surfaces.push_back(make_surface({0.4f, y, 0.3f}, normal, normal));
  }
  const wave_of_surfaces<Exec> wave(box.exec, surfaces);
  const stored_surfaces stored = wave.get().surfaces;
  const wfpg::buffer<sampled_direction, Exec> drawn(box.exec, rays);
  for (std::uint32_t sample = 0; sample < 8; ++sample) {
    box.guider.begin_sample();
    for (int again = 0; again < 2; ++again) box.guider.prepare(wave.get(), box_caster{});
    const hashed_numbers random{100 + sample};
    if (form == drawn_by::sample_directions) {
      box.guider.sample_directions(wfpg::wave{0, rays, stored, random}, box_caster{}, drawn.view());
    } else {
      const wfpg::guide_view view = box.guider.prepare(wave.get(), box_caster{});
      box.exec.fill_bytes(drawn.data(), 0, drawn.bytes());
      box.exec.for_each(rays, draw_from_view{view, stored, random, form, drawn.view()});
    }
    box.exec.for_each(rays, record_paths{box.guider.recorder(), stored, drawn.view(), technique});
    box.guider.end_sample();
  }
  CHECK(box.guider.statistics().dropped_vertices == 0);
  box.guider.begin_sample();
  const wfpg::guide_view view = box.guider.prepare(wave.get(), box_caster{});
  constexpr std::size_t draws = 4000;
  return double(count_where(box.exec, draws, is_draw_lit{view, stored, rays})) / draws;
}

WFPG_TEST_CASE("path guider: a field learns from a direction whatever sampled it", "[path_guider]") {
  for (const std::uint32_t products : {0u, 4u})
    for (const drawn_by form : {drawn_by::sample_directions, drawn_by::view, drawn_by::field})
      for (const sampling_technique technique : {sampling_technique::guide, sampling_technique::bsdf}) {
        if (form == drawn_by::field && technique == sampling_technique::bsdf) continue;
        INFO("products " << products << ", form " << int(form) << ", technique " << int(technique));
        CHECK(lit_fraction<Exec>(products, form, technique) > 0.8);
      }
  // Without recorded directions, both sides are equal.
  CHECK(lit_fraction<Exec>(0, drawn_by::view, sampling_technique::none) == Approx(0.5).margin(0.05));
}

/// Twenty places on the floor with 40 rays each, and ten on the ceiling with one.
std::vector<test_surface> crowds_and_loners() {
  std::vector<test_surface> surfaces;
  for (int i = 0; i < 800; ++i)
    surfaces.push_back(make_surface({0.11f + 0.19f * float(i % 5), 0, 0.11f + 0.23f * float(i % 20 / 5)},
                                    {0, 1, 0}, {0, 1, 0}));
  for (int i = 0; i < 10; ++i)
    surfaces.push_back(make_surface({0.05f + 0.09f * float(i), 1, 0.4f}, {0, -1, 0}, {0, -1, 0}));
  return surfaces;
}

/// The expected key of a ray's field: its leaf's if many rays are there. Otherwise that of the largest node
/// that can be a bin.
struct key_of_ray {
  wfpg::sparse_voxel_octree_view tree;
  wfpg::array_view<const test_surface> surfaces;
  WFPG_HD std::uint32_t operator()(std::size_t i) const {
    const test_surface& s = surfaces[i];
    const wfpg::node_id leaf = tree.nearest_leaf(s.position);
    const wfpg::node_id node = i < 800 ? leaf : tree.ancestor(leaf, 2);
    return node * wfpg::orientations + wfpg::dominant_axis(s.normal);
  }
};

/// The number of fields.
template <class Exec>
std::set<std::uint32_t> live_keys(const guided_box<Exec>& box) {
  std::set<std::uint32_t> keys;
  for (const std::uint32_t key : box.guider.guide().field_keys(box.exec))
    if (key != 0xffffffffu) keys.insert(key);
  return keys;
}

WFPG_TEST_CASE("path guider: unguided rays count when bins are chosen", "[path_guider]") {
  const auto surfaces = crowds_and_loners();
  for (const bool fused : {false, true}) {
    guider_options options = box_options();
    options.unguided_samples = 1;
    guided_box<Exec> box(options);
    const wfpg::buffer<test_surface, Exec> stored(box.exec, surfaces);
    const auto keys =
        evaluate(box.exec, surfaces.size(),
                 key_of_ray{box.guider.guide().octree().view(), const_view<test_surface>(stored)});
    const std::set<std::uint32_t> expected(keys.begin(), keys.end());
    REQUIRE(expected.size() > 20);
    const wave_of_surfaces<Exec> wave(box.exec, surfaces);
    box.guider.begin_sample();
    REQUIRE(!box.guider.guided());
    if (fused)
      CHECK(count_guided(box.sample(surfaces)) == 0);
    else
      CHECK(count_guided(box.exec, box.guider.prepare(wave.get(), box_caster{}), surfaces.size()) == 0);
    box.guider.end_sample();
    CHECK(live_keys(box).empty());
    box.guider.begin_sample();
    box.sample_again(surfaces);
    INFO("fused " << fused);
    CHECK(live_keys(box) == expected);
  }
}

WFPG_TEST_CASE("path guider: rays without a field count when bins are chosen", "[path_guider]") {
  const auto surfaces = crowds_and_loners();
  guider_options options = box_options();
  options.kept.max_wave_cones = 256;  // one new field per wave
  guided_box<Exec> box(options);
  const wfpg::buffer<test_surface, Exec> stored(box.exec, surfaces);
  const auto keys =
      evaluate(box.exec, surfaces.size(),
               key_of_ray{box.guider.guide().octree().view(), const_view<test_surface>(stored)});
  box.guider.begin_sample();
  box.sample(surfaces);
  const wfpg::guider_statistics first = box.guider.statistics();
  CHECK(first.kept.live == 1);
  CHECK(first.depths[0].unbinned > 300);  // rays without a field
  box.guider.end_sample();
  box.guider.begin_sample();
  for (int wave = 0; wave < 40; ++wave) box.sample(surfaces);
  std::set<std::uint32_t> missing(keys.begin(), keys.end());
  for (const std::uint32_t key : live_keys(box)) missing.erase(key);
  CHECK(missing.empty());
}

WFPG_TEST_CASE("path guider: fields learn their fractions, unless an option pins them", "[path_guider]") {
  const Exec exec;
  const float pinned = wfpg::resident_field(wfpg::vec3(0.0f), 0.7f).fraction();
  for (const bool pins : {false, true}) {
    wfpg::kept_guide_options options;
    options.octree_resolution = 8;
    options.kept.resolution = 4;
    options.max_paths = 600;
    options.max_depth = 3;
    options.binning.min_level = 1;
    if (pins) options.guide_fraction = 0.7f;
    wfpg::path_guider<Exec> guider(exec, box_mesh<Exec>(exec).view(), options);
    const auto surfaces = wall_surfaces(200, 3);
    const wave_of_surfaces<Exec> wave(exec, surfaces);
    const auto count = [&] {
      guider.begin_sample();
      const auto view = guider.prepare(wave.get(), box_caster());
      std::size_t learnt = 0, other = 0;
      for (const float fraction : evaluate(exec, surfaces.size(), fraction_of_ray{view})) {
        learnt += fraction > 0.0f && fraction != pinned;
        other += fraction == pinned;
      }
      guider.end_sample();
      return std::pair<std::size_t, std::size_t>(learnt, other);
    };
    trace_paths(exec, guider, 6, 600, box_caster());
    const auto [learnt, other] = count();
    CHECK((pins ? other : learnt) > 100);
    if (pins) CHECK(learnt == 0);
    // What moved may be lit otherwise.
    guider.invalidate_all();
    const auto [after, begun] = count();
    CHECK(after == 0);
    CHECK(begun > 100);
  }
}

}  // namespace
