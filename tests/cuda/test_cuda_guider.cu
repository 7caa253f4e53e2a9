// The guider on the CUDA policy. Its integer stages equal the serial policy's, and its directions agree
// except for rounding. One seed gives the same bits twice.
#include "cuda/walls.hpp"
#include "support/guiding.hpp"
#include "support/scenes.hpp"

#include <wfpg/exec/cuda.hpp>
#include <wfpg/exec/seq.hpp>
#include <wfpg/path_guider.hpp>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

using namespace wfpg_test;
using cuda_policy = wfpg::exec::cuda;
using serial_policy = wfpg::exec::seq;

namespace {

constexpr std::uint32_t rays = 20000, deposits = 50000;
constexpr int samples = 4;

struct do_nothing {
  template <class Block>
  WFPG_HD void operator()(Block&, std::size_t) const {}
};

struct guided {
  wfpg::guider_statistics statistics;
  std::uint32_t nodes = 0;
  std::size_t persistent_bytes = 0;
  std::vector<wfpg::sampled_direction> directions;
};

template <class Exec>
guided guide(field_lifetime lifetime, std::uint32_t product_resolution) {
  const Exec exec;
  guider_options options;
  options.fields = lifetime;
  options.product_resolution = unless_zero(product_resolution);
  options.octree_resolution = 64;
  options.max_rays = rays;
  options.deposit_capacity = 2 * deposits;
  options.unguided_samples = 0;
  options.kept.budget_bytes = std::size_t(4) << 20;
  octree_guider<Exec> guider(exec, box_mesh<Exec>(exec).view(), options);
  const wfpg::buffer<wfpg::sampled_direction, Exec> directions(exec, rays);
  for (std::uint32_t sample = 0; sample < samples; ++sample) {
    guider.begin_sample();
    exec.for_each(deposits, light_walls{guider.guide().cache()});
    guider.sample_directions(wfpg::wave{0u, rays, walls{}, hashed_numbers{sample}}, box_caster{},
                             directions.view());
    guider.end_sample();
  }
  return {guider.statistics(), guider.guide().octree().node_count(), guider.memory().persistent(),
          directions.to_host(exec)};
}

bool close(const wfpg::sampled_direction& a, const wfpg::sampled_direction& b) {
  return a.technique == b.technique && glm::length(a.direction - b.direction) < 1.0e-3f &&
         std::fabs(a.pdf - b.pdf) <= 1.0e-3f * a.pdf;
}

void compare(field_lifetime lifetime, std::uint32_t product_resolution) {
  INFO((lifetime == field_lifetime::kept ? "kept" : "transient") << ", products " << product_resolution);
  const guided host = guide<serial_policy>(lifetime, product_resolution),
               device = guide<cuda_policy>(lifetime, product_resolution);
  CHECK(device.nodes == host.nodes);
  CHECK(device.persistent_bytes == host.persistent_bytes);
  CHECK(device.statistics.kept.live == host.statistics.kept.live);
  CHECK(device.statistics.kept.refreshed == host.statistics.kept.refreshed);
  CHECK(device.statistics.depths[0].bins == host.statistics.depths[0].bins);
  CHECK(device.statistics.depths[0].rays == host.statistics.depths[0].rays);
  CHECK(device.statistics.depths[0].cones == host.statistics.depths[0].cones);
  std::size_t closely = 0, guided_rays = 0;
  for (std::size_t i = 0; i < rays; ++i) {
    closely += close(device.directions[i], host.directions[i]);
    guided_rays += device.directions[i].technique == wfpg::sampling_technique::guide;
  }
  // A cone at a voxel's border reads another voxel if rounding differs.
  CHECK(closely >= rays / 100 * 99);
  CHECK(guided_rays > rays / 4);
  const guided again = guide<cuda_policy>(lifetime, product_resolution);
  CHECK(std::memcmp(again.directions.data(), device.directions.data(),
                    rays * sizeof(wfpg::sampled_direction)) == 0);
}

}  // namespace

TEST_CASE("the guider on the CUDA policy agrees with the serial one", "[cuda]") {
  for (const auto lifetime : {field_lifetime::kept, field_lifetime::transient})
    for (const std::uint32_t product_resolution : {0u, 8u}) compare(lifetime, product_resolution);
}

TEST_CASE("the CUDA policy reports errors", "[cuda]") {
  const cuda_policy exec;
  CHECK_THROWS_AS((wfpg::buffer<char, cuda_policy>(exec, std::size_t(1) << 50)), wfpg::out_of_memory);
  const wfpg::buffer<std::uint32_t, cuda_policy> works_after(exec, std::vector<std::uint32_t>{1, 2, 3});
  CHECK((works_after.to_host(exec) == std::vector<std::uint32_t>{1, 2, 3}));
  const std::string refused = refusal([&] { exec.for_each_block(1, std::size_t(1) << 20, do_nothing{}); });
  INFO(refused);
  CHECK(refused.find("is 1048576, expected at most ") != std::string::npos);
}

TEST_CASE("a field of 128 x 128 fits 99 KiB of shared memory, and two fit 228 KiB", "[cuda]") {
  constexpr std::size_t small = 99 * 1024, large = 228 * 1024;  // of compute capabilities 8.6 and 9.0
  constexpr std::size_t reserved = 1024;                        // of each block
  const std::size_t bytes = sizeof(std::uint32_t) * wfpg::grid_distribution::words(128) + 16 +
                            wfpg::field_scratch_bytes(128, cuda_policy::warps_per_block) + reserved;
  CHECK(bytes <= small);
  CHECK(2 * bytes <= large);
}
