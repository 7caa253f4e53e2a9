// check_surface and check_surfaces.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/host/wave.hpp>
#include <wfpg/testing/check_surfaces.hpp>
#include <wfpg/testing/detail/describe.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace wfpg::detail {

/// A surface without its BSDF, and whether the octree knows of it. Without padding, which would be memory
/// that nobody wrote.
struct surface_probe {
  vec3 position, geometric_normal, normal, outgoing;
  std::uint16_t active, at_leaf;
  std::uint32_t path, path_alone;  // surface::path, and what path() of the functor returns
};

template <class Bsdf>
WFPG_HD surface_probe probe_of(const surface<Bsdf>& s, const sparse_voxel_octree_view& tree) {
  const bool look_up = s.active && !tree.empty() && is_finite(s.position);
  const bool at_leaf = !look_up || tree.nearest_leaf(s.position) != invalid_node;
  return {s.position,
          s.geometric_normal,
          s.normal,
          s.outgoing,
          std::uint16_t(s.active),
          std::uint16_t(at_leaf),
          s.path,
          s.path};
}

template <class Surfaces>
struct probe_surfaces {
  Surfaces surfaces;
  sparse_voxel_octree_view tree;
  array_view<surface_probe> probes;
  WFPG_HD void operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    probes[i] = probe_of(surfaces(ray), tree);
    if constexpr (gives_paths_v<Surfaces>) probes[i].path_alone = surfaces.path(ray);
  }
};

/// The first violation in words, or nothing.
inline std::string violation_of(const surface_probe& s) {
  if (s.active == 0) return {};
  const std::pair<const char*, vec3> vectors[] = {
      {"geometric_normal", s.geometric_normal}, {"normal", s.normal}, {"outgoing", s.outgoing}};
  if (!is_finite(s.position)) return sentence("position is ", in_words{s.position}, ", expected finite");
  for (const auto& [name, v] : vectors)
    if (!is_finite(v)) return sentence(name, " is ", in_words{v}, ", expected finite");
  for (const auto& [name, v] : vectors)
    if (std::fabs(glm::length(v) - 1.0f) > 1.0e-3f)
      return sentence(name, " is ", in_words{v}, " of length ", glm::length(v), ", expected unit length");
  if (std::fabs(glm::dot(s.outgoing, s.geometric_normal)) < 1.0e-6f)
    return sentence("outgoing ", in_words{s.outgoing}, " lies in the surface of geometric_normal ",
                    in_words{s.geometric_normal}, ", expected on one side of it");
  if (!(glm::dot(s.normal, s.geometric_normal) > 0.0f))
    return sentence("normal ", in_words{s.normal}, " and geometric_normal ", in_words{s.geometric_normal},
                    " have dot product ", glm::dot(s.normal, s.geometric_normal),
                    ", expected on the same side");
  if (s.path_alone != s.path)
    return sentence("path() is ", s.path_alone, ", expected surface::path, ", s.path);
  if (s.at_leaf == 0)
    return sentence("position ", in_words{s.position},
                    " lies in no leaf of the octree nor beside one, expected a leaf in its voxel or the 26 "
                    "around it");
  return {};
}

}  // namespace wfpg::detail

namespace wfpg::testing {

template <class Bsdf>
check_report check_surface(const surface<Bsdf>& s, const sparse_voxel_octree_view& tree) {
  return {wfpg::detail::violation_of(wfpg::detail::probe_of(s, tree))};
}

template <class Exec, class Surfaces>
check_report check_surfaces(const Exec& exec, const Surfaces& surfaces, std::size_t count,
                            const sparse_voxel_octree_view& tree) {
  using wfpg::detail::surface_probe;
  const buffer<surface_probe, Exec> device(exec, count);
  exec.for_each(count, wfpg::detail::probe_surfaces<Surfaces>{surfaces, tree, device.view()});
  const std::vector<surface_probe> host = device.to_host(exec);
  for (std::size_t i = 0; i < host.size(); ++i) {
    const std::string violation = wfpg::detail::violation_of(host[i]);
    if (!violation.empty()) return {wfpg::detail::sentence("the surface of ray ", i, ": ", violation)};
  }
  return {};
}

}  // namespace wfpg::testing
