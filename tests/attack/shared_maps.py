# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Attacks by several who use a map: by two names, with a log of another, after a fork."""

import os
import shutil
import signal
import subprocess
import time

from damaged_files import use_map
from disturbed_runs import check_saved
from harness import LOOPBIT, Skipped, attack, contents, running
from material import damaged, map_rows, python

LEAVE_JOURNAL = """
import os, sqlite3, sys
map = sqlite3.connect(sys.argv[1], isolation_level=None)
for sql in ("PRAGMA cache_size = 1", "BEGIN IMMEDIATE", "PRAGMA user_version = 2",
            "UPDATE session SET frames = 0",
            "INSERT INTO features SELECT place + 10000, zeroblob(900000), 0 FROM place",
            sys.argv[2]):
    map.execute(sql)  # more pages than the cache holds: SQLite writes the journal and the map
os._exit(0)
"""
HOLD = """
import sys, time, loopbit
writer = loopbit.MapWriter(sys.argv[1], loopbit.LoopDetectorOptions(), "held")
detector = loopbit.LoopDetector(map=writer)
for frame in loopbit.open_source(sys.argv[2], limit=6): detector.process(frame.image)
writer.flush()
print("ready", flush=True)
time.sleep(300)
"""


def hold(case, path):
    """A process that writes a map: six frames are saved, and it goes on living."""
    process = python(case, HOLD, path, case.material.images)
    while running(process) and not os.fstat(process.streams[0].fileno()).st_size:
        time.sleep(0.01)
    return process


def crashed_map(case, folder):
    """A map whose writer was killed: its log is a part of it."""
    folder.mkdir()
    path = folder / "map.db"
    shutil.copy(case.material.map, path)
    holder = hold(case, path)
    os.kill(holder.pid, signal.SIGKILL)
    case.finish(holder)
    return path


def log_of(path):
    return path.with_name(path.name + "-wal")


def second_name(case, path):
    """Another name of the map, and what has to stand before a command that uses it."""
    other = case.folder / "b"
    other.mkdir()
    other /= "other.db"
    case.about = case.pick(["hard_link", "link", "dots", "bind_mount", "linked_folder"])
    if case.about == "hard_link":
        os.link(path, other)
    elif case.about == "link":
        other.symlink_to(path)
    elif case.about == "dots":
        other = other.parent / ".." / path.parent.name / path.name
    elif case.about == "linked_folder":
        (case.folder / "c").symlink_to(path.parent)
        other = case.folder / "c" / path.name
    else:
        other.touch()
        if subprocess.run(["unshare", "-m", "true"], capture_output=True).returncode:
            raise Skipped("a name space of mounts is not permitted")
    return other


@attack(3)
def two_names(case):
    """Somebody writes a map, and others try to by another name of the same file."""
    folder = case.folder / "a"
    folder.mkdir()
    path = folder / "map.db"
    shutil.copy(case.material.map, path)
    other = second_name(case, path)
    holder = hold(case, path)
    before = [contents(file) for file in (path, log_of(path))]  # readers share the rest
    for command in (["run", case.material.images, "--limit", 2, "--map", other, "--out",
                     case.folder / "out", "--no-report"],
                    ["map", "merge", other, case.material.other_map], ["map", "link", other],
                    ["map", "compact", other, "--drop", 1]):
        if case.about == "bind_mount":
            ran = case.finish(case.start(
                "-m", "sh", "-c", 'mount --bind "$1" "$2" && shift 2 && exec "$@"', "sh", path,
                other, LOOPBIT, *command, program="unshare"))
            case.expect(ran.code in (3, 4), f"{command[:2]}: exit code {ran.code}: {ran.text}")
        else:
            case.loopbit(*command, codes=(4,))
    case.expect([contents(file) for file in (path, log_of(path))] == before,
                "a second writer changed the map of the first")
    refused = not running(holder)  # as who opens a file of several names may be
    os.kill(holder.pid, signal.SIGKILL)
    told = case.finish(holder).text
    case.expect(not refused or "OutputError" in told, f"the first writer fails: {told}")
    check_saved(case, path)
    case.expect(len(map_rows(path)) == len(map_rows(case.material.map)) + (0 if refused else 6),
                "what the first writer saved is not there")


