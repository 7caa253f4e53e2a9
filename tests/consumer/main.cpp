// Builds an empty scene's guider on every policy of the installed package.
#include <wfpg/exec/omp.hpp>
#include <wfpg/exec/tbb.hpp>
#include <wfpg/wfpg.hpp>

#include <cstdio>

std::uint32_t nodes_of_second_unit();

template <class Exec>
std::uint32_t nodes() {
  const Exec exec;
  return wfpg::path_guider<Exec>(exec, wfpg::triangle_mesh_view{}).guide().octree().node_count();
}

int main() {
  const std::uint32_t n = nodes<wfpg::exec::seq>() + nodes<wfpg::exec::omp>() + nodes<wfpg::exec::tbb>();
  std::printf("wfpg %d.%d.%d: %u nodes in empty scenes\n", WFPG_VERSION_MAJOR, WFPG_VERSION_MINOR,
              WFPG_VERSION_PATCH, n + nodes_of_second_unit());
  return n == 0 ? 0 : 1;
}
