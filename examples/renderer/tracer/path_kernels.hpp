// The kernels of a wave: functors of an index on the data of path_state.hpp. A Recorder is what
// wfpg::path_guider::recorder() returns, or one that does nothing.
#pragma once

#include "scene/camera.hpp"
#include "tracer/path_state.hpp"

#include <wfpg/sampling/mis.hpp>
#include <wfpg/sampling/sampled_direction.hpp>

namespace render {

/// The sample and depth of a wave. Depth counts vertices from 0, the camera's first hit.
struct wave_position {
  random_stream random;
  std::uint32_t depth = 0;
  std::uint32_t max_depth = 1;  ///< most vertices of a path

  WFPG_HD bool is_last() const { return depth + 1 >= max_depth; }
  WFPG_HD std::uint32_t first_dimension() const { return depth * dimension::per_vertex; }
  WFPG_HD vec2 draw(std::uint32_t path, std::uint32_t use) const {
    return random(path, first_dimension() + use);
  }
};

/// The lights as paths find them: by hits, and by next-event estimation if it is on.
struct path_lights {
  scene_view scene;
  light_view lights;
  bool next_event = true;
  wfpg::light_guide_view guide = {};  ///< rests: lights are chosen by power

  /// A light that was chosen for a vertex.
  struct chosen_light {
    std::uint32_t light = 0;                       ///< a column of the lights' table
    float preference = 1.0f;                       ///< probability of its group, over that by power
    std::uint32_t choice = wfpg::no_light_choice;  ///< key of the choice of a group
  };
  /// Chooses a light for a vertex. draw(dimension) returns random numbers in [0,1)². Precondition: there is
  /// a light.
  template <class Draw>
  WFPG_HD chosen_light choose(const path_vertex& vertex, const Draw& draw) const {
    const vec2 u = draw(dimension::light_choice);
    if (guide.rests()) return {lights.pick_of_all(u), 1.0f, wfpg::no_light_choice};
    const wfpg::light_choice choice = guide.choose(row(vertex), draw(dimension::light_group).x);
    return {lights.pick_in(choice.group, u), choice.probability / lights.groups[choice.group].share,
            choice.key};
  }
  /// The probability of a group at a vertex with this choice, over its probability by power.
  WFPG_HD float preference(const path_vertex& vertex, std::uint32_t choice, std::uint32_t group) const {
    if (guide.rests()) return 1.0f;
    const std::uint32_t of = choice == wfpg::no_light_choice ? row(vertex) : guide.row_of(choice);
    return guide.probability(of, group) / lights.groups[group].share;
  }

 private:
  WFPG_HD std::uint32_t row(const path_vertex& vertex) const {
    return guide.find(vertex.position, vertex.geometric_normal);
  }
};

/// Starts paths through pixels. Those of samples from `end` on do not begin. A Camera is a pinhole, or
/// another type with through().
template <class Camera>
struct start_paths {
  Camera camera;
  random_stream random;
  tiled_view<path_state> paths;
  wfpg::array_view<vec3> radiance;
  std::uint32_t end;

  WFPG_HD void operator()(std::size_t i) const {
    const auto path = static_cast<std::uint32_t>(i);
    paths.emplace(i, camera.through(random.pixel_of(path), random(path, dimension::pixel)));
    if (random.sample_of(path) >= end) paths.update(i, [](path_state& ended) { ended.active = 0; });
    radiance[i] = vec3(0.0f);
  }
};

/// Queries of kernels to an inline caster.
template <class Caster>
struct inline_answers {
  Caster caster;

  WFPG_HD triangle_hit hit(std::size_t, const wfpg::ray& ray) const { return caster.intersect(ray); }
  WFPG_HD bool is_hidden(std::size_t, const wfpg::ray& ray) const { return caster.occluded(ray); }
  WFPG_HD void asks_nothing(std::size_t) const {}
};

/// Hits of a batch caster, whose rays an earlier kernel wrote.
struct batch_hits {
  wfpg::array_view<const triangle_hit> hits;

