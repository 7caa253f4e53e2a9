// Implementation of irradiance_records.hpp.
#pragma once

#include <wfpg/exec/support/fill.hpp>
#include <wfpg/exec/support/sum_prefix.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/guides/records/irradiance_records.hpp>

#include <thrust/count.h>
#include <thrust/functional.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/transform_reduce.h>

#include <chrono>

namespace wfpg {
namespace detail {

/// Kernel that makes 16 rays for each direction of a record, which look at the environment. They start beyond
/// the scene and lead away from it, so that they meet no surface.
struct look_outside {
  static constexpr std::uint32_t rays_per_cell = 16;

  vec3 centre;
  float beyond;  // scene units
  std::uint64_t seed;
  ray* rays;

  WFPG_HD void operator()(std::size_t i) const {
    const auto cell = static_cast<std::uint32_t>(i / rays_per_cell);
    rays[i].direction = irradiance_record::direction(cell, unit_vec2(hash(seed, i)));
    rays[i].origin = centre + beyond * rays[i].direction;
    rays[i].t_min = 0.0f;
    rays[i].t_max = 3.0e38f;
  }
};
struct average_outside {
  const ray_hit* hits;
  float* environment;  // a cell
  WFPG_HD void operator()(std::size_t cell) const {
    constexpr std::uint32_t n = look_outside::rays_per_cell;
    float sum = 0.0f;
    for (std::uint32_t i = 0; i < n; ++i) {
      const ray_hit& hit = hits[cell * n + i];
      const bool sound = !hit.is_hit() && is_finite(hit.radiance) && hit.radiance > 0.0f;
      sum += sound ? min(hit.radiance, 1.0e30f) : 0.0f;
    }
    environment[cell] = sum / static_cast<float>(n);
  }
};

/// Kernel that gathers the radiance that arrives at each record from each direction, for records from `first`
/// on. Cones start at random leaves of the record's node. They start off the surface, on the side that they
/// lead to.
struct gather_records {
  voxel_cones<lit_nodes> cones;
  std::uint32_t level;  // of records
  std::uint32_t cones_per_direction;
  std::size_t first;
  std::uint64_t seed;
  const float* environment;  // a cell
  float* radiance;           // a cell of a record

  WFPG_HD void operator()(std::size_t i) const {
    const auto cell = static_cast<std::uint32_t>(i % irradiance_record::cells);
    const node_id node =
        cones.tree.level_begin(level) + static_cast<node_id>(first + i / irradiance_record::cells);
    const node_id begin = first_leaf_of(node), leaves = first_leaf_of(node + 1) - begin;
    const auto n = static_cast<float>(cones_per_direction);
    const float solid_angle = 4.0f * pi / (static_cast<float>(irradiance_record::cells) * n);
    float sum = 0.0f;
    for (std::uint32_t k = 0; k < cones_per_direction; ++k) {
      const std::uint64_t bits = hash(hash(hash(seed, node), cell), k);
      const vec2 u = unit_vec2(hash(bits, 1));
      const vec3 d = irradiance_record::direction(cell, {(static_cast<float>(k) + u.x) / n, u.y});
      const node_id leaf = begin + static_cast<node_id>((bits >> 32) * leaves >> 32);
      const gathered_light found = cones.gather({start(leaf, d), 0.0f, d}, solid_angle);
      sum += found.radiance + found.clear * environment[cell];
    }
    radiance[i] = min(sum / n, 1.0e30f);
  }

 private:
  /// First leaf below a node of the records' level. For one past the last node, one past the last leaf.
  WFPG_HD node_id first_leaf_of(node_id node) const {
    if (node >= cones.tree.level_begin(level + 1)) return cones.tree.node_count();
    while (!cones.tree.is_leaf(node)) node = cones.tree.first_child(node);
    return node;
  }
  WFPG_HD vec3 start(node_id leaf, vec3 direction) const {
    constexpr float voxels_off = 1.5f;  // a surface through a voxel's middle may touch the next one
    const vec3 n = unpack_voxel_normal(cones.nodes.normals[leaf]);
    const float off = voxels_off * cones.tree.grid().voxel_size();
    return cones.tree.centre(leaf) + (glm::dot(n, direction) >= 0.0f ? n : -n) * off;
  }
};

/// Kernel that computes each record's row sums above its normal or the opposite: the one with more light.
/// Most rays at the record leave that side.
struct sum_rows {
  const irradiance_record* records;
  const std::uint16_t* normals;  // a record
  normal_lattice lattice;
  const cell_cosines* cosines;
  float floor;
  record_rows* rows;

