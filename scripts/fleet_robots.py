# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Robots that add to one map at the same time, for scripts/bench_fleet."""

import bisect
import csv
import itertools
import math
import subprocess
import time

RATE_HZ = 30
# A place that comes later may be seen by nobody before the drive ends.
UNSEEN_S = 3
START_S = 4


def percentile(values, fraction):
    """NaN if there are none."""
    return sorted(values)[round(fraction * (len(values) - 1))] if values else math.nan


def drive(program, views, map_path_of, robots, frames, folder):
    """The rows that each robot wrote; see bench/bench_robot.cpp."""
    begin = time.monotonic() + START_S
    files = [folder / f"robot{number}.csv" for number in range(robots)]
    running = [subprocess.Popen(list(map(str, (program, views, number * 37, map_path_of(number), begin, frames,
                                               RATE_HZ, file)))) for number, file in enumerate(files)]
    if any([robot.wait() for robot in running]):
        raise SystemExit("bench_robot failed.")
    for file in files:
        with file.open(newline="") as rows:
            yield [{name: float(value) for name, value in row.items()} for row in csv.DictReader(rows)]


def delays_ms(driven, epochs):
    """From the arrival of a frame until each other robot has its place in its index. `epochs`: by session and
    frame, when it was committed."""
    end = driven[0][-1]["arrival_s"] - UNSEEN_S
    for writer, reader in itertools.permutations(driven, 2):
        known = [row["epoch"] for row in reader]
        for row in writer:
            if row["arrival_s"] > end:
                break
            seen = bisect.bisect_left(known, epochs.get((int(row["session"]), int(row["frame"])), float("inf")))
            done = reader[seen]["done_s"] if seen < len(reader) else float("inf")
            yield 1e3 * (done - row["arrival_s"])


def frame_ms(driven):
    times = [1e3 * (row["done_s"] - row["start_s"] - row["retrieval_s"]) for rows in driven for row in rows]
    return sum(times) / len(times)


def measure(server, loopbit, program, views, robots, seconds, folder):
    """The fields of the robots' line, by name."""
    server.sql("postgres", "CREATE DATABASE robots")
    address = server.address("robots")
    loopbit("map", "create", address)
    frames = seconds * RATE_HZ
    with_files = list(drive(program, views, lambda number: folder / f"robot{number}.db", robots,
                            min(frames, 10 * RATE_HZ), folder))
    driven = list(drive(program, views, lambda number: address, robots, frames, folder))
    stored = server.sql("robots", "SELECT session, frame, epoch FROM loopbit.place JOIN loopbit.batch USING (batch)")
    epochs = {}
    for line in stored.splitlines():
        session, frame, epoch = map(int, line.split("|"))
        epochs[session, frame] = epoch
    given = {(int(row["session"]), int(row["frame"])) for rows in driven for row in rows}
    loopbit("map", "check", address)
    late = [1e3 * (row["start_s"] - row["arrival_s"]) for rows in driven for row in rows]
    visible = list(delays_ms(driven, epochs))
    return {"writers": robots, "writers_frames": len(given), "writers_lost": len(given - epochs.keys()),
            "visible_p50_ms": f"{percentile(visible, 0.5):.0f}", "visible_p99_ms": f"{percentile(visible, 0.99):.0f}",
            "visible_max_ms": f"{percentile(visible, 1):.0f}", "writers_late_p99_ms": f"{percentile(late, 0.99):.1f}",
            "writers_file_ms": f"{frame_ms(with_files):.2f}", "writers_server_ms": f"{frame_ms(driven):.2f}"}
