// Makes OptiX's context, pipeline and acceleration structure, and launches.
#include "casters/optix_tracer.hpp"

#include <wfpg/base/error.hpp>
#include <wfpg/exec/buffer.hpp>

#include <optix.h>
#include <optix_function_table_definition.h>
#include <optix_stubs.h>

#include <array>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#if OPTIX_VERSION < 80000
#error "OptiX's headers are of version 8.0 or newer: the programs read hit objects"
#endif

namespace render {

// The PTX of optix_programs.cu. The build makes it.
extern const char* const optix_programs_ptx;

namespace {

std::string text_of(OptixResult result) {
  return std::string(optixGetErrorName(result)) + " (" + optixGetErrorString(result) + ")";
}

void check(OptixResult result, const char* what, const std::string& log = {}) {
  if (result == OPTIX_SUCCESS) return;
  throw std::runtime_error(std::string("OptiX: ") + what + " failed: " + text_of(result) +
                           (log.empty() ? "" : "\n" + log));
}

void check(cudaError_t code, const char* call) {
  if (code == cudaSuccess) return;
  cudaGetLastError();
  throw wfpg::device_error(code, cudaGetErrorString(code), call);
}

/// Calls `make(log, size)`. On failure its log becomes part of the error.
template <class F>
void check_with_log(const char* what, const F& make) {
  std::array<char, 4096> log{};
  std::size_t size = log.size();
  const OptixResult result = make(log.data(), &size);
  check(result, what, log.data());
}

/// Loads the driver's part of OptiX, and makes the device's context current.
void initialise() {
  check(cudaFree(nullptr), "OptiX needs an NVIDIA GPU and its driver; cudaFree");
  const OptixResult result = optixInit();
  if (result == OPTIX_SUCCESS) return;
  throw std::runtime_error(
      "OptiX: optixInit failed: " + text_of(result) +
      "; it needs an NVIDIA driver with libnvoptix.so.1, not older than this program's headers, OptiX " +
      std::to_string(OPTIX_VERSION / 10000) + "." + std::to_string(OPTIX_VERSION % 10000 / 100));
}

struct release {
  void operator()(OptixDeviceContext context) const { optixDeviceContextDestroy(context); }
  void operator()(OptixModule module) const { optixModuleDestroy(module); }
  void operator()(OptixProgramGroup group) const { optixProgramGroupDestroy(group); }
  void operator()(OptixPipeline pipeline) const { optixPipelineDestroy(pipeline); }
};
template <class Handle>
using owner = std::unique_ptr<std::remove_pointer_t<Handle>, release>;

/// Memory and copies ordered on a stream, with the interface that wfpg::buffer needs of a policy.
struct stream_memory {
  cudaStream_t stream;
  wfpg::memory_resource* memory;

  wfpg::memory_resource* resource() const { return memory; }
  /// Pageable memory has been read when the call returns.
  void copy_from_host(void* to, const void* from, std::size_t bytes) const {
    check(cudaMemcpyAsync(to, from, bytes, cudaMemcpyHostToDevice, stream), "cudaMemcpyAsync");
  }
  void copy_to_host(void* to, const void* from, std::size_t bytes) const {
    check(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToHost, stream), "cudaMemcpyAsync");
    check(cudaStreamSynchronize(stream), "cudaStreamSynchronize");
  }
};

/// Device memory with the alignment of acceleration structures, for any memory resource.
class aligned_memory {
 public:
  aligned_memory() = default;
  aligned_memory(const stream_memory& exec, std::size_t bytes) : block_(exec, bytes + alignment) {}

  CUdeviceptr address() const {
    return (reinterpret_cast<CUdeviceptr>(block_.data()) + alignment - 1) / alignment * alignment;
  }
  std::size_t bytes() const { return block_.bytes(); }

 private:
  static constexpr std::size_t alignment = OPTIX_ACCEL_BUFFER_BYTE_ALIGNMENT;
  wfpg::buffer<std::byte, stream_memory> block_;
};

/// A mesh's acceleration structure. Without triangles (the default), every ray misses.
struct acceleration_structure {
  OptixTraversableHandle handle = 0;
  aligned_memory memory;
};

/// A build's input, which points to its members.
class triangle_input {
 public:
  triangle_input(wfpg::array_view<const wfpg::vec3> positions, wfpg::array_view<const wfpg::uvec3> triangles)
      : vertices_(reinterpret_cast<CUdeviceptr>(positions.data())) {
    input_.type = OPTIX_BUILD_INPUT_TYPE_TRIANGLES;
    OptixBuildInputTriangleArray& array = input_.triangleArray;
    array.vertexBuffers = &vertices_;
    array.numVertices = static_cast<unsigned>(positions.size());
    array.vertexFormat = OPTIX_VERTEX_FORMAT_FLOAT3;
    array.vertexStrideInBytes = sizeof(wfpg::vec3);
    array.indexBuffer = reinterpret_cast<CUdeviceptr>(triangles.data());
    array.numIndexTriplets = static_cast<unsigned>(triangles.size());
    array.indexFormat = OPTIX_INDICES_FORMAT_UNSIGNED_INT3;
    array.indexStrideInBytes = sizeof(wfpg::uvec3);
    array.flags = &flags_;
    array.numSbtRecords = 1;
  }
  triangle_input(const triangle_input&) = delete;