  WFPG_HD triangle_hit hit(std::size_t i, const wfpg::ray&) const { return hits[i]; }
};

/// Writes rays for a batch caster. drop_hidden reads their answers.
struct batch_questions {
  wfpg::array_view<wfpg::ray> rays;

  WFPG_HD bool is_hidden(std::size_t i, const wfpg::ray& ray) const {
    rays[i] = ray;
    return false;
  }
  WFPG_HD void asks_nothing(std::size_t i) const { rays[i] = no_ray(); }

  /// A ray that batch casters do not trace.
  WFPG_HD static wfpg::ray no_ray() {
    wfpg::ray ray;
    ray.t_max = 0.0f;
    return ray;
  }
};

/// Writes the paths' rays for a batch caster.
struct write_rays {
  path_queue queue;
  tiled_view<path_state> paths;
  wfpg::array_view<wfpg::ray> rays;

  WFPG_HD void operator()(std::size_t slot) const {
    rays[slot] = batch_questions::no_ray();
    if (!queue.holds(slot)) return;
    const path_state& path = paths[queue[slot]];
    if (path.active) rays[slot] = path.ray();
  }
};

/// Finds the next vertex of each path that may continue, adds its emission, and returns the path's queue.
template <class Answers, class Recorder>
struct trace_paths {
  wave_position at;
  path_lights world;
  Answers answers;
  Recorder recorder;
  path_queue queue;  ///< of the previous vertex
  tiled_view<path_state> paths;
  tiled_view<path_vertex> vertices;
  tiled_view<light_query> queries;       ///< of the previous vertex
  wfpg::array_view<std::uint32_t> keys;  ///< the material's kind, or excluded
  wfpg::array_view<vec3> radiance;
  wfpg::array_view<std::uint32_t> segments;
  wfpg::array_view<std::uint32_t> light_hits;  ///< segments that ended where light is emitted toward them
  std::uint32_t excluded;

  WFPG_HD void operator()(std::size_t slot) const {
    if (!queue.holds(slot)) return;
    const std::uint32_t id = queue[slot];
    keys[id] = excluded;
    const path_state& path = paths[id];
    if (!path.active) return;
    ++segments[id];
    const triangle_hit hit = answers.hit(slot, path.ray());
    if (!hit.is_hit()) {
      recorder.escape(id, at.depth, path.throughput);
      const vec3 sky = world.scene.environment.radiance(path.direction);
      count_light(id, sky);
      gather(id, path.throughput * sky * environment_weight(slot, id, path));
      return end(id);
    }
    const hit_surface found = world.scene.surface(hit, -path.direction, !at.is_last());
    const wfpg::surface<bsdf>& surface = found.surface;
    const vec3 before = path.throughput, throughput = before * absorb(id, path, found);
    recorder.vertex(id, at.depth, surface.position, surface.outgoing, throughput);
    count_light(id, found.emission);
    gather(id, throughput * found.emission * emission_weight(slot, id, path, hit, found));
    if (at.is_last()) return end(id);
    vertices.emplace(id, found);
    keys[id] = static_cast<std::uint32_t>(surface.bsdf.kind);
  }

 private:
  WFPG_HD void end(std::uint32_t id) const {
    paths.update(id, [](path_state& path) { path.active = 0; });
  }

  // The fraction of light that a solid leaves along the path's last segment. It is inside if it ends at a
  // back side.
  WFPG_HD vec3 absorb(std::uint32_t id, const path_state& path, const hit_surface& found) const {
    if (found.absorption == vec3(0.0f)) return vec3(1.0f);
    const vec3 left = glm::exp(-found.absorption * glm::length(found.surface.position - path.origin));
    paths.update(id, [&](path_state& p) {
      p.throughput *= left;
      p.reflectance *= wfpg::luminance(left);
    });
    return left;
  }

