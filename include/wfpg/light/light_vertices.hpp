// Vertices of an iteration's light paths, stored for camera paths to connect with, and for splats. A vertex
// has its path, the vertex before it, its weights, and whatever the host needs to scatter light there.
//
// All paths go from vertex to vertex together, as a wave:
//
//   vertices.begin(exec);
//   for (each depth) {
//     exec.for_each(paths, trace);      // keeps[path] = 1 where its new vertex is to be stored
//     vertices.reserve(exec, keeps);
//     exec.for_each(paths, store);      // view.write(path, vertex) where view.has_place(path)
//   }
//   for (auto i = view.last(path); i != view.none; i = view.previous(i)) connect(view[i]);
//
// Places follow the order of depths and paths, never that of threads. Memory is a budget. Vertices beyond it
// are counted and not stored: the light that they carry is missing from the picture.
//
// Source: Moonen & Jalba 2023, "Efficient Hardware Acceleration of Robust Volumetric Light Transport
// Simulation", section 5. Places by a scan, and the budget, are wfpg's own.
// Cost: one scan of the paths a depth. Memory: sizeof(Vertex) + 8 bytes a vertex, 8 a path. On a GPU vertices
// lie in tiles (exec/tiled_array.hpp), so that loops over indices read them in whole lines.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/scan_places.hpp>
#include <wfpg/exec/tiled_array.hpp>

#include <cstdint>

namespace wfpg {

/// View of stored vertices for kernels. Trivially copyable. Vertex is the host's type, trivially copyable:
/// its position, its weights, and what it takes to scatter light there. A vertex has an index in [0, size()).
/// Indices ascend along a path, and inside a depth by path.
template <class Vertex>
class light_vertices_view {
 public:
  /// No vertex.
  static constexpr std::uint32_t none = 0xffffffffu;

  /// A view of no vertices.
  light_vertices_view() = default;

  /// Number of paths.
  WFPG_HD std::size_t paths() const { return last_.size(); }
  /// Most vertices that can be stored.
  WFPG_HD std::size_t capacity() const { return vertices_.size(); }
  /// Number of vertices stored so far in this iteration. It is read from the policy's memory.
  WFPG_HD std::uint32_t size() const { return size_ ? *size_ : 0; }
  /// A stored vertex, on a GPU a copy. Precondition: i < size().
  WFPG_HD typename tiled_view<Vertex>::element operator[](std::uint32_t i) const { return vertices_[i]; }
  /// The path of a stored vertex. Precondition: i < size().
  WFPG_HD std::uint32_t path(std::uint32_t i) const { return paths_[i]; }
  /// Index of the vertex before i on its path, or `none`. A vertex that was not stored is left out.
  WFPG_HD std::uint32_t previous(std::uint32_t i) const { return previous_[i]; }
  /// Index of a path's last stored vertex, or `none`.
  WFPG_HD std::uint32_t last(std::size_t path) const { return last_[path]; }

  /// Whether the path's new vertex has a place, after light_vertices::reserve(). False where the path keeps
  /// no vertex, where memory was used up, and before the iteration's first reserve(). `which`: of several new
  /// ones, from 0.
  WFPG_HD bool has_place(std::size_t path, std::uint32_t which = 0) const {
    const std::uint32_t place = places_[path];
    return place < vertices_.size() && which < vertices_.size() - place;
  }
  /// Stores the path's new vertex, which becomes its last. O(1). Precondition: has_place(path, which). Call
  /// it once for each new vertex after each reserve(), in order, from one thread for each path.
  WFPG_HD void write(std::size_t path, const Vertex& vertex, std::uint32_t which = 0) const {
    const std::uint32_t i = places_[path] + which;
    vertices_.emplace(i, vertex);
    paths_[i] = static_cast<std::uint32_t>(path);
    previous_[i] = last_[path];
    last_[path] = i;
  }

 private:
  template <class Exec, class V>
  friend class light_vertices;

