# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Runs a sequence with ground truth, prints its score, and draws figures for a paper as PDF:

    paper_figures.py IMAGES TRUTH OUT [POSES]
"""
import pathlib
import sys

import matplotlib

matplotlib.use("agg")

import loopbit
import loopbit.plots

images, truth, out = sys.argv[1:4]
run = loopbit.run_folder(images, out, truth=truth, positions_m=(sys.argv[4:] or [None])[0])
score = loopbit.evaluate(run)
print(score)

figures = {
    "precision_recall": loopbit.plots.precision_recall(score),
    "times": loopbit.plots.times(run),
    "similarity": loopbit.plots.similarity(run),
}
if len(run.positions_m):
    figures["trajectory"] = loopbit.plots.trajectory(run)
for name, axes in figures.items():
    axes.figure.savefig(pathlib.Path(out) / f"{name}.pdf")
print(loopbit.write_report(run))
