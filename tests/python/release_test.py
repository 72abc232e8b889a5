# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""What scripts/wheel and the Dockerfile do, as far as that takes no hour and no Docker."""

import importlib.machinery
import importlib.util
import os
import pathlib
import re
import shutil
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
DOCKERFILE = (ROOT / "Dockerfile").read_text().replace("\\\n", "")


def test_docker_installs_what_the_scripts_build_and_test():
    stages = re.split(r"^FROM debian:12-slim.*$", DOCKERFILE, flags=re.MULTILINE)[1:]
    assert len(stages) == 2
    steps = [re.findall(r"^RUN (.+)$", stage, re.MULTILINE) for stage in stages]
    assert steps[0] == ["/source/scripts/packages"] and os.access(ROOT / "scripts/packages", os.X_OK)
    # The packages are those that scripts/test_packages installs for the command, from where they are built.
    copied = re.findall(r"/source/(build/packages/)([\w.*-]+\.deb)", stages[1])
    tested = re.search(r"^# The command alone.*\n((?:.*\\\n)*.*)$", (ROOT / "scripts/test_packages").read_text(),
                       re.MULTILINE)[1]
    assert [name for _, name in copied] == re.findall(r"/packages/([\w.*-]+\.deb)", tested)
    for folder, _ in copied:
        assert f"ls -l {folder}*.deb" in (ROOT / "scripts/packages").read_text()
    assert re.search(r"^USER (?!root)", stages[1], re.MULTILINE)
    assert 'ENTRYPOINT ["loopbit"]' in stages[1]


def test_docker_gets_all_sources():
    ignored = (ROOT / ".dockerignore").read_text().split()
    needed = {"CMakeLists.txt", "CMakePresets.json", "LICENSE", "cmake", "python", "scripts", "src", "tools"}
    assert not needed & set(ignored)
    assert all((ROOT / name).exists() for name in needed)


@pytest.fixture
def wheel():
    loader = importlib.machinery.SourceFileLoader("wheel_script", str(ROOT / "scripts/wheel"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    return module


@pytest.mark.skipif(not shutil.which("patchelf"), reason="no patchelf")
def test_a_bundle_needs_no_library_of_the_machine(wheel, tmp_path, monkeypatch):
    """A program that loads a library, which loads another: both move into the bundle."""
    machine, package = tmp_path / "machine", tmp_path / "wheel/package/bin"
    machine.mkdir()
    package.mkdir(parents=True)
    (tmp_path / "versions").write_text("V1 { *; };\n")
    monkeypatch.setenv("LD_LIBRARY_PATH", str(machine))
    for name, text, links in (("one", "int one() { return 1; }", []),
                              ("two", "int one(); int two() { return one() + 1; }", ["-lone"])):
        subprocess.run(["gcc", "-x", "c", "-", "-shared", "-fPIC", "-o", machine / f"lib{name}.so.3",
                        f"-Wl,-soname,lib{name}.so.3,--version-script={tmp_path}/versions", f"-L{machine}", *links],
                       input=text, text=True, check=True)
        (machine / f"lib{name}.so").symlink_to(f"lib{name}.so.3")
    program = package / "program"
    subprocess.run(["gcc", "-x", "c", "-", "-o", program, f"-L{machine}", "-ltwo"],
                   input="int two(); int main() { return two(); }", text=True, check=True)
    originals = wheel.bundle([program], tmp_path / "wheel/package.libs")
    assert originals == [machine / "libone.so.3", machine / "libtwo.so.3"]
    shutil.rmtree(machine)
    monkeypatch.delenv("LD_LIBRARY_PATH")
    moved = (tmp_path / "wheel").rename(tmp_path / "elsewhere")
    assert subprocess.run([moved / "package/bin/program"]).returncode == 2
    names = sorted(file.name for file in (moved / "package.libs").iterdir())
    assert [re.sub("-[0-9a-f]{8}", "", name) for name in names] == ["libone.so.3", "libtwo.so.3"]
