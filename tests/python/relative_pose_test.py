# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Cameras and relative poses."""

import numpy as np
import pytest

import loopbit


@pytest.fixture(scope="module")
def camera(dataset):
    return loopbit.read_cameras(dataset / "camera.yaml")[0]


def true_pose(dataset, query, match):
    poses = [np.vstack([row.reshape(3, 4), [0, 0, 0, 1]]) for row in
             np.loadtxt(dataset / "poses.txt")]
    return np.linalg.inv(poses[match]) @ poses[query]


def angle_deg(rotation):
    return np.degrees(np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1)))


def test_cameras(camera, tmp_path):
    assert (camera.lens, camera.size_px) == ("pinhole", (320, 240))
    assert len(camera.distortion) == 8 and camera.fx > 0 and camera.cx == pytest.approx(159.5) and "320 x 240" in repr(camera)
    with pytest.raises(loopbit.InputError, match="missing.yaml"):
        loopbit.read_cameras(tmp_path / "missing.yaml")


def test_a_loop_has_the_rotation_of_the_truth(camera, dataset, images):
    detector = loopbit.LoopDetector()
    errors_deg = []
    for image in images:
        loop = detector.process(image)
        if not loop.is_loop:
            continue
        pose = loopbit.relative_pose(detector.features_of(loop.frame),
                                     detector.features_of(loop.match), camera)
        if pose.known == loopbit.PoseKnown.nothing:
            assert pose.status != loopbit.PoseStatus.measured
            continue
        assert pose.covariance.shape == (6, 6) and len(pose.inliers) >= 15 and pose.rms_px > 0
        true = true_pose(dataset, loop.frame, loop.match)
        errors_deg.append(angle_deg(true[:3, :3].T @ pose.T_match_query[:3, :3]))
    assert len(errors_deg) > 10 and np.median(errors_deg) < 0.5


def test_depth_gives_metres(camera, images):
    features = loopbit.extract_surf(images[0])
    ahead = loopbit.extract_surf(images[1])
    far = np.full((240, 320), np.nan, np.float32)
    pose = loopbit.relative_pose(ahead, features, camera, match_depth_m=far)
    assert pose.known != loopbit.PoseKnown.metric and pose.points == 0
    plane = np.full((240, 320), 10.0)  # which contradicts the directions
    pose = loopbit.relative_pose(ahead, features, camera, match_depth_m=plane)
    assert pose.status == loopbit.PoseStatus.ambiguous and pose.points == 0
    pose = loopbit.relative_pose(features, features, camera, match_depth_m=plane)
    assert pose.known == loopbit.PoseKnown.metric and pose.points > 0
    edge = pose.to_g2o_edge(4, 9).split()
    assert edge[:3] == ["EDGE_SE3:QUAT", "4", "9"] and len(edge) == 3 + 7 + 21


@pytest.mark.parametrize("depth, error, words", [
    (np.zeros((240, 320), np.uint16), TypeError, "match_depth_m has dtype uint16"),
    (np.zeros((2, 240, 320), np.float32), ValueError, "match_depth_m has 3 dimensions"),
])
def test_bad_depth_names_the_argument(camera, images, depth, error, words):
    features = loopbit.extract_surf(images[0])
    with pytest.raises(error, match=words):
        loopbit.relative_pose(features, features, camera, match_depth_m=depth)


def test_features_of_a_place(images):
    detector = loopbit.LoopDetector()
    detector.process(images[0])
    assert len(detector.features_of(0)) == len(loopbit.extract_surf(images[0])) > 100
    detector.skip()
    assert len(detector.features_of(1)) == 0
    detector.remove(0)
    assert len(detector.features_of(0)) == 0
    with pytest.raises(loopbit.OptionError, match="There is no frame 2"):
        detector.features_of(2)


def test_a_run_folder_has_relative_poses(command, dataset, tmp_path):
    camera = dataset / "camera.yaml"
    command("run", dataset / "images", "--out", tmp_path / "cpp", "--camera", camera)
    run = loopbit.run_folder(dataset / "images", tmp_path / "python", camera=camera)
    files = [tmp_path / side / "relative_poses.csv" for side in ("python", "cpp")]
    assert files[0].read_bytes() == files[1].read_bytes()
    assert files[0].read_text().count("\n") == 1 + sum(
        d.is_loop + len(d.late_loops) for d in run.detections)


def test_a_run_folder_takes_depth(command, dataset, tmp_path):
    ten_m = b"P5 320 240 65535 " + np.full((240, 320), 10_000, ">u2").tobytes()
    for image in sorted((dataset / "images").iterdir()):
        (tmp_path / image.with_suffix(".pgm").name).write_bytes(ten_m)
    camera = dataset / "camera.yaml"
    command("run", dataset / "images", "--out", tmp_path / "cpp", "--camera", camera, "--depth",
            tmp_path, "--depth-scale", 1000)
    loopbit.run_folder(dataset / "images", tmp_path / "python", camera=camera, depth=tmp_path,
                       depth_scale=1000)
    files = [tmp_path / side / "relative_poses.csv" for side in ("python", "cpp")]
    assert files[0].read_bytes() == files[1].read_bytes()
    scales = {row.split(",")[4] for row in files[0].read_text().splitlines()[1:]}
    assert scales and not scales & {"not_asked", "no_depth"}
