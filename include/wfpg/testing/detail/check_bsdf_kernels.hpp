// What check_bsdf asks of a BSDF inside kernels: a struct of answers a thread, judged on the host.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/host/bsdf.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg::detail {

/// Which part of a BSDF draws: all of it, its narrow part, or the rest.
enum class bsdf_part : std::uint32_t { whole, glossy, rest };

template <class Bsdf>
WFPG_HD glossy_part glossy_of(const Bsdf& bsdf, vec3 outgoing) {
  if constexpr (has_glossy_part_v<Bsdf>)
    return bsdf.glossy(outgoing);
  else
    return {};
}
/// Returns whether sample() ever draws from a part. Other parts are not checked.
template <class Bsdf>
WFPG_HD bool draws(const Bsdf& bsdf, bsdf_part part, vec3 outgoing) {
  if (part == bsdf_part::glossy) return glossy_of(bsdf, outgoing).fraction > 0.0f;
  return part == bsdf_part::whole || glossy_of(bsdf, outgoing).fraction < 1.0f;
}
template <class Bsdf>
WFPG_HD bsdf_sample sample_of(const Bsdf& bsdf, bsdf_part part, vec3 outgoing, vec2 u) {
  if constexpr (has_separate_parts_v<Bsdf>) {
    if (part != bsdf_part::whole) return bsdf.sample_part(part == bsdf_part::glossy, outgoing, u);
  }
  return bsdf.sample(outgoing, u);
}
template <class Bsdf>
WFPG_HD float pdf_of(const Bsdf& bsdf, bsdf_part part, vec3 outgoing, vec3 incident) {
  if constexpr (has_separate_parts_v<Bsdf>) {
    if (part != bsdf_part::whole) return bsdf.pdf_part(part == bsdf_part::glossy, outgoing, incident);
  }
  return bsdf.pdf(outgoing, incident);
}

/// Outgoing directions: every other one of a list, and random ones on the sides that are asked for.
struct outgoing_directions {
  array_view<const vec3> list;
  vec3 normal;
  bool both_sides;

  WFPG_HD vec3 operator()(std::size_t i, std::uint64_t random) const {
    const vec3 listed = list[i / 2 % list.size()];
    if (i % 2 == 0) return listed;
    const vec3 d = glm::normalize(square_to_sphere(unit_vec2(random)));
    const float above = glm::dot(d, normal);
    if (fabsf(above) < 1.0e-4f) return listed;
    return above > 0.0f || both_sides ? d : -d;
  }
};

/// Random numbers for a sample, among them the corners of the square.
WFPG_HD inline vec2 numbers_with_corners(std::size_t i, std::uint64_t random) {
  constexpr float last = 0x1.fffffep-1f;
  if (i % 128 >= 8) return unit_vec2(random);
  return {i & 2u ? last : 0.0f, i & 4u ? last : 0.0f};
}

/// A bsdf_sample without padding: all its bytes are written, as tools that look for unwritten memory expect.
struct stored_sample {
  vec3 direction;
  float pdf;
  std::uint32_t is_delta;

  WFPG_HD stored_sample& operator=(const bsdf_sample& drawn) {
    direction = drawn.direction;
    pdf = drawn.pdf;
    is_delta = drawn.is_delta ? 1 : 0;
    return *this;
  }
};

/// A BSDF at a uniform direction and at one that it drew.
struct bsdf_probe {
  vec3 outgoing, uniform;
  stored_sample drawn;
  float eval_uniform, pdf_uniform;
  float eval_drawn, pdf_drawn;  // 0 where sampling failed
};

template <class Bsdf>
struct probe_bsdf {
  Bsdf bsdf;
  outgoing_directions from;
  std::uint64_t seed;
  array_view<bsdf_probe> probes;

