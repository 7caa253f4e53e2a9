// Looks up voxels pixel by pixel.
#include "octree_pictures.hpp"

#include <wfpg/bins/spatial_binner.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace inspect {
namespace {

const vec3 nothing_known(0.01f, 0.04f, 0.16f);
const vec3 mark_colour(0.0f, 1.0f, 0.35f);
constexpr int mark_radius = 4;

render::image picture_of(const learnt_scene& learnt) {
  const render::image& rendered = learnt.rendering().picture;
  return render::make_image(rendered.width, rendered.height);
}

/// Calls f(pixel, leaf, surface) for each pixel that hits a voxel.
template <class F>
void for_each_voxel(const learnt_scene& learnt, const F& f) {
  const wfpg::sparse_voxel_octree_view tree = learnt.cache().octree();
  for (std::size_t pixel = 0; pixel < learnt.hits().size(); ++pixel) {
    const auto& surface = learnt.hits()[pixel].surface;
    if (!surface.active) continue;
    const wfpg::node_id leaf = tree.nearest_leaf(surface.position);
    if (leaf != wfpg::invalid_node) f(pixel, leaf, surface);
  }
}

/// A random colour from a number's bits, between dark and light in each channel.
vec3 random_colour(std::uint32_t key) {
  const std::uint64_t bits = wfpg::hash(0, key);
  const auto channel = [bits](int shift) { return 0.05f + float(bits >> shift & 0xffu) / 300.0f; };
  return {channel(0), channel(8), channel(16)};
}

}  // namespace

exitance_pictures exitance_of(const learnt_scene& learnt) {
  const wfpg::exitance_cache_view cache = learnt.cache();
  exitance_pictures pictures{picture_of(learnt), picture_of(learnt)};
  for (render::image* picture : {&pictures.facing, &pictures.turned})
    std::fill(picture->pixels.begin(), picture->pixels.end(), vec3(-1.0f));
  for_each_voxel(learnt, [&](std::size_t pixel, wfpg::node_id leaf, const auto& surface) {
    const std::uint32_t side = cache.side_facing(leaf, surface.outgoing);
    const float facing = cache.radiance(leaf, side), turned = cache.radiance(leaf, 1 - side);
    pictures.facing.pixels[pixel] = vec3(facing);
    pictures.turned.pixels[pixel] = vec3(turned);
    pictures.greatest = std::max({pictures.greatest, double(facing), double(turned)});
  });
  return pictures;
}

render::image coloured_exitance(const render::image& exitance, const colour_scale& scale) {
  render::image picture = exitance;
  for (vec3& pixel : picture.pixels) pixel = pixel.x < 0.0f ? nothing_known : scale.colour(pixel.x);
  return picture;
}

render::image normal_picture(const learnt_scene& learnt) {
  render::image picture = picture_of(learnt);
  const wfpg::exitance_cache_view cache = learnt.cache();
  for_each_voxel(learnt, [&](std::size_t pixel, wfpg::node_id leaf, const auto& surface) {
    const vec3 normal = cache.normal(leaf);
    const float sign = glm::dot(normal, surface.outgoing) < 0.0f ? -1.0f : 1.0f;
    picture.pixels[pixel] = 0.5f + 0.5f * sign * normal;
  });
  return picture;
}

render::image bin_picture(const learnt_scene& learnt) {
  render::image picture = picture_of(learnt);
  for (std::size_t pixel = 0; pixel < picture.pixels.size(); ++pixel)
    if (learnt.bins()[pixel] != no_bin) picture.pixels[pixel] = random_colour(learnt.bins()[pixel]);
  return picture;
}

render::image level_picture(const learnt_scene& learnt, const colour_scale& scale) {
  render::image picture = picture_of(learnt);
  const wfpg::sparse_voxel_octree_view tree = learnt.cache().octree();
  for (std::size_t pixel = 0; pixel < picture.pixels.size(); ++pixel) {
    const std::uint32_t bin = learnt.bins()[pixel];
    picture.pixels[pixel] =
        bin == no_bin ? nothing_known : scale.colour(tree.level_of(bin / wfpg::orientations));
  }
  return picture;
}

float exposure_of(const render::image& picture) {
  std::vector<float> values;
  for (const vec3& pixel : picture.pixels) values.push_back(wfpg::luminance(pixel));
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle > 0.0f && std::isfinite(*middle) ? 0.25f / *middle : 1.0f;
}

render::image exposed(render::image picture, float exposure) {
  for (vec3& pixel : picture.pixels) pixel *= exposure;
  return picture;
}

render::image marked(render::image picture, int x, int y) {
  for (int dy = -mark_radius; dy <= mark_radius; ++dy)
    for (int dx = -mark_radius; dx <= mark_radius; ++dx) {
      const int px = x + dx, py = y + dy;
      const bool is_frame = std::max(std::abs(dx), std::abs(dy)) == mark_radius;
      if (is_frame && px >= 0 && py >= 0 && px < picture.width && py < picture.height)
        picture.pixels[std::size_t(py) * std::size_t(picture.width) + std::size_t(px)] = mark_colour;
    }
  return picture;
}

}  // namespace inspect
