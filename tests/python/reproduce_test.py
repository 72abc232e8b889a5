# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""scripts/reproduce, on made-up data in the layout of the paper's data sets."""

import json
import pathlib
import shutil
import subprocess
import sys

import pytest

TESTS = pathlib.Path(__file__).resolve().parent.parent
SCRIPT = TESTS.parent / "scripts" / "reproduce"
sys.path.append(str(TESTS))
from mat_file import write_mat  # noqa: E402, of the tests of the command


@pytest.fixture
def data(dataset, tmp_path):
    """KITTI 00 and City Centre."""
    folder = tmp_path / "data"
    images = sorted((dataset / "images").iterdir())[:12]
    kitti = folder / "dataset" / "sequences" / "00"
    (kitti / "image_0").mkdir(parents=True)
    for image in images:
        shutil.copy(image, kitti / "image_0")
    (kitti / "times.txt").write_text("".join(f"{0.1 * i}\n" for i in range(len(images))))
    poses = (dataset / "poses.txt").read_text().splitlines(keepends=True)
    (folder / "dataset" / "poses").mkdir()
    (folder / "dataset" / "poses" / "00.txt").write_text("".join(poses[:len(images)]))
    city = folder / "City_Centre"
    (city / "Images").mkdir(parents=True)
    for number, image in enumerate(images + images):
        shutil.copy(image, city / "Images" / f"{number + 1:04}.png")
    write_mat(city / "CityCentreGroundTruth.mat", "truth", 24, [(12, 0), (23, 11)])
    return folder


def reproduce(data, out):
    return subprocess.run([sys.executable, SCRIPT, data, "--out", out], capture_output=True, text=True)


def record(run):
    return json.loads((run / "run.json").read_text())


def test_prints_the_papers_table_for_the_sets_there_are(data, tmp_path):
    ran = reproduce(data, tmp_path / "out")
    assert ran.returncode == 0, ran.stderr
    table = ran.stdout[ran.stdout.index("Recall in percent"):]
    lines = {line.split("  ")[0]: line.split() for line in table.splitlines()}
    assert lines["KITTI 00"][-4:] == ["54.9", "130", "32.2", "57.2"]
    assert lines["City Centre"][-4:] == ["27.7", "86", "-", "-"]
    skipped = table[table.index("Not found"):].split("\n")[1:]
    assert skipped == ["  KITTI 02", "  KITTI 05", "  New College", ""]
    city = record(tmp_path / "out" / "citycentre")
    assert city["counts"]["frames"] == 24 and city["score"]["positives"] == 2
    assert record(tmp_path / "out" / "kitti00")["score"]["protocol"] == "kitti"
    assert (tmp_path / "out" / "kitti00" / "report.html").exists()


@pytest.mark.parametrize("rows, frames", [(12, 12), (24, 24)])
def test_a_matrix_of_left_images_takes_every_other_image(data, tmp_path, rows, frames):
    write_mat(data / "City_Centre" / "CityCentreGroundTruth.mat", "truth", rows, [(11, 0)])
    ran = reproduce(data, tmp_path / "out")
    assert ran.returncode == 0, ran.stderr
    assert record(tmp_path / "out" / "citycentre")["counts"]["frames"] == frames


def test_a_sequence_without_images_is_skipped(data, tmp_path):
    sequence = data / "dataset" / "sequences" / "02"
    sequence.mkdir()
    (sequence / "times.txt").write_text("0.0\n")
    (sequence / "calib.txt").write_text("P0:\n")
    shutil.copy(data / "dataset" / "poses" / "00.txt", data / "dataset" / "poses" / "02.txt")
    ran = reproduce(data, tmp_path / "out")
    assert ran.returncode == 0, ran.stderr
    assert "KITTI 02" in ran.stdout[ran.stdout.index("Not found"):]


def test_sets_before_one_that_fails_are_printed(data, tmp_path):
    write_mat(data / "City_Centre" / "CityCentreGroundTruth.mat", "truth", 5, [(3, 0)])
    ran = reproduce(data, tmp_path / "out")
    assert ran.returncode == 1 and "CityCentreGroundTruth.mat" in ran.stderr
    assert "KITTI 00" in ran.stdout[ran.stdout.index("Recall in percent"):]


def test_no_data_set_at_all(tmp_path):
    ran = reproduce(tmp_path, tmp_path / "out")
    assert ran.returncode == 1 and str(tmp_path) in ran.stderr and "--help" in ran.stderr
