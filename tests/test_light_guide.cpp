// Choices of lights. Probabilities sum to one, equal those of choose(), and match a plain computation from
// deposits. They reach down from parents, and no group of lights is left out.
#include "support/evaluate.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/guides/octree/light_guide.hpp>
#include <wfpg/testing/statistics.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

using namespace wfpg_test;

namespace {

/// An octree over the walls of the unit box, and a guide of a few groups over it. It records every path of
/// samples of 3000 values.
template <class Exec>
struct guided_box {
  Exec exec;
  wfpg::sparse_voxel_octree<Exec> octree;
  wfpg::light_guide<Exec> lights;

  explicit guided_box(const wfpg::light_guide_options& options, std::size_t values = 3000)
      : octree(octree_of(exec)), lights(exec, octree.view(), options, values, 1) {}

  static wfpg::sparse_voxel_octree<Exec> octree_of(const Exec& exec) {
    const box_mesh<Exec> box(exec);
    wfpg::voxel_fragments<Exec> fragments = wfpg::voxelize(exec, box.view(), 32);
    return wfpg::sparse_voxel_octree<Exec>(exec, fragments);
  }
};

wfpg::light_guide_options three_groups() {
  wfpg::light_guide_options options;
  options.weights = {1.0f, 2.0f, 1.0f};
  options.resolution = 4;
  return options;
}

/// A place in the box, and the probabilities of its row.
struct asked_place {
  vec3 position;
  vec3 normal;
};

const asked_place on_floor{{0.3f, 0.0f, 0.3f}, {0.0f, 1.0f, 0.0f}};
const asked_place on_wall{{0.0f, 0.6f, 0.9f}, {1.0f, 0.0f, 0.0f}};

struct find_rows {
  wfpg::light_guide_view guide;
  wfpg::array_view<const asked_place> places;
  wfpg::array_view<std::uint32_t> rows;
  WFPG_HD void operator()(std::size_t i) const { rows[i] = guide.find(places[i].position, places[i].normal); }
};

struct ask_probabilities {
  wfpg::light_guide_view guide;
  wfpg::array_view<const std::uint32_t> rows;
  wfpg::array_view<float> probabilities;
  WFPG_HD void operator()(std::size_t i) const {
    probabilities[i] =
        guide.probability(rows[i / guide.groups()], static_cast<std::uint32_t>(i % guide.groups()));
  }
};

struct choose_groups {
  wfpg::light_guide_view guide;
  std::uint32_t row;
  hashed_numbers random;
  wfpg::array_view<wfpg::light_choice> choices;
  WFPG_HD void operator()(std::size_t i) const {
    choices[i] = guide.choose(row, random(static_cast<std::uint32_t>(i), 0).x);
  }
};

template <class Exec>
std::vector<std::uint32_t> rows_of(const guided_box<Exec>& box, const std::vector<asked_place>& places) {
  const wfpg::buffer<asked_place, Exec> asked(box.exec, places);
  wfpg::buffer<std::uint32_t, Exec> rows(box.exec, places.size());
  box.exec.for_each(places.size(), find_rows{box.lights.view(), asked.view(), rows.view()});
  return rows.to_host(box.exec);
}

/// Probabilities of each place's groups, one place after the other.
template <class Exec>
std::vector<float> probabilities_at(const guided_box<Exec>& box, const std::vector<asked_place>& places) {
  const wfpg::buffer<std::uint32_t, Exec> rows(box.exec, rows_of(box, places));
  wfpg::buffer<float, Exec> found(box.exec, places.size() * box.lights.view().groups());
  box.exec.for_each(found.size(), ask_probabilities{box.lights.view(), rows.view(), found.view()});
  return found.to_host(box.exec);
}

template <class Exec>
std::vector<wfpg::light_choice> choices_at(const guided_box<Exec>& box, const asked_place& place,
                                           std::uint32_t count) {
  wfpg::buffer<wfpg::light_choice, Exec> choices(box.exec, count);
  box.exec.for_each(count, choose_groups{box.lights.view(), rows_of(box, {place})[0], {3}, choices.view()});
  return choices.to_host(box.exec);
}

/// A path's contribution after a choice at a place.
struct light_deposit {
  asked_place at;
  std::uint32_t group;
  float scattered;  ///< not yet divided by the group's probability
};

struct deposit_lights {
  wfpg::light_guide_view guide;
  wfpg::array_view<const light_deposit> values;
  WFPG_HD void operator()(std::size_t i) const {
    const light_deposit& value = values[i];
    const std::uint32_t row = guide.find(value.at.position, value.at.normal);
    // The number that chooses the group: the middle of its interval.
    float before = 0.0f;
    for (std::uint32_t g = 0; g < value.group; ++g) before += guide.probability(row, g);
    const wfpg::light_choice choice = guide.choose(row, before + 0.5f * guide.probability(row, value.group));
    guide.deposit(i, choice.key, value.scattered / choice.probability);
  }
};

template <class Exec>
void learn(guided_box<Exec>& box, const std::vector<light_deposit>& values, std::uint32_t seed = 1) {
  const wfpg::buffer<light_deposit, Exec> deposited(box.exec, values);
  box.lights.begin_sample(seed);
  box.exec.for_each(values.size(), deposit_lights{box.lights.view(), deposited.view()});
  box.lights.end_sample(box.exec);
}

/// Places all over the box's walls.
std::vector<asked_place> places_on_walls(std::size_t count) {
  random_numbers random(7);
  std::vector<asked_place> places;
  for (std::size_t i = 0; i < count; ++i) {
    asked_place place{random.point(0.0f, 1.0f), vec3(0.0f)};
    const auto axis = static_cast<int>(random.below(3));
    const bool upper = random.below(2) == 1;
    place.position[axis] = upper ? 1.0f : 0.0f;
    place.normal[axis] = upper ? -1.0f : 1.0f;
    places.push_back(place);
  }
  return places;
}

std::vector<light_deposit> values_on_walls(std::size_t count) {
  random_numbers random(9);
  std::vector<light_deposit> values;
  for (const asked_place& place : places_on_walls(count))
    values.push_back(
        {place, random.below(3), random.below(4) == 0 ? 0.0f : std::exp(random.between(-9.0f, 9.0f))});
  return values;
}

/// On the floor only one of three groups is seen. All three get values, since priors may be wrong.
std::vector<light_deposit> only_group(std::uint32_t seen, int times) {
  std::vector<light_deposit> values;
  for (int i = 0; i < times; ++i)
    for (std::uint32_t g = 0; g < 3; ++g) values.push_back({on_floor, g, g == seen ? 5.0f : 0.0f});
  return values;
}

/// The estimate that choose_light_groups documents, for a group with `mean` from n values.
double expected_estimate(double prior, double scale, double mean, double n) {
  const double parent = 8.0;
  return (parent * scale * prior + n * mean) / (parent + n);
}

}  // namespace

