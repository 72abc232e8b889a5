# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
import numpy as np
import pytest

import loopbit

matplotlib = pytest.importorskip("matplotlib")
matplotlib.use("agg")
plots = pytest.importorskip("loopbit.plots")


@pytest.fixture(autouse=True)
def closed_figures():
    yield
    plots.pyplot.close("all")


def labels(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def pixels(figure):
    figure.set_dpi(100)
    figure.canvas.draw()
    return np.asarray(figure.canvas.buffer_rgba())[..., :3].astype(int)


def figures(run):
    score = loopbit.evaluate(run)
    return [plots.trajectory(run), plots.precision_recall({"a": score, "b": score}),
            plots.times(run), plots.similarity(run)]


def test_all_are_grey_and_not_empty(run):
    for axes in figures(run):
        image = pixels(axes.figure)
        assert np.array_equal(image[..., 0], image[..., 1])
        assert np.array_equal(image[..., 1], image[..., 2])
        assert (image < 128).mean() > 0.01


@pytest.mark.parametrize("kind, magic", [("pdf", b"%PDF"), ("svg", b"<?xml")])
def test_vector_output(run, tmp_path, kind, magic):
    for number, axes in enumerate(figures(run)):
        path = tmp_path / f"{number}.{kind}"
        axes.figure.savefig(path)
        assert path.read_bytes().startswith(magic)


def test_trajectory_shows_each_loop(run):
    axes = plots.trajectory(run)
    loops = sum(d.is_loop for d in run.detections)
    missed = len(loopbit.evaluate(run).missed)
    assert len(axes.lines) == 1 + loops + (missed > 0)
    assert labels(axes)[:2] == ["path", "loop"]


def test_trajectory_marks_wrong_loops(dataset, positions, tmp_path):
    wrong = loopbit.run_folder(dataset / "images", tmp_path / "run", evidence=False,
                               truth=loopbit.GroundTruth([]), positions_m=positions)
    assert labels(plots.trajectory(wrong)) == ["path", "wrong loop"]
    with pytest.raises(ValueError, match="no contents"):
        plots.similarity(wrong)


def test_trajectory_needs_positions(dataset, tmp_path):
    source = loopbit.open_source(dataset / "images", limit=2)
    run = loopbit.run_folder(source, tmp_path / "run", evidence=False)
    with pytest.raises(ValueError, match="no positions"):
        plots.trajectory(run)


def test_precision_recall_is_the_curve(run):
    score = loopbit.evaluate(run)
    line, dot = plots.precision_recall(score).lines
    assert np.array_equal(line.get_xdata(), score.curve["recall"])
    assert np.array_equal(line.get_ydata(), score.curve["precision"])
    assert (dot.get_xdata(), dot.get_ydata()) == (score.decision.recall, score.decision.precision)


def test_times_add_up(run):
    axes = plots.times(run, bins=1)
    steps = loopbit.detections_array(run.detections)
    total = sum(steps[name].mean() for name in plots._STEPS)
    top = axes.collections[-1].get_paths()[0].vertices[:, 1].max()
    assert top == pytest.approx(total)
    assert labels(axes) == ["content", "retrieval", "features", "verification"]
    assert plots.times([]).get_xlabel() == "frame"


def test_times_are_those_of_readable_frames(images):
    detector = loopbit.LoopDetector()
    found = [detector.skip() if number in (0, 2, 3) else detector.process(images[number])
             for number in range(6)]
    vertices = plots.times(found).collections[-1].get_paths()[0].vertices
    readable = loopbit.detections_array([found[number] for number in (1, 4, 5)])
    total = sum(readable[name] for name in plots._STEPS)
    assert [vertices[vertices[:, 0] == frame, 1].max() for frame in (1, 4, 5)] == (
        pytest.approx(total))
    assert set(vertices[:, 0]) == {1, 4, 5}
    assert plots.times(found[2:4]).get_ylabel() == "ms per frame"


def test_similarity_of_contents(images):
    contents = [loopbit.binary_content(image) for image in images[:3]]
    matrix = loopbit.similarity_matrix(contents)
    shown = plots.similarity(matrix).images[0].get_array()
    assert np.array_equal(shown, matrix)
    assert (plots.similarity(contents).images[0].get_array() >= matrix).all()
