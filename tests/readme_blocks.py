#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Runs what README.md shows, so that it stays true.

    readme_blocks.py README PREFIX CONFIGURED SCRATCH

Every fenced block of the file README is tried, in order, in the folder SCRATCH/work:
  sh     is run by bash, with the loopbit installed in PREFIX first in PATH;
  python is a whole script, run with the Python module in PREFIX;
  cpp    is a whole program: built against PREFIX with the consumer's CMakeLists.txt, which was
         configured in CONFIGURED;
  cmake  is a whole CMakeLists.txt: builds the C++ program shown last;
  text   shows output or a sketch and is not run.
Any other block is an error. A block that cannot be run here says why in the line before it:
  <!-- ci: skip REASON -->
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass

TESTS = pathlib.Path(__file__).resolve().parent
FENCE = re.compile(r"^(?P<indent> *)(?P<fence>`{3,}|~{3,}) *(?P<language>[^`\s]*)")
SKIP = re.compile(r"^ *<!-- ci: skip (?P<reason>.*\S) -->$")


@dataclass
class Block:
    line: int
    language: str
    text: str
    skip: str | None


class BlockError(Exception):
    """Why a block is not true; the message is shown behind its line number."""


def blocks_of(markdown):
    lines = iter(enumerate(markdown.splitlines(), start=1))
    skip = None
    for number, line in lines:
        opening = FENCE.match(line)
        if opening:
            body = []
            for _, inner in lines:
                if inner.strip() == opening["fence"]:
                    break
                body.append(inner.removeprefix(opening["indent"]))
            else:
                raise BlockError(f"the block opened in line {number} is never closed")
            yield Block(number, opening["language"], "\n".join(body) + "\n", skip)
        reason = SKIP.match(line)
        skip = reason["reason"] if reason else None


def run(command, **options):
    result = subprocess.run(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        **options,
    )
    if result.returncode != 0:
        raise BlockError(f"{result.stdout}exit code {result.returncode}")


class Runner:
    def __init__(self, prefix, configured, scratch):
        self.prefix, self.configured = prefix, configured
        self.work = scratch / "work"
        self.program = scratch / "program"
        shutil.rmtree(scratch, ignore_errors=True)
        self.work.mkdir(parents=True)
        self.program.mkdir()

    def sh(self, text):
        path = f"{self.prefix / 'bin'}{os.pathsep}{os.environ['PATH']}"
        environment = {**os.environ, "PATH": path}
        run(["bash", "-euo", "pipefail", "-c", text], cwd=self.work, env=environment)

    def python(self, text):
        environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1",
                       "PYTHONPATH": str(self.prefix / "lib/python3/dist-packages")}
        run(["/usr/bin/python3", "-c", text], cwd=self.work, env=environment)

    def cpp(self, text):
        if "int main" not in text:
            raise BlockError("not a whole program")
        (self.program / "main.cpp").write_text(text)
        cmake_lists = (TESTS / "consumer/CMakeLists.txt").read_text()
        for header, library in (("loopbit/fleet_", "loopbit::fleet"), ("loopbit/map_", "loopbit::map")):
            if header in text:
                cmake_lists = cmake_lists.replace("loopbit::loopbit", library)
        self.build(cmake_lists)

    def cmake(self, text):
        if "project(" not in text:
            raise BlockError("not a whole CMakeLists.txt")
        if not (self.program / "main.cpp").exists():
            raise BlockError("no C++ program is shown before it")
        self.build(text)

    def build(self, cmake_lists):
        (self.program / "CMakeLists.txt").write_text(cmake_lists)
        build = self.program / "build"
        run([TESTS / "configure_again", self.configured, self.program, build])
        run(["cmake", "--build", build])

    def text(self, text):
        pass


def main():
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    readme, prefix, configured, scratch = (pathlib.Path(argument).resolve() for argument in sys.argv[1:])
    runner = Runner(prefix, configured, scratch)
    actions = {"sh": runner.sh, "python": runner.python, "cpp": runner.cpp, "cmake": runner.cmake,
               "text": runner.text}
    number = 0
    try:
        for block in blocks_of(readme.read_text(encoding="utf-8")):
            number = block.line
            if block.skip:
                print(f"{readme.name}:{number}: skipped: {block.skip}")
                continue
            if block.language not in actions:
                raise BlockError(f"unknown language '{block.language}'")
            actions[block.language](block.text)
            print(f"{readme.name}:{number}: {block.language}: passed")
    except BlockError as error:
        sys.exit(f"{readme.name}:{number}: {error}")


if __name__ == "__main__":
    main()
