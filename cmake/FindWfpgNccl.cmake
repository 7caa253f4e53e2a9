# Finds NCCL 2.18 or later and makes the target wfpg::nccl_library. NCCL_ROOT, a folder with include/nccl.h and lib,
# chooses one; so does the folder nvidia/nccl of the Python package nvidia-nccl-cu13.
include(FindPackageHandleStandardArgs)

find_path(
  WFPG_NCCL_INCLUDE_DIR nccl.h
  HINTS "${NCCL_ROOT}" ENV NCCL_ROOT
  PATHS /usr/local/cuda /opt/cuda
  PATH_SUFFIXES include
  DOC "Directory that holds nccl.h")
find_library(
  WFPG_NCCL_LIBRARY
  NAMES nccl libnccl.so.2
  HINTS "${NCCL_ROOT}" ENV NCCL_ROOT
  PATHS /usr/local/cuda /opt/cuda
  PATH_SUFFIXES lib lib64
  DOC "NCCL's library")

if(WFPG_NCCL_INCLUDE_DIR AND EXISTS "${WFPG_NCCL_INCLUDE_DIR}/nccl.h")
  file(STRINGS "${WFPG_NCCL_INCLUDE_DIR}/nccl.h" wfpg_nccl_lines REGEX "#define NCCL_(MAJOR|MINOR|PATCH) ")
  string(REGEX REPLACE "[^0-9]+([0-9]+)[^0-9]+([0-9]+)[^0-9]+([0-9]+).*" "\\1.\\2.\\3" WfpgNccl_VERSION
                       "${wfpg_nccl_lines}")
endif()
# ncclCommSplit came with 2.18.
if(WfpgNccl_VERSION VERSION_LESS 2.18)
  set(WFPG_NCCL_INCLUDE_DIR WFPG_NCCL_INCLUDE_DIR-NOTFOUND)
endif()

find_package_handle_standard_args(
  WfpgNccl
  REQUIRED_VARS WFPG_NCCL_LIBRARY WFPG_NCCL_INCLUDE_DIR
  VERSION_VAR WfpgNccl_VERSION
  REASON_FAILURE_MESSAGE "install NCCL 2.18 or later, or set NCCL_ROOT to the folder with include/nccl.h")

if(WfpgNccl_FOUND AND NOT TARGET wfpg::nccl_library)
  add_library(wfpg::nccl_library UNKNOWN IMPORTED GLOBAL)
  set_target_properties(wfpg::nccl_library PROPERTIES IMPORTED_LOCATION "${WFPG_NCCL_LIBRARY}"
                                                      INTERFACE_INCLUDE_DIRECTORIES "${WFPG_NCCL_INCLUDE_DIR}")
endif()
mark_as_advanced(WFPG_NCCL_INCLUDE_DIR WFPG_NCCL_LIBRARY)
