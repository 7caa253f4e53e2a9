// How many vertices of light paths a sample has stored when they had so many segments. Whole paths have at
// most max_depth segments: vertices of long camera paths are joined with the first of these alone.
#pragma once

#include "tracer/bidirectional_state.hpp"

#include <wfpg/exec/buffer.hpp>

#include <cstdint>
#include <vector>

namespace render {

/// Copies the number of stored vertices. One thread runs it.
struct copy_stored_size {
  wfpg::light_vertices_view<subpath_vertex> stored;
  std::uint32_t* size;

  WFPG_HD void operator()(std::size_t) const { *size = stored.size(); }
};

/// Owns the numbers of one sample, in a policy's memory.
template <class Exec>
class stored_sizes {
 public:
  /// `max_depth`: most segments of a whole path.
  stored_sizes(const Exec& exec, std::uint32_t max_depth) : exec_(exec), sizes_(exec, max_depth + 1) {}

  /// Forgets the sample before.
  void begin() {
    exec_.fill_bytes(sizes_.data(), 0, sizes_.bytes());
    known_.clear();
  }
  /// Notes how many vertices are stored, when light paths have so many segments.
  void end_segment(const wfpg::light_vertices_view<subpath_vertex>& stored, std::uint32_t segments) {
    exec_.for_each(1, copy_stored_size{stored, sizes_.data() + segments});
  }
  /// The number of stored vertices whose light paths have at most so many segments, after the light paths. It
  /// waits once a sample.
  std::uint32_t up_to(std::uint32_t segments) {
    if (known_.empty()) known_ = sizes_.to_host(exec_);
    return known_[segments];
  }

 private:
  Exec exec_;
  wfpg::buffer<std::uint32_t, Exec> sizes_;  // by segments
  std::vector<std::uint32_t> known_;         // the same, once they are read
};

}  // namespace render
