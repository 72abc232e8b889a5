# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
import json
import pathlib
import sys
import threading
import time

import numpy as np
import pytest
from conftest import as_row, decisions

import loopbit

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent


def test_frame_by_frame_as_the_command(command, dataset, images, tmp_path):
    command("run", dataset / "images", "--out", tmp_path / "run", "--no-report")
    detector = loopbit.LoopDetector()
    found = [as_row(detector.process(image)) for image in images]
    assert found == decisions(tmp_path / "run")
    assert sum(row["status"] == "loop" for row in found) > 20


def test_corridor_loop_as_the_command(command, corridor, tmp_path):
    flags = [flag for file in ("truth", "not_false", "ignore")
             for flag in (f"--{file.replace('_', '-')}", corridor / f"{file}.csv")]
    command("run", corridor / "images", "--out", tmp_path / "cpp", "--no-report", *flags)
    expected = decisions(tmp_path / "cpp")

    detector = loopbit.LoopDetector()
    arrays = [detector.process(frame.image) for frame in loopbit.open_source(corridor / "images")]
    assert list(map(as_row, arrays)) == expected
    assert list(map(as_row, loopbit.run(corridor / "images"))) == expected

    truth = loopbit.read_truth(corridor / "truth.csv", not_false=corridor / "not_false.csv",
                               ignore=corridor / "ignore.csv")
    run = loopbit.run_folder(corridor / "images", tmp_path / "python", truth=truth, evidence=False)
    assert decisions(tmp_path / "python") == expected
    score = loopbit.evaluate(run)
    assert json.loads(score.to_json()) == json.loads(command("eval", tmp_path / "cpp", "--json"))
    assert (score.decision.positives, score.decision.wrong) == (38, 0)


def test_detection(images):
    detector = loopbit.LoopDetector()
    first = detector.process(images[0], timestamp_s=12.5)
    assert first.status == loopbit.Status.no_earlier_place
    assert (first.frame, first.timestamp_s, first.match, first.is_loop) == (0, 12.5, None, False)
    assert repr(first) == "Detection(frame=0, status=no_earlier_place)"
    loops = [d for d in map(detector.process, images[1:90]) if d.is_loop]
    last = loops[-1]
    assert last.match == pytest.approx(last.frame - 60, abs=4) and last.times.features_ms > 0
    start = f"Detection(frame={last.frame}, status=loop, match={last.match}, score={last.score:.4f}"
    assert repr(last).startswith(start)
    assert repr(last.times).startswith("StepTimes(content_ms=")
    assert as_row(detector.query(images[90])) == as_row(detector.query(images[90]))
    assert len(detector) == 90 and repr(detector) == "LoopDetector(90 frames)"
    assert detector.skip().status.name == "unreadable" and len(detector) == 91


def test_late_loops_are_of_frames_that_were_none(images):
    options = loopbit.LoopDetectorOptions()
    options.decision.min_score = 0.9999    # the path needs some frames to become sure
    detector = loopbit.LoopDetector(options)
    found = [detector.process(image) for image in images]
    late = [(loop, d) for d in found for loop in d.late_loops]
    assert late and len({loop.frame for loop, _ in late}) == len(late)
    for loop, d in late:
        assert loop.frame < d.frame and not found[loop.frame].is_loop
        assert loop.match == pytest.approx(loop.frame - 60, abs=4) and loop.earlier_match is None
        assert loop.score >= 0.9999 and 0 < loop.similarity < 1
    loop = late[0][0]
    assert repr(loop) == f"LateLoop(frame={loop.frame}, match={loop.match}, score={loop.score:.4f})"
    assert all(d.withdrawn_loops == [] for d in found)


def test_the_terms_add_up_to_the_score(images):
    detector = loopbit.LoopDetector()
    assert detector.process(images[0]).terms is None
    for image in images[1:80]:
        found = detector.process(image)
    terms = found.terms
    log_odds = terms.votes + terms.geometry + terms.path + terms.rivals + terms.prior
    assert found.score == pytest.approx(1 / (1 + np.exp(-log_odds)), abs=1e-6)
    assert repr(terms).startswith("ScoreTerms(votes=")


