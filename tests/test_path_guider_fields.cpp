// The field of each ray, and random choices of each sample and depth. These are the ray that cones start
// from, directions inside cells, and points at which products evaluate BSDFs. Also tests forget_light().
#include "support/chi_square.hpp"
#include "support/evaluate.hpp"
#include "support/guiding.hpp"
#include "support/kept_fields.hpp"
#include "support/kinds_of_guiding.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/path_guider.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::guiding_mode;

namespace {

/// Surfaces at one place with random shading normals, seen from either side. Their geometric normals are any
/// on that side.
std::vector<test_surface> turned_surfaces(std::size_t n, vec3 place) {
  random_numbers random(3);
  std::vector<test_surface> surfaces;
  for (std::size_t i = 0; i < n; ++i) {
    const bsdf_kind kind = random.below(8) == 0 ? bsdf_kind::glass : bsdf_kind::lambert;
    test_surface s = make_surface(place, random.direction(), random.direction(), kind);
    do s.geometric_normal = random.direction();
    while (glm::dot(s.geometric_normal, s.outgoing) * glm::dot(s.normal, s.outgoing) <= 0.0f);
    surfaces.push_back(s);
  }
  return surfaces;
}

/// The axis of six that is nearest to a shading normal on the viewer's side.
std::uint32_t nearest_axis(const test_surface& s) {
  const vec3 facing = glm::dot(s.normal, s.outgoing) < 0.0f ? -s.normal : s.normal;
  std::uint32_t nearest = 0;
  for (std::uint32_t axis = 1; axis < 6; ++axis)
    if (glm::dot(facing, face_normal(axis)) > glm::dot(facing, face_normal(nearest))) nearest = axis;
  return nearest;
}

struct field_of_ray {
  std::uint32_t number;
  wfpg::resident_field what;
};

struct find_field {
  wfpg::guide_view view;
  WFPG_HD field_of_ray operator()(std::size_t i) const {
    const std::uint32_t number = view.number(static_cast<std::uint32_t>(i));
    return {number, view.fields().info(number)};
  }
};

WFPG_TEST_CASE("path guider: rays share a field by their shading normal on the outgoing side",
               "[path_guider]") {
  const auto surfaces = turned_surfaces(600, {0.4f, 0.0f, 0.4f});
  for (const guider_options& options : kinds_of_guiding()) {
    INFO(describe(options));
    guided_box<Exec> box(options);
    box.learn();
    box.sample_again(surfaces);
    const wave_of_surfaces<Exec> wave(box.exec, surfaces);
    const wfpg::guide_view view = box.guider.prepare(wave.get(), box_caster{});
    const auto fields = evaluate(box.exec, surfaces.size(), find_field{view});
    const bool oriented = options.mode == guiding_mode::oriented;
    std::map<std::uint32_t, std::uint32_t> orientation_of;  // by field
    std::size_t shared = 0, wrong_side = 0;
    for (std::size_t i = 0; i < surfaces.size(); ++i) {
      const bool reflects = oriented && !surfaces[i].bsdf.transmits();
      const std::uint32_t expected = reflects ? nearest_axis(surfaces[i]) : 6;
      const auto found = orientation_of.emplace(fields[i].number, expected);
      shared += found.first->second != expected;
      wrong_side += !(fields[i].what.is_built()) || fields[i].what.hemisphere() != reflects ||
                    (reflects && wfpg::dominant_axis(fields[i].what.normal) != expected);
    }
    CHECK(shared == 0);
    CHECK(wrong_side == 0);
    CHECK(orientation_of.size() == (oriented ? 7 : 1));
  }
}

/// Checks random points in a square's n x n cells, one per cell and wave. Each must be uniform in its cell
/// and independent of the two waves before.
class drawn_anew {
 public:
  explicit drawn_anew(std::uint32_t n)
      : n_(n), waves_(n * n), inside_(n * n * fine * fine, 0.0), pairs_(2 * 16, 0.0) {}

