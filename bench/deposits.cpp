// Deposits of a sample's paths in the cache: back-propagation (Eq. 5), means of the leaves, averages
// bottom-up.
#include "floors.hpp"
#include "guide.hpp"

#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guides/octree/deposit_paths.hpp>

namespace bench {
namespace {

constexpr std::uint32_t path_length = 4;

struct record_vertex {
  wfpg::path_recorder_view recorder;
  wfpg::array_view<const room_point> points;
  std::uint32_t depth;
  std::uint32_t percent_in_one;
  WFPG_HD void operator()(std::size_t path) const {
    const room_point& p = points[path % 100 < percent_in_one ? 0 : path];
    recorder.vertex(path, depth, p.position, p.outgoing, vec3(1.0f / static_cast<float>(depth + 1)));
    recorder.radiance(path, depth,
                      vec3(wfpg::unit_float(static_cast<std::uint32_t>(wfpg::hash(depth, path)))));
  }
};

/// A wave's paths of four vertices. One leaf may have all vertices of some paths. The floor reads the
/// vertices.
template <class Exec>
void depositing(benchmark::State& state) {
  const Exec exec;
  guide_of_room<Exec> guide(exec, static_cast<std::uint32_t>(state.range(0)),
                            std::size_t(pixels) * path_length);
  wfpg::path_recorder<Exec> recorder(exec, wfpg::path_recorder_settings{pixels, path_length});
  std::vector<wfpg::buffer<room_point, Exec>> points;
  for (int bounces = 0; bounces < static_cast<int>(path_length); ++bounces)
    points.push_back(points_after(exec, bounces));
  const auto record = [&] {
    for (std::uint32_t depth = 0; depth < path_length; ++depth)
      exec.for_each(pixels,
                    record_vertex{recorder.view(), wfpg::array_view<const room_point>(points[depth].view()),
                                  depth, static_cast<std::uint32_t>(state.range(1))});
  };
  compare(
      state, exec,
      [&] {
        wfpg::deposit_paths(exec, recorder, guide.cache.view());
        guide.cache.update(exec);
      },
      copy_of(exec, recorder.bytes()), record);
  state.counters["leaves"] = guide.octree.leaf_count();
}

WFPG_BENCH_STAGE(depositing, {"resolution", "percent_in_one"}, sizes::depositing);

}  // namespace
}  // namespace bench
