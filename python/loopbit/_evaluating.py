# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Truth and scores: the rules of the command's --truth flags, for files and for values."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from typing import Union

from loopbit import _loopbit
from loopbit._loopbit import (
    Detection,
    Evaluation,
    FinishedRun,
    GroundTruth,
    MatchList,
    PoseTruthOptions,
    TruthKind,
)

Path = Union[str, "os.PathLike[str]"]
Times = Sequence[Union[float, None]]


def read_truth(
    path: Path,
    *,
    protocol: str = "",
    poses: PoseTruthOptions | None = None,
    variable: str = "",
    views: int | None = None,
    not_false: Path | None = None,
    ignore: Path | None = None,
    times_s: Times = (),
) -> GroundTruth:
    """What is true about a sequence, by a file: rows of query,first,last or query,match; KITTI
    poses or a TUM trajectory, which needs the frames' times; a loop matrix as .mat, text or image.

    A protocol fixes poses and views, which then must not be given. not_false and ignore are files
    of matches that are not wrong, and of queries that are not scored.
    """
    settings = PoseTruthOptions() if poses is None else poses
    rows = 1 if views is None else views
    if protocol:
        named = _loopbit.find_protocol(protocol)
        if poses is not None or views is not None:
            raise _loopbit.OptionError(
                f"poses and views cannot be given with protocol '{protocol}', which fixes them; "
                "leave out one of them."
            )
        kind = _loopbit.truth_kind(path)
        if named.truth_kind != kind:
            raise _loopbit.OptionError(
                f"protocol '{protocol}' is defined on {_words(named.truth_kind)}, but '{path}' "
                f"is {_words(kind)}; name another file, or leave out the protocol."
            )
        settings, rows = named.poses, named.views
    truth = _loopbit._read_truth(path, settings, variable, rows, list(times_s))
    if not_false is None and ignore is None:
        return truth
    near = [tuple(run) for run in truth.near_place.tolist()]
    if not_false is not None:
        near += _loopbit._read_place_runs(not_false).tolist()
    ignored = truth.ignored.tolist()
    if ignore is not None:
        ignored += _loopbit._read_frame_list(ignore)
    return GroundTruth(truth.same_place.tolist(), near, ignored)


def _words(kind: TruthKind) -> str:
    return {
        TruthKind.runs: "a list of true places",
        TruthKind.matrix: "a loop matrix",
        TruthKind.poses: "poses",
    }[kind]


def evaluate(
    found: FinishedRun | MatchList | Sequence[Detection] | Path,
    truth: GroundTruth | Path | None = None,
    *,
    protocol: str = "",
    tolerance_frames: int | None = None,
) -> Evaluation:
    """Scores what a detector, any detector, found.

    found: a run, a list of matches, detections, or the path of a run folder or of a CSV of
    query,match[,score]. truth: as read_truth() gives it, or its path; a run that was given a truth
    needs none, and is scored as it was then. A protocol fixes the tolerance, which then must not be
    given.
    """
    if isinstance(found, (str, os.PathLike)) and os.path.isdir(found):
        found = _loopbit.read_run(found)
    if protocol and tolerance_frames is not None:
        raise _loopbit.OptionError(
            f"tolerance_frames cannot be given with protocol '{protocol}', which fixes it; leave "
            "out one of them."
        )
    tolerance = tolerance_frames or 0
    if protocol:
        tolerance = _loopbit.find_protocol(protocol).tolerance_frames
    if isinstance(found, FinishedRun) and truth is None:
        truth = found.truth
        if not protocol and tolerance_frames is None:
            tolerance, protocol = recorded_scoring(found)
    if truth is None:
        raise _loopbit.OptionError("Nothing says what is true; give truth.")
    if tolerance < 0:
        raise _loopbit.OptionError(f"tolerance_frames is {tolerance}, but must be 0 or more.")
    matches = _matches(found)
    if not isinstance(truth, GroundTruth):
        truth = read_truth(truth, protocol=protocol, times_s=matches.times_s)
    return _loopbit._evaluate(matches, truth, tolerance, protocol)


def recorded_scoring(run: FinishedRun) -> tuple[int, str]:
    """The tolerance and the protocol that the run was scored with when it ended."""
    score = json.loads(run.record_json or "{}").get("score", {})
    return score.get("tolerance_frames", 0), score.get("protocol") or ""


def _matches(found: FinishedRun | MatchList | Sequence[Detection] | Path) -> MatchList:
    if isinstance(found, (str, os.PathLike)):
        return _loopbit.read_match_list(found)
    if isinstance(found, FinishedRun):
        return _loopbit.match_list(found.detections)
    return found if isinstance(found, MatchList) else _loopbit.match_list(list(found))
