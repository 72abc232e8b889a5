# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Ground truth and scores, with the rules of the command's --truth flags."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from typing import Any, TypeVar, Union

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
_Value = TypeVar("_Value", int, str)


def read_truth(
    path: Path,
    *,
    protocol: str = "",
    poses: PoseTruthOptions | None = None,
    variable: str = "",
    views: int | None = None,
    not_false: Path | None = None,
    ignore: Path | None = None,
    every: int = 1,
    times_s: Times = (),
    all_read: bool = False,
) -> GroundTruth:
    """Reads a file of ground truth: rows of query,first,last or query,match; KITTI poses, a TUM
    trajectory or EuRoC states; a loop matrix as .mat, text or image.

    poses, views and variable apply to poses and matrices; a protocol fixes poses and views.
    not_false is a file of matches that are not wrong, ignore a file of queries that are not scored.
    All files count the frames of the whole sequence; every means that only every N-th of them was
    read. times_s has the times of the frames read, which trajectories with times need. all_read:
    the sequence ends with those frames, so truth of more frames is refused.
    """
    kind = _loopbit.truth_kind(path)
    settings = PoseTruthOptions() if poses is None else poses
    rows = 1 if views is None else views
    if protocol:
        named = _loopbit.find_protocol(protocol)
        if poses is not None or views is not None:
            raise _loopbit.OptionError(
                f"poses and views cannot be given with protocol '{protocol}', which fixes them; "
                "leave out one of them."
            )
        check_kind(protocol, path)
        settings, rows = named.poses, named.views
    for name, given, needed in (
        ("poses", poses is not None, TruthKind.poses),
        ("views", rows != 1, TruthKind.matrix),
        ("variable", variable != "", TruthKind.matrix),
    ):
        if given and kind != needed:
            raise _loopbit.OptionError(
                f"{name} applies to {_words(needed)}, but '{path}' is {_words(kind)}; leave it "
                "out, or give another file."
            )
    truth = _loopbit._read_truth(path, settings, variable, rows, every, list(times_s), all_read)
    if not_false is None and ignore is None:
        return truth
    near = truth.near_place.tolist()
    if not_false is not None:
        near += _loopbit._read_place_runs(not_false).tolist()
    ignored = truth.ignored.tolist()
    if ignore is not None:
        ignored += _loopbit._read_frame_list(ignore)
    return GroundTruth(
        truth.same_place.tolist(), near, ignored, truth.unknown, truth.every, truth.frames
    )


def check_kind(protocol: str, path: Path) -> None:
    """Raises OptionError if the protocol requires another kind of truth than the file has."""
    named, kind = _loopbit.find_protocol(protocol), _loopbit.truth_kind(path)
    if named.truth_kind != kind:
        raise _loopbit.OptionError(
            f"protocol '{protocol}' requires {_words(named.truth_kind)}, but '{path}' "
            f"is {_words(kind)}; give another file, or leave out the protocol."
        )


def check_value(protocol: str) -> None:
    """Raises OptionError if there is a protocol, because truth as a value has no known kind."""
    if protocol:
        kind = _loopbit.find_protocol(protocol).truth_kind
        raise _loopbit.OptionError(
            f"protocol '{protocol}' requires {_words(kind)}, but a GroundTruth has no known kind; "
            "give truth as the path of a file, or leave out the protocol."
        )


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
    """Scores the loops of any detector.

    found is a run, a MatchList, detections, or the path of a run folder or of a CSV file of
    query,match[,score]. truth is a GroundTruth for the frames that were read, or the path of a
    file. Without truth, a run is scored by the truth and the protocol that it was given. A protocol
    fixes the tolerance and requires the path of a truth file.
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
        truth, recorded = found.truth, recorded_scoring(found)
        if truth is not None and protocol != recorded[1]:
            check_value(protocol)
        if tolerance_frames is None:
            tolerance, protocol = recorded
    elif isinstance(truth, GroundTruth):
        check_value(protocol)
    if truth is None:
        raise _loopbit.OptionError("There is no ground truth; give truth.")
    if tolerance < 0:
        raise _loopbit.OptionError(f"tolerance_frames is {tolerance}, but must be 0 or more.")
    matches = _matches(found)
    if not isinstance(truth, GroundTruth):
        every, is_whole = 1, False
        if isinstance(found, FinishedRun):
            every, is_whole = _every(found), _is_whole(found)
        truth = read_truth(
            truth, protocol=protocol, every=every, times_s=matches.times_s, all_read=is_whole
        )
    return _loopbit._evaluate(matches, truth, tolerance, protocol)


def recorded_scoring(run: FinishedRun) -> tuple[int, str]:
    """The tolerance and the protocol with which the run was scored at its end."""
    return _value_at(run, "score", "tolerance_frames", 0), _value_at(run, "score", "protocol", "")


def _every(run: FinishedRun) -> int:
    """The N of "every N-th frame was read", in frames of the truth file."""
    every, views = (max(1, _value_at(run, "input", name, 1)) for name in ("every", "views"))
    return max(1, every // views)


def _is_whole(run: FinishedRun) -> bool:
    """The sequence has no frame after those of the run."""
    record = _record(run)
    return record.get("stopped_by") == "end" and _value_at(run, "input", "limit", 1) == 0


def _value_at(run: FinishedRun, part: str, name: str, otherwise: _Value) -> _Value:
    """A value of run.json; `otherwise` if it is missing or has another type."""
    found = _record(run).get(part)
    value = found.get(name) if isinstance(found, dict) else None
    return value if isinstance(value, type(otherwise)) else otherwise


def _record(run: FinishedRun) -> dict[str, Any]:
    return json.loads(run.record_json or "{}")  # type: ignore[no-any-return]


def _matches(found: FinishedRun | MatchList | Sequence[Detection] | Path) -> MatchList:
    if isinstance(found, (str, os.PathLike)):
        return _loopbit.read_match_list(found)
    if isinstance(found, FinishedRun):
        return _loopbit.match_list(found.detections)
    return found if isinstance(found, MatchList) else _loopbit.match_list(list(found))
