// Connects camera paths' vertices with those of their light paths, a thread a connection. Rays are cast for
// those connections alone that may bring light.
#pragma once

#include "tracer/connection_kernels.hpp"

#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/index_list.hpp>
#include <wfpg/exec/tiled_array.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace render {

/// Copies the number of stored vertices. One thread runs it.
struct copy_stored_size {
  wfpg::light_vertices_view<subpath_vertex> stored;
  std::uint32_t* size;

  WFPG_HD void operator()(std::size_t) const { *size = stored.size(); }
};

/// Owns the connections of one vertex of each camera path, in a policy's memory.
template <class Exec>
class connection_list {
 public:
  /// `capacity`: most stored vertices of light paths. `max_depth`: most segments of a whole path.
  connection_list(const Exec& exec, std::size_t capacity, std::uint32_t max_depth)
      : exec_(exec),
        found_(exec, capacity),
        between_(exec, capacity),
        with_light_(exec, capacity),
        sizes_(exec, max_depth + 1) {}

  /// Forgets how many vertices there are.
  void begin() {
    exec_.fill_bytes(sizes_.data(), 0, sizes_.bytes());
    known_.clear();
  }
  /// Notes how many vertices are stored, when light paths have so many segments.
  void end_segment(const wfpg::light_vertices_view<subpath_vertex>& stored, std::uint32_t segments) {
    exec_.for_each(1, copy_stored_size{stored, sizes_.data() + segments});
  }

  /// Adds what connections of camera paths' vertices find. `segments`: of the camera paths. `joined`: those
  /// whose vertex can be connected. Waits once a sample.
  template <class World>
  void connect(const World& world, std::uint32_t segments, tiled_view<subpath_vertex> vertices,
               const wfpg::light_vertices_view<subpath_vertex>& stored, wfpg::index_list<Exec>& joined,
               const found_light& found) {
    if (known_.empty()) known_ = sizes_.to_host(exec_);
    if (segments + 1 >= world.max_depth) return;
    // Whole paths have at most max_depth segments, one of them the connection.
    const std::uint32_t size = known_[world.max_depth - segments - 1];
    const path_connections connections{vertices, stored, found_.view(), between_.view()};
    exec_.for_each(size, evaluate_connections{connections, joined.marks(), with_light_.marks()});
    with_light_.collect(exec_, size);
    with_light_.for_each(exec_, cast_connections<World>{world, connections, with_light_.marks()});
    with_light_.collect(exec_, size);
    with_light_.for_each(exec_, weight_connections{world.techniques, connections});
    joined.for_each(exec_, add_connections{connections, size, found});
  }

  std::size_t bytes() const {
    return found_.bytes() + between_.bytes() + with_light_.bytes() + sizes_.bytes();
  }

 private:
  Exec exec_;
  tiled_array<connection, Exec> found_;        // by stored vertex
  wfpg::buffer<way_densities, Exec> between_;  // by stored vertex
  wfpg::index_list<Exec> with_light_;          // stored vertices that may bring light
  wfpg::buffer<std::uint32_t, Exec> sizes_;    // number of stored vertices, by segments of light paths
  std::vector<std::uint32_t> known_;           // the same, of the sample, once they are read
};

}  // namespace render
