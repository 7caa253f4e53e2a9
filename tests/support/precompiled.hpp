// Headers of other libraries that most tests include, which the build compiles once for all of them.
//
// None of the library's own is here. With clang++ their lines would not all be counted, g++ would not warn of
// them, and each change in them would compile all tests anew. No test includes this file.
#pragma once

#define THRUST_DEVICE_SYSTEM THRUST_DEVICE_SYSTEM_CPP  // as exec/support/thrust.hpp has it

#include "support/catch.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <omp.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <thrust/copy.h>
#include <thrust/fill.h>
#include <thrust/scan.h>
#include <thrust/sort.h>
#include <thrust/system/cpp/execution_policy.h>
#include <thrust/system/omp/execution_policy.h>
#include <thrust/system/tbb/execution_policy.h>
#include <thrust/transform_reduce.h>
#include <thrust/transform_scan.h>
