// Joins camera paths' vertices with light samples and with the vertices of their light paths, a thread a
// join. Rays are cast for those joins alone that may bring light.
#pragma once

#include "tracer/join_kernels.hpp"

#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/index_list.hpp>
#include <wfpg/exec/tiled_array.hpp>

#include <cstddef>
#include <cstdint>

namespace render {

/// Owns the joins of one vertex of each camera path, in a policy's memory.
template <class Exec>
class join_list {
 public:
  /// `paths`: those that have a light sample a vertex, all or none. `vertices`: most stored vertices of light
  /// paths that are connected.
  join_list(const Exec& exec, std::size_t paths, std::size_t vertices)
      : exec_(exec),
        lights_(exec, paths),
        found_(exec, paths + vertices),
        between_(exec, paths + vertices),
        with_light_(exec, paths + vertices) {}

  /// Adds what light samples of camera paths' vertices find, and connections with the first `size` of
  /// `stored`. `joined`: paths whose vertex can be joined.
  template <class World>
  void join(const World& world, tiled_view<subpath_vertex> vertices,
            const wfpg::light_vertices_view<subpath_vertex>& stored, std::uint32_t size,
            wfpg::index_list<Exec>& joined, const found_light& found) {
    const path_joins joins{vertices, lights_.view(), stored, found_.view(), between_.view()};
    const std::size_t all = joins.with_stored(size);
    if (all == 0) return;
    const wfpg::array_view<std::uint32_t> marks = with_light_.marks();
    if (lights_.size() > 0) {
      exec_.fill_bytes(marks.data(), 0, lights_.size() * sizeof(std::uint32_t));
      joined.for_each(exec_, draw_lights<World>{world, joins, marks});
    }
    exec_.for_each(size, evaluate_connections{joins, joined.marks(), marks});
    with_light_.collect(exec_, all);
    with_light_.for_each(exec_, cast_joins<World>{world, joins, marks});
    with_light_.collect(exec_, all);
    with_light_.for_each(exec_, weight_joins{world.techniques, joins});
    joined.for_each(exec_, add_joins{joins, size, found});
  }

  std::size_t bytes() const {
    return lights_.bytes() + found_.bytes() + between_.bytes() + with_light_.bytes();
  }

 private:
  Exec exec_;
  tiled_array<sampled_light, Exec> lights_;    // by path
  tiled_array<render::join, Exec> found_;      // by join
  wfpg::buffer<way_densities, Exec> between_;  // by join
  wfpg::index_list<Exec> with_light_;          // joins that may bring light
};

}  // namespace render
