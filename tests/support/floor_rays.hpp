// Rays at the floor of the lit unit box for kept fields, and checks for any store and its views.
#pragma once

#include "support/evaluate.hpp"
#include "support/kept_fields.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/guides/octree/field_store.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace wfpg_test {

/// A point in one of the floor's 16 nodes of level 2, away from its edges.
inline vec3 floor_place(std::uint32_t node) {
  return {0.1f + 0.26f * float(node % 4), 0.0f, 0.1f + 0.26f * float(node / 4)};
}

/// A ray at each of the first `n` places.
inline std::vector<test_surface> floor_rays(std::uint32_t n) {
  constexpr vec3 up{0, 1, 0};
  std::vector<test_surface> wave;
  for (std::uint32_t i = 0; i < n; ++i) wave.push_back(make_surface(floor_place(i), up, up));
  return wave;
}

/// Whether each slot is once in the lists of live, free or freed slots.
template <class Exec>
bool consistent(const kept_box<Exec>& box) {
  const auto counts = box.counts();
  const auto state = box.state();
  return counts.live <= counts.capacity && counts.allocated - counts.freed == counts.live &&
         counts.live + state.free - state.taken == counts.capacity;
}

struct is_guided_otherwise {
  wfpg::guide_view view;
  wfpg::array_view<const test_surface> wave;
  WFPG_HD bool operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    if (view.guides(ray)) return false;
    const test_surface& s = wave[i];
    const auto drawn = view.sample(ray, s, 0.1f, {0.3f, 0.6f});
    return drawn.technique != wfpg::sampling_technique::bsdf ||
           !alike(drawn.pdf, s.bsdf.pdf(s.outgoing, drawn.direction)) ||
           !alike(view.pdf(ray, s, s.normal), s.bsdf.pdf(s.outgoing, s.normal));
  }
};

/// Rays without a field must sample only their BSDF.
template <class Exec>
std::size_t guided_otherwise(const kept_box<Exec>& box, const wfpg::guide_view& view,
                             const std::vector<test_surface>& wave) {
  const wfpg::buffer<test_surface, Exec> device(box.exec(), wave);
  return count_where(box.exec(), wave.size(), is_guided_otherwise{view, const_view<test_surface>(device)});
}

}  // namespace wfpg_test
