# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""What setup.py asks of CMake. A CMake that only notes what it is asked stands in for the real one,
which takes minutes."""

import os
import pathlib
import subprocess
import sys
import sysconfig

import pytest

pytest.importorskip("setuptools")
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
MODULE = "_loopbit" + sysconfig.get_config_var("EXT_SUFFIX")
CMAKE = f"""#!/bin/sh
echo "$@" >>"$ASKED"
case "$*" in
  *loopbit_python*)
    /bin/mkdir -p "$2/python/loopbit" "$2/src/cli"
    : >"$2/python/loopbit/{MODULE}"
    : >"$2/src/cli/loopbit" ;;
esac
"""


def test_the_pybind11_of_pip_is_found_and_nothing_but_cmake_is_needed(tmp_path):
    cmake = tmp_path / "bin/cmake"
    cmake.parent.mkdir()
    cmake.write_text(CMAKE)
    cmake.chmod(0o755)
    package = tmp_path / "site/pybind11"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text(f"def get_cmake_dir(): return {str(package)!r}\n")
    asked = tmp_path / "asked"
    environment = {**os.environ, "PATH": str(cmake.parent), "ASKED": str(asked),
                   "PYTHONPATH": str(package.parent), "PYTHONDONTWRITEBYTECODE": "1",
                   "CMAKE_ARGS": "-DONE=1 '-DTWO=a b'"}
    environment.pop("LOOPBIT_BUILD_DIR", None)
    done = subprocess.run(
        [sys.executable, "setup.py", "build_ext", "--build-temp", tmp_path / "build",
         "--build-lib", tmp_path / "lib"],
        cwd=ROOT, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "lib/loopbit" / MODULE).exists() and (tmp_path / "lib/loopbit/bin/loopbit").exists()
    configured = asked.read_text().splitlines()[0]
    assert f"-Dpybind11_DIR={package}" in configured.split()
    assert configured.endswith("-DONE=1 -DTWO=a b")
