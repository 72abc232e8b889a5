#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Kills programs that write maps, and looks for what was acknowledged.

    map_crash_test.py MAP_CRASH LOOPBIT KILLS [SEED]

Each time a writer (see map_crash.cpp) is killed by SIGKILL at a random moment, and the map must
hold every frame of every session that a writer had said is saved, all of it true. Every third time
'loopbit map merge' or 'map compact' is killed on a copy as well, which must leave the map as it was
or as it was to be.
"""

import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

KILLS_A_MAP = 12
MAX_DELAY_S = 0.25


def kill_after(command, delay_s):
    """Runs a command for a while, kills it, and returns the whole lines it printed."""
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.DEVNULL, text=True) as process:
        time.sleep(delay_s)
        process.send_signal(signal.SIGKILL)
        text = process.communicate()[0]
    return text[:text.rfind("\n") + 1].splitlines()


class CrashTest:
    def __init__(self, map_crash, loopbit, folder, seed):
        self.map_crash, self.loopbit = map_crash, loopbit
        self.folder = folder
        self.random = random.Random(seed)
        self.kills = self.lost = self.frames = 0

    def places(self, path):
        """Places by session; fails where one is not what was written."""
        if not path.exists() or path.stat().st_size == 0:
            return {}  # killed before it was made
        result = subprocess.run([self.map_crash, "verify", path], capture_output=True, text=True)
        # A map that was just begun may have no table yet.
        if result.returncode == 3 and "is empty" in result.stderr:
            return {}
        if result.returncode != 0:
            sys.exit(f"after {self.kills} kills: {path}: {result.stdout}{result.stderr}")
        return {int(s): int(n) for s, n in (line.split() for line in result.stdout.splitlines())}

    def kill_writer(self, path, saved):
        for line in kill_after([self.map_crash, "write", path], self.delay_s()):
            session, frames = map(int, line.split())
            saved[session] = frames
        self.kills += 1
        found = self.places(path)
        for session, frames in saved.items():
            self.lost += max(0, frames - found.get(session, 0))
        self.frames = max(self.frames, sum(found.values()))
        return found

    def kill_tool(self, path, found):
        copy = self.folder / "copy.db"
        for file in self.folder.glob("copy.db*"):
            file.unlink()
        if self.random.random() < 0.5:
            command, after = ["merge", copy, path], found
            before = {}
        else:
            shutil.copy(path, copy)
            before, after = found, {s: n for s, n in found.items() if s != min(found)}
            command = ["compact", copy, "--drop", str(min(found))]
        kill_after([self.loopbit, "map", *command], self.delay_s())
        self.kills += 1
        left = self.places(copy)
        # Merging gives sessions numbers of its own.
        if sorted(left.values()) not in (sorted(before.values()), sorted(after.values())):
            sys.exit(f"map {command[0]} left {left} of {before}, which was to be {after}")

    def delay_s(self):
        return self.random.uniform(0, MAX_DELAY_S)

    def run(self, kills):
        number = 0
        while self.kills < kills:
            path = self.folder / f"{number}.db"
            saved = {}
            for _ in range(KILLS_A_MAP):
                if self.kills >= kills:
                    break
                found = self.kill_writer(path, saved)
                if self.kills % 3 == 0 and found:
                    # Takes in the log first, so that the file alone is the map.
                    subprocess.run([self.loopbit, "map", "compact", path, "--budget", "2000000000"],
                                   check=True, stdout=subprocess.DEVNULL)
                    self.kill_tool(path, found)
            path.unlink(missing_ok=True)
            number += 1
        print(f"kills={self.kills} maps={number} largest_map={self.frames} frames_lost={self.lost}")
        return 0 if self.lost == 0 else 1


def main():
    if len(sys.argv) not in (4, 5):
        sys.exit(__doc__)
    map_crash, loopbit = (pathlib.Path(path).resolve() for path in sys.argv[1:3])
    seed = int(sys.argv[4]) if len(sys.argv) > 4 else 2019
    with tempfile.TemporaryDirectory(prefix="loopbit_crash_") as folder:
        return CrashTest(map_crash, loopbit, pathlib.Path(folder), seed).run(int(sys.argv[3]))


if __name__ == "__main__":
    sys.exit(main())
