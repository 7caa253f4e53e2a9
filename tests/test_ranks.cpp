// Ranks that share the paths of a sample. n ranks learn one guide: its file has the same bytes for any n, and
// every path samples the same directions.
#include "support/catch.hpp"
#include "support/evaluate.hpp"
#include "support/guiding.hpp"
#include "support/policies.hpp"
#include "support/ranks.hpp"
#include "support/scenes.hpp"

#include <wfpg/guide_file.hpp>
#include <wfpg/guides/records/irradiance_records.hpp>
#include <wfpg/guides/sarsa/sarsa_grid.hpp>
#include <wfpg/ranks/single.hpp>

#include <chrono>
#include <cstdint>
#include <functional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace {

using namespace wfpg_test;
using wfpg::kept_guide_options;
using wfpg::transient_guide_options;

constexpr std::chrono::seconds limit(10);
/// What findings are compared with: those without ranks. Ranks have kernels of their own, so where equal
/// operations may give other bits in another kernel, it is a single rank.
constexpr std::uint32_t reference = same_operations_same_bits ? 0 : 1;

/// The numbers of a path depend on its index among all paths.
struct numbers_of_paths {
  std::uint64_t seed;
  std::uint32_t first;
  std::uint32_t last_ray;  // rays go through the paths from this one down, or up where it is 0
  WFPG_HD std::uint32_t path(std::uint32_t ray) const { return last_ray > 0 ? last_ray - ray : ray; }
  WFPG_HD vec2 operator()(std::uint32_t ray, std::uint32_t dimension) const {
    return hashed_numbers{seed}(first + path(ray), dimension);
  }
};
/// A wave's rays, in either order of its paths.
struct surfaces_of_paths {
  wfpg::array_view<const test_surface> surfaces;
  numbers_of_paths numbers;
  WFPG_HD test_surface operator()(std::uint32_t ray) const { return surfaces[numbers.path(ray)]; }
};

/// What one run of all ranks has found.
struct finding {
  std::string file;                       // of rank 0
  std::vector<std::uint64_t> directions;  // a hash for each sample, depth and path
  wfpg::guider_statistics statistics;

  bool operator==(const finding& other) const { return file == other.file && directions == other.directions; }
};

/// A run to make: samples of paths of up to 3 directions.
template <class Options>
struct rank_run {
  Options options;
  std::uint32_t samples = 6;
  std::size_t paths = 600;
  std::vector<std::size_t> ends = {};  // of the ranks' paths; empty: parts of about equal size
  bool turns = false;                  // odd ranks go through their paths from the last one down
  bool batches = false;                // a caster that gets arrays of cones
  float ambient = 0.0f;                // radiance of all walls, beside the patch
  std::uint32_t moved_after = 0;       // geometry and lights move after this sample; 0: never
  std::uint32_t resumed_after = 0;     // saved and loaded after this sample; 0: never
};

kept_guide_options ranks_options() {
  kept_guide_options options = tracing_options(0);
  options.octree_resolution = 16;
  options.kept.resolution = 8;
  options.kept.budget_bytes = 150 * wfpg::field_store<one_policy>::bytes_a_slot(8);
  options.kept.recast = 8;
  options.binning.rays_per_bin = 16;
  options.lights.weights = {1.0f, 2.0f, 0.5f};
  options.lights.resolution = 4;
  return options;
}

/// The guide that options are of.
template <class Exec, class Options>
struct guide_of {
  using type = wfpg::octree_guide_for<Exec, Options>;
};
template <class Exec>
struct guide_of<Exec, wfpg::sarsa_grid_options> {
  using type = wfpg::sarsa_grid<Exec>;
};

/// What a guide has learnt: its file, or the bits of a grid's radiance.
template <class Exec, class Guide>
std::string saved(const Exec&, const wfpg::path_guider<Exec, Guide>& guider) {
  std::ostringstream out;
  wfpg::save_guide(guider, out);
  return out.str();
}
template <class Exec>
std::string saved(const Exec& exec, const wfpg::path_guider<Exec, wfpg::sarsa_grid<Exec>>& guider) {
  const wfpg::sarsa_grid_view view = guider.guide().view();
  const std::vector<float> values = evaluate(exec, 5000, [=] WFPG_HD(std::size_t i) {
    const hashed_numbers numbers{i};
    const vec2 a = numbers(0, 0), b = numbers(0, 1), c = numbers(0, 2);
    return view.radiance(vec3(a.x, a.y, b.x), glm::normalize(vec3(b.y, c.x, c.y) - 0.5f));
  });
  return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
}