  const OptixBuildInput* get() const { return &input_; }

 private:
  CUdeviceptr vertices_;
  unsigned flags_ = OPTIX_GEOMETRY_FLAG_DISABLE_ANYHIT;
  OptixBuildInput input_{};
};

acceleration_structure build(OptixDeviceContext context, const stream_memory& exec,
                             const triangle_input& input) {
  OptixAccelBuildOptions options{};
  options.buildFlags = OPTIX_BUILD_FLAG_PREFER_FAST_TRACE | OPTIX_BUILD_FLAG_ALLOW_COMPACTION;
  options.operation = OPTIX_BUILD_OPERATION_BUILD;
  OptixAccelBufferSizes sizes{};
  check(optixAccelComputeMemoryUsage(context, &options, input.get(), 1, &sizes),
        "asking for an acceleration structure's size");

  acceleration_structure loose;
  loose.memory = aligned_memory(exec, sizes.outputSizeInBytes);
  const aligned_memory scratch(exec, sizes.tempSizeInBytes);
  const wfpg::buffer<std::uint64_t, stream_memory> compacted_size(exec, 1);
  OptixAccelEmitDesc emit{};
  emit.type = OPTIX_PROPERTY_TYPE_COMPACTED_SIZE;
  emit.result = reinterpret_cast<CUdeviceptr>(compacted_size.data());
  check(optixAccelBuild(context, exec.stream, &options, input.get(), 1, scratch.address(),
                        sizes.tempSizeInBytes, loose.memory.address(), sizes.outputSizeInBytes, &loose.handle,
                        &emit, 1),
        "building the acceleration structure");

  const std::size_t bytes = wfpg::read_element(exec, compacted_size.data());
  if (bytes >= sizes.outputSizeInBytes) return loose;
  acceleration_structure compact;
  compact.memory = aligned_memory(exec, bytes);
  check(
      optixAccelCompact(context, exec.stream, loose.handle, compact.memory.address(), bytes, &compact.handle),
      "compacting the acceleration structure");
  return compact;
}

OptixPipelineCompileOptions pipeline_options() {
  OptixPipelineCompileOptions options{};
  options.traversableGraphFlags = OPTIX_TRAVERSABLE_GRAPH_FLAG_ALLOW_SINGLE_GAS;
  options.numAttributeValues = 2;  // barycentrics
  options.exceptionFlags = OPTIX_EXCEPTION_FLAG_NONE;
  options.pipelineLaunchParamsVariableName = "parameters";
  options.usesPrimitiveTypeFlags = OPTIX_PRIMITIVE_TYPE_FLAGS_TRIANGLE;
  return options;
}

owner<OptixDeviceContext> make_context() {
  OptixDeviceContext context = nullptr;
  const OptixDeviceContextOptions options{};
  check(optixDeviceContextCreate(nullptr, &options, &context), "making a context");
  return owner<OptixDeviceContext>(context);
}

owner<OptixModule> make_module(OptixDeviceContext context) {
  const OptixModuleCompileOptions options{};
  const OptixPipelineCompileOptions pipeline = pipeline_options();
  const std::string ptx = optix_programs_ptx;
  OptixModule module = nullptr;
  check_with_log("compiling the device programs", [&](char* log, std::size_t* size) {
    return optixModuleCreate(context, &options, &pipeline, ptx.data(), ptx.size(), log, size, &module);
  });
  return owner<OptixModule>(module);
}

owner<OptixProgramGroup> make_group(OptixDeviceContext context, const OptixProgramGroupDesc& description) {
  const OptixProgramGroupOptions options{};
  OptixProgramGroup group = nullptr;
  check_with_log("making a program group", [&](char* log, std::size_t* size) {
    return optixProgramGroupCreate(context, &description, 1, &options, log, size, &group);
  });
  return owner<OptixProgramGroup>(group);
}

/// One group for each query, in order, then those of misses and hits, which run nothing.
std::vector<owner<OptixProgramGroup>> make_groups(OptixDeviceContext context, OptixModule module) {
  std::vector<owner<OptixProgramGroup>> groups;
  for (const char* name : {"__raygen__intersect", "__raygen__occluded", "__raygen__cast"}) {
    OptixProgramGroupDesc description{};
    description.kind = OPTIX_PROGRAM_GROUP_KIND_RAYGEN;
    description.raygen = {module, name};
    groups.push_back(make_group(context, description));
  }
  for (const auto kind : {OPTIX_PROGRAM_GROUP_KIND_MISS, OPTIX_PROGRAM_GROUP_KIND_HITGROUP}) {
    OptixProgramGroupDesc description{};
    description.kind = kind;
    groups.push_back(make_group(context, description));
  }
  return groups;
}

owner<OptixPipeline> make_pipeline(OptixDeviceContext context,
                                   const std::vector<owner<OptixProgramGroup>>& groups) {
  std::vector<OptixProgramGroup> handles;
  for (const auto& group : groups) handles.push_back(group.get());
  const OptixPipelineCompileOptions options = pipeline_options();
  OptixPipelineLinkOptions link{};
  link.maxTraceDepth = 1;
  OptixPipeline pipeline = nullptr;
  check_with_log("making the pipeline", [&](char* log, std::size_t* size) {
    return optixPipelineCreate(context, &options, &link, handles.data(),
                               static_cast<unsigned>(handles.size()), log, size, &pipeline);
  });
  return owner<OptixPipeline>(pipeline);
}

/// A record of the shader binding table, without data.
struct alignas(OPTIX_SBT_RECORD_ALIGNMENT) sbt_record {
  std::array<std::byte, OPTIX_SBT_RECORD_HEADER_SIZE> header;
};

wfpg::buffer<sbt_record, stream_memory> make_records(const stream_memory& exec,
                                                     const std::vector<owner<OptixProgramGroup>>& groups) {
  std::vector<sbt_record> records(groups.size());
  for (std::size_t i = 0; i < groups.size(); ++i)
    check(optixSbtRecordPackHeader(groups[i].get(), &records[i]), "packing a record");
  return {exec, records};
}

}  // namespace

