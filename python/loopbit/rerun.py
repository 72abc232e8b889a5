# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Shows a run in Rerun::

    import rerun
    import loopbit.rerun

    rerun.init("loopbit", spawn=True)
    loopbit.rerun.log(loopbit.read_run("town_loops"))

Needs Rerun's SDK: ``pip install '.[rerun]'`` in the source tree.
"""

from __future__ import annotations

import contextlib
import importlib
import pathlib
import sqlite3
from typing import Any

import numpy
import numpy.typing

from loopbit._loopbit import FinishedRun, Status

_PATH, _LOOP = (150, 160, 170), (0, 158, 115)
_STEPS = ("content_ms", "retrieval_ms", "features_ms", "verification_ms")


def log(run: FinishedRun, recording: Any = None) -> None:
    """Logs each frame of a run at its number on the timeline "frame", and on "time" if all have one:
    the path so far and the loop under loopbit/scene, its picture and its match's under loopbit/query
    and loopbit/match, score and times as plots. Late loops appear, and withdrawn ones disappear, at
    the frame that reports them.

    recording: a rerun.RecordingStream; None is the global one of rerun.init().

    Without positions the frames lie on a ring. Pictures need the run's evidence.db. Raises
    ImportError without Rerun's SDK (0.23 or later).
    """
    try:
        sdk = importlib.import_module("rerun")
    except ImportError as error:
        raise ImportError("loopbit.rerun needs Rerun's SDK: pip install 'loopbit[rerun]'.") from error
    detections = run.detections
    places = _places(run)
    are_timed = all(found.timestamp_s is not None for found in detections)
    with contextlib.closing(_Pictures(run)) as pictures:
        for found in detections:
            sdk.set_time("frame", sequence=found.frame, recording=recording)
            if are_timed:
                sdk.set_time("time", timestamp=found.timestamp_s, recording=recording)
            for entity, shown in _shown(sdk, found, places, pictures):
                sdk.log(f"loopbit/{entity}", shown, recording=recording)


def _shown(sdk: Any, found: Any, places: numpy.typing.NDArray[Any], pictures: _Pictures) -> Any:
    """What is shown at a frame, as pairs of an entity and what to log there."""
    frame, at = found.frame, places[found.frame]
    yield "score", sdk.Scalars(found.score)
    for step in _STEPS:
        yield f"times/{step}", sdk.Scalars(getattr(found.times, step))
    if frame > 0 and numpy.isfinite([places[frame - 1], at]).all():
        # One entity a frame: in Rerun an entity keeps what it showed until it shows something else.
        yield f"scene/path/{frame}", sdk.LineStrips3D([[places[frame - 1], at]], colors=[_PATH])
    if (picture := pictures.jpeg(frame)) is not None:
        yield "query", sdk.EncodedImage(contents=picture, media_type="image/jpeg")
    for loop in found.withdrawn_loops:
        yield f"scene/loops/{loop.frame}", sdk.Clear(recursive=False)
    for loop in [found, *found.late_loops] if found.status == Status.loop else found.late_loops:
        if loop.match is not None and numpy.isfinite(ends := places[[loop.frame, loop.match]]).all():
            yield f"scene/loops/{loop.frame}", sdk.LineStrips3D([ends], colors=[_LOOP])
    if found.status != Status.loop or found.match is None:
        return
    if (picture := pictures.jpeg(found.match)) is not None:
        yield "match", sdk.EncodedImage(contents=picture, media_type="image/jpeg")


def _places(run: FinishedRun) -> numpy.typing.NDArray[Any]:
    """Camera centres, N x 3, metres; without any, the frames on a ring, one metre apart."""
    if len(run.positions_m) > 0:
        return run.positions_m
    frames = max(1, len(run.detections))
    angles = 2 * numpy.pi * numpy.arange(frames) / frames
    ring: numpy.typing.NDArray[Any] = frames / (2 * numpy.pi) * numpy.stack(
        [numpy.sin(angles), numpy.cos(angles), numpy.zeros(frames)], axis=1)
    return ring


class _Pictures:
    """The JPEG pictures in a run's evidence.db, if it has one."""

    def __init__(self, run: FinishedRun) -> None:
        file = pathlib.Path(run.path).resolve() / "evidence.db"
        self._database = sqlite3.connect(f"{file.as_uri()}?mode=ro", uri=True) if file.exists() else None

    def jpeg(self, frame: int) -> bytes | None:
        if self._database is None:
            return None
        row = self._database.execute("SELECT picture FROM frame WHERE frame = ?", (frame,)).fetchone()
        return None if row is None else bytes(row[0])

    def close(self) -> None:
        if self._database is not None:
            self._database.close()
