// The host that docs/bidirectional.md talks about, as far as its code needs it.
#include <wfpg/exec/seq.hpp>
#include <wfpg/exec/tbb.hpp>
#include <wfpg/light/box_tree.hpp>
#include <wfpg/light/light_vertices.hpp>
#include <wfpg/light/path_weights.hpp>
#include <wfpg/light/photon_map.hpp>
#include <wfpg/light/splats.hpp>

#include <vector>

namespace my {

struct scene {};
struct vertex {
  wfpg::vertex_weights weights;
};
struct light_path {
  wfpg::light_end end;
  std::vector<vertex> vertices;
};
struct segment {
  float distance, cosine, pdf, pdf_back;
};

segment trace(const scene& in, const vertex& to);
wfpg::path_departure scatter(const vertex& from);
wfpg::path_departure leave(const vertex& from, const vertex& to);
wfpg::path_edge join(const vertex& light, const vertex& camera);
wfpg::vec3 position(const vertex& at);
float contribution(const vertex& camera, std::uint32_t photon);
bool crosses(std::uint32_t beam, const wfpg::ray& ray);

struct trace_all {
  wfpg::array_view<std::uint32_t> keeps;
  void operator()(std::size_t path) const { keeps[path] = 1; }
};
struct store_and_splat {
  wfpg::light_vertices_view<vertex> vertices;
  wfpg::splat_view splats;
  void operator()(std::size_t path) const {
    if (vertices.has_place(path)) vertices.write(path, {});
    splats.add(path, 0, wfpg::vec3(1.0f));
  }
};

}  // namespace my

void follow(const my::scene& scene, const wfpg::path_techniques& techniques, my::light_path& path);
float weight(const wfpg::path_techniques& techniques, const my::vertex& light, const my::vertex& camera);
float merge(const wfpg::photon_map_view& map, const my::vertex& camera);
int beams_along(const wfpg::exec::tbb& exec, const std::vector<wfpg::bounds3>& boxes, const wfpg::ray& ray);

#include "bidirectional-3.inc"
#include "bidirectional-4.inc"
#include "bidirectional-5.inc"
#include "bidirectional-6.inc"

template void follow_all(const wfpg::exec::seq&, wfpg::light_vertices<wfpg::exec::seq, my::vertex>&,
                         wfpg::splats<wfpg::exec::seq>&, wfpg::array_view<std::uint32_t>,
                         wfpg::array_view<wfpg::vec3>);
