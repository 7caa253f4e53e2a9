// Kernels and geometry of merges: integrals, closest points by brute force in double, and estimates of
// photons and beams that are spread evenly, whose sums are known.
#include "support/catch.hpp"
#include "support/policies.hpp"

#include <wfpg/light/photon_estimators.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace {

using wfpg::merge_geometry;
using wfpg::merge_kernel;
using wfpg::path_beam;
using wfpg::vec3;
using wfpg_test::random_numbers;
using dvec3 = glm::dvec3;

constexpr double pi = 3.14159265358979;
constexpr merge_kernel shapes[] = {merge_kernel::constant, merge_kernel::epanechnikov};

vec3 random_direction(random_numbers& random) {
  const float z = 2.0f * random.unit() - 1.0f, phi = 2.0f * float(pi) * random.unit();
  const float r = std::sqrt(std::max(0.0f, 1.0f - z * z));
  return {r * std::cos(phi), r * std::sin(phi), z};
}

vec3 random_point(random_numbers& random, float half) {
  const auto x = [&] { return half * (2.0f * random.unit() - 1.0f); };
  const float a = x(), b = x(), c = x();
  return {a, b, c};
}

/// A mean over independent batches, and its standard error.
struct batch_mean {
  std::vector<double> batches;

  double mean() const {
    double sum = 0.0;
    for (const double x : batches) sum += x;
    return sum / double(batches.size());
  }
  double error() const {
    double sum = 0.0;
    for (const double x : batches) sum += (x - mean()) * (x - mean());
    return std::sqrt(sum / double(batches.size()) / double(batches.size() - 1));
  }
};

/// Checks that a mean is as expected, so precisely that a bias of 1% would be found.
void check_mean(const batch_mean& found, double expected) {
  INFO(found.mean() << " +- " << found.error() << ", expected " << expected);
  CHECK(std::abs(found.mean() - expected) < 4.0 * found.error());
  CHECK_FALSE(std::abs(1.01 * found.mean() - expected) < 4.0 * found.error());
  CHECK_FALSE(std::abs(0.99 * found.mean() - expected) < 4.0 * found.error());
}

template <int dimension>
double integral(merge_kernel shape, double radius) {
  constexpr int steps = 20000;
  double sum = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double d = 1.1 * radius * (i + 0.5) / steps;
    const double shell = dimension == 1 ? 2.0 : dimension == 2 ? 2.0 * pi * d : 4.0 * pi * d * d;
    sum += shell * 1.1 * radius / steps *
           double(wfpg::merge_kernel_value<dimension>(shape, float(d * d), float(radius)));
  }
  return sum;
}

/// The nearest points of two lines, by Newton's step on their squared distance, in double.
struct nearest_points {
  double t_a, t_b, distance;

  nearest_points(dvec3 a, dvec3 u, dvec3 b, dvec3 v) {
    const dvec3 w = a - b;
    const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), uw = dot(u, w), vw = dot(v, w);
    const double determinant = uu * vv - uv * uv;
    t_a = (uv * vw - vv * uw) / determinant;
    t_b = (uu * vw - uv * uw) / determinant;
    distance = length(a + t_a * u - b - t_b * v);
  }
};

}  // namespace

TEST_CASE("kernels of merges have the integral 1", "[photon_estimators]") {
  for (const merge_kernel shape : shapes)
    for (const double radius : {0.01, 1.0, 30.0}) {
      CHECK(integral<1>(shape, radius) == Approx(1.0).epsilon(1e-3));
      CHECK(integral<2>(shape, radius) == Approx(1.0).epsilon(1e-3));
      CHECK(integral<3>(shape, radius) == Approx(1.0).epsilon(1e-3));
    }
  CHECK(wfpg::merge_kernel_value<2>(merge_kernel::constant, std::nanf(""), 1.0f) == 0.0f);
  CHECK(wfpg::merge_kernel_value<2>(merge_kernel::constant, 1.0001f, 1.0f) == 0.0f);
}

TEST_CASE("the radius of merges falls as its power says", "[photon_estimators]") {
  const wfpg::radius_schedule plane{2.0f, 0.75f, 2}, line{2.0f, 0.5f, 1}, fixed{2.0f, 1.0f, 3};
  CHECK(plane(1) == 2.0f);
  CHECK(plane(16) == Approx(2.0 * std::pow(16.0, -0.125)));
  CHECK(line(16) == Approx(0.5));
  CHECK(fixed(1000) == 2.0f);
}

