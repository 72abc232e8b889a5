# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""What the scripts for a first start decide; programs that only tell stand in for those they call."""

import pathlib
import shutil
import subprocess

import pytest

SCRIPTS = pathlib.Path(__file__).resolve().parent.parent.parent / "scripts"
LOOPBIT = """#!/bin/sh
while [ "$1" != --out ]; do shift; done
mkdir -p "$2" && echo "$2"
"""


def program(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)


def run(*command, path, cwd=None):
    done = subprocess.run([str(part) for part in command], env={"PATH": str(path)}, cwd=cwd,
                          capture_output=True, text=True, stdin=subprocess.DEVNULL)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.skipif(not shutil.which("dpkg"), reason="no Debian")
@pytest.mark.parametrize("node, npm, wanted", [
    ("18.18.0", True, False), ("20.2.1", True, False), ("18.9.1", True, True),
    ("18.17.9", True, True), ("16.20.0", True, True), ("20.2.1", False, True),
    (None, True, True)])
def test_setup_wants_node_where_it_is_missing_or_old(tmp_path, node, npm, wanted):
    (tmp_path / "dpkg").symlink_to(shutil.which("dpkg"))
    if node:
        program(tmp_path / "node", f"#!/bin/sh\necho {node}\n")
    if npm:
        program(tmp_path / "npm", "#!/bin/sh\n")
    listed = run("/bin/bash", SCRIPTS / "setup", "--list", path=tmp_path).split()
    assert ("nodejs" in listed) == wanted and "cmake" in listed


@pytest.mark.parametrize("packages", ["build", "bench", "python", "packages"])
def test_building_needs_no_node(tmp_path, packages):
    listed = run("/bin/bash", SCRIPTS / "setup", "--list", packages, path=tmp_path).split()
    assert "nodejs" not in listed and "npm" not in listed and "cmake" in listed


@pytest.fixture
def demo(tmp_path):
    """Runs scripts/demo of a tree without sources, in a folder; returns where its results went."""
    root = tmp_path / "tree"
    (root / "scripts").mkdir(parents=True)
    shutil.copy(SCRIPTS / "demo", root / "scripts")
    for tool in (root / "scripts/setup", tmp_path / "bin/cmake"):
        program(tool, "#!/bin/sh\n")
    program(root / "build/release/src/cli/loopbit", LOOPBIT)

    def call(*arguments, cwd=tmp_path):
        out = run(root / "scripts/demo", *arguments, path=f"{tmp_path / 'bin'}:/usr/bin:/bin",
                  cwd=cwd).strip()
        return str(pathlib.Path(out).relative_to(root / "loopbit_demo"))

    return call


def test_results_of_the_demo_have_folders_of_their_own(demo, tmp_path):
    world = tmp_path / "my" / "world"
    world.mkdir(parents=True)
    assert demo(world) == "world-2"
    assert demo() == demo() == "world"
    assert demo(world) == "world-3"
    assert demo(".", cwd=tmp_path / "my") == "my"
    assert demo("..", cwd=world) == "my-2"
    assert demo("camera:0") == "camera:0"
