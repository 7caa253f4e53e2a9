// Writes leaves into grids.
#include "octree_vdb.hpp"

#include <wfpg/bins/spatial_binner.hpp>
#include <wfpg/state/section_file.hpp>

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <ostream>
#include <stdexcept>
#include <vector>

namespace inspect {
namespace {

template <class Grid>
typename Grid::Ptr make_grid(const char* name, const typename Grid::ValueType& background,
                             const wfpg::voxel_grid& voxels) {
  const double size = voxels.voxel_size();
  const auto transform = openvdb::math::Transform::createLinearTransform(size);
  transform->postTranslate(openvdb::Vec3d(voxels.origin.x, voxels.origin.y, voxels.origin.z) + 0.5 * size);
  const auto grid = Grid::create(background);
  grid->setName(name);
  grid->setTransform(transform);
  return grid;
}

/// Nodes that are bins of pixels, sorted.
std::vector<wfpg::node_id> nodes_of(const std::vector<std::uint32_t>& bins) {
  std::vector<wfpg::node_id> nodes;
  for (const std::uint32_t bin : bins)
    if (bin != no_bin) nodes.push_back(bin / wfpg::orientations);
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

openvdb::GridPtrVec grids_of(const learnt_scene& learnt) {
  const wfpg::exitance_cache_view cache = learnt.cache();
  const wfpg::sparse_voxel_octree_view tree = cache.octree();
  const std::vector<wfpg::node_id> nodes = nodes_of(learnt.bins());
  const openvdb::FloatGrid::Ptr sides[] = {make_grid<openvdb::FloatGrid>("exitance_front", 0.0f, tree.grid()),
                                           make_grid<openvdb::FloatGrid>("exitance_back", 0.0f, tree.grid())};
  const auto normals = make_grid<openvdb::Vec3SGrid>("normal", openvdb::Vec3s(0.0f), tree.grid());
  const auto levels = make_grid<openvdb::Int32Grid>("level", 0, tree.grid());
  for (wfpg::node_id leaf = tree.first_leaf(); leaf < tree.node_count(); ++leaf) {
    const wfpg::uvec3 c = tree.coordinates(leaf);
    const openvdb::Coord voxel(static_cast<int>(c.x), static_cast<int>(c.y), static_cast<int>(c.z));
    for (std::uint32_t side = 0; side < 2; ++side)
      if (const float radiance = cache.radiance(leaf, side); radiance >= 0.0f)
        sides[side]->tree().setValue(voxel, radiance);
    const vec3 normal = cache.normal(leaf);
    normals->tree().setValue(voxel, openvdb::Vec3s(normal.x, normal.y, normal.z));
    wfpg::node_id node = leaf;
    while (node != wfpg::invalid_node && !std::binary_search(nodes.begin(), nodes.end(), node))
      node = tree.parent(node);
    if (node != wfpg::invalid_node) levels->tree().setValue(voxel, static_cast<int>(tree.level_of(node)));
  }
  return {sides[0], sides[1], normals, levels};
}

}  // namespace

void require_vdb() {}

void write_vdb(const learnt_scene& learnt, const std::string& path) {
  openvdb::initialize();
  try {
    wfpg::replace_file(path, [&](std::ostream& out) { openvdb::io::Stream(out).write(grids_of(learnt)); });
  } catch (const openvdb::Exception& error) {
    throw std::runtime_error(path + ": cannot be written: " + error.what());
  }
}

}  // namespace inspect
