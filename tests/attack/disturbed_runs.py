# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Attacks on runs: kills, signals, full disks, few cores, other kernels."""

import contextlib
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import time

from damaged_files import saved
from harness import LOOPBIT, Skipped, attack, contents, decided_alike, decisions, rows, running
from material import FRAMES, REPOSITORY, TINY, map_rows


def mapped_run(case, folder, *flags):
    """The arguments of a run that adds a session to a copy of the map."""
    path = folder / "map.db"
    shutil.copy(case.material.map, path)
    return path, ["run", case.material.images, "--map", path, "--out", folder / "out", *flags]


def check_saved(case, path):
    """All that was in the map before is in it still, and it is whole."""
    case.loopbit("map", "check", path, codes=(0,))
    places = map_rows(path)
    case.expect(all(places.get(key) == place
                    for key, place in map_rows(case.material.map).items()),
                "a place that was saved before is lost or changed")


@attack(5)
def killed_run(case):
    """SIGKILL at a random moment of a run with a map; then what is left is used, and continued."""
    path, command = mapped_run(case, case.folder, *case.pick([["--no-report"], []]))
    process = case.start(*command)
    time.sleep(case.random.uniform(0, case.material.run_seconds))
    os.kill(process.pid, signal.SIGKILL)
    case.finish(process)
    check_saved(case, path)
    out = case.folder / "out"
    if (out / "loops.csv").exists():
        if (out / "loops.csv").stat().st_size:
            decided_alike(case, out, case.material.mapped, "killed")
        case.loopbit("report", out, codes=(0, 3))
        case.loopbit("eval", out, "--truth", case.material.truth, codes=(0, 3))
    case.loopbit(*command, "--overwrite", "--limit", 2, codes=(0,))
    check_saved(case, path)


def files_in(*folders):
    return {path.name: contents(path) for folder in folders if folder.is_dir()
            for path in folder.iterdir() if path.is_file()}


@attack(3)
def killed_overwrite(case):
    """SIGKILL at random moments of runs that replace one another: the last whole one is kept."""
    out = case.folder / "out"
    shutil.copytree(case.material.run, out)
    kept = files_in(out)
    for number in range(3):
        process = case.start("run", case.material.images, "--out", out, "--overwrite",
                             *case.random.choice([["--no-report"], ["--limit", 5], []]))
        time.sleep(case.random.choice([0.1, 1]) * case.random.uniform(0, case.material.run_seconds))
        os.kill(process.pid, signal.SIGKILL)
        case.finish(process)
        record = out / "run.json"
        if record.exists() and json.loads(record.read_text())["stopped_by"] == "end":
            case.loopbit("eval", out, "--truth", case.material.truth, codes=(0,))
            kept = files_in(out)
            continue
        aside, moved = files_in(out / "earlier_run"), files_in(out / "earlier_run.part", out)
        case.expect(aside == kept or kept.items() <= moved.items(),
                    f"after kill {number}: neither the run before nor the new one is whole")
    case.loopbit("run", case.material.images, "--out", out, "--overwrite", "--no-report",
                 codes=(0,))
    case.expect(not (out / "earlier_run").exists(), "the replaced run is still there")
    decided_alike(case, out, decisions(case.material.run), "after kills")


@attack(1)
def killed_writers(case):
    """Twelve kills by tests/map_crash_test.py."""
    killed = subprocess.run(
        [sys.executable, REPOSITORY / "tests" / "map_crash_test.py", case.material.map_crash,
         LOOPBIT, "12", str(case.random.randrange(10**6))],
        capture_output=True, text=True)
    case.expect(killed.returncode == 0, killed.stdout + killed.stderr)


@attack(5)
def signalled_run(case):
    """SIGINT, SIGTERM or SIGHUP end a run that keeps what it has found."""
    path, command = mapped_run(case, case.folder, "--no-report")
    out, wanted = case.folder / "out", case.random.randrange(FRAMES - 4)
    process = case.start(*command)
    while running(process) and not (
            (out / "loops.csv").exists() and len(rows(out)) >= wanted):
        time.sleep(0.002)
    case.about = case.pick(["SIGINT", "SIGTERM", "SIGHUP"])
    os.kill(process.pid, getattr(signal, case.about))
    ended = case.finish(process)
    case.judge(ended, (0, 130))
    if ended.code == 130:
        record = json.loads((out / "run.json").read_text())
        case.expect(record["stopped_by"] == "interrupt", f"stopped by {record['stopped_by']}")
        case.expect(record["counts"]["frames"] == len(rows(out)), "run.json counts other frames")
    decided_alike(case, out, case.material.mapped, "signalled")
    check_saved(case, path)
    if found := rows(out):  # a session without a frame may be none
        listed = json.loads(case.loopbit("map", "list", path, "--json", codes=(0,)).out)
        case.expect(listed[-1]["frames"] == len(found), "the map has not the frames of the run")


