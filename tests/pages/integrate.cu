// The CUDA code of docs/integrate.md. Without OptiX, dummies define the names of it that the page uses.
#include "integrate-4.inc"

#include <cuda.h>

#include <stdexcept>

#if __has_include(<optix.h>)
#include <optix.h>
#include <optix_stubs.h>
#else
using OptixPipeline = struct optix_pipeline*;
using OptixTraversableHandle = unsigned long long;
struct OptixShaderBindingTable {};
enum OptixResult { OPTIX_SUCCESS };
OptixResult optixLaunch(OptixPipeline, CUstream, CUdeviceptr, std::size_t, const OptixShaderBindingTable*,
                        unsigned, unsigned, unsigned);
#endif

#include "integrate-5.inc"

static_assert(is_batch_caster_v<optix_caster, exec::cuda>);