  void add(const std::vector<vec2>& points) {
    for (const vec2 uv : points) {
      const vec2 at = glm::clamp(uv, 0.0f, 0x1.fffffep-1f) * float(n_);
      const std::uint32_t cell = std::uint32_t(at.y) * n_ + std::uint32_t(at.x);
      const vec2 within = at - glm::floor(at);
      inside_[(cell * fine + std::uint32_t(within.y * fine)) * fine + std::uint32_t(within.x * fine)] += 1.0;
      const std::uint32_t quarter = 2 * std::uint32_t(within.y * 2.0f) + std::uint32_t(within.x * 2.0f);
      std::vector<std::uint32_t>& before = waves_[cell];
      for (std::size_t lag = 1; lag <= std::min<std::size_t>(before.size(), 2); ++lag)
        pairs_[16 * (lag - 1) + 4 * before[before.size() - lag] + quarter] += 1.0;
      before.push_back(quarter);
    }
  }

  void judge(chi_square_family& family, const std::string& name) const {
    double points = 0.0;
    for (const auto& cell : waves_) points += double(cell.size());
    const double cells = double(inside_.size());
    family.add(chi_square_test(inside_, std::vector<double>(inside_.size(), points / cells)), name);
    for (int lag = 1; lag <= 2; ++lag) {
      const std::vector<double> counted(pairs_.begin() + 16 * (lag - 1), pairs_.begin() + 16 * lag);
      double pairs = 0.0;
      for (const double count : counted) pairs += count;
      family.add(chi_square_test(counted, std::vector<double>(16, pairs / 16.0)),
                 name + ", after " + std::to_string(lag));
    }
  }

 private:
  static constexpr std::uint32_t fine = 4;

