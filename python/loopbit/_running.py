# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Runs over whole sequences, and what they leave."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable
from typing import Any

import numpy
import numpy.typing

from loopbit import _loopbit
from loopbit._evaluating import Path, read_truth, recorded_scoring
from loopbit._loopbit import (
    Detection,
    FinishedRun,
    GroundTruth,
    ImageSource,
    LoopDetector,
    LoopDetectorOptions,
)

_DETECTION = numpy.dtype(
    [
        ("frame", "i4"),
        ("timestamp_s", "f8"),
        ("status", "U16"),
        ("match", "i4"),
        ("earlier_session", "i4"),
        ("earlier_frame", "i4"),
        ("score", "f8"),
        ("similarity", "f8"),
        ("matches", "i4"),
        ("inliers", "i4"),
        ("content_ms", "f8"),
        ("retrieval_ms", "f8"),
        ("features_ms", "f8"),
        ("verification_ms", "f8"),
    ]
)


def detections_array(detections: Iterable[Detection]) -> numpy.typing.NDArray[Any]:
    """Detections as a structured array with the columns of loops.csv, where a match with an earlier
    session of a map is two: earlier_session and earlier_frame. timestamp_s is nan, match and
    earlier_frame are -1, and earlier_session is 0 where there is none."""
    rows = [
        (
            d.frame,
            numpy.nan if d.timestamp_s is None else d.timestamp_s,
            d.status.name,
            -1 if d.match is None else d.match,
            0 if d.earlier_match is None else d.earlier_match.session,
            -1 if d.earlier_match is None else d.earlier_match.frame,
            d.score,
            d.similarity,
            d.matches,
            d.inliers,
            d.times.content_ms,
            d.times.retrieval_ms,
            d.times.features_ms,
            d.times.verification_ms,
        )
        for d in detections
    ]
    return numpy.array(rows, dtype=_DETECTION)


def run(
    source: ImageSource | Path,
    detector: LoopDetector | None = None,
    *,
    on_detection: Callable[[Detection], None] | None = None,
    on_bad_frame: Callable[[str], None] = warnings.warn,
) -> list[Detection]:
    """Detects frame by frame, to the end of a source or of what open_source() opens.

    A frame that is unreadable, or of another size than the first, is told to on_bad_frame, counted
    with the status unreadable, and the run goes on.
    """
    if not isinstance(source, ImageSource):
        source = _loopbit.open_source(source)
    if detector is None:
        detector = LoopDetector()
    return _loopbit._run(source, detector, on_detection, on_bad_frame)


def run_folder(
    source: ImageSource | Path,
    out: Path | None = None,
    options: LoopDetectorOptions | None = None,
    *,
    map: Path | None = None,
    truth: GroundTruth | Path | None = None,
    protocol: str = "",
    positions_m: numpy.typing.ArrayLike | Path | None = None,
    keep_images: bool = False,
    overwrite: bool = False,
    evidence: bool = True,
    on_bad_frame: Callable[[str], None] = warnings.warn,
) -> FinishedRun:
    """Runs a new detector and leaves a run folder, as the command 'loopbit run' does: loops.csv,
    run.json, with evidence also what the frames looked like, for write_report().

    map: a map to continue with a session, made if there is none; places of earlier sessions are
    recognised, too; keep_images: with a small JPEG of each place. Without out, the folder is beside it: town_session_2 for session 2 of town.db.
    truth: as read_truth() gives it, in the numbers of the frames read, or its path, where all
    frames are read. positions_m: camera centres, one a frame, nan where not known, or a file of
    poses; a truth by poses gives them, too.
    """
    if not isinstance(source, ImageSource):
        source = _loopbit.open_source(source)
    if source.every > 1 and any(isinstance(x, (str, os.PathLike)) for x in (truth, positions_m)):
        raise _loopbit.OptionError(
            f"Every {source.every}-th frame is read, but files count all of them; give truth as "
            "every_nth(read_truth(FILE), N), and positions_m as an array."
        )
    if isinstance(truth, (str, os.PathLike)) and positions_m is None:
        if _loopbit.truth_kind(truth) == _loopbit.TruthKind.poses:
            positions_m = truth
    tolerance = _loopbit.find_protocol(protocol).tolerance_frames if protocol else 0
    options = LoopDetectorOptions() if options is None else options
    recorded = _loopbit._RecordedRun(
        source, out or "", options, map or "", overwrite, keep_images
    )
    stopped_by = "end"
    try:
        recorded.detect(source, on_bad_frame, evidence)
        if isinstance(truth, (str, os.PathLike)):
            truth = read_truth(truth, protocol=protocol, times_s=recorded.times_s)
        if truth is not None:
            recorded.score(truth, tolerance, protocol)
        if isinstance(positions_m, (str, os.PathLike)):
            positions_m = _loopbit.read_positions(positions_m, recorded.times_s)
        if positions_m is not None:
            recorded.keep_positions(numpy.asarray(positions_m, dtype=float))
    except BaseException as error:
        stopped_by = "interrupt" if isinstance(error, KeyboardInterrupt) else _plain(str(error))
        raise
    finally:
        recorded.finish(stopped_by)
    return _loopbit.read_run(recorded.path)


def _plain(text: str) -> str:
    """Without the bytes of file names that are no text."""
    return text.encode(errors="backslashreplace").decode()


def write_report(run: FinishedRun | Path, path: Path | None = None) -> str:
    """Writes the one HTML page of a run that 'loopbit report' writes; by default report.html in its
    folder. Returns its path."""
    if not isinstance(run, FinishedRun):
        run = _loopbit.read_run(run)
    path = os.path.join(run.path, "report.html") if path is None else os.fspath(path)
    name = os.path.basename(os.path.normpath(run.path))
    _loopbit._write_report(run, name, path, *recorded_scoring(run))
    return path
