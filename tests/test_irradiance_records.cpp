// Irradiance records: cells and densities, known tags of voxels, builds, options.
// test_irradiance_records_light.cpp tests their cones and the means of pictures.
#include "support/catch.hpp"
#include "support/records.hpp"
#include "support/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace {

using namespace wfpg_test;
using wfpg::irradiance_record;
using wfpg::irradiance_records_options;
using wfpg::voxel_tag;

TEST_CASE("irradiance records: cells divide the sphere equally, and directions find their cell",
          "[records]") {
  random_numbers random(3);
  std::vector<int> counts(irradiance_record::cells);
  constexpr int n = 128000;
  for (int i = 0; i < n; ++i) {
    ++counts[irradiance_record::cell_of(wfpg::square_to_sphere({random.unit(), random.unit()}))];
    const std::uint32_t cell = random.below(irradiance_record::cells);
    const vec2 inside{random.between(1.0e-4f, 0.9999f), random.between(1.0e-4f, 0.9999f)};
    const vec3 d = irradiance_record::direction(cell, inside);
    REQUIRE(irradiance_record::cell_of(d) == cell);
    REQUIRE(std::fabs(glm::length(d) - 1.0f) < 1.0e-6f);
  }
  double chi_square = 0.0;
  for (const int count : counts) chi_square += (count - 1000.0) * (count - 1000.0) / 1000.0;
  CHECK(chi_square_tail(chi_square, 127) > 1.0e-3);
  CHECK(irradiance_record::cell_of({0.0f, 1.0f, 0.0f}) / 16 == 7);  // the poles are in cells too
  CHECK(irradiance_record::cell_of({0.0f, -1.0f, 0.0f}) / 16 == 0);
}

TEST_CASE("irradiance records: cells above a surface have the cosine at their highest point", "[records]") {
  random_numbers random(4);
  for (int i = 0; i < 20000; ++i) {
    const vec3 normal = random.direction(), d = random.direction();
    const std::uint32_t cell = irradiance_record::cell_of(d);
    const std::uint32_t cosine = wfpg::detail::record_cosines(normal)(cell);
    if (glm::dot(normal, d) > 0.0f) REQUIRE(cosine > 0);
    const float middle = glm::dot(normal, irradiance_record::direction(cell, {0.5f, 0.5f}));
    const float reach = cell / 16 % 7 == 0 ? 0.5f : 0.25f;
    REQUIRE(std::fabs(float(cosine) / 128.0f - std::fmax(middle + reach, 0.0f)) < 0.02f);
  }
}

TEST_CASE("irradiance records: products of cosines and counters are summed four at a time", "[records]") {
  random_numbers random(5);
  for (int i = 0; i < 200; ++i) {
    const wfpg::detail::record_cosines cosines(random.direction());
    const wfpg::detail::cell_cosines table(cosines);
    for (std::uint32_t row = 0; row < irradiance_record::rows; ++row) {
      irradiance_record record{};
      for (std::uint32_t column = 0; column < irradiance_record::columns; ++column)
        record.words[row] |= std::uint64_t(i == 0 ? irradiance_record::most : random.below(16)) << 4 * column;
      std::uint32_t row_products = 0, row_alone = 0;
      for (std::uint32_t group = 0; group < wfpg::detail::cell_cosines::groups; ++group) {
        std::uint32_t products = 0, alone = 0;
        for (std::uint32_t column = group; column < irradiance_record::columns; column += 4) {
          const std::uint32_t cell = row * irradiance_record::columns + column;
          REQUIRE(table(cell) == cosines(cell));
          products += record.counter(cell) * cosines(cell);
          alone += cosines(cell);
        }
        REQUIRE(table.dot(record.words[row], row, group) == products);
        REQUIRE(table.sum(row, group) == alone);
        row_products += products;
        row_alone += alone;
      }
      REQUIRE(table.dot(record.words[row], row) == row_products);
      REQUIRE(table.sum(row) == row_alone);
    }
  }
}

