# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Figures for papers, with matplotlib. Lines and marks differ in shape and grey level.

Each function draws into the given axes, or into a new figure, and returns the axes::

    loopbit.plots.trajectory(run).figure.savefig("trajectory.pdf")
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy
import numpy.typing
from matplotlib import pyplot  # type: ignore[import]
from matplotlib.axes import Axes  # type: ignore[import]

from loopbit import _loopbit
from loopbit._evaluating import evaluate
from loopbit._loopbit import BinaryContent, Detection, Evaluation, FinishedRun, Status
from loopbit._running import detections_array

_STEPS = ("content_ms", "retrieval_ms", "features_ms", "verification_ms")
_LINES = ("-", "--", "-.", ":")
_GREYS = ("0.85", "0.0", "0.6", "0.35")
_HATCHES = ("", "", "//", "..")


def _axes(axes: Axes | None) -> Axes:
    if axes is not None:
        return axes
    _, axes = pyplot.subplots(figsize=(3.5, 2.8), layout="constrained")
    return axes


def trajectory(run: FinishedRun, axes: Axes | None = None) -> Axes:
    """Draws the trajectory in the two axes with the largest extent, and each loop as a line between
    its two frames. Wrong loops are thick and dashed, others thin and grey; missed revisits are
    circles.

    Raises ValueError if the run has no positions.
    """
    if len(run.positions_m) == 0:
        raise ValueError(f"The run '{run.path}' has no positions; give it positions_m.")
    # Some data sets have z up, others (KITTI) z forward.
    spread = numpy.nanstd(run.positions_m, axis=0)
    at = run.positions_m[:, sorted(numpy.argsort(-spread)[:2])]
    axes = _axes(axes)
    axes.plot(*at.T, color="0.0", linewidth=0.8, label="path", zorder=2)
    loops = _loops(run)
    score = None if run.truth is None else evaluate(run)
    wrong = set() if score is None else {int(query) for query in score.wrong_loops["query"]}
    for is_wrong, style in ((False, {"color": "0.6", "linewidth": 0.6}),
                            (True, {"color": "0.0", "linewidth": 2.0, "linestyle": "--"})):
        ends = [at[[query, match]] for query, match in loops if (query in wrong) == is_wrong]
        for number, end in enumerate(ends):
            label = ("wrong loop" if is_wrong else "loop") if number == 0 else None
            axes.plot(*end.T, label=label, zorder=3 if is_wrong else 1, **style)
    if score is not None and len(score.missed):
        axes.plot(*at[score.missed].T, "o", markerfacecolor="none", markeredgecolor="0.0",
                  markersize=4, linestyle="none", label="missed revisit", zorder=4)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("m")
    axes.set_ylabel("m")
    axes.legend(frameon=False, fontsize="small")
    return axes


def _loops(run: FinishedRun) -> list[tuple[int, int]]:
    return [(d.frame, d.match) for d in run.detections if d.is_loop and d.match is not None]


def precision_recall(
    evaluations: Evaluation | Mapping[str, Evaluation], axes: Axes | None = None
) -> Axes:
    """Draws the precision-recall curve of one evaluation, or of several by name. A dot marks the
    detector's own decision."""
    if isinstance(evaluations, Evaluation):
        evaluations = {"": evaluations}
    axes = _axes(axes)
    for number, (name, evaluation) in enumerate(evaluations.items()):
        style = {"color": str(0.5 * (number // len(_LINES) % 2)),
                 "linestyle": _LINES[number % len(_LINES)]}
        curve = evaluation.curve
        axes.plot(curve["recall"], curve["precision"], label=name or None, linewidth=1.2, **style)
        axes.plot(evaluation.decision.recall, evaluation.decision.precision, "o", color="0.0",
                  markersize=4)
    axes.set_xlabel("recall")
    axes.set_ylabel("precision")
    axes.set_xlim(0.0, 1.02)
    axes.set_ylim(0.0, 1.02)
    if any(evaluations):
        axes.legend(frameon=False, fontsize="small", loc="lower left")
    return axes


def times(
    detections: FinishedRun | Sequence[Detection], axes: Axes | None = None, *, bins: int = 100
) -> Axes:
    """Draws the time per frame by step, stacked. Each bin is the mean of the same number of frames.
    Unreadable frames are left out."""
    if isinstance(detections, FinishedRun):
        detections = detections.detections
    table = detections_array([d for d in detections if d.status != Status.unreadable])
    axes = _axes(axes)
    parts = numpy.array_split(numpy.arange(len(table)), min(bins, len(table)) or 1)
    parts = [part for part in parts if len(part)]
    frames = [float(table["frame"][part].mean()) for part in parts]
    layers = [[float(table[step][part].mean()) for part in parts] for step in _STEPS]
    drawn = axes.stackplot(frames, *layers, colors=_GREYS, edgecolor="0.0", linewidth=0.3,
                           labels=[step.removesuffix("_ms") for step in _STEPS])
    for layer, hatch in zip(drawn, _HATCHES):
        layer.set_hatch(hatch)
    axes.set_xlabel("frame")
    axes.set_ylabel("ms per frame")
    axes.legend(frameon=False, fontsize="small", loc="upper left")
    return axes


def similarity(
    contents: FinishedRun | Sequence[BinaryContent] | numpy.typing.NDArray[Any],
    axes: Axes | None = None,
) -> Axes:
    """Draws the matrix of similarities xi; dark cells are similar. contents is a run, whose loops
    are drawn as circles, a list of contents, or a matrix of similarity_matrix(). xi is the maximum
    over the default shift tolerance of retrieval."""
    axes = _axes(axes)
    frames = None
    if isinstance(contents, FinishedRun):
        frames = contents.contents()
        if loops := _loops(contents):
            queries, matches = numpy.transpose(loops)
            axes.plot(matches, queries, "o", markerfacecolor="none", markeredgecolor="0.0",
                      markersize=4, markeredgewidth=0.6, linestyle="none", label="loop")
            axes.legend(frameon=True, fontsize="small", loc="upper right")
        contents = list(frames.values())
    if not isinstance(contents, numpy.ndarray):
        tolerance = _loopbit.RetrievalOptions().shift_tolerance_columns
        contents = _loopbit.similarity_matrix(contents, shift_tolerance_columns=tolerance)
    if contents.size == 0:
        raise ValueError("There are no contents to compare; a run has them with its evidence.")
    if frames is not None:  # frames that were unreadable stay white
        numbers = numpy.fromiter(frames, dtype=int)
        matrix = numpy.full((numbers[-1] + 1,) * 2, numpy.nan)
        matrix[numpy.ix_(numbers, numbers)] = contents
        contents = matrix
    image = axes.imshow(contents, cmap="gray_r", vmin=0.0, vmax=1.0, interpolation="nearest")
    axes.figure.colorbar(image, ax=axes, label="similarity xi")
    axes.set_xlabel("place")
    axes.set_ylabel("query")
    return axes