  std::uint32_t n_;
  std::vector<std::vector<std::uint32_t>> waves_;  // by cell: quarters of the cell
  std::vector<double> inside_, pairs_;
};

/// Small bins and fields: nodes of level 2 with few rays.
guider_options small_fields(field_lifetime lifetime, std::uint32_t resolution) {
  guider_options options = box_options(guiding_mode::oriented, lifetime);
  options.octree_resolution = 8;
  options.binning.rays_per_bin = 1000;
  options.field_resolution = options.min_field_resolution = options.kept.resolution = resolution;
  options.kept.budget_bytes = 1 << 16;
  options.deposit_capacity = 16;
  return options;
}

constexpr std::uint32_t samples = 500, depths = 2;

/// Six places in one node of the floor.
std::vector<test_surface> six_rays() {
  std::vector<test_surface> rays;
  for (int i = 0; i < 6; ++i)
    rays.push_back(make_surface({0.05f + 0.07f * float(i % 3), 0.0f, 0.06f + 0.1f * float(i / 3)}, {0, 1, 0},
                                {0, 1, 0}));
  return rays;
}

/// The cones of each wave whose fields are all cast anew.
template <class Exec>
std::vector<std::vector<wfpg::ray>> cones_of_waves(field_lifetime lifetime, std::uint32_t resolution) {
  guided_box<Exec> box(small_fields(lifetime, resolution));
  cone_log<Exec> log(box.exec, resolution * resolution);
  std::vector<std::vector<wfpg::ray>> waves;
  for (std::uint32_t sample = 0; sample < samples; ++sample) {
    box.guider.begin_sample();
    for (std::uint32_t depth = 0; depth < depths; ++depth) {
      box.guider.invalidate_all();
      const wave_of_surfaces<Exec> wave(box.exec, six_rays(), depth);
      box.guider.prepare(wave.get(), log.caster());
      waves.push_back(log.cones(log.take()));
      REQUIRE(waves.back().size() == resolution * resolution);
    }
    box.guider.end_sample();
  }
  return waves;
}

WFPG_TEST_CASE("path guider: each ray of a bin is equally often the start of its cones", "[path_guider]") {
  const auto rays = six_rays();
  chi_square_family family;
  for (const field_lifetime lifetime : lifetimes) {
    std::vector<double> origins(6, 0.0), pairs(36, 0.0);
    std::size_t before = 0, wave = 0;
    for (const auto& cones : cones_of_waves<Exec>(lifetime, 2)) {
      std::size_t nearest = 0;
      const auto away = [&](std::size_t ray) { return glm::distance(rays[ray].position, cones[0].origin); };
      for (std::size_t ray = 1; ray < rays.size(); ++ray)
        if (away(ray) < away(nearest)) nearest = ray;
      CHECK(away(nearest) < 0.01f);
      for (const wfpg::ray& cone : cones) CHECK(cone.origin == cones[0].origin);
      origins[nearest] += 1.0;
      if (wave++ % depths != 0) pairs[6 * before + nearest] += 1.0;  // of one sample
      before = nearest;
    }
    family.add(chi_square_test(origins, std::vector<double>(6, samples * depths / 6.0)),
               name_of(lifetime) + std::string(", rays"));
    family.add(chi_square_test(pairs, std::vector<double>(36, samples / 36.0)),
               name_of(lifetime) + std::string(", pairs of depths"));
  }
  INFO(family.message());
  CHECK(family.accepted());
}

WFPG_TEST_CASE("path guider: cones have random places in their cells for each sample and depth",
               "[path_guider]") {
  chi_square_family family;
  for (const field_lifetime lifetime : lifetimes) {
    constexpr std::uint32_t resolution = 4;
    const wfpg::directional_field domain(wfpg::grid_distribution(nullptr, resolution), vec3(0, 1, 0));
    drawn_anew jitter(resolution);
    for (const auto& cones : cones_of_waves<Exec>(lifetime, resolution)) {
      std::vector<vec2> points;
      for (const wfpg::ray& cone : cones) {
        vec2 uv(0.0f);
        REQUIRE(domain.locate(cone.direction, uv));
        points.push_back(uv);
      }
      jitter.add(points);
    }
    jitter.judge(family, name_of(lifetime));
  }
  INFO(family.message());
  CHECK(family.accepted());
}

/// Logs where it is evaluated.
struct noting_bsdf {
  std::uint32_t* count = nullptr;
  wfpg::array_view<vec3> incident;
  bool glass = false;

