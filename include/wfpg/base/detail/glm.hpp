// GLM as the library uses it, without the warnings that nvcc has for GLM's own defaulted members.
#pragma once

#if defined(__CUDACC__)
#pragma nv_diagnostic push
#pragma nv_diag_suppress 20012
#endif

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#if defined(__CUDACC__)
#pragma nv_diagnostic pop
#endif
