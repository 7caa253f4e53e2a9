# What wfpg's own programs, tests and benchmarks have in common.

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release)
endif()
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/bin")
set(CMAKE_CXX_EXTENSIONS OFF)

foreach(policy IN ITEMS tbb omp)
  if(NOT TARGET wfpg::${policy})
    message(FATAL_ERROR "Tests and examples need TBB (libtbb-dev) and OpenMP; wfpg::${policy} is missing")
  endif()
endforeach()

add_library(wfpg_warnings INTERFACE)
set(wfpg_warning_options -Wall -Wextra $<$<BOOL:${WFPG_WARNINGS_AS_ERRORS}>:-Werror>)
target_compile_options(
  wfpg_warnings INTERFACE "$<$<COMPILE_LANGUAGE:CXX>:${wfpg_warning_options}>"
                          "$<$<COMPILE_LANGUAGE:CUDA>:-Xcompiler=-Wall,-Wextra>"
                          "$<$<AND:$<COMPILE_LANGUAGE:CUDA>,$<BOOL:${WFPG_WARNINGS_AS_ERRORS}>>:-Werror=all-warnings>")
