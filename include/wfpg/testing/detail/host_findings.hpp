// The verdicts of host_checker: sums over samples, on the host, and their sentences.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/testing/detail/describe.hpp>
#include <wfpg/testing/detail/host_steps.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace wfpg::detail {

/// How many of what a check looked at are wrong, and by how much.
struct counted_faults {
  std::size_t asked = 0, wrong = 0;
  double worst = 0.0;

  void add(bool is_wrong, double by = 0.0) {
    ++asked;
    if (!is_wrong) return;
    ++wrong;
    worst = std::max(worst, by);
  }
  /// Whether they are too many to be exceptions. A few alone prove nothing.
  bool are_many(double exceptions) const { return wrong >= 8 && double(wrong) > exceptions * double(asked); }
};
inline std::ostream& operator<<(std::ostream& out, const counted_faults& f) {
  return out << f.wrong << " of " << f.asked;
}

/// Mean and variance of samples, by Welford's method.
struct running_variance {
  double n = 0.0, mean = 0.0, squares = 0.0;

  void add(double x) {
    n += 1.0;
    const double before = x - mean;
    mean += before / n;
    squares += before * (x - mean);
  }
  /// Of one sample. Precondition: two samples or more.
  double variance() const { return squares / (n - 1.0); }
};

/// Roulette of vertices that are alike: of one depth, and with the throughput that they would have unguided.
class roulette_groups {
 public:
  /// `scale`: product of roulette_scale() along the path, with this vertex.
  void add(std::size_t depth, float throughput, float scale, float survival) {
    const float unguided = throughput * scale;
    if (!is_finite(unguided) || !is_finite(survival) || unguided < least) return;
    const bool is_chosen = scale > chosen;
    if (!is_chosen && scale > 1.0001f) return;
    // Bins are narrow, so that roulette by the unguided throughput is about the same all over a bin.
    const double octaves = std::log2(double(unguided) / double(least));
    const auto bin = std::min(static_cast<std::size_t>(4.0 * octaves), bins - 1);
    if (groups_.size() < (depth + 1) * bins) groups_.resize((depth + 1) * bins);
    (is_chosen ? groups_[depth * bins + bin].chosen : groups_[depth * bins + bin].others).add(survival);
  }

  /// The fault in words, or nothing.
  std::string sentence_of_fault() const {
    // Differences of the bins' means, weighted by what is known of them (Mantel and Haenszel).
    double weights = 0.0, chosen_sum = 0.0, others_sum = 0.0, variance = 0.0, chosen_n = 0.0, others_n = 0.0;
    for (const group& g : groups_) {
      if (g.chosen.n < 2.0 || g.others.n < 2.0) continue;
      const double weight = g.chosen.n * g.others.n / (g.chosen.n + g.others.n);
      weights += weight;
      chosen_sum += weight * g.chosen.mean;
      others_sum += weight * g.others.mean;
      chosen_n += g.chosen.n;
      others_n += g.others.n;
      variance += weight * weight * (g.chosen.variance() / g.chosen.n + g.others.variance() / g.others.n);
    }
    const bool is_known = chosen_n >= 100.0 && others_n >= 100.0;
    const double lost = others_sum - chosen_sum;
    if (!is_known || lost < 0.2 * others_sum || lost < 5.0 * std::sqrt(variance)) return {};
    return sentence("roulette ends guided paths: ", chosen_sum / weights, " of them survive where ",
                    others_sum / weights,
                    " of others do; decide by throughput times the product of wfpg::roulette_scale()");
  }

 private:
  struct group {
    running_variance chosen, others;  ///< by a guide, or not
  };
  static constexpr float chosen = 2.0f;    ///< least scale of a path that the guide chose
  static constexpr float least = 0.125f;   ///< least throughput without a guide
  static constexpr std::size_t bins = 20;  ///< quarters of an octave, and all above 4
  std::vector<group> groups_;
};

/// Variances of pixels with and without a guide.
class pixel_variances {
 public:
  void add(std::size_t i, bool guided, float radiance) {
    if (!is_finite(radiance) || radiance < 0.0f) return;
    if (pixels_.size() <= i) pixels_.resize(i + 1);
    (guided ? pixels_[i].guided : pixels_[i].plain).add(double(radiance));
  }

