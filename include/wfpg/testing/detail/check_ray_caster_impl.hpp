// check_ray_caster: casts through the policy, verdicts on the host.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/math.hpp>
#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/testing/check_ray_caster.hpp>
#include <wfpg/testing/detail/describe.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace wfpg::detail {

/// Writes 1 where a hit lies in a leaf or beside one, otherwise 0.
struct find_hit_leaves {
  sparse_voxel_octree_view tree;
  array_view<const ray> rays;
  array_view<const ray_hit> hits;
  array_view<std::uint32_t> found;
  WFPG_HD void operator()(std::size_t i) const {
    const vec3 p = rays[i].origin + hits[i].distance * rays[i].direction;
    found[i] = tree.nearest_leaf(p) != invalid_node ? 1u : 0u;
  }
};

/// One check of one form of a caster: in place, or in batches. Each step gives the first violation in words,
/// or nothing. `tree` may be null.
template <bool Batch, class Exec, class Caster>
class caster_check {
 public:
  caster_check(const Exec& exec, const Caster& caster, const bounds3& bounds,
               const sparse_voxel_octree_view* tree, const testing::caster_check_options& options)
      : exec_(exec),
        caster_(caster),
        tree_(tree),
        options_(options),
        near_(options.tolerance * glm::length(bounds.extent())) {
    require(!bounds.empty(), "extent of the bounds", bounds.extent().x, "not empty");
    require(options.rays > 0, "rays", options.rays, "positive");
    require(options.tolerance >= 0.0f && options.tolerance < 1.0f, "tolerance", options.tolerance,
            "in [0, 1)");
    require(options.least_distance >= 0.0f, "least_distance", options.least_distance, "at least 0");
    require(options.least_hits >= 0.0 && options.least_hits <= 1.0, "least_hits", options.least_hits,
            "in [0, 1]");
    require(options.exceptions >= 0.0 && options.exceptions <= 1.0, "exceptions", options.exceptions,
            "in [0, 1]");
    rays_.resize(options.rays);
    for (std::size_t i = 0; i < rays_.size(); ++i) {
      const std::uint64_t state = hash(options.seed, i);
      const vec2 xy = unit_vec2(hash(state, 0)), z = unit_vec2(hash(state, 1));
      rays_[i].origin = bounds.lower + vec3(xy.x, xy.y, z.x) * bounds.extent();
      rays_[i].direction = glm::normalize(square_to_sphere(unit_vec2(hash(state, 2))));
    }
  }

  std::string run() {
    hits_ = cast(rays_);
    std::string message = values();
    if (message.empty() && Batch) message = order();
    if (message.empty()) message = anew();
    if (message.empty() && options_.limits) message = limits();
    if (message.empty() && tree_) message = leaves();
    return message;
  }

 private:
  /// The first of a number of violations, once they are too many.
  struct violations {
    std::size_t count = 0;
    std::string first;

    template <class... Parts>
    void add(const Parts&... parts) {
      if (count++ == 0) first = sentence(parts...);
    }
    std::string message(std::size_t asked, double exceptions) const {
      if (count == 0 || double(count) <= exceptions * double(asked)) return {};
      return sentence(first, " (", count, " of ", asked, " rays)");
    }
  };

  /// Hits start as NaN: what a batch leaves unwritten is found.
  std::vector<ray_hit> cast(const std::vector<ray>& rays) const {
    const float none = std::numeric_limits<float>::quiet_NaN();
    const buffer<ray, Exec> device(exec_, rays);
    const buffer<ray_hit, Exec> hits(exec_, std::vector<ray_hit>(rays.size(), ray_hit{none, none}));
    if constexpr (Batch)
      caster_.cast(exec_, array_view<const ray>(device.view()), hits.view());
    else
      exec_.for_each(rays.size(), cast_each<Caster>{caster_, device.view(), hits.view()});
    return hits.to_host(exec_);
  }

  static std::string name(const ray& r) {
    return sentence("the ray from ", in_words{r.origin}, " toward ", in_words{r.direction}, " ");
  }
  static std::string answer(const ray_hit& hit) {
    return hit.is_hit() ? sentence("hits at distance ", hit.distance) : "misses";
  }
  bool same(const ray_hit& a, const ray_hit& b) const {
    if (a.is_hit() != b.is_hit()) return false;
    if (a.is_hit()) return std::fabs(a.distance - b.distance) <= near_;
    return std::fabs(a.radiance - b.radiance) <= options_.tolerance * std::max(a.radiance, b.radiance);
  }

  std::string values() const {
    std::size_t hit_count = 0;
    for (std::size_t i = 0; i < rays_.size(); ++i) {
      const ray_hit& h = hits_[i];
      if (!is_finite(h.distance) || h.distance == 0.0f)
        return sentence(name(rays_[i]), "has distance ", h.distance, Batch ? ", or none was written," : ",",
                        " expected finite and positive, or negative for a miss");
      hit_count += h.is_hit();
      if (h.is_hit() || (is_finite(h.radiance) && h.radiance >= 0.0f)) continue;
      return sentence(name(rays_[i]), "misses with environment radiance ", h.radiance,
                      ", expected finite and at least 0");
    }
    if (double(hit_count) >= options_.least_hits * double(rays_.size())) return {};
    for (std::size_t i = 0;; ++i)
      if (!hits_[i].is_hit())
        return sentence("too few rays hit: ", hit_count, " of ", rays_.size(),
                        ", expected a share of at least ", options_.least_hits, "; ", name(rays_[i]),
                        "misses with distance ", hits_[i].distance);
  }

