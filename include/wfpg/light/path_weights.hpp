// Weights of bidirectional techniques: how much a path counts that one technique found and others could have
// found. A light path is followed from a light and a camera path from the camera. They are joined by
// connections, or by merges of photon points and beams. The weight is that of the balance heuristic over all
// techniques. It takes constant time, from five numbers that each vertex keeps.
//
//   auto leaving = subpath_weights::from_light(techniques, {pdf_trace, pdf_connect, pdf_direction, cosine});
//   for (each vertex) {
//     const vertex_weights arrived = leaving.arrive({distance, cosine, pdf_distance, pdf_distance_back});
//     ...                                        // keep it with the vertex; connect or merge here
//     leaving = arrived.depart(techniques, {kind, pdf, pdf_back, cosine});
//   }
//
// The types keep the order: only what has left a vertex arrives, and only what has arrived leaves.
//
// Segments of float paths may have an optical depth of 25. Cut connections beyond: weights would not be
// finite.
//
// Source: Moonen & Jalba 2023, "Efficient Hardware Acceleration of Robust Volumetric Light Transport
// Simulation", section 4, Eqs. 22 to 46. The ends are weighted as Georgiev et al. 2012 do. A count for each
// kind of technique is wfpg's own. With it, two of the paper's three numbers are one.
// Cost: a dozen operations a vertex, some twenty a weight. Memory: 20 bytes a vertex in float.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>

#include <cstdint>