TEST_CASE("lattice of normals: each direction is near a normal, and the axes are exact", "[records]") {
  const wfpg::detail::normal_lattice lattice{16};
  for (int axis = 0; axis < 3; ++axis)
    for (const float sign : {-1.0f, 1.0f}) {
      vec3 n(0.0f);
      n[axis] = sign;
      CHECK(lattice.normal(lattice.index(n)) == n);
    }
  random_numbers random(9);
  for (int i = 0; i < 10000; ++i) {
    const vec3 n = random.direction();
    const std::uint32_t near = lattice.index(n);
    REQUIRE(near < lattice.size());
    REQUIRE(glm::dot(lattice.normal(near), n) > 0.96f);  // 16 degrees; 6 on average
  }
}

struct draw_directions {
  wfpg::irradiance_records_view view;
  vec3 place, normal;
  bool transmits;
  WFPG_HD drawn_direction operator()(std::size_t i) const {
    drawn_direction drawn;
    const vec2 u = hashed_numbers{7}(static_cast<std::uint32_t>(i), 0);
    drawn.direction = view.distribution(place, normal, transmits).sample(u, drawn.pdf);
    return drawn;
  }
};
struct density_of_direction {
  wfpg::irradiance_records_view view;
  vec3 place, normal;
  bool transmits;
  WFPG_HD float operator()(vec3 d) const { return view.distribution(place, normal, transmits).pdf(d); }
};

struct surface_side {
  const char* name;
  vec3 normal;
  bool transmits;
};

WFPG_TEST_CASE("irradiance records: densities integrate to one and match the frequencies", "[records]") {
  const Exec exec;
  chi_square_family family;
  const lit_mesh<Exec> mesh(exec, patch_lamp());
  for (const float floor : {0.0f, 0.01f, 1.0f}) {
    irradiance_records_options options = records_options();
    options.floor = floor;
    records_guider<Exec> guider(exec, mesh.scene(), options);
    begin_with_wave(exec, guider, box_caster());
    const wfpg::irradiance_records_view view = guider.guide().view();
    for (const vec3 place : {vec3(0.4f, 0.0f, 0.3f), vec3(1.0f, 0.5f, 0.5f), vec3(0.2f, 1.0f, 0.9f)}) {
      const vec3 wall = place.x == 1.0f ? vec3(-1, 0, 0) : place.y == 1.0f ? -up : up;
      const vec3 inside = glm::normalize(vec3(0.5f) - place + 0.1f * up);
      for (const auto& [kind, normal, transmits] :
           {surface_side{"the wall's normal", wall, false}, surface_side{"another normal", inside, false},
            surface_side{"both sides", wall, true}}) {
        const std::string name =
            "floor " + std::to_string(floor) + ", x " + std::to_string(place.x) + ", " + kind;
        INFO(name);
        const auto drawn = evaluate(exec, 8000, draw_directions{view, place, normal, transmits});
        sampler_check_options how;
        how.moments = false;
        const auto report = check_sampler(
            drawn, densities_by{exec, density_of_direction{view, place, normal, transmits}}, how);
        CHECK(report);
        INFO(report.message);
        family.add(report.frequencies, name);
      }
    }
  }
  INFO(family.message());
  CHECK(family.size() == 27);
  CHECK(family.accepted());
}

WFPG_TEST_CASE("irradiance records: mixtures with any BSDF report the density of their directions",
               "[records]") {
  const Exec exec;
  const lit_mesh<Exec> mesh(exec, patch_lamp());
  records_guider<Exec> guider(exec, mesh.scene(), records_options());
  guider.begin_sample();
  const std::vector<test_surface> surfaces = mixed_surfaces(1024, 5);
  const wave_of_surfaces<Exec> wave(exec, surfaces);
  const wfpg::buffer<wfpg::sampled_direction, Exec> directions(exec, surfaces.size());
  guider.sample_directions(wave.get(), box_caster(), directions.view());
  const auto view = guider.prepare(wave.get(), box_caster());
  const wfpg::buffer<test_surface, Exec> stored(exec, surfaces);
  const wfpg::array_view<const test_surface> at = stored.view();
  const wfpg::array_view<const wfpg::sampled_direction> drawn = directions.view();
  const auto densities = evaluate(exec, surfaces.size(), [=] WFPG_HD(std::size_t i) {
    return at[i].active ? view.pdf(static_cast<std::uint32_t>(i), at[i], drawn[i].direction) : 0.0f;
  });
  const auto host = directions.to_host(exec);
  int guided = 0;
  for (std::size_t i = 0; i < host.size(); ++i) {
    guided += host[i].technique == wfpg::sampling_technique::guide;
    if (host[i].technique == wfpg::sampling_technique::none) continue;
    const bool is_delta = host[i].technique == wfpg::sampling_technique::delta;
    CHECK(densities[i] == Approx(is_delta ? 0.0f : host[i].pdf).epsilon(1.0e-4));
  }
  CHECK(guided > 250);  // half of the 640 that could be guided
}

