// Recursive weights of bidirectional techniques against the balance heuristic, added up by brute force over
// all techniques of random paths. Paths have surfaces, delta lobes, media, and lights of all kinds. Forward
// and reverse densities are independent of each other, so that no symmetry hides a fault.
#include "support/catch.hpp"
#include "support/policies.hpp"

#include <wfpg/light/path_weights.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

namespace {

using wfpg::merge_technique;
using wfpg::scattering_kind;
using wfpg_test::random_numbers;

/// What a test breaks in the recursion's inputs.
enum class fault {
  none,
  splats_count_once,      ///< light tracing is taken for one sample of a pixel
  trace_for_connect,      ///< next-event estimation is taken to choose points as light paths begin
  delta_light_is_hit,     ///< a delta light is taken for an area light
  distant_light_is_near,  ///< distances to it count
  delta_joins,            ///< a delta vertex is taken for one that can be joined
  delta_has_two_ways,     ///< the lobe's probability is another one backwards
  long_for_short,         ///< photon beams are taken to go on behind their path's next vertex
  no_way_back,            ///< distances have one density both ways
  no_sine,                ///< beams are taken to be perpendicular
};

/// A full path: vertex 0 on a light, vertex k in a pinhole. Edge i joins vertices i and i + 1. What is `of
/// light` is a light path's, which arrives at a vertex from the one before; a camera path arrives from the
/// one behind.
struct full_path {
  int k = 1;
  std::vector<scattering_kind> kinds;
  std::vector<double> distance, extinction, sine;
  std::vector<double> cosine_before, cosine_behind;             ///< at a vertex, toward i - 1 and i + 1
  std::vector<double> direction_of_light, direction_of_camera;  ///< by which a path comes to the vertex
  std::vector<double> distance_of_light, distance_of_camera;    ///< likewise
  wfpg::basic_light_end<double> light;
  wfpg::basic_path_techniques<double> techniques;

  double at(const std::vector<double>& values, int i) const { return values[static_cast<std::size_t>(i)]; }
  scattering_kind kind(int i) const { return kinds[static_cast<std::size_t>(i)]; }
  /// Squares of the distance along an edge, as densities see it.
  double square(int edge) const {
    return edge == 0 && light.is_distant ? 1.0 : at(distance, edge) * at(distance, edge);
  }
  /// Densities of a vertex by area or volume, where a path of either kind made it.
  double by_light(int i) const {
    if (i == 0) return light.pdf_trace;
    return at(direction_of_light, i) * at(cosine_before, i) / square(i - 1) * at(distance_of_light, i);
  }
  double by_camera(int i) const {
    if (i == k) return 1.0;
    return at(direction_of_camera, i) * at(cosine_behind, i) / square(i) * at(distance_of_camera, i);
  }
};

double between(random_numbers& random, double low, double high) {
  return low * std::pow(high / low, double(random.unit()));
}

full_path random_path(random_numbers& random, int k) {
  full_path x;
  x.k = k;
  const auto n = static_cast<std::size_t>(k) + 1;
  x.kinds.assign(n, scattering_kind::surface);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const float u = random.unit();
    x.kinds[i] = u < 0.3f   ? scattering_kind::surface
                 : u < 0.5f ? scattering_kind::delta
                            : scattering_kind::medium;
  }
  for (auto* values :
       {&x.distance, &x.extinction, &x.sine, &x.cosine_before, &x.cosine_behind, &x.direction_of_light,
        &x.direction_of_camera, &x.distance_of_light, &x.distance_of_camera})
    values->assign(n, 1.0);
  for (std::size_t i = 0; i < n; ++i) {
    x.distance[i] = between(random, 0.05, 20.0);
    x.sine[i] = between(random, 0.01, 1.0);
    x.direction_of_light[i] = between(random, 0.01, 50.0);
    x.direction_of_camera[i] = between(random, 0.01, 50.0);
    if (x.kinds[i] == scattering_kind::medium) continue;
    x.cosine_before[i] = between(random, 0.02, 1.0);
    x.cosine_behind[i] = between(random, 0.02, 1.0);
  }
  x.direction_of_camera[n - 2] = between(random, 1e4, 1e6);  // of one pixel
  for (std::size_t i = 1; i + 1 < n; ++i)
    if (x.kinds[i] == scattering_kind::delta)
      x.direction_of_light[i + 1] = x.direction_of_camera[i - 1] = between(random, 0.05, 1.0);
  for (std::size_t i = 0; i + 1 < n; ++i) {  // the medium along edge i
    const bool needs = x.kinds[i] == scattering_kind::medium || x.kinds[i + 1] == scattering_kind::medium;
    const double extinction = needs || random.unit() > 0.3f ? between(random, 1e-3, 2.0) : 0.0;
    const double passes = std::exp(-std::min(extinction * x.distance[i], 25.0));
    x.distance_of_light[i + 1] = passes * (x.kinds[i + 1] == scattering_kind::medium ? extinction : 1.0);
    x.distance_of_camera[i] = passes * (x.kinds[i] == scattering_kind::medium ? extinction : 1.0);
    if (x.kinds[i + 1] == scattering_kind::medium) x.extinction[i + 1] = extinction;
  }
  x.light.pdf_trace = between(random, 0.01, 10.0);
  x.light.pdf_connect = between(random, 0.01, 10.0);
  x.light.pdf_direction = x.direction_of_light[1];
  const float kind = random.unit();
  x.light.is_delta = kind < 0.2f;
  x.light.is_distant = kind > 0.1f && kind < 0.3f;
  if (x.light.is_distant) x.cosine_behind[0] = 1.0;
  x.light.cosine = x.cosine_behind[0];

