# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Runs over whole sequences, and their folders."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable
from typing import Any

import numpy
import numpy.typing

from loopbit import _loopbit
from loopbit._evaluating import Path, request
from loopbit._loopbit import (
    Detection,
    FinishedRun,
    GroundTruth,
    ImageSource,
    LoopDetector,
    LoopDetectorOptions,
    PoseTruthOptions,
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
        ("votes", "f8"),
        ("geometry", "f8"),
        ("path", "f8"),
        ("rivals", "f8"),
        ("prior", "f8"),
        ("name", object),
        ("match_name", object),
        ("content_ms", "f8"),
        ("retrieval_ms", "f8"),
        ("features_ms", "f8"),
        ("verification_ms", "f8"),
    ]
)


def _terms(detection: Detection) -> tuple[float, ...]:
    terms = detection.terms
    if terms is None:
        return (numpy.nan,) * 5
    return terms.votes, terms.geometry, terms.path, terms.rivals, terms.prior


def detections_array(detections: Iterable[Detection]) -> numpy.typing.NDArray[Any]:
    """Converts detections to a structured array with the columns of loops.csv.

    A match with an earlier session of a map has two columns, earlier_session and earlier_frame.
    Missing values are nan in timestamp_s and the terms of the score, -1 in match and
    earlier_frame, 0 in earlier_session, and empty in name and match_name.
    """
    detections = list(detections)
    names = {d.frame: d.name for d in detections}
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
            *_terms(d),
            d.name,
            "" if d.match is None else names.get(d.match, ""),
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
    """Processes a source, or what open_source() opens, frame by frame to its end.

    If a frame is unreadable, on_bad_frame is called, the frame gets the status unreadable, and the
    run continues. Frames may differ in size.
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
    tolerance_frames: int | None = None,
    poses: PoseTruthOptions | None = None,
    variable: str = "",
    views: int | None = None,
    not_false: Path | None = None,
    ignore: Path | None = None,
    positions_m: numpy.typing.ArrayLike | Path | None = None,
    mask: Path | None = None,
    camera: Path | None = None,
    depth: Path | None = None,
    depth_scale: float = 5000.0,
    odometry: Path | None = None,
    correct: bool = False,
    right: Path | None = None,
    baseline_m: float = 0.0,
    keep_images: bool = False,
    map_cache_mb: int | None = None,
    overwrite: bool = False,
    evidence: bool = True,
    on_bad_frame: Callable[[str], None] = warnings.warn,
) -> FinishedRun:
    """Runs a new detector and writes a run folder like 'loopbit run': loops.csv and run.json, and
    with evidence also small images for write_report().

    out: the folder. Without it, the folder is beside the map: town_session_2 for session 2 of
    town.db.
    map: a map that the run continues with a new session, or creates. Places of earlier sessions are
    recognised.
    keep_images: stores a small JPEG of each place in the map.
    map_cache_mb: up to this many MiB of the map's features stay in memory; as in MapWriter without
    it. Changes no result.
    truth: the path of a file, or a GroundTruth for the frames that are read. A protocol requires
    the path. For protocol, tolerance_frames, poses, variable, views, not_false and ignore see
    evaluate().
    positions_m: camera centres, one per frame read, nan if unknown; or a file of poses. A truth
    file of poses also provides them.
    mask: an image file of the size of the images, see LoopDetector.set_mask().
    camera: a calibration file, see read_cameras(), whose first camera is that of the images. The run
    then measures the relative pose of each loop and writes relative_poses.csv, relative_poses.g2o
    and matched_poses.tum.
    depth: a folder of depth images, so that relative poses are in metres: with names like those of
    the images, or a TUM RGB-D folder with its depth.txt. 16-bit depth has depth_scale units per
    metre.
    odometry: a file of poses of the camera by odometry: TUM, KITTI, EuRoC, or TUM with covariances.
    options.odometry says how fast it drifts.
    correct: after the run, corrects the trajectory by a pose graph of odometry and loops, and
    withdraws the loops that it rejects: corrected.tum, judged_loops.csv and graph.g2o.
    right: a folder with the images of the right camera of a stereo pair, named like the images, in
    place of depth. baseline_m is that of a rectified pair; without it, the calibration in a KITTI or
    EuRoC folder counts, or the second camera of the calibration file.
    Files count all frames of the sequence, whatever part of it is read.

    Arguments are checked before the first frame as far as possible. If truth or positions turn out
    to be wrong after the run, the run is kept without them. An input without a readable frame is an
    InputError, and does not replace an earlier run.
    """
    if not isinstance(source, ImageSource):
        source = _loopbit.open_source(source)
    scoring, known = request(truth, protocol=protocol, tolerance_frames=tolerance_frames,
                             poses=poses, variable=variable, views=views, not_false=not_false,
                             ignore=ignore)
    file, rows = ((positions_m, None) if isinstance(positions_m, (str, os.PathLike))
                  else ("", positions_m))
    return _loopbit._run_folder(source, _loopbit._RunRequest(
        options=LoopDetectorOptions() if options is None else options,
        folder=out or "",
        overwrite=overwrite,
        evidence=evidence,
        map=map or "",
        keep_images=keep_images,
        map_cache_mb=map_cache_mb,
        scoring=scoring,
        truth=known,
        poses=file,
        positions_m=rows,
        mask=mask or "",
        camera=camera or "",
        depth=depth or "",
        depth_scale=depth_scale,
        odometry=odometry or "",
        correct=correct,
        right=right or "",
        baseline_m=baseline_m,
    ), on_bad_frame)


def write_report(run: FinishedRun | Path, path: Path | None = None) -> str:
    """Writes the HTML page of a run like 'loopbit report', by default report.html in its folder.
    Returns the path of the page."""
    if not isinstance(run, FinishedRun):
        run = _loopbit.read_run(run)
    path = os.path.join(run.path, "report.html") if path is None else os.fspath(path)
    name = os.path.basename(os.path.normpath(run.path))
    _loopbit._write_report(run, name, path)
    return path