/// The known tag of a voxel in the walled box with a lamp on the left. -1 where little light grazes it.
int known_tag(wfpg::uvec3 v, const wfpg::voxel_grid& grid) {
  const vec3 lower = grid.origin + vec3(v) * grid.voxel_size(), upper = lower + grid.voxel_size();
  const auto holds = [&](int axis, float x) { return lower[axis] < x && x < upper[axis]; };
  const bool across = holds(0, wall_x), side = holds(0, 0.0f) || holds(2, 0.0f) || holds(2, 1.0f);
  const bool floor = holds(1, 0.0f), ceiling = holds(1, 1.0f);
  if (!across && !side && !floor && !ceiling && !holds(0, 1.0f)) return int(voxel_tag::empty);
  const bool in_lamp = upper.x > 0.1f && lower.x < 0.4f && upper.z > 0.3f && lower.z < 0.7f;
  if (ceiling && in_lamp) return int(voxel_tag::light);
  if (lower.x > wall_x) return int(voxel_tag::object);
  if (ceiling) return side || across ? -1 : int(voxel_tag::object);
  return int(voxel_tag::directly_lit);
}

WFPG_TEST_CASE("irradiance records: tags are right in a box with a dividing wall and a lamp", "[records]") {
  const Exec exec;
  const lit_mesh<Exec> mesh(exec, ceiling_lamp(0.1f, 0.4f, 0.3f, 0.7f, 3.0f), true);
  irradiance_records_options options = records_options();
  options.emitter_rays = 1u << 18;
  records_guider<Exec> guider(exec, mesh.scene(), options);
  const wfpg::voxel_grid grid = guider.guide().octree().view().grid();
  const std::vector<vec3> places = voxel_centres(grid);
  const auto before = evaluate(exec, places, tag_at{guider.guide().view()});
  begin_with_wave(exec, guider, walled_box_caster());
  const auto tags = evaluate(exec, places, tag_at{guider.guide().view()});
  std::uint32_t counts[4] = {};
  int wrong = 0;
  for (std::uint32_t i = 0; i < tags.size(); ++i) {
    const wfpg::uvec3 v(i % 16, i / 16 % 16, i / 256);
    const int known = known_tag(v, grid);
    ++counts[int(tags[i])];
    if (known >= 0 && int(tags[i]) != known) ++wrong;
    if ((before[i] == voxel_tag::empty) != (tags[i] == voxel_tag::empty)) ++wrong;
    if (before[i] != voxel_tag::empty && before[i] != voxel_tag::object) ++wrong;
  }
  CHECK(wrong == 0);
  const wfpg::irradiance_records_statistics& found = guider.guide().statistics();
  CHECK(found.objects == counts[int(voxel_tag::object)]);
  CHECK(found.lights == counts[int(voxel_tag::light)]);
  CHECK(found.directly_lit == counts[int(voxel_tag::directly_lit)]);
  CHECK(found.rays == (1u << 18) + 2048);
}

struct has_record {
  wfpg::irradiance_records_view view;
  WFPG_HD bool operator()(vec3 p) const { return view.record(p) != nullptr; }
};

