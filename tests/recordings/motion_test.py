# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Camera and odometry of recordings that other libraries wrote. Run by run.sh."""

import csv
import json

import numpy as np
import pytest

import loopbit
from recordings_test import compressed, loopbit_command, mcap, stamp, write

FRAMES = 80
# The axes of a camera that looks ahead, on a robot with x ahead and z up, 0.3 m before its centre.
T_BASE_CAMERA = np.array([[0, 0, 1, 0.3], [-1, 0, 0, -0.05], [0, -1, 0, 0.5], [0, 0, 0, 1.0]])
# The camera on a mast that is turned by 30 degrees.
T_BASE_MAST = np.array([[np.cos(np.pi / 6), -np.sin(np.pi / 6), 0, 0.1],
                        [np.sin(np.pi / 6), np.cos(np.pi / 6), 0, 0], [0, 0, 1, 0.2], [0, 0, 0, 1]])
T_MAST_CAMERA = np.linalg.inv(T_BASE_MAST) @ T_BASE_CAMERA


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """A folder with images, camera.yaml and poses.txt."""
    folder = tmp_path_factory.mktemp("town") / "dataset"
    loopbit_command("demo", "--frames", FRAMES, "--world", "laps=2", "--world", "spacing_m=2.8",
                    "--world", "width_px=320", "--world", "height_px=240", "--write-images", folder)
    return folder


@pytest.fixture(scope="module")
def poses(town):
    rows = np.loadtxt(town / "poses.txt").reshape(-1, 3, 4)
    return [np.vstack([row, [0, 0, 0, 1]]) for row in rows]


def quaternion(rotation):
    """x y z w, by the largest of the four."""
    r = rotation
    candidates = np.array([
        [1 + r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]],
        [r[0, 1] + r[1, 0], 1 - r[0, 0] + r[1, 1] - r[2, 2], r[1, 2] + r[2, 1], r[0, 2] - r[2, 0]],
        [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], 1 - r[0, 0] - r[1, 1] + r[2, 2], r[1, 0] - r[0, 1]],
        [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], 1 + np.trace(r)]])
    best = max(candidates, key=np.linalg.norm)
    return dict(zip("xyzw", best / np.linalg.norm(best)))


def vector(values):
    return dict(zip("xyz", map(float, values)))


def header(number, frame):
    seconds, nanoseconds = stamp(number)
    return {"seq": 1, "stamp": {"sec": seconds, "nsec": nanoseconds, "nanosec": nanoseconds},
            "frame_id": frame}


def message(topic, type_, number, fields):
    return {"topic": topic, "type": type_, "number": number, "stamp": stamp(number), "data": b"",
            "fields": fields}


def odometry(number, T, parent="odom", child="base_link", topic="/odom"):
    pose = {"position": vector(T[:3, 3]), "orientation": quaternion(T[:3, :3])}
    twist = {"linear": vector([0] * 3), "angular": vector([0] * 3)}
    return message(topic, "nav_msgs/Odometry", number, {
        "header": header(number, parent), "child_frame_id": child,
        "pose": {"pose": pose, "covariance": [0.0] * 36},
        "twist": {"twist": twist, "covariance": [0.0] * 36}})


def pose_stamped(number, T):
    return message("/pose", "geometry_msgs/PoseStamped", number, {
        "header": header(number, "world"),
        "pose": {"position": vector(T[:3, 3]), "orientation": quaternion(T[:3, :3])}})


def tf(number, *edges, topic="/tf"):
    """edges: (parent, child, T_parent_child)."""
    return message(topic, "tf2_msgs/TFMessage", number, {"transforms": [
        {"header": header(number, parent), "child_frame_id": child,
         "transform": {"translation": vector(T[:3, 3]), "rotation": quaternion(T[:3, :3])}}
        for parent, child, T in edges]})


def camera_info(town, **changes):
    camera, = loopbit.read_cameras(town / "camera.yaml")
    k = [camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0]
    p = [camera.fx, 0.0, camera.cx, 0.0, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0]
    d, r = [0.0] * 5, np.eye(3).ravel().tolist()
    roi = {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False}
    fields = {"header": header(0, "camera"), "height": 240, "width": 320,
              "distortion_model": "plumb_bob", "binning_x": 0, "binning_y": 0, "roi": roi,
              "k": k, "d": d, "r": r, "p": p} | changes
    # ROS 1 has capitals.
    fields |= {name.upper(): fields[name] for name in "kdrp"}
    return message("/camera/camera_info", "sensor_msgs/CameraInfo", 0, fields)