  WFPG_HD void operator()(std::size_t i) const {
    const vec3 normal = unpack_voxel_normal(normals[i]);
    const record_rows ahead(records[i], floor, cosines, lattice.index(normal));
    const record_rows behind(records[i], floor, cosines, lattice.index(-normal));
    rows[i] = ahead.total() < behind.total() ? behind : ahead;
  }
};

}  // namespace detail

template <class Exec, class Smooth>
const irradiance_records_options& irradiance_records<Exec, Smooth>::checked(
    const irradiance_records_options& o) {
  detail::require_resolution(o.octree_resolution);
  require(o.emitter_rays >= 1 && o.emitter_rays <= 1u << 31, "emitter_rays", o.emitter_rays, "in [1, 2^31]");
  require(o.albedo >= 0.0f && o.albedo <= 1.0f, "albedo", o.albedo, "in [0, 1]");
  require(o.cones_per_direction >= 1 && o.cones_per_direction <= 256, "cones_per_direction",
          o.cones_per_direction, "in [1, 256]");
  require(o.smooth_bounces <= 64, "smooth_bounces", o.smooth_bounces, "at most 64");
  require(o.floor >= 0.0f && o.floor <= 1.0f, "floor", o.floor, "in [0, 1]");
  return o;
}

template <class Exec, class Smooth>
irradiance_records<Exec, Smooth>::irradiance_records(const Exec& exec, const Exec& working,
                                                     const lit_scene<Smooth>& scene,
                                                     const irradiance_records_options& options)
    : irradiance_records(exec, working, scene, voxelize(exec, scene.mesh, checked(options).octree_resolution),
                         options) {}

template <class Exec, class Smooth>
irradiance_records<Exec, Smooth>::irradiance_records(const Exec& exec, const Exec& working,
                                                     const lit_scene<Smooth>& scene,
                                                     voxel_fragments<Exec> fragments,
                                                     const irradiance_records_options& options)
    : options_(options),
      emitters_(scene.emitters),
      smooth_(scene.smooth),
      build_(fragments.report),
      octree_(exec, fragments),
      normals_(exec, octree_.node_count()),
      swapped_(exec, octree_.node_count() - octree_.leaf_count()),
      areas_(exec, octree_.leaf_count()),
      tags_(exec, octree_.leaf_count()) {
  const sparse_voxel_octree_view tree = octree_.view();
  view_.tree_ = tree;
  view_.level_ = min(options_.record_level, tree.depth());
  records_ = buffer<irradiance_record, Exec>(exec, tree.level_size(view_.level_));
  rows_ = buffer<detail::record_rows, Exec>(exec, records_.size());
  detail::build_voxel_normals(working, octree_, fragments, normals_.view(), swapped_.view());
  const float voxel = tree.grid().voxel_size();
  working.for_each(tree.leaf_count(),
                   detail::measure_leaves{octree_.leaf_fragment_begin(), fragments.surfaces.view(),
                                          1.0f / (voxel * voxel), areas_.data()});
  octree_.release_build_data();
  fill(working, tags_, voxel_tag::object);
  exec.fill_bytes(records_.data(), 0, records_.bytes());
  exec.fill_bytes(rows_.data(), 0, rows_.bytes());
  cosines_ = buffer<detail::cell_cosines, Exec>(exec, view_.normals_.size() + 1);
  exec.for_each(cosines_.size(), detail::tabulate_cell_cosines{view_.normals_, cosines_.data()});
  view_.cosines_ = cosines_.data();
  view_.records_ = records_.data();
  view_.rows_ = rows_.data();
  view_.tags_ = tags_.data();
  view_.floor_ = options_.floor;
  statistics_.records = static_cast<std::uint32_t>(records_.size());
  statistics_.objects = tree.leaf_count();
}

template <class Exec, class Smooth>
template <class Surfaces, class Random, class Caster>
irradiance_records_view irradiance_records<Exec, Smooth>::prepare(const sample_context<Exec>& at,
                                                                  const wave<Surfaces, Random>&,
                                                                  const Caster& caster) {
  irradiance_records_view view = view_;
  if (!at.guided) return view;
  if (!is_built_) build(at.exec, caster);
  view.fraction_ = options_.guide_fraction.value_or(0.5f);
  return view;
}

template <class Exec, class Smooth>
template <class Caster>
void irradiance_records<Exec, Smooth>::build(const Exec& exec, const Caster& caster) {
  const auto begin = std::chrono::steady_clock::now();
  const std::uint32_t leaves = octree_.leaf_count();
  statistics_.rays = 0;
  buffer<std::uint64_t, Exec> weights(exec, emitters_.size());
  const detail::emitter_set from = weigh(exec, weights);
  const buffer<detail::voxel_light, Exec> nodes(exec, octree_.node_count());
  {
    const buffer<detail::leaf_light, Exec> light(exec, leaves);
    exec.fill_bytes(light.data(), 0, light.bytes());
    if (!from.empty()) send_light(exec, caster, from, light);
    light_voxels(exec, from, light, nodes);
  }
  const buffer<float, Exec> environment(exec, irradiance_record::cells);
  see_environment(exec, caster, environment);
  fill_records(exec, nodes, environment);
  count_tags(exec);
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
  statistics_.seconds = taken.count();
  ++statistics_.builds;
  is_built_ = true;
}

/// Makes the distribution of emitters by power. Its sums are integers, since those of floats depend on their
/// order.
template <class Exec, class Smooth>
detail::emitter_set irradiance_records<Exec, Smooth>::weigh(const Exec& exec,
                                                            buffer<std::uint64_t, Exec>& weights) const {
  const detail::power_of_emitter power{emitters_};
  const ::thrust::counting_iterator<std::size_t> first(0);
  const float greatest =
      ::thrust::transform_reduce(exec.thrust(), first, first + static_cast<std::ptrdiff_t>(emitters_.size()),
                                 power, 0.0f, ::thrust::maximum<float>());
  detail::emitter_set result;
  if (!(greatest > 0.0f)) return result;
  exec.for_each(emitters_.size(), detail::weigh_emitters{power, greatest, weights.data()});
  result.total = sum_prefix(exec, weights);
  result.emitters = emitters_;
  result.weights_prefix = weights.view();
  result.power_of_weight = greatest * 0x1p-24f;
  return result;
}

/// Casts rays from emitters and adds their power to the leaves where they end.
template <class Exec, class Smooth>
template <class Caster>
void irradiance_records<Exec, Smooth>::send_light(const Exec& exec, const Caster& caster,
                                                  const detail::emitter_set& from,
                                                  const buffer<detail::leaf_light, Exec>& light) {
  const std::size_t count = options_.emitter_rays, most = min<std::size_t>(count, 1u << 16);
  const buffer<ray, Exec> rays(exec, most);
  const buffer<ray_hit, Exec> hits(exec, most);
  const buffer<std::uint32_t, Exec> powers(exec, most), on_their_way(exec, 1);
  constexpr bool ends_at_once = std::is_same_v<Smooth, no_smooth_surfaces>;
  const std::uint32_t bounces = ends_at_once ? 0 : options_.smooth_bounces;
  const std::uint64_t seed = hash(options_.seed, 1);
  for (std::size_t first = 0; first < count; first += most) {
    const std::size_t n = min(most, count - first);
    exec.for_each(n, detail::emit_rays{from, off_surface(), first, count, seed, rays.data(), powers.data()});
    for (std::uint32_t bounce = 0;; ++bounce) {
      detail::cast_rays(exec, caster, array_view<const ray>(rays.data(), n), hits.view().subview(0, n));
      statistics_.rays += n;
      exec.fill_bytes(on_their_way.data(), 0, on_their_way.bytes());
      exec.for_each(n, detail::land_rays<Smooth>{smooth_, octree_.view(), normals_.data(), off_surface(),
                                                 hash(hash(seed, first), bounce), hits.data(), rays.data(),
                                                 powers.data(), light.data(), on_their_way.data()});
      if (bounce == bounces || read_element(exec, on_their_way.data()) == 0) break;
    }
  }
}

template <class Exec, class Smooth>
float irradiance_records<Exec, Smooth>::arrived_unit(const detail::emitter_set& from) const {
  const double voxel = double(octree_.view().grid().voxel_size());
  const double power = double(from.total) * double(from.power_of_weight);
  const double of_ray = power / (double(options_.emitter_rays) * double(detail::whole_ray));
  return static_cast<float>(double(options_.albedo) * of_ray / (voxel * voxel));
}

template <class Exec, class Smooth>
float irradiance_records<Exec, Smooth>::emitted_unit(const detail::emitter_set& from, float face) {
  return static_cast<float>(double(from.total) * double(from.power_of_weight) / double(face) * 0x1p-32);
}

/// Computes light and tags of leaves, and then the light of inner nodes from the leaves up.
template <class Exec, class Smooth>
void irradiance_records<Exec, Smooth>::light_voxels(const Exec& exec, const detail::emitter_set& from,
                                                    const buffer<detail::leaf_light, Exec>& light,
                                                    const buffer<detail::voxel_light, Exec>& nodes) {
  const sparse_voxel_octree_view tree = octree_.view();
  const float voxel = tree.grid().voxel_size(), unit = emitted_unit(from, voxel * voxel);
  if (!from.empty())
    exec.for_each_block(from.emitters.size(), 0,
                        detail::emit_in_leaves{from, tree, normals_.data(), unit, light.data()});
  exec.for_each(tree.leaf_count(), detail::light_leaves{light.data(), areas_.data(), tree.first_leaf(),
                                                        options_.include_emission ? unit : 0.0f,
                                                        arrived_unit(from), nodes.data(), tags_.data()});
  detail::for_each_bottom_up(exec, tree, 0, detail::gather_children{tree, swapped_.data(), nodes.data()});
}

/// Computes the environment's mean radiance in each direction of a record. All records share it.
template <class Exec, class Smooth>
template <class Caster>
void irradiance_records<Exec, Smooth>::see_environment(const Exec& exec, const Caster& caster,
                                                       const buffer<float, Exec>& environment) {
  constexpr std::size_t n = std::size_t(irradiance_record::cells) * detail::look_outside::rays_per_cell;
  const voxel_grid grid = octree_.view().grid();
  const buffer<ray, Exec> rays(exec, n);
  const buffer<ray_hit, Exec> hits(exec, n);
  exec.for_each(n, detail::look_outside{grid.origin + 0.5f * grid.side, grid.side, hash(options_.seed, 2),
                                        rays.data()});
  detail::cast_rays(exec, caster, array_view<const ray>(rays.data(), n), hits.view().subview(0, n));
  statistics_.rays += n;
  exec.for_each(environment.size(), detail::average_outside{hits.data(), environment.data()});
}

/// Fills all records by cones, 4096 at a time, and then computes their row sums.
template <class Exec, class Smooth>
void irradiance_records<Exec, Smooth>::fill_records(const Exec& exec,
                                                    const buffer<detail::voxel_light, Exec>& nodes,
                                                    const buffer<float, Exec>& environment) {
  const std::size_t most = min<std::size_t>(records_.size(), 4096);
  const buffer<float, Exec> radiance(exec, most * irradiance_record::cells);
  const detail::voxel_cones<detail::lit_nodes> cones{octree_.view(), {nodes.data(), normals_.data()}};
  for (std::size_t first = 0; first < records_.size(); first += most) {
    const std::size_t n = min(most, records_.size() - first);
    exec.for_each(n * irradiance_record::cells,
                  detail::gather_records{cones, view_.level_, options_.cones_per_direction, first,
                                         hash(options_.seed, 3), environment.data(), radiance.data()});
    exec.for_each(n, detail::count_record{radiance.data(), records_.data() + first});
  }
  exec.for_each(records_.size(),
                detail::sum_rows{records_.data(), normals_.data() + octree_.view().level_begin(view_.level_),
                                 view_.normals_, cosines_.data(), options_.floor, rows_.data()});
  statistics_.cones =
      std::uint64_t(records_.size()) * irradiance_record::cells * options_.cones_per_direction;
}

template <class Exec, class Smooth>
void irradiance_records<Exec, Smooth>::count_tags(const Exec& exec) {
  const auto count = [&](voxel_tag tag) {
    return static_cast<std::uint32_t>(
        ::thrust::count(exec.thrust(), tags_.data(), tags_.data() + tags_.size(), tag));
  };
  statistics_.objects = count(voxel_tag::object);
  statistics_.lights = count(voxel_tag::light);
  statistics_.directly_lit = count(voxel_tag::directly_lit);
}

template <class Exec, class Smooth>
std::vector<memory_part> irradiance_records<Exec, Smooth>::memory() const {
  return {{"records", records_.bytes(), true},
          {"sums of records", rows_.bytes(), true},
          {"cosines", cosines_.bytes(), true},
          {"octree", octree_.bytes() + normals_.bytes() + swapped_.bytes() + areas_.bytes() + tags_.bytes(),
           true}};
}

}  // namespace wfpg
