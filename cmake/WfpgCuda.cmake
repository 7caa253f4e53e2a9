# The CUDA compiler, where there is one: enables the language and sets WFPG_HAS_CUDA, and wfpg_add_cuda_options()
# gives a target what all of the project's CUDA programs have in common. WFPG_CUDA_ARCHITECTURES chooses what is
# compiled for; without it CMake's own environment variable does.
set(architectures 75 90)
if(DEFINED ENV{CUDAARCHS})
  set(architectures $ENV{CUDAARCHS})
endif()
set(WFPG_CUDA_ARCHITECTURES
    ${architectures}
    CACHE STRING "Compute capabilities that CUDA programs are compiled for, a list")
set(CMAKE_CUDA_ARCHITECTURES "${WFPG_CUDA_ARCHITECTURES}")

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
else()
  message(STATUS "nvcc was not found: nothing is compiled for a GPU")
  set(WFPG_HAS_CUDA OFF)
endif()

function(wfpg_add_cuda_options target)
  set_target_properties(${target} PROPERTIES CUDA_STANDARD 17 CUDA_STANDARD_REQUIRED ON)
  target_link_libraries(${target} PRIVATE wfpg_warnings Threads::Threads)
endfunction()
