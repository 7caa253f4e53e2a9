// OptiX's pipeline and the acceleration structure of one mesh, launched on CUDA streams. Needs no nvcc.
// optix_caster.hpp makes it a caster of the renderer and of the guider.
#pragma once

#include "casters/optix_parameters.hpp"

#include <wfpg/base/types.hpp>
#include <wfpg/exec/policy.hpp>

#include <cuda_runtime_api.h>

#include <cstdint>
#include <memory>

namespace render {

/// Queries for a batch of rays. Each has a program in optix_programs.cu.
enum class optix_query { intersect, occluded, cast };

/// Owns OptiX's objects for one mesh. Launches may run on several streams at once.
class optix_tracer {
 public:
  /// Builds on the current device, ordered on `stream`, and waits. `memory` allocates device memory ordered
  /// on that stream. Both must outlive this. Positions and triangles are finite device memory, and every
  /// corner is below the number of positions. Neither is read later. Throws wfpg::out_of_memory, and
  /// std::runtime_error that names what OptiX needs.
  optix_tracer(cudaStream_t stream, wfpg::memory_resource* memory,
               wfpg::array_view<const wfpg::vec3> positions, wfpg::array_view<const wfpg::uvec3> triangles);
  /// Waits for the stream.
  ~optix_tracer();
  optix_tracer(const optix_tracer&) = delete;
  optix_tracer& operator=(const optix_tracer&) = delete;

  /// The mesh's acceleration structure, for optix_parameters::tree.
  unsigned long long tree() const;
  /// Bytes of device memory that it keeps.
  std::size_t bytes() const;

  /// The most rays of one launch (the programming guide's limit).
  static constexpr std::size_t max_rays = std::size_t(1) << 30;

  /// Launches `count` rays, at least one, ordered on `stream`. `parameters` is device memory.
  void launch(cudaStream_t stream, optix_query query, const optix_parameters* parameters,
              std::size_t count) const;

 private:
  struct state;
  std::unique_ptr<state> state_;
};

}  // namespace render
