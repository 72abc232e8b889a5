# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
import sys
import types

import numpy as np
import pytest

import loopbit
import loopbit.rerun


class StandIn(types.ModuleType):
    """In place of Rerun's SDK: keeps what is logged, with its time."""

    def __init__(self):
        super().__init__("rerun")
        self.times, self.logged = {}, []

    def set_time(self, timeline, *, sequence=None, timestamp=None, recording=None):
        assert (sequence is None) != (timestamp is None)
        self.times[timeline] = sequence if timestamp is None else timestamp

    def log(self, entity, shown, recording=None):
        self.logged.append((entity, self.times["frame"], shown))

    def at(self, entity):
        return [(frame, shown) for name, frame, shown in self.logged if name == entity]

    @staticmethod
    def Scalars(value):
        return value

    @staticmethod
    def LineStrips3D(strips, *, colors):
        assert len(strips) == len(colors) == 1
        return np.asarray(strips[0])

    @staticmethod
    def Clear(*, recursive):
        assert not recursive

    @staticmethod
    def EncodedImage(*, contents, media_type):
        assert media_type == "image/jpeg" and contents[:2] == b"\xff\xd8"
        return contents


@pytest.fixture
def sdk(monkeypatch):
    stand_in = StandIn()
    monkeypatch.setitem(sys.modules, "rerun", stand_in)
    return stand_in


def test_each_frame_and_loop_is_logged(run, sdk):
    loopbit.rerun.log(run)
    assert sdk.at("loopbit/score") == [(found.frame, found.score) for found in run.detections]
    loops = [found for found in run.detections if found.is_loop and found.match is not None]
    assert loops
    pictures = dict(sdk.at("loopbit/query"))
    changed = [loop.frame for found in run.detections for loop in (*found.late_loops, *found.withdrawn_loops)]
    for found in loops:
        (frame, line), *later = sdk.at(f"loopbit/scene/loops/{found.frame}")
        assert frame == found.frame
        assert len(later) == changed.count(found.frame)
        np.testing.assert_allclose(line, run.positions_m[[found.frame, found.match]])
    assert sdk.at("loopbit/match") == [
        (found.frame, pictures[found.match]) for found in loops if found.match in pictures]


def test_what_later_frames_change_is_logged_at_theirs(run, sdk):
    def late(frame, match):
        return types.SimpleNamespace(frame=frame, match=match)

    last = run.detections[-1]
    found = types.SimpleNamespace(frame=last.frame, timestamp_s=None, status=loopbit.Status.few_matches,
                                  match=None, score=0.5, times=last.times,
                                  late_loops=[late(5, 1), late(6, None)], withdrawn_loops=[late(7, 2)])
    loopbit.rerun.log(types.SimpleNamespace(
        path=run.path, detections=[found], positions_m=run.positions_m))
    [(frame, line)] = sdk.at("loopbit/scene/loops/5")
    assert frame == found.frame
    np.testing.assert_allclose(line, run.positions_m[[5, 1]])
    assert sdk.at("loopbit/scene/loops/6") == []  # its match is a frame of another session
    assert sdk.at("loopbit/scene/loops/7") == [(found.frame, None)]


def test_without_the_sdk_an_error_names_it(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(ImportError, match=r"pip install 'loopbit\[rerun\]'"):
        loopbit.rerun.log(run)


def test_with_the_sdk(run, tmp_path):
    sdk = pytest.importorskip("rerun")
    recording = sdk.RecordingStream("loopbit")
    recording.save(tmp_path / "run.rrd")
    loopbit.rerun.log(run, recording)
    recording.flush()
    assert (tmp_path / "run.rrd").stat().st_size > 1000
