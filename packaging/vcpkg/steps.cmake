# cmake -Droot=DIR -Dbuild=DIR [-Dfeatures=tbb] -P steps.cmake: runs the portfile in plain CMake. The functions below stand
# for vcpkg's of these names, as far as the port uses them. The package is in build/packages.
cmake_minimum_required(VERSION 3.25)
set(PORT wfpg)
set(FEATURES core ${features})
set(CURRENT_PORT_DIR "${root}/packaging/vcpkg/wfpg")
set(CURRENT_PACKAGES_DIR "${build}/packages")
set(CURRENT_BUILDTREES_DIR "${build}/tree")
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}" "${CURRENT_BUILDTREES_DIR}")

# Fails where the program does.
function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY OUTPUT_QUIET)
endfunction()

function(vcpkg_cmake_configure)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" SOURCE_PATH OPTIONS)
  run("${CMAKE_COMMAND}" -S "${arg_SOURCE_PATH}" -B "${CURRENT_BUILDTREES_DIR}" -DCMAKE_BUILD_TYPE=Release
      "-DCMAKE_INSTALL_PREFIX=${CURRENT_PACKAGES_DIR}" ${arg_OPTIONS})
endfunction()

function(vcpkg_cmake_install)
  run("${CMAKE_COMMAND}" --build "${CURRENT_BUILDTREES_DIR}" --target install)
endfunction()

# The files move from share/cmake/wfpg to share/wfpg, one folder nearer to the prefix.
function(vcpkg_cmake_config_fixup)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" CONFIG_PATH "")
  file(GLOB files "${CURRENT_PACKAGES_DIR}/${arg_CONFIG_PATH}/*")
  file(COPY ${files} DESTINATION "${CURRENT_PACKAGES_DIR}/share/${PORT}")
  file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/share/cmake")
  file(GLOB files "${CURRENT_PACKAGES_DIR}/share/${PORT}/*.cmake")
  set(parent [[get_filename_component(_IMPORT_PREFIX "${_IMPORT_PREFIX}" PATH)]])
  foreach(file IN LISTS files)
    file(READ "${file}" text)
    string(REPLACE "${parent}\n${parent}\n${parent}\n" "${parent}\n${parent}\n" text "${text}")
    string(REPLACE [[{CMAKE_CURRENT_LIST_DIR}/../../../"]] [[{CMAKE_CURRENT_LIST_DIR}/../../"]] text "${text}")
    file(WRITE "${file}" "${text}")
  endforeach()
endfunction()

function(vcpkg_fixup_pkgconfig)
  if(NOT EXISTS "${CURRENT_PACKAGES_DIR}/share/pkgconfig/${PORT}.pc")
    message(FATAL_ERROR "there is no file for pkg-config")
  endif()
endfunction()

function(vcpkg_install_copyright)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "" FILE_LIST)
  file(COPY_FILE "${arg_FILE_LIST}" "${CURRENT_PACKAGES_DIR}/share/${PORT}/copyright")
endfunction()

include("${CURRENT_PORT_DIR}/portfile.cmake")

# What vcpkg refuses of headers alone, and the version that vcpkg.json repeats.
foreach(unwanted IN ITEMS debug lib bin share/cmake)
  if(EXISTS "${CURRENT_PACKAGES_DIR}/${unwanted}")
    message(FATAL_ERROR "the port installs ${unwanted}")
  endif()
endforeach()
file(READ "${CURRENT_PORT_DIR}/vcpkg.json" manifest)
string(JSON of_port GET "${manifest}" version)
include("${CURRENT_PACKAGES_DIR}/share/${PORT}/wfpg-config-version.cmake")
if(NOT of_port STREQUAL PACKAGE_VERSION)
  message(FATAL_ERROR "vcpkg.json has version ${of_port}, and the headers have ${PACKAGE_VERSION}")
endif()
