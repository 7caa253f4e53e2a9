// host_checker: copies a sample to the host, and casts the rays of paths that ended unheard.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/host/ray_caster.hpp>
#include <wfpg/testing/check_host.hpp>
#include <wfpg/testing/detail/host_findings.hpp>
#include <wfpg/testing/detail/host_steps.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace wfpg::detail {

/// The size of a checker's log. Throws std::invalid_argument where it is out of range.
inline std::size_t checked_paths(std::size_t max_paths, std::uint32_t max_depth) {
  require(max_paths >= 1 && max_paths < 0xffffffffull, "max_paths", max_paths, "in [1, 2^32 - 1)");
  require(max_depth >= 1 && max_depth <= 1024, "max_depth", max_depth, "in [1, 1024]");
  return max_paths;
}

inline host_findings findings_for(bool media, float tolerance, double exceptions) {
  require(tolerance > 0.0f && tolerance < 1.0f, "tolerance", tolerance, "in (0, 1)");
  require(exceptions >= 0.0 && exceptions < 1.0, "exceptions", exceptions, "in [0, 1)");
  return {media, tolerance, exceptions};
}

}  // namespace wfpg::detail

namespace wfpg::testing {

template <class Exec>
host_checker<Exec>::host_checker(const Exec& exec, std::size_t max_paths, std::uint32_t max_depth,
                                 const host_check_options& options)
    : exec_(exec),
      steps_(exec, wfpg::detail::checked_paths(max_paths, max_depth) * max_depth),
      queries_(exec, max_paths * max_depth),
      lights_(exec, max_paths),
      findings_(wfpg::detail::findings_for(options.media, options.tolerance, options.exceptions)) {
  view_.paths_ = max_paths;
  view_.depths_ = max_depth;
  view_.steps_ = steps_.data();
  view_.queries_ = queries_.data();
  view_.lights_ = lights_.data();
  clear();
}

template <class Exec>
void host_checker<Exec>::clear() {
  exec_.fill_bytes(steps_.data(), 0, steps_.bytes());
  exec_.fill_bytes(queries_.data(), 0, queries_.bytes());
  exec_.fill_bytes(lights_.data(), 0, lights_.bytes());
}

template <class Exec>
template <class Caster>
void host_checker<Exec>::end_sample(const path_recorder_view& recorder, const Caster& caster) {
  static_assert(is_ray_caster_v<Caster, Exec>, "<wfpg/host/ray_caster.hpp> says what a ray caster is");
  using namespace wfpg::detail;
  require(recorder.paths() <= view_.paths_, "paths of the recorder", recorder.paths(), "at most max_paths");
  const buffer<checked_path, Exec> paths(exec_, recorder.recorded());
  const buffer<checked_vertex, Exec> vertices(exec_, recorder.recorded() * recorder.max_depth());
  exec_.fill_bytes(paths.data(), 0xff, paths.bytes());
  exec_.fill_bytes(vertices.data(), 0, vertices.bytes());
  exec_.for_each(recorder.paths(), read_recorded_path{recorder, paths.view(), vertices.view()});

  const std::vector<ray> rays =
      findings_.add({steps_.to_host(exec_), queries_.to_host(exec_), lights_.to_host(exec_),
                     paths.to_host(exec_), vertices.to_host(exec_), recorder.max_depth(),
                     recorder.records_directions(), recorder.silent_escapes()});
  if (!rays.empty()) {
    const buffer<ray, Exec> device(exec_, rays);
    const buffer<ray_hit, Exec> hits(exec_, rays.size());
    cast_rays(exec_, caster, array_view<const ray>(device.view()), hits.view());
    findings_.add_escapes(hits.to_host(exec_));
  }
  clear();
}

}  // namespace wfpg::testing
