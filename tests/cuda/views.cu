// Compiled, never run. Passes each view of the library to a kernel by value and calls it there. This checks
// that device code is annotated for the device.
#include <wfpg/exec/index_list.hpp>
#include <wfpg/octree/svo_ray_caster.hpp>
#include <wfpg/testing/check_bsdf.hpp>
#include <wfpg/testing/check_host.hpp>
#include <wfpg/testing/check_ray_caster.hpp>
#include <wfpg/testing/check_surfaces.hpp>
#include <wfpg/wfpg.hpp>

namespace cuda_compile {

struct grey {
  WFPG_HD float eval(wfpg::vec3, wfpg::vec3) const { return 0.25f; }
  WFPG_HD float pdf(wfpg::vec3, wfpg::vec3) const { return 0.25f; }
  WFPG_HD wfpg::bsdf_sample sample(wfpg::vec3, wfpg::vec2 u) const {
    return {wfpg::square_to_sphere(u), 0.25f};
  }
  WFPG_HD bool is_delta() const { return false; }
  WFPG_HD bool transmits() const { return false; }
};

struct surfaces {
  WFPG_HD wfpg::surface<grey> operator()(std::uint32_t) const { return {}; }
};

struct random_numbers {
  WFPG_HD wfpg::vec2 operator()(std::uint32_t ray, std::uint32_t) const {
    return wfpg::vec2(float(ray % 7u) / 7.0f);
  }
};

__global__ void use_octree(wfpg::sparse_voxel_octree_view tree, wfpg::vec3 p, float* out) {
  const wfpg::node_id leaf = tree.nearest_leaf(p);
  if (leaf == wfpg::invalid_node) return;
  const wfpg::node_id node = tree.node_for_cone(leaf, 1.0f, 0.1f);
  out[0] = tree.centre(node).x + tree.bounds(tree.ancestor(leaf, 1)).lower.y;
}

__global__ void use_cache(wfpg::exitance_cache_view cache, wfpg::vec3 p, float* out) {
  cache.deposit(p, wfpg::vec3(0, 0, 1), wfpg::vec3(1.0f));
  out[0] = cache.read(0, wfpg::vec3(0, 0, 1)) + cache.normal(0).x;
}

__global__ void use_recorder(wfpg::path_recorder_view recorder) {
  recorder.vertex(threadIdx.x, 0, wfpg::vec3(0.0f), wfpg::vec3(0, 0, 1), wfpg::vec3(1.0f));
  recorder.radiance(threadIdx.x, 0, wfpg::vec3(1.0f));
  recorder.emission(threadIdx.x, 1, wfpg::vec3(1.0f));
  recorder.scatter(threadIdx.x, 0, {wfpg::vec3(0, 0, 1), 1.0f, wfpg::sampling_technique::guide, {}, 0});
  recorder.escape(threadIdx.x, 1, wfpg::vec3(1.0f));
  recorder.vertex(threadIdx.x, 3, wfpg::vec3(0.0f), wfpg::vec3(0, 0, 1), wfpg::vec3(0, 0, 1), false, 1.0f);
  recorder.scatter(threadIdx.x, 3, wfpg::vec3(0, 0, 1), wfpg::no_field);
  recorder.total(threadIdx.x, 3, 1.0f);
}

__global__ void use_mixture(wfpg::guide_view view, float* out) {
  const auto mixture = view.mixture(threadIdx.x, wfpg::glossy_part::unknown(2.0f));
  float u = 0.25f;
  const wfpg::vec3 direction = mixture.choose(u) ? mixture.sample(wfpg::vec2(u)) : wfpg::vec3(0, 0, 1);
  const float pdf = mixture.pdf(direction, 0.25f) + mixture.delta_pdf(0.5f);
  out[threadIdx.x] = wfpg::roulette_scale(0.25f, pdf);
}

__global__ void use_checker(wfpg::testing::host_checker_view checker, wfpg::guide_view view) {
  const auto mixture = view.mixture(threadIdx.x, wfpg::glossy_part::none());
  checker.scatter(threadIdx.x, 0, view, mixture, wfpg::testing::host_step());
  checker.query(threadIdx.x, 0, mixture, wfpg::vec3(0, 0, 1), 0.25f, 0.25f);
  checker.radiance(threadIdx.x, 1.0f);
}

__global__ void use_path_weights(wfpg::path_techniques techniques, wfpg::path_departure to, float* out) {
  const auto light = wfpg::subpath_weights::from_light(techniques, {}).arrive({1.0f});
  const auto camera = wfpg::subpath_weights::from_camera(1.0f).arrive({1.0f});
  const auto next = light.depart(techniques, to).arrive({1.0f});
  out[0] = next.connection(techniques, to, camera, to, {1.0f}) + next.splat(techniques, to, 1.0f, {1.0f}) +
           next.merge(techniques, wfpg::merge_technique::beams, camera, to) +
           camera.next_event(techniques, to, {}, {1.0f}) + camera.light_hit(techniques, {});
}

__global__ void use_box_tree(wfpg::box_tree_view tree, wfpg::ray along, float* out) {
  const auto add = [&](std::uint32_t index) { out[index] += 1.0f; };
  tree.overlaps(along, add);
  tree.overlaps(along.origin, add);
  tree.nearest_first(along, [&](std::uint32_t place, float& t_max) { return (out[place] = t_max) > 1.0f; });
  tree.for_each_place_along(
      along, [&](std::uint32_t place) { return out[place] > 0.0f; }, add);
}

__global__ void use_photon_map(wfpg::photon_map_view map, wfpg::vec3 at, float* out) {
  map.for_each_point(at, [&](std::uint32_t index) { out[index] += map.radius(); });
}

__global__ void use_beam_map(wfpg::beam_map_view beams, wfpg::photon_map_view points, wfpg::path_beam camera,
                             float* out) {
  const auto add = [&](std::uint32_t index, const wfpg::merge_geometry& at) { out[index] += at.kernel; };
  beams.for_each_beam_along(camera, wfpg::merge_kernel::constant, add);
  points.for_each_point_along(camera, wfpg::merge_kernel::constant, add);
}

__global__ void use_light_paths(wfpg::light_vertices_view<float> vertices, wfpg::splat_view splats) {
  if (vertices.has_place(0)) vertices.write(0, 1.0f);
  splats.add(0, vertices.last(0), wfpg::vec3(vertices[vertices.previous(0)]));
  splats.skip(1);
}

struct stored_point {
  wfpg::vec3 at;
  bool inside;
  WFPG_HD wfpg::vec3 position() const { return at; }
  WFPG_HD bool in_medium() const { return inside; }
};

__global__ void use_bidirectional(wfpg::light_recorder_view<stored_point, wfpg::no_beam> recorder,
                                  wfpg::light_gather_view<stored_point, stored_point, wfpg::no_beam> gather,
                                  wfpg::path_beam camera, float* out) {
  if (recorder.leaves_beams(0)) recorder.add_beam(0, {camera});
  if (recorder.has_place(0)) recorder.write(0, {camera.origin, true});
  const auto add = [&](const auto&, const wfpg::photon_merge& at) { out[0] += at.scale; };
  gather.merge_on_surface(camera.origin, add);
  gather.merge_in_medium(camera.origin, add);
  gather.merge_points_along(camera, add);
  gather.merge_beams_along(camera, add);
}

__global__ void use_photon_estimators(wfpg::path_beam camera, wfpg::path_beam light, float* out) {
  constexpr auto kernel = wfpg::merge_kernel::epanechnikov;
  out[0] = wfpg::beam_beam_merge(kernel, camera, light, 1.0f).kernel +
           wfpg::beam_point_merge(kernel, camera, light.origin, 1.0f).kernel +
           wfpg::point_merge<3>(kernel, camera.origin, light.origin, wfpg::radius_schedule{1.0f}(2)).kernel;
}

__global__ void use_medium(wfpg::homogeneous_medium medium, wfpg::henyey_greenstein phase, float* out) {
  const auto drawn = medium.sample(0.25f, 0.5f, 1.0f);
  const auto turned = phase.sample(wfpg::vec3(0, 0, 1), wfpg::vec2(0.5f));
  out[0] = drawn.weight.x + medium.pdf(drawn.distance, drawn.scatters) + turned.pdf;
}

__global__ void use_learnt(wfpg::learnt_radiance_view learnt) {
  if (!learnt.empty()) learnt.deposit(0, wfpg::vec3(0, 0, 1), 1.0f);
}

__global__ void use_bins(wfpg::bins_view bins, float* out) {
  out[threadIdx.x] = float(bins.size(threadIdx.x) + bins.node(threadIdx.x) + bins.orientation(threadIdx.x));
}

__global__ void use_sarsa(wfpg::sarsa_grid_view guide, wfpg::sampled_direction* out, float* density) {
  const wfpg::surface<grey> s;
  out[threadIdx.x] = guide.sample(threadIdx.x, s, 0.5f, wfpg::vec2(0.25f));
  density[threadIdx.x] =
      guide.pdf(threadIdx.x, s, out[threadIdx.x].direction) + guide.radiance(s.position, wfpg::vec3(0, 0, 1));
}

__global__ void use_records(wfpg::irradiance_records_view guide, wfpg::sampled_direction* out,
                            float* density) {
  const wfpg::surface<grey> s;
  out[threadIdx.x] = guide.sample(threadIdx.x, s, 0.5f, wfpg::vec2(0.25f));
  density[threadIdx.x] = guide.pdf(threadIdx.x, s, out[threadIdx.x].direction) +
                         (guide.tag(s.position) == wfpg::voxel_tag::light ? 1.0f : 0.0f);
}

__global__ void use_guide(wfpg::guide_view guide, wfpg::sampled_direction* out, float* density) {
  const wfpg::surface<grey> s;
  out[threadIdx.x] = guide.sample(threadIdx.x, s, 0.5f, wfpg::vec2(0.25f));
  density[threadIdx.x] = guide.pdf(threadIdx.x, s, out[threadIdx.x].direction);
  if (guide.guides(threadIdx.x)) out[threadIdx.x] = guide.sample(threadIdx.x, wfpg::vec2(0.25f));
}

__global__ void use_caster(wfpg::svo_ray_caster caster, wfpg::ray r, wfpg::ray_hit* out) {
  *out = caster(r);
}

__global__ void use_cones(wfpg::svo_cone_caster caster, wfpg::ray r, wfpg::ray_hit* out) {
  *out = caster(r, 0.01f);
}

// The functors that detail/ runs in for_each.
template <class Functor>
__global__ void run(Functor f) {
  f(threadIdx.x);
}

template <class Functor>
void launch(const Functor& f) {
  run<<<1, 32>>>(f);
}

// Those that scan_places() calls.
template <class Functor>
__global__ void place(Functor f) {
  f(threadIdx.x, 0u);
}

}  // namespace cuda_compile