  /// Says that guiding does not pay, or nothing.
  std::string note() const {
    double plain[parts] = {}, guided[parts] = {}, all_plain = 0.0, all_guided = 0.0;
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
      if (pixels_[i].plain.n < 2.0 || pixels_[i].guided.n < 2.0) continue;
      const double weight = weight_of(i / block);
      plain[i % parts] += weight * pixels_[i].plain.variance();
      guided[i % parts] += weight * pixels_[i].guided.variance();
    }
    for (std::size_t k = 0; k < parts; ++k) all_plain += plain[k], all_guided += guided[k];
    // The error of the ratio, by leaving out one part of the pixels at a time.
    const double ratio = all_guided / std::max(all_plain, 1.0e-30);
    double squares = 0.0;
    for (std::size_t k = 0; k < parts; ++k) {
      if (!(all_plain - plain[k] > 0.0)) return {};
      const double without = (all_guided - guided[k]) / (all_plain - plain[k]) - ratio;
      squares += without * without;
    }
    const double error = std::sqrt(squares * double(parts - 1) / double(parts));
    if (!(ratio - error > 1.0)) return {};
    return sentence("guiding does not pay here: the variance of guided samples is ", ratio, " +- ", error,
                    " of unguided ones");
  }

 private:
  static constexpr std::size_t parts = 32;  ///< of the pixels, for errors
  static constexpr std::size_t block = 64;  ///< pixels in a row

  struct pixel {
    running_variance plain, guided;
  };

  /// Square of the derivative of c / (1 + c) at a block's mean. A pixel's own mean would hide the samples
  /// that make its variance.
  double weight_of(std::size_t b) const {
    double sum = 0.0, n = 0.0;
    for (std::size_t i = b * block; i < std::min((b + 1) * block, pixels_.size()); ++i)
      for (const running_variance* kind : {&pixels_[i].plain, &pixels_[i].guided})
        sum += kind->mean * kind->n, n += kind->n;
    const double slope = 1.0 / (1.0 + sum / std::max(n, 1.0));
    return slope * slope * slope * slope;
  }

  std::vector<pixel> pixels_;
};

/// Counts of all samples so far, and the sentences that follow from them.
class host_findings {
 public:
  host_findings() = default;
  host_findings(bool media, float tolerance, double exceptions)
      : media_(media), tolerance_(tolerance), exceptions_(exceptions) {}

  /// One sample, as copied from the policy's memory.
  struct sample {
    std::vector<logged_step> steps;        ///< those of one depth side by side
    std::vector<logged_query> queries;     ///< likewise
    std::vector<logged_light> lights;      ///< one a path
    std::vector<checked_path> recorded;    ///< by place
    std::vector<checked_vertex> vertices;  ///< those of one place side by side
    std::uint32_t recorder_depth = 0;
    bool has_directions = false;
    bool silent_escapes = false;  ///< the host need not tell of escapes

    const logged_step& step(std::size_t path, std::size_t depth) const {
      return steps[depth * lights.size() + path];
    }
    std::size_t depths() const { return steps.size() / lights.size(); }
  };

  /// Takes all of a sample but its escapes. Returns rays of paths whose next vertex nobody told of.
  std::vector<ray> add(const sample& s) {
    bool guided = false;
    for (const logged_step& step : s.steps) {
      if (!step.has(logged_step::is_logged)) continue;
      add_step(step);
      guided = guided || step.has(logged_step::guided);
    }
    for (const logged_query& query : s.queries)
      if (query.is_logged()) {
        const float off = difference(query.pdf, query.expected);
        queries_.add(off > tolerance_, double(off));
      }
    for (std::size_t path = 0; path < s.lights.size(); ++path) {
      add_roulette(s, path);
      if (s.lights[path].is_logged != 0) pixels_.add(path, guided, s.lights[path].sum);
    }
    return add_recorded(s);
  }
  /// Takes what the rays of add() found.
  void add_escapes(const std::vector<ray_hit>& hits) {
    for (const ray_hit& hit : hits) unheard_ += hit.is_hit() ? 0u : 1u;
  }

