#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""eval, compare and report as a user meets them."""

import json
import os
import pathlib
import shutil
import subprocess
import unittest
import xml.etree.ElementTree as ElementTree

from loopbit_command import FRAMES, LOOPBIT, CommandTest, loopbit, rows
from mat_file import write_mat


class EvaluationCommandTest(CommandTest):
    def file(self, name, text):
        path = self.scratch / name
        path.write_text(text)
        return path

    def score(self, *arguments):
        scored = loopbit("eval", *arguments, "--json")
        self.assertEqual(scored.returncode, 0, scored.stderr)
        return json.loads(scored.stdout)

    # eval

    def test_truth_that_says_nothing_is_refused(self):
        matches = self.file("other.csv", "5,1,0.9\n")
        for text in ("hello world\n", "", "# nothing\n"):
            with self.subTest(text):
                truth = self.file("truth.csv", text)
                self.assert_fails(loopbit("eval", matches, "--truth", truth), 3, truth,
                                  "query,first,last")
        truth = self.file("truth.csv", "query,first,last\n")
        self.assertEqual(self.score(matches, "--truth", truth)["wrong"], 1)
        empty = self.file("empty.csv", "")
        self.score(matches, "--truth", truth, "--not-false", empty, "--ignore", empty)
        self.assert_fails(loopbit("eval", matches, "--truth", truth, "--not-false",
                                  self.file("words.csv", "hello world\n")), 3, "words.csv")

    def test_truth_of_frames_that_the_run_does_not_have_is_refused(self):
        images = self.few_images(3)
        poses = self.file("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n" * 5)
        later = self.file("later.csv", "3,0,1\n")
        for truth, words in ((poses, ("5 poses", "3 frames")), (later, ("frame 3", "3 frames"))):
            with self.subTest(truth=truth):
                ran = loopbit("run", images, "--out", self.out, "--truth", truth)
                self.assert_fails(ran, 3, truth, *words)
                self.assertFalse(self.out.exists(), "told before the run")
        ran = loopbit("run", images, "--out", self.out)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assert_fails(loopbit("eval", self.out, "--truth", poses), 3, poses, "5 poses")
        part = self.scratch / "part"
        ran = loopbit("run", images, "--out", part, "--limit", 2, "--truth", poses)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.score(part, "--truth", later)

    def test_pipes_and_devices_are_not_waited_for(self):
        pipe = self.scratch / "pipe.csv"
        os.mkfifo(pipe)
        truth = self.dataset / "truth.csv"
        matches = self.file("other.csv", "5,1,0.9\n")
        for name in (pipe, "/dev/zero"):
            for command in (["eval", name, "--truth", truth], ["eval", matches, "--truth", name],
                            ["eval", matches, "--truth", truth, "--not-false", name],
                            ["eval", matches, "--truth", truth, "--ignore", name],
                            ["run", self.images, "--out", self.out, "--config", name],
                            ["run", self.images, "--out", self.out, "--poses", name]):
                with self.subTest(command=command):
                    self.assert_fails(loopbit(*command, timeout=20), 3, name, "pipe or a device")
        shutil.copytree(self.reference, self.out)
        (self.out / "run.json").unlink()
        os.mkfifo(self.out / "run.json")
        self.assert_fails(loopbit("eval", self.out, timeout=20), 3, "run.json", "pipe")

    def test_a_run_folder_is_scored_as_its_run_was(self):
        record = json.loads((self.reference / "run.json").read_text())["score"]
        scored = self.score(self.reference)
        self.assertEqual({key: scored[key] for key in record}, record)
        self.assertEqual(self.score(self.reference / "loops.csv", "--truth",
                                    self.dataset / "truth.csv", "--not-false",
                                    self.dataset / "not_false.csv"), scored)

    def test_any_detectors_matches_are_scored(self):
        truth = self.file("truth.csv", "query,match\n5,1\n6,2\n7,3\n")
        matches = self.file("other.csv", "5,1,0.9\n6,4,0.5\n8,0,0.1\n")
        scored = self.score(matches, "--truth", truth)
        self.assertEqual((scored["positives"], scored["right"], scored["wrong"]), (3, 1, 2))
        self.assertAlmostEqual(scored["recall_at_full_precision"], 1 / 3)
        self.assertEqual(scored["wrong_loops"][0], {"query": 6, "match": 4, "score": 0.5})
        self.assertEqual(self.score(matches, "--truth", truth, "--tolerance", 2)["right"], 2)
        text = loopbit("eval", matches, "--truth", truth).stdout
        self.assertIn("1 of 3 revisits found: recall 0.3333", text)
        self.assertIn("2 wrong loops: precision 0.3333", text)
        self.assertIn("recall 0.3333 at 100 % precision (score 0.9 or more)", text)

    def test_poses_and_matrices_say_what_is_true(self):
        poses = self.dataset / "poses.txt"
        near = self.score(self.reference, "--truth", poses, "--truth-set", "min_gap_frames=10",
                          "--truth-set", "radius_m=5")
        wide = self.score(self.reference, "--truth", poses, "--truth-set", "min_gap_frames=10",
                          "--truth-set", "radius_m=20")
        self.assertGreater(near["positives"], 0)
        self.assertGreater(wide["pairs"]["positives"], near["pairs"]["positives"])
        matrix = self.scratch / "truth.mat"
        write_mat(matrix, "truth", FRAMES, [(FRAMES - 1, 0), (FRAMES - 2, 0), (FRAMES - 2, 1)])
        scored = self.score(self.reference, "--truth", matrix)
        self.assertEqual((scored["positives"], scored["pairs"]["positives"]), (2, 3))

    def test_a_matrix_is_found_beside_objects_of_matlabs(self):
        matrix = self.scratch / "truth.mat"
        write_mat(matrix, "truth", 10, [(9, 0)], with_string=True)
        self.assertEqual(self.score(self.file("other.csv", "9,0\n"), "--truth", matrix)["right"], 1)

    def test_a_protocol_fixes_its_settings(self):
        matrix = self.scratch / "truth.mat"
        write_mat(matrix, "truth", 200, [(150, 50)])
        matches = self.file("other.csv", "150,90\n")
        self.assertEqual(self.score(matches, "--truth", matrix)["right"], 0)
        scored = self.score(matches, "--truth", matrix, "--protocol", "ibow-lcd")
        self.assertEqual((scored["right"], scored["protocol"]), (1, "ibow-lcd"))
        self.assertEqual(scored["tolerance_frames"], 40)
        both = ["eval", matches, "--truth", matrix, "--protocol"]
        self.assert_fails(loopbit(*both, "ibow-lcd", "--tolerance", 1), 2, "--tolerance", "fixes")
        self.assert_fails(loopbit(*both, "kitti"), 2, "poses", matrix, "loop matrix")
        self.assert_fails(loopbit(*both, "orb"), 2, "'orb'", "tsintotas")

    def test_views_of_a_matrix_are_frames_in_turn(self):
        matrix = self.scratch / "truth.mat"
        write_mat(matrix, "truth", 40, [(31, 1)])
        matches = self.file("other.csv", "15,0\n")
        self.assertEqual(self.score(matches, "--truth", matrix)["positives"], 1)
        self.assertEqual(self.score(matches, "--truth", matrix)["right"], 0)
        self.assertEqual(self.score(matches, "--truth", matrix, "--truth-views", 2)["right"], 1)
        self.assertEqual(self.score(matches, "--truth", matrix, "--protocol", "fab-map")["right"], 1)

    def test_frames_left_out_of_a_run_are_left_out_of_its_truth(self):
        ran = loopbit("run", self.images, "--out", self.out, "--every", 2, "--truth",
                      self.dataset / "truth.csv", "--poses", self.dataset / "poses.txt")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertEqual((self.out / "truth.csv").read_text(),
                         (self.dataset / "truth.csv").read_text())
        positions = (self.out / "positions.csv").read_text().splitlines()[1:]
        poses = (self.dataset / "poses.txt").read_text().splitlines()
        self.assertEqual(len(positions), (FRAMES + 1) // 2)
        self.assertAlmostEqual(float(positions[3].split(",")[1]), float(poses[6].split()[3]), 3)
        again = self.score(self.out, "--truth", self.dataset / "truth.csv")
        record = json.loads((self.out / "run.json").read_text())
        self.assertEqual(record["truth_every"], 2)
        self.assertEqual(again["positives"], record["score"]["positives"])
        self.assertEqual(self.score(self.out)["positives"], record["score"]["positives"])
        full = (self.dataset / "truth.csv").read_text().splitlines()[1:]
        queries = {int(line.split(",")[0]) for line in full}
        self.assertEqual(again["positives"], len([query for query in queries if query % 2 == 0]))
        loops = self.out / "loops.csv"
        self.assertEqual(self.score(loops, "--truth", self.dataset / "truth.csv"), again)
        self.assertEqual(self.score(loops)["positives"], again["positives"])
        in_folder = subprocess.run([LOOPBIT, "eval", "loops.csv", "--json"], cwd=self.out,
                                   stdout=subprocess.PIPE, check=True)
        self.assertEqual(json.loads(in_folder.stdout), self.score(self.out))
        shutil.copy(loops, self.scratch / "copy.csv")
        alone = self.score(self.scratch / "copy.csv", "--truth", self.dataset / "truth.csv")
        self.assertNotEqual(alone, again)

    def test_a_list_of_another_sequence_is_noticed(self):
        beyond = self.file("beyond.csv", f"{FRAMES},3,1\n")
        ran = loopbit("eval", beyond, "--truth", self.dataset / "poses.txt")
        self.assert_fails(ran, 3, f"Query {FRAMES}", f"{FRAMES} frames")

    def test_a_trajectory_goes_by_the_times_of_the_frames(self):
        data = self.timed_images(20)
        poses = self.file("tum.txt", "".join(f"{100 if i > 25 else 0.05 * i:.3f} {i} 0 0 0 0 0 1\n"
                                             for i in range(40)))
        ran = loopbit("run", data, "--out", self.out, "--poses", poses)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        positions = (self.out / "positions.csv").read_text().splitlines()[1:]
        self.assertEqual([line.split(",")[:2] for line in positions[:3]],
                         [["0", "0.0000"], ["1", "2.0000"], ["2", "4.0000"]])
        self.assertEqual(len(positions), 13)  # up to 1.25 s
        self.assert_fails(loopbit("eval", self.file("other.csv", "9,1\n"), "--truth", poses), 3,
                          poses, "times")

    def test_bad_truth_and_detections(self):
        truth = self.file("truth.csv", "5,1\n")
        matches = self.file("other.csv", "5,1\n")
        poses = self.dataset / "poses.txt"
        cases = [
            (2, ["eval", matches], [matches, "--truth"]),
            (3, ["eval", self.scratch / "none", "--truth", truth], [self.scratch / "none"]),
            (3, ["eval", self.scratch, "--truth", truth], [self.scratch, "loops.csv"]),
            (3, ["eval", self.file("bad.csv", "5,x\n"), "--truth", truth], ["line 1", "5,x"]),
            (3, ["eval", matches, "--truth", self.file("short.mat", "MATLAB")], ["short.mat"]),
            (2, ["eval", matches, "--truth", poses, "--truth-set", "radius_m=0"], ["radius_m", "0"]),
            (2, ["eval", matches, "--truth", poses, "--truth-set", "metres=2"], ["metres"]),
            (2, ["eval", matches, "--truth", poses, "--truth-set", "radius_m"], ["NAME=VALUE"]),
            (2, ["eval", matches, "--truth", truth, "--truth-set", "radius_m=2"],
             ["--truth-set", "poses", truth]),
            (2, ["eval", matches, "--truth", poses, "--truth-views", 2], ["--truth-views", poses]),
            (2, ["eval", matches, "--truth", truth, "--truth-variable", "x"], ["--truth-variable"]),
        ]
        for code, command, words in cases:
            with self.subTest(command=command):
                self.assert_fails(loopbit(*command), code, *words)

    def test_all_of_the_truth_is_read_before_a_run(self):
        poses = ["run", self.images, "--out", self.out, "--truth", self.dataset / "poses.txt"]
        missing = self.scratch / "missing.csv"
        self.assert_fails(loopbit(*poses, "--ignore", missing), 3, missing)
        self.assert_fails(loopbit(*poses, "--not-false", missing), 3, missing)
        self.assert_fails(loopbit(*poses, "--protocol", "ibow-lcd"), 2, "ibow-lcd", "poses")
        self.assertFalse(self.out.exists())

    def test_a_truth_that_fits_no_frame_costs_no_run(self):
        short = self.scratch / "short.mat"
        write_mat(short, "truth", 3, [(2, 0)])
        images = self.few_images()
        self.assert_fails(loopbit("run", images, "--out", self.out, "--truth", short), 3, short,
                          "14")
        poses = self.file("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n" * 13)
        for flag in ("--truth", "--poses"):
            self.assert_fails(loopbit("run", images, "--out", self.out, flag, poses), 3, poses,
                              "13 poses", "14 frames")
        self.assertFalse(self.out.exists())

    def timed_images(self, number):
        """The first images of the world as KITTI's, ten a second."""
        data = self.scratch / "timed"
        (data / "image_0").mkdir(parents=True)
        for image in sorted(self.images.iterdir())[:number]:
            shutil.copy(image, data / "image_0")
        (data / "times.txt").write_text("".join(f"{0.1 * i:.3f}\n" for i in range(number)))
        return data

    def test_what_is_found_wrong_after_a_run_costs_nothing_of_it(self):
        data = self.timed_images(14)
        late = self.file("late.txt", "1000 0 0 0 0 0 0 1\n")
        ran = loopbit("run", data, "--out", self.out, "--truth", self.file("truth.csv", "5,1\n"),
                      "--poses", late)
        self.assert_fails(ran, 3, "1000")
        self.assertEqual(len(rows(self.out)), 14)
        record = json.loads((self.out / "run.json").read_text())
        self.assertEqual((record["stopped_by"], record["score"]["positives"]), ("end", 1))
        self.assertTrue((self.out / "report.html").exists())

    # report and compare

    def test_a_run_ends_with_a_report_unless_unwanted(self):
        self.assertIn(str(self.reference / "report.html"), self.reference_output)
        self.assertIn("evidence.db", os.listdir(self.reference))
        plain = loopbit("run", self.few_images(), "--out", self.out, "--no-report")
        self.assertEqual(plain.returncode, 0, plain.stderr)
        self.assertEqual(sorted(os.listdir(self.out)), ["late_loops.csv", "loops.csv", "run.json"])
        made = loopbit("report", self.out)
        self.assertEqual(made.returncode, 0, made.stderr)
        self.assertIn("report.html", os.listdir(self.out))

    def test_the_size_of_a_report_can_be_set(self):
        page = self.scratch / "page.html"
        sizes = []
        for budget in (0, 0.1, 50):
            made = loopbit("report", self.reference, "--out", page, "--pictures-mb", budget)
            self.assertEqual(made.returncode, 0, made.stderr)
            sizes.append(page.stat().st_size)
        self.assertLess(sizes[1] - sizes[0], 0.15e6)
        self.assertGreater(sizes[1], sizes[0])
        self.assertGreater(sizes[2], sizes[1])

    def test_a_report_goes_where_it_is_told_or_says_why_not(self):
        matches = self.file("other.csv", "5,1\n")
        self.assert_fails(loopbit("report", matches), 2, matches, "--out")
        self.assert_fails(loopbit("report", matches, "--out", self.scratch / "no/page.html"), 4,
                          self.scratch / "no/page.html")
        page = self.scratch / "page.html"
        self.assertEqual(loopbit("report", matches, "--out", page).returncode, 0)
        self.assert_fails(loopbit("report", matches, "--out", page, "--open",
                                  environment={"PATH": ""}), 4, page, "xdg-open")

    def test_damaged_evidence_is_named(self):
        folder = self.scratch / "run"
        shutil.copytree(self.reference, folder)
        (folder / "evidence.db").write_bytes(b"SQLite format 3\0" + bytes(2000))
        self.assert_fails(loopbit("report", folder), 3, folder / "evidence.db")

    def test_runs_stand_side_by_side(self):
        strict = self.scratch / "strict"
        ran = loopbit("run", self.images, "--out", strict, "--set", "decision.min_score=0.999999")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        other = self.file("dbow2.csv", "query,match,score\n30,1,0.5\n")
        page = self.scratch / "page.html"
        compared = loopbit("compare", self.reference, strict, f"DBoW2={other}", "--out", page)
        self.assertEqual(compared.returncode, 0, compared.stderr)
        lines = compared.stdout.splitlines()
        self.assertEqual([line.split()[0] for line in lines[1:4]], ["reference", "strict", "DBoW2"])
        table = json.loads(loopbit("compare", self.reference, strict, "--json").stdout)
        self.assertEqual(table[0]["recall"], self.score(self.reference)["recall"])
        self.assertLessEqual(table[1]["recall"], table[0]["recall"])
        self.assertEqual(table[0]["positives"], table[1]["positives"])
        self.assertIn("p99", table[0]["time_ms"])
        self.assertGreater(page.stat().st_size, 10000)

    def plotted(self, *command):
        """The points of the curves, the decisions and the words of a plot."""
        plot = self.scratch / "plot.svg"
        ran = loopbit(*command, "--plot", plot)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertIn(f"plot       {plot}", ran.stdout)
        svg = ElementTree.parse(plot).getroot()
        tag = "{http://www.w3.org/2000/svg}"
        # Of the square between the axes, the shares from its left and from its bottom.
        left, top, side = (float(svg.find(f"{tag}rect").get(key)) for key in ("x", "y", "width"))
        share = lambda x, y: ((float(x) - left) / side, 1 - (float(y) - top) / side)
        curves = [[share(*point.split(",")) for point in line.get("points").split()]
                  for line in svg.iter(f"{tag}polyline") if line.get("stroke-width")]
        dots = [share(dot.get("cx"), dot.get("cy")) for dot in svg.iter(f"{tag}circle")]
        return curves[::2], dots, [text.text for text in svg.iter(f"{tag}text")]

    def test_a_plot_shows_what_eval_prints(self):
        curves, dots, words = self.plotted("eval", self.reference)
        score = self.score(self.reference)
        expected = [(point["recall"], point["precision"]) for point in score["curve"]]
        for some, others in ((curves[0], expected), (expected, curves[0]),
                             (dots, [(score["recall"], score["precision"])])):
            for x, y in some:
                self.assertLess(min(abs(x - u) + abs(y - v) for u, v in others), 0.001, (x, y))
        self.assertIn("reference", words)

    def test_a_plot_shows_all_compared_runs(self):
        other = self.file("dbow2.csv", "query,match,score\n30,1,0.5\n")
        curves, dots, words = self.plotted("compare", self.reference, f"A&B<2>={other}")
        self.assertEqual([len(curves), len(dots), words[-2:]], [2, 2, ["reference", "A&B<2>"]])
        nowhere = self.scratch / "none/plot.svg"
        self.assert_fails(loopbit("eval", self.reference, "--plot", nowhere), 4, nowhere)

    def test_pairs_of_images_are_those_of_the_loops(self):
        loops = [row for row in rows(self.reference) if row["status"] == "loop"]
        late = next(row for row in rows(self.reference) if row["status"] == "low_score")
        last = len(rows(self.reference)) - 1
        run = self.scratch / "run"
        run.mkdir()
        shutil.copy(self.reference / "loops.csv", run)
        (run / "late_loops.csv").write_text(
            "frame,kind,match,score,similarity,reported_at,name,match_name\n"
            f"{late['frame']},late,0,0.99,0.5,{last},{late['name']},000000.png\n"
            f"{loops[0]['frame']},withdrawn,{loops[0]['match']},0.1,0.5,{last},,\n")
        expected = "".join(f"{query} {match}\n" for query, match in [
            *[(row["name"], row["match_name"]) for row in loops[1:]], (late["name"], "000000.png")])
        self.assertEqual(loopbit("pairs", run).stdout, expected)
        pairs = self.scratch / "pairs.txt"
        self.assertEqual(loopbit("pairs", run, "--out", pairs).returncode, 0)
        self.assertEqual(pairs.read_text(), expected)

    def test_pairs_need_names_that_a_list_can_hold(self):
        run = self.scratch / "run"
        run.mkdir()
        header, *lines = (self.reference / "loops.csv").read_text().splitlines()
        at = header.split(",").index("name")
        loop = next(row for row in rows(self.reference) if row["status"] == "loop")
        for name in ("a b.png", "a\\x2cb.png", ""):
            with self.subTest(name):
                cells = [line.split(",") for line in lines]
                cells[int(loop["match"])][at] = name
                changed = [",".join(row) for row in cells]
                (run / "loops.csv").write_text("\n".join([header, *changed, ""]))
                self.assert_fails(loopbit("pairs", run), 3, f"Frame {loop['match']}", f"'{name}'")

    def test_a_run_that_lost_rows_is_refused(self):
        run = self.scratch / "run"
        shutil.copytree(self.reference, run)
        lines = (run / "loops.csv").read_text().splitlines(keepends=True)
        (run / "loops.csv").write_text("".join(lines[:30]))
        for command in ("eval", "report", "pairs"):
            self.assert_fails(loopbit(command, run), 3, f"{run}/loops.csv' has 29 rows", f"counts {len(lines) - 1}")

    def test_runs_that_cannot_be_compared(self):
        short = self.scratch / "short"
        ran = loopbit("run", self.few_images(), "--out", short)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assert_fails(loopbit("compare", self.reference, short), 3, "14", str(FRAMES))
        self.assert_fails(loopbit("compare", short, short), 2, "--truth")
        one = loopbit("compare", self.reference)
        self.assertEqual(one.returncode, 2)
        self.assertIn("RUN", one.stderr)

    def test_the_order_of_runs_changes_no_number(self):
        half = self.scratch / "half"
        ran = loopbit("run", self.images, "--out", half, "--every", 2, "--no-report")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        matches = [f"{row['frame']},{row['match']},{row['score']}" for row in rows(half)
                   if row["status"] == "loop"]
        other = self.file("other.csv", "\n".join(matches[:len(matches) // 2]) + "\n")
        truth = ["--truth", self.dataset / "truth.csv", "--not-false",
                 self.dataset / "not_false.csv"]
        expected = self.score(half, *truth)
        tables = [{row["name"]: row for row in json.loads(
            loopbit("compare", *runs, *truth, "--json").stdout)}
                  for runs in ((half, other), (other, half))]
        self.assertEqual(tables[0], tables[1])
        self.assertEqual(tables[0]["half"]["recall"], expected["recall"])
        self.assertEqual(tables[0]["other"]["positives"], expected["positives"])
        self.assertEqual(tables[0]["other"]["wrong"], 0)
        late = self.file("late.csv", f"{FRAMES},1\n")
        self.assert_fails(loopbit("compare", late, half, *truth), 3, "late", str(FRAMES))

    def test_another_detector_may_be_scored_by_a_trajectory(self):
        data = self.timed_images(20)
        poses = self.file("tum.txt", "".join(f"{0.1 * i:.3f} {i % 10} 0 0 0 0 0 1\n"
                                             for i in range(20)))
        ran = loopbit("run", data, "--out", self.out, "--no-report")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        truth = ["--truth", poses, "--truth-set", "min_gap_frames=5", "--truth-set", "radius_m=0.5"]
        table = json.loads(loopbit("compare", self.file("other.csv", "15,5\n"), self.out, *truth,
                                   "--json").stdout)
        self.assertEqual((table[0]["positives"], table[0]["right"]), (10, 1))

    def test_runs_that_read_other_frames_are_not_compared(self):
        runs = [self.scratch / name for name in ("half", "first")]
        for run, flags in zip(runs, (("--every", 2), ("--limit", FRAMES // 2))):
            ran = loopbit("run", self.images, "--out", run, "--no-report", *flags)
            self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assert_fails(loopbit("compare", *runs, "--truth", self.dataset / "truth.csv"), 3,
                          "one frame in 2", "all frames")

    def test_a_changed_record_is_named(self):
        folder = self.scratch / "run"
        shutil.copytree(self.reference, folder)
        whole = json.loads((folder / "run.json").read_text())
        for part in ({"score": None}, {"score": {"protocol": "of old"}}, {"new": 1}):
            (folder / "run.json").write_text(json.dumps({**whole, **part}))
            self.assertEqual(loopbit("eval", folder).returncode, 0, part)
        for part, key in (({"score": []}, "score"), ({"input": "x"}, "input"),
                          ({"score": {"tolerance_frames": "x"}}, "score.tolerance_frames")):
            (folder / "run.json").write_text(json.dumps({**whole, **part}))
            for command in ("eval", "report"):
                self.assert_fails(loopbit(command, folder), 3, folder / "run.json", f"'{key}'")
            self.assert_fails(loopbit("compare", folder, folder), 3, folder / "run.json", f"'{key}'")
        (folder / "run.json").write_text('{"score"')
        self.assert_fails(loopbit("eval", folder), 3, folder, "run.json")

    # Real results of others.

    def test_published_loops_of_ibow_lcd(self):
        if not os.environ.get("LOOPBIT_DATA"):
            self.skipTest("LOOPBIT_DATA names no folder of real data")
        truth = pathlib.Path(os.environ["LOOPBIT_DATA"]) / "truth"
        scored = self.score(truth / "published" / "ibow_lcd_city_centre.csv", "--truth",
                            truth / "mat" / "city_centre_htmap.mat", "--protocol", "ibow-lcd")
        self.assertEqual((scored["right"], scored["wrong"], scored["positives"]), (495, 0, 561))
        self.assertAlmostEqual(scored["recall"], 0.8824, 4)


if __name__ == "__main__":
    unittest.main()
