// Groups of lights. A piece is an emitter's triangles in one plane, or a light without extent. Groups of
// pieces are split in two, those with the most different pieces first. The split is along the coordinate of
// six that varies most.
#include "lights/light_groups.hpp"

#include "lights/lights.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

namespace render {
namespace {

/// A light, as the table counts it.
struct single_light {
  std::uint32_t number;  ///< as in grouped_lights::lights
  vec3 position;
  vec3 normal;  ///< zero: it emits in all directions
  double power;
};

/// Position in units of the scene's radius, and direction of emission. Opposite directions are as far apart
/// as places at a fifth of the radius.
using features = std::array<double, 6>;
constexpr double weight_of_normals = 0.1;
/// The standard deviation of a group that needs no split.
constexpr double close_enough = 0.02;

/// Lights that stay in one group.
struct piece {
  std::vector<std::uint32_t> members;
  double power = 0.0;
  features mean{};

  void add(std::uint32_t member, const single_light& light, float scene_radius) {
    const vec3 place = scene_radius > 0.0f ? light.position / scene_radius : vec3(0.0f);
    members.push_back(member);
    power += light.power;
    const double part = light.power / power;
    for (int k = 0; k < 3; ++k) {
      double& x = mean[static_cast<std::size_t>(k)];
      double& n = mean[static_cast<std::size_t>(k + 3)];
      x += part * (static_cast<double>(place[k]) - x);
      n += part * (weight_of_normals * static_cast<double>(light.normal[k]) - n);
    }
  }
};

/// Pieces that form a group.
struct cluster {
  std::vector<const piece*> pieces;
  double power = 0.0;
  features mean{}, variance{};

  explicit cluster(std::vector<const piece*> of) : pieces(std::move(of)) {
    for (const piece* p : pieces) {
      power += p->power;
      for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += p->power * p->mean[k];
    }
    for (double& m : mean) m /= power;
    for (const piece* p : pieces)
      for (std::size_t k = 0; k < mean.size(); ++k)
        variance[k] += p->power * (p->mean[k] - mean[k]) * (p->mean[k] - mean[k]) / power;
  }