/// One rank of a run.
template <class Exec, class Options>
class tracing_rank {
 public:
  using guider_type = wfpg::path_guider<Exec, typename guide_of<Exec, Options>::type>;

  tracing_rank(const rank_run<Options>& run, wfpg::communicator* ranks, std::size_t first, std::size_t end)
      : run_(run), first_(static_cast<std::uint32_t>(first)), count_(end - first) {
    options_ = run.options;
    options_.ranks = ranks;
    options_.max_paths = count_;
    if (ranks) {
      options_.first_path = first;
      options_.all_paths = run.paths;
      turns_ = run.turns && ranks->rank() % 2 == 1;
    }
  }

  /// Traces the run. `directions`: of all ranks.
  void trace(finding& found) {
    guider_type guider(exec_, box_mesh<Exec>(exec_).view(), options_);
    for (std::uint32_t sample = 0; sample < run_.samples; ++sample) {
      if constexpr (!std::is_same_v<Options, wfpg::sarsa_grid_options>)
        if (sample > 0 && sample == run_.resumed_after) {
          std::istringstream in(saved(exec_, guider));
          guider = wfpg::load_guide(exec_, in, options_);
        }
      if (sample > 0 && sample == run_.moved_after) {
        guider.invalidate({vec3(0.2f), vec3(0.4f)});
        guider.forget_light();
      }
      trace_sample(guider, sample, found.directions);
    }
    if (first_ > 0) return;
    found.file = saved(exec_, guider);
    found.statistics = guider.statistics();
  }

  void trace_sample(guider_type& guider, std::uint32_t sample, std::vector<std::uint64_t>& found) {
    std::vector<test_surface> all = mixed_surfaces(run_.paths, 7);
    std::vector<test_surface> own(all.begin() + first_,
                                  all.begin() + static_cast<std::ptrdiff_t>(first_ + count_));
    for (std::uint32_t i = 0; i < own.size(); ++i) own[i].path = i;
    const wfpg::buffer<test_surface, Exec> surfaces(exec_, own);
    const wfpg::buffer<path_step, Exec> steps(exec_, std::vector<path_step>(count_));
    const wfpg::buffer<wfpg::sampled_direction, Exec> directions(exec_, count_), of_path(exec_, count_);
    guider.begin_sample();
    const wfpg::path_recorder_view recorder = guider.recorder();
    const wfpg::light_guide_view lights = guider.lights();
    const wfpg::array_view<test_surface> at = surfaces.view();
    exec_.for_each(count_, [=] WFPG_HD(std::size_t i) {
      if (at[i].active) recorder.vertex(i, 0, at[i].position, at[i].outgoing, vec3(1.0f));
    });
    for (std::uint32_t depth = 0; depth < 3; ++depth) {
      const std::uint64_t seed = 100 * sample + depth;
      const numbers_of_paths numbers{seed, first_, turns_ ? static_cast<std::uint32_t>(count_) - 1 : 0};
      const wfpg::array_view<wfpg::sampled_direction> drawn = directions.view(), sorted = of_path.view();
      const wfpg::wave wave{depth, count_, surfaces_of_paths{const_view<test_surface>(surfaces), numbers},
                            numbers};
      batch_box_caster::log log;
      if (run_.batches)
        guider.sample_directions(wave, batch_box_caster{{}, &log}, drawn);
      else
        guider.sample_directions(wave, box_caster(), drawn);
      exec_.for_each(count_, [=] WFPG_HD(std::size_t ray) {
        sorted[numbers.path(static_cast<std::uint32_t>(ray))] = drawn[ray];
      });
      const std::vector<wfpg::sampled_direction> host = of_path.to_host(exec_);
      for (std::size_t i = 0; i < host.size(); ++i)
        found[(std::size_t(sample) * 3 + depth) * run_.paths + first_ + i] = hash_of(host[i]);
      const std::uint32_t first = first_;
      exec_.for_each(count_, [=] WFPG_HD(std::size_t i) {
        if (!at[i].active || lights.empty()) return;
        const vec2 u = hashed_numbers{seed}(first + static_cast<std::uint32_t>(i), 5);
        const wfpg::light_choice choice = lights.choose(lights.find(at[i].position, at[i].normal), u.x);
        lights.deposit(i, choice.key, (1.0f + u.y) * static_cast<float>(1u + choice.group));
      });
      trace_depth(recorder, depth, seed, surfaces.view(), steps.view(),
                  const_view<wfpg::sampled_direction>(of_path));
    }
    guider.end_sample();
  }

