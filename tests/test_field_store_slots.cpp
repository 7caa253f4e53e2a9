// Slots of kept fields: who gets one under a budget, when fields are built and with how many cones. Also
// their octree levels, and when slots are freed. test_field_store.cpp tests what fields hold.
// test_field_store_waves.cpp tests limits of a wave.
#include "support/evaluate.hpp"
#include "support/floor_rays.hpp"
#include "support/kept_fields.hpp"
#include "support/octree_nodes.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/guides/octree/field_store.hpp>

#include <algorithm>
#include <set>
#include <vector>

using namespace wfpg_test;
using wfpg::field_store;
using wfpg::guide_view;
using wfpg::kept_field_options;

namespace {

constexpr vec3 up{0, 1, 0}, down{0, -1, 0};

WFPG_TEST_CASE("field store: budgets of 0, less than a slot, one slot, and 1 MiB work", "[field_store]") {
  const auto wave = wall_surfaces(600, 1);
  const std::size_t a_slot = field_store<Exec>::bytes_a_slot(kept_field_options().resolution, false);
  for (std::size_t budget : {std::size_t(0), a_slot - 1, a_slot, 3 * a_slot + 7, std::size_t(1) << 20}) {
    kept_field_options options;
    options.budget_bytes = budget;
    kept_box<Exec> box(options);
    INFO("budget " << budget);
    CHECK(box.counts().capacity == budget / a_slot);
    CHECK(box.store.slot_bytes() <= std::max(budget, std::size_t(32)));
    for (int sample = 0; sample < 3; ++sample) {
      const guide_view view = box.whole_sample(wave);
      CHECK(consistent(box));
      CHECK(guided_otherwise(box, view, wave) == 0);
      const auto last = box.last_wave();
      CHECK(last.with_field == count_guided(box.exec(), view, wave.size()));
      CHECK(last.with_field + last.without_field == wave.size());
      CHECK(last.unbinned == 0);
      const bool everyone = budget > 1000000;
      CHECK(box.counts().live == (everyone ? box.counts().allocated : budget / a_slot));
      CHECK((box.counts().refused > 0) == !everyone);
      if (everyone) CHECK(last.without_field == 0);
    }
  }
}

WFPG_TEST_CASE("field store: a budget is spent on slots only", "[field_store]") {
  for (std::uint32_t resolution : {2u, 16u, 24u, 33u, 128u})
    for (std::size_t slots : {1u, 2u, 3u, 64u, 65u}) {
      for (const bool learns : {false, true}) {
        const kept_box<Exec> box(slots_of(resolution, slots, 4, learns), wfpg::guiding_mode::oriented, 0,
                                 learns ? 100 : 0);
        const std::size_t budget = slots * field_store<Exec>::bytes_a_slot(resolution, learns);
        CHECK(box.counts().capacity == slots);
        CHECK(box.counts().bytes_a_slot * slots == budget);
        CHECK(box.store.slot_bytes() <= budget);
        CHECK(budget / slots >= (learns ? 10 : 8) * resolution * resolution);
        CHECK(box.store.learnt().empty() == !learns);
        CHECK((box.store.value_bytes() >= 800) == learns);
      }
    }
}

WFPG_TEST_CASE("field store: a new field casts all cells, a refresh a part, once a sample", "[field_store]") {
  const struct {
    std::uint32_t resolution, recast;
    std::size_t all, part;
  } cases[] = {{8, 4, 64, 16}, {9, 4, 81, 21}, {5, 8, 25, 4}, {6, 1, 36, 36}, {3, 100, 9, 1}};
  for (const auto& c : cases) {
    INFO("resolution " << c.resolution << ", one in " << c.recast);
    kept_box<Exec> box(slots_of(c.resolution, 100, c.recast));
    const auto wave = floor_rays(7);
    box.begin();
    box.prepare_all(wave);
    CHECK(box.log.take() == 7 * c.all);
    CHECK(box.counts().allocated == 7);
    box.begin();
    CHECK(box.cones(wave) == 7 * c.part);
    CHECK(box.last_wave().part == 7);
    CHECK(box.last_wave().all == 0);
    CHECK(box.cones(wave) == 0);
    CHECK(box.counts().refreshed == 7);
    CHECK(box.store.refresh_cones() == c.part);
  }
}

WFPG_TEST_CASE("field store: fields are refreshed after 1/8 of the samples, later after 1/4",
               "[field_store]") {
  kept_box<Exec> box(slots_of(4, 10));
  const auto wave = rays_at(floor_place(0), up, 50);
  std::uint32_t last_built = 0;
  while (box.sample < 100) {
    box.begin();
    const std::size_t cones = box.cones(wave) + box.cones(wave);
    const std::uint32_t parts = box.sample <= 32 ? 8 : 4;
    const bool wave_builds = box.sample <= 32 || box.sample % 8 == 0 || (box.sample + 1) % 8 == 0;
    const bool due =
        wave_builds && box.sample > last_built && parts * (box.sample - last_built) >= box.sample;
    INFO("sample " << box.sample);
    CHECK(cones == (box.sample == 1 ? 16u : due ? 4u : 0u));
    if (due) last_built = box.sample;
  }
  CHECK(box.counts().refreshed < 30);
}

WFPG_TEST_CASE("field store: after warm-up one wave in eight builds, at every depth", "[field_store]") {
  for (std::uint32_t depth : {0u, 1u, 2u, 3u, 6u}) {
    kept_box<Exec> box(slots_of(4, 40));
    while (box.sample < 40) box.whole_sample(floor_rays(3));
    const auto late = rays_at({0.5f, 1.0f, 0.5f}, down, 9);
    std::uint32_t guided = 0;
    for (int i = 0; i < 8; ++i) {
      box.begin();
      for (std::uint32_t d = 0; d < depth; ++d) box.prepare({});
      const std::size_t cones = box.cones(late);
      guided += cones > 0 ? 1 : 0;
      INFO("depth " << depth << ", sample " << box.sample);
      CHECK(cones == ((box.sample + depth) % 8 == 0 ? 16u : 0u));
      CHECK(box.last_wave().with_field == (guided > 0 ? 9u : 0u));
      box.end();
    }
    CHECK(guided == 1);
    CHECK(consistent(box));
  }
}

WFPG_TEST_CASE("field store: after bin sizes change all waves build for four samples", "[field_store]") {
  kept_box<Exec> box(slots_of(4, 40));
  while (box.sample < 64) box.whole_sample(floor_rays(3));
  for (int i = 0; i < 8; ++i) {
    box.begin();
    for (std::uint32_t wave = 0; wave < 8; ++wave) {
      INFO("sample " << box.sample << ", wave " << wave);
      CHECK(box.store.builds_in_wave() == (box.sample <= 68 || (box.sample + wave) % 8 == 0));
      box.prepare({});
    }
    box.end();
  }
}

WFPG_TEST_CASE("field store: waves that do not build find fields, and each counts its own rays",
               "[field_store]") {
  kept_box<Exec> box(slots_of(4, 40));
  auto wave = floor_rays(3);
  wave.push_back(make_surface({9.0f, 9.0f, 9.0f}, up, up));
  while (box.sample < 41) box.whole_sample(wave);
  int found = 0, built = 0;
  for (int sample = 0; sample < 6; ++sample) {
    box.begin();
    for (int i = 0; i < 5; ++i) {
      INFO("sample " << box.sample << ", wave " << i);
      const bool builds = box.store.builds_in_wave(), is_empty = i == 2;
      const auto rays = is_empty ? std::vector<test_surface>() : wave;
      const guide_view view = builds ? box.prepare(rays) : guide_view();
      const auto numbers = builds ? evaluate(box.exec(), rays.size(),
                                             [=] WFPG_HD(std::size_t ray) {
                                               return view.number(static_cast<std::uint32_t>(ray));
                                             })
                                  : box.find(rays);
      (builds ? built : found) += is_empty ? 0 : 1;
      const auto counts = box.last_wave();
      CHECK(counts.with_field == (is_empty ? 0 : 3));
      CHECK(counts.without_field == 0);
      CHECK(counts.unbinned == (is_empty ? 0 : 1));
      CHECK(counts.builds <= 3);
      if (is_empty) continue;
      CHECK(numbers[3] == wfpg::no_field);
      for (int ray = 0; ray < 3; ++ray) CHECK(numbers[ray] < 40);
      CHECK(std::set<std::uint32_t>(numbers.begin(), numbers.end()).size() == 4);
    }
    box.end();
  }
  CHECK(found > 15);
  CHECK(built > 1);
}

WFPG_TEST_CASE("field store: find() returns no field that is not built", "[field_store]") {
  kept_box<Exec> box(slots_of(4, 40));
  box.begin();
  CHECK(box.store.builds_in_wave());
  CHECK(box.find(floor_rays(3)) == std::vector<std::uint32_t>(3, wfpg::no_field));
  CHECK(box.last_wave().without_field == 3);
  CHECK(box.cones(floor_rays(3)) == 3 * 16);
  CHECK(box.last_wave().with_field == 3);
}

WFPG_TEST_CASE("field store: fields invalidated after warm-up are cast in the next wave", "[field_store]") {
  kept_box<Exec> box(slots_of(4, 40));
  while (box.sample < 41) box.whole_sample(floor_rays(3));
  for (int i = 0; i < 5; ++i) {
    box.store.invalidate_all(box.exec());
    box.begin();
    CHECK(box.cones(floor_rays(3)) == 3 * 16);
    CHECK(box.cones(floor_rays(3)) == 0);
    box.end();
  }
}

WFPG_TEST_CASE("field store: idle slots are freed and used again", "[field_store]") {
  for (std::uint32_t idle : {1u, 2u, 5u}) {
    kept_field_options options = slots_of(4, 12);
    options.idle_samples = idle;
    kept_box<Exec> box(options);
    box.whole_sample(floor_rays(12));
    CHECK(box.counts().live == 12);
    for (std::uint32_t i = 0; i < idle; ++i) {
      box.whole_sample(floor_rays(4));
      CHECK(box.counts().freed == 0);
    }
    box.begin();
    CHECK(box.counts().freed == 8);
    CHECK(box.counts().live == 4);
    CHECK(consistent(box));
    box.log.take();
    const auto wave = floor_rays(12);
    CHECK(count_guided(box.exec(), box.prepare_all(wave), 12) == 12);
    CHECK(box.log.take() == 8 * 16 + 4 * 4);
    CHECK(box.counts().allocated == 20);
    CHECK(box.counts().live == 12);
    CHECK(box.counts().refused == 0);
    CHECK(consistent(box));
  }
}

WFPG_TEST_CASE("field store: after refusals slots are freed after one idle sample", "[field_store]") {
  kept_box<Exec> box(slots_of(4, 5));
  box.whole_sample(floor_rays(5));
  CHECK(box.counts().refused == 0);
  const std::vector<test_surface> other = rays_at({0.5f, 1.0f, 0.5f}, down, 9);
  box.begin();
  const guide_view view = box.prepare(other);
  CHECK(count_guided(box.exec(), view, 9) == 0);
  CHECK(guided_otherwise(box, view, other) == 0);
  CHECK(box.counts().refused == 1);
  box.begin();
  CHECK(box.counts().refused == 0);
  CHECK(box.counts().freed == 5);
  CHECK(count_guided(box.exec(), box.prepare(other), 9) == 9);
  CHECK(box.counts().live == 1);
  CHECK(consistent(box));
}

WFPG_TEST_CASE("field store: crowded places get finer fields; ancestors guide until there is room",
               "[field_store]") {
  kept_box<Exec> box(slots_of(4, 8));
  const auto crowd = rays_at(floor_place(0), up, 500);
  auto wave = floor_rays(8);
  wave.insert(wave.end(), crowd.begin(), crowd.end());
  box.whole_sample(wave);
  CHECK(box.counts().live == 8);
  box.begin();
  box.log.take();
  const guide_view coarse = box.prepare(crowd);
  CHECK(count_guided(box.exec(), coarse, crowd.size()) == crowd.size());
  CHECK(box.log.take() == 4);  // the ancestor's refresh
  CHECK(box.counts().refused == 1);
  CHECK(box.counts().live == 8);
  box.end();
  box.begin();
  CHECK(box.counts().freed == 7);
  CHECK(box.cones(crowd) == 16);
  CHECK(box.counts().live == 2);
}

/// A sample of waves from all walls, denser toward a corner. No two nodes get equally many rays.
template <class Exec>
void sample_of_waves(kept_box<Exec>& box, std::uint64_t waves) {
  box.begin();
  for (std::uint64_t wave = 0; wave < waves; ++wave) {
    const std::uint64_t seed = 100 * box.sample + wave;
    random_numbers random(seed);
    std::vector<test_surface> rays;
    for (const test_surface& s : wall_surfaces(4000, seed))
      if (rays.size() < kept_box<Exec>::max_rays && random.unit() < 0.1f / (0.1f + glm::length(s.position)))
        rays.push_back(s);
    box.prepare(rays);
  }
  box.end();
}

WFPG_TEST_CASE("field store: bins shrink to fill the slots, and stay after fields have learnt",
               "[field_store]") {
  for (const std::size_t slots : {110u, 180u}) {
    kept_box<Exec> box(slots_of(4, slots));
    INFO(slots << " slots");
    while (box.sample < 16) sample_of_waves(box, 8);
    const std::uint32_t converged = box.state().pressure;
    while (box.sample < 33) sample_of_waves(box, 2);
    const double live = box.counts().live / static_cast<double>(slots);
    CHECK(live > 0.8);
    CHECK(live <= 1.0);
    CHECK(box.state().pressure == converged);
  }
}

TEST_CASE("field store: next_pressure() scales bin sizes to the slots in use", "[field_store]") {
  using constants = wfpg::build_schedule_constants;
  const auto next = [](std::uint32_t sample, std::uint32_t slots, std::uint32_t used, std::uint32_t refused,
                       std::uint32_t pressure) {
    return wfpg::build_schedule::next_pressure(pressure, used + refused, slots, sample, refused > 0);
  };
  CHECK(next(8, 800, 700, 0, 128) == 128);  // an eighth is free
  CHECK(next(2, 800, 525, 0, 128) == 96);
  CHECK(next(8, 800, 800, 75, 128) == 160);
  CHECK(next(4, 800, 100, 0, 128) == 64);
  CHECK(next(4, 800, 800, 5000, 128) == 256);
  CHECK(next(16, 800, 100, 0, 128) == 128);  // fields have learnt
  CHECK(next(16, 800, 800, 75, 128) == 160);
  CHECK(next(256, 800, 800, 5000, 128) == 256);
  CHECK(next(16, 800, 100, 5, 128) == 128);
  CHECK(next(4, 800, 0, 0, 128) == 128);  // nothing was guided
  CHECK(next(4, 0, 0, 9, 128) == 256);
  CHECK(next(4, 800, 1, 0, constants::least_pressure) == constants::least_pressure);
  CHECK(next(64, 800, 800, 1, constants::largest_pressure) == constants::largest_pressure);
}

WFPG_TEST_CASE("field store: levels are chosen after samples 1, 2, 4, 8, ...", "[field_store]") {
  kept_box<Exec> box(slots_of(4, 100));
  const auto few = rays_at(floor_place(0), up, 2), many = rays_at(floor_place(0), up, 1000);
  std::set<std::uint32_t> finer_in;
  std::uint64_t allocated = 0;
  while (box.sample < 20) {
    box.whole_sample(box.sample + 1 == 5 ? many : few);
    if (box.counts().allocated > allocated) finer_in.insert(box.sample);
    allocated = box.counts().allocated;
  }
  CHECK(finer_in == std::set<std::uint32_t>{1, 9});
}

/// Counts the rays of leaves.
struct count_at {
  wfpg::detail::bin_marks_view marks;
  wfpg::array_view<const wfpg::node_id> leaves;
  WFPG_HD void operator()(std::size_t i) const { marks.count(leaves[i], 1); }
};

/// The deepest ancestor with at least `enough` rays. Never above the least level.
wfpg::node_id bin_by_hand(const std::vector<node_record>& nodes, const std::vector<wfpg::node_id>& rays,
                          wfpg::node_id leaf, std::uint32_t min_level, std::size_t enough) {
  for (std::uint32_t level = nodes[leaf].level; level > min_level; --level) {
    const wfpg::node_id node = nodes[leaf].ancestor[level];
    const auto inside = std::count_if(rays.begin(), rays.end(),
                                      [&](wfpg::node_id ray) { return nodes[ray].ancestor[level] == node; });
    if (std::size_t(inside) >= enough) return node;
  }
  return nodes[leaf].ancestor[min_level];
}

struct bin_of_leaf {
  wfpg::detail::bin_marks_view marks;
  wfpg::node_id first_leaf;
  WFPG_HD wfpg::node_id operator()(std::size_t i) const {
    return marks.bin(first_leaf + static_cast<wfpg::node_id>(i));
  }
};

WFPG_TEST_CASE("field store: bins are the deepest nodes with enough rays, limited by the slots",
               "[field_store]") {
  const lit_box<Exec> box(patch_light, 16);
  const wfpg::sparse_voxel_octree_view tree = box.tree.view();
  random_numbers random(5);
  std::vector<wfpg::node_id> rays;
  for (int i = 0; i < 400; ++i)  // dense in the first leaves, sparse in the last
    rays.push_back(tree.first_leaf() + random.below(1 + random.below(tree.leaf_count())));
  const wfpg::buffer<wfpg::node_id, Exec> leaves(box.exec, rays);
  const wfpg::buffer<std::uint32_t, Exec> pressure(
      box.exec, std::vector<std::uint32_t>{2 * wfpg::detail::mark_threshold::pressure_unit});
  const std::vector<node_record> nodes = nodes_of(box.exec, tree);
  for (std::uint32_t min_level : {0u, 2u, 9u}) {
    const std::uint32_t least = std::min(min_level, tree.depth());
    wfpg::detail::bin_marks<Exec> marks(box.exec, tree, {min_level, 6});
    const auto agree = [&](std::size_t enough) {
      int wrong = 0;
      const auto bins = evaluate(box.exec, tree.leaf_count(), bin_of_leaf{marks.view(), tree.first_leaf()});
      for (std::uint32_t i = 0; i < tree.leaf_count(); i += 3) {
        const wfpg::node_id leaf = tree.first_leaf() + i, bin = bins[i];
        wrong += bin != bin_by_hand(nodes, rays, leaf, least, enough);
        wrong += nodes[bin].level < least || nodes[leaf].ancestor[nodes[bin].level] != bin;
      }
      return wrong == 0;
    };
    CHECK(agree(~std::size_t(0)));
    box.exec.for_each(rays.size(), count_at{marks.view(), const_view<wfpg::node_id>(leaves)});
    marks.mark(box.exec, 1, 100000, pressure.data());
    CHECK(agree(3));
    marks.mark(box.exec, 4, 100000, pressure.data());
    CHECK(agree(12));
    marks.mark(box.exec, 1, 40, pressure.data());
    CHECK(agree(400 * 2 / 40));
    CHECK(marks.bytes() == 4 * (tree.node_count() + tree.leaf_count()));
  }
}

WFPG_TEST_CASE("field store: thresholds of thousands of rays decide exactly which leaf is a bin",
               "[field_store]") {
  const lit_box<Exec> box(patch_light, 16);
  const wfpg::sparse_voxel_octree_view tree = box.tree.view();
  const wfpg::node_id crowded = tree.first_leaf(), other = tree.node_count() - 1;
  const wfpg::buffer<std::uint32_t, Exec> pressure(box.exec, std::vector<std::uint32_t>{1});
  for (const std::uint32_t enough : {4096u, 10000u, 65536u, 70000u}) {
    std::vector<wfpg::node_id> rays(70000, crowded);
    rays.resize(70000 + enough - 1, other);
    const wfpg::buffer<wfpg::node_id, Exec> leaves(box.exec, rays);
    wfpg::detail::bin_marks<Exec> marks(box.exec, tree, {1, 2 * enough});
    box.exec.for_each(rays.size(), count_at{marks.view(), const_view<wfpg::node_id>(leaves)});
    marks.mark(box.exec, 1, 100000, pressure.data());
    const auto bins = evaluate(box.exec, tree.leaf_count(), bin_of_leaf{marks.view(), tree.first_leaf()});
    INFO(enough << " rays are enough");
    CHECK(bins.front() == crowded);
    CHECK(tree.level_of(bins.back()) == 1);
  }
}

}  // namespace
