# cpack makes a .deb that is the same on every architecture, and a .tar.gz; both hold what is installed, the headers
# and how to find them.
set(CPACK_GENERATOR DEB TGZ)
set(CPACK_PACKAGE_VENDOR "The wfpg authors")
set(CPACK_PACKAGE_CONTACT "The wfpg authors")
set(CPACK_PACKAGE_DESCRIPTION
    "Guides the paths of a path tracer to where light was found, on CPUs with TBB or OpenMP and on GPUs with CUDA.")
set(CPACK_PACKAGE_FILE_NAME "wfpg-${PROJECT_VERSION}")
set(CPACK_RESOURCE_FILE_LICENSE "${PROJECT_SOURCE_DIR}/LICENSE")
set(CPACK_THREADS 1)

set(CPACK_DEBIAN_PACKAGE_NAME libwfpg-dev)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "libglm-dev, libthrust-dev")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS libtbb-dev)
include(CPack)
