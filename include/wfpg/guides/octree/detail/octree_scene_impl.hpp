// Implementation of octree_scene.hpp.
#pragma once

#include <wfpg/guides/octree/octree_scene.hpp>

namespace wfpg {

template <class Exec>
void octree_scene<Exec>::require_valid(const octree_guide_options& o) {
  detail::require_resolution(o.octree_resolution);
  require(o.binning.rays_per_bin >= 1, "binning.rays_per_bin", o.binning.rays_per_bin, "at least 1");
  require(o.field.filter_alpha >= 0.0f, "field.filter_alpha", o.field.filter_alpha, "finite, at least 0");
  require(o.field.floor >= 0.0f, "field.floor", o.field.floor, "finite, at least 0");
  require(product_resolution(o) == 0 || o.guide_fraction.value_or(0.5f) < 1.0f, "guide_fraction",
          o.guide_fraction.value_or(0.5f),
          "less than 1 with products, which do not reach all that a BSDF does");
  require(o.product_resolution.value_or(4) >= 4, "product_resolution", o.product_resolution.value_or(4),
          "4, 8 or 16, or unset for none");
  detail::require_valid(o.lights);
  require(o.deposits_per_leaf.value_or(1) >= 1, "deposits_per_leaf", o.deposits_per_leaf.value_or(1),
          "at least 1, or unset to record all paths");
  require(o.deposit_capacity.value_or(0) <= detail::most_queued, "deposit_capacity",
          o.deposit_capacity.value_or(0), "at most 2^31");
  require(!o.ranks || o.deposit_capacity.value_or(0) == 0, "deposit_capacity", o.deposit_capacity.value_or(0),
          "unset with ranks: paths are recorded then");
}

template <class Exec>
octree_scene<Exec>::octree_scene(const Exec& exec, const Exec& working, voxel_fragments<Exec> fragments,
                                 const octree_guide_options& options)
    : options_((require_valid(options), options)),
      build_(fragments.report),
      octree_(exec, fragments),
      cache_(exec, octree_, fragments, deposits_of_sample(), options.ranks),
      meter_(working, compared_paths(), options.ranks),
      product_points_(working, std::size_t(2) * product_resolution(options) * product_resolution(options)),
      counts_(working, options_.max_depth),
      shared_counts_(working, options.ranks ? 2 * counts_.size() : 0) {
  // The cache has read the sorted fragments: they are not needed any more.
  octree_.release_build_data();
  lights_ = light_guide<Exec>(
      working, octree_.view(), options_.lights,
      options_.ranks ? rays_of_ranks() : max(options_.max_paths, options_.max_rays.value_or(0)),
      options_.max_depth, options_.ranks, options_.max_paths,
      static_cast<std::uint32_t>(options_.first_path));
  working.fill_bytes(counts_.data(), 0, counts_.bytes());
  // The means and radii of blocks do not change: measured once.
  const std::uint32_t p = product_resolution(options_);
  product_point* const hemisphere = product_points_.data();
  if (p > 0) working.for_each(std::size_t(p) * p, measure_product_blocks{hemisphere, hemisphere + p * p, p});
}

template <class Exec>
std::size_t octree_scene<Exec>::deposits_of_sample() const {
  if (options_.deposit_capacity) return *options_.deposit_capacity;
  return recorded().vertices("deposits_per_leaf, or deposit_capacity");
}

template <class Exec>
void octree_scene<Exec>::agree_scene(const Exec& exec, agreed_items& items) const {
  const octree_guide_options& o = options_;
  items.add("octree_resolution", std::uint64_t(o.octree_resolution));
  const voxel_grid grid = octree_.view().grid();
  items.add("the scene's bounds", std::vector<float>{grid.origin.x, grid.origin.y, grid.origin.z, grid.side});
  items.add("the scene's voxels", leaf_codes(exec, octree_.view()));
  items.add("the scene's normals", cache_.normals(exec));
  items.add("mode", std::uint64_t(o.mode));
  items.add("binning.min_level", std::uint64_t(o.binning.min_level));
  items.add("binning.rays_per_bin", std::uint64_t(o.binning.rays_per_bin));
  items.add("field.filter_alpha", o.field.filter_alpha);
  items.add("field.floor", o.field.floor);
  items.add("field.absolute_floor", std::uint64_t(o.field.absolute_floor));
  items.add("product_resolution", std::uint64_t(product_resolution(o)));
  items.add("deposits_per_leaf", std::uint64_t(o.deposits_per_leaf.value_or(0)));
  items.add("lights.weights", o.lights.weights);
  items.add("lights.resolution", std::uint64_t(o.lights.resolution));
  items.add("lights.floor", o.lights.floor);
  items.add("scene_tag", o.scene_tag);
}

template <class Exec>
mixture_fraction octree_scene<Exec>::fraction() const {
  // As fields in memory store them, so that both forms of a guide sample alike.
  const auto stored = [](float f) { return resident_field(vec3(0.0f), f).fraction(); };
  // An option counts for bins of every size.
  if (options_.guide_fraction) return {stored(*options_.guide_fraction), stored(*options_.guide_fraction), 0};
  if (options_.mode == guiding_mode::plain) return {stored(0.5f), stored(0.5f), 0};
  return {stored(0.7f), stored(0.5f), options_.binning.rays_per_bin};
}

template <class Exec>
product_points octree_scene<Exec>::draw_points(const sample_context<Exec>& at, std::uint32_t depth) {
  const std::uint32_t p = product_resolution(options_);
  if (p == 0) return {};
  product_point* const hemisphere = product_points_.data();
  at.exec.for_each(std::size_t(p) * p,
                   draw_product_points{hemisphere, hemisphere + p * p, p, hash(at.seed, depth)});
  return {hemisphere, hemisphere + p * p, p};
}

template <class Exec>
std::vector<memory_part> octree_scene<Exec>::scene_memory(const std::vector<memory_part>& kept,
                                                          std::size_t values, std::size_t binning,
                                                          std::size_t fields) const {
  std::vector<memory_part> parts{{"octree", octree_.bytes(), true},
                                 {"cache", cache_.persistent_bytes(), true}};
  parts.insert(parts.end(), kept.begin(), kept.end());
  parts.push_back({"lights", lights_.persistent_bytes(), true});
  parts.push_back({"compared paths", meter_.bytes(), true});
  parts.push_back({"deposits", cache_.transient_bytes() + values + lights_.transient_bytes(), false});
  parts.push_back(
      {"binning", binning + counts_.bytes() + shared_counts_.bytes() + product_points_.bytes(), false});
  parts.push_back({"fields", fields, false});
  return parts;
}

}  // namespace wfpg
