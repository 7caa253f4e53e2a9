"""Conan 2 recipe of the headers, made from the tree that it lies in: `conan create packaging/conan`."""
import os
import re

from conan import ConanFile
from conan.tools.cmake import CMake, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load


class Wfpg(ConanFile):
    name = "wfpg"
    description = "Path guiding for wavefront path tracers"
    license = "MIT"
    topics = ("rendering", "path-tracing", "path-guiding", "header-only")
    package_type = "header-library"
    settings = "os", "arch", "compiler", "build_type"
    options = {"with_tbb": [True, False]}
    default_options = {"with_tbb": True}
    generators = "CMakeDeps"

    def _tree(self):
        return os.path.join(self.recipe_folder, "..", "..")

    def set_version(self):
        header = load(self, os.path.join(self._tree(), "include", "wfpg", "version.hpp"))
        self.version = ".".join(re.findall(r"#define WFPG_VERSION_\w+ (\d+)", header))

    def export_sources(self):
        for pattern in ("CMakeLists.txt", "LICENSE", "cmake/*", "include/*"):
            copy(self, pattern, self._tree(), self.export_sources_folder)

    # Thrust is no requirement: FindWfpgThrust finds that of the system or of a CUDA toolkit.
    def requirements(self):
        self.requires("glm/[>=0.9.9 <2]", transitive_headers=True)
        if self.options.with_tbb:
            self.requires("onetbb/[>=2021]", transitive_headers=True)

    def layout(self):
        cmake_layout(self)

    # The package holds headers, so that it serves every compiler; with_tbb decides whether it has wfpg::tbb.
    def package_id(self):
        self.info.settings.clear()
        self.info.requires.clear()

    def generate(self):
        toolchain = CMakeToolchain(self)
        for what in ("TESTS", "EXAMPLES"):
            toolchain.cache_variables[f"WFPG_BUILD_{what}"] = False
        # The package has these targets either way.
        for what in ("MPI", "NCCL"):
            toolchain.cache_variables[f"WFPG_{what}"] = False
        toolchain.cache_variables["WFPG_INSTALL"] = True
        toolchain.cache_variables["CMAKE_DISABLE_FIND_PACKAGE_TBB"] = not self.options.with_tbb
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()

    def package(self):
        CMake(self).install()

    # The package's own files make its targets, with components, so Conan makes none.
    def package_info(self):
        self.cpp_info.set_property("cmake_find_mode", "none")
        self.cpp_info.builddirs = [os.path.join("share", "cmake", "wfpg")]
        self.cpp_info.bindirs = []
        self.cpp_info.libdirs = []
