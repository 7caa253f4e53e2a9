// The paths of a wave that go from stage to stage together: all of them, or those of a part. GPUs take them
// in the order of their materials, so that a warp's paths do the same work. CPUs take them as they come: a
// sort takes longer there than it saves.
#pragma once

#include "tracer/path_state.hpp"

#include <wfpg/bins/partitioner.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/host/recorded_runs.hpp>

#include <thrust/copy.h>
#include <thrust/gather.h>
#include <thrust/iterator/counting_iterator.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace render {

/// Makes queues of active paths. Its queues are valid until it makes the next one.
template <class Exec>
class queue_maker {
 public:
  /// Key of a path that has ended. Others have their material's kind, below 2^material_key_bits - 1.
  static constexpr std::uint32_t ended = wfpg::partitioner<Exec>::excluded;

  /// For waves of up to `paths` paths.
  queue_maker(const Exec& exec, std::size_t paths)
      : partitioner_(exec, sorts ? paths : 0),
        paths_(exec, sorts ? 0 : paths),
        ends_(exec, std::vector<std::uint32_t>{0, 0}),
        count_(exec, std::vector<std::uint32_t>{0}) {}

  /// The active ones of all paths. `keys`: a path's, or `ended`.
  path_queue of_all(const Exec& exec, wfpg::array_view<const std::uint32_t> keys) {
    if constexpr (sorts)
      return {partitioner_.partition(exec, keys, material_key_bits), false};
    else
      return copied(exec, ::thrust::counting_iterator<std::uint32_t>(0), keys.size(), keys);
  }
  /// The active ones of listed paths.
  path_queue of(const Exec& exec, wfpg::array_view<const std::uint32_t> list,
                wfpg::array_view<const std::uint32_t> keys) {
    if constexpr (sorts) {
      if (keys_.size() < list.size()) {
        keys_ = wfpg::buffer<std::uint32_t, Exec>(exec, list.size());
        paths_ = wfpg::buffer<std::uint32_t, Exec>(exec, list.size());
      }
      const wfpg::array_view<std::uint32_t> of_list(keys_.data(), list.size());
      ::thrust::gather(exec.thrust(), list.begin(), list.end(), keys.data(), of_list.begin());
      path_queue queue{partitioner_.partition(exec, of_list, material_key_bits), false};
      const wfpg::array_view<const std::uint32_t> order = queue.active.permutation;
      ::thrust::gather(exec.thrust(), order.begin(), order.end(), list.data(), paths_.data());
      queue.active.permutation = {paths_.data(), list.size()};
      return queue;
    } else {
      return copied(exec, list.data(), list.size(), keys);
    }
  }

 private:
  // CPU policies have blocks of one warp.
  static constexpr bool sorts = Exec::warps_per_block > 1;

  struct is_active {
    wfpg::array_view<const std::uint32_t> keys;
    WFPG_HD bool operator()(std::uint32_t path) const { return keys[path] != ended; }
  };

  template <class Paths>
  path_queue copied(const Exec& exec, Paths first, std::size_t n,
                    wfpg::array_view<const std::uint32_t> keys) {
    const std::uint32_t* const end = ::thrust::copy_if(
        exec.thrust(), first, first + static_cast<std::ptrdiff_t>(n), paths_.data(), is_active{keys});
    ends_.data()[1] = static_cast<std::uint32_t>(end - paths_.data());
    count_.data()[0] = ends_.data()[1] > 0 ? 1 : 0;
    return {{{paths_.data(), n}, ends_.view(), {}, {}, count_.data()}, false};
  }

  wfpg::partitioner<Exec> partitioner_;
  wfpg::buffer<std::uint32_t, Exec> keys_;   // of listed paths
  wfpg::buffer<std::uint32_t, Exec> paths_;  // in a queue's order, unless the partitioner has it
  wfpg::buffer<std::uint32_t, Exec> ends_;   // of the one group that a CPU's queue has
  wfpg::buffer<std::uint32_t, Exec> count_;  // 1, or 0 without active paths
};

/// Paths that wait for each other after each stage. A part of the paths is a list, so that stages take no
/// time for the others.
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
  /// The active paths. `keys`: each path's, as for queue_maker.
  path_queue active(const Exec& exec, queue_maker<Exec>& maker,
                    wfpg::array_view<const std::uint32_t> keys) const {
    return count_.data() ? maker.of(exec, list_.view(), keys) : maker.of_all(exec, keys);
  }

 private:
  staged_paths(const Exec& exec, const std::vector<std::uint32_t>& list)
      : size_(list.size()),
        list_(exec, list),
        ends_(exec, std::vector<std::uint32_t>{0, static_cast<std::uint32_t>(list.size())}),
        count_(exec, std::vector<std::uint32_t>{1}) {}

  static std::vector<std::uint32_t> list_of(std::size_t paths, const wfpg::recorded_runs& part, bool inside) {
    std::vector<std::uint32_t> list;
    for (std::uint32_t path = 0; path < paths; ++path)
      if (part.includes(path) == inside) list.push_back(path);
    return list;
  }

  std::size_t size_;
  wfpg::buffer<std::uint32_t, Exec> list_;   // of paths, ascending; of none where all paths are staged
  wfpg::buffer<std::uint32_t, Exec> ends_;   // of the one group that first() has
  wfpg::buffer<std::uint32_t, Exec> count_;  // of that group
};

}  // namespace render
