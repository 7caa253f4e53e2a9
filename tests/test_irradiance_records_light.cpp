// What irradiance records know of light, compared with brute force. Cones through voxels, direct light, light
// through smooth surfaces, the environment. Also the means of guided paths.
#include "support/catch.hpp"
#include "support/estimates.hpp"
#include "support/records.hpp"

#include <wfpg/octree/svo_ray_caster.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

namespace {

using namespace wfpg_test;
using wfpg::irradiance_record;
using wfpg::irradiance_records_options;
using wfpg::node_id;
using wfpg::voxel_tag;
using voxel_cones = wfpg::detail::voxel_cones<wfpg::detail::lit_nodes>;

template <class Radiance>
struct glow {
  wfpg::sparse_voxel_octree_view tree;
  Radiance radiance;
  wfpg::detail::leaf_light* light;
  WFPG_HD void operator()(std::size_t leaf) const {
    const vec3 centre = tree.centre(tree.first_leaf() + static_cast<node_id>(leaf));
    const auto arrived = static_cast<std::uint64_t>(65536.0f * radiance(centre));
    light[leaf] = {{0, 0}, {arrived, arrived}, 0};
  }
};

/// The unit box's voxels. A function of the place gives the radiance of their sides.
template <class Exec>
struct glowing_voxels {
  wfpg::sparse_voxel_octree<Exec> octree;
  wfpg::buffer<std::uint16_t, Exec> normals;
  wfpg::buffer<wfpg::detail::voxel_light, Exec> nodes;

