// Renders chunks of references, and averages them.
#include "reference.hpp"

#include <algorithm>

namespace quality {
namespace {

constexpr std::array<const char*, 2> names = {"path tracing", "guided"};
constexpr std::array<const char*, 2> arguments = {"--method pt", "--method wfpg"};
/// Far from the seeds of measured renderings.
constexpr std::array<int, 2> first_seeds = {1000001, 2000001};

planned_run plan_chunk(const scene_choice& scene, const std::string& identity, std::size_t half, int index,
                       int spp) {
  const method sampled{"reference", arguments[half]};
  planned_run run;
  run.options = options_of(scene, sampled);
  run.options.spp = spp;
  run.options.seed = static_cast<std::uint64_t>(first_seeds[half] + index);
  run.title = scene.title + ", reference, " + names[half] + ", part " + std::to_string(index + 1);
  run.rate = scene.title + ", " + (half == 0 ? "pt" : "wfpg");
  run.key.label = file_name_of("reference-" + scene.title);
  run.key.content = key_of_scene(scene, identity);
  run.key.content["method"] = sampled.arguments;
  run.key.content["spp"] = spp;
  run.key.content["seed"] = run.options.seed;
  return run;
}

/// The mean over the chunks' samples.
render::image render_half(const std::vector<planned_run>& chunks, const render::scene& scene, runner& runs) {
  std::vector<glm::dvec3> sums;
  double samples = 0.0;
  for (const planned_run& chunk : chunks) {
    const render::image picture = runs.get(
        chunk,
        [&] {
          render::render_result result = render::render(scene, chunk.options, {});
          return cache_entry{json::object(), std::move(result.picture)};
        },
        [&](cache_entry& entry) { return picture_of(entry, chunk.options); });
    sums.resize(picture.pixels.size(), glm::dvec3(0.0));
    for (std::size_t i = 0; i < sums.size(); ++i)
      sums[i] += double(chunk.options.spp) * glm::dvec3(picture.pixels[i]);
    samples += chunk.options.spp;
  }
  render::image mean = render::make_image(chunks.front().options.width, chunks.front().options.height);
  for (std::size_t i = 0; i < sums.size(); ++i) mean.pixels[i] = render::vec3(sums[i] / samples);
  return mean;
}

}  // namespace

std::string reference_plan::hash() const {
  std::string keys;
  for (const std::vector<planned_run>& half : halves)
    for (const planned_run& chunk : half) keys += chunk.key.content.dump();
  return hash_of(keys);
}

reference_plan plan_reference(const scene_choice& scene, const std::string& identity, int spp, int chunk) {
  reference_plan plan;
  for (std::size_t half = 0; half < 2; ++half) {
    const int samples = half == 0 ? spp - spp / 2 : spp / 2;
    for (int done = 0, index = 0; done < samples; done += chunk, ++index)
      plan.halves[half].push_back(plan_chunk(scene, identity, half, index, std::min(chunk, samples - done)));
  }
  return plan;
}

reference make_reference(const reference_plan& plan, const render::scene& scene, runner& runs) {
  reference result;
  for (std::size_t half = 0; half < 2; ++half)
    result.halves[half] = render_half(plan.halves[half], scene, runs);
  result.picture = result.halves[0];
  for (std::size_t i = 0; i < result.picture.pixels.size(); ++i)
    result.picture.pixels[i] = 0.5f * (result.halves[0].pixels[i] + result.halves[1].pixels[i]);
  result.noise = render::noise_of_halves(result.halves[0], result.halves[1]);
  return result;
}

}  // namespace quality