WFPG_TEST_CASE("a light guide without data chooses groups by weight", "[light_guide]") {
  const guided_box<Exec> box(three_groups());
  const std::vector<float> p = probabilities_at(box, {on_floor});
  // Half of a fifth is by weight, the other half uniform.
  CHECK(p[0] == Approx(0.8 * 0.25 + 0.2 * 0.5 * (0.25 + 1.0 / 3.0)));
  CHECK(p[1] == Approx(0.8 * 0.5 + 0.2 * 0.5 * (0.5 + 1.0 / 3.0)));
  CHECK(p[0] + p[1] + p[2] == Approx(1.0));
}

WFPG_TEST_CASE("groups of weight 0 get no defensive probability", "[light_guide]") {
  wfpg::light_guide_options options;
  options.weights = {0.0f, 3.0f, 0.0f, 0.0f, 1.0f, 4.0f, 0.0f};
  options.floor = 0.5f;
  const guided_box<Exec> box(options);
  const std::vector<float> p = probabilities_at(box, {on_floor});
  for (std::size_t g = 0; g < p.size(); ++g) {
    const double fraction = static_cast<double>(options.weights[g]) / 8.0;
    const double alike = options.weights[g] > 0.0f ? 1.0 / 3.0 : 0.0;  // of three groups
    INFO("group " << g);
    CHECK(p[g] == Approx(0.5 * fraction + 0.5 * 0.5 * (fraction + alike)));
  }
}