namespace wfpg {

/// Kind of a vertex between the ends of a path.
enum class scattering_kind : std::uint8_t {
  surface,  ///< of which a part, at least, is not delta
  delta,    ///< drew a delta lobe: it cannot be connected or merged
  medium,   ///< scattering in a medium
};

/// Photon techniques: which photons and which part of the camera path are merged.
enum class merge_technique : std::uint8_t {
  surface_points,  ///< photon points with points on surfaces (P-P2D)
  volume_points,   ///< photon points with points in media (P-P3D)
  beam_points,     ///< photon points with camera beams in media (P-B2D)
  beams,           ///< photon beams with camera beams in media (B-B1D)
};

/// How many samples a camera path has of each technique. A count of 0 switches a technique off. Weights of
/// all others then still add up to 1. Zero or positive, and finite.
template <class Real>
struct basic_path_techniques {
  /// The camera path hits lights: 1 or 0.
  Real light_hits = 1;
  /// Light samples at each vertex of the camera path.
  Real next_event = 1;
  /// Light paths with whose vertices each vertex of the camera path is connected. With 1, connect with all
  /// vertices of one light path, such as the one of the pixel's index. Do not divide by the number of paths.
  Real connections = 1;
  /// Light paths whose vertices are connected to the camera: all those of an iteration, n_L.
  Real splats = 0;
  Real surface_points = 0;  ///< light paths times pi r²
  Real volume_points = 0;   ///< light paths times 4/3 pi r³
  Real beam_points = 0;     ///< light paths whose vertices merge along camera beams, times pi r²
  Real beams = 0;           ///< light paths that leave beams, times 2 r
  /// Photon beams end where their path scatters. False: they go on to the medium's end.
  bool short_beams = true;
};

/// The end of a path on a light. Points have densities by area, directions by solid angle. A distant light
/// has it the other way round: `pdf_trace` and `pdf_connect` are by solid angle. Its `pdf_direction` is by
/// area of the disc from which it shines.
template <class Real>
struct basic_light_end {
  Real pdf_trace = 0;      ///< of the point, or a distant light's direction, where a light path begins
  Real pdf_connect = 0;    ///< of the same where next-event estimation chooses it
  Real pdf_direction = 0;  ///< with which a light path leaves it toward its next vertex
  /// Between the light's normal and that direction, in (0, 1]; 1 for distant lights. light_hit() does not
  /// read it.
  Real cosine = 1;
  /// A point, a spot, or a direction: no camera path hits it. Densities are then probabilities.
  bool is_delta = false;
  bool is_distant = false;  ///< at infinity: distances to it do not count
};

/// The segment with which a subpath arrives at a vertex.
template <class Real>
struct basic_path_arrival {
  Real distance = 0;  ///< scene units, positive; 1 where a camera path arrives at a distant light
  Real cosine = 1;    ///< |cos| between the new vertex's normal and the segment; 1 in media
  /// Density, per unit of length, of scattering at the new vertex, or the probability of reaching a surface.
  /// 1 without media.
  Real pdf_distance = 1;
  /// Likewise, for the way back: of a path that begins at the new vertex.
  Real pdf_distance_back = 1;
};

/// How a subpath leaves a vertex, for its next one or for a vertex of the other subpath.
template <class Real>
struct basic_path_departure {
  scattering_kind kind = scattering_kind::surface;  ///< of the vertex
  Real pdf = 0;       ///< of the direction in which it leaves, per steradian; of a delta lobe its probability
  Real pdf_back = 0;  ///< of a path that comes the other way: toward the vertex before; not read for delta
  Real cosine = 1;    ///< |cos| between normal and that direction; 1 in media
  Real sine = 0;      ///< between the directions of arrival and departure, in (0, 1]; read in media alone
  Real extinction = 0;  ///< of the medium, per unit of length; read where photon beams are short
};

/// The segment that joins a vertex of a light path with one of a camera path.
template <class Real>
struct basic_path_edge {
  Real distance = 0;  ///< scene units, positive; not read for distant lights
  /// As basic_path_arrival::pdf_distance, of a path that arrives at the camera path's vertex.
  Real pdf_light = 1;
  Real pdf_camera = 1;  ///< likewise, of a path that arrives at the light path's vertex
};

namespace detail {

/// Volume of merges of photon beams with a camera beam, without the camera's distance. 0 where they are off,
/// whatever the medium.
template <class Real>
WFPG_HD Real beam_volume(const basic_path_techniques<Real>& t, Real sine, Real extinction, Real pdf_light) {
  if (!(t.beams > 0)) return 0;
  return t.beams * sine / (t.short_beams ? extinction : pdf_light);
}

/// A number of light samples times a kernel's volume in path space, at a vertex: n_v e_v of the paper.
/// `pdf_light`, `pdf_camera`: densities of the distances with which the two subpaths arrive.
template <class Real>
WFPG_HD Real merge_volume(const basic_path_techniques<Real>& t, merge_technique technique,
                          const basic_path_departure<Real>& at, Real pdf_light, Real pdf_camera) {
  // Volume techniques are for media alone, and P-P2D for surfaces alone.
  const bool in_medium = at.kind == scattering_kind::medium;
  if (at.kind == scattering_kind::delta || in_medium == (technique == merge_technique::surface_points))
    return 0;
  switch (technique) {
    case merge_technique::surface_points:
      return t.surface_points;
    case merge_technique::volume_points:
      return t.volume_points;
    case merge_technique::beam_points:
      return t.beam_points / pdf_camera;
    default:
      return beam_volume(t, at.sine, at.extinction, pdf_light) / pdf_camera;
  }
}

/// merge_volume() of all techniques.
template <class Real>
WFPG_HD Real merge_volumes(const basic_path_techniques<Real>& t, const basic_path_departure<Real>& at,
                           Real pdf_light, Real pdf_camera) {
  const auto volume = [&](merge_technique technique) {
    return merge_volume(t, technique, at, pdf_light, pdf_camera);
  };
  return volume(merge_technique::surface_points) + volume(merge_technique::volume_points) +
         volume(merge_technique::beam_points) + volume(merge_technique::beams);
}

}  // namespace detail

template <class Real>
class basic_vertex_weights;

/// The weights of a subpath on its way from one vertex to the next. Trivially copyable.
template <class Real>
class basic_subpath_weights {
 public:
  /// Begins a light path. Its density is `end`.pdf_trace times `end`.pdf_direction, both positive.
  WFPG_HD static basic_subpath_weights from_light(const basic_path_techniques<Real>& techniques,
                                                  const basic_light_end<Real>& end) {
    const Real pdf = end.pdf_trace * end.pdf_direction;
    basic_subpath_weights begun;
    begun.shared_ = end.pdf_connect / pdf;
    begun.rest_ = end.is_delta ? Real(0) : techniques.light_hits * end.cosine / pdf;
    begun.flags_ = is_first | (end.is_distant ? is_distant : 0u);
    return begun;
  }
  /// Begins a camera path in a pinhole, which no path hits. `pdf_direction`: of the direction in which it
  /// leaves, per steradian, as the camera draws directions for one pixel. Positive.
  WFPG_HD static basic_subpath_weights from_camera(Real pdf_direction) {
    basic_subpath_weights begun;
    begun.shared_ = 1 / pdf_direction;
    begun.flags_ = is_first | is_camera;
    return begun;
  }

  /// Arrives at the next vertex. O(1).
  WFPG_HD basic_vertex_weights<Real> arrive(const basic_path_arrival<Real>& arrival) const;

 private:
  friend class basic_vertex_weights<Real>;

  // is_first: no vertex lies behind it. after_delta: the vertex behind it is a delta vertex.
  static constexpr std::uint32_t is_first = 1, after_delta = 2, is_camera = 4, is_distant = 8;