  /// How much a split would help. 0 if none is needed.
  double urgency() const {
    const double spread = std::accumulate(variance.begin(), variance.end(), 0.0);
    return spread > close_enough * close_enough ? std::sqrt(power) * spread : 0.0;
  }
  /// Keeps the pieces up to the mean along the coordinate that varies most, and returns the others.
  cluster split() {
    const auto axis =
        static_cast<std::size_t>(std::max_element(variance.begin(), variance.end()) - variance.begin());
    const auto middle = std::partition(pieces.begin(), pieces.end(),
                                       [&](const piece* p) { return p->mean[axis] <= mean[axis]; });
    cluster other(std::vector<const piece*>(middle, pieces.end()));
    pieces.erase(middle, pieces.end());
    *this = cluster(std::move(pieces));
    return other;
  }
};

std::vector<cluster> clusters_of(const std::vector<piece>& pieces, std::uint32_t most) {
  std::vector<const piece*> all;
  for (const piece& p : pieces) all.push_back(&p);
  std::vector<cluster> clusters;
  if (!all.empty()) clusters.emplace_back(std::move(all));
  while (!clusters.empty() && clusters.size() < most) {
    const auto widest =
        std::max_element(clusters.begin(), clusters.end(),
                         [](const cluster& a, const cluster& b) { return a.urgency() < b.urgency(); });
    if (!(widest->urgency() > 0.0)) break;
    cluster other = widest->split();
    clusters.push_back(std::move(other));
  }
  return clusters;
}

std::vector<single_light> lights_of(const scene& host, float scene_radius) {
  const std::vector<float> luminances = emitted_luminances(host);
  std::vector<single_light> lights;
  for (std::size_t i = 0; i < host.triangles.size(); ++i) {
    const float luminance = luminances[host.triangle_materials[i]];
    if (!(luminance > 0.0f)) continue;
    const uvec3 t = host.triangles[i];
    const vec3 a = host.positions[t.x], b = host.positions[t.y], c = host.positions[t.z];
    const vec3 normal = glm::cross(b - a, c - a);
    const float area = 0.5f * glm::length(normal);
    if (!(area > 0.0f)) continue;
    lights.push_back({static_cast<std::uint32_t>(i), (a + b + c) / 3.0f, normal / (2.0f * area),
                      static_cast<double>(luminance) * static_cast<double>(area)});
  }
  for (std::uint32_t i = 0; i < host.punctual_lights.size(); ++i) {
    const punctual_light& light = host.punctual_lights[i];
    const auto power = static_cast<double>(light_view::power_of(light, scene_radius));
    lights.push_back({grouped_lights::beyond_triangles | i, light.position, vec3(0.0f), power});
  }
  return lights;
}

/// Triangles are one piece if they share a corner, a material and, except for rounding, a normal.
std::vector<piece> pieces_of(const scene& host, const std::vector<single_light>& lights, float scene_radius) {
  std::vector<std::uint32_t> first(lights.size());  // of its piece, or a triangle nearer to it
  std::iota(first.begin(), first.end(), 0u);
  const auto find = [&](std::uint32_t i) {
    while (first[i] != i) i = first[i] = first[first[i]];
    return i;
  };
  std::map<std::tuple<float, float, float, std::uint32_t>, std::vector<std::uint32_t>> at_corner;
  for (std::uint32_t i = 0; i < lights.size(); ++i) {
    if (lights[i].number & grouped_lights::beyond_triangles) continue;
    const uvec3 t = host.triangles[lights[i].number];
    for (const std::uint32_t corner : {t.x, t.y, t.z}) {
      const vec3 p = host.positions[corner];
      auto& others = at_corner[{p.x, p.y, p.z, host.triangle_materials[lights[i].number]}];
      for (const std::uint32_t other : others)
        if (glm::dot(lights[i].normal, lights[other].normal) > 0.9999f) first[find(i)] = find(other);
      others.push_back(i);
    }
  }
  std::map<std::uint32_t, piece> pieces;
  for (std::uint32_t i = 0; i < lights.size(); ++i)
    if (lights[i].power > 0.0) pieces[find(i)].add(i, lights[i], scene_radius);
  std::vector<piece> result;
  for (auto& [number, p] : pieces) result.push_back(std::move(p));
  return result;
}

wfpg::bounds3 box_of(const scene& host) {
  wfpg::bounds3 box;
  for (const vec3& p : host.positions) box = {glm::min(box.lower, p), glm::max(box.upper, p)};
  return box;
}

double power_of_sky(const scene& host, float scene_radius) {
  if (host.sky.texels.empty()) return 0.0;
  const std::vector<double> powers = texel_powers(host.sky);
  return static_cast<double>(scene_radius * scene_radius) *
         std::accumulate(powers.begin(), powers.end(), 0.0);
}

}  // namespace

grouped_lights group_lights(const scene& host, std::uint32_t most) {
  grouped_lights result;
  const wfpg::bounds3 box = box_of(host);
  if (!box.empty()) {
    result.scene_radius = 0.5f * glm::length(box.extent());
    result.scene_centre = 0.5f * (box.lower + box.upper);
  }
  const std::vector<single_light> lights = lights_of(host, result.scene_radius);
  const std::vector<piece> pieces = pieces_of(host, lights, result.scene_radius);
  const auto append = [&](std::uint32_t number, double power) {
    result.lights.push_back(number);
    result.powers.push_back(power);
    result.total_power += power;
    ++result.groups.back().count;
  };
  for (const cluster& c : clusters_of(pieces, most)) {
    result.groups.push_back({static_cast<std::uint32_t>(result.lights.size()), 0, 0.0f});
    std::vector<std::uint32_t> members;
    for (const piece* p : c.pieces) members.insert(members.end(), p->members.begin(), p->members.end());
    std::sort(members.begin(), members.end());
    for (const std::uint32_t i : members) append(lights[i].number, lights[i].power);
  }
  if (const double power = power_of_sky(host, result.scene_radius); power > 0.0) {
    if (result.groups.empty() || most > 1)
      result.groups.push_back({static_cast<std::uint32_t>(result.lights.size()), 0, 0.0f});
    append(grouped_lights::beyond_triangles | static_cast<std::uint32_t>(host.punctual_lights.size()), power);
  }
  for (light_group& group : result.groups) {
    const auto begin = result.powers.begin() + group.first;
    group.share = static_cast<float>(std::accumulate(begin, begin + group.count, 0.0) / result.total_power);
  }
  if (result.groups.size() < 2) return result;
  result.triangle_groups.assign(host.triangles.size(), 0);
  for (std::size_t g = 0; g < result.groups.size(); ++g)
    for (std::uint32_t i = 0; i < result.groups[g].count; ++i)
      if (const std::uint32_t number = result.lights[result.groups[g].first + i];
          !(number & grouped_lights::beyond_triangles))
        result.triangle_groups[number] = static_cast<std::uint8_t>(g);
  return result;
}

}  // namespace render
