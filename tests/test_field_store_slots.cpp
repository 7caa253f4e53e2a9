// Kept fields' slots: who gets one under a budget, when fields are built and with how many cones, at which
// level of the octree they are, when they are freed or cast anew, and what is refused. What fields hold is
// test_field_store.cpp's.
#include "support/evaluate.hpp"
#include "support/kept_fields.hpp"
#include "support/octree_nodes.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/field_store.hpp>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::field_store;
using wfpg::guide_view;
using wfpg::kept_field_options;

namespace {

constexpr vec3 up{0, 1, 0}, down{0, -1, 0};

/// A point of one of the floor's 16 nodes of level 2, away from its rims.
vec3 floor_place(std::uint32_t node) {
  return {0.1f + 0.26f * float(node % 4), 0.0f, 0.1f + 0.26f * float(node / 4)};
}

/// A ray at each of the first `n` places.
std::vector<test_surface> floor_rays(std::uint32_t n) {
  std::vector<test_surface> wave;
  for (std::uint32_t i = 0; i < n; ++i) wave.push_back(make_surface(floor_place(i), up, up));
  return wave;
}

template <class Exec>
bool consistent(const kept_box<Exec>& box) {
  const auto counts = box.counts();
  const auto state = box.state();
  return counts.live <= counts.capacity && counts.born - counts.freed == counts.live &&
         counts.live + state.free - state.taken == counts.capacity;
}

struct is_guided_otherwise {
  guide_view view;
  wfpg::array_view<const test_surface> wave;
  WFPG_HD bool operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    if (view.guides(ray)) return false;
    const test_surface& s = wave[i];
    const auto drawn = view.sample(ray, s, 0.1f, {0.3f, 0.6f});
    return drawn.technique != wfpg::sampling_technique::bsdf ||
           !alike(drawn.pdf, s.bsdf.pdf(s.outgoing, drawn.direction)) ||
           !alike(view.pdf(ray, s, s.normal), s.bsdf.pdf(s.outgoing, s.normal));
  }
};

/// Rays without a field are their BSDF's alone.
template <class Exec>
std::size_t guided_otherwise(const kept_box<Exec>& box, const guide_view& view,
                             const std::vector<test_surface>& wave) {
  const wfpg::buffer<test_surface, Exec> device(box.exec(), wave);
  return count_where(box.exec(), wave.size(), is_guided_otherwise{view, const_view<test_surface>(device)});
}

WFPG_TEST_CASE("field store: budgets of nothing, less than a slot, one slot, and 1 MiB", "[field_store]") {
  const auto wave = wall_surfaces(600, 1);
  const std::size_t a_slot = field_store<Exec>::bytes_a_slot(24, false);
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
      CHECK(last.served == count_guided(box.exec(), view, wave.size()));
      CHECK(last.served + last.unserved == wave.size());
      CHECK(last.unbinned == 0);
      const bool everyone = budget > 1000000;
      CHECK(box.counts().live == (everyone ? box.counts().born : budget / a_slot));
      CHECK((box.counts().refused > 0) == !everyone);
      if (everyone) CHECK(last.unserved == 0);
    }
  }
}

WFPG_TEST_CASE("field store: a budget is spent on its slots and on nothing else", "[field_store]") {
  for (std::uint32_t resolution : {2u, 16u, 24u, 33u, 128u})
    for (std::size_t slots : {1u, 2u, 3u, 64u, 65u}) {
      for (const bool learns : {false, true}) {
        const kept_box<Exec> box(slots_of(resolution, slots, 4, learns), wfpg::guiding_mode::oriented, 0,
                                 learns ? 100 : 0);
        const std::size_t budget = slots * field_store<Exec>::bytes_a_slot(resolution, learns);
        CHECK(box.counts().capacity == slots);
        CHECK(box.counts().bytes_a_slot * slots == budget);
        CHECK(box.store.slot_bytes() <= budget);
        CHECK(budget / slots >= (learns ? 12 : 8) * resolution * resolution);
        CHECK(box.store.learnt().empty() == !learns);
        CHECK((box.store.value_bytes() >= 800) == learns);
      }
    }
}