  const double pi = 3.14159265358979, light_paths = 1e6, beam_paths = 4e3;
  const auto radius = [&] { return between(random, 1e-3, 0.1); };
  const auto on = [&] { return random.unit() < 0.8f ? 1.0 : 0.0; };
  auto& t = x.techniques;
  t.light_hits = on();
  t.next_event = on() * 2.0;
  t.connections = on() * 3.0;
  t.splats = on() * light_paths;
  t.surface_points = on() * light_paths * pi * std::pow(radius(), 2);
  t.volume_points = on() * light_paths * 4.0 / 3.0 * pi * std::pow(radius(), 3);
  t.beam_points = on() * light_paths * pi * std::pow(radius(), 2);
  t.beams = on() * beam_paths * 2.0 * radius();
  t.short_beams = random.unit() < 0.5f;
  return x;
}

/// A way to make a path: a connection of `light_vertices` vertices with the rest, or a merge at its last one.
struct technique {
  bool merges = false;
  merge_technique merge = merge_technique::surface_points;
  int light_vertices = 0;
};

/// Samples of a merge times its kernel's volume, as the paper has them.
double volume_of(const full_path& x, merge_technique m, int i) {
  const bool in_medium = x.kind(i) == scattering_kind::medium;
  if (x.kind(i) == scattering_kind::delta) return 0.0;
  const double beam = x.techniques.short_beams ? x.at(x.extinction, i) : x.at(x.distance_of_light, i);
  switch (m) {
    case merge_technique::surface_points:
      return in_medium ? 0.0 : x.techniques.surface_points;
    case merge_technique::volume_points:
      return in_medium ? x.techniques.volume_points : 0.0;
    case merge_technique::beam_points:
      return in_medium ? x.techniques.beam_points / x.at(x.distance_of_camera, i) : 0.0;
    default:
      return in_medium ? x.techniques.beams * x.at(x.sine, i) / (beam * x.at(x.distance_of_camera, i)) : 0.0;
  }
}

/// Samples times density with which a technique makes the path.
long double density(const full_path& x, const technique& t) {
  long double product = 1.0L;
  const int s = t.light_vertices, camera_vertices = x.k + 1 - s;
  if (t.merges) {
    for (int i = 0; i < s; ++i) product *= x.by_light(i);
    for (int i = s - 1; i <= x.k; ++i) product *= x.by_camera(i);
    return product * volume_of(x, t.merge, s - 1);
  }
  if (s == 0 && x.light.is_delta) return 0.0L;
  if (x.k == 1 && s == 1) return 0.0L;  // the light itself is not connected to the camera
  if (s >= 1 && x.kind(s) == scattering_kind::delta) return 0.0L;
  if (s >= 2 && x.kind(s - 1) == scattering_kind::delta) return 0.0L;
  for (int i = 0; i < s; ++i) product *= s == 1 ? x.light.pdf_connect : x.by_light(i);
  for (int i = s; i <= x.k; ++i) product *= x.by_camera(i);
  const auto& n = x.techniques;
  return product * (s == 0                 ? n.light_hits
                    : camera_vertices == 1 ? n.splats
                    : s == 1               ? n.next_event
                                           : n.connections);
}

