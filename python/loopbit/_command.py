# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""The command of a package that pip installed."""

import os
import pathlib
import sys


def main() -> None:
    command = pathlib.Path(__file__).parent / "bin/loopbit"
    os.execv(command, ["loopbit", *sys.argv[1:]])
