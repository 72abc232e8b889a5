# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Pose graphs."""

import numpy as np
import pytest

import loopbit

COVARIANCE = np.diag([0.05**2] * 3 + [np.radians(0.5) ** 2] * 3)


def step(turn_deg):
    """1 m ahead, and a turn to the right."""
    turn = np.radians(turn_deg)
    return np.array([[np.cos(turn), 0, np.sin(turn), 0], [0, 1, 0, 0],
                     [-np.sin(turn), 0, np.cos(turn), 1], [0, 0, 0, 1]])


@pytest.fixture
def graph():
    """Two laps around a square; the odometry turns 0.3 degrees too far per metre."""
    graph = loopbit.LoopGraph()
    assert graph.add_keyframe() == 0
    for k in range(1, 81):
        drift = loopbit.OdometryOptions(rotation_deg_per_m=0.3)
        assert graph.add_keyframe(step(90.3 if k % 10 == 0 else 0.3), drift=drift) == k
    return graph


def test_a_graph_corrects_and_rejects(graph, tmp_path):
    assert len(graph) == 81
    assert graph.add_loop(5, 45, T_match_query=np.eye(4), covariance=COVARIANCE) == 0
    assert graph.add_loop(5, 65, T_match_query=np.eye(4), covariance=COVARIANCE) == 1
    before = np.linalg.norm(graph.pose(80)[:3, 3])
    graph.solve()
    right, wrong = graph.loops
    assert (right.match, right.query, right.known) == (5, 45, loopbit.PoseKnown.metric)
    assert right.verdict == loopbit.LoopVerdict.kept and right.chi2 < right.limit
    assert wrong.verdict == loopbit.LoopVerdict.unreachable and wrong.odometry_chi2 > wrong.limit
    assert "query=65, unreachable" in repr(wrong)
    assert np.linalg.norm(graph.pose(80)[:3, 3]) < 0.6 * before
    assert graph.cost() > 0

    graph.write_g2o(tmp_path / "graph.g2o")
    read = loopbit.read_g2o(tmp_path / "graph.g2o")
    assert [loop.verdict for loop in read.loops] == [right.verdict, wrong.verdict]
    assert read.pose(80) == pytest.approx(graph.pose(80), abs=1e-9)


def test_update_follows_a_robot(graph):
    graph.add_loop(5, 45)
    graph.update()
    loop, = graph.loops
    assert loop.known == loopbit.PoseKnown.nothing
    assert loop.verdict == loopbit.LoopVerdict.kept


def test_a_covariance_counts(graph):
    exact = 1e-6 * np.eye(6)
    assert graph.add_keyframe(step(0), exact) == 81
    graph.add_loop(80, 81, T_match_query=step(30), covariance=COVARIANCE)
    graph.solve()
    assert graph.loops[0].verdict == loopbit.LoopVerdict.unreachable


def test_a_measured_pose_is_a_loop(dataset, images):
    camera = loopbit.read_cameras(dataset / "camera.yaml")[0]
    features = loopbit.extract_surf(images[8])
    pose = loopbit.relative_pose(features, features, camera,
                                 match_depth_m=np.full(images[8].shape[:2], 4.0))
    graph = loopbit.LoopGraph(loopbit.LoopGraphOptions(seen_within_m=1.0))
    graph.add_keyframe()
    graph.add_keyframe()
    graph.add_loop(0, 1, pose)
    graph.solve()
    assert graph.loops[0].odometry_chi2 is None and graph.loops[0].known == pose.known


def test_a_run_folder_is_corrected_as_the_command_does(command, dataset, tmp_path):
    given = ["--odometry", dataset / "odometry.txt", "--correct"]
    command("run", dataset, "--out", tmp_path / "cpp", "--no-report", "--no-poses", *given)
    loopbit.run_folder(dataset, tmp_path / "python", evidence=False,
                       odometry=dataset / "odometry.txt", correct=True)
    for name in ("corrected.tum", "judged_loops.csv", "graph.g2o"):
        ours = (tmp_path / "python" / name).read_bytes()
        assert ours and ours == (tmp_path / "cpp" / name).read_bytes(), name
    with pytest.raises(loopbit.InputError, match="No frame has odometry"):
        loopbit.run_folder(dataset / "images", tmp_path / "none", evidence=False, correct=True)


def test_what_does_not_fit_is_refused(graph, tmp_path):
    with pytest.raises(loopbit.InputError, match="two different keyframes from 0 to 80"):
        graph.add_loop(5, 81)
    with pytest.raises(loopbit.InputError, match="not a rigid motion"):
        graph.add_keyframe(2 * np.eye(4))
    with pytest.raises(ValueError, match=r"motion has shape \(3, 4\)"):
        graph.add_keyframe(np.eye(4)[:3])
    with pytest.raises(ValueError, match="covariance belongs to a motion"):
        graph.add_keyframe(covariance=np.eye(6))
    with pytest.raises(ValueError, match="either pose, or T_match_query and covariance"):
        graph.add_loop(5, 45, T_match_query=np.eye(4))
    with pytest.raises(IndexError, match="no keyframe 81"):
        graph.pose(81)
    with pytest.raises(loopbit.OptionError, match="graph.confidence"):
        loopbit.LoopGraphOptions(confidence=2.0)
    with pytest.raises(loopbit.InputError, match="missing.g2o"):
        loopbit.read_g2o(tmp_path / "missing.g2o")
    assert len(graph) == 81