WFPG_TEST_CASE("irradiance records: places in a node with surface, or one voxel away, have a record",
               "[records]") {
  const Exec exec;
  const lit_mesh<Exec> mesh(exec, ceiling_lamp(0.1f, 0.4f, 0.3f, 0.7f, 3.0f), true);
  for (const std::uint32_t level : {2u, 3u, 4u}) {
    irradiance_records_options options = records_options();
    options.record_level = level;
    const records_guider<Exec> guider(exec, mesh.scene(), options);
    const std::vector<vec3> places = voxel_centres(guider.guide().octree().view().grid());
    const auto tags = evaluate(exec, places, tag_at{guider.guide().view()});
    const auto found = evaluate(exec, places, has_record{guider.guide().view()});
    const int side = 16, node = side >> level;
    const auto surface = [&](int lower_x, int lower_y, int lower_z, int size) {
      for (int z = std::max(lower_z, 0); z < std::min(lower_z + size, side); ++z)
        for (int y = std::max(lower_y, 0); y < std::min(lower_y + size, side); ++y)
          for (int x = std::max(lower_x, 0); x < std::min(lower_x + size, side); ++x)
            if (tags[static_cast<std::size_t>((z * side + y) * side + x)] != voxel_tag::empty) return true;
      return false;
    };
    int wrong = 0, with = 0;
    for (int i = 0; i < side * side * side; ++i) {
      const int x = i % side, y = i / side % side, z = i / (side * side);
      const bool expected =
          surface(x / node * node, y / node * node, z / node * node, node) || surface(x - 1, y - 1, z - 1, 3);
      wrong += found[static_cast<std::size_t>(i)] != expected ? 1 : 0;
      with += expected ? 1 : 0;
    }
    INFO("level " << level);
    CHECK(wrong == 0);
    CHECK(with > 1000);
    CHECK(with < side * side * side);
  }
}

WFPG_TEST_CASE("irradiance records: they are built before the first guided wave and after light moves",
               "[records]") {
  const Exec exec;
  const lit_mesh<Exec> mesh(exec, ceiling_lamp(0.1f, 0.4f, 0.3f, 0.7f, 3.0f), true);
  irradiance_records_options options = records_options();
  options.unguided_samples = 1;
  records_guider<Exec> guider(exec, mesh.scene(), options);
  const auto view = guider.guide().view();
  const std::vector<vec3> places = voxel_centres(guider.guide().octree().view().grid());
  begin_with_wave(exec, guider, walled_box_caster());
  CHECK(guider.guide().statistics().builds == 0);
  begin_with_wave(exec, guider, walled_box_caster());
  const auto first = everything(exec, view, places);
  begin_with_wave(exec, guider, walled_box_caster());
  CHECK(guider.guide().statistics().builds == 1);
  CHECK(guider.guide().statistics().seconds > 0.0);

  guider.invalidate_all();
  begin_with_wave(exec, guider, walled_box_caster());
  CHECK(guider.guide().statistics().builds == 2);
  CHECK(everything(exec, view, places) == first);  // nothing has changed

  const auto lamp = ceiling_lamp(0.7f, 0.9f, 0.3f, 0.7f, 3.0f);
  exec.copy_from_host(mesh.emitters.data(), lamp.data(), mesh.emitters.bytes());
  CHECK(everything(exec, view, places) == first);
  guider.forget_light();
  begin_with_wave(exec, guider, walled_box_caster());  // not guided, as the first sample
  CHECK(guider.guide().statistics().builds == 2);
  begin_with_wave(exec, guider, walled_box_caster());
  CHECK(guider.guide().statistics().builds == 3);
  const std::vector<vec3> floors{{0.3f, 0.0f, 0.5f}, {0.8f, 0.0f, 0.5f}};
  const auto tags = evaluate(exec, floors, tag_at{view});
  CHECK(tags[0] == voxel_tag::object);
  CHECK(tags[1] == voxel_tag::directly_lit);
}

WFPG_TEST_CASE("irradiance records: both forms of casters give the same bits and may throw", "[records]") {
  const Exec exec;
  const lit_mesh<Exec> mesh(exec, patch_lamp());
  std::vector<std::vector<std::uint64_t>> found;
  for (const bool batch : {false, true}) {
    records_guider<Exec> guider(exec, mesh.scene(), records_options());
    if (batch) {
      batch_box_caster::log calls;
      calls.throw_at = 1;  // the second call
      const batch_box_caster caster{{}, &calls};
      CHECK_THROWS_AS(begin_with_wave(exec, guider, caster), std::runtime_error);
      CHECK(guider.guide().statistics().builds == 0);
      begin_with_wave(exec, guider, caster);
    } else {
      begin_with_wave(exec, guider, box_caster());
    }
    CHECK(guider.guide().statistics().builds == 1);
    found.push_back(
        everything(exec, guider.guide().view(), voxel_centres(guider.guide().octree().view().grid())));
  }
  CHECK(found[0] == found[1]);
}

