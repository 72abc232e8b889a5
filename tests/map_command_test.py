#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Maps as a user meets them: loopbit run --map, query and map."""

import concurrent.futures
import contextlib
import csv
import json
import os
import pathlib
import re
import shutil
import signal
import sqlite3
import struct
import subprocess
import time
import unittest
import zlib

from loopbit_command import FRAMES, LOOPBIT, QUICK, CommandTest, loopbit, repeats_when_sanitized, rows, started

LAP = FRAMES // 2


def has_open(pid, path):
    """Whether a process has opened a file."""
    for descriptor in pathlib.Path(f"/proc/{pid}/fd").iterdir():
        with contextlib.suppress(OSError):    # it was closed just now
            if descriptor.samefile(path):
                return True
    return False


class MapCommandTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        # Two laps as two sessions.
        images = sorted(cls.images.iterdir())
        cls.laps = []
        for number, files in enumerate((images[:LAP], images[LAP:]), start=1):
            folder = cls.shared / f"lap{number}"
            folder.mkdir()
            for file in files:
                shutil.copy(file, folder)
            cls.laps.append(folder)
        cls.made = cls.shared / "made"
        cls.made.mkdir()
        cls.map = cls.made / "town.db"
        cls.alone = [cls.shared / f"alone{number}.db" for number in (1, 2)]    # maps of one lap each
        cls.runs = []
        for lap, path in ((0, cls.map), (1, cls.map), (1, cls.alone[1])):
            cls.runs.append(loopbit("run", cls.laps[lap], "--map", path, "--no-report"))
            assert cls.runs[-1].returncode == 0, cls.runs[-1].stderr
            if lap == 0:
                shutil.copy(cls.map, cls.alone[0])

    def copy_of_map(self):
        return pathlib.Path(shutil.copy(self.map, self.scratch / "copy.db"))

    def test_a_run_continues_the_map_and_leaves_a_folder_beside_it(self):
        self.assertIn(f"{self.map}, session 2", self.runs[1].stdout)
        record = json.loads((self.made / "town_session_2/run.json").read_text())
        self.assertEqual(record["map"], {"path": str(self.map), "session": 2})
        self.assertFalse(list(self.made.glob("town.db-*")), "the log is left")
        self.assertFalse(list(self.made.glob("*.lock")))

    def test_checksums_are_those_of_zlib_as_the_docs_describe(self):
        town = self.scratch / "town.db"
        made = loopbit("run", self.dataset, "--odometry", self.dataset / "odometry.txt", "--map", town,
                       "--keep-images", "--no-report")
        self.assertEqual(made.returncode, 0, made.stderr)
        queries = {
            "session": "SELECT session, frames, uid, name, started, loopbit, options, checksum "
                       "FROM session",
            "place": "SELECT session, frame, ifnull(timestamp, 0.0), content, checksum FROM place",
            "features": "SELECT session, frame, features, f.checksum FROM features AS f "
                        "JOIN place USING (place)",
            "image": "SELECT image, session, frame, i.checksum FROM image AS i "
                     "JOIN place USING (place)",
            "loop": "SELECT session, frame, match_session, match_frame, score, similarity, "
                    "matches, inliers, checksum FROM loop",
            "odometry": "SELECT pose, session, frame, ifnull(timestamp, 0.0), checksum FROM odometry",
            "relative_pose": "SELECT pose, session, frame, match_session, match_frame, known, "
                             "checksum FROM relative_pose",
            "linked": "SELECT session, checksum FROM linked"}
        encoders = {int: lambda value: struct.pack("<q", value), str: str.encode,
                    float: lambda value: struct.pack("<d", value), bytes: bytes}
        for table, query in queries.items():
            checked = sqlite3.connect(town).execute(query).fetchall()
            for *values, checksum in checked:
                data = b"".join(encoders[type(value)](value) for value in values)
                self.assertEqual(zlib.crc32(data), checksum, table)
            self.assertTrue(checked or QUICK, table)

    @unittest.skipIf(QUICK, "too few frames")
    def test_the_second_lap_is_recognised_as_session_and_frame(self):
        found = rows(self.made / "town_session_2")
        earlier = [row for row in found
                   if row["status"] == "loop" and re.fullmatch(r"1:\d+", row["match"])]
        self.assertGreater(len(earlier), len(found) / 2)

    def test_json_names_the_session_of_a_match(self):
        ran = loopbit("run", self.laps[1], "--map", self.copy_of_map(), "--no-report", "--json",
                      "--limit", LAP // 2)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        found = [json.loads(line) for line in ran.stdout.splitlines()][:-1]
        expected = [row["match"].split(":") for row in rows(self.scratch / "copy_session_3")
                    if row["status"] == "loop" and ":" in row["match"]]
        self.assertEqual([[str(n) for n in loop["earlier_match"].values()]
                          for loop in found if "match" not in loop], expected)
        self.assertTrue(expected or QUICK)

    def test_a_run_with_a_map_can_be_scored_and_shown(self):
        run = self.made / "town_session_2"
        truth = self.scratch / "truth.csv"
        truth.write_text("5,1,2\n")
        self.assertEqual(loopbit("report", run, "--out", self.scratch / "page.html").returncode, 0)
        for scored in (run, run / "loops.csv"):
            ran = loopbit("eval", scored, "--truth", truth)
            self.assertEqual(ran.returncode, 0, ran.stderr)

    def test_a_file_mounted_under_another_name_is_not_written(self):
        town, alias = self.copy_of_map(), self.scratch / "alias.db"
        alias.touch()
        before = town.read_bytes()
        # In a mount namespace of its own.
        run = [LOOPBIT, "run", self.laps[0], "--map", alias, "--out", self.scratch / "out"]
        script = ('mount --bind "$1" "$2" || exit 99\nshift 2\n"$@"')
        ran = subprocess.run(["unshare", "-m", "sh", "-c", script, "sh", town, alias, *run],
                             capture_output=True, text=True, stdin=subprocess.DEVNULL)
        if ran.returncode == 99 or "unshare" in ran.stderr:
            self.skipTest("bind mounts are not permitted here")
        self.assert_fails(ran, 4, "alias.db", "is mounted as a single file", "mount its folder")
        self.assertEqual(town.read_bytes(), before)

    def test_a_header_that_forbids_writing_is_damage(self):
        town = self.copy_of_map()
        bytes_ = bytearray(town.read_bytes())
        bytes_[18] = 3
        town.write_bytes(bytes_)
        checked = loopbit("map", "check", town)
        self.assertEqual(checked.returncode, 3, checked.stdout)
        self.assertIn("damaged    the file: its header gives", checked.stdout)
        run = loopbit("run", self.laps[0], "--map", town, "--out", self.scratch / "out")
        self.assert_fails(run, 3, "is damaged", "--recover")
        self.assert_fails(loopbit("map", "merge", town, self.map), 3, "is damaged", "--recover")
        new = self.scratch / "new.db"
        self.assertEqual(loopbit("map", "check", town, "--recover", new).returncode, 0)
        self.assertEqual(loopbit("map", "merge", new, self.map).returncode, 0)

    def test_the_log_of_another_map_is_refused(self):
        town = self.copy_of_map()
        other = self.scratch / "other.db"
        with subprocess.Popen([LOOPBIT, "run", self.images, "--map", other, "--no-report"],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as killed:
            log = self.scratch / "other.db-wal"
            while not log.exists() or log.stat().st_size < 100_000:
                self.assertIsNone(killed.poll())
                time.sleep(0.002)
            killed.kill()
        stray = pathlib.Path(shutil.copy(log, f"{town}-wal"))
        before = town.read_bytes(), stray.read_bytes()
        run = ("run", self.laps[0], "--map", town, "--out", self.scratch / "out")
        for command in (run, ("map", "check", town), ("map", "info", town)):
            self.assert_fails(loopbit(*command), 3, str(stray), "of another map")
        self.assertEqual((town.read_bytes(), stray.read_bytes()), before)
        stray.unlink()
        self.assertEqual(loopbit("map", "check", town).returncode, 0)
        self.assertEqual(loopbit("map", "check", other).returncode, 0)

    @repeats_when_sanitized
    def test_other_settings_are_refused_before_anything_is_written(self):
        ran = loopbit("run", self.laps[0], "--map", self.map, "--out", self.out, "--set",
                      "surf.max_keypoints=100")
        self.assert_fails(ran, 2, self.map, "surf.max_keypoints", "600", "100")
        self.assertFalse(self.out.exists())

    @repeats_when_sanitized
    def test_a_refused_run_leaves_the_map_as_it_is(self):
        copy = self.copy_of_map()
        before = copy.read_bytes()
        ran = loopbit("run", self.laps[0], "--map", copy, "--out", self.out, "--set",
                      "surf.max_keypoints=100")
        self.assert_fails(ran, 2, copy, "surf.max_keypoints")
        self.assertEqual(copy.read_bytes(), before)
        self.assertEqual(list(self.scratch.iterdir()), [copy])

    def test_a_second_writer_is_refused_and_readers_are_not(self):
        copy = self.copy_of_map()
        holder = subprocess.Popen(
            [LOOPBIT, "run", self.images, "--map", copy, "--out", self.scratch / "holder"],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            for _ in range(200):
                if (self.scratch / "holder/loops.csv").exists():
                    break
                time.sleep(0.02)
            holder.send_signal(signal.SIGSTOP)
            self.assert_fails(loopbit("run", self.images, "--map", copy, "--out", self.out), 4,
                              copy, "being written")
            self.assertEqual(loopbit("map", "list", copy).returncode, 0)
            self.assertEqual(loopbit("query", copy, self.laps[0] / "000003.png").returncode, 0)
        finally:
            holder.kill()
            holder.wait()
        # Nothing stale is left by the kill.
        ran = loopbit("run", self.few_images(), "--map", copy, "--out", self.out)
        self.assertEqual(ran.returncode, 0, ran.stderr)

    def test_an_interrupt_saves_what_was_seen(self):
        path = self.scratch / "cut.db"
        process = subprocess.Popen([LOOPBIT, "run", self.images, "--map", path, "--out", self.out],
                                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL)
        while not (self.out / "loops.csv").exists() or len(rows(self.out)) < 5:
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        self.assertIn(process.wait(), (0, 130))
        sessions = json.loads(loopbit("map", "list", path, "--json").stdout)
        self.assertEqual([s["places"] for s in sessions], [len(rows(self.out))])

    def test_a_session_that_answered_nothing_leaves_its_folder_to_the_next(self):
        path = self.scratch / "new.db"
        run = ["run", self.few_images(), "--map", path, "--no-report"]
        folder = self.scratch / "new_session_1"
        folder.mkdir()
        header, *answers = (self.made / "town_session_1/loops.csv").read_text().splitlines(True)
        (folder / "loops.csv").write_text(header + answers[0])
        self.assert_fails(loopbit(*run), 4, folder, "--overwrite")
        self.assertEqual((folder / "loops.csv").read_text(), header + answers[0])
        (folder / "loops.csv").write_text(header)
        ran = loopbit(*run)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertEqual(len(rows(folder)), 14)

    # query

    def test_query_answers_in_a_table_and_in_json(self):
        image = self.laps[0] / "000007.png"
        table = loopbit("query", self.map, image)
        self.assertEqual(table.returncode, 0, table.stderr)
        first = table.stdout.splitlines()[1].split()
        self.assertEqual(first[:4], [str(image), "loop", "1", "7"])
        ran = loopbit("query", self.map, image, "--json", "--places", "2")
        answer = json.loads(ran.stdout)
        self.assertEqual(answer["status"], "loop")
        self.assertEqual(len(answer["places"]), 2)
        self.assertEqual((answer["places"][0]["session"], answer["places"][0]["frame"]), (1, 7))

    def test_query_goes_on_after_an_unreadable_image(self):
        broken = self.scratch / "broken.png"
        broken.write_text("no image")
        ran = loopbit("query", self.map, broken, self.laps[0] / "000001.png", "--json")
        self.assertEqual(ran.returncode, 0)
        answers = [json.loads(line) for line in ran.stdout.splitlines()]
        self.assertEqual([a["status"] for a in answers], ["unreadable", "loop"])
        self.assertIn("broken.png", ran.stderr)
        self.assertEqual(loopbit("query", self.map, broken).returncode, 3)

    @repeats_when_sanitized
    def test_query_goes_on_after_an_image_that_is_not_there(self):
        ran = loopbit("query", self.map, self.scratch / "none.png", self.laps[0] / "000001.png",
                      "--json")
        self.assertEqual(ran.returncode, 0)
        answers = [json.loads(line) for line in ran.stdout.splitlines()]
        self.assertEqual([a["status"] for a in answers], ["unreadable", "loop"])
        self.assertIn("does not exist", ran.stderr)

    def test_query_tells_images_of_one_name_apart(self):
        folders = []
        for number in (1, 2):
            folder = self.scratch / str(number)
            folder.mkdir()
            shutil.copy(self.laps[0] / f"00000{number}.png", folder / "same.png")
            folders.append(folder)
        images = [folder / "same.png" for folder in folders]
        for asked in (images, folders):
            ran = loopbit("query", self.map, *asked, "--json")
            answers = [json.loads(line) for line in ran.stdout.splitlines()]
            self.assertEqual([a["image"] for a in answers], [str(image) for image in images])

    def test_query_says_what_is_missing(self):
        self.assert_fails(loopbit("query", self.scratch / "none.db", "x.png"), 3, "none.db", "--map")
        self.assert_fails(loopbit("query", self.map), 2, "--watch")
        self.assert_fails(loopbit("query", self.map, "x.png", "--set", "surf.upright=false"), 2,
                          "surf.upright", self.map)
        self.assert_fails(loopbit("query", self.map, "x.png", "--set", "exclusion.seconds=5"), 2,
                          "exclusion.seconds", "no effect")

    def test_watch_answers_images_as_they_come(self):
        folder = self.scratch / "incoming"
        folder.mkdir()
        with started("query", self.map, "--watch", folder, "--json") as watch:
            for name in ("000004.png", "000009.png"):
                shutil.copy(self.laps[0] / name, folder)
                answer = json.loads(watch.stdout.readline())
                self.assertEqual(answer["image"], name)
                self.assertEqual(answer["places"][0]["frame"], int(name[:6]))
            watch.send_signal(signal.SIGINT)
            self.assertEqual(watch.wait(), 0)

    def test_watch_answers_an_image_again_when_it_has_come_whole(self):
        folder = self.scratch / "incoming"
        folder.mkdir()
        whole = (self.laps[0] / "000004.png").read_bytes()
        with started("query", self.map, "--watch", folder, "--json") as watch:
            for bytes_there, status in ((len(whole) // 2, "unreadable"), (len(whole), "loop")):
                (folder / "slow.png").write_bytes(whole[:bytes_there])
                self.assertEqual(json.loads(watch.stdout.readline())["status"], status)
            watch.send_signal(signal.SIGINT)
            self.assertEqual(watch.wait(), 0)

    def test_watch_goes_on_when_an_image_is_gone_before_it_is_read(self):
        folder = self.few_images()
        first, *others = sorted(folder.iterdir())
        with started("query", self.map, "--watch", folder, "--json") as watch:
            self.assertEqual(json.loads(watch.stdout.readline())["image"], first.name)
            for image in reversed(others):
                image.unlink()
            answers = [json.loads(watch.stdout.readline()) for _ in others]
            self.assertIn(others[-1].name, answers[-1]["image"])
            self.assertEqual(answers[-1]["status"], "unreadable")
            shutil.copy(self.laps[0] / "000004.png", folder / "again.png")
            self.assertEqual(json.loads(watch.stdout.readline())["status"], "loop")
            watch.send_signal(signal.SIGINT)
            self.assertEqual(watch.wait(), 0)

    # map

    def test_info_and_list(self):
        info = json.loads(loopbit("map", "info", self.map, "--json").stdout)
        self.assertEqual((info["sessions"], info["places"]), (2, FRAMES))
        self.assertEqual(info["options"]["surf"]["max_keypoints"], 600)
        self.assertIn("sessions   2", loopbit("map", "info", self.map).stdout)
        sessions = json.loads(loopbit("map", "list", self.map, "--json").stdout)
        self.assertEqual([s["name"] for s in sessions], [str(lap) for lap in self.laps])
        self.assertEqual([s["frames"] for s in sessions], [LAP, FRAMES - LAP])
        self.assertIn(sessions[1]["uid"], loopbit("map", "list", self.map).stdout)

    @unittest.skipIf(QUICK, "too few frames")
    def test_an_export_is_what_eval_reads(self):
        edges = self.scratch / "edges.csv"
        self.assertEqual(loopbit("map", "export", self.map, "--out", edges).returncode, 0)
        ran = loopbit("eval", edges, "--truth", self.dataset / "truth.csv", "--not-false",
                      self.dataset / "not_false.csv", "--json")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertGreater(json.loads(ran.stdout)["recall"], 0.5)
        loops = json.loads(loopbit("map", "export", self.map, "--format", "json").stdout)["loops"]
        self.assertEqual(len(loops), len(edges.read_text().splitlines()) - 1)
        g2o = loopbit("map", "export", self.map, "--format", "g2o").stdout.splitlines()
        self.assertEqual(sum(line.startswith("EDGE_SE3:QUAT") for line in g2o), len(loops))

    def test_an_export_replaces_no_link_and_no_pipe(self):
        link, file, pipe = (self.scratch / name for name in ("link", "file.csv", "pipe"))
        link.symlink_to(file.name)
        export = ["map", "export", self.map, "--out"]
        text = loopbit("map", "export", self.map).stdout
        for _ in range(2):  # makes the file, then replaces it
            self.assertEqual(loopbit(*export, link).returncode, 0)
            self.assertTrue(link.is_symlink())
            self.assertEqual(file.read_text(), text)
            self.assertEqual(len(list(self.scratch.iterdir())), 2)
        os.mkfifo(pipe)
        reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
        self.assertEqual(loopbit(*export, pipe).returncode, 0)
        self.assertTrue(pipe.is_fifo())
        self.assertEqual(os.read(reader, 1 << 16).decode(), text)
        os.close(reader)
        self.assert_fails(loopbit(*export, "/dev/full"), 4, "/dev/full", "space")

    def test_images_are_kept_shown_and_forgotten(self):
        path, shown, all_images = (self.scratch / name for name in ("kept.db", "shown", "all"))
        few = self.few_images()
        ran = loopbit("run", few, "--map", path, "--keep-images", "--no-report")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        info = json.loads(loopbit("map", "info", path, "--json").stdout)
        self.assertEqual(info["images"], 14)
        self.assertGreater(info["image_bytes"], 14 * 1000)
        self.assertIn("images     14", loopbit("map", "info", path).stdout)

        ran = loopbit("query", path, few / "000007.png", "--places", "1", "--json",
                      "--place-images", shown)
        file = pathlib.Path(json.loads(ran.stdout)["places"][0]["image"])
        self.assertEqual(file, shown / "1_000007.jpg")
        self.assertEqual(loopbit("query", path, file, "--places", "1").stdout.split()[-5:-3],
                         ["1", "7"])
        self.assert_fails(loopbit("query", path, file, "--place-images", shown), 4, shown)

        self.assertIn("14 in", loopbit("map", "images", path, "--out", all_images).stdout)
        self.assertEqual((all_images / "1_000007.jpg").read_bytes(), file.read_bytes())
        self.assertEqual(len(list(all_images.iterdir())), 14)
        self.assert_fails(loopbit("map", "images", path, "--out", all_images), 4, all_images)

        self.assertEqual(loopbit("map", "compact", path, "--drop-images").returncode, 0)
        self.assertIn("14 places, 0 loops, 0 images", loopbit("map", "check", path).stdout)

    @repeats_when_sanitized
    def test_images_need_a_map(self):
        ran = loopbit("run", self.laps[0], "--out", self.out, "--keep-images")
        self.assertEqual(ran.returncode, 2)
        self.assertIn("--keep-images requires --map", ran.stderr)
        self.assertFalse(self.out.exists())

    def test_merge_compact_and_check(self):
        merged = self.scratch / "merged.db"
        self.assertIn("2 sessions", loopbit("map", "merge", merged, self.map).stdout)
        self.assertIn("already there: 2 sessions",
                      loopbit("map", "merge", merged, self.map).stdout)
        self.assertIn(f"{FRAMES} places", loopbit("map", "check", merged).stdout)
        self.assertIn(f"20 of {FRAMES} kept",
                      loopbit("map", "compact", merged, "--budget", 20).stdout)
        self.assertEqual(loopbit("map", "compact", merged, "--drop", 1).returncode, 0)
        sessions = json.loads(loopbit("map", "list", merged, "--json").stdout)
        self.assertEqual([s["session"] for s in sessions], [2])
        self.assert_fails(loopbit("map", "compact", merged), 2, "--drop", "--budget")
        self.assert_fails(loopbit("map", "compact", merged, "--drop", 9), 2, "session 9")

    def test_link_finds_the_loops_between_merged_maps(self):
        first, second, met = self.scratch / "first.db", self.alone[1], self.map
        shutil.copy(self.alone[0], first)

        def loops(map):
            rows = csv.DictReader(loopbit("map", "export", map).stdout.splitlines())
            return [row for row in rows if row["query_session"] != row["match_session"]]

        merged = loopbit("map", "merge", first, second)
        self.assertIn(f"next       loopbit map link {first}", merged.stdout)
        self.assertIn(f"loopbit map link {first}", loopbit("map", "info", first).stdout)
        self.assertEqual(loops(first), [])
        linked = loopbit("map", "link", first)
        self.assertEqual(linked.returncode, 0, linked.stderr)
        self.assertGreater(len(loops(met)), LAP // 2)
        self.assertEqual(loops(first), loops(met))
        self.assertIn(f"1 session, {LAP} places: {len(loops(met))} new loops", linked.stdout)
        before = first.read_bytes()
        again = loopbit("map", "link", first)
        self.assertIn("all sessions were compared", again.stdout)
        self.assertEqual(first.read_bytes(), before)
        self.assertEqual([s["linked"] for s in json.loads(
            loopbit("map", "list", first, "--json").stdout)], [True, True])
        info = json.loads(loopbit("map", "info", first, "--json").stdout)
        self.assertEqual((info["unlinked_sessions"], info["rejected_loops"]), (0, 0))

    def test_a_link_that_is_interrupted_or_killed_leaves_the_map_whole(self):
        merged, copy = self.scratch / "m.db", self.scratch / "copy.db"
        shutil.copy(self.alone[0], merged)
        loopbit("map", "merge", merged, self.alone[1])
        before = merged.read_bytes()
        ended = set()
        for attempt in range(40):    # some come after its end
            shutil.copy(merged, copy)
            with started("map", "link", copy) as link:
                while link.poll() is None and not has_open(link.pid, copy):
                    time.sleep(0.001)
                time.sleep(0.02 * (attempt // 2 % 5))
                link.send_signal(signal.SIGKILL if attempt % 2 else signal.SIGINT)
                out, err = link.communicate()
            ended.add(link.returncode)
            if link.returncode == 130:
                self.assertIn("the same command does the rest", err)
                self.assertIn("0 sessions", out)
                self.assertEqual(copy.read_bytes(), before)
            self.assertEqual(loopbit("map", "check", copy).returncode, 0)
            if ended >= {130, -signal.SIGKILL} and attempt >= 5:
                break
        self.assertGreaterEqual(ended, {130, -signal.SIGKILL})
        self.assertIn("1 session", loopbit("map", "link", merged).stdout)

    def test_damage_is_listed_recovered_and_never_written_to(self):
        copy = self.copy_of_map()
        with sqlite3.connect(copy) as database:
            database.execute("UPDATE place SET frame = 99 WHERE place = 5")
        database.close()
        check = loopbit("map", "check", copy)
        self.assertEqual(check.returncode, 3)
        self.assertIn("place 5", check.stdout)
        self.assert_fails(loopbit("run", self.laps[0], "--map", copy, "--out", self.out), 3,
                          "place 5", "--recover")
        asked = loopbit("query", copy, self.laps[0] / "000009.png")
        self.assertEqual(asked.returncode, 0)
        self.assertIn("place 5", asked.stderr)
        recovered = self.scratch / "recovered.db"
        self.assertIn(f"{FRAMES - 1} places",
                      loopbit("map", "check", copy, "--recover", recovered).stdout)
        self.assertEqual(loopbit("map", "check", recovered).returncode, 0)

    def test_damage_that_a_run_finds_is_told(self):
        copy = self.copy_of_map()
        with sqlite3.connect(copy) as database:
            database.execute("UPDATE features SET checksum = 0 WHERE place < 10")
        database.close()
        ran = loopbit("run", self.few_images(), "--map", copy, "--no-report")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertEqual(ran.stderr.count("what is damaged was left out"), 1, ran.stderr)
        self.assertRegex(ran.stderr, r"place \d \(session 1, frame \d\)")
        self.assertIn(f"loopbit map check {copy}", ran.stderr)
        self.assertEqual(len(json.loads(loopbit("map", "list", copy, "--json").stdout)), 3)

    def test_a_map_that_another_program_holds_is_not_called_damaged(self):
        copy, new = self.copy_of_map(), self.scratch / "new.db"
        holder = sqlite3.connect(copy, isolation_level=None)
        holder.execute("BEGIN EXCLUSIVE")
        commands = {("map", "info", copy): 3,
                    ("map", "check", copy, "--recover", new): 3,
                    ("run", self.laps[0], "--map", copy, "--out", self.out): 4}
        with concurrent.futures.ThreadPoolExecutor() as threads:  # each waits for ten seconds
            results = list(threads.map(lambda command: loopbit(*command), commands))
        holder.close()
        for ran, code in zip(results, commands.values()):
            self.assert_fails(ran, code, copy, "locked", "another program")
            self.assertNotRegex(ran.stderr, "damaged|free space")
        self.assertFalse(new.exists())

    def test_what_is_no_map_is_not_recovered(self):
        text, new = self.scratch / "text.db", self.scratch / "new.db"
        text.write_text("no map " * 10000)
        self.assert_fails(loopbit("map", "check", text, "--recover", new), 3, text, "copy")
        self.assertFalse(new.exists())

    def test_files_that_are_no_maps_are_named(self):
        text = self.scratch / "text.db"
        text.write_text("no map " * 1000)
        newer = self.copy_of_map()
        with sqlite3.connect(newer) as database:
            database.execute("PRAGMA user_version = 99")
        database.close()
        for command in (["info"], ["list"], ["export"], ["check"], ["compact", "--drop", "1"]):
            self.assert_fails(loopbit("map", command[0], text, *command[1:]), 3, text)
            self.assert_fails(loopbit("map", command[0], newer, *command[1:]), 3, "version 99")
        self.assert_fails(loopbit("map", "merge", newer, self.map), 3, "version 99")


if __name__ == "__main__":
    unittest.main()