std::vector<technique> techniques_of(const full_path& x) {
  std::vector<technique> all;
  for (int s = 0; s <= x.k; ++s) all.push_back({false, {}, s});
  for (int i = 1; i < x.k; ++i)
    for (const auto m : {merge_technique::surface_points, merge_technique::volume_points,
                         merge_technique::beam_points, merge_technique::beams})
      all.push_back({true, m, i + 1});
  all.erase(
      std::remove_if(all.begin(), all.end(), [&](const technique& t) { return !(density(x, t) > 0.0L); }),
      all.end());
  return all;
}

/// The library's weights of a path, in one precision.
template <class Real>
class recursion {
 public:
  recursion(const full_path& path, fault broken) : x_(path), broken_(broken) {
    const auto& t = x_.techniques;
    counts_ = {Real(t.light_hits),  Real(t.next_event),     Real(t.connections),
               Real(t.splats),      Real(t.surface_points), Real(t.volume_points),
               Real(t.beam_points), Real(t.beams),          t.short_beams};
    if (broken == fault::splats_count_once) counts_.splats = t.splats > 0.0 ? Real(1) : Real(0);
    if (broken == fault::long_for_short) counts_.short_beams = !t.short_beams;
    light_ = {Real(x_.light.pdf_trace), Real(x_.light.pdf_connect), Real(x_.light.pdf_direction),
              Real(x_.light.cosine),    x_.light.is_delta,          x_.light.is_distant};
    if (broken == fault::trace_for_connect) light_.pdf_connect = light_.pdf_trace;
    if (broken == fault::delta_light_is_hit) light_.is_delta = false;
    if (broken == fault::distant_light_is_near) light_.is_distant = false;
  }

  Real weight(const technique& t) const {
    const int s = t.light_vertices, camera_vertices = x_.k + 1 - s;
    if (t.merges) {
      const int i = s - 1;
      return from_light(i).merge(counts_, t.merge, from_camera(i), leave(i, true));
    }
    if (s == 0) return from_camera(0).light_hit(counts_, light_);
    const wfpg::basic_path_edge<Real> edge{value(x_.distance, s - 1), value(x_.distance_of_light, s),
                                           value(x_.distance_of_camera, s - 1)};
    if (camera_vertices == 1)
      return from_light(s - 1).splat(counts_, leave(s - 1, false), value(x_.direction_of_camera, s - 1),
                                     edge);
    if (s == 1) return from_camera(1).next_event(counts_, leave(1, true), light_, edge);
    return from_light(s - 1).connection(counts_, leave(s - 1, false), from_camera(s), leave(s, true), edge);
  }

 private:
  using vertex = wfpg::basic_vertex_weights<Real>;

  Real value(const std::vector<double>& values, int i) const { return Real(x_.at(values, i)); }

  /// How a path leaves vertex i: a camera path for the light, or a light path for the camera.
  wfpg::basic_path_departure<Real> leave(int i, bool for_light) const {
    wfpg::basic_path_departure<Real> to;
    to.kind = x_.kind(i);
    to.pdf = for_light ? value(x_.direction_of_camera, i - 1) : value(x_.direction_of_light, i + 1);
    to.pdf_back = for_light ? value(x_.direction_of_light, i + 1) : value(x_.direction_of_camera, i - 1);
    if (to.kind == scattering_kind::delta) to.pdf_back = 0;  // not read
    to.cosine = value(for_light ? x_.cosine_before : x_.cosine_behind, i);
    if (counts_.beams > 0) {  // else neither is read
      to.sine = broken_ == fault::no_sine ? Real(1) : value(x_.sine, i);
      to.extinction = value(x_.extinction, i);
    }
    if (to.kind == scattering_kind::delta && broken_ == fault::delta_joins)
      to.kind = scattering_kind::surface;
    if (to.kind == scattering_kind::delta && broken_ == fault::delta_has_two_ways) {
      to.kind = scattering_kind::surface;
      to.pdf_back = Real(0.5) * to.pdf;
    }
    return to;
  }
  wfpg::basic_path_arrival<Real> arrive(Real distance, Real cosine, Real pdf, Real back) const {
    return {distance, cosine, pdf, broken_ == fault::no_way_back ? pdf : back};
  }
  vertex from_light(int n) const {
    auto leaving = wfpg::basic_subpath_weights<Real>::from_light(counts_, light_);
    for (int i = 1;; ++i) {
      const vertex at =
          leaving.arrive(arrive(value(x_.distance, i - 1), value(x_.cosine_before, i),
                                value(x_.distance_of_light, i), value(x_.distance_of_camera, i - 1)));
      if (i == n) return at;
      leaving = at.depart(counts_, leave(i, false));
    }
  }
  vertex from_camera(int n) const {
    auto leaving = wfpg::basic_subpath_weights<Real>::from_camera(value(x_.direction_of_camera, x_.k - 1));
    for (int i = x_.k - 1;; --i) {
      const bool at_infinity = i == 0 && light_.is_distant;
      const vertex at =
          leaving.arrive(arrive(at_infinity ? Real(1) : value(x_.distance, i), value(x_.cosine_behind, i),
                                value(x_.distance_of_camera, i), value(x_.distance_of_light, i + 1)));
      if (i == n) return at;
      leaving = at.depart(counts_, leave(i, true));
    }
  }

