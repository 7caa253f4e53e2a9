// Catch2 of major version 2 or 3 under one name. Tests use TEST_CASE, CHECK and, unqualified, Approx.
#pragma once

#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
using Catch::Approx;
#define WFPG_TEST_CONTAINS(text) Catch::Matchers::ContainsSubstring(text)
#else
#include <catch2/catch.hpp>
#define WFPG_TEST_CONTAINS(text) Catch::Contains(text)
#endif

#if defined(__CUDACC__)
// Catch2's own macro makes an anonymous namespace. nvcc confuses one inside another with the outer one.
#undef TEST_CASE
#define WFPG_TEST_JOINED_(a, b) a##b
#define WFPG_TEST_JOINED(a, b) WFPG_TEST_JOINED_(a, b)
#define WFPG_REGISTERED_TEST_CASE(function, registered, ...) \
  static void function();                                    \
  [[maybe_unused]] static const bool registered = [] {       \
    REGISTER_TEST_CASE(function, __VA_ARGS__);               \
    return true;                                             \
  }();                                                       \
  static void function()
#define TEST_CASE(...)                                                    \
  WFPG_REGISTERED_TEST_CASE(WFPG_TEST_JOINED(registered_test_, __LINE__), \
                            WFPG_TEST_JOINED(is_registered_test_, __LINE__), __VA_ARGS__)
#endif