  WFPG_HD void count_light(std::uint32_t id, vec3 emitted) const {
    if (emitted != vec3(0.0f)) ++light_hits[id];
  }

  WFPG_HD void gather(std::uint32_t id, vec3 contribution) const {
    if (contribution == vec3(0.0f)) return;
    radiance[id] += contribution;
    recorder.emission(id, at.depth, contribution);
  }

  WFPG_HD float environment_weight(std::size_t slot, std::uint32_t id, const path_state& path) const {
    if (!world.next_event || !(path.pdf > 0.0f)) return 1.0f;
    const float pdf = world.lights.environment_pdf(world.scene.environment, path.direction);
    if (!(pdf > 0.0f)) return 1.0f;
    return wfpg::power_heuristic(path.pdf, pdf * preference(slot, id, world.lights.sky_group()));
  }

  // Precondition: the path has a previous vertex.
  WFPG_HD float preference(std::size_t slot, std::uint32_t id, std::uint32_t group) const {
    return world.preference(vertices[id], queries[slot].choice, group);
  }

  // MIS weight against next-event estimation at the previous vertex, which could have found this point.
  WFPG_HD float emission_weight(std::size_t slot, std::uint32_t id, const path_state& path,
                                const triangle_hit& hit, const hit_surface& found) const {
    if (!world.next_event || !(path.pdf > 0.0f) || found.emission == vec3(0.0f)) return 1.0f;
    const vec3 normal = found.surface.geometric_normal;
    const float cosine = std::abs(glm::dot(normal, path.direction));
    const float distance = glm::length(found.surface.position - path.origin);
    const float pdf =
        world.lights.pdf(found.emitted_luminance) * preference(slot, id, world.lights.group_of(hit.triangle));
    return wfpg::power_heuristic(path.pdf, solid_angle_pdf(pdf, distance, cosine));
  }
};

/// Next-event estimation without its weight: samples a point on a light for each slot and tests whether it is
/// visible.
template <class Answers>
struct query_lights {
  wave_position at;
  path_lights world;
  Answers answers;
  path_queue queue;
  tiled_view<path_vertex> vertices;
  tiled_view<light_query> queries;

  WFPG_HD void operator()(std::size_t slot) const {
    answers.asks_nothing(slot);
    queries.emplace(slot, queue.holds(slot) ? query(slot, queue[slot]) : light_query{});
  }

 private:
  WFPG_HD light_query query(std::size_t slot, std::uint32_t path) const {
    const path_vertex& vertex = vertices[path];
    const bsdf scatters = vertex.bsdf();
    if (scatters.is_delta() || world.lights.of_all.empty()) return {};
    const auto draw = [&](std::uint32_t use) { return at.draw(path, use); };
    const path_lights::chosen_light chosen = world.choose(vertex, draw);
    light_sample light = world.lights.sample(world.scene, vertex.position, chosen.light, draw);
    light.pdf *= chosen.preference;
    const light_query nothing(chosen.choice);
    if (!(light.pdf > 0.0f)) return nothing;
    light_query result = nothing;
    result.direction = light.direction;
    result.pdf = light.is_delta ? unrivalled_pdf : light.pdf;
    result.value = scatters.eval_rgb(vertex.outgoing, light.direction) * light.radiance / light.pdf;
    if (!(wfpg::luminance(result.value) > 0.0f)) return nothing;
    return is_hidden(slot, vertex, light) ? nothing : result;
  }

  WFPG_HD bool is_hidden(std::size_t slot, const path_vertex& vertex, const light_sample& light) const {
    const wfpg::ray ray = ray_toward(
        leave_surface(vertex.position, vertex.geometric_normal, light.direction, vertex.offset), light);
    return ray.t_max > 0.0f && answers.is_hidden(slot, ray);
  }