  template <class Radiance>
  glowing_voxels(const Exec& exec, std::uint32_t resolution, const Radiance& radiance) {
    const box_mesh<Exec> mesh(exec);
    auto fragments = wfpg::voxelize(exec, mesh.view(), resolution);
    octree = wfpg::sparse_voxel_octree<Exec>(exec, fragments);
    const auto tree = octree.view();
    const std::uint32_t leaves = tree.leaf_count();
    normals = wfpg::buffer<std::uint16_t, Exec>(exec, tree.node_count());
    nodes = wfpg::buffer<wfpg::detail::voxel_light, Exec>(exec, tree.node_count());
    const wfpg::buffer<std::uint8_t, Exec> swapped(exec, tree.node_count() - leaves);
    const wfpg::buffer<wfpg::voxel_tag, Exec> tags(exec, leaves);
    const wfpg::buffer<wfpg::detail::leaf_light, Exec> light(exec, leaves);
    wfpg::detail::build_voxel_normals(exec, octree, fragments, normals.view(), swapped.view());
    // Areas of one make voxels opaque.
    const wfpg::buffer<float, Exec> areas(exec, std::vector<float>(leaves, 1.0f));
    exec.for_each(leaves, glow<Radiance>{tree, radiance, light.data()});
    exec.for_each(leaves, wfpg::detail::light_leaves{light.data(), areas.data(), tree.first_leaf(), 0.0f,
                                                     1.0f / 65536.0f, nodes.data(), tags.data()});
    wfpg::detail::for_each_bottom_up(exec, tree, 0,
                                     wfpg::detail::gather_children{tree, swapped.data(), nodes.data()});
  }
  voxel_cones cones() const { return {octree.view(), {nodes.data(), normals.data()}}; }
};

/// Radiance that differs from voxel to voxel.
struct speckles {
  WFPG_HD float operator()(vec3 p) const {
    const float x = 37.0f * p.x + 53.0f * p.y + 71.0f * p.z;
    return 0.1f + x - std::floor(x);
  }
};
struct slopes {
  WFPG_HD float operator()(vec3 p) const { return 0.2f + p.x * p.y + 0.5f * p.z * p.z; }
};

/// Difference between a thin cone's radiance and that of the voxel that a ray hits.
struct thin_cone {
  voxel_cones cones;
  WFPG_HD float operator()(std::size_t i) const {
    const hashed_numbers random{3};
    const auto ray_number = static_cast<std::uint32_t>(i);
    const vec2 place = random(ray_number, 0);
    wfpg::ray r;
    r.origin = vec3(0.2f + 0.6f * place.x, 0.2f + 0.6f * place.y, 0.5f);
    r.direction = wfpg::square_to_sphere(random(ray_number, 1));
    const wfpg::detail::gathered_light found = cones.gather(r, 1.0e-9f);
    const float distance = wfpg::svo_ray_caster(cones.tree, 0.0f, 0.0f)(r).distance;
    const node_id leaf = cones.tree.leaf_at(r.origin + distance * r.direction);
    if (leaf == wfpg::invalid_node) return 1.0f;
    const float known = cones.nodes.radiance(leaf, -r.direction);
    return std::fabs(found.radiance - known) + found.clear;
  }
};

WFPG_TEST_CASE("irradiance records: thin cones see the voxel that a ray hits", "[records]") {
  const Exec exec;
  const glowing_voxels<Exec> voxels(exec, 32, speckles());
  int wrong = 0;
  for (const float difference : evaluate(exec, 4000, thin_cone{voxels.cones()}))
    wrong += difference > 1.0e-4f ? 1 : 0;
  CHECK(wrong < 8);  // cones split by a voxel's edge
}

/// A cone as wide as a record's cell, and the mean of rays in that cell.
struct wide_cone {
  voxel_cones cones;
  WFPG_HD vec2 operator()(std::size_t i) const {
    const auto cell = static_cast<std::uint32_t>(i % irradiance_record::cells);
    const hashed_numbers random{5};
    const vec2 at = random(static_cast<std::uint32_t>(i / irradiance_record::cells), 0);
    const vec3 from(0.2f + 0.6f * at.x, 0.2f + 0.6f * at.y, 0.4f);
    constexpr float cell_angle = 4.0f * wfpg::pi / float(irradiance_record::cells);
    constexpr int n = 16;
    float sum = 0.0f;
    for (int k = 0; k < n * n; ++k) {
      const vec2 inside(float(k % n) + 0.5f, float(k / n) + 0.5f);
      sum +=
          cones.gather({from, 0.0f, irradiance_record::direction(cell, inside / float(n))}, 1.0e-9f).radiance;
    }
    const vec3 middle = irradiance_record::direction(cell, vec2(0.5f));
    return {cones.gather({from, 0.0f, middle}, cell_angle).radiance, sum / float(n * n)};
  }
};

WFPG_TEST_CASE("irradiance records: wide cones see about the mean of rays", "[records]") {
  const Exec exec;
  const glowing_voxels<Exec> voxels(exec, 32, slopes());
  double error = 0.0, bias = 0.0, known = 0.0;
  for (const vec2 found : evaluate(exec, 20 * irradiance_record::cells, wide_cone{voxels.cones()})) {
    error += std::fabs(double(found.x) - double(found.y));
    bias += double(found.x) - double(found.y);
    known += double(found.y);
  }
  CHECK(error < 0.1 * known);
  CHECK(std::fabs(bias) < 0.05 * known);
}

/// The six walls of the box, emitting.
std::vector<wfpg::emitting_triangle> glowing_walls() {
  std::vector<wfpg::emitting_triangle> walls;
  const std::vector<vec3> p = box_positions();
  for (const wfpg::uvec3 t : box_triangles()) walls.push_back({p[t.x], p[t.y], p[t.z], 1.0f, true});
  return walls;
}

WFPG_TEST_CASE("irradiance records: in a furnace all directions above a wall are equal",
               "[records][furnace]") {
  const Exec exec;
  const lit_mesh<Exec> mesh(exec, glowing_walls());
  irradiance_records_options options = records_options();
  options.albedo = 0.0f;
  records_guider<Exec> guider(exec, mesh.scene(), options);
  begin_with_wave(exec, guider, box_caster());
  for (std::uint32_t face = 0; face < 6; ++face) {
    const irradiance_record record = record_of(exec, guider.guide().view(), face_point(face, 0.55f, 0.45f));
    for (std::uint32_t cell = 0; cell < irradiance_record::cells; ++cell) {
      INFO("face " << face << ", cell " << cell);
      const float up = glm::dot(face_normal(face), irradiance_record::direction(cell, {0.5f, 0.5f}));
      if (std::fabs(up) > 0.5f) CHECK(record.counter(cell) == (up > 0.0f ? 15u : 0u));
    }
  }
  CHECK(guider.guide().statistics().objects + guider.guide().statistics().directly_lit == 0);
}

/// Radiance of the walls that the patch lights, from a point along a direction. 0 for the patch itself.
double lit_wall_radiance(vec3 from, vec3 direction, double albedo) {
  wfpg::ray r;
  r.origin = from;
  r.direction = direction;
  const vec3 p = glm::clamp(from + box_caster()(r).distance * direction, vec3(0.0f), vec3(1.0f));
  const vec3 normal = inward_normal(p);
  constexpr int n = 12;
  const float step = (patch_high - patch_low) / n;
  double irradiance = 0.0;
  for (int i = 0; i < n * n; ++i) {
    const vec3 to =
        vec3(patch_low + (float(i % n) + 0.5f) * step, 1.0f, patch_low + (float(i / n) + 0.5f) * step) - p;
    const float square = glm::dot(to, to);
    irradiance += double(patch_radiance * step * step * std::fmax(to.y * glm::dot(normal, to), 0.0f)) /
                  double(square * square + 1.0e-6f);
  }
  return albedo * irradiance / double(wfpg::pi);
}

WFPG_TEST_CASE("irradiance records: light of a lamp agrees with brute force", "[records]") {
  const Exec exec;
  const lit_mesh<Exec> mesh(exec, patch_lamp());
  irradiance_records_options options = records_options();
  options.octree_resolution = 32;
  options.record_level = 4;
  options.emitter_rays = 1u << 18;
  options.include_emission = false;
  records_guider<Exec> guider(exec, mesh.scene(), options);
  begin_with_wave(exec, guider, box_caster());
  for (const vec3 place : {vec3(0.4f, 0.0f, 0.4f), vec3(0.0f, 0.6f, 0.5f)}) {
    const vec3 normal = inward_normal(place);
    const irradiance_record record = record_of(exec, guider.guide().view(), place);
    std::vector<double> known(irradiance_record::cells), found(irradiance_record::cells);
    double all_known = 0.0, all_found = 0.0, apart = 0.0;
    for (std::uint32_t cell = 0; cell < irradiance_record::cells; ++cell) {
      for (int k = 0; k < 36; ++k) {
        const vec2 inside((float(k % 6) + 0.5f) / 6.0f, (float(k / 6) + 0.5f) / 6.0f);
        const vec3 d = irradiance_record::direction(cell, inside);
        if (glm::dot(d, normal) > 0.0f)
          known[cell] += lit_wall_radiance(place + 1.0e-3f * normal, d, double(options.albedo));
      }
      found[cell] = std::fmax(record.counter(cell) - 0.5, 0.0);  // the middle of its step
      all_known += known[cell];
      all_found += found[cell];
    }
    for (std::uint32_t cell = 0; cell < irradiance_record::cells; ++cell)
      apart += 0.5 * std::fabs(found[cell] / all_found - known[cell] / all_known);
    INFO("place " << place.x << " " << place.y);
    CHECK(apart < 0.2);  // fraction of the light in wrong directions
  }
}

/// Lets light through the upper half of the wall.
struct window {
  WFPG_HD wfpg::smooth_bounce operator()(std::uint32_t, const wfpg::ray& r, float distance, vec2) const {
    const vec3 p = r.origin + distance * r.direction;
    return {std::fabs(p.x - wall_x) < 1.0e-4f && p.y > 0.5f, r.direction, 1.0f};
  }
};
/// Reflects all light back.
struct mirrors {
  WFPG_HD wfpg::smooth_bounce operator()(std::uint32_t, const wfpg::ray& r, float, vec2) const {
    return {true, -r.direction, 1.0f};
  }
};

/// The lowest and highest point at which light from the lamp crosses the wall to a voxel.
vec2 heights_at_wall(vec3 lower, vec3 upper) {
  vec2 range(2.0f, -1.0f);
  for (int i = 0; i < 8; ++i) {
    const vec3 to(i & 1 ? upper.x : lower.x, i & 2 ? upper.y : lower.y, 0.0f);
    const vec3 from(i & 4 ? 0.4f : 0.1f, 1.0f, 0.0f);
    const float y = from.y + (wall_x - from.x) / (to.x - from.x) * (to.y - from.y);
    range = {std::fmin(range.x, y), std::fmax(range.y, y)};
  }
  return range;
}

WFPG_TEST_CASE("irradiance records: voxels behind a window are lit where light comes through", "[records]") {
  const Exec exec;
  const lit_mesh<Exec> mesh(exec, ceiling_lamp(0.1f, 0.4f, 0.3f, 0.7f, 3.0f), true);
  irradiance_records_options options = records_options();
  options.emitter_rays = 1u << 18;
  records_guider<Exec, window> guider(exec, mesh.scene(window()), options);
  begin_with_wave(exec, guider, walled_box_caster());
  const wfpg::voxel_grid grid = guider.guide().octree().view().grid();
  const std::vector<vec3> places = voxel_centres(grid);
  const auto tags = evaluate(exec, places, tag_at{guider.guide().view()});
  int lit = 0, dark = 0, wrong = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const vec3 lower = places[i] - 0.5f * grid.voxel_size(), upper = lower + grid.voxel_size();
    if (tags[i] == voxel_tag::empty || lower.x < wall_x || upper.y > 1.0f) continue;
    const vec2 heights = heights_at_wall(lower, upper);
    if (heights.x > 0.51f) {
      ++lit;
      wrong += tags[i] != voxel_tag::directly_lit;
    } else if (heights.y < 0.49f) {
      ++dark;
      wrong += tags[i] != voxel_tag::object;
    }
  }
  CHECK(lit > 100);
  CHECK(dark > 10);
  CHECK(wrong == 0);
}

