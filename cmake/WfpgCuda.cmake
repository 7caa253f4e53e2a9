# The CUDA compiler, where there is one: enables the language and sets WFPG_HAS_CUDA, and wfpg_add_cuda_options()
# gives a target what all of the project's CUDA programs have in common. CMAKE_CUDA_ARCHITECTURES, or CUDAARCHS in the
# environment, chooses what is compiled for.
if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES)
  # CMake itself reads the environment in a new build folder alone.
  set(CMAKE_CUDA_ARCHITECTURES 75 90)
  if(NOT "$ENV{CUDAARCHS}" STREQUAL "")
    set(CMAKE_CUDA_ARCHITECTURES $ENV{CUDAARCHS})
  endif()
endif()

option(WFPG_CUDA_COMPILE_ONLY "Compile the renderer's kernels quickly, only to find errors" OFF)

find_program(WFPG_NVCC nvcc HINTS ENV CUDA_HOME PATHS /usr/local/cuda /opt/cuda PATH_SUFFIXES bin)
mark_as_advanced(WFPG_NVCC)
if(WFPG_NVCC AND NOT DEFINED ENV{CUDACXX})
  set(ENV{CUDACXX} "${WFPG_NVCC}")
endif()
include(CheckLanguage)
check_language(CUDA)
if(CMAKE_CUDA_COMPILER)
  enable_language(CUDA)
  find_package(Threads REQUIRED)
  set(WFPG_HAS_CUDA ON)
  include(CheckCompilerFlag)
  check_compiler_flag(CUDA -Ofc=max WFPG_CUDA_COMPILES_FAST)
else()
  message(STATUS "nvcc was not found: nothing is compiled for a GPU")
  set(WFPG_HAS_CUDA OFF)
endif()

function(wfpg_add_cuda_options target)
  set_target_properties(${target} PROPERTIES CUDA_STANDARD 17 CUDA_STANDARD_REQUIRED ON)
  target_link_libraries(${target} PRIVATE wfpg_warnings Threads::Threads)
endfunction()

# Kernels are hardly optimised, which takes a fraction of the time and finds nearly all errors.
function(wfpg_compile_cuda_fast target)
  target_compile_options(
    ${target} PRIVATE $<$<AND:$<COMPILE_LANGUAGE:CUDA>,$<BOOL:${WFPG_CUDA_COMPILES_FAST}>>:-Ofc=max>)
endfunction()

# Adds a library of PTX, which is compiled to find errors: of the first architecture, and hardly optimised. It is not part
# of `all`.
function(wfpg_add_ptx name source)
  add_library(${name} OBJECT EXCLUDE_FROM_ALL ${source})
  list(GET CMAKE_CUDA_ARCHITECTURES 0 first)
  if(first MATCHES "^[0-9]+[a-z]?$")
    string(APPEND first -virtual)
  elseif(NOT first MATCHES "^[0-9]")
    set(first 75-virtual)  # the list is a word for several, such as "all"
  endif()
  set_target_properties(${name} PROPERTIES CUDA_PTX_COMPILATION ON CUDA_ARCHITECTURES "${first}")
  wfpg_compile_cuda_fast(${name})
endfunction()