  void trace_depth(const wfpg::path_recorder_view& recorder, std::uint32_t depth, std::uint64_t seed,
                   wfpg::array_view<test_surface> at, wfpg::array_view<path_step> steps,
                   wfpg::array_view<const wfpg::sampled_direction> directions) {
    const std::uint32_t first = first_;
    const float ambient = run_.ambient;
    exec_.for_each(count_, [=] WFPG_HD(std::size_t i) {
      test_surface& surface = at[i];
      const wfpg::sampled_direction& d = directions[i];
      if (!surface.active) return;
      recorder.scatter(i, depth, d);
      surface.active =
          d.pdf > 0.0f && hashed_numbers{seed}(first + static_cast<std::uint32_t>(i), 2).x < 0.8f;
      if (!surface.active) return;
      path_step& step = steps[i];
      step.throughput *= surface.bsdf.eval(surface.outgoing, d.direction) / (0.8f * d.pdf);
      wfpg::ray ray;
      ray.origin = surface.position;
      ray.direction = d.direction;
      const vec3 p =
          glm::clamp(ray.origin + box_caster()(ray).distance * d.direction, vec3(0.0f), vec3(1.0f));
      surface = make_surface(p, inward_normal(p), -d.direction);
      surface.path = static_cast<std::uint32_t>(i);
      surface.active = step.throughput > 0.0f;
      recorder.vertex(i, depth + 1, p, -d.direction, vec3(step.throughput));
      recorder.emission(i, depth + 1, vec3(step.throughput * (ambient + emitted(p))));
    });
  }

 private:
  static std::uint64_t hash_of(const wfpg::sampled_direction& d) {
    std::uint64_t key = static_cast<std::uint64_t>(d.technique);
    for (const float value : {d.direction.x, d.direction.y, d.direction.z, d.pdf})
      key = wfpg::hash(key, wfpg::float_bits(value));
    return wfpg::hash(key, d.field);
  }

  rank_run<Options> run_;
  Options options_;
  std::uint32_t first_;
  std::size_t count_;
  bool turns_ = false;
  Exec exec_;
};

template <class Options>
finding nothing_of(const rank_run<Options>& run) {
  return {"", std::vector<std::uint64_t>(std::size_t(run.samples) * 3 * run.paths), {}};
}

/// Runs n ranks; 0: one without a communicator.
template <class Exec, class Options>
finding found_by(std::uint32_t n, const rank_run<Options>& run) {
  finding found = nothing_of(run);
  if (n == 0) {
    tracing_rank<Exec, Options>(run, nullptr, 0, run.paths).trace(found);
    return found;
  }
  // Threads write to other elements of the findings, and rank 0 alone to the rest.
  const std::vector<std::string> errors = run_ranks<Exec>(n, limit, [&](wfpg::communicator& ranks) {
    const std::uint32_t r = ranks.rank();
    const auto begin = [&](std::uint32_t k) {
      return run.ends.empty() || k == 0 || k == n ? run.paths * k / n : run.ends[k - 1];
    };
    tracing_rank<Exec, Options>(run, &ranks, begin(r), begin(r + 1)).trace(found);
  });
  REQUIRE(errors == std::vector<std::string>(n));
  return found;
}

template <class Exec, class Options>
finding check_any_number(const rank_run<Options>& run, std::uint32_t alone_with = reference) {
  const finding alone = found_by<Exec>(alone_with, run);
  REQUIRE(alone.file.size() > 1000);
  for (const std::uint32_t n : {1u, 2u, 3u, 4u, 8u}) {
    CAPTURE(n);
    const finding found = found_by<Exec>(n, run);
    CHECK((found.file == alone.file));  // in brackets: they are long to print
    CHECK((found.directions == alone.directions));
  }
  return alone;
}

}  // namespace

TEST_CASE("any number of ranks learns the same guide", "[ranks]") {
  rank_run<kept_guide_options> run{ranks_options(), 40, 600};
  run.moved_after = 21;
  const finding found = check_any_number<one_policy>(run);
  CHECK(found.statistics.kept.freed > 0);
  CHECK(found.statistics.kept.refreshed > 0);
  CHECK(found.statistics.deposits.total() == 0);
  // Compacted waves have their rays in another order; parts have any size.
  run.turns = true;
  CHECK((found_by<one_policy>(4, run) == found));
  run.ends = {1, 33, 599};
  CHECK((found_by<one_policy>(4, run) == found));
  // A state saved by n ranks goes on with as many, and with the same bits as one that was not saved.
  run.resumed_after = 11;
  CHECK((found_by<one_policy>(4, run) == found));
}

