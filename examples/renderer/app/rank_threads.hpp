// Ranks as threads of this process, each with a GPU or a part of the cores.
#pragma once

#include "app/render.hpp"
#include "scene/scene.hpp"

#include <vector>

namespace render {

/// Renders one picture by as many ranks as there are options, a thread each. Options differ in devices alone.
/// Returns the first rank's result. Throws what the rank threw that failed first. `progress` is the first
/// rank's.
render_result render_by_threads(const scene& scene, const std::vector<render_options>& options,
                                const progress_callback& progress);

/// Renders on each of options.devices, a GPU each.
render_result render_on_devices(const scene& scene, const render_options& options,
                                const progress_callback& progress);

}  // namespace render