WFPG_TEST_CASE("groups are chosen with their probabilities", "[light_guide]") {
  wfpg::light_guide_options options;
  const auto is_worth_nothing = [](std::size_t g) { return g == 5 || g > 30; };  // including the last ones
  for (std::size_t g = 0; g < 33; ++g)
    options.weights.push_back(is_worth_nothing(g) ? 0.0f : static_cast<float>(1 + g % 4));
  guided_box<Exec> box(options);
  std::vector<light_deposit> values;
  random_numbers random(4);
  for (int i = 0; i < 400; ++i) {
    const std::uint32_t group = random.below(33);
    if (!is_worth_nothing(group)) values.push_back({on_floor, group, static_cast<float>(group)});
  }
  learn(box, values);
  const std::vector<float> p = probabilities_at(box, {on_floor});
  const std::uint32_t row = rows_of(box, {on_floor})[0];
  constexpr std::uint32_t draws = 100000;
  std::vector<double> counted(p.size(), 0.0), expected;
  for (const wfpg::light_choice& choice : choices_at(box, on_floor, draws)) {
    REQUIRE(choice.group < p.size());
    REQUIRE(choice.probability == p[choice.group]);
    REQUIRE(box.lights.view().row_of(choice.key) == row);
    counted[choice.group] += 1.0;
  }
  for (const float probability : p) expected.push_back(draws * static_cast<double>(probability));
  for (std::size_t g = 0; g < p.size(); ++g) {
    INFO("group " << g);
    CHECK((p[g] == 0.0f) == is_worth_nothing(g));
    if (is_worth_nothing(g)) CHECK(counted[g] == 0.0);
  }
  CHECK(wfpg::testing::chi_square_test(counted, expected).p > 1e-4);
}

WFPG_TEST_CASE("probabilities sum to one everywhere and leave no group out", "[light_guide]") {
  guided_box<Exec> box(three_groups());
  learn(box, values_on_walls(3000));
  const std::vector<float> p = probabilities_at(box, places_on_walls(1000));
  for (std::size_t i = 0; i < p.size(); i += 3) {
    REQUIRE(static_cast<double>(p[i]) + static_cast<double>(p[i + 1]) + static_cast<double>(p[i + 2]) ==
            Approx(1.0).margin(1e-6));
    REQUIRE(std::min({p[i], p[i + 1], p[i + 2]}) > 0.2f * 0.29f);
  }
}

WFPG_TEST_CASE("groups of weight 0 are never chosen, whatever the rounding", "[light_guide]") {
  random_numbers random(6);
  for (int i = 0; i < 20; ++i) {
    wfpg::light_guide_options options;
    options.resolution = 4;
    const std::size_t groups = 4 + random.below(30);
    while (options.weights.size() + 1 < groups) options.weights.push_back(random.unit());
    options.weights.push_back(0.0f);
    guided_box<Exec> box(options);
    const auto chance_of_last = [&] {
      float most = 0.0f;
      const std::vector<float> p = probabilities_at(box, {on_floor, on_wall});
      for (std::size_t last = groups - 1; last < p.size(); last += groups) most = std::max(most, p[last]);
      return most;
    };
    CHECK(chance_of_last() == 0.0f);
    std::vector<light_deposit> values;
    for (int k = 0; k < 100; ++k) values.push_back({on_floor, random.below(3), random.unit()});
    learn(box, values);
    CHECK(chance_of_last() == 0.0f);
  }
}

