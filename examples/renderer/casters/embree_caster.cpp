// Building Embree's acceleration structure.
#include "casters/embree_caster.hpp"

#include <cstring>
#include <stdexcept>
#include <string>

namespace render {
namespace {

void check(RTCDevice device, const char* what) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_NONE) return;
  throw std::runtime_error(std::string("Embree: ") + what + " failed (code " + std::to_string(error) + ")");
}

template <class T>
void set_buffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format, const std::vector<T>& elements) {
  if (elements.empty()) return;
  void* const memory = rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(T), elements.size());
  if (memory) std::memcpy(memory, elements.data(), elements.size() * sizeof(T));
}

}  // namespace

embree_scene::embree_scene(const scene& host) : environment_(host.environment) {
  device_.reset(rtcNewDevice(nullptr));
  check(device_.get(), "making a device");
  scene_.reset(rtcNewScene(device_.get()));
  // Without this, rays pass between two triangles of a closed wall and leak light.
  rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_HIGH);
  const RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
  set_buffer(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, host.positions);
  set_buffer(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, host.triangles);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_.get(), geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_.get());
  check(device_.get(), "building the scene");
}

}  // namespace render
