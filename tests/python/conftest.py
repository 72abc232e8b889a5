# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""What the tests of the Python module share. LOOPBIT_COMMAND names the command to compare with, and
LOOPBIT_DATA the folder of real images; what needs one that is not set is skipped."""

import csv
import os
import pathlib
import sys

import pytest

import loopbit

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1]))
from served_command import run_command  # noqa: E402

TIMES = ("content_ms", "retrieval_ms", "features_ms", "verification_ms")


@pytest.fixture(scope="session")
def command():
    """Calls the loopbit command, and returns what it printed."""
    path = os.environ.get("LOOPBIT_COMMAND")
    if not path:
        pytest.skip("LOOPBIT_COMMAND is not set")

    def call(*arguments):
        result = run_command(path, *arguments)
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
def dataset(command, tmp_path_factory):
    """Two laps through a small built-in town: 120 images, their times, poses and truth."""
    folder = tmp_path_factory.mktemp("town") / "dataset"
    command("demo", "--frames", 120, "--world", "laps=2", "--world", "spacing_m=1.9", "--world",
            "width_px=320", "--world", "height_px=240", "--write-images", folder)
    return folder


@pytest.fixture(scope="session")
def images(dataset):
    return [frame.image for frame in loopbit.open_source(dataset / "images")]


@pytest.fixture(scope="session")
def truth(dataset):
    return loopbit.read_truth(dataset / "truth.csv", not_false=dataset / "not_false.csv")


@pytest.fixture(scope="session")
def positions(dataset):
    return loopbit.read_positions(dataset / "poses.txt", [None] * 120)


@pytest.fixture(scope="session")
def run(dataset, truth, positions, tmp_path_factory):
    """A run of the data set with times, in the layout of KITTI."""
    sequence = tmp_path_factory.mktemp("kitti")
    (sequence / "image_0").symlink_to(dataset / "images")
    (sequence / "times.txt").symlink_to(dataset / "times.txt")
    return loopbit.run_folder(sequence, tmp_path_factory.mktemp("runs") / "run", truth=truth,
                              positions_m=positions)


def decisions(folder):
    """The rows of a run's loops.csv without times, which differ from run to run, and names."""
    with open(pathlib.Path(folder) / "loops.csv", newline="") as file:
        left_out = (*TIMES, "name", "match_name")
        return [{k: v for k, v in row.items() if k not in left_out} for row in csv.DictReader(file)]


def as_row(detection):
    """A detection as loops.csv has it, without times and names."""
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
        **{name: "" if detection.terms is None else f"{getattr(detection.terms, name):.3f}"
           for name in ("votes", "geometry", "path", "rivals", "prior")},
    }