@attack(2)
def foreign_log(case):
    """The log of another map lies beside a map."""
    other = crashed_map(case, case.folder / "other")
    path = case.folder / "map.db"
    shutil.copy(case.pick([case.material.map, case.material.other_map]), path)
    saved = map_rows(path)
    shutil.copy(log_of(other), log_of(path))
    check = case.loopbit("map", "check", path, codes=(0, 3))
    for command in (["query", path, case.material.images / "000001.png", "--json"],
                    ["map", "export", path], ["run", case.material.images, "--limit", 2, "--map",
                                              path, "--out", case.folder / "out", "--no-report"]):
        ran = case.loopbit(*command, codes=(0, 3, 4))
        case.expect(ran.code == 0 or command[0] != "run" or check.code != 0,
                    f"a map that is whole is not continued: {ran.text}")
    if check.code == 0:
        places = map_rows(path)
        case.expect(all(places.get(key) == place for key, place in saved.items()),
                    "map check finds nothing, and a place is not what was saved")


@attack(2)
def foreign_journal(case):
    """The journal of another map lies beside a map, as where its writer was killed."""
    path, other = case.folder / "map.db", case.folder / "other.db"
    maps = [case.material.map, case.material.other_map]
    shutil.copy(maps[case.number % 2], path)
    shutil.copy(maps[1 - case.number % 2], other)
    change = case.random.choice(["UPDATE place SET content = zeroblob(40000)", "DELETE FROM place",
                                 "UPDATE features SET features = zeroblob(40000)"])
    case.finish(python(case, LEAVE_JOURNAL, other, change))
    target = case.folder / "map.db-journal"
    shutil.copy(case.folder / "other.db-journal", target)
    for command in (["map", "check", path], ["map", "export", path],
                    ["query", path, case.material.images / "000001.png", "--json"],
                    ["map", "merge", path, case.material.other_map], ["map", "link", path],
                    ["map", "compact", path, "--drop", 1],
                    ["run", case.material.images, "--limit", 2, "--map", path, "--out",
                     case.folder / "out", "--no-report"]):
        case.loopbit(*command, codes=(3,), keeps=[path, target], names=target)


@attack(4)
def damaged_log(case):
    """A writer is killed, and its log damaged, before the map is opened again."""
    path = crashed_map(case, case.folder / "crashed")
    copy = case.folder / "whole.db"
    shutil.copy(path, copy)
    shutil.copy(log_of(path), log_of(copy))
    saved = map_rows(copy)
    file = log_of(path) if case.number % 4 else path
    file.write_bytes(damaged(file.read_bytes(), case.random))
    case.loopbit("map", "check", path, codes=(0, 3))
    new = case.folder / "recovered.db"
    if case.loopbit("map", "check", path, "--recover", new, codes=(0, 3)).code == 0:
        case.expect(all(saved.get(key) == place for key, place in map_rows(new).items()),
                    "a recovered place is not what was saved")
    use_map(case, path, signed=True)


FORK = """
import os, sys, time, loopbit
path, images, child_does = sys.argv[1:4]
writer = loopbit.MapWriter(path, loopbit.LoopDetectorOptions(), "forked")
detector = loopbit.LoopDetector(map=writer)
frames = list(loopbit.open_source(images, limit=8))
for frame in frames[:4]: detector.process(frame.image)
child = os.fork()
if child == 0:
    try:
        if child_does == "process":
            for frame in frames[4:]: detector.process(frame.image)
        elif child_does == "finish": writer.finish()
        elif child_does == "flush": writer.flush()
        elif child_does == "delete": del detector, writer
    except loopbit.Error as error: assert str(error).endswith("."), error
    if child_does != "exit": os._exit(0)
    sys.exit(0)
for frame in frames[4:]: detector.process(frame.image)
for _ in range(1000):
    pid, status = os.waitpid(child, os.WNOHANG)
    if pid: break
    time.sleep(0.01)
else:
    os.kill(child, 9)
    print("the child hangs", file=sys.stderr)
if pid and status: print("the child ends with status", status, file=sys.stderr)
writer.finish()
"""


@attack(2)
def forked_writer(case):
    """Python forks while it writes a map, and the child uses or drops what it inherits."""
    path = case.folder / "map.db"
    shutil.copy(case.material.map, path)
    case.about = case.pick(["process", "finish", "flush", "delete", "exit"])
    ran = case.finish(python(case, FORK, path, case.material.images, case.about))
    case.expect(ran.code == 0 and not ran.err, f"{ran.code} {ran.text[-600:]}")
    check_saved(case, path)
    case.expect(len(map_rows(path)) == len(map_rows(case.material.map)) + 8,
                "the map has not the places of the parent")
