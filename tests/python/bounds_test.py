# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Where Python and C++ meet: numbers, names of files, and who may run meanwhile."""

import os
import resource
import subprocess
import sys
import warnings

import numpy as np
import pytest

import loopbit

NAN, HUGE = float("nan"), 1 << 40
# A file name that is no UTF-8.
LATIN = os.fsdecode(b"caf\xe9")
# While a function reads a long file, another thread of Python counts: if the function kept the GIL,
# not beyond 1 or 2.
READ_LONG_FILES = """
import os, sys, threading, time
import loopbit
from loopbit import _loopbit

ticks = 0

def tick():
    global ticks
    while True:
        ticks += 1
        time.sleep(0.0005)

def ticks_while(read, path):
    before = ticks
    read(path)
    return ticks - before

threading.Thread(target=tick, daemon=True).start()
for number, (read, text, comment) in enumerate([
        (loopbit.read_match_list, "5,1", "#"), (loopbit.truth_kind, "5,1", "#"),
        (loopbit.read_truth, "5,1", "#"),
        (lambda path: loopbit.read_positions(path, [None]), "1 0 0 0 0 1 0 0 0 0 1 0", "#"),
        (loopbit.load_options, "{}", "//")]):
    path = os.path.join(sys.argv[1], str(number))
    with open(path, "w") as file:
        file.write(f"{comment}\\n" * 300_000 + text + "\\n")
    assert any(ticks_while(read, path) > 2 for _ in range(50)), f"number {number} keeps the GIL"
"""
# Ends while daemon threads are inside the module, or in what it calls.
LEAVE_DAEMONS = """
import os, sys, threading, time
import loopbit

images = sys.argv[3]
image = next(loopbit.open_source(images)).image
detector = loopbit.LoopDetector()
started = threading.Semaphore(0)

def process(number):
    while True:
        detector.process(image)
        started.release()

def run(number):
    loopbit.run(images, on_detection=lambda _: started.release())

def run_slowly(number):
    def wait(detection):
        started.release()
        time.sleep(0.01)
    loopbit.run(images, on_detection=wait)

def run_folder(number):
    started.release()
    loopbit.run_folder(images, os.path.join(sys.argv[2], str(number)))

for number in range(4):
    threading.Thread(target=globals()[sys.argv[1]], args=(number,), daemon=True).start()
for _ in range(4):
    started.acquire()
time.sleep(0.2)
"""


def test_an_image_that_cannot_be_copied():
    limits = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (1 << 36, limits[1]))  # some systems promise anything
    try:
        huge = np.broadcast_to(np.zeros(1, np.uint8), (1 << 20, 1 << 20))
        with pytest.raises(MemoryError):
            loopbit.LoopDetector().process(huge)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, limits)


@pytest.mark.parametrize("columns, kind, words", [
    (([1.5], [0]), TypeError, "query has dtype float64"),
    (([2, 3], ["0", "1"]), TypeError, "match has dtype <U1"),
    (([1], [0], ["high"]), TypeError, "score has dtype <U4"),
    (([1], [0], [1], [1.0]), TypeError, "is_loop has dtype float64, but must be bool, or integers"),
    (([1, 2], [0, 0], [1, 1], [1, 2]), ValueError, "is_loop, row 1: 2 is not 0 or 1"),
    (([1], [0], [1], [-1]), ValueError, "is_loop, row 0: -1 is not 0 or 1"),
    (([1], [0], [1], [[1]]), ValueError, r"is_loop has shape \(1, 1\)"),
    (([3, HUGE], [0, 1]), ValueError, f"query, row 1: {HUGE} is not"),
    ((np.array([1 << 63], np.uint64), [0]), ValueError, f"query, row 0: {1 << 63} is not"),
    (([2, 3], [0, -1]), ValueError, "match, row 1: -1 is not"),
    (([2, 3], [0, 3]), ValueError, "match, row 1: 3 is not earlier than query 3"),
    (([1, 2], [0, 0], [1, NAN]), ValueError, "score, row 1: nan is not"),
    (([1], [0], [-np.inf]), ValueError, "score, row 0: -inf is not"),
    (([[1]], [0]), ValueError, r"query has shape \(1, 1\)"),
])
def test_matches_that_are_none(columns, kind, words):
    with pytest.raises(kind, match=words):
        loopbit.MatchList(*columns)