struct optix_tracer::state {
  explicit state(const stream_memory& exec)
      : memory(exec),
        context(make_context()),
        module(make_module(context.get())),
        groups(make_groups(context.get(), module.get())),
        pipeline(make_pipeline(context.get(), groups)),
        records(make_records(exec, groups)) {}

  CUdeviceptr record(std::size_t i) const { return reinterpret_cast<CUdeviceptr>(records.data() + i); }

  OptixShaderBindingTable binding_table(optix_query query) const {
    OptixShaderBindingTable table{};
    table.raygenRecord = record(static_cast<std::size_t>(query));
    table.missRecordBase = record(groups.size() - 2);
    table.hitgroupRecordBase = record(groups.size() - 1);
    table.missRecordStrideInBytes = table.hitgroupRecordStrideInBytes = sizeof(sbt_record);
    table.missRecordCount = table.hitgroupRecordCount = 1;
    return table;
  }

  stream_memory memory;
  owner<OptixDeviceContext> context;
  owner<OptixModule> module;
  std::vector<owner<OptixProgramGroup>> groups;
  owner<OptixPipeline> pipeline;
  wfpg::buffer<sbt_record, stream_memory> records;
  acceleration_structure tree;
};

optix_tracer::optix_tracer(cudaStream_t stream, wfpg::memory_resource* memory,
                           wfpg::array_view<const wfpg::vec3> positions,
                           wfpg::array_view<const wfpg::uvec3> triangles) {
  initialise();
  const stream_memory exec{stream, memory};
  state_ = std::make_unique<state>(exec);
  if (!triangles.empty())
    state_->tree = build(state_->context.get(), exec, triangle_input(positions, triangles));
  check(cudaStreamSynchronize(stream), "cudaStreamSynchronize");
}

optix_tracer::~optix_tracer() {
  cudaStreamSynchronize(state_->memory.stream);
}

unsigned long long optix_tracer::tree() const {
  return state_->tree.handle;
}

std::size_t optix_tracer::bytes() const {
  return state_->records.bytes() + state_->tree.memory.bytes();
}

void optix_tracer::launch(cudaStream_t stream, optix_query query, const optix_parameters* parameters,
                          std::size_t count) const {
  const OptixShaderBindingTable table = state_->binding_table(query);
  check(optixLaunch(state_->pipeline.get(), stream, reinterpret_cast<CUdeviceptr>(parameters),
                    sizeof(optix_parameters), &table, static_cast<unsigned>(count), 1, 1),
        "a launch");
}

}  // namespace render