void launch_all(const wfpg::sparse_voxel_octree_view& tree, const wfpg::exitance_cache_view& cache,
                const wfpg::path_recorder_view& recorder, float* out, wfpg::sampled_direction* directions) {
  using namespace cuda_compile;
  namespace d = wfpg::detail;
  use_octree<<<1, 1>>>(tree, wfpg::vec3(0.0f), out);
  use_cache<<<1, 1>>>(cache, wfpg::vec3(0.0f), out);
  use_recorder<<<1, 32>>>(recorder);
  use_learnt<<<1, 1>>>({});
  use_bins<<<1, 32>>>(wfpg::bins_view{}, out);
  use_guide<<<1, 32>>>(wfpg::guide_view{}, directions, out);
  use_mixture<<<1, 32>>>(wfpg::guide_view{}, out);
  use_checker<<<1, 32>>>(wfpg::testing::host_checker_view{}, wfpg::guide_view{});
  use_caster<<<1, 1>>>(wfpg::svo_ray_caster(tree), wfpg::ray{}, nullptr);
  use_cones<<<1, 1>>>(wfpg::svo_cone_caster(cache, wfpg::voxel_opacity_view()), wfpg::ray{}, nullptr);

  launch(d::forget_vertex{});
  launch(d::count_items{});
  launch(d::mark_first_items{});
  launch(d::find_runs{});
  launch(d::emit_fragments{});
  launch(d::check_samples{});
  launch(d::emit_samples{});
  launch(d::measure_fragments{});
  launch(d::describe_leaves{});
  launch(d::link_nodes{});
  launch(d::mark_beginnings{});
  launch(d::gather_level_ends{});
  launch(d::find_child_masks{});
  launch(d::leaf_normals{});
  launch(d::inner_normals{});
  launch(d::set_group_unit{});
  launch(d::add_queued_values{});
  launch(d::fold_deposits{});
  launch(d::average_children{});
  launch(d::compose_opacity{});
  launch(wfpg::deposit_path{recorder, cache, {}});
  launch(d::starts_key_group{});
  place<<<1, 32>>>(d::number_groups{});
  place<<<1, 32>>>(d::collect_indices{});
  place<<<1, 32>>>(d::place_light_vertices{});
  launch(d::count_at_leaves<wfpg::wave_rays<surfaces>>{});
  launch(d::sum_wave_counts{});
  launch(d::ascend_to_marked{});
  launch(wfpg::sample_bsdf<wfpg::sample_ray<surfaces, random_numbers, wfpg::no_queries>>{});
  launch(d::add_counts{});

  // Kept fields.
  const wfpg::field_slots_view slots;
  wfpg::field_store_state* const state = nullptr;
  wfpg::field_wave_counts* const counts = nullptr;
  launch(d::count_rays<wfpg::wave_rays<surfaces>>{{}, tree, {}, {}});
  launch(d::forget_wave_builds{{}, counts});
  launch(d::list_builds{{}, nullptr, {}, {}, 0});
  launch(d::begin_slots{slots, nullptr, state, counts, 1, 16});
  launch(d::index_slots{slots, nullptr, nullptr, state});
  launch(wfpg::invalidate_fields{slots, nullptr, tree, {}});
  launch(d::mark_leaves{tree, {}, 3, {}});
  launch(d::sum_running_counts{tree, {}});
  launch(d::fill_top{});
  launch(d::fill_steps{});
  launch(d::count_used{{}, 0, state});
  launch(d::update_pressure{state, 0, 0});

  // Choices of lights.
  launch(d::fold_light_values{});
  launch(d::gather_light_means{tree, {}, 0, nullptr});
  launch(d::choose_light_groups{tree, {}, 0, nullptr, nullptr, nullptr, 0.5f, nullptr});

  // Checks that hosts run.
  launch(d::probe_bsdf<cuda_compile::grey>{});
  launch(d::draw_bsdf<cuda_compile::grey>{});
  launch(d::tabulate_bsdf<cuda_compile::grey>{});
  launch(d::pair_bsdf<cuda_compile::grey>{});
  launch(d::probe_surfaces<surfaces>{});
  launch(d::cast_each<wfpg::svo_ray_caster>{wfpg::svo_ray_caster(tree), {}, {}});
  launch(d::find_hit_leaves{});
  launch(d::read_recorded_path{});
}
