// Catch2 of either major version under one name. Tests say TEST_CASE, CHECK and, unqualified, Approx.
#pragma once

#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
using Catch::Approx;
#else
#include <catch2/catch.hpp>
#endif