WFPG_TEST_CASE("field store: births cast all cells, refreshes one in so many, once a sample",
               "[field_store]") {
  const struct {
    std::uint32_t resolution, recast;
    std::size_t all, part;
  } cases[] = {{8, 4, 64, 16}, {9, 4, 81, 21}, {5, 8, 25, 4}, {6, 1, 36, 36}, {3, 100, 9, 1}};
  for (const auto& c : cases) {
    INFO("resolution " << c.resolution << ", one in " << c.recast);
    kept_box<Exec> box(slots_of(c.resolution, 100, c.recast));
    const auto wave = floor_rays(7);
    box.begin();
    box.settle(wave);
    CHECK(box.log.take() == 7 * c.all);
    CHECK(box.counts().born == 7);
    box.begin();
    CHECK(box.cones(wave) == 7 * c.part);
    CHECK(box.last_wave().part == 7);
    CHECK(box.last_wave().all == 0);
    CHECK(box.cones(wave) == 0);
    CHECK(box.counts().refreshed == 7);
    CHECK(box.store.refresh_cones() == c.part);
  }
}

WFPG_TEST_CASE(
    "field store: fields are refreshed when an eighth of the samples has passed, or a quarter of many",
    "[field_store]") {
  kept_box<Exec> box(slots_of(4, 10));
  const auto wave = rays_at(floor_place(0), up, 50);
  std::uint32_t last_built = 0;
  while (box.sample < 100) {
    box.begin();
    const std::size_t cones = box.cones(wave) + box.cones(wave);
    const std::uint32_t parts = box.sample <= 32 ? 8 : 4;
    const bool has_turn = box.sample <= 32 || box.sample % 4 == 0 || (box.sample + 1) % 4 == 0;
    const bool due = has_turn && box.sample > last_built && parts * (box.sample - last_built) >= box.sample;
    INFO("sample " << box.sample);
    CHECK(cones == (box.sample == 1 ? 16u : due ? 4u : 0u));
    if (due) last_built = box.sample;
  }
  CHECK(box.counts().refreshed < 30);
}

WFPG_TEST_CASE("field store: after many samples one wave in four builds, whatever its depth",
               "[field_store]") {
  for (std::uint32_t depth : {0u, 1u, 2u, 3u, 6u}) {
    kept_box<Exec> box(slots_of(4, 40));
    while (box.sample < 36) box.whole_sample(floor_rays(3));
    const auto late = rays_at({0.5f, 1.0f, 0.5f}, down, 9);
    std::uint32_t guided = 0;
    for (int i = 0; i < 4; ++i) {
      box.begin();
      for (std::uint32_t d = 0; d < depth; ++d) box.prepare({});
      const std::size_t cones = box.cones(late);
      guided += cones > 0 ? 1 : 0;
      INFO("depth " << depth << ", sample " << box.sample);
      CHECK(cones == ((box.sample + depth) % 4 == 0 ? 16u : 0u));
      CHECK(box.last_wave().served == (guided > 0 ? 9u : 0u));
      box.end();
    }
    CHECK(guided == 1);
    CHECK(consistent(box));
  }
}

WFPG_TEST_CASE("field store: what is invalidated after many samples is cast in the next wave",
               "[field_store]") {
  kept_box<Exec> box(slots_of(4, 40));
  while (box.sample < 37) box.whole_sample(floor_rays(3));
  for (int i = 0; i < 5; ++i) {
    box.store.invalidate_all(box.exec());
    box.begin();
    CHECK(box.cones(floor_rays(3)) == 3 * 16);
    CHECK(box.cones(floor_rays(3)) == 0);
    box.end();
  }
}

WFPG_TEST_CASE("field store: slots unused for some samples are freed and used again", "[field_store]") {
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
    CHECK(count_guided(box.exec(), box.settle(wave), 12) == 12);
    CHECK(box.log.take() == 8 * 16 + 4 * 4);
    CHECK(box.counts().born == 20);
    CHECK(box.counts().live == 12);
    CHECK(box.counts().refused == 0);
    CHECK(consistent(box));
  }
}