/// What a place at the far wall knows of the direction to the lamp behind the window.
template <class Exec, class Smooth>
std::uint32_t seen_of_lamp(const Exec& exec, const Smooth& smooth) {
  const lit_mesh<Exec> mesh(exec, ceiling_lamp(0.1f, 0.4f, 0.3f, 0.7f, 3.0f), true);
  irradiance_records_options options = records_options();
  options.emitter_rays = 1u << 18;
  records_guider<Exec, Smooth> guider(exec, mesh.scene(smooth), options);
  begin_with_wave(exec, guider, walled_box_caster());
  const vec3 place(1.0f, 0.4f, 0.5f), lamp(0.25f, 1.0f, 0.5f);
  const irradiance_record record = record_of(exec, guider.guide().view(), place);
  return record.counter(irradiance_record::cell_of(glm::normalize(lamp - place)));
}

WFPG_TEST_CASE("irradiance records: a lamp is seen through smooth surfaces", "[records]") {
  const Exec exec;
  CHECK(seen_of_lamp(exec, window()) >= 8);                    // the lamp is in neighbouring cells too
  CHECK(seen_of_lamp(exec, wfpg::no_smooth_surfaces()) <= 1);  // no light there at all
}

WFPG_TEST_CASE("irradiance records: light between mirrors ends", "[records]") {
  const Exec exec;
  const lit_mesh<Exec> mesh(exec, patch_lamp());
  irradiance_records_options options = records_options();
  options.smooth_bounces = 3;
  records_guider<Exec, mirrors> guider(exec, mesh.scene(mirrors()), options);
  begin_with_wave(exec, guider, box_caster());
  CHECK(guider.guide().statistics().rays == 4 * options.emitter_rays + 2048);
  CHECK(guider.guide().statistics().directly_lit == 0);
  CHECK(guider.guide().statistics().lights > 0);
}