  // By index: vertices, their paths, and the index of the one before on its path.
  tiled_view<Vertex> vertices_;
  array_view<std::uint32_t> paths_, previous_;
  // By path: the index of its last vertex, and of its new one.
  array_view<std::uint32_t> last_, places_;
  // The number of vertices, in the policy's memory.
  const std::uint32_t* size_ = nullptr;
};

namespace detail {

/// Turns ranks of new vertices into places, or `none`. With the last path it writes the number of all new
/// vertices.
struct place_light_vertices {
  array_view<const std::uint32_t> keeps;  ///< by path: the number of new vertices
  array_view<std::uint32_t> places;       ///< by path: receives the first one's place
  const std::uint32_t* stored;            ///< number of vertices before
  std::uint32_t* news;                    ///< receives the number of new ones
  std::uint32_t capacity;                 ///< most vertices
  std::uint32_t none;                     ///< place of what is not stored
  WFPG_HD void operator()(std::size_t path, std::uint32_t rank) const {
    if (path + 1 == places.size()) *news = rank + keeps[path];
    const std::uint64_t place = std::uint64_t(*stored) + rank;
    places[path] = keeps[path] != 0 && place < capacity ? static_cast<std::uint32_t>(place) : none;
  }
};

/// Kernel of one thread: adds the new vertices to the counts of those that are stored and those that are not.
struct count_light_vertices {
  const std::uint32_t* news;  ///< number of new vertices
  std::uint32_t* stored;      ///< number of all that have a place
  std::uint32_t* dropped;     ///< number of all that have none
  std::uint32_t capacity;     ///< most vertices
  WFPG_HD void operator()(std::size_t) const {
    const std::uint32_t room = capacity - *stored, fit = *news < room ? *news : room;
    *stored += fit;
    *dropped += *news - fit;
  }
};

}  // namespace detail

/// Size of light_vertices.
struct light_vertices_options {
  std::size_t paths = 0;  ///< light paths of an iteration, below 2^32 - 1
  /// Memory for vertices, bytes. What each path needs beside is not counted.
  std::size_t budget_bytes = std::size_t(1) << 30;
  /// Vertices a path for which memory is allocated at most, at least 1. A path may have more where others
  /// have fewer.
  std::uint32_t max_vertices = 8;
};

/// Owns the vertices of an iteration. Movable, not copyable; the policy's memory must outlive it. Vertex:
/// trivially copyable.
template <class Exec, class Vertex>
class light_vertices {
 public:
  /// Stores no vertices.
  light_vertices() = default;
  /// Allocates. Throws out_of_memory, and std::invalid_argument that names an option out of range.
  light_vertices(const Exec& exec, const light_vertices_options& options)
      : vertices_(exec, capacity_of(options)),
        paths_(exec, vertices_.size()),
        previous_(exec, vertices_.size()),
        last_(exec, options.paths),
        places_(exec, options.paths),
        counts_(exec, std::size_t(counters)) {
    begin(exec);
  }

  /// Forgets all vertices, for a new iteration. Writes 8 bytes a path.
  void begin(const Exec& exec) {
    exec.fill_bytes(last_.data(), 0xff, last_.bytes());
    exec.fill_bytes(places_.data(), 0xff, places_.bytes());
    exec.fill_bytes(counts_.data(), 0, counts_.size() * sizeof(std::uint32_t));
  }

  /// Finds places for the paths' new vertices, in the order of paths. What has no place any more counts as
  /// dropped. On a GPU it returns before the work is done. O(paths).
  /// `keeps`: for each path the number of its new vertices that are to be stored, mostly 1 or 0. Their sum
  /// is below 2³².
  /// Throws std::invalid_argument where `keeps` does not have an element for each path, and out_of_memory.
  void reserve(const Exec& exec, array_view<const std::uint32_t> keeps) {
    require(keeps.size() == places_.size(), "keeps.size()", keeps.size(), "the number of paths");
    if (keeps.size() == 0) return;
    std::uint32_t* const stored = counts_.data() + counter_stored;
    std::uint32_t* const news = counts_.data() + counter_new;
    const auto capacity = static_cast<std::uint32_t>(vertices_.size());
    scan_places(exec, keeps.size(), keeps.data(),
                detail::place_light_vertices{keeps, places_.view(), stored, news, capacity, none});
    exec.for_each(1, detail::count_light_vertices{news, stored, counts_.data() + counter_dropped, capacity});
  }

  /// View for kernels: valid until the owner is moved.
  light_vertices_view<Vertex> view() {
    light_vertices_view<Vertex> v;
    v.vertices_ = vertices_.view();
    v.paths_ = paths_.view();
    v.previous_ = previous_.view();
    v.last_ = last_.view();
    v.places_ = places_.view();
    v.size_ = counts_.data() + counter_stored;
    return v;
  }

  /// Most vertices that it can store.
  std::size_t capacity() const { return vertices_.size(); }
  /// Number of vertices stored in this iteration. Waits for the work before it.
  std::uint32_t size(const Exec& exec) const { return count(exec, counter_stored); }
  /// Number of vertices of this iteration that had no place, modulo 2^32. Waits for the work before it.
  std::uint32_t dropped(const Exec& exec) const { return count(exec, counter_dropped); }
  /// Bytes allocated, without the scan's temporaries.
  std::size_t bytes() const {
    return vertices_.bytes() + paths_.bytes() + previous_.bytes() + last_.bytes() + places_.bytes() +
           counts_.bytes();
  }

 private:
  static constexpr std::uint32_t none = light_vertices_view<Vertex>::none;
  enum : std::uint32_t { counter_new, counter_stored, counter_dropped, counters };

  std::uint32_t count(const Exec& exec, std::uint32_t which) const {
    return counts_.size() > 0 ? read_element(exec, counts_.data() + which) : 0;
  }
  static std::size_t capacity_of(const light_vertices_options& options) {
    require(options.paths < none, "light_vertices_options.paths", options.paths, "less than 2^32 - 1");
    require(options.max_vertices > 0, "light_vertices_options.max_vertices", options.max_vertices,
            "at least 1");
    const std::size_t fit = options.budget_bytes / (sizeof(Vertex) + 2 * sizeof(std::uint32_t));
    const std::size_t wanted = options.paths * options.max_vertices;
    const std::size_t capacity = fit < wanted ? fit : wanted;
    require(capacity > 0 || options.paths == 0, "light_vertices_options.budget_bytes", options.budget_bytes,
            "room for a vertex");
    return capacity < none ? capacity : std::size_t(none) - 1;
  }

  // By index, as in the view.
  tiled_array<Vertex, Exec> vertices_;
  buffer<std::uint32_t, Exec> paths_, previous_, last_, places_, counts_;
};

}  // namespace wfpg
