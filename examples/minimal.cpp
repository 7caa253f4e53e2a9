// The smallest program that guides, without a renderer: a white floor, lit by a small lamp in the ceiling.
// Prints how much guiding reduces the variance of the floor's light.
#include <wfpg/exec/seq.hpp>
#include <wfpg/octree/svo_ray_caster.hpp>
#include <wfpg/path_guider.hpp>

#include <cmath>
#include <cstdio>
#include <vector>

using namespace wfpg;

struct lambert {  // white; its normal is +y
  float eval(vec3, vec3 wi) const { return std::fmax(wi.y, 0.0f) / pi; }
  float pdf(vec3 wo, vec3 wi) const { return eval(wo, wi); }
  bsdf_sample sample(vec3 wo, vec2 u) const {
    const float r = std::sqrt(u.x), phi = 2 * pi * u.y;
    const vec3 wi(r * std::cos(phi), std::sqrt(1 - u.x), r * std::sin(phi));
    return {wi, pdf(wo, wi)};
  }
  bool is_delta() const { return false; }
  bool transmits() const { return false; }
};

int main() {
  const std::vector<vec3> corners{{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1},
                                  {0, 1, 0}, {1, 1, 0}, {1, 1, 1}, {0, 1, 1}};
  const std::vector<uvec3> triangles{{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};  // a floor and a ceiling
  constexpr std::uint32_t n = 4096, samples = 16;
  kept_guide_options options;
  options.max_paths = n;
  path_guider<exec::seq> guider(exec::seq(), {{corners.data(), 8}, {triangles.data(), 4}}, options);
  const svo_ray_caster caster(guider.guide().octree().view());
  std::vector<sampled_direction> next(n);
  for (std::uint32_t sample = 0; sample < samples; ++sample) {
    const auto floor = [](std::uint32_t i) {
      return surface<lambert>{
          {(i % 64 + 0.5f) / 64, 0, (i / 64 + 0.5f) / 64}, {0, 1, 0}, {0, 1, 0}, {0, 1, 0}};
    };
    const auto random = [&](std::uint32_t i, std::uint32_t d) { return unit_vec2(hash(hash(sample, d), i)); };
    guider.begin_sample();
    guider.sample_directions(wave{0u, n, floor, random}, caster, {next.data(), n});
    double sum = 0, squares = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      const vec3 p = floor(i).position, wi = next[i].direction, hit = p + wi / wi.y;
      const vec3 throughput(lambert().eval({}, wi) / next[i].pdf);
      const bool lit = hit.x > 0.8f && hit.x < 1 && hit.z > 0.8f && hit.z < 1;
      guider.recorder().vertex(i, 0, p, {0, 1, 0}, vec3(1));
      guider.recorder().scatter(i, 0, next[i]);
      guider.recorder().vertex(i, 1, hit, -wi, throughput);
      guider.recorder().emission(i, 1, lit ? 25.0f * throughput : vec3(0));
      sum += lit ? 25.0 * throughput.x : 0.0;
      squares += lit ? 625.0 * throughput.x * throughput.x : 0.0;
    }
    guider.end_sample();
    std::printf("sample %2u: variance %.2f\n", sample, squares / n - sum / n * sum / n);
  }
}