/// A sky of radiance 5 above.
struct sky_caster {
  WFPG_HD wfpg::ray_hit operator()(const wfpg::ray& r) const {
    return {-1.0f, r.direction.y > 0.0f ? 5.0f : 0.0f};
  }
};

WFPG_TEST_CASE("irradiance records: cones that leave the octree see the environment", "[records]") {
  const Exec exec;
  const wfpg::buffer<vec3, Exec> positions(exec, box_positions());
  const std::vector<wfpg::uvec3> floor{{0, 4, 5}, {0, 5, 1}};
  const wfpg::buffer<wfpg::uvec3, Exec> triangles(exec, floor);
  const wfpg::triangle_mesh_view mesh{const_view<vec3>(positions), const_view<wfpg::uvec3>(triangles)};
  records_guider<Exec> guider(exec, mesh, records_options());
  begin_with_wave(exec, guider, sky_caster());
  const irradiance_record record = record_of(exec, guider.guide().view(), {0.5f, 0.0f, 0.5f});
  for (std::uint32_t cell = 0; cell < irradiance_record::cells; ++cell) {
    INFO("cell " << cell);
    CHECK(record.counter(cell) == (cell / irradiance_record::columns >= 4 ? 15u : 0u));
  }
}

/// Estimate of the radiance that paths gather under guidance of records.
template <class Exec>
std::vector<float> guided_paths(const Exec& exec, const irradiance_records_options& options) {
  const lit_mesh<Exec> mesh(exec, patch_lamp());
  records_guider<Exec> guider(exec, mesh.scene(), options);
  return trace_paths(exec, guider, 16, options.max_paths, box_caster());
}

WFPG_TEST_CASE("irradiance records: guided paths keep the mean, lower the variance, and reruns agree",
               "[records]") {
  const Exec exec;
  irradiance_records_options options = records_options(0);
  options.max_paths = 2048;
  options.max_depth = 3;
  options.unguided_samples = 1000;
  const estimate unguided = estimate_of(guided_paths(exec, options));
  options.unguided_samples = 0;
  CHECK(guided_paths(exec, options) == guided_paths(exec, options));
  for (const float fraction : {0.0f, 0.3f, 1.0f})
    for (const bool include_emission : {true, false}) {
      INFO("fraction " << fraction << (include_emission ? "" : ", without emission"));
      options.guide_fraction = unless_zero(fraction);
      options.include_emission = include_emission;
      options.floor = fraction == 1.0f ? 1.0f : 0.01f;  // a test of means needs bounded weights
      const estimate found = estimate_of(guided_paths(exec, options));
      INFO("variance " << found.variance << ", unguided " << unguided.variance);
      CHECK(std::fabs(found.mean - unguided.mean) < 4.0 * std::sqrt(found.variance + unguided.variance));
      if (include_emission && fraction < 1.0f) CHECK(found.variance < 0.7 * unguided.variance);
    }
}

}  // namespace
