// Completes and checks options, and chooses the device.
#include "app/render.hpp"

#include "app/option_names.hpp"
#include "app/rank_threads.hpp"
#include "app/ranks.hpp"

#include <wfpg/base/error.hpp>
#include <wfpg/base/math.hpp>

namespace render {

namespace {

/// Files of guides and states need a method that can be saved.
void require_guided_files(const render_options& options) {
  using wfpg::require;
  const std::string& method = name_of(method_names(), options.method);
  require(is_wfpg(options.method) || (options.load_guide.empty() && !options.keep_guide), "method", method,
          "wfpg or wfpg-product where a guide is loaded or saved");
  require(
      properties_of(options.method).can_be_saved || (options.resume.empty() && !options.keep_state), "method",
      method,
      (names_of_methods(&method_properties::can_be_saved) + " where a rendering's state is resumed or saved")
          .c_str());
  require(options.resume.empty() || options.load_guide.empty(), "load_guide", options.load_guide,
          "none where a rendering goes on, which has its own");
}

}  // namespace

render_options completed(const scene& scene, render_options options) {
  using wfpg::require;
  if (options.width == 0 && options.height == 0) {
    options.width = scene.width;
    options.height = scene.height;
  }
  if (options.max_depth == 0) options.max_depth = scene.max_depth;
  require(options.width > 0 && options.width <= largest_side, "width", options.width, "1 to 32768");
  require(options.height > 0 && options.height <= largest_side, "height", options.height, "1 to 32768");
  require(std::int64_t(options.width) * options.height <= most_pixels, "width times height",
          std::int64_t(options.width) * options.height, "at most 2^28");
  require(options.max_depth > 0 && options.max_depth <= largest_depth, "max_depth", options.max_depth,
          "1 to 1024");
  require(options.roulette_depth >= 1 && options.roulette_depth <= 1 << 30, "roulette_depth",
          options.roulette_depth, "1 to 2^30");
  require(options.method != sampling_method::wfpg_product || options.product_resolution > 0,
          "product_resolution", options.product_resolution, "4, 8 or 16 for wfpg-product");
  require(!is_openpgl(options.method) || options.where == device::cpu, "device",
          name_of(device_names(), options.where), "cpu for Open PGL's methods, which run on TBB");
  const float fraction = options.guide_fraction.value_or(1.0f);
  require(fraction > 0.0f && fraction <= 1.0f, "guide_fraction", fraction, "above 0, at most 1");
  const float gain = options.least_gain.value_or(1.0f);
  require(wfpg::is_finite(gain) && (gain == 0.0f || (gain >= 1.0f && gain <= 1.0e6f)), "least_gain", gain,
          "1 to 1e6, or 0 for guides that never rest");
  require(options.samples_per_leaf >= 8 && options.samples_per_leaf <= 1u << 30, "samples_per_leaf",
          options.samples_per_leaf, "8 to 2^30");
  require(options.seconds >= 0.0, "seconds", options.seconds, "0 or more");
  const int least = least_samples(options);
  require(options.seconds > 0.0 || options.spp >= least, "spp", options.spp,
          least > 1 ? ("at least " + std::to_string(least) + ", as the first sample is discarded").c_str()
                    : "at least 1");
  require(properties_of(options.method).has_media || !needs_volume_tracing(scene), "method",
          name_of(method_names(), options.method),
          (names_of_methods(&method_properties::has_media) + " for a scene with fog or scattering solids")
              .c_str());
  wfpg::require_in_range(light_options_of(options));
  require(!options.technique_pictures || options.resume.empty(), "technique_pictures", "on",
          "off where a rendering goes on, whose state has none");
  require_guided_files(options);
  require_shared(options);
  if (!options.policy_ranks) options.policy_ranks = options.ranks;
  return options;
}

namespace {

render_result render_completed(const scene& scene, const render_options& options,
                               const progress_callback& progress) {
  if (is_openpgl(options.method)) return render_with_openpgl(scene, options, progress);
  switch (options.where) {
    case device::omp:
      return render_on_omp(scene, options, progress);
    case device::seq:
      return render_on_seq(scene, options, progress);
    case device::cuda:
      return render_on_cuda(scene, options, progress);
    case device::optix:
      return render_on_optix(scene, options, progress);
    default:
      return render_on_tbb(scene, options, progress);
  }
}

}  // namespace

render_result render(const scene& scene, const render_options& options, const progress_callback& progress) {
  if (options.devices.size() > 1) return render_on_devices(scene, options, progress);
  const render_options complete = completed(scene, options);
  require_same_rendering(scene, complete);
  render_result result = render_completed(scene, complete, progress);
  result.report.scene = scene.name;
  result.report.method = name_of(method_names(), options.method);
  result.report.device = name_of(device_names(), options.where);
  return result;
}

}  // namespace render
