// The octree's voxels as an OpenVDB file, for programs that show volumes.
#pragma once

#include "learnt_scene.hpp"

#include <string>

namespace inspect {

/// Throws std::runtime_error that names what is missing if this was built without OpenVDB.
void require_vdb();

/// Writes a voxel for each leaf, in world space. `exitance_front` and `exitance_back` are luminances of the
/// sides that face N and -N in W/(m² sr), without voxels where there is no data. `normal` is N. `level` is
/// that of the smallest bin of a pixel there, without voxels where there is none. Throws as require_vdb(),
/// and std::runtime_error that names the path.
void write_vdb(const learnt_scene& learnt, const std::string& path);

}  // namespace inspect
