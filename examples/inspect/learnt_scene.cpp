// Combines the renderer's parts to look into its guider.
#include "learnt_scene.hpp"

#include "app/option_names.hpp"
#include "app/render_impl.hpp"
#include "casters/embree_caster.hpp"

#include <wfpg/bins/spatial_binner.hpp>
#include <wfpg/exec/tbb.hpp>

#include <variant>

namespace inspect {
namespace {

using exec_policy = wfpg::exec::tbb;
using caster_type = decltype(std::declval<const render::embree_scene&>().caster());
using tracer_type = render::path_tracer<exec_policy, caster_type>;

using kept_guider = wfpg::path_guider<exec_policy>;
using transient_guider = wfpg::path_guider<exec_policy, wfpg::transient_guide<exec_policy>>;
using guider_type = std::variant<kept_guider, transient_guider>;

constexpr std::uint64_t reference_seed = 0x5eed0fed;

render::render_options checked(render::render_options options) {
  require_fields(options);
  options.least_gain = 0.0f;  // a guide that rests has no fields to show
  return options;
}

/// The surfaces of a wave with a ray for each pixel.
struct hit_surfaces {
  const render::hit_surface* hits;

  wfpg::surface<render::bsdf> operator()(std::uint32_t pixel) const { return hits[pixel].surface; }
};

/// A camera at a point on a surface that looks along the directions of cells. If the surface only reflects,
/// directions below it hit its near side, as a field's cones do.
struct cell_camera {
  const render::hit_surface& at;
  direction_grid cells;

  wfpg::ray through(std::uint32_t cell, vec2 offset) const {
    wfpg::ray ray;
    ray.direction = cells.direction(cell, offset);
    const vec3 normal = at.surface.geometric_normal;
    const vec3 side = at.surface.bsdf.transmits() ? ray.direction : at.surface.outgoing;
    ray.origin = render::leave_surface(at.surface.position, normal, side, at.offset);
    return ray;
  }
};

std::vector<render::hit_surface> hits_of(const exec_policy& exec, const render::scene_view& geometry,
                                         const caster_type& caster, const render::pinhole& camera,
                                         std::size_t pixels) {
  std::vector<render::hit_surface> hits(pixels);
  exec.for_each(pixels, [&](std::size_t i) {
    const wfpg::ray ray = camera.through(static_cast<std::uint32_t>(i), vec2(0.5f));
    const render::triangle_hit hit = caster.intersect(ray);
    if (hit.is_hit()) hits[i] = geometry.surface(hit, -ray.direction);
    hits[i].surface.active = hit.is_hit();
  });
  return hits;
}

}  // namespace

struct learnt_scene::state {
  state(const render::scene& scene, const render::render_options& given)
      : options(checked(given)),
        geometry(exec, scene),
        lights(exec, scene, options.light_groups),
        lights_by_power(exec, scene),
        accelerated(exec, scene, geometry.view()),
        camera(scene.view, options.width, options.height),
        guider(begin(scene)) {}

  guider_type begin(const render::scene& scene) {
    const auto mesh = [&] {
      return wfpg::triangle_mesh_view{geometry.view().positions, geometry.view().triangles};
    };
    if (options.lifetime == render::fields::kept)
      return render::begin_guider(exec, scene, mesh, render::kept_options_of(options, lights.shares()),
                                  options, "");
    return render::begin_guider(exec, scene, mesh, render::transient_options_of(options, lights.shares()),
                                options, "");
  }

  void learn(const render::progress_callback& progress) {
    tracer_type tracer(exec, render::tracer_settings_of(options),
                       {geometry.view(), lights.view(), options.nee}, accelerated.caster());
    std::visit([&](auto& g) { render::take_samples(tracer, g, camera, options, progress, rendering); },
               guider);
    rendering.picture = {options.width, options.height, tracer.film().picture()};
    std::visit([&](auto& g) { render::report_guider(g, tracer.film().segments(), rendering.report); },
               guider);
  }

  /// Looks up the fields that the next sample's camera rays will have.
  void look() {
    const std::size_t pixels = rendering.picture.pixels.size();
    hits = hits_of(exec, geometry.view(), accelerated.caster(), camera, pixels);
    std::visit(
        [&](auto& g) {
          g.begin_sample();
          fields = g.prepare(wfpg::wave{0, pixels, hit_surfaces{hits.data()}, wfpg::no_random{}},
                             accelerated.caster());
          find_bins(g);
        },
        guider);
  }

  void find_bins(const kept_guider& g) {
    const std::vector<std::uint32_t> keys = g.guide().field_keys(exec);
    for (std::uint32_t pixel = 0; pixel < hits.size(); ++pixel) {
      const std::uint32_t number = fields.mixture(pixel).number;
      bins.push_back(number < keys.size() ? keys[number] : no_bin);
    }
    field_bytes =
        wfpg::field_store<exec_policy>::bytes_a_slot(g.options().kept.resolution, options.kept.learn);
  }

