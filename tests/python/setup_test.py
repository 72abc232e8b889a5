# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""setup.py has the report page built where that is possible, and does without it where not. A CMake
that only notes what it is asked stands in for the real one, which takes minutes."""

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
  *loopbit_report_page*) exit $PAGE_FAILS ;;
  *loopbit_python*) /bin/mkdir -p "$2/python/loopbit" && : >"$2/python/loopbit/{MODULE}" ;;
esac
"""


@pytest.fixture
def build(tmp_path):
    """Runs setup.py; returns what it told, and, for each configuration, whether with the page."""
    def run(tools=("cmake", "node", "npm"), page_fails=0, cmake_args=""):
        for tool in tools:
            (tmp_path / tool).write_text(CMAKE)
            (tmp_path / tool).chmod(0o755)
        asked = tmp_path / "asked"
        environment = {**os.environ, "PATH": str(tmp_path), "ASKED": str(asked),
                       "PAGE_FAILS": str(page_fails), "CMAKE_ARGS": cmake_args,
                       "PYTHONDONTWRITEBYTECODE": "1"}
        environment.pop("LOOPBIT_BUILD_DIR", None)
        done = subprocess.run(
            [sys.executable, "setup.py", "build_ext", "--build-temp", tmp_path / "build",
             "--build-lib", tmp_path / "lib"],
            cwd=ROOT, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert (tmp_path / "lib/loopbit" / MODULE).exists()
        lines = asked.read_text().splitlines()
        return done.stderr, [line.partition("LOOPBIT_BUILD_REPORT=")[2].split() for line in lines
                             if line.startswith("-S")]

    return run


def test_the_page_is_built_where_it_can_be(build):
    told, configured = build()
    assert configured == [["ON"]] and "leaving out" not in told


def test_without_npm_there_is_no_page(build):
    told, configured = build(tools=("cmake", "node"))
    assert configured == [["OFF"]] and "no Node.js with npm" in told


def test_a_page_that_cannot_be_built_is_left_out(build):
    told, configured = build(page_fails=1)
    assert configured == [["ON"], ["OFF"]] and "npm could not build it" in told


def test_the_pybind11_of_pip_is_found(build, tmp_path, monkeypatch):
    package = tmp_path / "site" / "pybind11"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text(f"def get_cmake_dir(): return {str(package)!r}\n")
    monkeypatch.setenv("PYTHONPATH", str(package.parent))
    build()
    assert f"-Dpybind11_DIR={package}" in (tmp_path / "asked").read_text().split()


@pytest.mark.parametrize("wanted", ["ON", "OFF"])
def test_what_is_asked_for_is_done(build, wanted):
    told, configured = build(page_fails=1, cmake_args=f"-DLOOPBIT_BUILD_REPORT={wanted}")
    assert configured == [[wanted]] and "leaving out" not in told