def images(town):
    return [compressed(i, file.read_bytes(), "png", "/camera/image_raw/compressed")
            for i, file in enumerate(sorted((town / "images").iterdir(), key=lambda f: int(f.stem)))]


def in_order(messages):
    return sorted(messages, key=lambda each: each["number"])


def decisions(folder):
    with open(folder / "loops.csv", newline="") as file:
        return [(row["status"], row["match"], row["score"]) for row in csv.DictReader(file)]


def relative_poses(folder):
    with open(folder / "relative_poses.csv", newline="") as file:
        return list(csv.DictReader(file))


STATIC = tf(0, ("base_link", "mast", T_BASE_MAST), ("mast", "camera", T_MAST_CAMERA), topic="/tf_static")


def base_poses(poses):
    return [pose @ np.linalg.inv(T_BASE_CAMERA) for pose in poses]


@pytest.mark.parametrize("encoding", ["ros2", "ros1"])
def test_camera_and_odometry_are_those_of_files(town, poses, tmp_path, encoding):
    drive = [odometry(i, T) for i, T in enumerate(base_poses(poses))]
    recording = tmp_path / "drive.mcap"
    write(tmp_path, mcap(recording, in_order([STATIC, camera_info(town), *images(town), *drive]), encoding))
    ran = loopbit_command("run", recording, "--odometry-topic", "/odom", "--out", tmp_path / "ours",
                          "--no-report")
    assert ran.stderr.count("loopbit:") == 0
    loopbit_command("run", town / "images", "--camera", town / "camera.yaml", "--odometry",
                    town / "poses.txt", "--out", tmp_path / "files", "--no-report")
    assert decisions(tmp_path / "ours") == decisions(tmp_path / "files")
    ours, theirs = (relative_poses(tmp_path / side) for side in ("ours", "files"))
    assert len(ours) == len(theirs) > 20
    # The last digits of the odometry differ, which may decide whether a pose has a rival.
    same = [mine["status"] == other["status"] and mine["scale"] == other["scale"]
            for mine, other in zip(ours, theirs)]
    assert sum(same) >= 0.9 * len(same)
    assert any(mine["scale"] == "known" for mine in ours)
    record = json.loads((tmp_path / "ours/run.json").read_text())
    assert record["camera"] == str(recording) and "/odom" in record["input"]["description"]
    source = loopbit.open_source(recording, odometry_topic="/odom")
    for frame, pose in zip(source, poses):
        assert frame.T_odometry_camera == pytest.approx(pose, abs=1e-6)


def test_transforms_from_the_camera_up_to_odom(town, poses, tmp_path):
    jump = np.eye(4)
    messages = [STATIC, *images(town)]
    for i, T in enumerate(base_poses(poses)):
        jump[0, 3] = 50 * (i % 2)
        messages += [tf(i, ("map", "odom", jump)), tf(i, ("/odom", "/base_link", T), ("base_link", "wheel", T))]
    recording = tmp_path / "drive.mcap"
    write(tmp_path, mcap(recording, in_order(messages)))
    frames = list(loopbit.open_source(recording, odometry_topic="/tf"))
    assert len(frames) == FRAMES
    for frame, pose in zip(frames, poses):
        assert frame.T_odometry_camera == pytest.approx(pose, abs=1e-6)


def test_a_pose_without_a_child_is_that_of_the_camera(town, poses, tmp_path):
    recording = tmp_path / "drive.mcap"
    given = {i: pose for i, pose in enumerate(poses) if i % 3 == 0}
    write(tmp_path, mcap(recording, in_order([*images(town), *(pose_stamped(i, T) for i, T in given.items())])))
    for i, frame in enumerate(loopbit.open_source(recording, odometry_topic="/pose")):
        if i % 3 == 0:
            assert frame.T_odometry_camera == pytest.approx(poses[i], abs=1e-6)
        else:    # a pose 33 ms away is near enough
            near = [given[j] for j in (i - 1, i + 1) if j in given]
            assert any(frame.T_odometry_camera == pytest.approx(T, abs=1e-6) for T in near)


