// A field store over the lit unit box, samples and waves for it, and a caster that logs its cones.
#pragma once

#include "support/evaluate.hpp"
#include "support/guiding.hpp"
#include "support/lit_box.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/guides/octree/field_store.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace wfpg_test {

/// Inline caster of the box. Logs cones from any number of threads.
struct noting_caster {
  std::uint32_t* count;
  wfpg::array_view<wfpg::ray> cones;
  box_caster box;
  WFPG_HD wfpg::ray_hit operator()(const wfpg::ray& cone) const {
    const std::uint32_t at = wfpg::atomic_add(count, 1);
    if (at < cones.size()) cones[at] = cone;
    return box(cone);
  }
};

/// Counts cones, and stores the first ones.
template <class Exec>
class cone_log {
 public:
  cone_log(const Exec& exec, std::size_t room)
      : exec_(exec), count_(exec, std::vector<std::uint32_t>{0}), cones_(exec, room) {}

  noting_caster caster() const { return {count_.data(), cones_.view(), {}}; }
  std::size_t count() const { return wfpg::read_element(exec_, count_.data()); }
  /// Returns the count and resets it.
  std::size_t take() {
    const std::size_t counted = count();
    count_ = wfpg::buffer<std::uint32_t, Exec>(exec_, std::vector<std::uint32_t>{0});
    return counted;
  }
  std::vector<wfpg::ray> cones() const { return cones(std::min(count(), cones_.size())); }
  /// The first n cones, also after take().
  std::vector<wfpg::ray> cones(std::size_t n) const { return cones_.to_host(exec_, n); }

 private:
  Exec exec_;
  wfpg::buffer<std::uint32_t, Exec> count_;
  wfpg::buffer<wfpg::ray, Exec> cones_;
};

inline float patch_light(std::uint32_t face, float u, float v) {
  return emitted(face_point(face, u, v));
}

/// Options whose budget is `slots` slots.
inline wfpg::kept_field_options slots_of(std::uint32_t resolution, std::size_t slots,
                                         std::uint32_t recast = 4, bool learns = false) {
  wfpg::kept_field_options options;
  options.learn = learns;
  options.resolution = resolution;
  options.recast = recast;
  options.budget_bytes = slots * wfpg::field_store<one_policy>::bytes_a_slot(resolution, learns);
  return options;
}

struct note_number {
  wfpg::array_view<std::uint32_t> numbers;
  WFPG_HD void operator()(std::size_t ray, std::uint32_t field) const { numbers[ray] = field; }
};

/// A store over the box with the patch. Bins are nodes of level 2 until levels are marked.
template <class Exec>
struct kept_box {
  lit_box<Exec> box{patch_light};
  wfpg::field_store<Exec> store;
  wfpg::guiding_mode mode;
  wfpg::field_options field;
  std::uint32_t sample = 0;
  cone_log<Exec> log;
  wfpg::buffer<test_surface, Exec> surfaces;  // of the last wave

  static constexpr std::size_t max_rays = 1024;

  explicit kept_box(const wfpg::kept_field_options& options,
                    wfpg::guiding_mode guiding = wfpg::guiding_mode::oriented, std::size_t noted = 0,
                    std::size_t max_values = 0)
      : store(box.exec, box.tree.view(), {2, 32}, options, max_rays, max_values),
        mode(guiding),
        log(box.exec, noted) {}

  const Exec& exec() const { return box.exec; }
  void begin() {
    ++sample;
    store.begin_sample(exec(), sample, sample);
  }
  void end() { store.end_sample(exec()); }

  template <class Caster>
  wfpg::guide_view prepare(const std::vector<test_surface>& wave, const Caster& caster,
                           std::size_t buffer_bytes = std::size_t(1) << 20) {
    return store.prepare(exec(), kept(wave), caster, buffer_bytes);
  }
  wfpg::guide_view prepare(const std::vector<test_surface>& wave) { return prepare(wave, log.caster()); }
  /// A wave that makes no fields. Returns each ray's field number.
  std::vector<std::uint32_t> find(const std::vector<test_surface>& wave) {
    const wfpg::buffer<std::uint32_t, Exec> numbers(exec(), wave.size());
    store.find_and_sample(exec(), kept(wave), note_number{numbers.view()});
    return numbers.to_host(exec());
  }
  /// The number of cones that a wave casts.
  std::size_t cones(const std::vector<test_surface>& wave) {
    log.take();
    prepare(wave);
    return log.take();
  }
  /// Repeats a wave until all its rays have fields. A wave allocates only one slot per hash bucket.
  wfpg::guide_view prepare_all(const std::vector<test_surface>& wave) {
    std::uint64_t allocated = 0;
    do {
      allocated = counts().allocated;
      prepare(wave);
    } while (counts().allocated != allocated);
    return prepare(wave);
  }
  /// A sample of one repeated wave.
  wfpg::guide_view whole_sample(const std::vector<test_surface>& wave) {
    begin();
    const wfpg::guide_view view = prepare_all(wave);
    end();
    return view;
  }

  wfpg::kept_field_statistics counts() const { return store.statistics(exec()); }
  wfpg::field_store_state state() const { return wfpg::read_element(exec(), store.state()); }
  wfpg::field_wave_counts last_wave() const { return wfpg::read_element(exec(), store.last_wave()); }
  /// A ray's field. Its cells are in the policy's memory.
  wfpg::directional_field field_of(const wfpg::guide_view& view, std::uint32_t ray) const {
    return evaluate(exec(), [=] WFPG_HD() { return view.mixture(ray).field; });
  }

 private:
  wfpg::kept_field_wave<stored_surfaces> kept(const std::vector<test_surface>& wave) {
    surfaces = wfpg::buffer<test_surface, Exec>(exec(), wave);
    return {wave.size(),
            {const_view<test_surface>(surfaces)},
            box.cache.view(),
            field,
            mode,
            0.7f,
            wfpg::hash(7, sample),
            {}};
  }
};

/// Rays of one place, `n` times.
inline std::vector<test_surface> rays_at(vec3 position, vec3 normal, std::size_t n = 1) {
  return std::vector<test_surface>(n, make_surface(position, normal, normal));
}

/// A hash of a ray's field: frame, fraction and every weight.
WFPG_HD inline std::uint64_t field_bits(const wfpg::guide_mixture& mixture) {
  if (mixture.field.empty()) return 0;
  const wfpg::grid_distribution& grid = mixture.field.grid();
  std::uint64_t bits = wfpg::hash(mixture.field.hemisphere(), grid.resolution());
  for (int axis = 0; axis < 3; ++axis)
    bits = wfpg::hash(bits, wfpg::float_bits(mixture.field.normal()[axis]));
  bits = wfpg::hash(bits, wfpg::float_bits(mixture.fraction));
  for (std::uint32_t i = 0; i < grid.resolution() * grid.resolution(); ++i)
    bits = wfpg::hash(bits, grid.weight(i % grid.resolution(), i / grid.resolution()));
  return bits;
}

template <class Exec>
std::vector<std::uint64_t> field_bits(const Exec& exec, const wfpg::guide_view& view, std::size_t rays) {
  return evaluate(exec, rays, [=] WFPG_HD(std::size_t ray) {
    return field_bits(view.mixture(static_cast<std::uint32_t>(ray)));
  });
}

}  // namespace wfpg_test