TEST_CASE("any number of ranks probes, compares and rests alike", "[ranks]") {
  rank_run<kept_guide_options> run{ranks_options(), 9, 20011};
  run.options.deposits_per_leaf = 8;  // a part of the paths is recorded
  run.options.least_gain = 2.0f;
  for (const float ambient : {0.0f, 0.3f}) {  // much light that unguided paths find, or little
    CAPTURE(ambient);
    run.ambient = ambient;
    run.ends = {};
    run.resumed_after = 0;
    const finding alone = found_by<one_policy>(reference, run);
    CHECK(alone.statistics.gain.paths > wfpg::guiding_gain::least_paths);
    CHECK((alone.statistics.rested_samples > 0) == (ambient > 0.0f));
    for (const std::uint32_t n : {1u, 3u, 8u}) {
      CAPTURE(n);
      CHECK((found_by<one_policy>(n, run) == alone));
    }
    run.ends = {7, 8, 9000};
    run.resumed_after = 5;
    CHECK((found_by<one_policy>(4, run) == alone));
  }
}

TEST_CASE("any number of ranks waits alike where paths have little noise", "[ranks]") {
  rank_run<kept_guide_options> run{ranks_options(), 34, 6011};
  run.options.least_gain = 2.0f;
  run.ambient = 4.0f;
  const finding alone = found_by<one_policy>(reference, run);
  CHECK(alone.statistics.gain.paths > wfpg::guiding_gain::least_paths);
  CHECK(alone.statistics.rested_samples >= 26);  // samples 3 to 28
  for (const std::uint32_t n : {1u, 3u}) {
    CAPTURE(n);
    CHECK((found_by<one_policy>(n, run) == alone));
  }
  run.ends = {7, 8, 3000};
  for (const std::uint32_t saved_after : {2u, 10u, 30u}) {
    CAPTURE(saved_after);
    run.resumed_after = saved_after;
    CHECK((found_by<one_policy>(4, run) == alone));
  }
}

TEST_CASE("ranks build equal fields under every option", "[ranks]") {
  for (const std::uint32_t kind : {0u, 1u, 2u, 3u, 4u}) {
    CAPTURE(kind);
    rank_run<kept_guide_options> run{ranks_options(), 12, 500};
    if (kind == 0) run.options.kept.max_wave_cones = 500;
    if (kind == 1) run.options.mode = wfpg::guiding_mode::plain;
    if (kind == 2) run.options.product_resolution = 4;
    run.batches = kind == 4;
    if (kind == 4) run.options.caster_buffer_bytes = 5000;
    if (kind == 3) {
      run.options.kept.learn = false;
      run.options.kept.budget_bytes /= 3;
    }
    const finding alone = found_by<one_policy>(reference, run);
    CHECK(alone.statistics.kept.live > 50);
    CHECK((alone.statistics.kept.refused > 0) == (kind == 3));
    CHECK((found_by<one_policy>(3, run) == alone));
  }
}

TEST_CASE("any number of ranks makes the same transient fields", "[ranks]") {
  rank_run<transient_guide_options> run{{}, 6, 600};
  static_cast<wfpg::octree_guide_options&>(run.options) = ranks_options();
  run.options.field_resolution = 8;
  run.options.min_field_resolution = 4;
  run.options.binning.rays_per_bin = 5;  // bins with fewer rays have another fraction of guided directions
  // Without ranks a bin's field starts from another of its rays.
  const finding found = check_any_number<one_policy>(run, 1);
  CHECK(found.statistics.depths[0].bins > 100);
  CHECK(found.statistics.depths[0].rays > 2 * found.statistics.depths[0].bins);
  run.turns = true;
  run.ends = {1, 33, 599};
  run.resumed_after = 3;
  CHECK((found_by<one_policy>(4, run) == found));
}

TEST_CASE("any number of ranks learns the same grid", "[ranks]") {
  rank_run<wfpg::sarsa_grid_options> run{{}, 12, 600};
  run.options.max_depth = 3;
  run.options.resolution = 4;
  run.options.direction_resolution = 8;
  run.options.step = 2;
  for (const auto update : {wfpg::sarsa_update::sarsa, wfpg::sarsa_update::monte_carlo}) {
    run.options.update = update;
    const finding found = check_any_number<one_policy>(run);
    CHECK(found.file.find_first_not_of('\0') != std::string::npos);
    // There are few keys, so that each has many values on every rank.
    rank_run<wfpg::sarsa_grid_options> dense = run;
    dense.options.resolution = 1;
    dense.options.direction_resolution = 4;
    CHECK((found_by<one_policy>(3, dense) == found_by<one_policy>(reference, dense)));
  }
}

