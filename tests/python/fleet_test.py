# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Maps on a PostgreSQL server, which this starts: they answer as map files do."""

import os
import pathlib
import sys

import pytest
from conftest import as_row

import loopbit

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from postgres_server import ENCODED_PASSWORD, PASSWORD, PostgresServer    # noqa: E402

LAP = 60
SEARCH = os.environ.get("LOOPBIT_SERVER_SEARCH")    # the folder of the server's extension, if it was built


def record(path, images, name, **settings):
    """Adds a session to a map, and returns the writer and what was found."""
    with loopbit.MapWriter(path, loopbit.LoopDetectorOptions(), name, **settings) as map:
        detector = loopbit.LoopDetector(map=map)
        return map, [detector.process(image) for image in images]


@pytest.fixture(scope="module")
def server():
    try:
        server = PostgresServer(extension=SEARCH and pathlib.Path(SEARCH))
    except SystemExit as reason:
        pytest.skip(str(reason))
    with server:
        yield server


@pytest.fixture(scope="module")
def maps(server, command, images, tmp_path_factory):
    """The address of a map of two laps, a map file with the same, and what the second lap found."""
    server.sql("postgres", "CREATE DATABASE town")
    address = server.address("town")
    command("map", "create", address)
    file = tmp_path_factory.mktemp("map") / "town.db"
    queue = file.with_name("queue.db")
    found = []
    for path, settings in ((file, {}), (address, {"queue": queue})):
        record(path, images[:LAP], "first lap", **settings)
        map, detections = record(path, images[LAP:], "second lap", **settings)
        assert (map.queue, map.reconnections, map.unverified, map.take_notices()) == ("", 0, 0, [])
        found.append(detections)
    assert not queue.exists()
    return address, file, found


def test_a_server_answers_as_a_file(maps):
    address, file, (of_file, of_server) = maps
    assert [*map(as_row, of_server)] == [*map(as_row, of_file)]
    assert any(detection.earlier_match for detection in of_server)
    ours, others = loopbit.MapReader(address), loopbit.MapReader(file)
    for column in ("session", "frame", "content"):
        assert ours.places()[column].tobytes() == others.places()[column].tobytes()
    assert ours.loops().tobytes() == others.loops().tobytes()
    assert [(s.session, s.name, s.frames, s.linked) for s in ours.sessions] == [
        (1, "first lap", LAP, True), (2, "second lap", LAP, True)]


def test_an_answer_is_as_of_an_epoch(server, maps, images):
    address, file, (of_file, of_server) = maps
    assert {detection.epoch for detection in of_file} == {0}
    epoch = of_server[0].epoch    # before the second lap
    reader = loopbit.MapReader(address)
    reader.set_epoch(epoch)
    before = loopbit.LoopDetector(map=reader).query(images[LAP + 5])
    latest = loopbit.MapReader(address)
    # A lap is one epoch or more: the slower the machine, the more commits it is written in.
    latest.set_epoch(server.latest_epoch("town"))
    now = loopbit.LoopDetector(map=latest).query(images[LAP + 5])
    assert now.epoch > before.epoch == epoch > 0
    assert before.earlier_match.session == 1
    assert now.earlier_match == loopbit.SessionFrame(2, 5)
    with pytest.raises(loopbit.OptionError, match="epoch"):
        loopbit.MapReader(file).set_epoch(1)


@pytest.mark.skipif(not SEARCH, reason="the extension was not built")
def test_a_detector_searches_on_the_server(maps, images):
    found, of_file = (loopbit.LoopDetector(map=loopbit.MapReader(path)).query(images[LAP + 5]) for path in maps[:2])
    assert found.epoch == 0    # it has read no contents
    assert as_row(found) == as_row(of_file)


def test_a_run_uses_a_map_on_a_server(maps, dataset, server, command, tmp_path):
    server.sql("postgres", "CREATE DATABASE run")
    address = server.address("run")
    command("map", "create", address)
    loopbit.run_folder(dataset / "images", tmp_path / "run", map=address)
    assert [session.frames for session in loopbit.MapReader(address).sessions] == [2 * LAP]


def test_sessions_move_to_another_server(maps, images, server, command):
    _, file, _ = maps
    ends = []
    for name in ("here", "there"):
        server.sql("postgres", f"CREATE DATABASE {name}")
        ends.append(server.address(name))
        command("map", "create", ends[-1])
    loopbit.merge_map(ends[0], file)
    moved = loopbit.move_sessions(*ends, [2])
    assert (moved.sessions, moved.places, moved.known) == (1, LAP, 0)
    assert [[session.session for session in loopbit.MapReader(end).sessions] for end in ends] == [[1], [2]]
    assert loopbit.move_sessions(*ends, [2]).known == 1
    with pytest.raises(loopbit.OptionError, match="no session 9"):
        loopbit.move_sessions(*ends, [9])
    several = loopbit.ShardedMap(ends)
    of_several = loopbit.LoopDetector(map=several).query(images[5])
    assert as_row(of_several) == as_row(loopbit.LoopDetector(map=loopbit.MapReader(file)).query(images[5]))
    assert of_several.earlier_match
    away = loopbit.ShardedMap([*ends, ends[0].replace("/here", "/away")])
    assert len(away.not_asked) == len(away.take_notices()) == 1
    assert ENCODED_PASSWORD not in repr(away)
    with loopbit.MapWriter(" ".join(ends), loopbit.LoopDetectorOptions(), "third lap",
                           queue=file.with_name("third.db")) as map:
        assert loopbit.LoopDetector(map=map).process(images[LAP]).earlier_match
        assert map.not_asked == []


def test_a_password_is_not_shown(maps):
    reader = loopbit.MapReader(maps[0])
    for text in (reader.path, repr(reader)):
        assert "/town" in text
        assert PASSWORD not in text and ENCODED_PASSWORD not in text
    with pytest.raises(loopbit.InputError) as error:
        loopbit.MapReader(maps[0].replace("/town", "/village"))
    assert "village" in str(error.value) and ENCODED_PASSWORD not in str(error.value)
