#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""loopbit run --correct: the corrected trajectory and the loops that the pose graph rejects."""

import csv
import json
import pathlib
import subprocess
import unittest

from loopbit_command import FRAMES, CommandTest, loopbit

# Two storeys that look the same, a lap and a piece on each.
STOREYS = ["--frames", 240, "--world", "spacing_m=1.5", "--world",
           "floors=2", "--world", "laps=1.3", "--world", "width_px=320", "--world", "height_px=240"]
# The detector then takes odometry for no reason against a place.
NO_GATE = ["--set", "decision.reach_m=1000", "--set", "decision.reach_up_m=1000"]
MAKE_ODOMETRY = pathlib.Path(__file__).parent.parent / "scripts/make_odometry"
FILES = ["corrected.kitti", "corrected.tum", "graph.g2o", "judged_loops.csv", "trajectory.csv"]


def table(file):
    with open(file, newline="") as stream:
        return list(csv.DictReader(stream))


def numbers(file):
    rows = (line.split() for line in file.read_text().splitlines() if not line.startswith("#"))
    return [float(word) for row in rows for word in row]


class CorrectionTest(CommandTest):
    """All share a drive through two storeys and a run on it, beside the town of other tests."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.storeys = cls.shared / "storeys"
        made = loopbit("demo", *STOREYS, "--write-images", cls.storeys)
        assert made.returncode == 0, made.stderr
        cls.truth = ["--truth", cls.storeys / "truth.csv", "--not-false", cls.storeys / "not_false.csv",
                     "--poses", cls.storeys / "poses.txt"]
        cls.corrected = cls.shared / "corrected"
        cls.ran = loopbit("run", cls.storeys, "--odometry", cls.storeys / "odometry.txt", "--correct",
                          "--out", cls.corrected, *cls.truth, *NO_GATE, "--no-report", "--json")
        assert cls.ran.returncode == 0, cls.ran.stderr
        cls.record = json.loads((cls.corrected / "run.json").read_text())
        cls.loops = table(cls.corrected / "judged_loops.csv")

    def test_loops_that_odometry_excludes_are_withdrawn(self):
        counts = self.record["correction"]["loops"]
        rejected = [(loop["query"], loop["match"]) for loop in self.loops if loop["verdict"] != "kept"]
        self.assertEqual(len(rejected), counts["unreachable"] + counts["inconsistent"] + counts["outlier"])
        self.assertGreater(len(rejected), 0)
        self.assertEqual(counts["kept"], len(self.loops) - len(rejected))
        last = str(len(table(self.corrected / "loops.csv")) - 1)
        withdrawn = [(row["frame"], row["match"]) for row in table(self.corrected / "late_loops.csv")
                     if (row["kind"], row["reported_at"], float(row["score"])) == ("withdrawn", last, 0)]
        self.assertEqual(withdrawn, rejected)
        lines = [json.loads(line) for line in self.ran.stdout.splitlines()]
        told = [(str(line["frame"]), str(line["match"])) for line in lines if line["type"] == "withdrawn"]
        self.assertEqual(told[-len(rejected):], rejected)
        self.assertEqual(lines[-1]["run"]["correction"], self.record["correction"])

    def test_wrong_loops_go_and_the_trajectory_is_corrected(self):
        score = self.record["score"]
        self.assertGreater(score["wrong"], 50, "without the gate, storeys are confused")
        self.assertLess(score["late"]["wrong"], score["wrong"] / 5)
        self.assertGreaterEqual(score["late"]["right"], score["right"])
        correction = self.record["correction"]
        self.assertLess(correction["corrected_error_m"], 0.6 * correction["odometry_error_m"])

    def test_the_files_agree(self):
        trajectory = table(self.corrected / "trajectory.csv")
        frames = len(table(self.corrected / "loops.csv"))
        self.assertEqual([int(row["frame"]) for row in trajectory], list(range(frames)))
        tum = [list(map(float, line.split())) for line in
               (self.corrected / "corrected.tum").read_text().splitlines()[1:]]
        kitti = [list(map(float, line.split())) for line in
                 (self.corrected / "corrected.kitti").read_text().splitlines()]
        times = [float(line) for line in (self.storeys / "times.txt").read_text().split()]
        for row, time_s, pose, matrix in zip(trajectory, times, tum, kitti, strict=True):
            self.assertAlmostEqual(pose[0], time_s, delta=1e-6)
            for axis, name in enumerate(["x_m", "y_m", "z_m"]):
                self.assertAlmostEqual(pose[1 + axis], float(row[name]), delta=1e-4)
                self.assertAlmostEqual(matrix[4 * axis + 3], float(row[name]), delta=1e-4)
        graph = (self.corrected / "graph.g2o").read_text().splitlines()
        kept = sum(loop["verdict"] == "kept" for loop in self.loops)
        self.assertEqual(sum(line.startswith("VERTEX_SE3:QUAT ") for line in graph), frames)
        self.assertEqual(sum(line.startswith("EDGE_SE3:QUAT ") for line in graph), frames - 1 + kept)

    def test_the_summary_says_what_was_kept_and_how_far_off_it_was(self):
        out = self.scratch / "out"
        run = ["run", self.storeys, "--out", out, "--overwrite", "--no-report"]
        ran = loopbit(*run, "--odometry", self.storeys / "odometry.txt", "--correct", *self.truth, *NO_GATE)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        correction = self.record["correction"]
        kept = correction["loops"]["kept"]
        self.assertRegex(ran.stdout, rf"graph +{kept} loops kept, {len(self.loops) - kept} rejected and "
                                     r"withdrawn \(\d+ unreachable")
        self.assertIn(f"trajectory error: {correction['odometry_error_m']:.3f} m by odometry, "
                      f"{correction['corrected_error_m']:.3f} m corrected", ran.stdout)
        for name in FILES:
            self.assertEqual((out / name).read_bytes(), (self.corrected / name).read_bytes(), name)
        ran = loopbit(*run, "--limit", 5)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertEqual([name for name in FILES if (out / name).exists()], [], "they were of another run")

    def test_the_demo_has_odometry_and_a_camera_of_its_own(self):
        ran = loopbit("demo", *STOREYS, "--correct", "--out", self.out, *NO_GATE, "--no-report", "--quiet")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        correction = json.loads((self.out / "run.json").read_text())["correction"]
        self.assertEqual(correction["loops"], self.record["correction"]["loops"])
        for error in ("odometry_error_m", "corrected_error_m"):
            self.assertAlmostEqual(correction[error], self.record["correction"][error], delta=0.01)

    def test_poses_by_row_and_no_camera(self):
        ran = loopbit("run", self.images, "--odometry", self.dataset / "poses.txt", "--correct", "--no-poses",
                      "--out", self.out, "--no-report")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertNotIn("trajectory error", ran.stdout)
        times = [float(line.split()[0]) for line in
                 (self.out / "corrected.tum").read_text().splitlines()[1:]]
        self.assertEqual(times, list(range(len(times))), "frames take the place of times")
        self.assertEqual({loop["known"] for loop in table(self.out / "judged_loops.csv")}, {"nothing"})

    def test_wrong_odometry_loses_no_loops_silently(self):
        truth = ["--truth", self.dataset / "truth.csv", "--not-false", self.dataset / "not_false.csv"]
        flags = [self.dataset, *truth, "--no-report", "--quiet", "--overwrite", "--out", self.out]

        def record_of(*more):
            ran = loopbit("run", *flags, *more)
            self.assertEqual(ran.returncode, 0, ran.stderr)
            return json.loads((self.out / "run.json").read_text())

        without = record_of()["score"]["late"]["right"]
        told = []
        for fault in (None, "jump", "scale", "axes", "clock"):
            spoil = ["--fault", fault] if fault else []
            made = subprocess.run([MAKE_ODOMETRY, self.dataset / "poses.txt", *spoil], check=True,
                                  stdout=subprocess.PIPE, text=True)
            odometry = self.scratch / "odometry.txt"
            odometry.write_text(made.stdout)
            record = record_of("--odometry", odometry, "--correct")
            if "odometry_doubt" in record:
                told.append(fault)
            else:
                self.assertGreater(record["score"]["late"]["right"], 0.85 * without, fault)
        self.assertEqual([fault for fault in told if fault in (None, "jump", "clock")], ["jump", "clock"])

    def test_a_map_of_one_session_is_corrected_as_its_run(self):
        storeys, out = self.scratch / "storeys.db", self.scratch / "graph"
        ran = loopbit("run", self.storeys, "--odometry", self.storeys / "odometry.txt", "--map", storeys,
                      *NO_GATE, "--no-report", "--quiet")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        before = storeys.read_bytes()
        ran = loopbit("graph", storeys, "--out", out)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        rejected = [(loop["query"], loop["match"]) for loop in self.loops if loop["verdict"] != "kept"]
        self.assertRegex(ran.stdout, rf"graph +{len(self.loops) - len(rejected)} loops kept, "
                                     rf"{len(rejected)} rejected \(\d+ unreachable")
        self.assertIn("--reject", ran.stdout)
        self.assertEqual(storeys.read_bytes(), before, "it was only read")
        for name in ("corrected.tum", "corrected.kitti"):
            # A map keeps what was measured of loops in another form, so the last of nine digits may differ.
            of_session, of_run = (numbers(file)
                                  for file in (out / name.replace(".", "_1."), self.corrected / name))
            self.assertEqual(len(of_session), len(of_run), name)
            for here, there in zip(of_session, of_run):
                self.assertLessEqual(abs(here - there), 1e-8 * abs(there), name)
        for row in ("VERTEX_SE3:QUAT ", "EDGE_SE3:QUAT ", "#EDGE_SE3:QUAT "):
            counts = [sum(line.startswith(row) for line in (folder / "graph.g2o").read_text().splitlines())
                      for folder in (out, self.corrected)]
            self.assertEqual(counts[0], counts[1], row)
        self.assertEqual((out / "judged_loops.csv").read_text().replace("1:", ""),
                         (self.corrected / "judged_loops.csv").read_text())
        self.assert_fails(loopbit("graph", storeys, "--out", out), 4, out, "new folder")
        ran = loopbit("graph", storeys, "--reject", "--json")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        told = json.loads(ran.stdout)
        self.assertEqual([(str(loop["query"]["frame"]), str(loop["match"]["frame"]))
                          for loop in told["rejected"]], rejected)
        self.assertEqual(told["loops"], self.record["correction"]["loops"])
        exported = self.scratch / "loops.csv"
        loopbit("map", "export", storeys, "--out", exported)
        left = [(row["query"], row["match"]) for row in table(exported)]
        self.assertEqual(sorted(left), sorted((loop["query"], loop["match"]) for loop in self.loops
                                              if loop["verdict"] == "kept"))

    def test_sessions_of_a_map_are_corrected_together(self):
        town, out = self.scratch / "town.db", self.scratch / "graph"
        run = ["run", self.dataset, "--map", town, "--odometry", self.dataset / "odometry.txt", "--no-report",
               "--quiet"]
        for flags in (["--limit", FRAMES // 2], ["--correct"]):
            ran = loopbit(*run, *flags)
            self.assertEqual(ran.returncode, 0, ran.stderr)
        withdrawn = sum(row["kind"] == "withdrawn" for row in table(self.scratch / "town_session_2/late_loops.csv"))
        info = json.loads(loopbit("map", "info", town, "--json").stdout)
        self.assertEqual(info["odometry_frames"], FRAMES // 2 + FRAMES)
        self.assertEqual(info["rejected_loops"], withdrawn, "by later frames and the graph of the run")
        ran = loopbit("graph", town, "--out", out)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertIn("sessions 1, 2 joined by loops, in the frame of session 1", ran.stdout)
        for session, frames in ((1, FRAMES // 2), (2, FRAMES)):
            self.assertEqual(len((out / f"corrected_{session}.tum").read_text().splitlines()), 1 + frames)
        between = [loop for loop in table(out / "judged_loops.csv") if loop["match"].startswith("1:")
                   and loop["query"].startswith("2:")]
        self.assertGreater(len(between), FRAMES // 3)
        self.assertEqual({loop["odometry_chi2"] for loop in between}, {""})

    def test_a_map_without_odometry_is_refused(self):
        town, out = self.scratch / "town.db", self.scratch / "graph"
        ran = loopbit("run", self.images, "--limit", 5, "--map", town, "--no-report")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assert_fails(loopbit("graph", town, "--out", out, "--reject"), 3, town, "no odometry",
                          "--odometry FILE")
        self.assert_fails(loopbit("graph", self.scratch / "none.db"), 3, "no map", "none.db")

    def test_without_odometry_it_is_refused(self):
        self.assert_fails(loopbit("run", self.storeys, "--correct", "--out", self.out), 2, "--correct",
                          "--odometry FILE", "--odometry-topic")
        self.assertFalse(self.out.exists())


if __name__ == "__main__":
    unittest.main()