  Real shared_ = 0;            // 1 / p> of the direction, without the distance
  Real rest_ = 0;              // d of the paper, without merges at the vertex behind
  Real merges_ = 0;            // merges there: this
  Real merges_over_back_ = 0;  // and this over the density of the distance back
  std::uint32_t flags_ = 0;
};

/// The weights that a vertex of a subpath keeps, from which all techniques at it have theirs. Trivially
/// copyable, 20 bytes in float.
template <class Real>
class basic_vertex_weights {
  using subpath = basic_subpath_weights<Real>;

 public:
  using techniques = basic_path_techniques<Real>;  ///< counts of all techniques, the same for a whole path
  using departure = basic_path_departure<Real>;    ///< how a path leaves the vertex
  using light_end = basic_light_end<Real>;         ///< the path's end on a light
  using edge = basic_path_edge<Real>;              ///< what joins two subpaths

  /// Leaves the vertex for the next one. O(1). Precondition: `to`.pdf is positive.
  WFPG_HD subpath depart(const techniques& t, const departure& to) const {
    const bool is_delta = to.kind == scattering_kind::delta;
    subpath left;
    left.flags_ = (flags_ & subpath::is_camera) | (is_delta ? subpath::after_delta : 0u);
    left.shared_ = 1 / to.pdf;
    // A delta lobe has one probability both ways, and joins with nothing.
    const Real joined = is_delta ? Real(0) : joined_before(t) / to.pdf;
    const Real back = is_delta ? Real(1) : to.pdf_back / to.pdf;
    left.rest_ = to.cosine * (joined + back * pdf_back_ * rest_);
    if (is_delta) return left;
    // Merges at this vertex. A part of them is over the density of the distance back from the next vertex,
    // which is not known before the path arrives there.
    const Real over = to.cosine / to.pdf;
    if (to.kind == scattering_kind::surface) {
      left.merges_ = over * t.surface_points;
      return left;
    }
    const bool is_camera = (flags_ & subpath::is_camera) != 0, long_beams = is_camera && !t.short_beams;
    // Of long photon beams, the distance back is that of the light path.
    const Real beams = detail::beam_volume(t, to.sine, to.extinction, long_beams ? Real(1) : pdf_distance_);
    const Real known = is_camera ? (t.beam_points + (long_beams ? Real(0) : beams)) / pdf_distance_ : Real(0);
    left.merges_ = t.volume_points + known;
    left.merges_over_back_ = !is_camera   ? t.beam_points + beams
                             : long_beams ? beams / pdf_distance_
                                          : Real(0);
    left.merges_ *= over;
    left.merges_over_back_ *= over;
    return left;
  }

  /// Weight of a light that the camera path hit with this vertex. `end`: pdf_direction is that of the
  /// direction toward the vertex before. It is 1 for the path's first vertex: nothing else finds it.
  WFPG_HD Real light_hit(const techniques& t, const light_end& end) const {
    if (flags_ & subpath::is_first) return 1;
    // Next-event estimation at the vertex before would have found the light, and so would a light path.
    const Real sampled = after_delta() ? Real(0) : t.next_event * end.pdf_connect * shared_;
    const Real traced = end.pdf_trace * end.pdf_direction * pdf_back_ * rest_;
    return t.light_hits / (t.light_hits + sampled + traced);
  }

  /// Weight of next-event estimation at this vertex of a camera path. `to`: leaves it for the light. `end`:
  /// pdf_direction and cosine are those of the direction toward this vertex.
  WFPG_HD Real next_event(const techniques& t, const departure& to, const light_end& end,
                          const edge& joins) const {
    const Real square = end.is_distant ? Real(1) : joins.distance * joins.distance;
    const Real hit = end.is_delta
                         ? Real(0)
                         : t.light_hits * to.pdf * end.cosine * joins.pdf_camera / (square * end.pdf_connect);
    const Real traced =
        end.pdf_trace / end.pdf_connect * end.pdf_direction * to.cosine * joins.pdf_light / square;
    return t.next_event / (hit + t.next_event + traced * behind(t, to, joins.pdf_light));
  }

  /// Weight of this vertex of a light path, connected to a pinhole. `to`: leaves it for the camera.
  /// `pdf_direction`: as in basic_subpath_weights::from_camera(), of the direction toward this vertex.
  WFPG_HD Real splat(const techniques& t, const departure& to, Real pdf_direction, const edge& joins) const {
    const Real traced = pdf_direction * to.cosine * joins.pdf_camera / (joins.distance * joins.distance);
    return t.splats / (t.splats + traced * behind(t, to, joins.pdf_camera));
  }