def test_errors_say_what_is_missing(town, poses, tmp_path):
    pictures = images(town)[:4]
    drive = [odometry(i, T) for i, T in enumerate(base_poses(poses)[:4])]
    late = [message | {"number": message["number"] + 300} for message in pictures]
    late = [message | {"stamp": stamp(message["number"])} for message in late]
    moving = [tf(i, ("base_link", "camera", T)) for i, T in enumerate(poses[:4])]
    broken = odometry(2, np.eye(4))
    broken["fields"]["pose"]["pose"]["orientation"]["w"] = 0.5
    for name, messages, topic, kind, parts in [
            ("no_tf", pictures + drive, "/odom", loopbit.InputError, ["'camera'", "'base_link'", "/tf_static"]),
            ("no_topic", pictures + drive, "/odometry", loopbit.OptionError, ["'/odometry'", "/odom (nav_msgs"]),
            ("images", pictures + drive, "/camera/image_raw/compressed", loopbit.OptionError, ["no odometry"]),
            ("late", late + drive + [STATIC], "/odom", loopbit.InputError, ["ends at", "begin at"]),
            ("moving", pictures + drive + moving, "/odom", loopbit.InputError, ["'camera' moves in 'base_link'"]),
            ("no_rotation", pictures + drive + [broken, STATIC], "/odom", loopbit.InputError, ["unit quaternion"])]:
        recording = tmp_path / f"{name}.mcap"
        write(tmp_path, mcap(recording, in_order(messages)))
        with pytest.raises(kind) as error:
            loopbit.open_source(recording, odometry_topic=topic)
        for part in [str(recording), *parts]:
            assert part in str(error.value), name
    with pytest.raises(loopbit.OptionError, match="is no recording, so it has no topic '/odom'"):
        loopbit.open_source(town / "images", odometry_topic="/odom")
    both = loopbit_command("run", tmp_path / "no_tf.mcap", "--odometry-topic", "/odom", "--odometry",
                           town / "poses.txt", code=2)
    assert "--odometry" in both.stderr


def test_the_camera_is_that_of_the_images(town, tmp_path):
    def camera_of(name, topic="", images_topic="/camera/image_raw/compressed", **changes):
        pictures = [message | {"topic": images_topic} for message in images(town)[:1]]
        recording = tmp_path / f"{name}.mcap"
        write(tmp_path, mcap(recording, [camera_info(town, **changes), *pictures]))
        yaml = loopbit.recorded_camera_info(recording, topic)
        if not yaml:
            return None
        (tmp_path / "camera.yaml").write_text(yaml)
        return loopbit.read_cameras(tmp_path / "camera.yaml")[0]

    expected, = loopbit.read_cameras(town / "camera.yaml")
    camera = camera_of("plain")
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (expected.fx, expected.fy, expected.cx, expected.cy)
    assert camera_of("raw", images_topic="/camera/image_raw") is not None
    assert camera_of("elsewhere", images_topic="/left/image_raw") is None
    assert camera_of("uncalibrated", k=[0.0] * 9) is None
    bent = camera_of("bent", d=[0.1, 0.02, 0.0, 0.0, 0.0])
    assert bent.lens == "radial_tangential" and list(bent.distortion[:2]) == [0.1, 0.02]
    rectified = camera_of("rect", images_topic="/camera/image_rect", d=[0.1, 0.02, 0.0, 0.0, 0.0])
    assert rectified.lens == "pinhole"
    # A window of 200 x 160, of which every second pixel is kept: the centre of pixel 0 is at 0.5.
    window = {"x_offset": 60, "y_offset": 40, "height": 160, "width": 200, "do_rectify": False}
    half = camera_of("window", roi=window, binning_x=2, binning_y=2)
    assert list(half.size_px) == [100, 80]
    assert (half.fx, half.cx, half.cy) == pytest.approx(
        (expected.fx / 2, (expected.cx - 60 + 0.5) / 2 - 0.5, (expected.cy - 40 + 0.5) / 2 - 0.5))


def test_a_camera_that_does_not_fit_costs_the_poses_only(town, tmp_path):
    recording = tmp_path / "drive.mcap"
    write(tmp_path, mcap(recording, [camera_info(town, width=640, height=480), *images(town)[:3]]))
    ran = loopbit_command("run", recording, "--out", tmp_path / "out", "--no-report")
    assert "No relative poses" in ran.stderr and "640 x 480" in ran.stderr
    assert not (tmp_path / "out/relative_poses.csv").exists()


