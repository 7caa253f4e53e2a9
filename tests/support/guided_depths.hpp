// Which of a path's directions the renderer's guide samples.
#pragma once

#include "support/catch.hpp"
#include "support/renderings.hpp"

#include <cstdint>

namespace wfpg_test {

/// A path of n segments samples n - 1 directions. A guide samples all of them, but with next-event estimation
/// not the last. In a path of two segments the only direction is guided.
inline void check_depths_are_guided(render::sampling_method method) {
  constexpr std::uint32_t all = 0xffffffffu;
  const auto picture = [](render::sampling_method by, bool nee, int max_depth, std::uint32_t depths) {
    render::render_options options = rendering{"cornell-box", nee, by}.options();
    options.spp = 3;
    options.max_depth = max_depth;
    options.guided_depths = depths;
    return render::render(render::make_builtin_scene("cornell-box"), options, {}).picture.pixels;
  };
  INFO(rendering({"cornell-box", true, method}).name());
  const auto first_are_all = [&](std::uint32_t depths, bool nee) {
    return picture(method, nee, 6, depths) == picture(method, nee, 6, all);
  };
  CHECK(first_are_all(4, true));
  CHECK_FALSE(first_are_all(3, true));
  CHECK(first_are_all(5, false));
  CHECK_FALSE(first_are_all(4, false));
  const bool guided = picture(method, true, 2, all) != picture(render::sampling_method::pt, true, 2, all);
  CHECK(guided);
}

}  // namespace wfpg_test