  /// Weight of a connection between this vertex of a light path and `camera`, one of a camera path.
  /// `to_camera` leaves this one, `to_light` the other.
  WFPG_HD Real connection(const techniques& t, const departure& to_camera, const basic_vertex_weights& camera,
                          const departure& to_light, const edge& joins) const {
    const Real square = joins.distance * joins.distance;
    const Real of_light =
        to_light.pdf * to_camera.cosine * joins.pdf_camera / square * behind(t, to_camera, joins.pdf_camera);
    const Real of_camera = to_camera.pdf * to_light.cosine * joins.pdf_light / square *
                           camera.behind(t, to_light, joins.pdf_light);
    return t.connections / (of_light + t.connections + of_camera);
  }

  /// Weight of a merge of this vertex, or beam, of a light path with `camera`, one of a camera path. `at`:
  /// how the camera path would go on along the light path. Its pdf is toward the light path's vertex before.
  /// Its pdf_back is the light path's, toward the camera path's vertex before. Cosine is not read.
  WFPG_HD Real merge(const techniques& t, merge_technique technique, const basic_vertex_weights& camera,
                     const departure& at) const {
    const Real volume = detail::merge_volume(t, technique, at, pdf_distance_, camera.pdf_distance_);
    // Here the vertex is one for both subpaths, so that no segment joins them.
    const Real of_light = joined_before(t) + at.pdf * pdf_back_ * rest_;
    const Real of_camera = camera.joined_before(t) + at.pdf_back * camera.pdf_back_ * camera.rest_;
    return volume / (of_light + merges_at(t, at, camera.pdf_distance_) + of_camera);
  }

 private:
  friend class basic_subpath_weights<Real>;

  /// Whether the vertex before is a delta vertex, which this one cannot be joined with.
  WFPG_HD bool after_delta() const { return (flags_ & subpath::after_delta) != 0; }

  /// Samples of the technique that joins this vertex with the one before, over its density.
  WFPG_HD Real joined_before(const techniques& t) const {
    if (after_delta()) return 0;
    const Real first = flags_ & subpath::is_camera ? t.splats : t.next_event;
    return (flags_ & subpath::is_first ? first : t.connections) * shared_;
  }
  /// merge_volumes() at this vertex. `pdf_other`: density of the distance with which the other subpath
  /// arrives.
  WFPG_HD Real merges_at(const techniques& t, const departure& at, Real pdf_other) const {
    const bool is_camera = (flags_ & subpath::is_camera) != 0;
    return detail::merge_volumes(t, at, is_camera ? pdf_other : pdf_distance_,
                                 is_camera ? pdf_distance_ : pdf_other);
  }
  /// All techniques that meet on this subpath, over what the path would be connected with at this vertex.
  WFPG_HD Real behind(const techniques& t, const departure& to, Real pdf_other) const {
    return merges_at(t, to, pdf_other) + joined_before(t) + to.pdf_back * pdf_back_ * rest_;
  }

  Real shared_ = 0;        // 1 / p> of the vertex, by area
  Real rest_ = 0;          // d of the paper
  Real pdf_distance_ = 1;  // of the segment that arrives
  Real pdf_back_ = 1;      // of the same segment, the other way
  std::uint32_t flags_ = 0;
};

template <class Real>
WFPG_HD basic_vertex_weights<Real> basic_subpath_weights<Real>::arrive(
    const basic_path_arrival<Real>& arrival) const {
  basic_vertex_weights<Real> at;
  // The square of the distance is in `shared` alone: elsewhere that of the way back cancels it.
  const Real square = flags_ & is_distant ? Real(1) : arrival.distance * arrival.distance;
  const Real pdf = arrival.cosine * arrival.pdf_distance;
  at.shared_ = shared_ * square / pdf;
  at.rest_ = (rest_ + merges_ + merges_over_back_ / arrival.pdf_distance_back) / pdf;
  at.pdf_distance_ = arrival.pdf_distance;
  at.pdf_back_ = arrival.pdf_distance_back;
  at.flags_ = flags_ & ~std::uint32_t(is_distant);
  return at;
}

using path_techniques = basic_path_techniques<float>;  ///< counts of techniques
using light_end = basic_light_end<float>;              ///< a path's end on a light
using path_arrival = basic_path_arrival<float>;        ///< a segment that arrives
using path_departure = basic_path_departure<float>;    ///< a direction that leaves
using path_edge = basic_path_edge<float>;              ///< a segment that joins
using subpath_weights = basic_subpath_weights<float>;  ///< between two vertices
using vertex_weights = basic_vertex_weights<float>;    ///< at a vertex

}  // namespace wfpg
