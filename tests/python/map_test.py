# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Maps: what Python writes the command reads, the reverse, and both are answered alike."""

import gc
import json
import shutil
import subprocess
import sys
import threading

import numpy as np
import pytest
from conftest import as_row, decisions

import loopbit

LAP = 60


def record(path, images, name):
    """Adds a session to a map, and returns what was found."""
    with loopbit.MapWriter(path, loopbit.LoopDetectorOptions(), name) as map:
        return list(map_detector(map, images))


def map_detector(map, images):
    detector = loopbit.LoopDetector(map=map)
    for image in images:
        yield detector.process(image)


@pytest.fixture(scope="module")
def laps(dataset, tmp_path_factory):
    """Two folders of images: the first lap and the second."""
    folder = tmp_path_factory.mktemp("laps")
    for number, image in enumerate(sorted((dataset / "images").iterdir())):
        lap = folder / str(1 + number // LAP)
        lap.mkdir(exist_ok=True)
        shutil.copy(image, lap)
    return [folder / "1", folder / "2"]


@pytest.fixture(scope="module")
def made(images, tmp_path_factory):
    """A map of two laps, a session each, and what the second lap found."""
    path = tmp_path_factory.mktemp("map") / "town.db"
    record(path, images[:LAP], "first lap")
    return path, record(path, images[LAP:], "second lap")


@pytest.fixture(scope="module")
def commanded(command, laps, tmp_path_factory):
    """The map that the command makes of the laps."""
    path = tmp_path_factory.mktemp("commanded") / "town.db"
    for lap in laps:
        command("run", lap, "--map", path, "--no-report")
    return path


@pytest.fixture
def town(made, tmp_path):
    """A copy of the map, to be changed."""
    return shutil.copy(made[0], tmp_path / "town.db")


def test_a_map_is_that_of_the_command(command, made, commanded):
    path, found = made
    assert list(map(as_row, found)) == decisions(commanded.parent / "town_session_2")
    ours, other = loopbit.MapReader(path), loopbit.MapReader(str(commanded))
    assert ours.places().tobytes() == other.places().tobytes()
    assert ours.loops().tobytes() == other.loops().tobytes()
    assert "damaged" not in command("map", "check", path)
    listed = json.loads(command("map", "list", path, "--json"))
    assert [(s.session, s.name, s.frames, s.uid, s.started, s.loopbit) for s in ours.sessions] == [
        (s["session"], s["name"], s["frames"], s["uid"], s["started"], s["loopbit"])
        for s in listed]
    for format in loopbit.ExportFormat.__members__.values():
        if format != loopbit.ExportFormat.json:    # which has names and times
            assert loopbit.export_loops(ours, format) == command(
                "map", "export", commanded, "--format", format.name)


def test_answers_are_those_of_the_command(command, made, laps):
    path, _ = made
    asked = sorted(laps[1].iterdir())[:20:4]
    printed = command("query", path, "--json", "--places", 1000, *asked).splitlines()
    detector = loopbit.LoopDetector(map=loopbit.MapReader(path))
    ranking = ["is", "replaced"]
    for image, line in zip(asked, printed):
        frame = next(loopbit.open_source(image))
        found = detector.query(frame.image, ranking=ranking)
        first = ranking[0]
        assert found.earlier_match == first.place and found.match is None
        assert f"earlier_match={first.place!r}" in repr(found) and repr(first.place) in repr(first)
        assert {"status": found.status.name, "places": [
            {"session": r.place.session, "frame": r.place.frame, "score": r.score,
             "similarity": r.similarity, "matches": r.matches, "inliers": r.inliers}
            for r in ranking]} == {k: v for k, v in json.loads(line).items() if k != "image"}
    assert len(detector) == 0


def test_ranking_without_a_map(images):
    detector = loopbit.LoopDetector()
    for image in images[:80]:
        detector.process(image)
    ranking = []
    found = detector.query(images[80], ranking=ranking)
    assert found.earlier_match is None
    assert ranking[0].place == loopbit.SessionFrame(0, found.match)
    assert [r.score for r in ranking] == sorted((r.score for r in ranking), reverse=True)
    with pytest.raises(TypeError):
        detector.query(images[80], ranking=())


def test_removed_places_and_rejected_loops_are_in_the_map(town, images):
    with loopbit.MapWriter(town, loopbit.LoopDetectorOptions(), "third lap") as map:
        detector = loopbit.LoopDetector(map=map)
        loops = [d for d in (detector.process(image) for image in images[LAP:LAP + 20])
                 if d.is_loop]
        wrong, other = loops[5:7]
        detector.reject(wrong)
        detector.reject(other.frame, other.earlier_match)
        detector.reject(loopbit.SessionFrame(2, 0), loopbit.SessionFrame(1, 50))    # never found
        detector.remove(3)
        detector.remove(loopbit.SessionFrame(1, 4))
        for place in ("3", 2.0, None):
            with pytest.raises(TypeError, match="place is"):
                detector.remove(place)
        with pytest.raises(TypeError, match="match is None"):
            detector.reject(3)
        with pytest.raises(loopbit.OptionError, match="no frame 900"):
            detector.remove(900)
    map = loopbit.MapReader(town)
    rejected = map.rejected_loops()
    assert rejected["query_frame"].tolist() == [wrong.frame, other.frame, 0]
    assert rejected["score"].tolist() == [wrong.score, other.score, 0]
    assert rejected["match_frame"][0] == wrong.earlier_match.frame
    pairs = map.loops()[["query_session", "query_frame"]].tolist()
    assert (3, wrong.frame) not in pairs and (3, loops[0].frame) in pairs
    places = map.places()[["session", "frame"]].tolist()
    assert (3, 3) not in places and (1, 4) not in places and (3, 4) in places
    with pytest.raises(loopbit.OptionError, match="MapWriter"):
        loopbit.LoopDetector(map=map).remove(loopbit.SessionFrame(1, 5))


def test_link(command, laps, images, tmp_path):
    paths = [tmp_path / f"{name}.db" for name in ("first", "second", "met")]
    for path, lap in zip(paths, (images[:LAP], images[LAP:], images[:LAP])):
        record(path, lap, "a lap")
    record(paths[2], images[LAP:], "a lap")
    loopbit.merge_map(paths[0], paths[1])
    assert [s.linked for s in loopbit.MapReader(paths[0]).sessions] == [True, False]
    counts = loopbit.link_map(paths[0])
    assert (counts.sessions, counts.places) == (1, len(images) - LAP)
    assert repr(counts) == f"LinkCounts(sessions=1, places=60, loops={counts.loops})"

    def between(path):
        loops = loopbit.MapReader(path).loops()
        return loops[loops["query_session"] != loops["match_session"]].tolist()

    assert between(paths[0]) == between(paths[2]) and len(between(paths[0])) == counts.loops > 20
    assert loopbit.link_map(str(paths[0])).places == 0
    assert "all sessions" in command("map", "link", paths[0])
    options = loopbit.LoopDetectorOptions(surf=loopbit.SurfOptions(max_keypoints=100))
    with pytest.raises(loopbit.OptionError, match="max_keypoints"):
        loopbit.link_map(paths[0], options)


def test_reader(made, images):
    path, found = made
    map = loopbit.MapReader(path)
    assert map.path == str(path) and repr(map) == f"MapReader('{path}')"
    assert [(s.session, s.name, s.frames) for s in map.sessions] == [
        (1, "first lap", LAP), (2, "second lap", LAP)]
    assert repr(map.sessions[0]).startswith("MapSession(1, 'first lap', started 20")
    assert loopbit.to_json(map.options) == loopbit.to_json(loopbit.LoopDetectorOptions())
    places = map.places()
    assert places.dtype.names == ("id", "session", "frame", "timestamp_s", "content")
    assert places["session"].tolist() == [1] * LAP + [2] * LAP
    assert places["frame"].tolist() == [*range(LAP)] * 2 and np.isnan(places["timestamp_s"]).all()
    for number in (0, 77):
        content = loopbit.BinaryContent(places[number]["content"])
        assert content == loopbit.binary_content(images[number])
        features = map.features_of(places[number])
        expected = loopbit.extract_surf(images[number])
        assert np.array_equal(features.descriptors, expected.descriptors)
        assert np.array_equal(features.keypoints, expected.keypoints)
    loops = map.loops()
    earlier = [d for d in found if d.is_loop and d.earlier_match]
    of_second = loops[(loops["query_session"] == 2) & (loops["match_session"] == 1)]
    assert len(earlier) > LAP / 2
    assert of_second[["query_frame", "match_frame", "score"]].tolist() == [
        (d.frame, d.earlier_match.frame, d.score) for d in earlier]
    table = loopbit.detections_array(found)
    assert table["earlier_frame"].tolist() == [
        d.earlier_match.frame if d.earlier_match else -1 for d in found]
    assert set(table["earlier_session"]) == {0, 1}
    assert map.damage == [] and map.check_structure() == []


def test_sessions_are_corrected_together(town, images, tmp_path):
    path, poses = tmp_path / "map.db", []
    for session in (1, 2):
        with loopbit.MapWriter(path, loopbit.LoopDetectorOptions(), "lap") as map:
            detector = loopbit.LoopDetector(map=map)
            for k in range(12):
                pose = np.eye(4)
                pose[2, 3] = 2.25 * k + session
                detector.process(images[k], float(k), odometry=pose)
                poses.append(pose)
    map = loopbit.MapReader(path)
    odometry = map.odometry()
    assert odometry["session"].tolist() == [1] * 12 + [2] * 12 and odometry["timestamp_s"][13] == 1
    assert np.array_equal(odometry["pose"], poses)
    assert odometry["covariance"].shape == (24, 6, 6) and (odometry["covariance"][:, 0, 0] > 0).all()
    folder = tmp_path / "graph"
    result = loopbit.correct_map(map, folder)
    assert (result.keyframes, result.unjudged, result.rejected) == (24, 0, [])
    assert result.kept == len(map.loops()) > 5 and result.frame_of == {1: 1, 2: 1}
    assert len((folder / "corrected_2.tum").read_text().splitlines()) == 13
    wrong = map.loops()[0]
    pair = (loopbit.SessionFrame(int(wrong["query_session"]), int(wrong["query_frame"])),
            loopbit.SessionFrame(int(wrong["match_session"]), int(wrong["match_frame"])))
    loopbit.reject_loops(path, [pair])
    assert len(map.rejected_loops()) == 1 and loopbit.correct_map(map).kept == result.kept - 1
    with pytest.raises(loopbit.InputError, match="no odometry"):
        loopbit.correct_map(loopbit.MapReader(town), tmp_path / "none")
    assert not (tmp_path / "none").exists()
    with pytest.raises(loopbit.OutputError, match="has files"):
        loopbit.correct_map(map, folder)


def test_session_frames_are_values():
    frame = loopbit.SessionFrame(session=1, frame=17)
    assert frame == loopbit.SessionFrame(1, 17) != loopbit.SessionFrame(2, 17)
    assert len({frame, loopbit.SessionFrame(1, 17)}) == 1
    assert repr(frame) == "SessionFrame(session=1, frame=17)"


def test_writer(images, tmp_path):
    path = tmp_path / "new.db"
    map = loopbit.MapWriter(path, loopbit.LoopDetectorOptions(), "drive")
    assert (map.session, map.saved_frames, repr(map)) == (1, 0, f"MapWriter('{path}')")
    detector = loopbit.LoopDetector(map=map)
    detector.process(images[0], timestamp_s=2.5)
    detector.skip()
    map.flush()
    assert map.saved_frames == 2
    assert map.damage == []
    with pytest.raises(OSError, match="is being written"):
        loopbit.MapWriter(path, loopbit.LoopDetectorOptions(), "another")
    assert loopbit.MapReader(path).places()["timestamp_s"].tolist() == [2.5]
    map.finish()
    map.finish()
    with pytest.raises(loopbit.OptionError, match="finished"):
        detector.process(images[1])
    # It is free again, though the detector and the writer are still there.
    with loopbit.MapWriter(path, loopbit.LoopDetectorOptions(), "another") as second:
        assert second.session == 2
        map.finish()
        with pytest.raises(OSError, match="is being written"):
            loopbit.MapWriter(path, loopbit.LoopDetectorOptions(), "third")
    assert [s.session for s in loopbit.MapReader(path).sessions] == [1]    # without frames: no trace
    assert [file.name for file in tmp_path.iterdir()] == ["new.db"]


def test_a_writer_is_refused_in_a_forked_child(images, tmp_path):
    script = """
import os, sys, threading, time
import loopbit, numpy
map = loopbit.MapWriter(sys.argv[1], loopbit.LoopDetectorOptions(), "parent")
detector = loopbit.LoopDetector(map=map)
image = numpy.zeros((240, 320), numpy.uint8)
detector.process(image)
uses = [map.flush, map.finish, lambda: map.session, lambda: map.saved_frames, lambda: map.damage,
        lambda: detector.process(image)]
child = os.fork()
if child == 0:
    for use in uses:
        try:
            use()
        except loopbit.OptionError as error:
            assert "forked" in str(error) and sys.argv[1] in str(error), error
        else:
            raise AssertionError("not refused")
    # One of its own is no trouble.
    with loopbit.MapWriter(sys.argv[1] + ".child", loopbit.LoopDetectorOptions(), "child") as own:
        loopbit.LoopDetector(map=own).process(image)
    sys.exit(7)    # all is torn down, not left as os._exit() would
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7
detector.process(image)
map.finish()
"""
    path = tmp_path / "map.db"
    subprocess.run([sys.executable, "-c", script, path], check=True, stdin=subprocess.DEVNULL,
                   timeout=60)
    assert [s.frames for s in loopbit.MapReader(path).sessions] == [2]
    assert [s.frames for s in loopbit.MapReader(f"{path}.child").sessions] == [1]
    assert sorted(file.name for file in tmp_path.iterdir()) == ["map.db", "map.db.child"]


def test_a_refused_writer_leaves_the_locks_of_others(images, tmp_path):
    path = tmp_path / "map.db"
    map = loopbit.MapWriter(path, loopbit.LoopDetectorOptions(), "drive")
    loopbit.LoopDetector(map=map).process(images[0])
    map.flush()
    for _ in range(3):
        with pytest.raises(OSError, match="is being written"):
            loopbit.MapWriter(path, loopbit.LoopDetectorOptions(), "another")
    # Another process may not take the log away.
    script = "import sqlite3, sys; print(*sqlite3.connect(sys.argv[1], timeout=0).execute(sys.argv[2]))"
    ran = subprocess.run([sys.executable, "-c", script, path, "PRAGMA journal_mode = DELETE"],
                         capture_output=True, text=True, stdin=subprocess.DEVNULL)
    assert "locked" in ran.stderr
    map.finish()


def test_a_cache_changes_no_result(made, images):
    found = []
    for cache_mb in (0, 64):
        detector = loopbit.LoopDetector(map=loopbit.MapReader(made[0], cache_mb=cache_mb))
        found.append([as_row(detector.query(image)) for image in images[70:73]])
    assert found[0] == found[1]


def test_a_detector_may_outlive_the_map_that_it_was_given(made, images):
    detector = loopbit.LoopDetector(map=loopbit.MapReader(made[0]))
    gc.collect()
    assert detector.query(images[70]).earlier_match is not None


def test_a_map_that_nobody_finishes_is_whole_when_nobody_holds_it(images, tmp_path):
    path = tmp_path / "map.db"
    detector = loopbit.LoopDetector(map=loopbit.MapWriter(path, loopbit.LoopDetectorOptions(), ""))
    detector.process(images[0])
    del detector
    script = f"""
import loopbit, numpy
map = loopbit.MapWriter({str(path)!r}, loopbit.LoopDetectorOptions(), "a script")
detector = loopbit.LoopDetector(map=map)
detector.process(numpy.zeros((240, 320), numpy.uint8))
"""
    subprocess.run([sys.executable, "-c", script], check=True, stdin=subprocess.DEVNULL)
    assert [s.frames for s in loopbit.MapReader(path).sessions] == [1, 1]
    assert [file.name for file in tmp_path.iterdir()] == ["map.db"]


def test_a_detector_of_other_settings_is_refused(made):
    options = loopbit.LoopDetectorOptions()
    options.surf.max_keypoints = 500
    with pytest.raises(loopbit.OptionError, match=r"surf\.max_keypoints is 500, but .* = 600"):
        loopbit.LoopDetector(options, map=loopbit.MapReader(made[0]))


def test_a_map_serves_one_detector(made, images):
    map = loopbit.MapReader(made[0])
    detector = loopbit.LoopDetector(map=map)
    with pytest.raises(loopbit.OptionError, match="has a detector"):
        loopbit.LoopDetector(map=map)
    with pytest.raises(loopbit.OptionError, match="open to be read"):
        detector.process(images[0])


def test_settings_are_those_of_the_map(made, town, tmp_path):
    options = loopbit.LoopDetectorOptions(surf=loopbit.SurfOptions(max_keypoints=100))
    with pytest.raises(ValueError, match="surf.max_keypoints is 100, .* = 600"):
        loopbit.LoopDetector(options, loopbit.MapReader(made[0]))
    with pytest.raises(ValueError, match="surf.max_keypoints = 600, but this run has 100"):
        loopbit.MapWriter(town, options, "")
    with loopbit.MapWriter(tmp_path / "new.db", options, "") as map:
        assert loopbit.LoopDetector(map=map).options.surf.max_keypoints == 100
    strict = loopbit.LoopDetectorOptions(decision=loopbit.DecisionOptions(min_score=0.75))
    detector = loopbit.LoopDetector(strict, map=loopbit.MapReader(made[0]))
    assert detector.options.decision.min_score == 0.75


def test_wrong_arguments(made, tmp_path):
    map = loopbit.MapReader(made[0])
    with pytest.raises(TypeError, match="place is 3, but must be a row of places"):
        map.features_of(3)
    with pytest.raises(TypeError, match="place is"):
        map.features_of(map.loops()[0])
    with pytest.raises(TypeError):
        loopbit.LoopDetector(map=str(made[0]))
    with pytest.raises(TypeError):
        loopbit.MapReader(3)
    with pytest.raises(loopbit.InputError, match="There is no map"):
        loopbit.MapReader(tmp_path / "none.db")
    with pytest.raises(loopbit.OptionError, match="max_places is -1"):
        loopbit.compact_map(made[0], max_places=-1)
    with pytest.raises(loopbit.OptionError, match="no session 7"):
        loopbit.compact_map(made[0], drop_sessions=[7])


def test_threads_may_share_a_map(made, images):
    map = loopbit.MapReader(made[0])
    detector = loopbit.LoopDetector(map=map)
    expected = as_row(detector.query(images[70])), map.places().tobytes(), len(map.loops())
    found = []

    def ask():
        for _ in range(5):
            found.append((as_row(detector.query(images[70])), map.places().tobytes(),
                          len(map.loops())))

    threads = [threading.Thread(target=ask) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [expected] * 15


def test_tools(command, town, tmp_path):
    check = loopbit.check_map(town)
    assert (check.sessions, check.places, check.damage) == (2, 2 * LAP, [])
    assert repr(check) == f"MapCheck(sessions=2, places=120, loops={check.loops}, " \
        "images=0, damage=0)"
    merged = loopbit.merge_map(tmp_path / "merged.db", town)
    assert (merged.sessions, merged.places, merged.loops, merged.known) == (
        2, 2 * LAP, check.loops, 0)
    assert loopbit.merge_map(tmp_path / "merged.db", town).known == 2
    shutil.copy(town, tmp_path / "command.db")
    command("map", "compact", tmp_path / "command.db", "--drop", 1, "--budget", 20)
    counts = loopbit.compact_map(town, drop_sessions=[1], max_places=20)
    assert (counts.places_before, counts.places_after) == (2 * LAP, 20)
    assert counts.bytes_after < counts.bytes_before and "places_after=20" in repr(counts)
    ours, theirs = loopbit.MapReader(town), loopbit.MapReader(tmp_path / "command.db")
    assert ours.places().tobytes() == theirs.places().tobytes()
    assert "known=0" in repr(merged)


def test_images_are_kept_where_asked_for(images, laps, tmp_path):
    path = tmp_path / "town.db"
    loopbit.run_folder(laps[0], map=path, keep_images=True, evidence=False)
    with loopbit.MapWriter(path, loopbit.LoopDetectorOptions(), "next", keep_images=True) as writer:
        next(map_detector(writer, images[LAP:]))
    with loopbit.MapWriter(path, loopbit.LoopDetectorOptions(), "last") as writer:
        next(map_detector(writer, images[LAP:]))
    map = loopbit.MapReader(path)
    places = map.places()
    kept = [map.image_of(place) for place in places]
    assert len(kept) == LAP + 2 and kept[-1] is None
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    for number, jpeg in enumerate(kept[:-1]):
        (pictures / f"{number:03}.jpg").write_bytes(jpeg)
    for frame, image in zip(loopbit.open_source(pictures), images[: LAP + 1]):
        assert max(frame.image.shape) == 256
        assert abs(frame.image.mean() - image.mean()) < 2
    assert loopbit.check_map(path).images == LAP + 1
    loopbit.compact_map(path, drop_images=True)
    after = loopbit.MapReader(path)
    assert len(after.places()) == LAP + 2 and after.image_of(after.places()[0]) is None


def test_damage_is_named_and_what_is_whole_recovered(town, tmp_path):
    data = bytearray(open(town, "rb").read())
    content = loopbit.MapReader(town).places()[7]["content"].tobytes()
    data[data.index(content)] ^= 1
    open(town, "wb").write(data)
    map = loopbit.MapReader(town)
    assert map.damage == [] and len(map.places()) == 2 * LAP - 1
    assert len(map.damage) == 1 and "place 8: its content" in map.damage[0]
    assert loopbit.check_map(town).damage == map.damage
    with pytest.raises(loopbit.InputError):
        loopbit.LoopDetector(map=loopbit.MapWriter(town, loopbit.LoopDetectorOptions(), ""))
    saved = loopbit.recover_map(town, tmp_path / "saved.db")
    assert saved.damage == map.damage
    assert loopbit.check_map(tmp_path / "saved.db").damage == []


def test_run_folder_continues_a_map_as_the_command(commanded, laps, tmp_path):
    path = tmp_path / "town.db"
    for lap in laps:
        run = loopbit.run_folder(lap, map=path, evidence=False)
    assert run.path == str(tmp_path / "town_session_2")
    assert decisions(run.path) == decisions(commanded.parent / "town_session_2")
    assert json.loads(run.record_json)["map"] == {"path": str(path), "session": 2}
    ours, theirs = (loopbit.MapReader(map).places().tobytes() for map in (path, commanded))
    assert ours == theirs
    with pytest.raises(loopbit.OptionError, match="The run has no output"):
        loopbit.run_folder(laps[0])


def test_a_run_that_is_stopped_keeps_what_its_map_has(laps, tmp_path):
    folder = tmp_path / "images"
    shutil.copytree(laps[0], folder)
    (folder / "000010.png").write_bytes(b"no image")
    path = tmp_path / "town.db"
    try:
        loopbit.run_folder(folder, map=path, on_bad_frame=lambda sentence: 1 / 0)
    except ZeroDivisionError:
        # Though the traceback holds all that was running.
        loopbit.MapWriter(path, loopbit.LoopDetectorOptions(), "next").finish()
        assert len(loopbit.MapReader(path).places()) == 10
    else:
        pytest.fail("the run was not stopped")
