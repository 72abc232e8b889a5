# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Servers that are killed, cut off or full while a robot adds to their map, for scripts/bench_fleet."""

import csv
import math
import pathlib
import random
import subprocess
import time

from fleet_robots import percentile

SEED = 37
MAX_PAUSE_S = 2.5    # between faults
MAX_DEAD_S = 2
MAX_CUT_S = 12       # an answer is awaited for 10 s
MAX_FULL_S = 5
POLL_S = 0.02
GIVEN_UP_S = 60
NEAR_M = 25
NEAR_DEG = 60


def rows_of(file):
    with pathlib.Path(file).open(newline="") as rows:
        return list(csv.DictReader(rows))


def loops_of(folder):
    """The matches of the frames that a run calls loops in the end."""
    loops = {row["frame"]: row["match"] for row in rows_of(folder / "loops.csv") if row["status"] == "loop"}
    for row in rows_of(folder / "late_loops.csv"):
        if row["kind"] == "late":
            loops[row["frame"]] = row["match"]
        else:
            loops.pop(row["frame"], None)
    return loops


def poses_of(file):
    """x, z and heading of each camera, from a file in KITTI's format."""
    for line in file.read_text().splitlines():
        numbers = list(map(float, line.split()))
        yield numbers[3], numbers[11], math.atan2(numbers[2], numbers[10])


class Town:
    """A map with one session, of which each run gets a copy, and what a run says that nothing disturbs. Every
    other run has the session on a second server, which it only reads."""

    def __init__(self, server, second, loopbit, first, images, laps, poses, folder):
        """`first`: a map file with the session. `images`: of the next one, again and again. `poses`: of both."""
        self.server, self.second, self.loopbit, self.folder = server, second, loopbit, folder
        for each, name in (server, "faultless"), (server, "empty"), (second, "first"):
            each.sql("postgres", f"CREATE DATABASE {name}")
            loopbit("map", "create", each.address(name), "--first-session", 2 if name == "empty" else 1)
            if name != "empty":
                loopbit("map", "merge", each.address(name), first)
        self.images = folder / "drive.txt"
        self.poses = list(poses_of(poses))
        self.lap = len(list(images.iterdir()))
        self.images.write_text("".join(f"{image.resolve()}\n" for image in laps * sorted(images.iterdir())))
        undisturbed = folder / "undisturbed"
        with self.run("undisturbed", undisturbed, False) as run:
            if run.wait():
                raise SystemExit("The undisturbed run failed.")
        self.loops = loops_of(undisturbed)

    def run(self, name, out, on_two):
        template = "empty" if on_two else "faultless"
        self.server.sql("postgres", f"CREATE DATABASE {name} TEMPLATE {template} STRATEGY FILE_COPY")
        addresses = [self.server.address(name)] + on_two * [self.second.address("first")]
        return subprocess.Popen([self.loopbit.program, "run", self.images, "--map", " ".join(addresses), "--out", out,
                                 "--no-report", "--quiet"], stderr=subprocess.DEVNULL)

    def pose(self, place):
        """Of a place as loops.csv names it."""
        session, _, frame = place.rpartition(":")
        first = len(self.poses) - self.lap
        return self.poses[int(frame) if session == "1" else first + int(frame) % self.lap]

    def is_wrong(self, frame, match):
        """A loop, by the rules of the world's not_false.csv."""
        (x, z, heading), (match_x, match_z, match_heading) = self.pose(frame), self.pose(match)
        turn = abs(math.remainder(heading - match_heading, 2 * math.pi))
        return math.hypot(x - match_x, z - match_z) > NEAR_M or turn > math.radians(NEAR_DEG)

    def places(self, name):
        """Of both servers, as loops.csv names them."""
        query = "SELECT CASE session WHEN 1 THEN '1:' ELSE '' END || frame FROM loopbit.place"
        return set(self.server.sql(name, query).split() + self.second.sql("first", query).split())

    def saved_frames(self, name):
        return int(self.server.sql(name, "SELECT coalesce(max(frames), 0) FROM loopbit.session WHERE session = 2"))


