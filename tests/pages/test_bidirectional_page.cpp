// Tests the host of docs/bidirectional.md: a lamp in endless fog, compared with integrals.
#include "../support/catch.hpp"
#include "bidirectional-1.inc"
#include "bidirectional-2.inc"

#include <cmath>

namespace {

const vec3 lamp(0.0f, 1.0f, 0.0f), eye(0.0f, 0.0f, -3.0f), ahead(0.0f, 0.0f, 1.0f);

bidirectional_options merges(bool points, bool beams) {
  bidirectional_options options;
  options.beam_points = points;
  options.beams = beams;
  options.paths = 1 << 15;
  options.beam_paths = 1 << 13;
  options.volume_radius = 0.02f;
  return options;
}

float radiance_by(const bidirectional_options& options, std::uint32_t max_segments,
                  std::uint32_t iterations = 32) {
  return radiance(exec::tbb(), options, lamp, eye, ahead, max_segments, iterations).x;
}

/// Light of the lamp that scatters once toward the eye. The midpoint rule.
double scattered_once() {
  const double scattering = double(fog.scattering.x), extinction = double(fog.extinction().x);
  const double step = 1e-3;
  double sum = 0.0;
  for (double t = 0.5 * step; t < 40.0; t += step) {
    const glm::dvec3 from_lamp = glm::dvec3(eye) + t * glm::dvec3(ahead) - glm::dvec3(lamp);
    const double distance = glm::length(from_lamp);
    const auto to_lamp = vec3(-from_lamp / distance);
    sum += step * scattering * std::exp(-extinction * (t + distance)) / (distance * distance) *
           double(phase.eval(-ahead, to_lamp));
  }
  return sum;
}

}  // namespace

TEST_CASE("the host of docs/bidirectional.md finds light in an iteration", "[pages]") {
  for (const bool beams : {false, true}) CHECK(radiance_by(merges(!beams, beams), 3, 1) > 0.0f);
}

// Sanitizers take minutes for the others.
TEST_CASE("the host of docs/bidirectional.md finds the light that fog scatters once", "[pages][slow]") {
  CHECK(double(radiance_by(merges(false, true), 2)) == Approx(scattered_once()).epsilon(0.03));
  CHECK(double(radiance_by(merges(true, true), 2)) == Approx(scattered_once()).epsilon(0.03));
}

TEST_CASE("the host of docs/bidirectional.md finds the same light by points and by beams", "[pages][slow]") {
  const float by_beams = radiance_by(merges(false, true), 3);
  CHECK(by_beams > 1.2f * float(scattered_once()));
  CHECK(radiance_by(merges(true, false), 3) == Approx(by_beams).epsilon(0.08));
  CHECK(radiance_by(merges(true, true), 3) == Approx(by_beams).epsilon(0.04));
}
