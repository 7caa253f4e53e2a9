// A second translation unit with the same headers. Tests that nothing is defined twice.
#include <wfpg/exec/omp.hpp>
#include <wfpg/exec/tbb.hpp>
#include <wfpg/wfpg.hpp>

std::uint32_t nodes_of_second_unit() {
  return wfpg::path_guider<wfpg::exec::seq>(wfpg::exec::seq(), wfpg::triangle_mesh_view{})
      .guide()
      .octree()
      .node_count();
}
