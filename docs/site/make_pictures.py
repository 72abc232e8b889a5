# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Draws the pictures of the documentation from the built-in world that the command LOOPBIT writes:

    make_pictures.py LOOPBIT FOLDER
"""

import pathlib
import subprocess
import sys
import tempfile

import matplotlib

matplotlib.use("agg")

import loopbit
import loopbit.plots
import numpy as np
from matplotlib import pyplot

matplotlib.rcParams["svg.hashsalt"] = "loopbit"  # the same picture is the same file
WORLD = ["--frames", "240", "--world", "spacing_m=1.5", "--world", "width_px=320", "--world",
         "height_px=240"]


def save(figure, path):
    figure.savefig(path, metadata={"Date": None})
    pyplot.close(figure)


def panels(rows, columns):
    """A small figure, so that letters stay readable on a phone."""
    figure, axes = pyplot.subplots(rows, columns, figsize=(5.0, 4.4 * rows / columns),
                                   layout="constrained")
    for each in axes.flat:
        each.set_axis_off()
    return figure, axes.flat


def show(axes, picture, title):
    picture = picture[..., ::-1] if picture.ndim == 3 else picture
    axes.imshow(picture, cmap="gray")
    axes.set_title(title, fontsize=9)


def draw_content(images, folder):
    """An image, its saliency map and its content."""
    image = images[200]
    content = loopbit.binary_content(image)
    figure, axes = panels(1, 3)
    show(axes[0], image, "image")
    show(axes[1], loopbit.saliency_map(image), "saliency map S")
    show(axes[2], content.bits(), f"content O, |O| = {loopbit.count(content)}")
    save(figure, folder / "content.svg")


def draw_candidates(images, run, query, folder):
    """The candidates of one frame."""
    contents = run.contents()
    index = loopbit.PlaceIndex()
    for frame in range(query - 60):
        index.add(contents[frame])
    found = index.query(contents[query])[:3]
    figure, axes = panels(2, 2)
    show(axes[0], images[query], f"query {query}")
    for each, (place, similarity) in zip(list(axes)[1:], found):
        show(each, images[place], f"place {place}, xi = {similarity:.2f}")
    save(figure, folder / "candidates.svg")


def draw_inliers(images, detection, folder):
    """The matches that fit one epipolar geometry."""
    pair = [images[detection.frame], images[detection.match]]
    query, place = map(loopbit.extract_surf, pair)
    inliers = loopbit.verify(query, place).inliers
    height, width = pair[0].shape[:2]
    scale = width / query.working_size_px[0]
    figure, axes = pyplot.subplots(figsize=(5.0, 2.2), layout="constrained")
    axes.imshow(np.hstack(pair)[..., ::-1])
    for i, j in inliers[::4]:
        a, b = query.keypoints[i], place.keypoints[j]
        axes.plot([a["x_px"] * scale, b["x_px"] * scale + width],
                  [a["y_px"] * scale, b["y_px"] * scale], color="yellow", linewidth=0.4)
    axes.set_title(f"query {detection.frame} and place {detection.match}: "
                   f"{len(inliers)} inliers, every fourth drawn", fontsize=9)
    axes.set_axis_off()
    save(figure, folder / "inliers.svg")


def main():
    command, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="loopbit_pictures_") as scratch:
        town = pathlib.Path(scratch) / "town"
        subprocess.run([command, "demo", *WORLD, "--write-images", town], check=True,
                       stdout=subprocess.DEVNULL)
        images = [frame.image for frame in loopbit.open_source(town / "images")]
        truth = loopbit.read_truth(town / "truth.csv", not_false=town / "not_false.csv")
        run = loopbit.run_folder(town / "images", pathlib.Path(scratch) / "run", truth=truth,
                                 positions_m=town / "poses.txt")
        draw_content(images, folder)
        loop = max((d for d in run.detections if d.is_loop), key=lambda d: d.score)
        draw_candidates(images, run, loop.frame, folder)
        draw_inliers(images, loop, folder)
        plots = {"trajectory": loopbit.plots.trajectory(run),
                 "similarity": loopbit.plots.similarity(run),
                 "precision_recall": loopbit.plots.precision_recall(loopbit.evaluate(run)),
                 "times": loopbit.plots.times(run)}
        for name, axes in plots.items():
            save(axes.figure, folder / f"{name}.svg")


if __name__ == "__main__":
    main()
