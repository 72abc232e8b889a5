#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Maps on a PostgreSQL server, which this starts: the command, and the program fleet_map_test.

    fleet_command_test.py LOOPBIT FLEET_MAP_TEST [--search DIR] [--quick] [unittest arguments]

--search: where the extension of the server is.
"""

import contextlib
import csv
import json
import os
import pathlib
import signal
import sqlite3
import subprocess
import sys
import time
import unittest

FLEET_MAP_TEST = sys.argv.pop(2)
SEARCH = None
if sys.argv[2:3] == ["--search"]:
    SEARCH = pathlib.Path(sys.argv[3])
    del sys.argv[2:4]
sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / "scripts"))

from loopbit_command import (FRAMES, QUICK, CommandTest, decisions, loopbit, repeats_when_sanitized,    # noqa: E402
                             started)
from postgres_server import ENCODED_PASSWORD, PASSWORD, PostgresServer    # noqa: E402
from served_command import TIME_LIMIT_S    # noqa: E402

HALF = FRAMES // 2
# Longer than a server is away, which costs a slow build fewer frames.
LAPS = 2 if QUICK else 5
WAITS = 8 if QUICK else 60


def without(text, *names):
    for name in names:
        text = text.replace(str(name), "MAP")
    return text


class FleetTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.server = PostgresServer(extension=SEARCH, limit_s=TIME_LIMIT_S)
        cls.addClassCleanup(cls.server.close)
        cls.server.sql("postgres", "CREATE DATABASE town", "CREATE DATABASE copy", "CREATE DATABASE empty",
                       "CREATE DATABASE cpp")
        cls.town = cls.server.address("town")
        created = loopbit("map", "create", cls.town)
        assert created.returncode == 0, created.stderr
        for role, rights in (("robot1", "loopbit_writer"), ("robot2", "loopbit_writer"),
                             ("viewer", "loopbit_reader"), ("stranger", None)):
            cls.server.sql("town", f"CREATE ROLE {role} LOGIN PASSWORD '{PASSWORD}'")
            if rights:
                cls.server.sql("town", f"GRANT {rights} TO {role}")
        cls.robot = cls.server.address("town", "robot1")
        cls.file = cls.shared / "town.db"
        cls.fleet = cls.shared / "fleet"
        cls.fleet.mkdir()
        cls.runs = []
        images = sorted(cls.images.iterdir())
        cls.long = cls.shared / "long.txt"
        cls.waiting = cls.shared / "waiting.txt"    # 5 frames again and again, then the session
        cls.waiting.write_text("".join(f"{image}\n" for image in WAITS * images[HALF:HALF + 5] + images[HALF:]))
        cls.long.write_text("".join(f"{image}\n" for image in LAPS * images[HALF:]))
        for name, files in (("first", images[:HALF]), ("second", images[HALF:])):
            folder = cls.shared / name
            folder.mkdir()
            for file in files:
                (folder / file.name).symlink_to(file)
            for map_path in (cls.file, cls.robot):
                ran = loopbit("run", folder, "--map", map_path, "--no-report", cwd=cls.fleet)
                assert ran.returncode == 0, ran.stderr
                cls.runs.append(ran)

    def lines(self, *arguments):
        ran = loopbit(*arguments)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        # A slow machine tells how far it is.
        self.assertEqual([line for line in ran.stderr.splitlines() if " frames/s, " not in line], [])
        return ran.stdout.splitlines()

    def test_program(self):
        environment = {**os.environ, "LOOPBIT_FLEET_ADDRESS": self.server.address("cpp")}
        ran = subprocess.run([FLEET_MAP_TEST], env=environment, capture_output=True, text=True,
                             timeout=TIME_LIMIT_S)
        self.assertEqual(ran.returncode, 0, ran.stdout + ran.stderr)

    def test_runs_answer_as_with_a_file(self):
        shown = self.server.address("town", "robot1", None)
        for session in (1, 2):
            of_file = decisions(self.shared / f"town_session_{session}")
            self.assertEqual(decisions(self.fleet / f"town_session_{session}"), of_file)
        self.assertIn(f"{shown}, session 2", self.runs[3].stdout)
        loops = [row for row in of_file if row["status"] == "loop"]
        self.assertTrue(QUICK or any(row["match"].startswith("1:") for row in loops))

    def test_passwords_are_not_written(self):
        for ran in self.runs:
            self.assertNotIn("p%253A", ran.stdout + ran.stderr)
        for folder in self.fleet.glob("town_session_*"):
            for file in folder.rglob("*"):
                if file.is_file():
                    data = file.read_bytes()
                    self.assertNotIn(PASSWORD.encode(), data, file)
                    self.assertNotIn(ENCODED_PASSWORD.encode(), data, file)
        record = json.loads((self.fleet / "town_session_2/run.json").read_text())
        shown = self.server.address("town", "robot1", None)
        self.assertEqual(record["map"], {"path": shown, "session": 2})
        self.assertIn(shown, record["arguments"])

    @repeats_when_sanitized
    def test_queries_and_exports_answer_as_of_a_file(self):
        viewer = self.server.address("town", "viewer")
        shown = self.server.address("town", "viewer", None)
        image = sorted(self.images.iterdir())[3]
        answer = json.loads(self.lines("query", viewer, image, "--json")[0])
        self.assertIn(answer.pop("epoch", None),    # none if the server searches
                      (None, self.server.latest_epoch("town")))
        self.assertEqual(answer, json.loads(self.lines("query", self.file, image, "--json")[0]))
        for form in ("csv", "g2o"):
            self.assertEqual(self.lines("map", "export", viewer, "--format", form),
                             self.lines("map", "export", self.file, "--format", form))
        self.assertEqual(self.lines("map", "check", viewer), self.lines("map", "check", self.file))
        info, of_file = ["\n".join(self.lines("map", "info", path, "--json"))
                         for path in (viewer, self.file)]
        info, of_file = json.loads(info), json.loads(of_file)
        self.assertEqual(info.pop("path"), shown)
        self.assertGreater(info.pop("bytes"), 1e5)
        del of_file["path"], of_file["bytes"]
        self.assertEqual(info, of_file)
        self.assertIn(shown, self.lines("map", "info", viewer)[0])
        self.assertEqual(len(self.lines("map", "list", viewer)), 3)

    def test_maps_move_between_files_and_servers(self):
        copy = self.server.address("copy")
        self.lines("map", "create", copy)
        self.assertEqual(self.lines("map", "create", copy),
                         [f"exists     {self.server.address('copy', password=None)}"])
        back = self.scratch / "back.db"
        merged = self.lines("map", "merge", copy, self.file)
        self.assertEqual(without(merged[0], self.file), without(
            self.lines("map", "merge", back, copy)[0], self.server.address("copy", password=None)))
        self.assertIn("already there: 2 sessions", self.lines("map", "merge", back, self.file)[0])
        for command in ("export", "list", "check"):
            expected = self.lines("map", command, self.file)
            self.assertEqual(self.lines("map", command, copy), expected)
            self.assertEqual(self.lines("map", command, back), expected)
        self.assertIn("2 sessions", self.lines("map", "merge", copy, self.town)[0])
        self.assertIn("linked     2 sessions", self.lines("map", "link", copy)[0])
        self.server.sql("copy", "DROP SCHEMA loopbit CASCADE")

    def test_odometry_and_poses_are_kept_as_in_a_file(self):
        self.server.sql("postgres", "CREATE DATABASE driven")
        address, file, back = self.server.address("driven"), self.scratch / "a.db", self.scratch / "b.db"
        self.lines("map", "create", address)
        for number, map_path in enumerate((file, address)):
            ran = loopbit("run", self.dataset, "--odometry", self.dataset / "odometry.txt", "--map", map_path,
                          "--no-report", "--out", self.scratch / str(number))
            self.assertEqual(ran.returncode, 0, ran.stderr)
        self.lines("map", "merge", back, address)

        def rows_in(path, columns):
            with contextlib.closing(sqlite3.connect(path)) as database:
                return database.execute(f"SELECT {columns}, session, frame, pose, checksum FROM "
                                        f"{'odometry' if columns == 'timestamp' else 'relative_pose'}").fetchall()

        self.assertEqual(len(rows_in(file, "timestamp")), FRAMES)
        self.assertTrue(QUICK or rows_in(file, "match_session, match_frame, known"))
        for columns in ("timestamp", "match_session, match_frame, known"):
            self.assertEqual(rows_in(back, columns), rows_in(file, columns))
        shown = self.server.address("driven", password=None)
        of_file, of_server = ["\n".join(self.lines("graph", map_path)) for map_path in (file, address)]
        self.assertEqual(without(of_server, shown), without(of_file, file))

    def test_faults_are_told_with_a_remedy(self):
        def fails(code, words, *arguments):
            ran = loopbit(*arguments, cwd=self.scratch)
            self.assert_fails(ran, code, *words)
            self.assertNotIn("secret", ran.stdout + ran.stderr)
            self.assertEqual(list(self.scratch.iterdir()), [])

        run = ["run", self.images, "--no-report", "--map"]
        dead = "postgresql://robot1:secret@127.0.0.1:1/town"
        fails(3, ["robot1@127.0.0.1:1/town", "refused", "server runs"], "map", "info", dead)
        fails(4, ["robot1@127.0.0.1:1/town", "refused", "server runs"], *run, dead)
        wrong = self.server.address("town", "robot1", "secret")
        fails(3, ["password authentication failed", "~/.pgpass"], "query", wrong, self.images)
        fails(3, ['database "nowhere" does not exist'], "map", "list", self.server.address("nowhere"))
        fails(3, ["without a map", "loopbit map create postgresql://admin@"], *run,
              self.server.address("empty"))
        stranger = self.server.address("town", "stranger")
        fails(3, ["permission denied", "loopbit_reader"], "map", "info", stranger)
        fails(4, ["permission denied", "docs/fleet.md"], "map", "create",
              self.server.address("empty", "stranger"))
        fails(4, ["permission denied", "loopbit_writer"], *run, self.server.address("town", "viewer"))
        fails(2, ["not a valid address", "%40"], *run, "postgresql://robot1:sec@ret:secret@h/town")
        fails(4, ["only its owner"], "map", "compact", self.robot, "--budget", "5")
        fails(2, ["is on a server", "NEW.db"], "map", "check", self.file, "--recover", self.town)
        fails(2, ["not the address of a server"], "map", "create", "town.db")
        ran = loopbit("map", "info", dead, dead)
        self.assertEqual(ran.returncode, 2)
        self.assertNotIn("secret", ran.stderr)

    def new_town(self, name):
        """The address of a map with the first session."""
        self.server.sql("postgres", f"CREATE DATABASE {name}")
        self.addCleanup(self.server.sql, "postgres", f"DROP DATABASE {name} WITH (FORCE)")
        address = self.server.address(name)
        self.lines("map", "create", address)
        self.assertEqual(loopbit("run", self.shared / "first", "--map", address, "--out", self.out,
                                 "--no-report").returncode, 0)
        return address

    @contextlib.contextmanager
    def second_run(self, address, out, sessions=2, images=None):
        """The second session, stopped when the server has some of it."""
        with started("run", images or self.long, "--map", address, "--out", out, "--no-report", "--json") as run:
            name = address.rsplit("/", 1)[1]
            while self.server.sql(name, "SELECT count(*) FROM loopbit.session") != f"{sessions}\n":
                self.assertIsNone(run.poll())
            run.send_signal(signal.SIGSTOP)
            yield run

    def assert_all_is_saved(self, name, out):
        """The map `name` has all that the long run in `out` found, once."""
        rows = decisions(out)
        checked = self.lines("map", "check", self.server.address(name))
        self.assertIn(f"2 sessions, {HALF + len(rows)} places", checked[-1])
        found = [(row["frame"], row["match"]) for row in rows if row["status"] == "loop"]
        with (out / "late_loops.csv").open(newline="") as file:
            for row in csv.DictReader(file):
                change = found.append if row["kind"] == "late" else found.remove
                change((row["frame"], row["match"]))
        loops = self.server.sql(name, "SELECT frame, CASE match_session WHEN 2 THEN '' ELSE "
                                "match_session || ':' END || match_frame FROM loopbit.loop WHERE session = 2")
        self.assertEqual(sorted(tuple(line.split("|")) for line in loops.splitlines()), sorted(found))

    def test_a_server_that_crashes_costs_no_frame(self):
        address = self.new_town("outage")
        out = self.scratch / "second"
        with self.second_run(address, out) as run:
            self.server.kill()
            run.send_signal(signal.SIGCONT)
            frames = len(decisions(out))
            while len(decisions(out)) < frames + 5:    # it goes on
                self.assertIsNone(run.poll())
            run.send_signal(signal.SIGSTOP)
            self.server.start()
            run.send_signal(signal.SIGCONT)
            _, stderr = run.communicate()
        self.assertEqual(run.returncode, 0, stderr)
        self.assertRegex(stderr, r"was lost and reached again \d times?; all frames are saved")
        record = json.loads((out / "run.json").read_text())
        self.assertGreater(record["map"]["reconnections"], 0)
        self.assertNotIn("queue", record["map"])
        self.assertEqual(record["counts"]["frames"], LAPS * (FRAMES - HALF))
        self.assertEqual(list(out.glob("queue*")), [])
        self.assert_all_is_saved(address.rsplit("/", 1)[1], out)

    @repeats_when_sanitized
    def test_a_server_that_stays_away_is_brought_up_to_date_later(self):
        address = self.new_town("away")
        out = self.scratch / "second"
        with self.second_run(address, out) as run:
            self.server.kill()
            run.send_signal(signal.SIGCONT)
            _, stderr = run.communicate()
        self.server.start()
        self.assertEqual(run.returncode, 0, stderr)
        shown = self.server.address("away", password=None)
        queue = out / "queue.db"
        self.assertIn(f"'loopbit map merge {shown} {queue}' brings them there", stderr)
        record = json.loads((out / "run.json").read_text())
        self.assertEqual(record["map"]["queue"], str(queue))
        self.assertGreater(record["map"]["queued_frames"], 0)
        self.assertIn("whole", self.lines("map", "check", queue)[-1])
        self.assertRegex(self.lines("map", "merge", address, queue)[0], "the rest of 1 session")
        self.assert_all_is_saved(address.rsplit("/", 1)[1], out)
        exported = self.lines("map", "export", address)
        self.assertIn(": 0 sessions, 0 places, 0 loops", self.lines("map", "merge", address, queue)[0])
        self.assertEqual(self.lines("map", "export", address), exported)

    def test_a_commit_whose_answer_is_lost_is_not_repeated(self):
        self.new_town("forgetful")
        out = self.scratch / "second"
        with self.server.forgetful("forgetful", 2) as address:
            ran = loopbit("run", self.shared / "second", "--map", address, "--out", out, "--no-report")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertIn("all frames are saved", ran.stderr)
        self.assertEqual(decisions(out), decisions(self.fleet / "town_session_2"))
        for command in ("check", "export"):
            self.assertEqual(self.lines("map", command, self.server.address("forgetful")),
                             self.lines("map", command, self.file))

    def server_timers(self):
        """Of each connection of the server: the kind, and the seconds until it runs out (proc(5), /proc/net/tcp)."""
        established, clock_hz = "01", os.sysconf("SC_CLK_TCK")
        for line in pathlib.Path("/proc/net/tcp").read_text().splitlines()[1:]:
            _, local, _, state, _, timer, *_ = line.split()
            if local.endswith(f":{self.server.port:04X}") and state == established:
                kind, left = timer.split(":")
                yield int(kind, 16), int(left, 16) / clock_hz

    @repeats_when_sanitized
    def test_the_server_soon_notices_that_a_robot_is_cut_off(self):
        keepalive = 2
        with self.second_run(self.new_town("lonely"), self.scratch / "second") as run:
            timers = []
            while not timers or any(kind != keepalive for kind, _ in timers):    # until all is sent
                self.assertIsNone(run.poll())
                timers = list(self.server_timers())
        self.assertGreaterEqual(len(timers), 2)
        for _, left_s in timers:
            self.assertLessEqual(left_s, 30)

    def test_ctrl_c_does_not_wait_for_a_server(self):
        address = self.new_town("frozen")
        out = self.scratch / "second"
        with self.second_run(address, out) as run, self.server.frozen():
            run.send_signal(signal.SIGCONT)
            run.send_signal(signal.SIGINT)
            begin = time.monotonic()
            _, stderr = run.communicate()
            self.assertLess(time.monotonic() - begin, 30 if QUICK else 8)    # an answer is awaited for 10 s
        self.assertEqual(run.returncode, 130, stderr)
        self.assertIn("brings them there", stderr)
        frames = len(decisions(out))
        self.lines("map", "merge", address, out / "queue.db")
        self.assertEqual(self.server.sql("frozen", "SELECT frames FROM loopbit.session WHERE session = 2"),
                         f"{frames}\n")

    def test_robots_recognise_what_others_add_meanwhile(self):
        self.server.sql("postgres", "CREATE DATABASE together")
        self.addCleanup(self.server.sql, "postgres", "DROP DATABASE together WITH (FORCE)")
        address = self.server.address("together")
        self.lines("map", "create", address)
        first = self.scratch / "first"
        with self.second_run(address, first, 1, self.waiting) as run:
            frames = len(decisions(first))
            ran = loopbit("run", self.shared / "first", "--map", address, "--out", self.out, "--no-report")
            self.assertEqual(ran.returncode, 0, ran.stderr)
            image = sorted(self.images.iterdir())[3]
            query = ("query", address, image, "--json", "--epoch")
            epoch = self.server.latest_epoch("together")
            answer = self.lines(*query, epoch)
            self.assertEqual(json.loads(answer[0])["epoch"], epoch)
            run.send_signal(signal.SIGCONT)
            stdout, stderr = run.communicate()
        self.assertEqual(run.returncode, 0, stderr)
        elsewhere = [row for row in decisions(first) if row["status"] == "loop" and row["match"].startswith("2:")]
        self.assertTrue(QUICK or elsewhere)
        self.assertTrue(all(int(row["frame"]) >= frames for row in elsewhere))
        with (first / "epochs.csv").open(newline="") as file:
            epochs = [(int(row["frame"]), int(row["epoch"])) for row in csv.DictReader(file)]
        self.assertEqual(epochs, sorted(set(epochs)))
        self.assertGreater(epochs[-1][1], epoch)
        as_of = [json.loads(line)["epoch"] for line in stdout.splitlines() if '"earlier_match"' in line
                 and '"type":"loop"' in line]
        self.assertTrue(QUICK or min(as_of) >= 2)
        self.assertEqual(self.lines(*query, epoch), answer)    # although the map has grown
        self.assertNotEqual(self.lines(*query, 1), answer)
        self.assert_fails(loopbit(*query, 10000), 2, "10000")

    @repeats_when_sanitized
    def test_a_full_server_is_brought_up_to_date_later(self):
        address = self.new_town("filled")
        out = self.scratch / "second"
        trigger = "FUNCTION public.fail() RETURNS trigger LANGUAGE plpgsql AS $$BEGIN {} END$$"
        self.server.sql("filled", "CREATE " + trigger.format("RETURN new;"), "CREATE TRIGGER fail BEFORE INSERT ON "
                        "loopbit.features EXECUTE FUNCTION public.fail()")
        with self.second_run(address, out) as run:
            # A function may be replaced although the stopped run has a transaction open; a trigger would wait for it.
            self.server.sql("filled", "CREATE OR REPLACE "
                            + trigger.format("RAISE 'disk full' USING ERRCODE = 'disk_full';"))
            run.send_signal(signal.SIGCONT)
            _, stderr = run.communicate()
        self.assertEqual(run.returncode, 0, stderr)
        self.assertIn("free space or memory on the server", stderr)
        self.assertNotIn("unverified", json.loads((out / "run.json").read_text())["map"])
        self.server.sql("filled", "DROP TRIGGER fail ON loopbit.features")
        self.assertRegex(self.lines("map", "merge", address, out / "queue.db")[0], "the rest of 1 session")
        self.assert_all_is_saved("filled", out)

    @unittest.skipUnless(SEARCH, "the extension was not built")
    def test_the_index_of_contents_survives_a_crash(self):
        self.server.sql("postgres", "CREATE DATABASE crash")
        self.server.sql(
            "crash", "CREATE EXTENSION loopbit", "CREATE TABLE t (id integer, c binary_content)",
            "CREATE INDEX i ON t USING loopbit (c)", "CREATE UNLOGGED TABLE u (LIKE t INCLUDING INDEXES)",
            "INSERT INTO t SELECT n, (SELECT string_agg(sha512((n / 20 + part)::text::bytea), '' ORDER BY part) "
            "FROM generate_series(1, 8) AS part)::binary_content FROM generate_series(1, 3000) AS n",
            "INSERT INTO u SELECT * FROM t", "DELETE FROM t WHERE id % 3 = 0")
        self.server.sql("crash", "VACUUM t")
        self.server.kill()
        self.server.start()
        nearest = ("SELECT id FROM (SELECT id, c <~> (SELECT c FROM t WHERE id = 1000) AS far FROM t ORDER BY far "
                   "FETCH FIRST 50 ROWS WITH TIES) AS nearest ORDER BY far, id")
        for _ in range(2):
            found, scanned = [self.server.sql("crash", f"SET {off} = off", nearest)
                              for off in ("enable_seqscan", "enable_indexscan")]
            self.assertEqual(found, scanned)
            self.assertGreaterEqual(len(found.splitlines()), 50)
            self.server.sql("crash", "INSERT INTO t SELECT id + 5000, c FROM t")
        self.assertEqual(self.server.sql("crash", "SELECT count(*) FROM u"), "0\n")
        self.server.sql("crash", "INSERT INTO u SELECT * FROM t")
        self.assertEqual(self.server.sql("crash", "SET enable_seqscan = off", "SELECT count(*) FROM (SELECT FROM u "
                                         "ORDER BY c <~> (SELECT c FROM t LIMIT 1)) AS all_rows"), "8000\n")

    @unittest.skipUnless(SEARCH, "the extension was not built")
    def test_readers_may_search_on_the_server(self):
        nearest = ("SET enable_seqscan = off; SELECT frame FROM loopbit.place ORDER BY content::loopbit.binary_content "
                   "OPERATOR(loopbit.<~>) (SELECT content FROM loopbit.place WHERE session = 1 AND frame = 3)"
                   "::loopbit.binary_content LIMIT 1")
        for user in ("viewer", "robot2"):
            ran = subprocess.run(["psql", "-X", "-q", "-A", "-t", "-c", nearest, "-c",
                                  "EXPLAIN " + nearest.split("; ")[1],
                                  self.server.address("town", user)], capture_output=True, text=True)
            self.assertEqual(ran.stdout.splitlines()[0], "3", ran.stderr)
            self.assertIn("Index Scan using place_content", ran.stdout)
        for statement in ("CREATE FUNCTION loopbit.similarity(int) RETURNS int LANGUAGE sql AS 'SELECT 1'",
                          "DROP EXTENSION loopbit", "ALTER EXTENSION loopbit UPDATE",
                          "DROP INDEX loopbit.place_content"):
            self.assertRegex(self.as_robot2(statement).stderr, "must be owner|permission denied", statement)

    @unittest.skipUnless(SEARCH, "the extension was not built")
    def test_queries_are_answered_by_the_index_of_contents(self):
        def uses():
            return int(self.server.sql("town", "SELECT idx_scan FROM pg_stat_user_indexes "
                                       "WHERE indexrelname = 'place_content'"))

        images = sorted(self.images.iterdir())[1::FRAMES // 6]
        of_file = self.lines("query", self.file, *images, "--json", "--places", "30")
        viewer, before = self.server.address("town", "viewer"), uses()
        ran = loopbit("query", viewer, *images, "--json", "--places", "30",
                      environment={"PGOPTIONS": "-c enable_seqscan=off"})
        self.assertEqual((ran.returncode, ran.stderr, ran.stdout.splitlines()), (0, "", of_file))
        deadline = time.monotonic() + 60
        while uses() < before + len(images) and time.monotonic() < deadline:
            time.sleep(0.1)    # statistics come late
        self.assertGreaterEqual(uses(), before + len(images))
        self.assertTrue(QUICK or any(json.loads(line)["status"] == "loop" for line in of_file))

    def new_shards(self):
        """The addresses of two maps with a session each, and a file with both."""
        one, addresses = self.scratch / "one.db", []
        for number, name in enumerate(("first", "second"), start=1):
            self.server.sql("postgres", f"CREATE DATABASE shard{number}")
            self.addCleanup(self.server.sql, "postgres", f"DROP DATABASE IF EXISTS shard{number} WITH (FORCE)")
            addresses.append(self.server.address(f"shard{number}"))
            self.lines("map", "create", addresses[-1], "--first-session", number)
            file = self.shared / f"{name}.db"    # of the first case that needs it
            if not file.exists():
                ran = loopbit("run", self.shared / name, "--map", file, "--no-report")
                self.assertEqual(ran.returncode, 0, ran.stderr)
            for into in (addresses[-1], one):
                self.lines("map", "merge", into, file)
        return addresses, one

    def test_several_servers_answer_as_one_map(self):
        addresses, one = self.new_shards()
        images = sorted(self.images.iterdir())[1::FRAMES // 6]
        query = ("--json", "--places", "30")
        of_one = self.lines("query", one, *images, *query)
        self.assertTrue(QUICK or any(json.loads(line)["status"] == "loop" for line in of_one))
        self.assertEqual({place["session"] for line in of_one for place in json.loads(line)["places"]}, {1, 2})
        for order in (addresses, addresses[::-1]):
            self.assertEqual(self.lines("query", " ".join(order), *images, *query), of_one)
        self.server.sql("shard2", "DROP INDEX IF EXISTS loopbit.place_content")    # its contents are read
        self.assertEqual(self.lines("query", " ".join(addresses), *images, *query), of_one)

        def answers(lines):
            return [{name: value for name, value in json.loads(line).items() if name not in ("epoch", "not_asked")}
                    for line in lines]

        dead = "postgresql://robot1:secret@127.0.0.1:1/town"
        shown = "postgresql://robot1@127.0.0.1:1/town"
        ran = loopbit("query", f"{dead} {addresses[0]}", *images, *query)
        self.assertEqual(ran.returncode, 3)
        self.assertEqual(answers(ran.stdout.splitlines()), answers(self.lines("query", addresses[0], *images, *query)))
        self.assertTrue(all(json.loads(line)["not_asked"] == [shown] for line in ran.stdout.splitlines()))
        self.assertRegex(ran.stderr, f"^loopbit: '{shown}' cannot be read .*refused.*\n$")
        ran = loopbit("query", f"{addresses[0]} {dead}", images[0])
        self.assertIn(f"not asked: {shown}", ran.stdout)
        self.assertNotIn("secret", ran.stdout + ran.stderr)
        self.assert_fails(loopbit("query", f"{dead} {dead}", images[0]), 3, "refused")
        self.assert_fails(loopbit("query", f"{addresses[0]} {self.town}", images[0]), 2, "Session 1 in",
                          "is another one", "--first-session")
        self.assert_fails(loopbit("query", " ".join(addresses), images[0], "--epoch", "1"), 2, "one address")
        for command in (("map", "export"), ("map", "create")):
            ran = loopbit(*command, " ".join((dead, addresses[0])), cwd=self.scratch)
            self.assert_fails(ran, 2, "are several maps", shown)
            self.assertNotIn("secret", ran.stdout + ran.stderr)

    def test_runs_on_several_servers_answer_as_with_one_map(self):
        addresses, one = self.new_shards()
        for number in (3, 4):
            self.server.sql("postgres", f"CREATE DATABASE shard{number}")
            self.addCleanup(self.server.sql, "postgres", f"DROP DATABASE shard{number} WITH (FORCE)")
            addresses.append(self.server.address(f"shard{number}"))
            self.lines("map", "create", addresses[-1], "--first-session", number)
        shown = [self.server.address(f"shard{number}", password=None) for number in (1, 2, 3, 4)]
        first, second, third, fourth = addresses
        dead = "postgresql://robot1:secret@127.0.0.1:1/town"
        self.lines("run", self.images, "--map", one, "--out", self.scratch / "of_one", "--no-report", "--quiet")
        ran = loopbit("run", self.images, "--map", " ".join((third, second, dead, fourth, first)), "--out", self.out,
                      "--no-report", "--quiet")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertRegex(ran.stderr, "^loopbit: 'postgresql://robot1@127.0.0.1:1/town' cannot be read .*refused.*\n$")
        self.assertEqual(decisions(self.out), decisions(self.scratch / "of_one"))
        matched = {row["match"].split(":")[0] for row in decisions(self.out) if ":" in row["match"]}
        self.assertTrue(QUICK or matched >= {"1", "2"}, matched)
        record = json.loads((self.out / "run.json").read_text())
        self.assertEqual(record["map"], {"path": " ".join([shown[2], shown[1], "postgresql://robot1@127.0.0.1:1/town",
                                                          shown[3], shown[0]]),
                                         "not_asked": ["postgresql://robot1@127.0.0.1:1/town"], "session": 3})
        self.assertEqual(self.sessions(*addresses), [[1], [2], [3], []])
        self.assertRegex(self.lines("map", "check", third)[-1], "^whole ")
        image = sorted(self.images.iterdir())[3]
        query = (image, "--json", "--places", "30")
        self.assertEqual(self.lines("query", " ".join(addresses), *query), self.lines("query", one, *query))
        self.assert_fails(loopbit("run", self.images, "--map", f"{third} {first} {self.town}", "--no-report",
                                  cwd=self.scratch), 2, "Session 1 in", "is another one", "--first-session")

    def test_several_servers_are_shown_together(self):
        addresses, _ = self.new_shards()
        paths = [self.server.address(f"shard{number}", password=None) for number in (1, 2)]
        dead = "postgresql://robot1:secret@127.0.0.1:1/town"
        for with_dead in (False, True):
            given = " ".join([dead] * with_dead + addresses)

            def shown(*command):
                ran = loopbit("map", *command)
                self.assertEqual(ran.returncode, 3 if with_dead else 0, ran.stderr)
                self.assertRegex(ran.stderr, "^loopbit: 'postgresql://robot1@127.0.0.1:1/town' cannot be read "
                                 ".*refused.*\n$" if with_dead else "^$")
                return ran.stdout

            self.assertEqual([info["path"] for info in json.loads(shown("info", given, "--json"))], paths)
            self.assertTrue(all(path in shown("info", given) for path in paths))
            sessions = json.loads(shown("list", given, "--json"))
            self.assertEqual([session["session"] for session in sessions], [1, 2])
            self.assertEqual(len(shown("list", given).splitlines()), 3)
            whole = [line for address in addresses for line in self.lines("map", "check", address)]
            lines = [line for line in shown("check", given).splitlines() if not line.startswith("map ")]
            self.assertEqual(lines, whole)

    def sessions(self, *addresses):
        """The numbers of the sessions of each."""
        return [[session["session"] for session in json.loads("\n".join(self.lines("map", "list", address, "--json")))]
                for address in addresses]

    def test_only_whole_sessions_move_and_by_the_owner_of_the_map(self):
        (first, second), _ = self.new_shards()
        move = ("map", "move", first, second, "--session", "1")
        self.assert_fails(loopbit(*move[:2], self.file, *move[3:]), 2, "is a map file", "map merge")
        self.assert_fails(loopbit(*move[:3], first, *move[4:]), 4, "is the map", "itself")
        self.assert_fails(loopbit(*move[:5], "7"), 2, "has no session 7", "map list")
        self.assert_fails(loopbit("map", "move", self.town, *move[3:4], "--session", "2"), 2, "is another one")
        robot = self.server.address("shard1", "robot1")
        self.assert_fails(loopbit("map", "move", robot, *move[3:]), 4, "only its owner")
        self.server.sql("shard1", "CREATE TABLE public.whole AS SELECT * FROM loopbit.features",
                        "UPDATE loopbit.features SET features = set_byte(features, 100, 255 - get_byte(features, 100)) "
                        "WHERE place = (1::bigint << 32) + 3")
        self.assert_fails(loopbit(*move), 3, "is damaged", f"place {(1 << 32) + 3}")
        self.assertEqual(self.sessions(first, second), [[1], [2]])

    def test_a_session_moves_to_another_server_whatever_is_killed(self):
        (first, second), one = self.new_shards()
        query = (sorted(self.images.iterdir())[HALF + 3], "--json", "--places", "30")
        of_one = self.lines("query", one, *query)
        move = ("map", "move", first, second, "--session", "1")
        # After the copy, before the first one has removed the session.
        self.server.sql("shard1", "UPDATE loopbit.session SET owner = 'robot1'",
                        "CREATE FUNCTION public.wait() RETURNS trigger LANGUAGE plpgsql AS "
                        "$$BEGIN PERFORM pg_sleep(600); RETURN NEW; END$$", "CREATE TRIGGER wait BEFORE INSERT ON "
                        "loopbit.moved FOR EACH ROW EXECUTE FUNCTION public.wait()")
        with started(*move) as moving:
            sleeping = "SELECT count(*) FROM pg_stat_activity WHERE wait_event = 'PgSleep'"
            while self.server.sql("shard1", sleeping) == "0\n":
                self.assertIsNone(moving.poll())
            self.server.kill()
            self.server.start()
            self.assertIn("can be reached", moving.communicate()[1])
        self.server.sql("shard1", "DROP TRIGGER wait ON loopbit.moved")
        self.assertEqual(self.sessions(first, second), [[1], [1, 2]])
        for both in (f"{first} {second}", f"{second} {first}"):
            self.assertEqual(self.lines("query", both, *query), of_one)

        self.server.sql("shard2", "UPDATE loopbit.features SET features = set_byte(features, 100, 255 - "
                        "get_byte(features, 100)) WHERE place = (1::bigint << 32) + 3")    # it is copied again
        self.assertEqual(self.lines(*move)[0], f"moved      1 session, {HALF} places")
        self.assertEqual(self.sessions(first, second), [[], [1, 2]])
        for command in ("check", "export"):
            self.assertEqual(sorted(self.lines("map", command, second)), sorted(self.lines("map", command, one)))
        self.assertEqual(self.server.sql("shard2", "SELECT owner FROM loopbit.session WHERE session = 1"), "robot1\n")
        self.assertIn("0 sessions, 0 places; already there: 1 session", self.lines(*move)[0])
        self.assert_fails(loopbit("map", "merge", first, self.shared / "first.db"), 4,
                          "session 1 was moved to another server")

        back = ("map", "move", second, first, "--session", "1", "--session", "2")
        folder = self.scratch / "arriving"
        folder.mkdir()
        with started("query", f"{first} {second}", "--watch", folder, *query[1:], "--map-cache-mb", 0) as watching:
            for name in ("before.png", "after.png"):
                (folder / name).symlink_to(query[0])
                answer = {**json.loads(watching.stdout.readline()), "image": str(query[0])}
                self.assertEqual(answer, json.loads(of_one[0]))
                with started(*back) as moving:    # the second time, there is nothing to move
                    while moving.poll() is None:
                        for both in (f"{first} {second}", f"{second} {first}"):
                            self.assertEqual(self.lines("query", both, *query), of_one)
        self.assertEqual(self.sessions(first, second), [[1, 2], []])
        self.server.sql("shard1", "SELECT setval('loopbit.session_number', 1, false)")
        self.lines("map", "merge", first, self.file)    # whose sessions get numbers that are free
        self.assertEqual(self.sessions(first), [[1, 2, 3, 4]])

    def test_a_server_that_is_lost_during_queries_is_named(self):
        addresses, _ = self.new_shards()
        images = sorted(self.images.iterdir())
        folder = self.scratch / "arriving"
        folder.mkdir()
        with started("query", " ".join(addresses), "--watch", folder, "--json", "--map-cache-mb", 0) as query:
            (folder / "a.png").symlink_to(images[HALF + 3])
            answer = json.loads(query.stdout.readline())
            self.assertNotIn("not_asked", answer)
            self.assertIn(2, {place["session"] for place in answer["places"]})
            self.server.sql("postgres", "DROP DATABASE shard2 WITH (FORCE)")
            (folder / "b.png").symlink_to(images[HALF + 4])
            answer = json.loads(query.stdout.readline())
            self.assertEqual(answer["not_asked"], [self.server.address("shard2", password=None)])
            query.send_signal(signal.SIGINT)
            _, stderr = query.communicate()
        self.assertEqual(query.returncode, 3, stderr)

    def test_another_version_is_refused(self):
        for version, remedy in (99, "newer loopbit"), (2, "'loopbit map merge COPY.db ADDRESS'"):
            self.server.sql("town", f"UPDATE loopbit.migration SET version = {version}")
            try:
                self.assert_fails(loopbit("map", "info", self.town), 3, f"version {version}", remedy)
            finally:
                self.server.sql("town", "UPDATE loopbit.migration SET version = 3")

    def as_robot2(self, statement):
        return subprocess.run(["psql", "-X", "-q", "-A", "-t", "-c", statement,
                               self.server.address("town", "robot2")], capture_output=True, text=True)

    @repeats_when_sanitized
    def test_a_robot_changes_only_its_own_sessions(self):
        before = self.lines("map", "export", self.town, "--format", "json")
        for statement in ("UPDATE loopbit.session SET frames = 0",
                          "DELETE FROM loopbit.place", "DELETE FROM loopbit.features",
                          "DELETE FROM loopbit.loop", "UPDATE loopbit.linked SET checksum = 0"):
            self.assertEqual(self.as_robot2(f"WITH done AS ({statement} RETURNING 1) "
                                            "SELECT count(*) FROM done").stdout, "0\n", statement)
        for statement, why in (
                ("SELECT nextval('loopbit.batch_number'); INSERT INTO loopbit.loop (session, frame, "
                 "match_session, match_frame, score, similarity, matches, inliers, checksum) VALUES "
                 "(1, 2, 1, 1, 1, 1, 1, 1, 1)",
                 "row-level security"),
                ("INSERT INTO loopbit.linked VALUES (1, 0) ON CONFLICT (session) DO UPDATE SET checksum = 1",
                 "row-level security"),
                ("SELECT nextval('loopbit.batch_number'); INSERT INTO loopbit.place (place, session, frame, "
                 "content, checksum) VALUES ((1::bigint << 32) + 7777, 1, 7777, "
                 "decode(repeat('00', 512), 'hex'), 0)", "row-level security"),
                ("UPDATE loopbit.session SET owner = 'robot2'", "permission denied"),
                ("UPDATE loopbit.place SET checksum = 0", "permission denied"),
                ("INSERT INTO loopbit.batch VALUES (1000, 1000)", "permission denied"),
                ("DELETE FROM loopbit.session", "permission denied"),
                ("DROP TABLE loopbit.place", "must be owner"),
                ("CREATE TABLE loopbit.mine (a int)", "permission denied")):
            self.assertIn(why, self.as_robot2(statement).stderr, statement)
        viewer = self.server.address("town", "viewer")
        self.assertEqual(self.lines("map", "export", viewer, "--format", "json"), before)

    def test_damaged_rows_are_left_out_by_name(self):
        hostile = self.server.address("copy")
        self.lines("map", "create", hostile)
        self.lines("map", "merge", hostile, self.file)
        checks = self.server.sql(
            "copy", "SELECT format('ALTER TABLE %s DROP CONSTRAINT %I;', conrelid::regclass, conname) FROM "
            "pg_constraint WHERE contype = 'c' AND connamespace = 'loopbit'::regnamespace")
        at = "session = 1 AND frame ="
        self.server.sql(
            "copy", "DROP INDEX IF EXISTS loopbit.place_content", checks,
            f"UPDATE loopbit.place SET content = 'short' WHERE {at} 1",
            f"UPDATE loopbit.place SET timestamp = 'NaN' WHERE {at} 2",
            f"UPDATE loopbit.place SET checksum = checksum + 1 WHERE {at} 3",
            f"UPDATE loopbit.place SET content = decode(repeat('00', 600000), 'hex') WHERE {at} 4",
            "UPDATE loopbit.features SET features = 'x' WHERE place = (1::bigint << 32) + 5",
            "UPDATE loopbit.features SET features = set_byte(features, 16, 255) WHERE place = "
            "(1::bigint << 32) + 6",
            "UPDATE loopbit.loop SET score = 'NaN' WHERE loop = (SELECT min(loop) FROM loopbit.loop)",
            "UPDATE loopbit.session SET name = 'other' WHERE session = 2")
        ran = loopbit("map", "check", hostile)
        self.assertEqual(ran.returncode, 3)
        first = 1 << 32
        for clause in (*(f"place {first + frame}: its content differs from its checksum"
                         for frame in (1, 2, 3, 4)),
                       *(f"place {first + frame} (session 1, frame {frame}): its features are missing or "
                         "differ" for frame in (5, 6)),
                       *([] if QUICK else ["loop 1: its values differ from their checksum"]),
                       "session 2: its description differs from its checksum"):
            self.assertIn(f"damaged    {clause}", ran.stdout)
        self.assert_fails(loopbit("run", self.images, "--map", hostile, "--out", self.out), 3, "is damaged",
                          "--recover NEW.db")
        new = self.scratch / "new.db"
        self.assertEqual(loopbit("map", "check", hostile, "--recover", new).returncode, 0)
        self.assertEqual(loopbit("map", "check", new).returncode, 0)
        self.server.sql("copy", "DROP SCHEMA loopbit CASCADE")


if __name__ == "__main__":
    unittest.main()
