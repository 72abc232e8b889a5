# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""The file of --mcap-out, read back by Foxglove's library. Run by run.sh."""

import base64
import csv
import io
import json
import os
import pathlib
import resource
import subprocess

import pytest
from PIL import Image

from recordings_test import LOOPBIT, loopbit_command

HERE = pathlib.Path(__file__).resolve().parent
TOWN = ["--frames", "110", "--world", "laps=2", "--world", "spacing_m=2.1",
        "--world", "width_px=320", "--world", "height_px=240"]


def read_back(file):
    ran = subprocess.run(["node", HERE / "read_mcap.mjs", os.environ["LOOPBIT_NODE_MODULES"], file],
                         capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)


def on(read, topic):
    return [each["message"] for each in read["messages"] if each["topic"] == f"/loopbit/{topic}"]


def rows_of(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def walk(folder, *world):
    """A run in the built-in world, with poses, truth and times, and its MCAP file, which lies in
    the folder that the run makes."""
    run = folder / "run"
    loopbit_command("demo", *TOWN, *world, "--out", run, "--mcap-out", run / "out.mcap")
    return folder, read_back(run / "out.mcap"), rows_of(run / "loops.csv")


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    return walk(tmp_path_factory.mktemp("town"))


@pytest.fixture(scope="module")
def twins(tmp_path_factory):
    """Houses that look alike: some loops are found late, and some are withdrawn."""
    return walk(tmp_path_factory.mktemp("twins"), "--seed", "23", "--world", "look_alike=1")


def test_detections_are_those_of_loops_csv(town):
    _, read, rows = town
    detections = on(read, "detection")
    assert len(detections) == len(rows)
    for detection, row in zip(detections, rows):
        assert detection["status"] == row["status"]
        assert detection["is_loop"] == (row["status"] == "loop")
        assert detection["score"] == pytest.approx(float(row["score"]), abs=1e-6)
        assert detection["inliers"] == int(row["inliers"])
        for name, term in detection.get("terms", {}).items():
            assert term == pytest.approx(float(row[name]), abs=1e-3)
        assert ("terms" in detection) == (row["match"] != "")
        assert str(detection.get("match", "")) == row["match"]
    times = [int(each["time_ns"]) for each in read["messages"]]
    assert times == sorted(times)


def shown_loops(scenes):
    """What the viewer draws at the end: the ends of each loop's line."""
    shown = {}
    for scene in scenes:
        for deletion in scene["deletions"]:
            del shown[deletion["id"]]  # fails if nothing is shown by this name
        for entity in scene["entities"]:
            if entity["id"].startswith("loop "):
                shown[entity["id"]] = [[point[axis] for axis in "xyz"] for point in entity["lines"][0]["points"]]
    return shown


def changes_of(folder, kind):
    rows = rows_of(folder / "run/late_loops.csv")
    return [(row["frame"], row["match"]) for row in rows if row["kind"] == kind]


@pytest.mark.parametrize("run", ["town", "twins"])
def test_each_loop_is_a_line_between_its_places(run, request):
    folder, read, rows = request.getfixturevalue(run)
    places = {row["frame"]: [float(row[axis]) for axis in ("x_m", "y_m", "z_m")]
              for row in rows_of(folder / "run/positions.csv")}
    loops = {row["frame"]: row["match"] for row in rows if row["status"] == "loop"}
    assert len(loops) > 20
    for change in rows_of(folder / "run/late_loops.csv"):
        if change["kind"] == "withdrawn":
            del loops[change["frame"]]
        else:
            loops[change["frame"]] = change["match"]
    assert shown_loops(on(read, "scene")) == {
        f"loop {frame}": [pytest.approx(places[frame]), pytest.approx(places[match])]
        for frame, match in loops.items()}


def test_detections_tell_what_changed_of_earlier_frames(twins):
    folder, read, _ = twins
    for kind in ("late", "withdrawn"):
        told = [(str(loop["frame"]), str(loop["match"]))
                for detection in on(read, "detection") for loop in detection[f"{kind}_loops"]]
        assert told == changes_of(folder, kind) != []


def test_the_path_is_drawn_in_stretches(town):
    _, read, rows = town
    path = {entity["id"]: entity["lines"][0]["points"] for scene in on(read, "scene")
            for entity in scene["entities"] if entity["id"].startswith("path ")}
    # Stretches share their ends.
    assert sum(map(len, path.values())) == len(rows) + len(path) - 1


def test_pictures_are_the_frame_and_its_match(town):
    _, read, rows = town
    queries, matches = on(read, "query"), on(read, "match")
    assert len(queries) == len(rows)
    loops = [row for row in rows if row["status"] == "loop"]
    assert [message["data"] for message in matches] == [
        queries[int(row["match"])]["data"] for row in loops]
    assert Image.open(io.BytesIO(base64.b64decode(queries[0]["data"]))).size == (256, 192)


def test_without_pictures_and_poses(tmp_path, monkeypatch):
    loopbit_command("demo", *TOWN, "--write-images", tmp_path / "town")
    monkeypatch.chdir(tmp_path)
    loopbit_command("run", tmp_path / "town/images", "--limit", "30", "--out", tmp_path / "run",
                    "--no-report", "--mcap-out", "out.mcap")
    read = read_back(tmp_path / "out.mcap")
    assert on(read, "query") == [] and len(on(read, "detection")) == 30
    path = on(read, "scene")[-1]["entities"][0]["lines"][0]["points"]
    assert len({(point["x"], point["y"]) for point in path}) == 30  # on a ring


@pytest.mark.parametrize("out", ["/dev/full", "out.mcap"])
def test_full_disk_is_one_clear_error_and_keeps_the_earlier_file(out, tmp_path):
    out = tmp_path / out
    is_device = out == pathlib.Path("/dev/full")
    if not is_device:
        out.write_text("earlier")

    def limit_files():
        if not is_device:  # to more than any other file of the run has
            resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))

    ran = subprocess.run([LOOPBIT, "demo", *TOWN, "--out", tmp_path / "run", "--no-report",
                          "--mcap-out", out],
                         preexec_fn=limit_files, capture_output=True, text=True)
    assert ran.returncode == 4, ran.stderr
    reason = "No space left on device" if is_device else "File too large"
    assert [line for line in ran.stderr.splitlines() if "Cannot write" in line] == [
        f"loopbit: Cannot write '{out}': {reason}; check the folder, its permissions and the free space."]
    if not is_device:
        assert out.read_text() == "earlier"
    assert list(out.parent.glob("*.part")) == []


def test_impossible_files_are_refused_before_the_run(tmp_path):
    images = tmp_path / "images.txt"
    images.write_text("1.png\n")
    for arguments, code, text in [
            (["run", images, "--mcap-out", images], 2, "would replace what INPUT"),
            (["demo", *TOWN, "--out", tmp_path / "run", "--mcap-out", tmp_path / "none/out.mcap"], 4,
             "No such file or directory"),
            (["run", images, "--map", tmp_path / "map.db", "--mcap-out", tmp_path / "none/out.mcap"], 4,
             "No such file or directory"),
            (["demo", *TOWN, "--out", tmp_path / "run", "--mcap-out", tmp_path], 4, "Is a directory")]:
        ran = loopbit_command(*arguments, code=code)
        assert text in ran.stderr
    assert not (tmp_path / "run").exists()
