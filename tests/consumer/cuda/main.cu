// Builds an empty scene's guider on the CUDA policy of the installed package. Says so if there is no GPU.
#include <wfpg/exec/cuda.hpp>
#include <wfpg/wfpg.hpp>

#include <cstdio>

int main() try {
  const wfpg::exec::cuda exec;
  const std::uint32_t n =
      wfpg::path_guider<wfpg::exec::cuda>(exec, wfpg::triangle_mesh_view{}).guide().octree().node_count();
  std::printf("wfpg %d.%d.%d: %u nodes in an empty scene\n", WFPG_VERSION_MAJOR, WFPG_VERSION_MINOR,
              WFPG_VERSION_PATCH, n);
  return n == 0 ? 0 : 1;
} catch (const wfpg::cuda_error& error) {
  std::printf("no GPU: %s\n", error.what());
}
