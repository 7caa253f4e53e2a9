// The paths of a wave that go from stage to stage together: all of them, or those of a part.
#pragma once

#include "tracer/path_state.hpp"

#include <wfpg/bins/partitioner.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/host/recorded_runs.hpp>

#include <thrust/gather.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace render {

/// Paths that wait for each other after each stage. A part of the paths is a list, so that stages and sorts
/// take no time for the others.
template <class Exec>
class staged_paths {
 public:
  /// All of `paths` paths.
  explicit staged_paths(std::size_t paths) : size_(paths) {}
  /// Those of `paths` paths that are in a part (`inside`), or all others.
  staged_paths(const Exec& exec, std::size_t paths, const wfpg::recorded_runs& part, bool inside)
      : staged_paths(exec, list_of(paths, part, inside)) {}

  /// The number of slots.
  std::size_t size() const { return size_; }
  /// Each path in a slot, in the order of paths.
  path_queue first() const {
    if (!count_.data()) return {{}, true};
    return {{list_.view(), ends_.view(), {}, {}, count_.data()}, false};
  }
  /// The active paths in the order of their materials: keys[path], or excluded. Valid until the next call.
  path_queue by_material(const Exec& exec, wfpg::partitioner<Exec>& partitioner,
                         wfpg::array_view<const std::uint32_t> keys) {
    if (!count_.data()) return {partitioner.partition(exec, keys, material_key_bits), false};
    const std::uint32_t* const list = list_.data();
    ::thrust::gather(exec.thrust(), list, list + size_, keys.data(), keys_.data());
    path_queue queue{partitioner.partition(exec, keys_.view(), material_key_bits), false};
    const std::uint32_t* const order = queue.by_material.permutation.data();
    ::thrust::gather(exec.thrust(), order, order + size_, list, sorted_.data());
    queue.by_material.permutation = sorted_.view();
    return queue;
  }

 private:
  staged_paths(const Exec& exec, const std::vector<std::uint32_t>& list)
      : size_(list.size()),
        list_(exec, list),
        keys_(exec, list.size()),
        sorted_(exec, list.size()),
        ends_(exec, std::vector<std::uint32_t>{0, static_cast<std::uint32_t>(list.size())}),
        count_(exec, std::vector<std::uint32_t>{1}) {}

  static std::vector<std::uint32_t> list_of(std::size_t paths, const wfpg::recorded_runs& part, bool inside) {
    std::vector<std::uint32_t> list;
    for (std::uint32_t path = 0; path < paths; ++path)
      if (part.includes(path) == inside) list.push_back(path);
    return list;
  }

  std::size_t size_;
  wfpg::buffer<std::uint32_t, Exec> list_;    // of paths, ascending; of none where all paths are staged
  wfpg::buffer<std::uint32_t, Exec> keys_;    // of its paths
  wfpg::buffer<std::uint32_t, Exec> sorted_;  // its active paths, by material
  wfpg::buffer<std::uint32_t, Exec> ends_;    // of the one group that first() has
  wfpg::buffer<std::uint32_t, Exec> count_;   // of that group
};

}  // namespace render