  /// The guider's bins are those of Algorithm 2, too.
  void find_bins(const transient_guider& g) {
    wfpg::spatial_binner<exec_policy> binner(exec, g.guide().octree().view(), g.options().binning,
                                             hits.size());
    const wfpg::bins_view found = binner.bin(
        exec, hits.size(), wfpg::wave_rays<hit_surfaces>{hit_surfaces{hits.data()}, g.options().mode});
    bins.assign(found.ray_keys.data(), found.ray_keys.data() + hits.size());
    field_bytes = wfpg::grid_distribution::words(g.guide().field_resolution(0)) * sizeof(std::uint32_t) +
                  sizeof(wfpg::resident_field);
  }

  exec_policy exec;
  render::render_options options;
  render::device_scene<exec_policy> geometry;
  render::light_distribution<exec_policy> lights;
  render::light_distribution<exec_policy> lights_by_power;  // for guides that do not learn choices
  render::embree_scene accelerated;
  render::pinhole camera;
  guider_type guider;
  render::render_result rendering;
  std::vector<render::hit_surface> hits;
  wfpg::guide_view fields;
  std::vector<std::uint32_t> bins;
  std::size_t field_bytes = 0;
};

void require_fields(const render::render_options& options) {
  using wfpg::require;
  const std::string& method = render::name_of(render::method_names(), options.method);
  require(render::is_wfpg(options.method), "method", method,
          "wfpg or wfpg-product: others have no fields to look at");
  require(options.where == render::device::cpu, "device",
          render::name_of(render::device_names(), options.where), "cpu: fields are looked at in its memory");
  require(options.through == render::cones::scene, "cones",
          render::name_of(render::cones_names(), options.through),
          "scene: by others fields are not looked at");
  require(options.octree == render::octree_source::triangles, "octree",
          render::name_of(render::octree_names(), options.octree),
          "triangles: fields are looked at over them");
  require(options.max_depth >= 2, "max_depth", options.max_depth, "at least 2, for light to arrive from");
}

learnt_scene::learnt_scene(const render::scene& scene, const render::render_options& options,
                           const render::progress_callback& progress)
    : state_(std::make_unique<state>(scene, options)) {
  state_->learn(progress);
  state_->look();
}

learnt_scene::~learnt_scene() = default;

const render::render_result& learnt_scene::rendering() const {
  return state_->rendering;
}
const std::vector<render::hit_surface>& learnt_scene::hits() const {
  return state_->hits;
}
const wfpg::guide_view& learnt_scene::fields() const {
  return state_->fields;
}
const std::vector<std::uint32_t>& learnt_scene::bins() const {
  return state_->bins;
}
wfpg::exitance_cache_view learnt_scene::cache() const {
  return std::visit([](const auto& g) { return g.guide().cache(); }, state_->guider);
}

guide_bytes learnt_scene::bytes() const {
  const wfpg::memory_report memory = std::visit([](const auto& g) { return g.memory(); }, state_->guider);
  return {state_->field_bytes, memory.persistent(), memory.transient()};
}

render::image incident_light::mean() const {
  render::image picture = first;
  for (std::size_t i = 0; i < picture.pixels.size(); ++i)
    picture.pixels[i] = 0.5f * (first.pixels[i] + second.pixels[i]);
  return picture;
}

incident_light learnt_scene::arriving(const render::hit_surface& at, const direction_grid& cells, int samples,
                                      const render::progress_callback& progress) const {
  const state& s = *state_;
  const render::stopwatch clock;
  const int side = cells.resolution(), half = std::max(1, samples / 2);
  incident_light light;
  for (render::image* picture : {&light.first, &light.second}) {
    const bool is_second = picture == &light.second;
    render::tracer_settings settings = render::tracer_settings_of(s.options);
    settings.width = settings.height = side;
    settings.share = {};  // all cells
    --settings.max_depth;
    settings.seed += reference_seed + (is_second ? 1 : 0);
    tracer_type tracer(s.exec, settings, {s.geometry.view(), s.lights_by_power.view(), s.options.nee},
                       s.accelerated.caster());
    render::unguided<exec_policy> guider(s.exec);
    for (int i = 0; i < half; ++i) {
      tracer.render_sample(guider, cell_camera{at, cells}, static_cast<std::uint32_t>(i), 1.0f);
      const int done = i + 1 + (is_second ? half : 0);
      if (progress) progress({done, double(done) / (2.0 * half), clock.seconds(), 0.0});
    }
    *picture = {side, side, tracer.film().picture()};
  }
  return light;
}

}  // namespace inspect