WFPG_TEST_CASE("field store: with refusals slots are freed after one idle sample", "[field_store]") {
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

WFPG_TEST_CASE(
    "field store: many rays at one place make finer fields, which ancestors serve for until there "
    "is room",
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

WFPG_TEST_CASE("field store: levels are chosen anew after samples 1, 2, 4, 8, ...", "[field_store]") {
  kept_box<Exec> box(slots_of(4, 100));
  const auto few = rays_at(floor_place(0), up, 2), many = rays_at(floor_place(0), up, 1000);
  std::set<std::uint32_t> finer_in;
  std::uint64_t born = 0;
  while (box.sample < 20) {
    box.whole_sample(box.sample + 1 == 5 ? many : few);
    if (box.counts().born > born) finer_in.insert(box.sample);
    born = box.counts().born;
  }
  CHECK(finer_in == std::set<std::uint32_t>{1, 9});
}

/// Counts the rays of leaves.
struct count_at {
  wfpg::detail::bin_marks_view marks;
  wfpg::array_view<const wfpg::node_id> leaves;
  WFPG_HD void operator()(std::size_t i) const { marks.count(leaves[i], 1); }
};

/// The deepest ancestor of enough rays, or that of the least level. Half of c_ray a sample is enough.
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

WFPG_TEST_CASE(
    "field store: bins are the deepest nodes with enough rays a sample, or as many as there is room",
    "[field_store]") {
  const lit_box<Exec> box(patch_light, 16);
  const wfpg::sparse_voxel_octree_view tree = box.tree.view();
  random_numbers random(5);
  std::vector<wfpg::node_id> rays;
  for (int i = 0; i < 400; ++i)  // dense at first leaves, sparse at the last ones
    rays.push_back(tree.first_leaf() + random.below(1 + random.below(tree.leaf_count())));
  const wfpg::buffer<wfpg::node_id, Exec> leaves(box.exec, rays);
  const wfpg::buffer<std::uint32_t, Exec> pressure(box.exec, std::vector<std::uint32_t>{2});
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

WFPG_TEST_CASE("field store: a wave casts no more cones than it may, and nobody waits for ever",
               "[field_store]") {
  const auto wave = floor_rays(16);
  for (std::uint64_t most : {0, 15, 16, 35, 64}) {
    kept_field_options options = slots_of(4, 16);
    options.max_wave_cones = most;
    kept_box<Exec> box(options);
    INFO("at most " << most);
    for (std::uint32_t sample = 0; sample < 30; ++sample) {
      box.begin();
      CHECK(box.cones(wave) <= most);
      const guide_view view = box.prepare(wave);
      CHECK(guided_otherwise(box, view, wave) == 0);
      CHECK(consistent(box));
      if (sample == 0) CHECK(box.counts().refused > 0);
    }
    CHECK(box.counts().born == (most < 16 ? 0 : 16));
    CHECK(count_guided(box.exec(), box.prepare(wave), 16) == (most < 16 ? 0 : 16));
    box.store.invalidate_all(box.exec());
    std::size_t recast = 0;
    for (std::uint32_t sample = 0; sample < 40; ++sample) {
      box.begin();
      box.prepare(wave);
      recast += box.last_wave().all;
    }
    CHECK(recast == (most < 16 ? 0 : 16));
  }
}

WFPG_TEST_CASE("field store: a slot used again guides nobody until its own field is built", "[field_store]") {
  const auto first = floor_rays(2);
  const std::vector<test_surface> second{first[1], make_surface({0.6f, 1.0f, 0.6f}, down, down)};
  int waited = 0;
  for (std::uint32_t skipped = 0; skipped < 8; ++skipped) {
    kept_field_options options = slots_of(4, 2);
    options.max_wave_cones = 16;
    options.idle_samples = 1;
    kept_box<Exec> box(options, wfpg::guiding_mode::oriented, 16);
    box.sample = skipped;
    box.begin();
    box.settle(first);
    for (int sample = 0; sample < 3; ++sample) {
      box.begin();
      box.prepare({first[1]});
    }
    CHECK(box.counts().freed == 1);
    box.store.invalidate_all(box.exec());
    box.begin();
    box.log.take();
    const guide_view view = box.prepare(second);  // both are to be cast whole, and one has to wait
    const bool built = box.log.cones().at(0).origin.y > 0.5f;
    CHECK(box.log.count() == 16);
    CHECK(guides(box.exec(), view, 0));
    CHECK(guides(box.exec(), view, 1) == built);
    CHECK(guided_otherwise(box, view, second) == 0);
    waited += !built;
  }
  CHECK(waited > 0);
}

WFPG_TEST_CASE("field store: a limit on cones is shared evenly, however large the budget", "[field_store]") {
  const auto wave = floor_rays(16);
  kept_field_options options = slots_of(4, 2000);
  options.max_wave_cones = 16;  // a birth, or 4 refreshes
  kept_box<Exec> box(options, wfpg::guiding_mode::oriented, 16);
  box.begin();
  while (count_guided(box.exec(), box.prepare(wave), 16) < 16) {
  }
  std::vector<int> cones(16, 0);
  for (int sample = 0; sample < 14; ++sample) {  // every field is due in each of them
    box.begin();
    CHECK(box.cones(wave) == 16);
    for (const wfpg::ray& cone : box.log.cones(16))
      for (std::uint32_t i = 0; i < 16; ++i) cones[i] += glm::distance(cone.origin, floor_place(i)) < 0.1f;
  }
  const auto [least, most] = std::minmax_element(cones.begin(), cones.end());
  INFO("least " << *least << ", most " << *most);
  CHECK(*least >= 4);
  CHECK(*most < 14 * 4);
}

WFPG_TEST_CASE("field store: a limit on cones leaves levels alone", "[field_store]") {
  kept_field_options options = slots_of(4, 2000);
  options.max_wave_cones = 16;
  kept_box<Exec> box(options);
  for (int sample = 0; sample < 4; ++sample) {
    box.begin();
    box.prepare(floor_rays(16));
    box.end();
  }
  CHECK(box.counts().live == 4);
  CHECK(box.state().pressure == wfpg::detail::field_store_state().pressure);
}

WFPG_TEST_CASE("field store: fields that may see what moved are cast anew, the others refreshed",
               "[field_store]") {
  kept_box<Exec> box(slots_of(4, 100));
  std::vector<test_surface> floor = floor_rays(5), ceiling, glass = rays_at({0.0f, 0.4f, 0.4f}, {1, 0, 0});
  for (const test_surface& s : floor) ceiling.push_back(make_surface(s.position + up, down, down));
  glass[0].bsdf.kind = bsdf_kind::glass;
  std::vector<test_surface> all = floor;
  all.insert(all.end(), ceiling.begin(), ceiling.end());
  all.insert(all.end(), glass.begin(), glass.end());
  const auto next = [&](const wfpg::bounds3& moved) {
    box.store.invalidate(box.exec(), moved);
    box.begin();
    return std::vector<std::size_t>{box.cones(floor), box.cones(ceiling), box.cones(glass)};
  };
  box.begin();
  box.settle(all);
  const std::vector<std::size_t> none{20, 20, 4}, see_all{80, 80, 16};
  CHECK(next({{0.4f, -2.0f, 0.4f}, {0.6f, -1.8f, 0.6f}}) == std::vector<std::size_t>{20, 80, 16});
  CHECK(next({{0.4f, 2.8f, 0.4f}, {0.6f, 3.0f, 0.6f}}) == std::vector<std::size_t>{80, 20, 16});
  CHECK(next({{0.4f, 0.4f, 0.4f}, {0.6f, 0.6f, 0.6f}}) == see_all);
  CHECK(next({floor_place(0) - 0.01f, floor_place(0) + 0.01f}) == see_all);
  CHECK(next({vec3(-9.0f), vec3(9.0f)}) == see_all);
  box.store.invalidate_all(box.exec());
  CHECK(box.cones(all) == 80 + 80 + 16);  // in the same sample, too
  CHECK(box.cones(all) == 0);
  box.begin();
  CHECK(box.cones(floor) == none[0]);
  CHECK(box.counts().born == 11);
}

WFPG_TEST_CASE("field store: invalid fields serve as they are until they are used next", "[field_store]") {
  kept_box<Exec> box(slots_of(8, 10));
  const auto wave = floor_rays(3);
  box.begin();
  const auto before = field_bits(box.exec(), box.settle(wave), 3);
  box.store.invalidate_all(box.exec());
  CHECK(box.cones({wave[0]}) == 64);
  box.begin();
  CHECK(box.cones({wave[1]}) == 64);
  CHECK(box.cones({wave[1], wave[0]}) == 16);
  CHECK(box.counts().born == 3);
  CHECK(field_bits(box.exec(), box.prepare({wave[2]}), 1)[0] != before[2]);
}

WFPG_TEST_CASE("field store: unusual rays are counted and have no field", "[field_store]") {
  kept_box<Exec> box(slots_of(4, 100));
  auto wave = floor_rays(12);
  wave[1].active = false;
  wave[2].bsdf.kind = bsdf_kind::mirror;
  wave[3].position = vec3(std::nanf(""));
  wave[4].position = vec3(INFINITY);
  wave[5].position = {0.5f, 0.5f, 0.5f};
  box.begin();
  const guide_view view = box.settle(wave);
  CHECK(box.last_wave().unbinned == 3);
  CHECK(box.last_wave().unserved == 0);
  CHECK(box.last_wave().served == 7);
  CHECK(count_guided(box.exec(), view, wave.size()) == 7);
  CHECK(count_guided(box.exec(), box.prepare({}), 12) == 0);
}

WFPG_TEST_CASE("field store: options out of range are named, and too many rays refused", "[field_store]") {
  const auto refused = [](const char* name, void (*spoil)(kept_field_options&)) {
    kept_field_options options;
    spoil(options);
    const std::string message = refusal([&] { kept_box<Exec> box(options); });
    INFO("expected: " << name << ", message: " << message);
    CHECK(message.find(name) != std::string::npos);
  };
  refused("kept.resolution", [](kept_field_options& o) { o.resolution = 1; });
  refused("kept.resolution", [](kept_field_options& o) { o.resolution = 129; });
  refused("kept.recast", [](kept_field_options& o) { o.recast = 0; });
  refused("kept.idle_samples", [](kept_field_options& o) { o.idle_samples = 0; });
  refused("kept.budget_bytes", [](kept_field_options& o) { o.budget_bytes = ~std::size_t(0); });
  CHECK(refusal([] { kept_box<Exec> box(slots_of(128, 2, 128 * 128)); }).empty());

  kept_box<Exec> box(slots_of(4, 10));
  box.begin();
  const std::string message = refusal([&] { box.prepare(rays_at({}, up, box.max_rays + 1)); });
  CHECK(message.find("ray_count") != std::string::npos);
  CHECK(count_guided(box.exec(), box.prepare(rays_at(floor_place(0), up, box.max_rays)), 2000) ==
        box.max_rays);
}

WFPG_TEST_CASE("field store: a caster that throws leaves it usable, and fields are built in the next wave",
               "[field_store]") {
  const auto wave = floor_rays(16);
  kept_box<Exec> box(slots_of(4, 100)), other(slots_of(4, 100));
  for (std::size_t call : {0, 1, 3}) {
    box.begin();
    other.begin();
    const auto expected = field_bits(other.exec(), other.settle(wave), wave.size());
    batch_box_caster::log log;
    log.throw_at = call;
    CHECK_THROWS_AS(box.prepare(wave, batch_box_caster{{}, &log}, 1), std::runtime_error);
    CHECK(consistent(box));
    CHECK(field_bits(box.exec(), box.settle(wave), wave.size()) == expected);
    CHECK(count_guided(box.exec(), box.prepare(wave), wave.size()) == wave.size());
    CHECK(box.counts().live == 16);
    box.end();
    other.end();
  }
}

WFPG_TEST_CASE("field store: a wave after one that failed builds its own rays' fields only",
               "[field_store]") {
  kept_box<Exec> box(slots_of(4, 100));
  const auto wave = floor_rays(2);
  batch_box_caster::log log;
  log.throw_at = 0;
  box.begin();
  for (int i = 0; i < 2; ++i) {
    log.calls = 0;
    CHECK_THROWS_AS(box.prepare(wave, batch_box_caster{{}, &log}), std::runtime_error);
  }
  CHECK(box.counts().live == 2);
  CHECK(box.cones({wave[1]}) == 16);
  CHECK(box.cones(wave) == 16);
  CHECK(box.cones(wave) == 0);
}

}  // namespace