WFPG_TEST_CASE("a row with data combines its parents and its own means", "[light_guide]") {
  wfpg::light_guide_options options = three_groups();
  options.resolution = 2;  // two levels: the root and its children
  guided_box<Exec> box(options);
  // On the floor, group 0 brings nothing in 40 choices, group 1 brings 3 in 20. Group 2 is not chosen.
  std::vector<light_deposit> values(40, {on_floor, 0, 0.0f});
  values.insert(values.end(), 20, {on_floor, 1, 3.0f});
  learn(box, values);
  const double fraction[] = {0.25, 0.5, 0.25};
  const double mean[] = {0.0, 3.0, 0.0}, n[] = {40.0, 20.0, 0.0};
  double prior[] = {0.25, 0.5, 0.25};
  for (int level = 0; level < 2; ++level) {
    double found = 0.0, expected = 0.0, total = 0.0, estimate[3];
    for (int g = 0; g < 3; ++g) found += n[g] * mean[g], expected += n[g] * prior[g];
    for (int g = 0; g < 3; ++g) {
      estimate[g] = expected_estimate(prior[g], found / expected, mean[g], n[g]);
      total += estimate[g];
    }
    for (int g = 0; g < 3; ++g) prior[g] = estimate[g] / total;
  }
  const std::vector<float> p = probabilities_at(box, {on_floor, on_wall});
  for (std::size_t g = 0; g < 3; ++g) {
    const double defensive = 0.5 * (fraction[g] + 1.0 / 3.0);
    CHECK(p[g] == Approx(0.8 * prior[g] + 0.2 * defensive).epsilon(1e-4));
    // Nothing was learnt of surfaces that face another way.
    CHECK(p[3 + g] == Approx(0.8 * fraction[g] + 0.2 * defensive).epsilon(1e-4));
  }
}

/// A path of a host. It chooses a group on the floor, samples a light, and deposits the result. A group
/// brings between nothing and twice its mean.
struct ask_light {
  wfpg::light_guide_view guide;
  wfpg::array_view<const float> means;
  hashed_numbers random;
  WFPG_HD void operator()(std::size_t path) const {
    const auto i = static_cast<std::uint32_t>(path);
    const wfpg::light_choice choice =
        guide.choose(guide.find(on_floor.position, on_floor.normal), random(i, 0).x);
    const float scattered = 2.0f * random(i, 0).y * means[choice.group];
    guide.deposit(path, choice.key, scattered / choice.probability);
  }
};

WFPG_TEST_CASE("choices become proportional to the groups' light, however rarely chosen", "[light_guide]") {
  const std::vector<float> brings{1.0f, 4.0f, 16.0f};
  wfpg::light_guide_options options = three_groups();
  for (const std::vector<float>& weights :
       {std::vector<float>{20.0f, 1.0f, 1.0f}, {1.0f, 1.0f, 1.0f}, {1.0f, 1.0f, 20.0f}}) {
    options.weights = weights;
    guided_box<Exec> box(options);
    const wfpg::buffer<float, Exec> means(box.exec, brings);
    for (std::uint32_t sample = 1; sample <= 4; ++sample) {
      box.lights.begin_sample(sample);
      box.exec.for_each(3000, ask_light{box.lights.view(), const_view<float>(means), {sample}});
      box.lights.end_sample(box.exec);
    }
    const std::vector<float> p = probabilities_at(box, {on_floor});
    for (std::size_t g = 0; g < 3; ++g) {
      const double fraction = static_cast<double>(weights[g] / (weights[0] + weights[1] + weights[2]));
      const double defensive = 0.5 * (fraction + 1.0 / 3.0), learnt = static_cast<double>(brings[g]) / 21.0;
      INFO("group " << g << " of weight " << weights[g]);
      // The mean of 250 choices is known to 4%. Unconverged estimates would be off by 0.04 or more.
      CHECK(p[g] == Approx(0.8 * learnt + 0.2 * defensive).margin(0.01));
    }
  }
}

WFPG_TEST_CASE("places without data nearby use their parent's choices", "[light_guide]") {
  guided_box<Exec> box(three_groups());
  learn(box, only_group(2, 100));
  const asked_place beside{{0.2f, 0.0f, 0.3f}, {0.0f, 1.0f, 0.0f}};
  const std::vector<float> p = probabilities_at(box, {on_floor, beside});
  CHECK(p[2] > 0.7f);
  CHECK(p[5] > 0.5f);
  CHECK(p[5] < p[2]);
}

WFPG_TEST_CASE("learnt choices do not depend on the order of deposits", "[light_guide]") {
  std::vector<light_deposit> values = values_on_walls(3000);
  guided_box<Exec> box(three_groups()), other(three_groups());
  learn(box, values);
  random_numbers random(2);
  shuffle(values, random);
  learn(other, values);
  const std::vector<asked_place> places = places_on_walls(500);
  CHECK(probabilities_at(box, places) == probabilities_at(other, places));
}

