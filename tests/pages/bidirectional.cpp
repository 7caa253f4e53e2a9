// The host that docs/bidirectional.md talks about, as far as its code needs it.
#include <wfpg/light/path_weights.hpp>

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

}  // namespace my

void follow(const my::scene& scene, const wfpg::path_techniques& techniques, my::light_path& path);
float weight(const wfpg::path_techniques& techniques, const my::vertex& light, const my::vertex& camera);

#include "bidirectional-1.inc"
