# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""What the tests of the Python module share. LOOPBIT_COMMAND names the command to compare with, and
LOOPBIT_DATA the folder of real images; what needs one that is not set is skipped."""

import csv
import os
import pathlib
import subprocess

import numpy as np
import pytest

import loopbit

TIMES = ("content_ms", "retrieval_ms", "features_ms", "verification_ms")


@pytest.fixture(scope="session")
def command():
    """Calls the loopbit command, and returns what it printed."""
    path = os.environ.get("LOOPBIT_COMMAND")
    if not path:
        pytest.skip("LOOPBIT_COMMAND is not set")

    def call(*arguments):
        result = subprocess.run([path, *map(str, arguments)], stdin=subprocess.DEVNULL,
                                capture_output=True, text=True)
        assert result.returncode == 0, result.stderr
        return result.stdout

    return call


@pytest.fixture(scope="session")
def corridor():
    """The folder of the data set corridor_loop."""
    data = os.environ.get("LOOPBIT_DATA")
    if not data:
        pytest.skip("LOOPBIT_DATA is not set")
    return pathlib.Path(data) / "corridor_loop"


@pytest.fixture(scope="session")
def world():
    """Two laps through a small town, in pictures that are quick to draw."""
    return loopbit.World(loopbit.WorldOptions(frames=120, laps=2.0, spacing_m=1.9, width_px=320,
                                              height_px=240))


@pytest.fixture(scope="session")
def images(world):
    return [world.render(frame) for frame in range(len(world))]


@pytest.fixture(scope="session")
def dataset(world, tmp_path_factory):
    folder = tmp_path_factory.mktemp("dataset")
    world.write_dataset(folder)
    return folder


@pytest.fixture(scope="session")
def run(world, tmp_path_factory):
    positions = np.array([[*world.pose(frame)[:2], 0.0] for frame in range(len(world))])
    return loopbit.run_folder(world.source(), tmp_path_factory.mktemp("runs") / "run",
                              truth=world.truth(), positions_m=positions)


def decisions(folder):
    """The rows of a run's loops.csv without the times, which differ from run to run."""
    with open(pathlib.Path(folder) / "loops.csv", newline="") as file:
        return [{k: v for k, v in row.items() if k not in TIMES} for row in csv.DictReader(file)]


def as_row(detection):
    """A detection as loops.csv has it, without the times."""
    earlier = detection.earlier_match
    match = f"{earlier.session}:{earlier.frame}" if earlier else detection.match
    return {
        "frame": str(detection.frame),
        "timestamp": "" if detection.timestamp_s is None else f"{detection.timestamp_s:.6f}",
        "status": detection.status.name,
        "match": "" if match is None else str(match),
        "score": repr(detection.score).removesuffix(".0"),
        "similarity": f"{detection.similarity:.6f}",
        "matches": str(detection.matches),
        "inliers": str(detection.inliers),
    }