class Faults:
    """So many of each kind, in an order and at times that are always the same. Full disks are the first
    server's, since nothing is written to the second."""

    def __init__(self, town, numbers):
        self.town = town
        self.random = random.Random(SEED)
        self.kinds = [kind for kind, number in numbers.items() for _ in range(number)]
        self.random.shuffle(self.kinds)
        self.found = {"kills": numbers["kill"], "cuts": numbers["cut"], "full_disks": numbers["full"],
                      "second_server": 0, "fault_runs": 0, "fault_frames": 0, "merged_later": 0, "kill_lost": 0,
                      "wrong_answers": 0, "other_matches": 0, "missed_loops": 0}
        self.recovery_s = []

    def disturb(self, kind, server):
        """Returns when the server was there again."""
        if kind == "kill":
            server.kill()
            time.sleep(self.random.uniform(0, MAX_DEAD_S))
            server.start()
        elif kind == "cut":
            with server.frozen():
                time.sleep(self.random.uniform(0, MAX_CUT_S))
        else:
            with server.full():
                time.sleep(self.random.uniform(0, MAX_FULL_S))
        return time.monotonic()

    def wait_for_frames(self, name, number, run):
        """Whether the server got more than so many frames before the run ended."""
        give_up = time.monotonic() + GIVEN_UP_S
        while self.town.saved_frames(name) <= number:
            if run.poll() is not None:
                return False
            if time.monotonic() > give_up:
                raise SystemExit(f"'{name}' gets no frames.")
            time.sleep(POLL_S)
        return True

    def run(self):
        """Disturbs one run until it ends, and looks at what is left of it."""
        name = f"faults{self.found['fault_runs']}"
        out = self.town.folder / name
        on_two = self.found["fault_runs"] % 2 == 1
        with self.town.run(name, out, on_two) as run:
            goes_on = self.wait_for_frames(name, 0, run)
            while goes_on and self.kinds:
                time.sleep(self.random.uniform(0, MAX_PAUSE_S))
                if run.poll() is not None:
                    break
                before = self.town.saved_frames(name)
                kind = self.kinds.pop()
                is_first = not on_two or kind == "full" or self.random.random() < 0.5
                again = self.disturb(kind, self.town.server if is_first else self.town.second)
                goes_on = self.wait_for_frames(name, before, run)
                self.found["second_server"] += not is_first
                if goes_on and is_first:
                    self.recovery_s.append(time.monotonic() - again)
            if run.wait():
                raise SystemExit(f"A run failed: see {out}.")
        self.look_at(name, out)
        self.found["fault_runs"] += 1

    def look_at(self, name, out):
        town, found = self.town, self.found
        address = town.server.address(name)
        for queue in out.glob("queue*.db"):
            town.loopbit("map", "merge", address, queue)
            found["merged_later"] += 1
        town.loopbit("map", "check", address)
        given = {int(row["frame"]) for row in rows_of(out / "loops.csv")}
        saved = set(map(int, town.server.sql(name, "SELECT frame FROM loopbit.place WHERE session = 2").split()))
        found["fault_frames"] += len(given)
        found["kill_lost"] += len(given - saved)
        loops = loops_of(out)
        places = town.places(name)
        found["wrong_answers"] += sum(match not in places or town.is_wrong(frame, match)
                                      for frame, match in loops.items())
        found["other_matches"] += sum(town.loops.get(frame) != match for frame, match in loops.items())
        found["missed_loops"] += len(town.loops.keys() - loops.keys())
        town.server.sql("postgres", f"DROP DATABASE {name}")


def measure(town, numbers):
    """The fields of the faults' line, by name. `numbers`: of faults, by kind."""
    faults = Faults(town, numbers)
    while faults.kinds:
        faults.run()
    recovery = faults.recovery_s or [0]
    return {**faults.found, "recovery_p50_s": f"{percentile(recovery, 0.5):.2f}",
            "recovery_max_s": f"{max(recovery):.2f}"}
