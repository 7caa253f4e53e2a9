// The least that guiding takes, with no renderer around it: a closed box with a bright patch in its ceiling,
// one wave of rays on its floor. Light is deposited by hand; the guider then sends the rays' next directions
// toward the patch.
#include <wfpg/exec/seq.hpp>
#include <wfpg/path_guider.hpp>

#include <cmath>
#include <cstdio>
#include <vector>

using namespace wfpg;

// A white Lambertian surface whose normal is +y.
struct lambert {
  float eval(vec3, vec3 incident) const { return pdf({}, incident); }
  float pdf(vec3, vec3 incident) const { return std::fmax(incident.y, 0.0f) * 0.31830989f; }
  bsdf_sample sample(vec3 outgoing, vec2 u) const {
    const float r = std::sqrt(u.x), phi = 6.2831853f * u.y;
    const vec3 d(r * std::cos(phi), std::sqrt(1.0f - u.x), r * std::sin(phi));
    return {d, pdf(outgoing, d)};
  }
  bool is_delta() const { return false; }
  bool transmits() const { return false; }
};

// A grid of 16 x 16 points of the floor, looked at from above.
struct floor_surfaces {
  surface<lambert> operator()(std::uint32_t ray) const {
    const vec3 p((float(ray % 16) + 0.5f) / 16.0f, 0.0f, (float(ray / 16) + 0.5f) / 16.0f);
    return {p, {0, 1, 0}, {0, 1, 0}, {0, 1, 0}, lambert{}, true};
  }
};

struct random_numbers {
  vec2 operator()(std::uint32_t ray, std::uint32_t dimension) const {
    const std::uint32_t h = (ray * 2u + dimension + 1u) * 2654435761u;
    return {float(h >> 8) * 0x1p-24f, float((h * 1664525u + 1013904223u) >> 8) * 0x1p-24f};
  }
};

// The unit box from inside: every ray hits a face.
struct box_caster {
  ray_hit operator()(const ray& r) const {
    float nearest = r.t_max;
    for (int axis = 0; axis < 3; ++axis) {
      const float face = r.direction[axis] > 0.0f ? 1.0f : 0.0f;
      if (r.direction[axis] != 0.0f)
        nearest = std::fmin(nearest, (face - r.origin[axis]) / r.direction[axis]);
    }
    return {std::fmax(nearest, 0.0f), 0.0f};
  }
};

int main() {
  const exec::seq policy;
  const std::vector<vec3> corners = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                     {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  const std::vector<uvec3> faces = {{0, 1, 2}, {0, 2, 3}, {4, 6, 5}, {4, 7, 6}, {0, 4, 5}, {0, 5, 1},
                                    {3, 2, 6}, {3, 6, 7}, {0, 3, 7}, {0, 7, 4}, {1, 5, 6}, {1, 6, 2}};
  const buffer<vec3, exec::seq> positions(policy, corners);
  const buffer<uvec3, exec::seq> triangles(policy, faces);

  guider_options options;
  options.octree_resolution = 32;
  options.unguided_samples = 0;
  options.max_rays = 256;
  options.deposit_capacity = 6 * 1024;
  path_guider<exec::seq> guider(policy, {positions.view(), triangles.view()}, options);

  // Light as paths would find it: a bright patch in the ceiling, darkness on the rest of the six faces. A
  // path tracer records its paths in guider.recorder() instead.
  for (int i = 0; i < 6 * 1024; ++i) {
    const int axis = i / 2048, upper = i / 1024 % 2;
    const float u = (float(i % 32) + 0.5f) / 32.0f, v = (float(i / 32 % 32) + 0.5f) / 32.0f;
    vec3 position, inward(0.0f);
    position[axis] = float(upper);
    position[(axis + 1) % 3] = u;
    position[(axis + 2) % 3] = v;
    inward[axis] = upper ? -1.0f : 1.0f;
    const bool bright = axis == 1 && upper && u > 0.7f && v > 0.7f;
    guider.cache().deposit(position, inward, bright ? 100.0f : 0.0f);
  }
  guider.end_sample();

  guider.begin_sample();
  std::vector<sampled_direction> directions(256);
  guider.sample_directions(wave{0, directions.size(), floor_surfaces{}, random_numbers{}}, box_caster{},
                           {directions.data(), directions.size()});
  for (std::size_t ray = 0; ray < directions.size(); ray += 16) {
    const sampled_direction& next = directions[ray];
    const vec3 d = next.direction;
    const char* by = next.technique == sampling_technique::guide ? "guide" : "BSDF";
    std::printf("ray %3zu: direction (% .3f % .3f % .3f), density %8.4f per steradian, by the %s\n", ray, d.x,
                d.y, d.z, next.pdf, by);
  }
}