TEST_CASE("ranks that do not fit together are refused by name", "[ranks]") {
  const auto message = [](std::uint32_t n,
                          const std::function<void(kept_guide_options&, std::uint32_t)>& change) {
    const std::vector<std::string> errors = run_ranks<one_policy>(n, limit, [&](wfpg::communicator& ranks) {
      const one_policy exec;
      kept_guide_options options = ranks_options();
      options.ranks = &ranks;
      options.max_paths = 100;
      options.first_path = 100 * ranks.rank();
      options.all_paths = 100 * n;
      change(options, ranks.rank());
      const wfpg::path_guider<one_policy> guider(exec, box_mesh<one_policy>(exec).view(), options);
    });
    for (const std::string& error : errors)
      if (error.find("expected") == std::string::npos) CHECK(error == errors[0]);  // all ranks say the same
    return errors[0];
  };
  CHECK(message(2, [](auto&, std::uint32_t) {}).empty());
  const auto has = [&](const std::string& words, auto change) {
    const std::string said = message(2, change);
    CAPTURE(said);
    CHECK(said.find(words) != std::string::npos);
  };
  has("differ in seed", [](auto& o, std::uint32_t r) { o.seed = r; });
  has("differ in kept.recast", [](auto& o, std::uint32_t r) { o.kept.recast = 8 + r; });
  has("differ in lights.weights",
      [](auto& o, std::uint32_t r) { o.lights.weights[0] += static_cast<float>(r); });
  has("differ in octree_resolution", [](auto& o, std::uint32_t r) { o.octree_resolution = 16u << r; });
  has("overlap at path 100", [](auto& o, std::uint32_t r) { o.max_paths = 100 + (1 - r); });
  has("leave out paths at path 99", [](auto& o, std::uint32_t r) { o.max_paths = 99 + r; });
  has("leave out paths from 150",
      [](auto& o, std::uint32_t) { o.max_paths = 75, o.first_path = o.first_path / 4 * 3; });
  has("deposit_capacity is 5, expected unset", [](auto& o, std::uint32_t) { o.deposit_capacity = 5; });
  has("max_paths is 0", [](auto& o, std::uint32_t) { o.max_paths = 0; });
  has("first_path plus max_paths", [](auto& o, std::uint32_t) { o.max_paths = 300; });

  const one_policy exec;
  kept_guide_options alone = ranks_options();
  alone.max_paths = 10;
  alone.first_path = 1;
  CHECK_THROWS_AS(wfpg::path_guider<one_policy>(exec, box_mesh<one_policy>(exec).view(), alone),
                  std::invalid_argument);
}

TEST_CASE("ranks share samples of a scene without surfaces", "[ranks]") {
  const std::vector<std::string> errors = run_ranks<one_policy>(2, limit, [&](wfpg::communicator& ranks) {
    const one_policy exec;
    kept_guide_options options = ranks_options();
    options.ranks = &ranks;
    options.max_paths = 100;
    options.first_path = 100 * ranks.rank();
    options.all_paths = 200;
    wfpg::path_guider<one_policy> guider(exec, wfpg::triangle_mesh_view{}, options);
    const wfpg::buffer<test_surface, one_policy> surfaces(exec, wall_surfaces(100, 1));
    const wfpg::buffer<wfpg::sampled_direction, one_policy> directions(exec, 100);
    for (int sample = 0; sample < 3; ++sample) {
      guider.begin_sample();
      guider.sample_directions(
          wfpg::wave{0, 100, stored_surfaces{const_view<test_surface>(surfaces)}, hashed_numbers{}},
          box_caster(), directions.view());
      guider.end_sample();
    }
  });
  CHECK(errors == std::vector<std::string>(2));
  static_assert(!wfpg::irradiance_records<one_policy>::joins_ranks, "it is refused with ranks");
}

TEST_CASE("a rank that is lost is an error of the others, whose guiders are destroyed", "[ranks]") {
  const std::vector<std::string> errors = run_ranks<one_policy>(3, limit, [&](wfpg::communicator& ranks) {
    const one_policy exec;
    kept_guide_options options = ranks_options();
    options.ranks = &ranks;
    options.max_paths = 100;
    options.first_path = 100 * ranks.rank();
    options.all_paths = 300;
    wfpg::path_guider<one_policy> guider(exec, box_mesh<one_policy>(exec).view(), options);
    for (int sample = 0; sample < 3; ++sample) {
      guider.begin_sample();
      if (sample == 1 && ranks.rank() == 1) return;
      guider.end_sample();
    }
  });
  CHECK(errors == std::vector<std::string>{"wfpg: rank 1 has ended", "", "wfpg: rank 1 has ended"});
}