struct bad_option {
  const char* name;
  std::function<void(irradiance_records_options&)> spoil;
};

WFPG_TEST_CASE("irradiance records: options out of range are named", "[records]") {
  const Exec exec;
  const lit_mesh<Exec> mesh(exec, patch_lamp());
  const bad_option bad_options[] = {{"octree resolution", [](auto& o) { o.octree_resolution = 48; }},
                                    {"emitter_rays", [](auto& o) { o.emitter_rays = 0; }},
                                    {"albedo", [](auto& o) { o.albedo = 1.5f; }},
                                    {"albedo", [](auto& o) { o.albedo = std::nanf(""); }},
                                    {"cones_per_direction", [](auto& o) { o.cones_per_direction = 0; }},
                                    {"smooth_bounces", [](auto& o) { o.smooth_bounces = 65; }},
                                    {"floor", [](auto& o) { o.floor = -0.1f; }},
                                    {"guide_fraction", [](auto& o) { o.guide_fraction = 2.0f; }}};
  for (const bad_option& bad : bad_options) {
    irradiance_records_options options = records_options();
    bad.spoil(options);
    const std::string message = refusal([&] { records_guider<Exec>(exec, mesh.scene(), options); });
    INFO("expected: " << bad.name << ", message: " << message);
    CHECK(message.find(bad.name) != std::string::npos);
  }
}

WFPG_TEST_CASE("irradiance records: they take 64 bytes each, and rebuilds allocate nothing", "[records]") {
  counting_resource resource;
  const Exec exec = Exec().with_resource(&resource);
  const lit_mesh<Exec> mesh(exec, patch_lamp());
  const std::size_t before = resource.bytes_in_use;
  irradiance_records_options options = records_options();
  options.max_paths = 100000;
  records_guider<Exec> guider(exec, mesh.scene(), options);
  begin_with_wave(exec, guider, box_caster());
  CHECK(guider.memory().persistent() + guider.memory().transient() == resource.bytes_in_use - before);
  const wfpg::memory_part records = guider.memory().parts[0];
  CHECK(records.name == std::string("records"));
  CHECK(records.bytes == 64 * guider.guide().statistics().records);
  CHECK(guider.guide().statistics().records == 8 * 8 * 8 - 6 * 6 * 6);  // level 3, of a box's faces
  const std::size_t allocations = resource.allocations;
  guider.forget_light();
  begin_with_wave(exec, guider, box_caster());
  CHECK(resource.allocations - allocations <= (loops_on_host ? 1 : 7));  // the test's own
}

WFPG_TEST_CASE("irradiance records: they work without light, without emitters and without a scene",
               "[records]") {
  const Exec exec;
  const std::vector<wfpg::emitting_triangle> unsound{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, 1.0f},
                                                     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, -1.0f},
                                                     {{0, 0, 0}, {1, 0, 0}, {0, std::nanf(""), 0}, 1.0f}};
  const lit_mesh<Exec> dark(exec, unsound);
  const lit_mesh<Exec> none(exec, {});
  const wfpg::lit_scene<> nothing{};
  for (const wfpg::lit_scene<>& scene : {dark.scene(), none.scene(), nothing}) {
    records_guider<Exec> guider(exec, scene, records_options(500));
    CHECK(trace_paths(exec, guider, 2, 500, box_caster()).size() == 1000);
    CHECK(guider.guide().statistics().lights + guider.guide().statistics().directly_lit == 0);
  }
  records_guider<Exec> guider(exec, none.scene().mesh, records_options(500));
  begin_with_wave(exec, guider, box_caster());
  CHECK(guider.statistics().build.skipped() == 0);
}

}  // namespace
