#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""The loopbit command as a user meets it: what it writes, says and exits with."""

import contextlib
import csv
import fcntl
import json
import math
import os
import pathlib
import pty
import re
import resource
import shutil
import signal
import sqlite3
import statistics
import struct
import subprocess
import tempfile
import termios
import time
import unittest
import zlib

from loopbit_command import (FRAMES, LOOPBIT, QUICK, WORLD, CommandTest, complaints, decisions,
                             loopbit, repeats_when_sanitized, rows)
from served_command import TIME_LIMIT_S

HEADER = (
    "frame,timestamp,status,match,score,similarity,matches,inliers,"
    "votes,geometry,path,rivals,prior,name,match_name,"
    "content_ms,retrieval_ms,features_ms,verification_ms"
)


def pose_rows(folder):
    with open(folder / "relative_poses.csv", newline="") as file:
        return list(csv.DictReader(file))


def late_rows(folder):
    with open(folder / "late_loops.csv", newline="") as file:
        return list(csv.DictReader(file))


def rotation_error_deg(row, truth):
    """Angle between the rotation of a row and that of `truth`, camera-to-world rows of 3 x 4."""
    match, query = truth[int(row["match"])], truth[int(row["query"])]
    true = [[sum(match[4 * k + i] * query[4 * k + j] for k in range(3)) for j in range(3)]
            for i in range(3)]
    x, y, z, w = (float(row[name]) for name in ("qx", "qy", "qz", "qw"))
    found = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
             [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
             [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    trace = sum(true[i][j] * found[i][j] for i in range(3) for j in range(3))
    return math.degrees(math.acos(max(-1.0, min(1.0, (trace - 1) / 2))))


def motion_jpeg(jpegs):
    """The bytes of a video, 256 x 192 px at 10 Hz."""
    def chunk(name, *parts):
        data = b"".join(parts)
        return name + struct.pack("<I", len(data)) + data + bytes(len(data) % 2)

    header = struct.pack("<14I", 100000, 0, 0, 0, len(jpegs), 0, 1, 0, 256, 192, 0, 0, 0, 0)
    stream = b"vidsMJPG" + struct.pack("<IHH8I4H", 0, 0, 0, 0, 1, 10, 0, len(jpegs), 0, 0xFFFFFFFF, 0,
                                       0, 0, 256, 192)
    picture = struct.pack("<IiiHH4sIiiII", 40, 256, 192, 1, 24, b"MJPG", 147456, 0, 0, 0, 0)
    headers = chunk(b"LIST", b"hdrl", chunk(b"avih", header),
                    chunk(b"LIST", b"strl", chunk(b"strh", stream), chunk(b"strf", picture)))
    movie = chunk(b"LIST", b"movi", *(chunk(b"00dc", jpeg) for jpeg in jpegs))
    return chunk(b"RIFF", b"AVI ", headers, movie)


class CommandLineTest(CommandTest):
    # Relative poses.

    def camera_for(self, width_px):
        """A calibration that differs from that of the world in the width of its images."""
        camera = self.scratch / "camera.yaml"
        text = (self.dataset / "camera.yaml").read_text()
        camera.write_text(re.sub("image_width: 320", f"image_width: {width_px}", text))
        return camera

    @repeats_when_sanitized
    def test_a_camera_gives_each_loop_a_row(self):
        camera = self.dataset / "camera.yaml"
        ran = loopbit("run", self.images, "--out", self.out, "--camera", camera, "--no-report")
        self.assertEqual((ran.returncode, complaints(ran)), (0, []))
        self.assertIn(f"{self.out}/relative_poses.csv, with {camera}", ran.stdout)
        self.assertEqual(decisions(self.out), decisions(self.reference))  # only a fisheye counts
        loops = [row for row in rows(self.out) if row["status"] == "loop"]
        loops += [row for row in late_rows(self.out) if row["kind"] == "late"]
        poses = pose_rows(self.out)
        self.assertEqual(sorted((row["query"], row["match"]) for row in poses),
                         sorted((row["frame"], row["match"]) for row in loops))
        for row in poses:
            self.assertEqual(len(row), 16 + 21)
            is_known = row["known"] != "nothing"
            for name in ("x", "qw", "rms_px", "cov_x_x", "cov_rz_rz"):
                self.assertEqual(row[name] != "", is_known, row)
        record = json.loads((self.out / "run.json").read_text())
        self.assertEqual(record["camera"], str(camera))

    def test_a_camera_gives_a_recognised_image_its_pose(self):
        town = self.scratch / "town.db"
        first = self.images / "000000.png"
        self.assertEqual(loopbit("run", self.images, "--map", town, "--limit", "30", "--no-poses").returncode, 0)
        camera = self.dataset / "camera.yaml"
        ran = loopbit("query", town, first, "--camera", camera, "--json")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        pose = json.loads(ran.stdout)["relative_pose"]
        self.assertEqual((pose["status"], pose["known"]), ("pure_rotation", "rotation"))  # the same image
        masked = loopbit("query", town, first, "--camera", camera, "--mask", self.mask(dark_rows=80), "--json")
        self.assertLess(json.loads(masked.stdout)["relative_pose"]["matches"], pose["matches"])
        for row in range(4):
            for column in range(4):
                self.assertAlmostEqual(pose["T_match_query"][row][column], float(row == column), places=3)
        self.assertEqual([len(row) for row in pose["covariance"]], [6] * 6)
        self.assertIn("relative pose: pure_rotation, rotation, x y z qx qy qz qw 0 0 0",
                      loopbit("query", town, first, "--camera", camera).stdout)
        self.assertNotIn("relative_pose", loopbit("query", town, first, "--json").stdout)
        ran = loopbit("query", town, first, "--camera", self.camera_for(640))
        self.assertEqual(ran.returncode, 3)
        self.assertIn("640", ran.stderr)

    @unittest.skipIf(QUICK, "too few frames")
    def test_relative_poses_have_the_rotations_of_the_truth(self):
        ran = loopbit("run", self.images, "--out", self.out, "--no-report",
                      "--camera", self.dataset / "camera.yaml")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        truth = [[float(number) for number in line.split()]
                 for line in (self.dataset / "poses.txt").read_text().splitlines()]
        errors_deg = [rotation_error_deg(row, truth) for row in pose_rows(self.out)
                      if row["known"] != "nothing"]
        self.assertGreater(len(errors_deg), 20)
        self.assertLess(statistics.median(errors_deg), 0.5)
        self.assertLess(statistics.quantiles(errors_deg, n=10)[-1], 1.5)

    def test_a_map_has_the_features_for_poses_of_earlier_sessions(self):
        for session in (1, 2):
            ran = loopbit("run", self.images, "--out", self.scratch / str(session), "--limit", 10,
                          "--map", self.scratch / "town.db", "--no-report",
                          "--camera", self.dataset / "camera.yaml")
            self.assertEqual(ran.returncode, 0, ran.stderr)
        poses = pose_rows(self.scratch / "2")
        self.assertGreater(len(poses), 0)
        for row in poses:
            self.assertRegex(row["match"], r"^1:\d+$")
        self.assertEqual((self.scratch / "2" / "relative_poses.g2o").read_text(), "")

    def test_a_camera_that_does_not_fit_is_refused(self):
        camera = self.camera_for(width_px=640)
        ran = loopbit("run", self.few_images(), "--out", self.out, "--camera", camera)
        self.assert_fails(ran, 3, f"'{camera}' is for images of 640 x 240 px", "320 x 240")
        self.assertFalse(self.out.exists())

    # Masks.

    def mask(self, width=320, height=240, dark_rows=0, maximum=255):
        """A mask whose lowest rows are black."""
        bright = maximum.to_bytes(1 if maximum < 256 else 2, "big")
        file = self.scratch / f"mask_{width}_{dark_rows}_{maximum}.pgm"
        file.write_bytes(b"P5 %d %d %d " % (width, height, maximum) +
                         bright * (width * (height - dark_rows)) +
                         bytes(len(bright)) * (width * dark_rows))
        return file

    @repeats_when_sanitized
    def test_a_mask_leaves_out_a_part_of_all_images(self):
        run = ["run", self.images, "--out", self.out, "--no-report", "--overwrite"]
        self.assertEqual(loopbit(*run, "--mask", self.mask()).returncode, 0)
        self.assertEqual(decisions(self.out), decisions(self.reference))
        self.assertEqual(loopbit(*run, "--mask", self.mask(dark_rows=80)).returncode, 0)
        self.assertNotEqual(decisions(self.out), decisions(self.reference))

    def test_a_mask_that_does_not_fit_is_refused(self):
        images = self.few_images()
        for mask, parts in ((self.mask(width=640), ("640 x 240 px, but the images have 320 x 240",)),
                            (self.mask(maximum=65535), ("16 bits per pixel",)),
                            (self.mask(dark_rows=240), ("black everywhere", ".pgm'")),
                            (self.scratch / "no.png", ("no.png", "cannot be found"))):
            ran = loopbit("run", images, "--out", self.out, "--mask", mask)
            self.assert_fails(ran, 3, *parts)
        self.assertFalse(self.out.exists())

    @repeats_when_sanitized
    def test_a_query_takes_the_mask_of_its_map(self):
        town = self.scratch / "town.db"
        mask = self.mask(dark_rows=80)
        run = ["run", self.images, "--map", town, "--mask", mask, "--no-report", "--limit", 10]
        self.assertEqual(loopbit(*run).returncode, 0)
        image = sorted(self.images.iterdir())[4]
        ran = loopbit("query", town, image, "--json", "--mask", mask)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        place = json.loads(ran.stdout)["places"][0]
        self.assertEqual((place["frame"], place["similarity"]), (4, 1.0))
        ran = loopbit("query", town, image, "--json")
        self.assertLess(json.loads(ran.stdout)["places"][0]["similarity"], 1.0)
        ran = loopbit("query", town, image, "--mask", self.mask(width=640))
        self.assertIn("the mask has 640 x 240", ran.stderr)

    def test_a_camera_that_cannot_be_read_is_refused(self):
        missing = self.scratch / "missing.yaml"
        malformed = self.scratch / "malformed.yaml"
        malformed.write_text("image_width: 320\n")
        for camera in (missing, malformed):
            with self.subTest(camera.name):
                ran = loopbit("run", self.images, "--out", self.out, "--camera", camera)
                self.assert_fails(ran, 3, camera)
        self.assertFalse(self.out.exists())

    @repeats_when_sanitized
    def test_a_calibration_in_the_folder_is_found(self):
        images = self.few_images(3)
        run = ["run", images, "--out", self.out, "--no-report", "--overwrite"]
        shutil.copy(self.dataset / "camera.yaml", images)
        ran = loopbit(*run)
        self.assertEqual((ran.returncode, complaints(ran)), (0, []))
        self.assertIn(f"with {images / 'camera.yaml'}", ran.stdout)
        ran = loopbit(*run, "--no-poses")
        self.assertEqual((ran.returncode, complaints(ran)), (0, []))
        for name in ("relative_poses.csv", "relative_poses.g2o", "matched_poses.tum"):
            self.assertFalse((self.out / name).exists(), name)

    def test_a_found_calibration_that_does_not_fit_is_told_and_left_out(self):
        images = self.few_images(3)
        shutil.copy(self.camera_for(width_px=640), images)
        ran = loopbit("run", images, "--out", self.out, "--no-report")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertIn("loopbit: No relative poses: ", ran.stderr)
        self.assertEqual(len(rows(self.out)), 3)
        self.assertFalse((self.out / "relative_poses.csv").exists())

    # What a run leaves.

    def test_loops_csv_has_the_documented_header_and_a_row_a_frame(self):
        lines = (self.reference / "loops.csv").read_text().splitlines()
        self.assertEqual(lines[0], HEADER)
        self.assertEqual([row["frame"] for row in rows(self.reference)],
                         [str(n) for n in range(FRAMES)])

    def test_rows_explain_their_decision(self):
        options = json.loads((self.reference / "run.json").read_text())["options"]
        for row in rows(self.reference):
            accepted = float(row["score"]) >= options["decision"]["min_score"]
            self.assertEqual(row["status"] == "loop", accepted, row)
            self.assertEqual(row["match"] == "",
                             row["status"] in ("no_earlier_place", "no_similar_place"), row)
            self.assertGreaterEqual(int(row["matches"]), int(row["inliers"]))

    def test_late_loops_are_of_frames_that_were_none_and_truth_judges_both(self):
        # At a high threshold a path needs frames to become sure.
        ran = loopbit("run", self.images, "--out", self.out, "--no-report", "--set",
                      "decision.min_score=0.9999", "--truth", self.dataset / "truth.csv",
                      "--not-false", self.dataset / "not_false.csv")
        self.assertEqual((ran.returncode, complaints(ran)), (0, []))
        status = [row["status"] for row in rows(self.out)]
        late = [row for row in late_rows(self.out) if row["kind"] == "late"]
        for row in late:
            self.assertNotEqual(status[int(row["frame"])], "loop")
            self.assertLess(int(row["frame"]), int(row["reported_at"]))
            self.assertGreaterEqual(float(row["score"]), 0.9999)
        self.assertEqual(len({row["frame"] for row in late}), len(late))
        record = json.loads((self.out / "run.json").read_text())
        self.assertEqual(record["counts"]["late_loops"], len(late))
        self.assertEqual("found late" in ran.stdout, len(late) > 0)
        score = record["score"]
        self.assertLessEqual(score["right"], score["late"]["right"])
        self.assertLessEqual(score["late"]["right"], score["right"] + len(late))
        again = json.loads(loopbit("eval", self.out, "--json").stdout)
        self.assertEqual(again["late"], score["late"])
        if not QUICK:
            self.assertGreater(len(late), 0)

    def test_terms_add_up_to_the_log_odds_of_the_score(self):
        for row in rows(self.reference):
            terms = [row[name] for name in ("votes", "geometry", "path", "rivals", "prior")]
            if row["match"] == "":
                self.assertEqual(terms, [""] * 5)
                continue
            log_odds = sum(map(float, terms))
            self.assertAlmostEqual(1 / (1 + math.exp(-log_odds)), float(row["score"]), delta=1e-3)

    def test_rows_name_their_image_and_that_of_the_match(self):
        images = sorted(path.name for path in self.images.iterdir())
        self.assertEqual([row["name"] for row in rows(self.reference)], images)
        for row in rows(self.reference):
            self.assertEqual(row["match_name"], images[int(row["match"])] if row["match"] else "")

    @unittest.skipIf(QUICK, "too few frames")
    def test_loops_in_a_row_are_one_revisit(self):
        first, last = re.search(r"(\d+)-(\d+) is 0-\d+\n", self.reference_output).groups()
        loops = [int(row["frame"]) for row in rows(self.reference) if row["status"] == "loop"]
        self.assertEqual((int(first), int(last)), (loops[0], loops[-1]))

    @unittest.skipIf(QUICK, "too few frames")
    def test_the_world_is_recognised(self):
        score = json.loads((self.reference / "run.json").read_text())["score"]
        self.assertGreaterEqual(score["precision"], 0.98)
        self.assertGreater(score["recall"], 0.5)
        self.assertIn(f"recall {score['recall']:.3f}", self.reference_output)

    def test_run_json_agrees_with_loops_csv(self):
        record = json.loads((self.reference / "run.json").read_text())
        self.assertEqual(record["counts"]["frames"], FRAMES)
        for status, number in record["counts"]["by_status"].items():
            self.assertEqual(number, sum(r["status"] == status for r in rows(self.reference)))
        for step in ("content", "retrieval", "features", "verification"):
            column = [float(r[f"{step}_ms"]) for r in rows(self.reference)]
            self.assertAlmostEqual(record["times_ms"][step]["mean"], sum(column) / FRAMES, places=2)
            self.assertAlmostEqual(record["times_ms"][step]["max"], max(column), places=2)
        self.assertEqual(record["stopped_by"], "end")
        self.assertGreater(record["peak_memory_mib"], 1)

    @unittest.skipIf(QUICK, "the unit tests run every kernel with sanitizers")
    def test_threads_and_instruction_set_change_no_decision(self):
        variants = {
            "one thread": (["--threads", "1"], {}),
            "scalar": (["--threads", "3"], {"LOOPBIT_KERNEL": "scalar"}),
            "plain OpenCV": ([], {"OPENCV_CPU_DISABLE": "SSE4.1,SSE4.2,AVX,FP16,AVX2,AVX512-SKX",
                                  "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F"}),
        }
        for name, (flags, environment) in variants.items():
            with self.subTest(name):
                out = self.scratch / name
                # In a process of its own: libraries read such variables when they are loaded.
                ran = loopbit("run", self.images, "--out", out, *flags, environment=environment,
                              timeout=TIME_LIMIT_S)
                self.assertEqual(ran.returncode, 0, ran.stderr)
                self.assertEqual(decisions(out), decisions(self.reference))

    def test_demo_finds_what_its_images_show(self):
        ran = loopbit("demo", *WORLD, "--out", self.out)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        without_time = [{**row, "timestamp": ""} for row in decisions(self.out)]
        self.assertEqual(without_time, decisions(self.reference))

    @repeats_when_sanitized
    def test_every_and_limit(self):
        ran = loopbit("run", self.images, "--out", self.out, "--every", 3, "--limit", 5)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertEqual(len(rows(self.out)), 5)

    def test_a_run_without_out_names_its_folder_after_the_input(self):
        run = ["run", f"{self.few_images(3)}/", "--no-report"]
        for folder, flags in (("few_loops", []), ("few_loops_2", []), ("few_loops_3", []),
                              ("few_loops", ["--overwrite"])):
            ran = loopbit(*run, *flags, cwd=self.scratch)
            self.assertEqual(ran.returncode, 0, ran.stderr)
            self.assertIn(f"written    {folder}/loops.csv", ran.stdout)
        self.assertEqual(sorted(path.name for path in self.scratch.glob("few_*")),
                         ["few_loops", "few_loops_2", "few_loops_3"])

    @repeats_when_sanitized
    def test_json_is_one_line_per_loop_and_a_summary(self):
        ran = loopbit("run", self.images, "--out", self.out, "--no-report", "--json")
        self.assertEqual((ran.returncode, complaints(ran)), (0, []))
        *lines, summary = map(json.loads, ran.stdout.splitlines())
        loops = [line for line in lines if line["type"] == "loop"]
        changes = [line for line in lines if line["type"] != "loop"]
        self.assertEqual([(line["type"], str(line["frame"]), str(line["reported_at"]))
                          for line in changes],
                         [(row["kind"], row["frame"], row["reported_at"])
                          for row in late_rows(self.out)])
        expected = [row for row in rows(self.out) if row["status"] == "loop"]
        self.assertEqual(len(loops), len(expected))
        for loop, row in zip(loops, expected):
            self.assertEqual(loop.pop("type"), "loop")
            self.assertEqual(f"{loop.pop('similarity'):.6f}", row["similarity"])
            for name, term in loop.pop("terms").items():
                self.assertAlmostEqual(term, float(row[name]), delta=6e-4)
            self.assertEqual({key: str(value) for key, value in loop.items()},
                             {key: row[key] for key in loop})
        self.assertEqual(summary, {"type": "summary", "folder": str(self.out),
                                   "run": json.loads((self.out / "run.json").read_text())})

    def test_json_that_cannot_be_printed_ends_the_run(self):
        with open("/dev/full", "w") as full:
            ran = subprocess.run([LOOPBIT, "run", self.images, "--out", self.out, "--json"],
                                 stdin=subprocess.DEVNULL, stdout=full, stderr=subprocess.PIPE, text=True)
        self.assert_fails(ran, 4, "standard output")

    def test_a_quiet_run_prints_nothing_but_errors(self):
        few = self.few_images(3)
        (few / "z.png").write_text("no image")
        run = ["run", few, "--quiet", "--no-report"]
        self.assertEqual(loopbit(*run, "--out", self.out).stdout, "")
        shown = self.on_terminal(80, "stderr", *run, "--out", self.scratch / "again")
        self.assertRegex(shown, r"^loopbit: [^\r\n]*z\.png[^\r\n]*\r?\n$")
        wrote = loopbit("demo", *WORLD, "--write-images", self.scratch / "town", "--quiet")
        self.assertEqual((wrote.returncode, wrote.stdout, wrote.stderr), (0, "", ""))

    def test_the_report_opens_in_a_browser(self):
        browser = self.scratch / "browser"
        browser.write_text('#!/bin/sh\necho "$1" >"$0.shown"\n')
        browser.chmod(0o755)
        environment = {"PATH": "", "BROWSER": str(browser)}
        run = ["run", self.few_images(3), "--out", self.out, "--open", "--overwrite"]
        ran = loopbit(*run, environment=environment)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        page = self.out / "report.html"
        self.assertEqual((self.scratch / "browser.shown").read_text(), f"{page}\n")
        environment["BROWSER"] = str(self.scratch / "none")
        self.assert_fails(loopbit(*run, environment=environment), 4, page, "by hand")
        unseen = loopbit(*run, "--no-report")
        self.assertEqual((unseen.returncode, "--open" in unseen.stderr), (2, True))

    def test_settings_from_file_and_by_name(self):
        config = self.scratch / "settings.json"
        config.write_text('{"decision": {"min_score": 1.0}, // nothing passes\n'
                          ' "surf": {"max_keypoints": 100}}')
        ran = loopbit("run", self.few_images(), "--out", self.out, "--config", config,
                      "--set", "surf.max_keypoints=200")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        options = json.loads((self.out / "run.json").read_text())["options"]
        self.assertEqual(options["decision"]["min_score"], 1.0)
        self.assertEqual(options["surf"]["max_keypoints"], 200)

    @repeats_when_sanitized
    def test_printed_settings_are_a_settings_file(self):
        config = self.scratch / "settings.json"
        config.write_text(loopbit("options", "--json").stdout)
        ran = loopbit("run", self.few_images(), "--out", self.out, "--config", config)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertEqual(json.loads((self.out / "run.json").read_text())["options"],
                         json.loads(config.read_text()))

    def on_terminal(self, columns, stream, *arguments):
        """What the command shows on a terminal of this width that is its stdout or stderr."""
        try:
            leader, follower = pty.openpty()
        except OSError as error:
            self.skipTest(f"no terminal here: {error}")
        fcntl.ioctl(follower, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
        streams = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, stream: follower}
        subprocess.run([LOOPBIT, *arguments], check=True, stdin=subprocess.DEVNULL, **streams)
        os.close(follower)
        shown = b""
        try:
            while chunk := os.read(leader, 65536):
                shown += chunk
        except OSError:  # all was read
            pass
        os.close(leader)
        return shown.decode()

    def test_progress_is_a_bar_on_a_terminal(self):
        shown = self.on_terminal(80, "stderr", "run", self.images, "--out", self.out, "--limit", "40")
        self.assertRegex(shown, r"\[#+\.*\] \d+ of 40 frames, [\d.]+ frames/s, "
                                r"\d+:\d\d left, \d+ loops?")
        self.assertTrue(shown.endswith("\r\x1b[K"), "the bar is left")

    def test_progress_and_help_fit_the_terminal(self):
        for columns in (60, 80):
            with self.subTest(columns=columns):
                shown = self.on_terminal(columns, "stderr", "run", self.images, "--out",
                                         self.scratch / str(columns), "--limit", "40")
                lines = shown.split("\r\x1b[K")
                self.assertLess(max(map(len, lines)), columns, lines)
                self.assertRegex(shown, r"\d+ of 40 frames")
                for command in ([], ["run"], ["map", "merge"]):
                    lines = self.on_terminal(columns, "stdout", *command, "--help").splitlines()
                    long = [line for line in lines if len(line) > columns and "Usage" not in line]
                    self.assertEqual(long, [])

    def test_help_names_every_command_and_exit_code(self):
        text = loopbit("--help").stdout
        for word in ("run", "demo", "options", "Exit codes: 0", "130"):
            self.assertIn(word, text)
        self.assertRegex(loopbit("--version").stdout, r"^\d+\.\d+\.\d+\n$")

    # Bad frames: the run goes on.

    def test_bad_frames_have_their_row_and_end_nothing(self):
        folder = self.few_images()
        whole = (folder / "000003.png").read_bytes()
        (folder / "000003.png").write_bytes(whole[: len(whole) // 2])
        (folder / "000005.png").write_bytes(b"")
        (folder / "000007.png").write_text("this is no image")
        (folder / "notes.txt").write_text("nor is this, by its name")
        ran = loopbit("run", folder, "--out", self.out)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        unreadable = [r["frame"] for r in rows(self.out) if r["status"] == "unreadable"]
        self.assertEqual(unreadable, ["3", "5", "7"])
        for number in (3, 5, 7):
            self.assertRegex(ran.stderr, rf"(?m)^loopbit: Frame {number}: .*00000{number}\.png")
        self.assertEqual(len(complaints(ran)), 3, ran.stderr)

    def test_the_second_lap_may_have_another_size(self):
        wide = self.scratch / "wide"
        made = loopbit("demo", *WORLD, "--world", "width_px=400", "--write-images", wide)
        self.assertEqual(made.returncode, 0, made.stderr)
        folder = self.scratch / "mixed"
        folder.mkdir()
        for number, image in enumerate(sorted(self.images.iterdir())):
            shutil.copy((image if number < FRAMES // 2 else wide / "images" / image.name), folder)
        town = self.scratch / "town.db"
        ran = loopbit("run", folder, "--map", town, "--out", self.out)
        self.assertEqual((ran.returncode, complaints(ran)), (0, []))
        loops = [row for row in rows(self.out) if row["status"] == "loop"]
        self.assertNotIn("unreadable", {row["status"] for row in rows(self.out)})
        if not QUICK:
            self.assertGreater(len(loops), 20)
            self.assertTrue(all(int(row["match"]) < FRAMES // 2 for row in loops[:20]))
        asked = loopbit("query", town, folder / "000007.png", wide / "images" / "000007.png")
        self.assertEqual((asked.returncode, asked.stderr), (0, ""))

    def unreadable_images(self, number):
        """A folder of so many empty files, and an image after them."""
        folder = self.scratch / "bad"
        folder.mkdir()
        for image in range(number):
            (folder / f"{image}.png").write_bytes(b"")
        shutil.copy(self.images / "000000.png", folder / f"{number}.png")
        return folder

    def test_many_bad_frames_do_not_flood_the_terminal(self):
        ran = loopbit("run", self.unreadable_images(100), "--out", self.out)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertLess(len(ran.stderr.splitlines()), 15)
        self.assertIn("100 frames were unreadable", ran.stderr)

    def test_no_readable_frame_at_all_is_an_error(self):
        folder = self.scratch / "bad"
        folder.mkdir()
        (folder / "1.png").write_bytes(b"")
        ran = loopbit("run", folder, "--out", self.out)
        self.assertEqual(ran.returncode, 3)
        self.assertIn("No frame of", ran.stderr)
        self.assertEqual(rows(self.out)[0]["status"], "unreadable")

    def pictures(self):
        """The reference run's small JPEG pictures of its frames."""
        with contextlib.closing(sqlite3.connect(self.reference / "evidence.db")) as evidence:
            return [row[0] for row in evidence.execute("SELECT picture FROM frame")]

    def test_libraries_print_nothing_of_damaged_images(self):
        folder = self.few_images(3)
        whole = (folder / "000001.png").read_bytes()
        middle = len(whole) // 2
        (folder / "000001.png").write_bytes(whole[:middle] + b"damage" + whole[middle + 6:])
        ran = loopbit("run", folder, "--out", self.out)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertRegex("\n".join(complaints(ran)), r"^loopbit: Frame 1: .*000001\.png.*$")
        for image in folder.iterdir():
            image.unlink()
        for number, jpeg in enumerate(self.pictures()[:3]):
            middle = len(jpeg) // 2
            (folder / f"{number}.jpg").write_bytes(jpeg[:middle] + jpeg[middle + 50:])
        ran = loopbit("run", folder, "--out", self.scratch / "jpeg")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertEqual(complaints(ran), [], "libjpeg makes something of them")
        video = self.scratch / "v.mp4"
        video.write_bytes(b"\0\0\0\x10ftypisom\0\0\2\0\0\0\1\0mdat" + bytes(1000))
        ran = loopbit("run", video, "--out", self.scratch / "mp4")
        self.assertEqual(ran.returncode, 3)
        self.assertRegex(ran.stderr, r"^loopbit: '.*v\.mp4' is not a video .*\n$")

    def test_large_images_are_refused_by_their_headers(self):
        folder = self.few_images(3)
        header = struct.pack(">4sIIBBBBB", b"IHDR", 60000, 20000, 8, 2, 0, 0, 0)
        checked = header + struct.pack(">I", zlib.crc32(header))
        (folder / "000001.png").write_bytes(b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + checked +
                                            struct.pack(">I4sI", 0, b"IEND", 0xAE426082))
        ran = loopbit("run", folder, "--out", self.out)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertRegex(ran.stderr, r"^loopbit: Frame 1: .*000001\.png.* 60000 x 20000 pixels, but "
                                     r"max_megapixels is 100: .*\n$")
        ran = loopbit("run", folder, "--out", self.out, "--overwrite", "--max-megapixels", 1200)
        self.assertIn("damaged", ran.stderr)

    def test_a_damaged_frame_of_a_video_costs_no_other(self):
        jpegs = self.pictures()[:20]
        video = self.scratch / "v.avi"
        for name, damaged in {"first": {0}, "two": {5, 6}, "last": {19}}.items():
            with self.subTest(name):
                video.write_bytes(motion_jpeg([jpeg[:200] if i in damaged else jpeg
                                               for i, jpeg in enumerate(jpegs)]))
                ran = loopbit("run", video, "--out", self.out, "--overwrite", "--no-report")
                self.assertEqual(ran.returncode, 0, ran.stderr)
                unreadable = {int(row["frame"]) for row in rows(self.out) if row["status"] == "unreadable"}
                # What comes after the last frame that can be read is the end.
                self.assertEqual((len(rows(self.out)), unreadable),
                                 (19, set()) if name == "last" else (20, damaged))
                for frame in unreadable:
                    self.assertIn(f"frame {frame}, cannot be decoded", ran.stderr)

    def test_a_video_of_which_much_is_missing_says_so(self):
        jpegs = self.pictures()[:20]
        video = self.scratch / "v.avi"
        video.write_bytes(motion_jpeg([*jpegs[:10], *[b"no image"] * 10]))
        ran = loopbit("run", video, "--out", self.out, "--no-report")
        self.assertEqual((ran.returncode, len(rows(self.out))), (0, 10))
        self.assertEqual(complaints(ran), [f"loopbit: Video '{video}' ends after 10 of about 20 frames: copy it "
                                           "again or convert it."])

    def test_a_video_that_is_cut_off_says_so(self):
        jpegs = self.pictures()[:20]
        video = self.scratch / "v.avi"
        whole = motion_jpeg(jpegs)
        for name, size in {"whole": len(whole), "cut": len(whole) // 2}.items():
            with self.subTest(name):
                video.write_bytes(whole[:size])
                ran = loopbit("run", video, "--out", self.out, "--overwrite")
                self.assertEqual(ran.returncode, 0, ran.stderr)
                told = json.loads((self.out / "run.json").read_text())["input"].get("early_end")
                if name == "whole":
                    self.assertEqual([len(rows(self.out)), told, complaints(ran)], [20, None, []])
                else:
                    self.assertLess(len(rows(self.out)), 20)
                    self.assertEqual(complaints(ran), [f"loopbit: {told}"])
                    self.assertIn(f"'{video}' is cut off after {size} of", told)
                self.assertEqual("cut off" in ran.stdout, name == "cut")

    def test_only_regular_files_are_waited_for(self):
        for name in ("v.avi", "v.png", "list.txt"):
            pipe = self.scratch / name
            os.mkfifo(pipe)
            self.assert_fails(loopbit("run", pipe, "--out", self.out), 3, pipe, "neither a file")
        listed = self.scratch / "images.txt"
        device = self.scratch / "device.png"
        device.symlink_to("/dev/zero")
        listed.write_text(f"v.png\ndevice.png\n{self.images / '000000.png'}\n")
        ran = loopbit("run", listed, "--out", self.out)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        for name in ("v.png", "device.png"):
            self.assertIn(f"{name}' is a folder, a pipe or a device", ran.stderr)

    def test_no_more_threads_than_cores_to_run_on(self):
        core = {next(iter(os.sched_getaffinity(0)))}
        ran = loopbit("run", self.few_images(3), "--out", self.out, "--threads", 2,
                      preexec_fn=lambda: os.sched_setaffinity(0, core))
        self.assertEqual([ran.returncode, ran.stderr], [0, ""])
        self.assertIn("with 1 thread;", ran.stdout)
        self.assertEqual(json.loads((self.out / "run.json").read_text())["threads"], 1)

    # Bad input, output and options: one sentence, an exit code, nothing lost.

    def test_missing_input(self):
        missing = self.scratch / "nothing"
        self.assert_fails(loopbit("run", missing, "--out", self.out), 3, missing)
        self.assertFalse(self.out.exists())

    def test_empty_folder(self):
        empty = self.scratch / "empty"
        empty.mkdir()
        self.assert_fails(loopbit("run", empty, "--out", self.out), 3, empty)

    def test_what_is_read_is_never_replaced(self):
        def copy(name):
            return pathlib.Path(shutil.copy(self.dataset / name, self.scratch))

        truth, image = copy("truth.csv"), self.few_images(3) / "000001.png"
        run, map_file = self.scratch / "run", self.scratch / "map.db"
        shutil.copytree(self.reference, run)
        loopbit("run", image.parent, "--map", map_file, "--out", self.out, "--no-report")
        few = ["run", image.parent, "--no-report", "--out", self.scratch / "new"]
        for arguments, lost in [
                ([*few, "--map", map_file, "--mcap-out"], map_file),
                ([*few, "--map", f"{self.scratch}/./map.db", "--mcap-out"], map_file),
                ([*few, "--truth", truth, "--mcap-out"], truth),
                ([*few, "--mcap-out"], image),
                (["run", image.parent, "--out", run, "--overwrite", "--mcap-out"], run / "loops.csv"),
                (["map", "export", map_file, "--out"], map_file),
                (["pairs", run, "--out"], run / "loops.csv"),
                (["report", run, "--out"], run / "run.json"),
                (["eval", run, "--truth", truth, "--plot"], truth),
                (["compare", run, f"again={run}", "--out"], run / "run.json")]:
            with self.subTest(arguments[0], lost=lost.name):
                before = lost.read_bytes()
                self.assert_fails(loopbit(*arguments, lost), 2, arguments[-1], lost, "name another file")
                self.assertEqual(lost.read_bytes(), before)
        self.assertFalse((self.scratch / "new").exists())
        for page in (run / "report.html", run / "new.html"):
            self.assertEqual(loopbit("report", run, "--out", page).returncode, 0)

    def test_an_empty_value_is_no_value(self):
        for arguments in (["run", ""], ["run", self.images, "--mask", ""], ["eval", self.reference, "--plot", ""],
                          ["map", "check", "map.db", "--recover", ""]):
            ran = loopbit(*arguments)
            self.assertEqual(ran.returncode, 2)
            self.assertIn("the value is empty", ran.stderr)

    def test_a_data_set_replaces_no_file(self):
        mine = self.scratch / "mine"
        mine.mkdir()
        (mine / "poses.txt").write_text("mine\n")
        self.assert_fails(loopbit("demo", *WORLD, "--write-images", mine), 4, mine / "poses.txt", "another folder")
        self.assertEqual([file.name for file in mine.iterdir()], ["poses.txt"])

    def test_input_that_is_no_video(self):
        text = self.scratch / "letter.doc"
        text.write_text("Dear loopbit,")
        self.assert_fails(loopbit("run", text, "--out", self.out), 3, text)

    @repeats_when_sanitized
    def test_an_earlier_run_is_never_overwritten_unasked(self):
        folder = self.few_images()
        self.assertEqual(loopbit("run", folder, "--out", self.out).returncode, 0)
        before = (self.out / "loops.csv").read_bytes()
        self.assert_fails(loopbit("run", folder, "--out", self.out), 4, self.out, "--overwrite")
        self.assertEqual((self.out / "loops.csv").read_bytes(), before)
        again = loopbit("run", folder, "--out", self.out, "--overwrite")
        self.assertEqual(again.returncode, 0, again.stderr)

    @repeats_when_sanitized
    def test_a_bad_setting_leaves_an_earlier_run_alone(self):
        folder = self.few_images()
        self.assertEqual(loopbit("run", folder, "--out", self.out).returncode, 0)
        before = (self.out / "loops.csv").read_bytes()
        bad = loopbit("run", folder, "--out", self.out, "--overwrite", "--set", "surf.x=1")
        self.assert_fails(bad, 2, "surf.x")
        self.assertEqual((self.out / "loops.csv").read_bytes(), before)

    @repeats_when_sanitized
    def test_an_unknown_kernel_leaves_an_earlier_run_alone(self):
        folder = self.few_images(2)
        self.assertEqual(loopbit("run", folder, "--out", self.out).returncode, 0)
        before = (self.out / "loops.csv").read_bytes()
        bad = loopbit("run", folder, "--out", self.out, "--overwrite",
                      environment={"LOOPBIT_KERNEL": "abacus"})
        self.assert_fails(bad, 2, "LOOPBIT_KERNEL")
        self.assertEqual((self.out / "loops.csv").read_bytes(), before)

    @repeats_when_sanitized
    def test_a_data_set_is_no_earlier_run(self):
        folder = self.scratch / "town"
        folder.mkdir()
        truth = folder / "truth.csv"
        truth.write_text("5,1\n")
        ran = loopbit("run", self.few_images(), "--out", folder, "--no-report", "--truth", truth,
                      "--overwrite")
        self.assert_fails(ran, 4, folder, "truth.csv")
        self.assertEqual(truth.read_text(), "5,1\n")
        self.assertEqual(list(folder.iterdir()), [truth])

    def test_what_a_run_reads_is_not_replaced_by_it(self):
        few = self.few_images()
        truth = self.scratch / "truth.csv"
        truth.write_text("5,1\n")
        run = ["run", few, "--out", self.out, "--no-report", "--truth"]
        self.assertEqual(loopbit(*run, truth).returncode, 0)
        own = self.out / "truth.csv"
        before = own.read_bytes()
        self.assert_fails(loopbit(*run, own, "--overwrite"), 4, own)
        self.assertEqual(own.read_bytes(), before)
        self.assertTrue((self.out / "loops.csv").exists())
        self.assertEqual(loopbit(*run, truth, "--overwrite").returncode, 0)

    @repeats_when_sanitized
    def test_an_input_without_an_image_leaves_an_earlier_run_alone(self):
        self.assertEqual(loopbit("run", self.few_images(3), "--out", self.out).returncode, 0)
        before = (self.out / "loops.csv").read_bytes()
        bad = self.scratch / "bad"
        bad.mkdir()
        (bad / "1.png").write_bytes(b"")
        ran = loopbit("run", bad, "--out", self.out, "--overwrite")
        self.assert_fails(ran, 3, bad, "1.png")
        self.assertEqual((self.out / "loops.csv").read_bytes(), before)
        shutil.copy(self.images / "000000.png", bad / "2.png")
        ran = loopbit("run", bad, "--out", self.out, "--overwrite")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertEqual([row["status"] for row in rows(self.out)],
                         ["unreadable", "no_earlier_place"])

    @repeats_when_sanitized
    def test_images_too_small_to_use_leave_an_earlier_run_alone(self):
        self.assertEqual(loopbit("run", self.few_images(3), "--out", self.out).returncode, 0)
        before = (self.out / "loops.csv").read_bytes()
        tiny = self.scratch / "tiny"
        tiny.mkdir()
        (tiny / "1.pgm").write_bytes(b"P5 20 20 255\n" + bytes(400))
        ran = loopbit("run", tiny, "--out", self.out, "--overwrite")
        self.assert_fails(ran, 3, tiny, "1.pgm", "20 x 20")
        self.assertEqual((self.out / "loops.csv").read_bytes(), before)

    @repeats_when_sanitized
    def test_a_window_of_seconds_without_times_writes_nothing(self):
        few = self.few_images(3)
        seconds = ("--set", "exclusion.seconds=5")
        self.assert_fails(loopbit("run", few, "--out", self.out, *seconds), 2, "000000.png")
        self.assertFalse(self.out.exists())
        self.assertEqual(loopbit("run", few, "--out", self.out).returncode, 0)
        before = (self.out / "loops.csv").read_bytes()
        ran = loopbit("run", few, "--out", self.out, "--overwrite", *seconds)
        self.assert_fails(ran, 2, "exclusion.seconds", "000000.png")
        self.assertEqual((self.out / "loops.csv").read_bytes(), before)

    @repeats_when_sanitized
    def test_a_stderr_that_cannot_be_written_ends_nothing(self):
        run = [LOOPBIT, "run", self.unreadable_images(20), "--no-report", "--out"]
        missing = [LOOPBIT, "run", self.scratch / "none", "--out", self.out]
        with open("/dev/full", "w") as full:
            for name, options in {"full": {"stderr": full},
                                  "closed": {"preexec_fn": lambda: os.close(2)}}.items():
                with self.subTest(name):
                    ran = subprocess.run([*run, self.scratch / name], stdin=subprocess.DEVNULL,
                                         stdout=subprocess.DEVNULL, **options)
                    self.assertEqual(ran.returncode, 0)
                    lines = (self.scratch / name / "loops.csv").read_text().splitlines()
                    self.assertEqual([lines[0], len(lines)], [HEADER, 22])
                    self.assertEqual(subprocess.run(missing, **options).returncode, 3)

    def test_a_stdout_that_cannot_be_written_is_an_error(self):
        with open("/dev/full", "w") as full:
            for name, options in {"full": {"stdout": full},
                                  "closed": {"preexec_fn": lambda: os.close(1)}}.items():
                for command in (["options"], ["options", "--json"], ["eval", self.reference],
                                ["--version"], ["run", "--help"]):
                    with self.subTest(name, command=command):
                        ran = subprocess.run([LOOPBIT, *command], stdin=subprocess.DEVNULL,
                                             stderr=subprocess.PIPE, text=True, **options)
                        reason = "No space left on device" if name == "full" else "Bad file descriptor"
                        self.assert_fails(ran, 4, "standard output", reason)

    def test_paths_need_not_be_utf8(self):
        folder = os.fsencode(self.scratch) + b"/\xff"
        os.rename(self.few_images(3), folder)
        ran = subprocess.run([LOOPBIT, "run", folder, "--out", self.out], capture_output=True)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertIn("\ufffd", json.loads((self.out / "run.json").read_text())["input"]["path"])
        os.rename(self.out, folder + b"_run")
        truth = self.scratch / "truth.csv"
        truth.write_text("2,0\n")
        ran = subprocess.run([LOOPBIT, "compare", "--json", folder + b"_run", folder + b"_run",
                              "--truth", truth], capture_output=True)
        self.assertEqual(ran.returncode, 0, ran.stderr)

    def test_names_do_not_steer_the_terminal(self):
        folder = self.few_images(3)
        (folder / "z\x1b[31m\r\n\x9b.png").write_text("no image")
        ran = loopbit("run", folder, "--out", self.scratch / "out\x1b[2J")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertIn("z\\x1b[31m\\x0d\\x0a\\xc2\\x9b.png", ran.stderr)
        self.assertIn("out\\x1b[2J", ran.stdout)
        missing = loopbit("eval", "no\x1b[2J", "--truth", "no\x1b[2J")
        self.assert_fails(missing, 3, "no\\x1b[2J")
        unknown = loopbit("eval", self.reference, "more\x1b[2J")
        self.assertEqual(unknown.returncode, 2)
        for text in (ran.stdout, ran.stderr, missing.stderr, unknown.stderr):
            self.assertNotRegex(text, "[\x00-\x09\x0b-\x1f\x7f-\x9f]")

    def test_times_are_needed_where_a_setting_is_in_seconds(self):
        ran = loopbit("run", self.few_images(), "--out", self.out, "--set", "exclusion.seconds=5")
        self.assert_fails(ran, 2, "exclusion.seconds is 5", "000000.png", "exclusion.frames")

    def test_names_that_no_file_can_have(self):
        loop = self.scratch / "loop"
        loop.symlink_to(loop)
        truth = ["--truth", self.dataset / "truth.csv"]
        for name in (loop, self.scratch / ("x" * 300)):
            for code, command in ((3, ["eval", name, *truth]), (3, ["eval", f"a={name}", *truth]),
                                  (3, ["report", name]), (3, ["run", name, "--out", self.out]),
                                  (4, ["run", self.images, "--out", name]),
                                  (4, ["report", self.reference, "--out", name])):
                with self.subTest(command=command):
                    self.assert_fails(loopbit(*command), code, name)

    def test_output_folder_that_cannot_be_made(self):
        file = self.scratch / "file"
        file.write_text("")
        self.assert_fails(loopbit("run", self.few_images(), "--out", file / "out"), 4, file)

    @unittest.skipIf(os.geteuid() == 0, "root may write anywhere")
    def test_read_only_output_folder(self):
        self.out.mkdir(mode=0o555)
        self.assert_fails(loopbit("run", self.few_images(), "--out", self.out), 4, self.out)

    def run_on_small_disk(self, images, bytes_left, *flags):
        def limit_file_size():
            resource.setrlimit(resource.RLIMIT_FSIZE, (bytes_left, bytes_left))

        return loopbit("run", images, "--out", self.out, *flags, preexec_fn=limit_file_size)

    @repeats_when_sanitized
    def test_full_disk_keeps_whole_rows(self):
        # So many that their rows take more than what run.json begins with, and so small that they take
        # no time.
        image = self.scratch / "image.pgm"
        image.write_bytes(b"P5\n64 48\n255\n" + bytes(range(256)) * 12)
        images = self.scratch / "images.txt"
        images.write_text(f"{image}\n" * 600)
        ran = self.run_on_small_disk(images, 20_000, "--no-report")
        self.assert_fails(ran, 4, "loops.csv", "rows before are kept")
        text = (self.out / "loops.csv").read_text()
        self.assertTrue(text.endswith("\n"))
        kept = rows(self.out)
        self.assertGreater(len(kept), 3)
        self.assertTrue(all(row["verification_ms"] for row in kept))
        self.assertIn(f"The {len(kept)} rows", ran.stderr)

    @repeats_when_sanitized
    def test_a_disk_too_full_for_pictures_keeps_the_rows(self):
        ran = self.run_on_small_disk(self.few_images(), 100_000)
        self.assert_fails(ran, 4, "evidence.db", "free space", "--no-report")
        self.assertGreater(len(rows(self.out)), 0)
        self.assertIn("evidence.db", json.loads((self.out / "run.json").read_text())["stopped_by"])

    @repeats_when_sanitized
    def test_a_full_disk_costs_no_earlier_run(self):
        few = self.few_images(3)
        self.assertEqual(loopbit("run", few, "--out", self.out, "--no-report").returncode, 0)
        before = {file: file.read_bytes() for file in self.out.iterdir()}
        for bytes_left in (40, 2000):
            ran = self.run_on_small_disk(few, bytes_left, "--no-report", "--overwrite")
            self.assert_fails(ran, 4, self.out)
            self.assertEqual({file: file.read_bytes() for file in self.out.iterdir()}, before)

    def test_how_a_run_ends_on_a_full_disk_is_kept(self):
        self.out.mkdir()
        mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=200k", "tmpfs", self.out],
                                 capture_output=True, text=True)
        if mounted.returncode != 0:
            self.skipTest(f"no small disk here: {mounted.stderr}")
        try:
            few = self.few_images()
            ran = loopbit("run", few, "--out", self.out)
            self.assert_fails(ran, 4, self.out)
            record = json.loads((self.out / "run.json").read_text())
            self.assertEqual(complaints(ran), [f"loopbit: {record['stopped_by']}"])
            with contextlib.suppress(OSError), open(self.out / "filler", "wb", 0) as filler:
                while filler.write(bytes(512)):
                    pass
            before = {file: file.read_bytes() for file in self.out.iterdir()}
            self.assert_fails(loopbit("run", few, "--out", self.out, "--overwrite"), 4, self.out)
            self.assertEqual({file: file.read_bytes() for file in self.out.iterdir()}, before)
        finally:
            subprocess.run(["umount", self.out], check=True)

    def test_bad_settings(self):
        cases = [
            ("surf.max_keypoints=1", "surf.max_keypoints is 1, but must be between"),
            ("surf.max_keypoints=many", "'many', but must be a whole number"),
            ("surf.max_keypoint=500", "no setting 'surf.max_keypoint'"),
            ("binary_content.gamma=nan", "binary_content.gamma is nan"),
            ("gamma", "'gamma' has no value"),
        ]
        for setting, words in cases:
            with self.subTest(setting):
                ran = loopbit("run", self.images, "--out", self.out, "--set", setting)
                self.assert_fails(ran, 2, words)

    def test_bad_settings_files(self):
        for text, words in [("{", "not valid JSON"), ("[]", "object"),
                            ('{"surf": {"upright": 3}}', "surf.upright is '3'"),
                            ('{"surf": {"max_keypoints": 1e9}}', "surf.max_keypoints")]:
            with self.subTest(text):
                config = self.scratch / "settings.json"
                config.write_text(text)
                ran = loopbit("run", self.images, "--out", self.out, "--config", config)
                self.assert_fails(ran, 2, config, words)
        missing = loopbit("run", self.images, "--out", self.out, "--config", "/nowhere.json")
        self.assert_fails(missing, 3, "/nowhere.json")

    def test_bad_command_lines(self):
        for arguments in ([], ["walk"], ["run"], ["demo", "--frames", "x"],
                          ["run", self.images, "--out", self.out, "--every", "0"]):
            with self.subTest(arguments):
                ran = loopbit(*arguments)
                self.assertEqual(ran.returncode, 2, ran.stderr)
                self.assertTrue(ran.stderr)

    def test_a_bad_command_line_names_what_is_wrong(self):
        run = ["run", self.images, "--out", self.out]
        for arguments, words in ((["walk"], "no command 'walk'"), (["--foo"], "no option '--foo'"),
                                 (["map", "lst", "x.db"], "no command 'lst'"),
                                 (["map", "--foo"], "no option '--foo'"),
                                 ([*run, "--every", "2.5"], "'2.5' is not a whole number from 1"),
                                 ([*run, "--limit", "-1"], "'-1' is not a whole number from 0"),
                                 ([*run, "--pictures-mb", "nan"], "'nan' is not a number from 0")):
            with self.subTest(arguments):
                ran = loopbit(*arguments)
                self.assertEqual(ran.returncode, 2, ran.stderr)
                self.assertIn(words, ran.stderr)
        self.assertFalse(self.out.exists())

    def test_unknown_kernel(self):
        ran = loopbit("run", self.few_images(), "--out", self.out,
                      environment={"LOOPBIT_KERNEL": "abacus"})
        self.assert_fails(ran, 2, "LOOPBIT_KERNEL is 'abacus'", "scalar")

    def test_bad_truth(self):
        truth = self.scratch / "truth.csv"
        truth.write_text("# query,first,last\n40,0,2\n41,one,3\n")
        ran = loopbit("run", self.images, "--out", self.out, "--truth", truth)
        self.assert_fails(ran, 3, truth, "3", "41,one,3")

    def test_images_are_not_written_over_others(self):
        ran = loopbit("demo", *WORLD, "--write-images", self.dataset)
        self.assert_fails(ran, 4, self.dataset)

    def test_writing_images_takes_no_settings_of_the_detector(self):
        for flags in (["--set", "nonsense=1"], ["--map", self.scratch / "x.db"],
                      ["--preset", "paper"], ["--no-report"]):
            ran = loopbit("demo", *WORLD, "--write-images", self.scratch / "town", *flags)
            self.assert_fails(ran, 2, flags[0], "--write-images")
        self.assertFalse((self.scratch / "town").exists())

    def interrupted_run(self, number, images=None, **options):
        process = subprocess.Popen([LOOPBIT, "run", images or self.images, "--out", self.out],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                   **options)
        loops = self.out / "loops.csv"
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            if loops.exists() and len(loops.read_text().splitlines()) > FRAMES // 8:
                break
            time.sleep(0.005)
        process.send_signal(number)
        output, errors = process.communicate(timeout=60)
        return process.returncode, output, errors

    def test_what_libraries_printed_is_shown_when_the_process_aborts(self):
        images = self.scratch / "images"
        shutil.copytree(self.images, images)
        whole = (images / "000001.png").read_bytes()
        middle = len(whole) // 2
        (images / "000001.png").write_bytes(whole[:middle] + b"damage" + whole[middle + 6:])
        code, _, errors = self.interrupted_run(signal.SIGABRT, images)
        self.assertEqual(code, -signal.SIGABRT, errors)
        self.assertRegex(errors, r"\nlibpng error: .*\n$")

    def test_a_hangup_that_is_ignored_ends_nothing(self):
        code, _, errors = self.interrupted_run(
            signal.SIGHUP, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
        self.assertEqual(code, 0, errors)
        self.assertEqual(len(rows(self.out)), FRAMES)

    def test_signals_end_cleanly_and_keep_what_was_found(self):
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            with self.subTest(number):
                shutil.rmtree(self.out, ignore_errors=True)
                self.check_interrupted(*self.interrupted_run(number))

    def check_interrupted(self, code, output, errors):
        self.assertEqual(code, 130, errors)
        self.assertIn("interrupted", output)
        record = json.loads((self.out / "run.json").read_text())
        self.assertEqual(record["stopped_by"], "interrupt")
        kept = decisions(self.out)
        self.assertEqual(record["counts"]["frames"], len(kept))
        self.assertLess(len(kept), FRAMES)
        self.assertEqual(kept, decisions(self.reference)[: len(kept)])


class RealImagesTest(unittest.TestCase):
    @unittest.skipIf(QUICK, "too many frames")
    @unittest.skipUnless(os.environ.get("LOOPBIT_DATA"), "LOOPBIT_DATA names no folder of images")
    def test_truth_scores_a_run(self):
        data = pathlib.Path(os.environ["LOOPBIT_DATA"]) / "corridor_loop"
        with tempfile.TemporaryDirectory() as out:
            ran = loopbit("run", data / "images", "--out", out, "--truth", data / "truth.csv",
                          "--not-false", data / "not_false.csv", "--ignore", data / "ignore.csv")
            self.assertEqual(ran.returncode, 0, ran.stderr)
            found = re.search(r"(\d+) of 38 revisits found: recall [\d.]+; 0 wrong", ran.stdout)
            self.assertIsNotNone(found, ran.stdout)
            self.assertGreaterEqual(int(found[1]), 0.90 * 38)


if __name__ == "__main__":
    unittest.main()
