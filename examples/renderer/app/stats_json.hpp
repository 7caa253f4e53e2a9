// The cost of a rendering, as JSON.
#pragma once

#include "app/metrics.hpp"
#include "app/render.hpp"

#include <nlohmann/json_fwd.hpp>

#include <optional>
#include <string>

namespace render {

/// Every measure by its name. Infinity becomes null, since JSON has none.
nlohmann::ordered_json to_json(const image_error& error);

/// Writes scene, method, device, spp, segments, light_hits_per_path, seconds, memory, octree, bins and
/// cones_per_segment. With an error it writes `error` too. Infinities and NaN become null. Throws
/// std::runtime_error that names the path.
void write_stats(const std::string& path, const render_report& report,
                 const std::optional<image_error>& error);

}  // namespace render