  WFPG_HD bool is_delta() const { return false; }
  WFPG_HD bool transmits() const { return glass; }
  WFPG_HD float eval(vec3, vec3 direction) const {
    const std::uint32_t at = wfpg::atomic_add(count, 1);
    if (at < incident.size()) incident[at] = direction;
    return 1.0f;
  }
  WFPG_HD float pdf(vec3, vec3) const { return 0.25f / wfpg::pi; }
  WFPG_HD wfpg::bsdf_sample sample(vec3, vec2 u) const {
    return {wfpg::square_to_sphere(u), 0.25f / wfpg::pi};
  }
};

struct one_noting_surface {
  noting_bsdf bsdf;
  WFPG_HD wfpg::surface<noting_bsdf> operator()(std::uint32_t) const {
    const vec3 up(0, 1, 0);
    return {{0.1f, 0.0f, 0.1f}, up, up, up, bsdf, true};
  }
};

WFPG_TEST_CASE("path guider: products evaluate BSDFs at other points for each sample and depth",
               "[path_guider]") {
  constexpr std::uint32_t p = 4;
  chi_square_family family;
  for (const field_lifetime lifetime : lifetimes)
    for (const bool glass : {false, true}) {
      guider_options options = small_fields(lifetime, 8);
      options.product_resolution = unless_zero(p);
      guided_box<Exec> box(options);
      const wfpg::grid_distribution grid(nullptr, p);
      const wfpg::directional_field domain =
          glass ? wfpg::directional_field(grid) : wfpg::directional_field(grid, vec3(0, 1, 0));
      const wfpg::buffer<wfpg::sampled_direction, Exec> drawn(box.exec, 1);
      const wfpg::buffer<vec3, Exec> incident(box.exec, p * p);
      drawn_anew jitter(p);
      for (std::uint32_t sample = 0; sample < samples; ++sample) {
        box.guider.begin_sample();
        for (std::uint32_t depth = 0; depth < depths; ++depth) {
          const wfpg::buffer<std::uint32_t, Exec> count(box.exec, std::vector<std::uint32_t>{0});
          const one_noting_surface surfaces{{count.data(), incident.view(), glass}};
          box.guider.sample_directions(wfpg::wave{depth, 1, surfaces, hashed_numbers{sample}}, box_caster{},
                                       drawn.view());
          REQUIRE(wfpg::read_element(box.exec, count.data()) == p * p);
          std::vector<vec2> points;
          for (const vec3 direction : incident.to_host(box.exec)) {
            vec2 uv(0.0f);
            REQUIRE(domain.locate(direction, uv));
            points.push_back(uv);
          }
          jitter.add(points);
        }
        box.guider.end_sample();
      }
      jitter.judge(family, name_of(lifetime) + std::string(glass ? ", sphere" : ", hemisphere"));
    }
  INFO(family.message());
  CHECK(family.accepted());
}

/// What a guider knows at a place on the floor: choices of lights, and the field's density of a direction.
struct knowledge {
  float chances[3];  ///< of groups of lights
  float density;     ///< of the direction, per steradian
};

struct ask_guider {
  wfpg::light_guide_view lights;
  wfpg::guide_view view;
  test_surface at;
  vec3 direction;
  WFPG_HD knowledge operator()() const {
    knowledge result{};
    const std::uint32_t row = lights.find(at.position, at.normal);
    for (std::uint32_t g = 0; g < 3; ++g) result.chances[g] = lights.probability(row, g);
    result.density = view.pdf(0, direction);
    return result;
  }
};

/// Finds light along a direction, and from the third of three groups of lights.
struct find_light {
  wfpg::light_guide_view lights;
  wfpg::learnt_radiance_view learnt;
  wfpg::guide_view view;
  test_surface at;
  vec3 direction;
  WFPG_HD void operator()(std::size_t i) const {
    const wfpg::light_choice choice = lights.choose(lights.find(at.position, at.normal),
                                                    hashed_numbers{4}(static_cast<std::uint32_t>(i), 0).x);
    lights.deposit(i, choice.key, choice.group == 2 ? 1.0f / choice.probability : 0.0f);
    learnt.deposit(view.number(0), direction, 5.0f);
  }
};

WFPG_TEST_CASE("path guider: forget_light() forgets choices of lights and learnt radiance", "[path_guider]") {
  for (const field_lifetime lifetime : lifetimes) {
    INFO(name_of(lifetime));
    guider_options options = box_options(guiding_mode::oriented, lifetime);
    options.lights.weights = {4.0f, 2.0f, 1.0f};
    options.lights.resolution = 4;
    options.binning.rays_per_bin = 1000;  // the place keeps its field
    guided_box<Exec> box(options);
    const test_surface at = make_surface({0.3f, 0.0f, 0.3f}, {0, 1, 0}, {0, 1, 0});
    const vec3 direction = glm::normalize(vec3(-0.3f, 0.8f, 0.4f));  // away from the patch
    const wave_of_surfaces<Exec> wave(box.exec, std::vector<test_surface>(40, at));
    const auto known = [&] {
      const wfpg::guide_view view = box.guider.prepare(wave.get(), box_caster{});
      return evaluate(box.exec, ask_guider{box.guider.lights(), view, at, direction});
    };
    const auto next_sample = [&] {
      box.guider.end_sample();
      box.guider.begin_sample();
    };
    const auto learn = [&] {
      const wfpg::guide_view view = box.guider.prepare(wave.get(), box_caster{});
      box.exec.for_each(300,
                        find_light{box.guider.lights(), box.guider.guide().learnt(), view, at, direction});
    };
    box.guider.begin_sample();
    const knowledge before = known();
    const auto check_forgotten = [&] {
      box.guider.forget_light();
      for (int sample = 0; sample < 2; ++sample) {
        next_sample();
        const knowledge after = known();
        for (int g = 0; g < 3; ++g) CHECK(after.chances[g] == before.chances[g]);
        CHECK(after.density == before.density);
      }
    };
    learn();
    next_sample();
    known();  // fields use learnt radiance after a refresh
    next_sample();
    const knowledge learnt = known();
    CHECK(learnt.chances[2] > 2.0f * before.chances[2]);
    CHECK(learnt.chances[0] < 0.7f * before.chances[0]);
    if (lifetime == field_lifetime::kept) CHECK(learnt.density > 10.0f * before.density);
    check_forgotten();
    learn();
    check_forgotten();  // including contributions of the current sample
  }
}

/// The box, whose patch may have moved to the opposite corner of the ceiling.
struct lamp_box {
  static constexpr float survival = 1.0f;
  bool moved;
  WFPG_HD float operator()(vec3 p) const { return emitted(moved ? vec3(1.0f - p.x, p.y, 1.0f - p.z) : p); }
};

double variance_of(const std::vector<float>& values) {
  double sum = 0.0, squares = 0.0;
  for (const float value : values) {
    sum += double(value);
    squares += double(value) * double(value);
  }
  const auto n = static_cast<double>(values.size());
  return squares / n - sum / n * (sum / n);
}

WFPG_TEST_CASE(
    "path guider: after a lamp moved, forget_light() leaves a guide that errs as little as a new one",
    "[path_guider]") {
  const Exec exec;
  constexpr std::size_t paths = 4096;
  const box_mesh<Exec> mesh(exec);
  double first_told = 0.0, first_new = 0.0, all_told = 0.0, all_new = 0.0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    guider_options options = tracing_options(paths);
    options.seed = seed;
    octree_guider<Exec> told(exec, mesh.view(), options), fresh(exec, mesh.view(), options);
    trace_paths(exec, told, paths_to_trace{24, paths}, box_caster(), lamp_box{false});
    told.forget_light();
    for (std::uint64_t part = 0; part < 4; ++part) {
      const paths_to_trace four{4, paths, 2, 100 * seed + 4 * part};
      const double of_told = variance_of(trace_paths(exec, told, four, box_caster(), lamp_box{true})),
                   of_new = variance_of(trace_paths(exec, fresh, four, box_caster(), lamp_box{true}));
      if (part == 0) first_told += of_told;
      if (part == 0) first_new += of_new;
      all_told += of_told;
      all_new += of_new;
    }
  }
  INFO("variance of 4 samples " << first_told << " and " << first_new << ", of 16 " << all_told << " and "
                                << all_new);
  CHECK(first_told < 1.1 * first_new);
  CHECK(all_told < 1.1 * all_new);
  CHECK(all_told > 0.5 * all_new);
}

WFPG_TEST_CASE("path guider: after forget_light() the first samples are not guided, as of a new guide",
               "[path_guider]") {
  const Exec exec;
  constexpr std::size_t paths = 256;
  const box_mesh<Exec> mesh(exec);
  guider_options options = tracing_options(paths);
  options.unguided_samples = 2;
  octree_guider<Exec> guider(exec, mesh.view(), options);
  const auto next_is_guided = [&] {
    trace_paths(exec, guider, 1, paths, box_caster());
    return guider.guided();
  };
  for (int time = 0; time < 2; ++time) {
    CHECK_FALSE(next_is_guided());
    CHECK_FALSE(next_is_guided());
    CHECK(next_is_guided());
    CHECK(next_is_guided());
    guider.forget_light();
  }
}

}  // namespace
