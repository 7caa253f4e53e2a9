// The octree's voxels as an OpenVDB file, for programs that show volumes.
#pragma once

#include "learnt_scene.hpp"

#include <string>

namespace inspect {

/// Throws std::runtime_error that says what is missing where this was built without OpenVDB.
void require_vdb();

/// Writes a voxel for each leaf, in world space: `exitance_front` and `exitance_back`, luminance of the sides
/// that face N and -N in W/(m² sr), no voxel where there is no data; `normal`, N; `level`, of the smallest
/// bin there that a pixel has, no voxel where none has one. Throws as require_vdb(), and std::runtime_error
/// that names the path.
void write_vdb(const learnt_scene& learnt, const std::string& path);

}  // namespace inspect