@pytest.mark.parametrize("lists, kind, words", [
    (([[5, 1.5]],), TypeError, "same_place has dtype float64"),
    (([], [[5, "1"]]), TypeError, "near_place has dtype <U"),
    (([], [], [1.5]), TypeError, "ignored has dtype float64"),
    (([[5, 1], [6, -1]],), ValueError, "same_place, row 1: -1 is not"),
    (([[9, 1, 2], [9, 3, HUGE]],), ValueError, f"same_place, row 1: {HUGE} is not"),
    (([], [[9, 1, 2], [9, 4, 3]]), ValueError, r"near_place, row 1: \(9, 4, 3\) is not first <="),
    (([[5, 5]],), ValueError, r"same_place, row 0: \(5, 5, 5\) is not first <= last < query"),
    (([], [], [3, -1]), ValueError, "ignored, row 1: -1 is not"),
])
def test_truth_that_is_none(lists, kind, words):
    with pytest.raises(kind, match=words):
        loopbit.GroundTruth(*lists)


def test_whole_numbers_of_any_type_are_taken():
    for dtype in (np.int8, np.uint16, np.int64, np.uint64, ">i4"):
        found = loopbit.MatchList(np.array([7], dtype), np.array([5], dtype), np.array([1], dtype))
        assert found.matches.tolist() == [(7, 5, 1.0, True)]
        flags = np.array([0, 1], dtype)
        assert loopbit.MatchList([7, 8], [5, 5], [1, 1], flags).matches["is_loop"].tolist() == [
            False, True]
    strided = np.arange(12).reshape(4, 3)[:, ::-1]
    assert loopbit.GroundTruth(strided[:, [0, 1]]).same_place["query"].tolist() == [2, 5, 8, 11]
    assert loopbit.GroundTruth(np.zeros((0, 3)), [], ()).same_place.size == 0
    assert len(loopbit.MatchList([], [], [], [])) == 0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for dtype in "FO?U":
            assert len(loopbit.MatchList(*[np.zeros(0, dtype)] * 4)) == 0


def latin_folder(dataset, tmp_path):
    folder = tmp_path / LATIN
    folder.mkdir()
    for number in range(2):
        (folder / f"{LATIN}{number}.png").write_bytes(
            (dataset / "images" / f"00000{number}.png").read_bytes())
    return folder


def test_a_report_of_names_that_are_no_utf8(dataset, tmp_path):
    run = loopbit.run_folder(latin_folder(dataset, tmp_path), tmp_path / f"{LATIN}_run",
                             on_bad_frame=[].append)
    assert loopbit.write_report(run) == f"{run.path}/report.html"


def test_names_that_are_no_utf8(dataset, tmp_path):
    folder = latin_folder(dataset, tmp_path)
    (folder / f"{LATIN}9.png").write_bytes(b"no image")
    frames = list(loopbit.open_source(folder))
    assert [frame.name for frame in frames] == [f"{LATIN}{n}.png" for n in (0, 1, 9)]
    assert LATIN in frames[2].error and LATIN in repr(frames[0])
    with pytest.raises(loopbit.InputError, match=LATIN):
        loopbit.open_source(tmp_path / f"no {LATIN}")

    bad = []
    path = tmp_path / f"{LATIN}.db"
    run = loopbit.run_folder(folder, map=path, on_bad_frame=bad.append)
    assert len(bad) == 1 and LATIN in bad[0]
    assert run.path == str(tmp_path / f"{LATIN}_session_1") and LATIN in repr(run)
    map = loopbit.MapReader(path)
    assert map.path == str(path) and map.sessions[0].name == str(folder)
    with loopbit.MapWriter(path, map.options, str(folder)) as writer:
        assert writer.path == str(path)

    def stop(sentence):
        raise RuntimeError(sentence)

    with pytest.raises(RuntimeError, match=LATIN):
        loopbit.run_folder(folder, tmp_path / "stopped", on_bad_frame=stop)


def test_files_are_read_while_other_threads_run(tmp_path):
    subprocess.run([sys.executable, "-c", READ_LONG_FILES, tmp_path], check=True, timeout=60)


@pytest.mark.parametrize("work", ["process", "run", "run_slowly", "run_folder"])
def test_the_interpreter_may_end_while_daemon_threads_work(work, dataset, tmp_path):
    images = tmp_path / "long.txt"
    names = [str(image) for image in sorted((dataset / "images").iterdir())]
    images.write_text("\n".join(40 * names) + "\n")
    for number in range(3):
        folder = tmp_path / str(number)
        folder.mkdir()
        ended = subprocess.run([sys.executable, "-c", LEAVE_DAEMONS, work, folder, images],
                               timeout=60, capture_output=True)
        assert (ended.returncode, ended.stderr) == (0, b"")