  // Every density is negligible beside this one, since hits never find a light without extent.
  static constexpr float unrivalled_pdf = 1e30f;
};

/// Drops the light samples that a batch caster found hidden.
struct drop_hidden {
  wfpg::array_view<const std::uint32_t> hidden;
  tiled_view<light_query> queries;

  WFPG_HD void operator()(std::size_t slot) const {
    if (hidden[slot] != 0) queries.emplace(slot, light_query(queries[slot].choice));
  }
};

/// Adds each slot's light sample with its MIS weight, and continues the path along its sampled direction.
template <class Recorder>
struct shade_paths {
  wave_position at;
  Recorder recorder;
  path_queue queue;
  tiled_view<path_vertex> vertices;
  tiled_view<light_query> queries;          ///< empty: no next-event estimation
  wfpg::array_view<const float> densities;  ///< the mixture's, of the queries' directions
  wfpg::array_view<const wfpg::sampled_direction> directions;
  tiled_view<path_state> paths;
  wfpg::array_view<vec3> radiance;
  wfpg::light_guide_view lights;
  std::uint32_t roulette_depth;  ///< roulette begins at this vertex

  WFPG_HD void operator()(std::size_t slot) const {
    if (!queue.holds(slot)) return;
    const std::uint32_t id = queue[slot];
    if (!queries.empty()) add_light(slot, id);
    recorder.scatter(id, at.depth, directions[slot]);
    paths.update(id, [&](path_state& path) {
      const bool goes_on =
          scatter(vertices[id], directions[slot], path) &&
          (at.depth < roulette_depth || survive_roulette(path, at.draw(id, dimension::roulette).x));
      path.active = goes_on ? 1 : 0;
    });
  }

 private:
  // Roulette spares paths with more than a tenth of the light. Ending those added more noise than it saved
  // time.
  static constexpr float spared_reflectance = 0.1f;

  WFPG_HD void add_light(std::size_t slot, std::uint32_t id) const {
    const light_query& query = queries[slot];
    if (query.direction == vec3(0.0f)) return lights.deposit(id, query.choice, 0.0f);
    const vec3 scattered = query.value * wfpg::power_heuristic(query.pdf, densities[slot]);
    lights.deposit(id, query.choice, wfpg::luminance(scattered));
    const vec3 contribution = paths[id].throughput * scattered;
    radiance[id] += contribution;
    recorder.radiance(id, at.depth, contribution);
  }

  // False if the path ends.
  WFPG_HD bool scatter(const path_vertex& vertex, const wfpg::sampled_direction& drawn,
                       path_state& path) const {
    if (drawn.technique == wfpg::sampling_technique::none || !(drawn.pdf > 0.0f)) return false;
    const bool delta = drawn.technique == wfpg::sampling_technique::delta;
    const bsdf scatters = vertex.bsdf();
    const vec3 weight = delta ? scatters.delta_weight_rgb(vertex.outgoing, drawn.direction, drawn.pdf)
                              : scatters.eval_rgb(vertex.outgoing, drawn.direction) / drawn.pdf;
    if (!(wfpg::luminance(weight) > 0.0f)) return false;
    path.throughput *= weight;
    // Paths that roulette never ends need no reflectance.
    if (at.max_depth > roulette_depth + 1)
      path.reflectance *= scatters.reflectance(vertex.outgoing, drawn.direction, delta);
    path.pdf = delta ? 0.0f : drawn.pdf;
    path.origin = leave_surface(vertex.position, vertex.geometric_normal, drawn.direction, vertex.offset);
    path.direction = drawn.direction;
    return true;
  }

  // Uses the throughput that the path would have if BSDFs had sampled all its directions. The real one is low
  // where guiding is certain of a direction, and those paths matter most.
  WFPG_HD static bool survive_roulette(path_state& path, float u) {
    const float probability = glm::min(1.0f, path.reflectance / spared_reflectance);
    if (!(u < probability)) return false;
    path.throughput /= probability;
    path.reflectance /= probability;
    return true;
  }
};

}  // namespace render
