# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""The type stub is that of the built module, and the package and its users pass a strict check."""

import pathlib
import subprocess
import sys

import pytest

import loopbit

pytest.importorskip("mypy")
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PACKAGES = pathlib.Path(loopbit.__file__).absolute().parent.parent

# Seen from outside, pybind11's classes have a metaclass and no declared constructor.
ALLOWED = r"""
loopbit\._loopbit\.[A-Z_]\w*
loopbit\._loopbit\.\w+\.__(init|index|int|members)__
"""
USER = """
import numpy

import loopbit

options = loopbit.LoopDetectorOptions(surf=loopbit.SurfOptions(max_keypoints=500))
detector = loopbit.LoopDetector(options)
image = numpy.zeros((480, 640), numpy.uint8)
detection = detector.process(image, timestamp_s=0.5)
place: int | None = detection.match
names: list[str] = [frame.name for frame in loopbit.open_source("images", every=2)]
score: float = loopbit.evaluate("run", protocol="kitti").average_precision
ranking: list[loopbit.RankedPlace] = []
with loopbit.MapWriter("town.db", options, "drive") as map:
    loopbit.LoopDetector(map=map).query(image, ranking=ranking)
session: int = ranking[0].place.session
"""
WRONG = ["detector.process(image, evidence=3)", "loopbit.SurfOptions(max_keypoints='many')",
         "detection.colour", "loopbit.evaluate('run').average", "loopbit.run(3)",
         "loopbit.LoopDetector(map='town.db')"]


def python(*arguments):
    return subprocess.run([sys.executable, *map(str, arguments)], stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          cwd=PACKAGES)


def mypy(*files):
    return python("-m", "mypy", "--strict", "--cache-dir", "/dev/null", *files)


def test_stub_is_not_stale():
    checked = python(ROOT / "scripts/python_stubs", "--check", PACKAGES)
    assert checked.returncode == 0, checked.stdout


def test_stub_agrees_with_the_module(tmp_path):
    allowed = tmp_path / "allowed"
    allowed.write_text(ALLOWED)
    checked = python("-m", "mypy.stubtest", "--ignore-unused-allowlist", "--allowlist", allowed,
                     "loopbit._loopbit")
    assert checked.returncode == 0, checked.stdout


def test_strict_check_of_package_and_user(tmp_path):
    user = tmp_path / "user.py"
    user.write_text(USER)
    wrong = tmp_path / "wrong.py"
    wrong.write_text(USER + "\n".join(WRONG) + "\n")
    checked = mypy("loopbit", user)
    assert checked.returncode == 0, checked.stdout
    checked = mypy("loopbit", wrong)
    first = USER.count("\n") + 1
    lines = {int(line.split(":")[1]) for line in checked.stdout.splitlines() if ": error:" in line}
    assert lines == set(range(first, first + len(WRONG))), checked.stdout