  /// A sentence a line.
  std::string report() const {
    std::string text = roulette_.sentence_of_fault();
    const auto add = [&text](const std::string& line) { text += (text.empty() ? "" : "\n") + line; };
    if (narrow_.are_many(exceptions_))
      add(sentence("narrow lobes get the guide's full fraction at ", narrow_,
                   " guided vertices; pass wfpg::glossy_part::unknown(), or the lobe's alpha, to mixture()"));
    if (deltas_.are_many(exceptions_))
      add(sentence("delta lobes get the guide's full fraction, and drew ", deltas_,
                   " guided vertices' directions; pass wfpg::glossy_part{probability, 0} to mixture()"));
    // Of another direction than the path's, neither the next hit nor the density is what the host had.
    const bool steps_are_right = !steps_.are_many(exceptions_);
    if (has_unheard_escapes() && steps_are_right)
      add(sentence("escapes are not told: ", unheard_, " of ", unheard_ + escapes_,
                   " rays left the scene unheard; call recorder.escape() for each, dark or not"));
    if (radiance_.are_many(exceptions_))
      add(sentence("recorded radiance is not the picture's in ", radiance_, " paths, ", recorded_sum_,
                   " against ", told_sum_, " in all; call recorder.total() with all that a path brought"));
    if (scatters_.are_many(exceptions_))
      add(sentence("recorder.scatter() has other directions than the paths took at ", scatters_,
                   " vertices, by up to ", scatters_.worst,
                   " degrees; pass the sampled direction in world space"));
    if (silent_.are_many(exceptions_))
      add(sentence("directions are not told at ", silent_,
                   " recorded vertices; call recorder.scatter() wherever a path goes on"));
    if (untraced_.are_many(exceptions_))
      add(sentence("recorder.scatter() is told of directions that ended paths did not take at ", untraced_,
                   " vertices; with silent_escapes, call it after roulette"));
    if (outgoing_.are_many(exceptions_))
      add(sentence(
          "recorder.vertex() has an outgoing direction that does not point to the previous vertex at ",
          outgoing_, " vertices; pass -ray.direction"));
    if (!steps_are_right)
      add(sentence("host_step::wi is not the direction that paths took at ", steps_, " vertices, by up to ",
                   steps_.worst, " degrees; pass it in world space"));
    if (densities_.are_many(exceptions_) && steps_are_right)
      add(sentence("densities of directions are not the mixture's at ", densities_,
                   " vertices; ask mixture.pdf() in world space, or delta_pdf() of a delta lobe"));
    if (queries_.are_many(exceptions_))
      add(sentence("densities of next-event estimation are not the mixture's in ", queries_,
                   " queries; ask mixture.pdf() in world space, with the BSDF's own density"));
    return text;
  }
  std::string note() const { return pixels_.note(); }

 private:
  // Chord between unit directions that are not one: a degree. Spawned rays begin beside their vertex.
  static constexpr float other_direction = 0.02f;

  static bool differs(vec3 a, vec3 b) {
    // Directions that are not finite differ, whatever a compiler assumes of comparisons.
    const float chord = glm::distance(a, b);
    return !is_finite(chord) || chord > other_direction;
  }
  static double degrees(vec3 a, vec3 b) {
    const double chord = is_finite(glm::distance(a, b)) ? double(glm::distance(a, b)) : 2.0;
    return 2.0 * std::asin(std::min(0.5 * chord, 1.0)) * 180.0 / double(pi);
  }

  void add_step(const logged_step& step) {
    if (step.has(logged_step::guided)) {
      const bool in_full = step.has(logged_step::in_full);
      narrow_.add(step.has(logged_step::narrow) && in_full);
      deltas_.add(step.has(logged_step::delta) && in_full);
    }
    // Where nothing could be drawn, the path ends, and its density does not matter.
    if (float_bits(step.pdf) == 0 && !step.has(logged_step::goes_on)) return;
    const float off = difference(step.pdf, step.expected);
    densities_.add(off > tolerance_, double(off));
  }

  void add_roulette(const sample& s, std::size_t path) {
    float scale = 1.0f;
    for (std::size_t depth = 0; depth < s.depths(); ++depth) {
      const logged_step& step = s.step(path, depth);
      if (!step.has(logged_step::is_logged)) continue;
      scale *= step.scale;
      roulette_.add(depth, step.throughput, scale, step.survival);
    }
  }

