# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Builds the Python package with the CMake project around it; all else stands in pyproject.toml.

CMAKE_ARGS holds more arguments for CMake, separated as in a shell. LOOPBIT_BUILD_DIR names a build
folder to build in, so that what is compiled there is not compiled again.
"""

import os
import pathlib
import re
import shlex
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = pathlib.Path(__file__).resolve().parent


class BuildWithCMake(build_ext):
    """Has CMake build the one extension and the command, and copies them into the package."""

    def build_extension(self, ext):
        build = os.environ.get("LOOPBIT_BUILD_DIR")
        if build is None:
            build = pathlib.Path(self.build_temp).resolve()
            configure(build)
        jobs = self.parallel or os.cpu_count()
        cmake("--build", build, "--target", "loopbit_python", "loopbit_cli", "--parallel", jobs)
        module = pathlib.Path(self.get_ext_fullpath(ext.name))
        command = module.parent / "bin/loopbit"  # see _command.py
        self.mkpath(str(command.parent))
        self.copy_file(str(pathlib.Path(build) / "python/loopbit" / module.name), str(module))
        self.copy_file(str(pathlib.Path(build) / "src/cli/loopbit"), str(command))


def configure(build):
    cmake("-S", ROOT, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
          "-DLOOPBIT_BUILD_PYTHON=ON", "-DLOOPBIT_BUILD_CLI=ON", "-DLOOPBIT_BUILD_TESTS=OFF",
          "-DLOOPBIT_BUILD_BENCHMARKS=OFF", "-DLOOPBIT_BUILD_SERVER_SEARCH=OFF",
          f"-DPython3_EXECUTABLE={sys.executable}",
          *installed_pybind11(), *shlex.split(os.environ.get("CMAKE_ARGS", "")))


def installed_pybind11():
    """Where pip put it; CMake looks where the system has it."""
    try:
        import pybind11
    except ImportError:
        return []
    return [f"-Dpybind11_DIR={pybind11.get_cmake_dir()}"]


def cmake(*arguments):
    subprocess.run(["cmake", *map(str, arguments)], check=True)


def version():
    """The one that stands in the project() of the top CMakeLists.txt."""
    return re.search(r"^  VERSION (\S+)$", (ROOT / "CMakeLists.txt").read_text(), re.MULTILINE)[1]


setup(
    version=version(),
    ext_modules=[Extension("loopbit._loopbit", sources=[])],
    cmdclass={"build_ext": BuildWithCMake},
)