WFPG_TEST_CASE("each sample records another part of many paths", "[light_guide]") {
  wfpg::light_guide_options options = three_groups();
  options.resolution = 1;
  constexpr std::size_t paths = 32768;  // 384 are wanted
  std::vector<light_deposit> values(paths, {on_floor, 0, 0.0f});
  for (std::size_t i = 0; i < paths; i += 2) values[i] = {on_floor, 1, 1.0f};
  const auto learnt = [&](std::uint32_t seed) {
    guided_box<Exec> box(options, paths);
    CHECK(box.lights.transient_bytes() < 8 * 1000 + 16 * 100);
    learn(box, values, seed);
    return probabilities_at(box, {on_floor});
  };
  CHECK(learnt(1)[1] > 0.6f);
  // Contributions differ between paths, so another selection gives other choices.
  for (std::size_t i = 0; i < paths; ++i)
    values[i].scattered = static_cast<float>(values[i].group == 1 ? i : paths - i);
  CHECK(learnt(1) == learnt(1));
  CHECK(learnt(1) != learnt(2));
}

WFPG_TEST_CASE("choices forget light, and invalid deposits are dropped", "[light_guide]") {
  guided_box<Exec> box(three_groups(), 100);
  const std::vector<float> before = probabilities_at(box, {on_floor});
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              infinite = std::numeric_limits<float>::infinity();
  learn(box, {{on_floor, 0, nan}, {on_floor, 0, -1.0f}, {on_floor, 0, infinite}});
  CHECK(probabilities_at(box, {on_floor}) == before);
  learn(box, only_group(0, 300));  // nine times the queue's capacity
  const std::vector<float> after = probabilities_at(box, {on_floor});
  CHECK(after[0] > 0.6f);
  box.lights.forget(box.exec);
  CHECK(probabilities_at(box, {on_floor}) == before);
  // A host that never gives the number of choices may call choose(), but nothing is learnt.
  guided_box<Exec> silent(three_groups(), 0);
  learn(silent, only_group(0, 10));
  CHECK(probabilities_at(silent, {on_floor}) == before);
}

WFPG_TEST_CASE("a view says whether choices are by weight alone", "[light_guide]") {
  guided_box<Exec> box(three_groups());
  CHECK(!box.lights.view().rests());
  CHECK(box.lights.resting_view().rests());
  CHECK(!box.lights.resting_view().empty());
  CHECK(wfpg::light_guide_view().rests());
}

WFPG_TEST_CASE("places outside the octree use the root's choices", "[light_guide]") {
  guided_box<Exec> box(three_groups());
  const asked_place outside{{40.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}};
  learn(box, only_group(2, 100));
  CHECK(rows_of(box, {outside})[0] == 2);
  for (const wfpg::light_choice& choice : choices_at(box, outside, 100))
    CHECK(choice.key == wfpg::no_light_choice);
  CHECK(probabilities_at(box, {outside})[2] > 0.4f);
}

WFPG_TEST_CASE("invalid options of light groups are refused by name", "[light_guide]") {
  const auto refused = [](const wfpg::light_guide_options& options, const std::string& name) {
    try {
      guided_box<Exec> box(options);
      FAIL("not refused: " << name);
    } catch (const std::invalid_argument& error) {
      CHECK(std::string(error.what()).find(name) != std::string::npos);
    }
  };
  wfpg::light_guide_options options = three_groups();
  options.weights = {1.0f, -1.0f};
  refused(options, "weights");
  options.weights = {0.0f, 0.0f};
  refused(options, "weights");
  options.weights = std::vector<float>(257, 1.0f);
  refused(options, "weights");
  options = three_groups();
  options.resolution = 3;
  refused(options, "resolution");
  options = three_groups();
  options.floor = 0.0f;
  refused(options, "floor");
  options.floor = 1.0f;
  refused(options, "floor");
  CHECK(guided_box<Exec>(wfpg::light_guide_options()).lights.view().empty());
}
