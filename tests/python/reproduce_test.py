# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""scripts/reproduce, on small folders of our own in the layout of the public data sets."""

import json
import pathlib
import shutil
import struct
import subprocess
import sys

import pytest

SCRIPT = pathlib.Path(__file__).resolve().parent.parent.parent / "scripts/reproduce"


def write_mat(path, size, cells):
    """A MAT-file of version 5 with one matrix of bytes, `cells` of which are 1."""
    def element(kind, data):
        return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)

    dense = bytearray(size * size)
    for row, column in cells:
        dense[column * size + row] = 1
    matrix = (element(6, struct.pack("<II", 9, 0)) + element(5, struct.pack("<ii", size, size))
              + element(1, b"truth") + element(2, bytes(dense)))
    header = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM"
    path.write_bytes(header + element(14, matrix))


@pytest.fixture
def data(dataset, tmp_path):
    """KITTI 00 and City Centre."""
    images = sorted((dataset / "images").iterdir())[:12]
    kitti = tmp_path / "data/dataset/sequences/00"
    (kitti / "image_0").mkdir(parents=True)
    for image in images:
        shutil.copy(image, kitti / "image_0")
    (kitti / "times.txt").write_text("".join(f"{0.1 * i}\n" for i in range(len(images))))
    poses = tmp_path / "data/dataset/poses"
    poses.mkdir()
    rows = (dataset / "poses.txt").read_text().splitlines(keepends=True)
    (poses / "00.txt").write_text("".join(rows[:12]))
    city = tmp_path / "data/City_Centre"
    (city / "Images").mkdir(parents=True)
    for number, image in enumerate(images + images):
        shutil.copy(image, city / "Images" / f"{number + 1:04}.png")
    write_mat(city / "CityCentreGroundTruth.mat", 24, [(12, 0), (23, 11)])
    return tmp_path / "data"


def reproduce(data, out):
    return subprocess.run([sys.executable, SCRIPT, data, "--out", out], stdin=subprocess.DEVNULL,
                          capture_output=True, text=True)


def record(out, name):
    return json.loads((out / name / "run.json").read_text())


def test_the_tables_of_the_paper(data, tmp_path):
    ran = reproduce(data, tmp_path / "out")
    assert ran.returncode == 0, ran.stderr
    lines = {line[:12].strip(): line.split() for line in ran.stdout.splitlines()}
    assert lines["KITTI 00"][-4:] == ["54.9", "130", "32.2", "57.2"]
    assert lines["City Centre"][-4:] == ["27.7", "86", "-", "-"]
    left_out = ran.stdout[ran.stdout.index("Not found"):].splitlines()[1:]
    assert left_out == ["  KITTI 02", "  KITTI 05", "  New College"]
    city = record(tmp_path / "out", "citycentre")
    assert (city["counts"]["frames"], city["score"]["positives"]) == (24, 2)
    assert record(tmp_path / "out", "kitti00")["score"]["protocol"] == "kitti"


@pytest.mark.parametrize("rows, frames, every", [(12, 12, 2), (24, 24, 1)])
def test_a_matrix_may_be_of_the_left_images_only(data, tmp_path, rows, frames, every):
    write_mat(data / "City_Centre/CityCentreGroundTruth.mat", rows, [(11, 0)])
    ran = reproduce(data, tmp_path / "out")
    assert ran.returncode == 0, ran.stderr
    city = record(tmp_path / "out", "citycentre")
    assert (city["counts"]["frames"], city["input"]["every"]) == (frames, every)
    assert city["score"]["positives"] == 1


def test_a_sequence_of_which_only_poses_are_there_is_left_out(data, tmp_path):
    sequence = data / "dataset/sequences/02"
    sequence.mkdir()
    (sequence / "times.txt").write_text("0.0\n")
    shutil.copy(data / "dataset/poses/00.txt", data / "dataset/poses/02.txt")
    ran = reproduce(data, tmp_path / "out")
    assert ran.returncode == 0, ran.stderr
    assert "KITTI 02" in ran.stdout[ran.stdout.index("Not found"):]


def test_a_set_that_fails_leaves_the_others(data, tmp_path):
    (data / "City_Centre/CityCentreGroundTruth.mat").write_bytes(b"no matrix")
    ran = reproduce(data, tmp_path / "out")
    assert ran.returncode == 1 and "CityCentreGroundTruth.mat" in ran.stderr
    assert "KITTI 00" in ran.stdout


def test_no_public_data_at_all(tmp_path):
    (tmp_path / "empty").mkdir()
    ran = reproduce(tmp_path / "empty", tmp_path / "out")
    assert ran.returncode == 1 and "none of the paper's data sets" in ran.stderr
