# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""The table of dependencies in docs/install.md, compared with what Debian's packages say."""

import json
import pathlib
import re
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
INSTALL = (ROOT / "docs/install.md").read_text()
LICENCES = dict(re.findall(r"^\| `([\w+-]+)` \| [\d.]* ?\| ([^|]+) \|", INSTALL, re.MULTILINE))
TOOLS = {"cmake", "ninja-build", "g++", "pkgconf", "libbenchmark-dev", "python3-dev"}


def licence_of(package):
    """What a copyright file says of most files, or else its whole text."""
    text = pathlib.Path("/usr/share/doc", package, "copyright").read_text()
    found = re.search(r"^Files: *\*$.*?^License: *(\S.*?)$", text, re.MULTILINE | re.DOTALL)
    return found[1] if found else text


def test_every_library_is_listed():
    listed = subprocess.run([ROOT / "scripts/setup", "--list", "python"], capture_output=True, text=True,
                            check=True)
    assert set(LICENCES) == set(listed.stdout.split()) - TOOLS


@pytest.mark.parametrize("package", sorted(LICENCES))
def test_licences_are_those_of_debian(package):
    if not pathlib.Path("/usr/share/doc", package, "copyright").exists():
        pytest.skip(f"{package} is not installed")
    said = licence_of(package)
    if package == "python3-numpy":  # whose file has the text of the licence, and not its name
        assert LICENCES[package] == "BSD-3-Clause" and "NumPy Developers" in said
        assert "Neither the name of the NumPy Developers nor the names of any" in " ".join(said.split())
    else:
        assert said.lower() == LICENCES[package].lower()


def test_the_page_contains_uplot_alone():
    web = ROOT / "src/report/web"
    assert list(json.loads((web / "package.json").read_text())["dependencies"]) == ["uplot"]
    lock = json.loads((web / "package-lock.json").read_text())
    assert lock["packages"]["node_modules/uplot"]["license"] == "MIT"
    assert "The report page contains uPlot (MIT)." in INSTALL
