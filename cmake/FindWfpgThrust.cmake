# Finds Thrust's headers and makes the target wfpg::thrust. Debian's libthrust-dev and the CUDA toolkit's copy both
# serve; WFPG_THRUST_INCLUDE_DIR, a directory that holds thrust/version.h, chooses one.
# A toolkit's directory is used as a whole, since its Thrust needs the cub, cuda/std and nv beside it. nvcc finds its
# own Thrust by itself and must see no other, so the directory is for C++ sources alone.
include(FindPackageHandleStandardArgs)

# The compiler's own directories come first, then toolkits: 13 has Thrust in include/cccl, earlier ones in include.
find_path(WFPG_THRUST_INCLUDE_DIR thrust/version.h DOC "Directory that holds thrust/version.h")
find_path(
  WFPG_THRUST_INCLUDE_DIR thrust/version.h
  HINTS "${CUDAToolkit_ROOT}" ENV CUDAToolkit_ROOT ENV CUDA_PATH ENV CUDA_HOME
  PATHS /usr/local/cuda /opt/cuda
  PATH_SUFFIXES include/cccl include)

if(WFPG_THRUST_INCLUDE_DIR AND EXISTS "${WFPG_THRUST_INCLUDE_DIR}/thrust/version.h")
  file(STRINGS "${WFPG_THRUST_INCLUDE_DIR}/thrust/version.h" WFPG_THRUST_VERSION REGEX "#define THRUST_VERSION ")
  string(REGEX REPLACE "^#define THRUST_VERSION +([0-9]+).*$" "\\1" WFPG_THRUST_VERSION "${WFPG_THRUST_VERSION}")
  math(EXPR wfpg_thrust_major "${WFPG_THRUST_VERSION} / 100000")
  math(EXPR wfpg_thrust_minor "${WFPG_THRUST_VERSION} / 100 % 1000")
  math(EXPR wfpg_thrust_patch "${WFPG_THRUST_VERSION} % 100")
  set(WfpgThrust_VERSION ${wfpg_thrust_major}.${wfpg_thrust_minor}.${wfpg_thrust_patch})
endif()

find_package_handle_standard_args(
  WfpgThrust
  REQUIRED_VARS WFPG_THRUST_INCLUDE_DIR WfpgThrust_VERSION
  VERSION_VAR WfpgThrust_VERSION
  REASON_FAILURE_MESSAGE
    "install libthrust-dev or a CUDA toolkit, or set WFPG_THRUST_INCLUDE_DIR to the directory with thrust/version.h")

if(WfpgThrust_FOUND AND NOT TARGET wfpg::thrust)
  add_library(wfpg::thrust INTERFACE IMPORTED GLOBAL)
  set_target_properties(
    wfpg::thrust PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "$<$<COMPILE_LANGUAGE:CXX>:${WFPG_THRUST_INCLUDE_DIR}>")
endif()
mark_as_advanced(WFPG_THRUST_INCLUDE_DIR)