  WFPG_HD void operator()(std::size_t i) const {
    const std::uint64_t state = hash(seed, i);
    bsdf_probe p{};
    p.outgoing = from(i, hash(state, 0));
    p.uniform = glm::normalize(square_to_sphere(unit_vec2(hash(state, 1))));
    p.eval_uniform = bsdf.eval(p.outgoing, p.uniform);
    p.pdf_uniform = bsdf.pdf(p.outgoing, p.uniform);
    p.drawn = bsdf.sample(p.outgoing, numbers_with_corners(i, hash(state, 2)));
    if (p.drawn.pdf > 0.0f) {
      p.eval_drawn = bsdf.eval(p.outgoing, p.drawn.direction);
      p.pdf_drawn = bsdf.pdf(p.outgoing, p.drawn.direction);
    }
    probes[i] = p;
  }
};

/// A sample, for counting.
struct bsdf_draw {
  stored_sample drawn;
  float eval, pdf;      // 0 where sampling failed
  std::uint32_t asked;  // 0 where the part is never drawn; no bool, whose padding nobody would write
};

template <class Bsdf>
struct draw_bsdf {
  Bsdf bsdf;
  bsdf_part part;
  vec3 outgoing;
  std::uint64_t seed;
  array_view<bsdf_draw> draws_made;

  WFPG_HD void operator()(std::size_t i) const {
    bsdf_draw d{};
    d.asked = draws(bsdf, part, outgoing) ? 1 : 0;
    if (d.asked != 0) d.drawn = sample_of(bsdf, part, outgoing, unit_vec2(hash(hash(seed, i), 0)));
    if (d.drawn.pdf > 0.0f) {
      d.eval = bsdf.eval(outgoing, d.drawn.direction);
      d.pdf = pdf_of(bsdf, part, outgoing, d.drawn.direction);
    }
    draws_made[i] = d;
  }
};

/// Evaluates eval() or a part's pdf() at the points of a quadrature.
template <class Bsdf>
struct tabulate_bsdf {
  Bsdf bsdf;
  bsdf_part part;
  bool value;  // true: eval(), false: pdf
  vec3 outgoing;
  array_view<const vec3> directions;
  array_view<float> results;

  WFPG_HD void operator()(std::size_t i) const {
    results[i] = value ? bsdf.eval(outgoing, directions[i]) : pdf_of(bsdf, part, outgoing, directions[i]);
  }
};

/// eval() both ways, and the parts' densities beside the whole's.
struct bsdf_pair {
  vec3 outgoing, incident;
  float forth, back;
  glossy_part glossy;
  float pdf, pdf_glossy, pdf_rest;
};

template <class Bsdf>
struct pair_bsdf {
  Bsdf bsdf;
  outgoing_directions from;
  std::uint64_t seed;
  array_view<bsdf_pair> pairs;

  WFPG_HD void operator()(std::size_t i) const {
    const std::uint64_t state = hash(seed, i);
    bsdf_pair p{};
    p.outgoing = from(i, hash(state, 0));
    p.incident = glm::normalize(square_to_sphere(unit_vec2(hash(state, 1))));
    if (i % 4 < 2) {
      const bsdf_sample drawn = bsdf.sample(p.outgoing, unit_vec2(hash(state, 2)));
      if (drawn.pdf > 0.0f) p.incident = drawn.direction;
    }
    p.forth = bsdf.eval(p.outgoing, p.incident);
    p.back = bsdf.eval(p.incident, p.outgoing);
    p.glossy = glossy_of(bsdf, p.outgoing);
    if constexpr (has_separate_parts_v<Bsdf>) {
      p.pdf = bsdf.pdf(p.outgoing, p.incident);
      if (p.glossy.fraction > 0.0f) p.pdf_glossy = bsdf.pdf_part(true, p.outgoing, p.incident);
      if (p.glossy.fraction < 1.0f) p.pdf_rest = bsdf.pdf_part(false, p.outgoing, p.incident);
    }
    pairs[i] = p;
  }
};

}  // namespace wfpg::detail
