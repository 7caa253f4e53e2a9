// Voxel fragments on the host.
#pragma once

#include <wfpg/octree/voxelizer.hpp>

#include <algorithm>
#include <vector>

namespace wfpg_test {

/// Morton codes of fragments, sorted, each once.
template <class Exec>
std::vector<wfpg::morton_code> voxels_of(const Exec& exec, const wfpg::voxel_fragments<Exec>& fragments) {
  std::vector<wfpg::morton_code> codes = fragments.codes.to_host(exec);
  std::sort(codes.begin(), codes.end());
  codes.erase(std::unique(codes.begin(), codes.end()), codes.end());
  return codes;
}

}  // namespace wfpg_test