@attack(1)
def signalled_watch(case):
    """A signal ends a query that waits for images, which is what it is told to do."""
    folder = case.folder / "watched"
    folder.mkdir()
    shutil.copy(case.material.images / "000003.png", folder)
    process = case.start("query", case.material.map, "--watch", folder, "--json")
    while running(process) and not os.fstat(process.streams[0].fileno()).st_size:
        time.sleep(0.002)
    case.about = case.pick(["SIGHUP", "SIGINT", "SIGTERM"])
    os.kill(process.pid, getattr(signal, case.about))
    ended = case.finish(process)
    case.judge(ended, (0, 130))
    case.expect(len(ended.out.splitlines()) == 1 and json.loads(ended.out), "its answer is lost")


@contextlib.contextmanager
def disk(case, kilobytes):
    """A disk of its own, in memory."""
    folder = case.folder / "disk"
    folder.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "attack", folder],
                             capture_output=True, text=True)
    if mounted.returncode:
        raise Skipped("mounting is not permitted")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", folder], check=True)


@attack(4)
def full_disk(case):
    """A run on a disk that is soon full, over an earlier run; then there is space again."""
    map_kilobytes = case.material.map.stat().st_size // 1024
    with disk(case, map_kilobytes + case.random.choice([40, 200, 1000])) as folder:
        path, command = mapped_run(case, folder, *case.pick([["--no-report"], []]))
        earlier = case.loopbit(*command[:2], "--out", folder / "out", "--no-report", "--limit",
                               case.random.choice([1, FRAMES]), codes=(0, 4))
        out = folder / "out"
        before = contents(out)
        if earlier.code == 0:
            case.loopbit(*command, codes=(4,), names=out, keeps=[out])
        ran = case.loopbit(*command, "--overwrite", codes=(0, 4), names=folder)
        if ran.code == 4 and earlier.code == 0:
            case.expect(before in (contents(out), contents(out / "earlier_run")),
                        f"the earlier run is lost: {ran.text}")
        if (out / "loops.csv").exists():
            text = (out / "loops.csv").read_text()
            case.expect(text == "" or text.endswith("\n"), "half a row is left")
        subprocess.run(["mount", "-o", "remount,size=64m", folder], check=True)
        check_saved(case, path)
        case.loopbit(*command, "--overwrite", "--limit", 3, codes=(0,))
        check_saved(case, path)


@attack(5)
def file_limit(case):
    """No file may grow beyond a limit (RLIMIT_FSIZE), whatever writes it."""
    material = case.material
    path, run = mapped_run(case, case.folder, "--overwrite")
    new, before = case.folder / "new", saved(path)
    command = case.pick([run, ["run", material.images, "--out", new], [
        "report", material.run, "--out", new], ["map", "export", path, "--out", new], [
        "map", "merge", new, path], ["map", "merge", path, material.other_map], [
        "map", "compact", path, "--drop", 1], ["map", "check", path, "--recover", new], [
        "map", "images", path, "--out", new], ["demo", *TINY, "--write-images", new]])
    size = int(10 ** case.random.uniform(3.6, 6.5))  # messages are longer than nothing, too
    ran = case.loopbit(*command, codes=(0, 4), limits=[(resource.RLIMIT_FSIZE, size)])
    if command[:2] != ["map", "compact"] or ran.code:
        check_saved(case, path)
    if ran.code and command[0] == "map":
        case.expect(saved(path) == before, f"{case.words(ran)}: failed, and changed the map")


@attack(1)
def few_cores(case):
    """More threads than cores: nothing but lines of our own, and the same decisions."""
    out = case.folder / "out"
    run = case.loopbit("run", case.material.images, "--out", out, "--threads",
                       case.random.choice([2, 16, 200]), cores={min(os.sched_getaffinity(0))},
                       codes=(0,))
    case.expect(run.text == "" or "frames/s" in run.text, f"says {run.text}")
    decided_alike(case, out, decisions(case.material.run), "few cores")


@attack(1)
def kernels(case):
    """All instruction sets and numbers of threads decide alike, scores included."""
    refused = case.loopbit("run", case.material.images, "--out", case.folder / "none",
                           environment={"LOOPBIT_KERNEL": "none"}, codes=(2,))
    names = re.search(r"one of: (.*)\.", refused.text)[1].split()
    flags = case.pick([[], ["--set", "surf.upright=false"], ["--set", "surf.max_keypoints=90"],
                       ["--every", 2], ["--preset", "paper"]])
    found = []
    for kernel in names:
        out = case.folder / kernel
        case.loopbit("run", case.material.images, "--out", out, "--no-report", "--threads",
                     case.random.choice([1, 2, 5]), *flags,
                     environment={"LOOPBIT_KERNEL": kernel}, codes=(0,))
        found.append(decisions(out))
    case.expect(all(each == found[0] for each in found), f"{names} {flags}: other decisions")
