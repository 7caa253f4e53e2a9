# An overlay port of the tree that it lies in: vcpkg install wfpg --overlay-ports=packaging/vcpkg
set(VCPKG_BUILD_TYPE release) # headers alone

get_filename_component(SOURCE_PATH "${CURRENT_PORT_DIR}/../../.." ABSOLUTE)

set(without_tbb ON)
if("tbb" IN_LIST FEATURES)
  set(without_tbb OFF)
endif()

vcpkg_cmake_configure(
  SOURCE_PATH "${SOURCE_PATH}"
  OPTIONS -DWFPG_BUILD_TESTS=OFF -DWFPG_BUILD_EXAMPLES=OFF -DWFPG_INSTALL=ON -DWFPG_MPI=OFF -DWFPG_NCCL=OFF
          "-DCMAKE_DISABLE_FIND_PACKAGE_TBB=${without_tbb}"
)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH share/cmake/wfpg)
vcpkg_fixup_pkgconfig()

file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/share/licenses")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
file(INSTALL "${CMAKE_CURRENT_LIST_DIR}/usage" DESTINATION "${CURRENT_PACKAGES_DIR}/share/${PORT}")
