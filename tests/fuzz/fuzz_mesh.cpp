// Meshes of any floats and indices, at any resolution: a valid octree and guiding from any surfaces, or an
// error. Errors name the argument.
#include "guided_samples.hpp"

#include <wfpg/octree/voxelizer.hpp>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace wfpg_fuzz;

/// Reads bytes from the first to the last, then zeros.
class byte_reader {
 public:
  byte_reader(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}

  std::size_t left() const { return left_; }
  template <class T>
  T get() {
    T value{};
    const std::size_t n = left_ < sizeof(T) ? left_ : sizeof(T);
    if (n > 0) std::memcpy(&value, data_, n);
    data_ += n;
    left_ -= n;
    return value;
  }

 private:
  const std::uint8_t* data_;
  std::size_t left_;
};

/// A mesh, its resolution, and the options of guiding.
struct input {
  std::uint32_t resolution = 1;
  wfpg_test::guider_options options;
  std::vector<vec3> positions;
  std::vector<wfpg::uvec3> triangles;
};

/// Powers of two that take milliseconds, and numbers that must be refused.
std::uint32_t resolution_of(std::uint8_t byte) {
  if (byte < 128) return 1u << byte % 7;
  const std::uint32_t refused[] = {0u, 3u, 5u, 8192u, 0x80000000u, 0xffffffffu};
  return refused[byte % 6];
}

wfpg_test::guider_options options_of(std::uint8_t bits) {
  wfpg_test::guider_options options;
  options.mode = static_cast<wfpg::guiding_mode>(bits % 2);
  options.fields = static_cast<wfpg_test::field_lifetime>(bits / 2 % 2);
  options.product_resolution = wfpg_test::unless_zero(std::uint32_t(bits / 4 % 2 * 4));
  options.unguided_samples = bits / 8 % 2;
  options.kept.resolution = options.field_resolution = options.min_field_resolution = 4;
  options.kept.budget_bytes = 16384;
  options.binning.min_level = bits / 16 % 4;
  options.binning.rays_per_bin = 2;
  options.max_paths = rays;
  options.max_depth = 2;
  return options;
}

input read_input(byte_reader bytes) {
  input result;
  result.resolution = resolution_of(bytes.get<std::uint8_t>());
  result.options = options_of(bytes.get<std::uint8_t>());
  result.options.octree_resolution = result.resolution;
  const std::size_t vertices = bytes.get<std::uint8_t>();
  for (std::size_t i = 0; i < vertices && bytes.left() > 0; ++i) {
    const float x = bytes.get<float>(), y = bytes.get<float>(), z = bytes.get<float>();
    result.positions.push_back({x, y, z});
  }
  // Indices of a byte. The last value stands for the largest of 32 bits.
  const auto index = [&bytes] {
    const auto byte = bytes.get<std::uint8_t>();
    return byte == 255 ? 0xffffffffu : std::uint32_t(byte);
  };
  while (bytes.left() > 0 && result.triangles.size() < 64) {
    const std::uint32_t a = index(), b = index(), c = index();
    result.triangles.push_back({a, b, c});
  }
  return result;
}

/// Surfaces whose positions and directions are any vertices. Precondition: there are some.
struct any_surfaces {
  const std::vector<vec3>* vertices;

  wfpg::surface<lambert> operator()(std::uint32_t ray) const {
    const auto vertex = [&](std::uint32_t i) { return (*vertices)[(ray + i) % vertices->size()]; };
    return {vertex(0), vertex(1), vertex(2), vertex(3), lambert{vertex(2)}, ray % 5 != 4};
  }
};

/// Checks that leaves contain their centres and lie inside their parents.
void check_octree(const wfpg::sparse_voxel_octree_view& tree) {
  for (wfpg::node_id leaf = tree.first_leaf(); leaf < tree.node_count(); ++leaf) {
    require(tree.leaf_at(tree.centre(leaf)) == leaf, "a leaf is found at its centre");
    require(tree.ancestor(leaf, 0) == 0, "a leaf is below the root");
  }
}

void build_and_guide(const input& in) {
  const wfpg::triangle_mesh_view mesh{{in.positions.data(), in.positions.size()},
                                      {in.triangles.data(), in.triangles.size()}};
  wfpg_test::octree_guider<policy> guider(policy(), mesh, in.options);
  const wfpg::sparse_voxel_octree_view tree = guider.guide().octree().view();
  check_octree(tree);
  require(guider.statistics().build.skipped() <= in.triangles.size(), "no more is skipped than there is");
  require(tree.empty() == (guider.statistics().build.skipped() == in.triangles.size()),
          "what is not skipped has leaves");
  if (!tree.empty()) guide(guider, leaf_surfaces{tree});
  if (!in.positions.empty()) guide(guider, any_surfaces{&in.positions});
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const input in = read_input(byte_reader(data, size));
  const bool is_valid =
      in.resolution >= 1 && in.resolution <= 64 && (in.resolution & (in.resolution - 1)) == 0;
  try {
    build_and_guide(in);
    require(is_valid, "resolutions that are none are refused");
  } catch (const std::invalid_argument& error) {
    require(!is_valid && std::string(error.what()).find("resolution") != std::string::npos,
            "what is refused is the resolution");
  }
  return 0;
}
