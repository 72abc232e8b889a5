# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Ground truth and scores, with the rules of the command's --truth flags."""

from __future__ import annotations

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
)

Path = Union[str, "os.PathLike[str]"]
Times = Sequence[Union[float, None]]


def request(
    truth: GroundTruth | Path | None, **fields: object
) -> tuple[_loopbit._ScoringRequest, GroundTruth | None]:
    """The keyword arguments of a function that scores, and the truth if it is a value."""
    given = {name: value for name, value in fields.items() if value is not None}
    if truth is None or isinstance(truth, GroundTruth):
        return _loopbit._ScoringRequest(**given), truth  # type: ignore[arg-type]
    if not isinstance(truth, (str, os.PathLike)):
        raise TypeError(f"truth is {truth!r}, but must be a GroundTruth or a path.")
    return _loopbit._ScoringRequest(truth=truth, **given), None  # type: ignore[arg-type]


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
    scoring, _ = request(os.fspath(path), protocol=protocol, poses=poses, variable=variable,
                         views=views, not_false=not_false, ignore=ignore)
    truth = scoring.read_truth(every, list(times_s), all_read)
    assert truth is not None, "a request with a path has truth"
    return truth


def evaluate(
    found: FinishedRun | MatchList | Sequence[Detection] | Path,
    truth: GroundTruth | Path | None = None,
    *,
    protocol: str = "",
    tolerance_frames: int | None = None,
    poses: PoseTruthOptions | None = None,
    variable: str = "",
    views: int | None = None,
    not_false: Path | None = None,
    ignore: Path | None = None,
) -> Evaluation:
    """Scores the loops of any detector.

    found is a run, a MatchList, detections, or the path of a run folder or of a CSV file of
    query,match[,score]. truth is a GroundTruth for the frames that were read, or the path of a
    file. Without truth, a run is scored by the truth and the protocol that it was given. A protocol
    fixes the tolerance and requires the path of a truth file. The other arguments apply to such a
    file; see read_truth().
    """
    scoring, known = request(truth, protocol=protocol, tolerance_frames=tolerance_frames,
                             poses=poses, variable=variable, views=views, not_false=not_false,
                             ignore=ignore)
    if isinstance(found, (str, os.PathLike)):
        is_run = os.path.isdir(found)
        found = _loopbit.read_run(found) if is_run else _loopbit.read_match_list(found)
    if isinstance(found, FinishedRun):
        matches = _loopbit.match_list(found.detections)
        return _loopbit._evaluate(matches, found, known, scoring)
    matches = found if isinstance(found, MatchList) else _loopbit.match_list(list(found))
    # The binding takes None, but its signature does not say so.
    return _loopbit._evaluate(matches, None, known, scoring)  # type: ignore[arg-type]