  std::vector<ray> add_recorded(const sample& s) {
    std::vector<ray> rays;
    const float near = 1.0e-3f * extent_of(s);
    for (std::size_t place = 0; place < s.recorded.size(); ++place) {
      const checked_path& path = s.recorded[place];
      if (path.path == ~0u || path.vertices == 0) continue;
      const checked_vertex* const vertices = s.vertices.data() + place * s.recorder_depth;
      add_light(s, path, vertices);
      if (!s.has_directions) continue;
      for (std::uint32_t depth = 0; depth < path.surfaces; ++depth)
        if (vertices[depth].has(checked_vertex::is_surface)) add_directions(s, path, vertices, depth, near);
      if (path.vertices > path.surfaces)
        ++escapes_;
      else if (!media_ && !s.silent_escapes)  // in media a ray that misses may not have left the scene
        add_ray(s, path, vertices[path.surfaces - 1], 0.1f * near, rays);
    }
    return rays;
  }
  /// Diagonal of the box of all recorded vertices.
  static float extent_of(const sample& s) {
    bounds3 box;
    for (std::size_t place = 0; place < s.recorded.size(); ++place)
      for (std::uint32_t depth = 0; s.recorded[place].path != ~0u && depth < s.recorded[place].surfaces;
           ++depth) {
        const checked_vertex& v = s.vertices[place * s.recorder_depth + depth];
        if (!v.has(checked_vertex::is_surface) || !is_finite(v.position)) continue;
        box.lower = glm::min(box.lower, v.position);
        box.upper = glm::max(box.upper, v.position);
      }
    return box.empty() ? 0.0f : glm::length(box.extent());
  }

  void add_light(const sample& s, const checked_path& path, const checked_vertex* vertices) {
    const logged_light& told = s.lights[path.path];
    if (told.is_logged == 0) return;
    double sum = 0.0;
    for (std::uint32_t depth = 0; depth < path.vertices; ++depth) sum += double(vertices[depth].contribution);
    const float off = difference(static_cast<float>(sum), told.sum);
    // Dark paths agree, and prove nothing.
    if (sum == 0.0 && told.sum == 0.0f) return;
    radiance_.add(off > tolerance_, double(off));
    if (!(off > tolerance_)) return;
    recorded_sum_ += sum;
    told_sum_ += double(told.sum);
  }

  void add_directions(const sample& s, const checked_path& path, const checked_vertex* vertices,
                      std::uint32_t depth, float near) {
    static constexpr logged_step none{};
    const checked_vertex& here = vertices[depth];
    const logged_step& step = depth < s.depths() ? s.step(path.path, depth) : none;
    const bool scattered = here.has(checked_vertex::has_scattered);
    if (step.has(logged_step::goes_on)) silent_.add(!scattered);
    // Of directions that were not traced nothing is heard, and the guide would take them for dark.
    else if (s.silent_escapes && step.has(logged_step::is_logged) && depth + 1 < s.recorder_depth)
      untraced_.add(scattered);

    // The way to the next vertex is what the path took. A gap between the two hides it.
    if (depth + 1 >= path.surfaces || !vertices[depth + 1].has(checked_vertex::is_surface)) return;
    const vec3 way = vertices[depth + 1].position - here.position;
    if (!is_finite(way) || !(glm::length(way) > near)) return;
    const vec3 taken = glm::normalize(way);
    outgoing_.add(differs(vertices[depth + 1].outgoing, -taken));
    if (scattered) scatters_.add(differs(here.scattered, taken), degrees(here.scattered, taken));
    if (step.has(logged_step::is_logged))
      steps_.add(differs(step.direction, taken), degrees(step.direction, taken));
  }

  /// Adds the ray with which a path went on from its last vertex, if the host traced it.
  static void add_ray(const sample& s, const checked_path& path, const checked_vertex& last, float near,
                      std::vector<ray>& rays) {
    const std::uint32_t depth = path.surfaces - 1;
    // At the last depth hosts trace no ray, or the recorder has no room for what it finds.
    if (depth + 1 >= s.depths() || depth + 1 >= s.recorder_depth) return;
    const logged_step& step = s.step(path.path, depth);
    if (!last.has(checked_vertex::is_surface) || !step.has(logged_step::goes_on)) return;
    for (std::size_t later = depth + 1; later < s.depths(); ++later)
      if (s.step(path.path, later).has(logged_step::is_logged)) return;
    if (!is_finite(last.position) || !is_finite(step.direction)) return;
    ray r;
    r.origin = last.position;
    r.direction = step.direction;
    r.t_min = near;
    rays.push_back(r);
  }

  bool has_unheard_escapes() const {
    return unheard_ >= 8 && double(unheard_) > 0.1 * double(unheard_ + escapes_);
  }

  bool media_ = false;
  float tolerance_ = 0.0f;
  double exceptions_ = 0.0;
  roulette_groups roulette_;
  counted_faults narrow_, deltas_, radiance_, scatters_, silent_, untraced_, outgoing_, steps_, densities_,
      queries_;
  double recorded_sum_ = 0.0, told_sum_ = 0.0;  // of the paths whose sums differ
  std::size_t unheard_ = 0, escapes_ = 0;
  pixel_variances pixels_;
};

}  // namespace wfpg::detail