  std::string order() const {
    std::vector<std::size_t> place(rays_.size());
    for (std::size_t i = 0; i < place.size(); ++i) place[i] = i;
    for (std::size_t i = place.size(); i > 1; --i)
      std::swap(place[i - 1], place[hash(options_.seed, i + rays_.size()) % i]);
    std::vector<ray> shuffled(rays_.size());
    for (std::size_t i = 0; i < place.size(); ++i) shuffled[place[i]] = rays_[i];
    const std::vector<ray_hit> hits = cast(shuffled);
    violations wrong;
    for (std::size_t i = 0; i < place.size(); ++i)
      if (!same(hits_[i], hits[place[i]]))
        wrong.add("batches answer for other rays: ", name(rays_[i]), answer(hits_[i]), " as ray ", i,
                  " of its batch; in another order, as ray ", place[i], ", it ", answer(hits[place[i]]),
                  ", expected the same");
    return wrong.message(rays_.size(), options_.exceptions);
  }

  std::string anew() const {
    std::vector<ray> halfway;
    std::vector<std::size_t> of;
    for (std::size_t i = 0; i < rays_.size(); ++i) {
      if (!hits_[i].is_hit() || 0.5f * hits_[i].distance < options_.least_distance) continue;
      halfway.push_back(rays_[i]);
      halfway.back().origin += 0.5f * hits_[i].distance * rays_[i].direction;
      of.push_back(i);
    }
    const std::vector<ray_hit> hits = cast(halfway);
    violations wrong;
    for (std::size_t k = 0; k < of.size(); ++k) {
      const ray_hit expected{0.5f * hits_[of[k]].distance, 0.0f};
      if (!same(expected, hits[k]))
        wrong.add(name(rays_[of[k]]), answer(hits_[of[k]]), "; cast anew from halfway, ",
                  in_words{halfway[k].origin}, ", it ", answer(hits[k]), ", expected ", expected.distance);
    }
    return wrong.message(of.size(), options_.exceptions);
  }

  std::string limits() const {
    std::vector<ray> shortened;
    for (std::size_t i = 0; i < rays_.size(); ++i) {
      if (!hits_[i].is_hit()) continue;
      shortened.push_back(rays_[i]);
      shortened.back().t_max = 0.5f * hits_[i].distance;
    }
    const std::vector<ray_hit> hits = cast(shortened);
    violations wrong;
    for (std::size_t i = 0; i < hits.size(); ++i)
      if (hits[i].is_hit())
        wrong.add("t_max is not respected: ", name(shortened[i]), "with t_max ", shortened[i].t_max,
                  ", half the distance of its hit, ", answer(hits[i]), ", expected a miss");
    return wrong.message(hits.size(), options_.exceptions);
  }

  std::string leaves() const {
    const buffer<ray, Exec> rays(exec_, rays_);
    const buffer<ray_hit, Exec> hits(exec_, hits_);
    const buffer<std::uint32_t, Exec> found(exec_, rays_.size());
    exec_.for_each(rays_.size(), find_hit_leaves{*tree_, rays.view(), hits.view(), found.view()});
    const std::vector<std::uint32_t> at_leaf = found.to_host(exec_);
    violations wrong;
    std::size_t hit_count = 0;
    for (std::size_t i = 0; i < rays_.size(); ++i) {
      if (!hits_[i].is_hit()) continue;
      ++hit_count;
      if (at_leaf[i] == 0)
        wrong.add(name(rays_[i]), answer(hits_[i]), ", at ",
                  in_words{rays_[i].origin + hits_[i].distance * rays_[i].direction},
                  ", in no leaf of the octree nor beside one, expected a leaf in its voxel of side ",
                  tree_->grid().voxel_size(), " or the 26 around it");
    }
    return wrong.message(hit_count, options_.exceptions);
  }

  const Exec& exec_;
  const Caster& caster_;
  const sparse_voxel_octree_view* tree_;
  const testing::caster_check_options& options_;
  float near_;
  std::vector<ray> rays_;
  std::vector<ray_hit> hits_;
};

/// Checks a caster in each of its forms, and stops at the first violation.
template <class Exec, class Caster>
testing::check_report check_caster_forms(const Exec& exec, const Caster& caster, const bounds3& bounds,
                                         const sparse_voxel_octree_view* tree,
                                         const testing::caster_check_options& options) {
  static_assert(is_ray_caster_v<Caster, Exec>, "<wfpg/host/ray_caster.hpp> says what a ray caster is");
  testing::check_report report;
  if constexpr (is_inline_caster_v<Caster>)
    report = {caster_check<false, Exec, Caster>(exec, caster, bounds, tree, options).run()};
  if constexpr (is_batch_caster_v<Caster, Exec>)
    if (report) report = {caster_check<true, Exec, Caster>(exec, caster, bounds, tree, options).run()};
  return report;
}

}  // namespace wfpg::detail

namespace wfpg::testing {

template <class Exec, class Caster>
check_report check_ray_caster(const Exec& exec, const Caster& caster, const bounds3& bounds,
                              const caster_check_options& options) {
  return wfpg::detail::check_caster_forms(exec, caster, bounds, nullptr, options);
}

template <class Exec, class Caster>
check_report check_ray_caster(const Exec& exec, const Caster& caster, const sparse_voxel_octree_view& tree,
                              const caster_check_options& options) {
  const voxel_grid& grid = tree.grid();
  const float margin = grid.resolution > 4 ? grid.voxel_size() : 0.0f;
  const bounds3 inside{grid.origin + margin, grid.origin + (grid.side - margin)};
  return wfpg::detail::check_caster_forms(exec, caster, inside, &tree, options);
}

}  // namespace wfpg::testing