def test_allowed_places(images):
    detector = loopbit.LoopDetector()
    for image in images[:80]:
        detector.process(image)
    best = detector.query(images[80]).match
    ranking, evidence = [], loopbit.Evidence()
    found = detector.query(images[80], ranking=ranking, evidence=evidence,
                           allowed=lambda place: place.frame != best)
    assert found.match != best and best not in [r.place.frame for r in ranking]
    assert len(evidence.inliers) == found.inliers > 0
    for allowed in (range(best, best + 1), [loopbit.SessionFrame(0, best), 999],
                    np.array([best], np.uint8), (best,)):
        assert detector.query(images[80], allowed=allowed).match == best
    assert detector.query(images[80], allowed=[]).status == loopbit.Status.no_similar_place
    for wrong in ("12", 12, [1.5], ["12"], [None]):
        with pytest.raises(TypeError, match="allowed"):
            detector.process(images[80], allowed=wrong)

    def fails(place):
        raise KeyError(place)

    with pytest.raises(KeyError):
        detector.process(images[80], allowed=fails)
    with pytest.raises(loopbit.OptionError, match="uses the detector"):
        detector.process(images[80], allowed=lambda place: detector.query(images[0]).is_loop)
    assert len(detector) == 80
    assert detector.process(images[80], allowed=lambda place: True).match == best


def test_rejected_loops_and_removed_places(images):
    detector = loopbit.LoopDetector()
    for image in images[:80]:
        detector.process(image)
    loop = detector.process(images[80])
    assert loop.is_loop
    detector.reject(loop)
    assert not detector.query(images[80]).is_loop
    # Without the path that was rejected, it takes a few frames to be sure again.
    for image in images[81:86]:
        next_loop = detector.process(image)
    assert next_loop.is_loop
    for frame in range(next_loop.match - 2, next_loop.match + 3):
        detector.remove(frame)
    assert abs((detector.query(images[85]).match or 999) - next_loop.match) > 2


def test_every_status_is_explained():
    page = (ROOT / "docs/no_loop.md").read_text()
    for status in loopbit.Status.__members__:
        assert status == "loop" or f"\n## `{status}`\n" in page, status


def test_evidence(images):
    detector = loopbit.LoopDetector()
    evidence = loopbit.Evidence()
    assert evidence.saliency is None and evidence.inliers.size == 0
    for image in images[:90]:
        last = detector.process(image, evidence=evidence)
    assert evidence.content == loopbit.binary_content(images[89])
    assert np.array_equal(evidence.saliency, loopbit.saliency_map(images[89]))
    inliers = evidence.inliers
    assert inliers.dtype.names == ("query_x", "query_y", "match_x", "match_y")
    assert len(inliers) == last.inliers and 0 <= inliers["match_x"].min() <= 1


def test_time_must_not_go_back(images):
    detector = loopbit.LoopDetector(loopbit.LoopDetectorOptions(
        exclusion=loopbit.ExclusionOptions(seconds=1.0)))
    detector.process(images[0], 2.0)
    with pytest.raises(loopbit.InputError):
        detector.process(images[1], 1.0)
    with pytest.raises(TypeError):
        detector.process(images[1], "now")
    assert len(detector) == 1


def test_other_threads_run_meanwhile(images, tmp_path):
    """With a switch interval of hours, another thread moves only where the GIL is given up."""
    steps, stop = 0, threading.Event()

    def count():
        nonlocal steps
        while not stop.wait(0.0005):
            steps += 1

    counter = threading.Thread(target=count)
    interval = sys.getswitchinterval()
    detector = loopbit.LoopDetector()
    with loopbit.MapWriter(tmp_path / "map.db", detector.options, "") as map:
        loopbit.LoopDetector(map=map).process(images[0])
    map = loopbit.MapReader(tmp_path / "map.db")
    work = [lambda: detector.process(images[0]), lambda: detector.query(images[0]),
            lambda: loopbit.extract_surf(images[0]),
            map.places, map.check_structure, lambda: loopbit.check_map(tmp_path / "map.db")]
    sys.setswitchinterval(10_000)
    try:
        counter.start()
        for call in work:
            before, latest = steps, time.monotonic() + 10
            while steps == before and time.monotonic() < latest:
                call()
            assert steps > before
    finally:
        sys.setswitchinterval(interval)
        stop.set()
        counter.join()


def test_threads_may_share_a_detector(images):
    detector = loopbit.LoopDetector()

    def work():
        for image in images[:20]:
            detector.process(image)
            detector.query(image)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(detector) == 80


def test_odometry(images):
    detector = loopbit.LoopDetector()
    pose = np.eye(4)
    pose[0, 3] = 2.5
    first = detector.process(images[0], odometry=pose)
    assert (first.odometry == pose).all()
    pose[0, 3] = 3.5
    assert detector.process(images[1], odometry=pose, odometry_covariance=np.eye(6)).frame == 1
    assert (detector.skip(odometry=pose).odometry == pose).all()
    assert detector.process(images[2]).odometry is None
    with pytest.raises(ValueError, match=r"odometry has shape \(3, 4\)"):
        detector.process(images[3], odometry=pose[:3])
    with pytest.raises(ValueError, match="give both"):
        detector.process(images[3], odometry_covariance=np.eye(6))
    with pytest.raises(loopbit.InputError, match="odometry of frame 4 is not a rigid motion"):
        detector.process(images[3], odometry=2 * pose)
    assert len(detector) == 4