TEST_CASE("beams merge at their nearest points", "[photon_estimators]") {
  random_numbers random(3);
  int merged = 0, steep = 0;
  for (int i = 0; i < 20000; ++i) {
    path_beam a{random_point(random, 1.0f), random_direction(random), 0.0f, 4.0f},
        b{random_point(random, 1.0f), random_direction(random), 0.5f, 3.0f};
    if (i % 4 == 0) {  // perpendicular ones, where a division by the cosine would fail
      b.direction = glm::normalize(glm::cross(a.direction, random_direction(random)));
      ++steep;
    }
    const float radius = 0.3f;
    const merge_geometry found = wfpg::beam_beam_merge(merge_kernel::epanechnikov, a, b, radius);
    const nearest_points expected(dvec3(a.origin), dvec3(a.direction), dvec3(b.origin), dvec3(b.direction));
    const double sine = length(cross(dvec3(a.direction), dvec3(b.direction)));
    if (sine < 0.05) continue;
    const double margin = 1e-4 / sine;
    const auto in = [&](double t, const path_beam& beam, double by) {
      return t > double(beam.begin) + by && t < double(beam.end) - by;
    };
    const bool surely = expected.distance < double(radius) - margin && in(expected.t_a, a, margin) &&
                        in(expected.t_b, b, margin),
               perhaps = expected.distance < double(radius) + margin && in(expected.t_a, a, -margin) &&
                         in(expected.t_b, b, -margin);
    if (found.kernel > 0.0f) {
      CHECK(perhaps);
      CHECK(std::abs(double(found.t_camera) - expected.t_a) < margin);
      CHECK(std::abs(double(found.t_light) - expected.t_b) < margin);
      CHECK(double(found.sine) == Approx(sine).epsilon(1e-3));
      CHECK(double(found.kernel) ==
            Approx(0.75 / double(radius) * (1.0 - std::pow(expected.distance / double(radius), 2)))
                .margin(0.01));
      ++merged;
    } else {
      CHECK_FALSE(surely);
    }
  }
  CHECK(merged > 500);
  CHECK(steep > 1000);
  const path_beam along{vec3(0.0f), {1.0f, 0.0f, 0.0f}, 0.0f, 1.0f};
  CHECK(wfpg::beam_beam_merge(merge_kernel::constant, along, along, 1.0f).kernel == 0.0f);
}

TEST_CASE("of all pieces of a beam exactly one merges", "[photon_estimators]") {
  random_numbers random(4);
  int merged = 0;
  for (int i = 0; i < 5000; ++i) {
    const path_beam camera{random_point(random, 1.0f), random_direction(random), 0.0f, 4.0f},
        whole{random_point(random, 1.0f), random_direction(random), 0.0f, 3.0f};
    const merge_geometry expected = wfpg::beam_beam_merge(merge_kernel::constant, camera, whole, 0.3f);
    int pieces = 0;
    path_beam piece = whole;
    for (piece.end = 0.0f; piece.end < whole.end;) {
      piece.begin = piece.end;
      piece.end = std::min(piece.begin + 0.05f + 0.4f * random.unit(), whole.end);
      const merge_geometry found = wfpg::beam_beam_merge(merge_kernel::constant, camera, piece, 0.3f);
      if (!(found.kernel > 0.0f)) continue;
      ++pieces;
      CHECK(found.kernel == expected.kernel);
      CHECK(found.t_light == expected.t_light);
    }
    CHECK(pieces == (expected.kernel > 0.0f ? 1 : 0));
    merged += pieces;
  }
  CHECK(merged > 100);
}

TEST_CASE("evenly spread photons have their density at points and along beams", "[photon_estimators]") {
  // Photons fill a cube of side 2 around all that merges reach.
  constexpr float radius = 0.4f;
  constexpr int batches = 40, photons = 320000;
  const path_beam camera{{-0.4f, 0.1f, -0.2f}, glm::normalize(vec3(1.0f, 0.3f, 0.5f)), 0.0f, 0.9f};
  for (const merge_kernel shape : shapes) {
    batch_mean in_space, on_plane, along;
    random_numbers random(5);
    for (int batch = 0; batch < batches; ++batch) {
      double space = 0.0, plane = 0.0, beam = 0.0;
      for (int i = 0; i < photons; ++i) {
        const vec3 p = random_point(random, 1.0f);
        space += double(wfpg::point_merge<3>(shape, vec3(0.2f), p, radius).kernel);
        plane +=
            double(wfpg::point_merge<2>(shape, vec3(0.2f, 0.2f, 0.0f), vec3(p.x, p.y, 0.0f), radius).kernel);
        beam += double(wfpg::beam_point_merge(shape, camera, p, radius).kernel);
      }
      in_space.batches.push_back(space / photons * 8.0);
      on_plane.batches.push_back(plane / photons * 4.0);
      along.batches.push_back(beam / photons * 8.0);
    }
    check_mean(in_space, 1.0);
    check_mean(on_plane, 1.0);
    check_mean(along, double(camera.end));
  }
}

TEST_CASE("evenly spread beams have their density along a beam", "[photon_estimators]") {
  // Lines of all directions through a sphere of radius 1 around the camera's beam. The length of lines in a
  // unit of volume is one over the disc of their offsets, for each line.
  constexpr float radius = 0.35f;
  constexpr int batches = 40, lines = 250000;
  const path_beam camera{{-0.3f, 0.1f, -0.2f}, glm::normalize(vec3(1.0f, 0.3f, 0.5f)), 0.0f, 0.6f};
  for (const merge_kernel shape : shapes) {
    batch_mean along;
    random_numbers random(6);
    for (int batch = 0; batch < batches; ++batch) {
      double sum = 0.0;
      for (int i = 0; i < lines; ++i) {
        const vec3 direction = random_direction(random);
        const wfpg::frame around(direction);
        const float r = std::sqrt(random.unit()), phi = 2.0f * float(pi) * random.unit();
        const path_beam light{around.to_world({r * std::cos(phi), r * std::sin(phi), -1.5f}), direction, 0.0f,
                              3.0f};
        const merge_geometry found = wfpg::beam_beam_merge(shape, camera, light, radius);
        if (found.kernel > 0.0f) sum += double(found.kernel / found.sine);
      }
      along.batches.push_back(sum / lines * pi);
    }
    check_mean(along, double(camera.end));
  }
}
