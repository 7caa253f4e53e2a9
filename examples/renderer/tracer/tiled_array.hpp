// The library's arrays of structures, by the names that the renderer's kernels use.
#pragma once

#include <wfpg/exec/tiled_array.hpp>

namespace render {

using wfpg::tiled_array;
using wfpg::tiled_view;

}  // namespace render