  const full_path& x_;
  fault broken_;
  wfpg::basic_path_techniques<Real> counts_;
  wfpg::basic_light_end<Real> light_;
};

/// How far weights of random paths are from the balance heuristic.
struct distances {
  double relative = 0.0;  ///< of a weight, at most
  double absolute = 0.0;
  double sum = 0.0;  ///< of a path's weights from 1, at most
  std::uint64_t weights = 0, not_finite = 0;
};

template <class Real>
distances measure(int paths, int most_segments, fault broken = fault::none) {
  random_numbers random(11);
  distances worst;
  for (int i = 0; i < paths; ++i) {
    const full_path x =
        random_path(random, 1 + static_cast<int>(random.below(static_cast<std::uint32_t>(most_segments))));
    const std::vector<technique> all = techniques_of(x);
    long double total = 0.0L;
    for (const technique& t : all) total += density(x, t);
    if (!(total > 0.0L) || !std::isfinite(double(total))) continue;
    const recursion<Real> weights(x, broken);
    double sum = 0.0;
    for (const technique& t : all) {
      const double expected = double(density(x, t) / total), found = double(weights.weight(t));
      ++worst.weights;
      if (!wfpg::is_finite(Real(found))) ++worst.not_finite;
      sum += found;
      const double off = std::fabs(found - expected);
      worst.absolute = std::max(worst.absolute, off);
      worst.relative = std::max(worst.relative, off / std::max(expected, 1e-12));
    }
    worst.sum = std::max(worst.sum, std::fabs(sum - 1.0));
  }
  return worst;
}

/// Checks the weights of random paths in both precisions. There are more than `least` of them.
void check_weights(int paths, int most_segments, std::uint64_t least) {
  const distances in_double = measure<double>(paths, most_segments),
                  in_float = measure<float>(paths, most_segments);
  CHECK(in_double.weights > least);
  INFO(in_double.relative << ' ' << in_double.sum << ", " << in_float.absolute << ' ' << in_float.sum);
  CHECK(in_double.relative <= 1e-12);
  CHECK(in_double.sum <= 1e-12);
  CHECK(in_float.absolute <= 1e-6);
  CHECK(in_float.sum <= 1e-5);
  CHECK(in_double.not_finite + in_float.not_finite == 0);
}

}  // namespace

TEST_CASE("path weights: those of short paths are the balance heuristic's", "[path_weights]") {
  check_weights(20000, 9, 100000);
}

TEST_CASE("path weights: those of long paths are the balance heuristic's", "[path_weights]") {
  check_weights(300, 80, 10000);
}

TEST_CASE("path weights: each special case that is left out shows", "[path_weights]") {
  const fault broken = GENERATE(fault::splats_count_once, fault::trace_for_connect, fault::delta_light_is_hit,
                                fault::distant_light_is_near, fault::delta_joins, fault::delta_has_two_ways,
                                fault::long_for_short, fault::no_way_back, fault::no_sine);
  const distances found = measure<double>(2000, 9, broken);
  INFO("fault " << static_cast<int>(broken) << ": " << found.absolute);
  CHECK(found.absolute > 0.01);
}

TEST_CASE("path weights: they are small and can be copied to a device", "[path_weights]") {
  CHECK(sizeof(wfpg::vertex_weights) == 20);
  CHECK(sizeof(wfpg::subpath_weights) == 20);
  CHECK(std::is_trivially_copyable_v<wfpg::vertex_weights>);
}
