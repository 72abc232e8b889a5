# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Recordings that other libraries wrote: MCAP and CDR by Foxglove's, bags by ROS 1's, and the tables
of rosbag2 by Python's SQLite. Run by run.sh."""

import csv
import io
import json
import os
import pathlib
import sqlite3
import struct
import subprocess
import sys

import genpy
import numpy as np
import pytest
import rosbag
import sensor_msgs.msg
from PIL import Image

import loopbit

HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))
from served_command import run_command  # noqa: E402

LOOPBIT = os.environ["LOOPBIT_COMMAND"]
TOPIC = "/camera/image_raw"
START_S = 1_700_000_000
PERIOD_NS = 33_333_333
# CREATE TABLE as rosbag2 writes it.
ROSBAG2 = """
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
  serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
  data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
"""


def loopbit_command(*arguments, code=0):
    ran = run_command(LOOPBIT, *arguments)
    assert ran.returncode == code, ran.stderr
    return ran


def stamp(number):
    return divmod(START_S * 10**9 + number * PERIOD_NS, 10**9)


def name_of(number):
    seconds, rest = stamp(number)
    return f"{seconds}.{rest:09}"


def raw(number, array, encoding, topic=TOPIC, padding=0, big_endian=False):
    """A message with the pixels of an array, each row `padding` bytes longer than it need be."""
    height, width = array.shape[:2]
    rows = np.ascontiguousarray(array).view(np.uint8).reshape(height, -1)
    rows = np.pad(rows, ((0, 0), (0, padding)), constant_values=0xAB)
    return {"topic": topic, "type": "Image", "number": number, "stamp": stamp(number),
            "width": width, "height": height, "step": rows.shape[1], "encoding": encoding,
            "is_bigendian": int(big_endian), "data": rows.tobytes()}


def compressed(number, data, encoding="jpeg", topic=TOPIC):
    return {"topic": topic, "type": "CompressedImage", "number": number, "stamp": stamp(number),
            "encoding": encoding, "data": data}


def write(folder, *specs):
    """Has write.mjs write recordings or messages of these specs."""
    for spec in specs:
        spec["out"] = str(spec["out"])
        spec["messages"] = [dict(message) for message in spec["messages"]]
        for i, message in enumerate(spec["messages"]):
            data = message.pop("data")
            file = folder / f"data_{len(data)}_{hash(data) & 0xffffffffffff:x}"
            if not file.exists():
                file.write_bytes(data)
            message["file"] = str(file)
            # Recorded a moment after it was taken.
            message["time_ns"] = str((START_S * 10**9) + message["number"] * PERIOD_NS + 5_000_000)
    file = folder / "specs.json"
    file.write_text(json.dumps(specs))
    subprocess.run(["node", HERE / "write.mjs", os.environ["LOOPBIT_NODE_MODULES"], file], check=True)


def mcap(out, messages, encoding="ros2", compression="", chunked=True, chunk_size=1 << 20):
    return {"out": out, "container": "mcap", "encoding": encoding, "messages": messages,
            "compression": compression, "chunked": chunked, "chunk_size": chunk_size}


def cdr_messages(folder, messages):
    """The messages in CDR."""
    file = folder / "messages"
    write(folder, {"out": file, "container": "messages", "encoding": "ros2", "messages": messages})
    data = file.read_bytes()
    while data:
        size, = struct.unpack_from("<I", data)
        yield data[4:4 + size]
        data = data[4 + size:]


def write_db3(file, folder, messages, rows=None):
    with sqlite3.connect(file) as database:
        database.executescript(ROSBAG2)
        topics = {}
        for message, data in zip(messages, rows or cdr_messages(folder, messages)):
            if message["topic"] not in topics:
                topics[message["topic"]] = len(topics) + 1
                database.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')",
                                 (len(topics), message["topic"], f"sensor_msgs/msg/{message['type']}"))
            time_ns = START_S * 10**9 + message["number"] * PERIOD_NS + 5_000_000
            database.execute("INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)",
                             (topics[message["topic"]], time_ns, data))
    database.close()
    return file


def write_bag(file, messages, compression=rosbag.Compression.NONE, chunk_bytes=768 * 1024):
    with rosbag.Bag(str(file), "w", compression=compression, chunk_threshold=chunk_bytes) as bag:
        for message in messages:
            ros = getattr(sensor_msgs.msg, message["type"])()
            ros.header.stamp = genpy.Time(*message["stamp"])
            ros.header.frame_id = "camera"
            ros.data = message["data"]
            if message["type"] == "Image":
                for field in ("width", "height", "step", "encoding", "is_bigendian"):
                    setattr(ros, field, message[field])
            else:
                ros.format = message["encoding"]
            late = genpy.Time(*divmod(START_S * 10**9 + message["number"] * PERIOD_NS + 5_000_000, 10**9))
            bag.write(message["topic"], ros, t=late)
    return file


def read(recording, **options):
    source = loopbit.open_source(recording, **options)
    return list(source), source.early_end()


def png(array):
    file = io.BytesIO()
    Image.fromarray(array).save(file, "png")
    return file.getvalue()


@pytest.fixture(scope="session")
def images(tmp_path_factory):
    """A folder of the images of corridor_loop, or of the built-in town where there are none."""
    if "LOOPBIT_DATA" in os.environ:
        return pathlib.Path(os.environ["LOOPBIT_DATA"]) / "corridor_loop/images"
    folder = tmp_path_factory.mktemp("town") / "dataset"
    loopbit_command("demo", "--frames", 80, "--world", "laps=2", "--world", "spacing_m=2.8",
                    "--world", "width_px=320", "--world", "height_px=240", "--write-images", folder)
    return folder / "images"


@pytest.fixture(scope="session")
def pictures(images):
    """The first three, 64 x 48, as BGR arrays."""
    arrays = [frame.image for frame in loopbit.open_source(images, limit=3)]
    return [array[100:148, 100:164].copy() for array in arrays]


@pytest.fixture(scope="session")
def reference(images, tmp_path_factory):
    return decisions_of(images, tmp_path_factory.mktemp("reference") / "run")


def decisions_of(source, folder):
    """loops.csv without times and names."""
    loopbit_command("run", source, "--out", folder, "--no-report", "--quiet")
    with open(folder / "loops.csv", newline="") as file:
        return [{k: v for k, v in row.items() if not k.endswith("_ms") and k not in
                 ("timestamp", "name", "match_name")} for row in csv.DictReader(file)]


def test_all_containers_give_the_loops_of_the_folder(images, reference, tmp_path):
    assert sum(row["status"] == "loop" for row in reference) > 20
    frames = [frame.image for frame in loopbit.open_source(images)]
    color = [raw(i, image, "bgr8") for i, image in enumerate(frames)]
    files = [compressed(i, file.read_bytes(), file.suffix[1:])
             for i, file in enumerate(sorted(images.iterdir()))]
    specs = [mcap(tmp_path / "unchunked.mcap", files, chunked=False),
             mcap(tmp_path / "none.mcap", color), mcap(tmp_path / "ros1.mcap", files, "ros1"),
             mcap(tmp_path / "lz4.mcap", files, compression="lz4"),
             mcap(tmp_path / "zstd.mcap", color, compression="zstd")]
    write(tmp_path, *specs)
    folder = tmp_path / "ros2_bag"
    folder.mkdir()
    (folder / "metadata.yaml").write_text("rosbag2_bagfile_information:\n  version: 5\n")
    half = len(files) // 2
    write_db3(folder / "bag_0.db3", tmp_path, files[:half])
    write_db3(folder / "bag_1.db3", tmp_path, files[half:])
    recordings = [pathlib.Path(spec["out"]) for spec in specs] + [
        folder, write_bag(tmp_path / "none.bag", color),
        write_bag(tmp_path / "lz4.bag", files, rosbag.Compression.LZ4),
        write_bag(tmp_path / "bz2.bag", files, rosbag.Compression.BZ2)]
    for recording in recordings:
        assert decisions_of(recording, tmp_path / f"{recording.name}_run") == reference, recording


def encodings(picture):
    """(a message's array, its encoding, what has to be read of it)."""
    b, g, r = np.moveaxis(picture, 2, 0)
    alpha = np.full_like(b, 200)
    wide = picture.astype(np.uint16) * 257 + 3
    bgra = np.stack([b, g, r, alpha], axis=2)
    rgba = np.stack([r, g, b, alpha], axis=2)
    return [(g, "mono8", g), (g, "8UC1", g), (wide[..., 1], "mono16", wide[..., 1]),
            (wide[..., 1], "16UC1", wide[..., 1]), (picture, "bgr8", picture),
            (picture, "8UC3", picture), (picture[..., ::-1], "rgb8", picture),
            (bgra, "bgra8", bgra), (bgra, "8UC4", bgra), (rgba, "rgba8", bgra),
            (wide, "bgr16", wide), (wide[..., ::-1], "rgb16", wide)]


def test_encodings_and_rows_in_every_serialization(pictures, tmp_path):
    cases = encodings(pictures[0])
    messages = [raw(i, array, encoding, padding=(0, 2, 10)[i % 3])
                for i, (array, encoding, _) in enumerate(cases)]
    big = [raw(i, array.astype(array.dtype.newbyteorder(">")), encoding, big_endian=True)
           for i, (array, encoding, _) in enumerate(cases)]
    write(tmp_path, mcap(tmp_path / "cdr.mcap", messages),
          mcap(tmp_path / "big_endian_cdr.mcap", messages, "ros2be"),
          mcap(tmp_path / "ros1.mcap", messages, "ros1"), mcap(tmp_path / "big.mcap", big))
    recordings = ["cdr.mcap", "big_endian_cdr.mcap", "ros1.mcap", "big.mcap",
                  write_bag(tmp_path / "ros1.bag", messages),
                  write_db3(tmp_path / "cdr.db3", tmp_path, messages)]
    for recording in recordings:
        frames, early_end = read(tmp_path / recording)
        assert early_end == "" and len(frames) == len(cases)
        for number, (frame, (_, encoding, expected)) in enumerate(zip(frames, cases)):
            assert frame.error == ""
            assert np.array_equal(frame.image, expected), (recording, encoding)
            assert frame.name == name_of(number)
            assert frame.timestamp_s == pytest.approx(START_S + number * PERIOD_NS / 1e9, abs=1e-6)


def test_bayer_patterns(pictures, tmp_path):
    picture = pictures[0]
    patterns = {"rggb": "RGGB", "bggr": "BGGR", "gbrg": "GBRG", "grbg": "GRBG"}
    channel = {letter: "BGR".index(letter) for letter in "BGR"}
    messages = []
    mosaics = []
    for depth in (8, 16):
        for pattern, letters in patterns.items():
            source = picture if depth == 8 else picture.astype(np.uint16) * 257
            mosaic = np.empty(source.shape[:2], source.dtype)
            for i, letter in enumerate(letters):
                y, x = divmod(i, 2)
                mosaic[y::2, x::2] = source[y::2, x::2, channel[letter]]
            messages.append(raw(len(messages), mosaic, f"bayer_{pattern}{depth}"))
            mosaics.append((letters, source))
    write(tmp_path, mcap(tmp_path / "bayer.mcap", messages))
    frames, _ = read(tmp_path / "bayer.mcap")
    assert len(frames) == len(mosaics)
    for frame, (letters, source) in zip(frames, mosaics):
        for i, letter in enumerate(letters):    # what was measured has to stay
            y, x = divmod(i, 2)
            inside = (slice(2 + y, -2, 2), slice(2 + x, -2, 2), channel[letter])
            assert np.array_equal(frame.image[inside], source[inside]), letters


def test_yuv422(tmp_path):
    generator = np.random.default_rng(1)
    y = generator.integers(16, 236, (6, 8))
    u, v = (np.repeat(generator.integers(90, 166, (6, 4)), 2, axis=1) for _ in range(2))
    # ITU-R BT.601, limited range.
    luma, d, e = 1.164 * (y - 16.0), u - 128.0, v - 128.0
    expected = np.stack([luma + 2.018 * d, luma - 0.813 * e - 0.391 * d, luma + 1.596 * e], axis=2)
    chroma = np.where(np.arange(8) % 2 == 0, u, v)
    uyvy = np.stack([chroma, y], axis=2).astype(np.uint8)
    messages = [raw(0, uyvy, "yuv422"), raw(1, uyvy, "uyvy"), raw(2, uyvy[..., ::-1], "yuv422_yuy2"),
                raw(3, uyvy[..., ::-1], "yuyv")]
    for message in messages:
        message["width"] = 8
    write(tmp_path, mcap(tmp_path / "yuv.mcap", messages))
    frames, _ = read(tmp_path / "yuv.mcap")
    assert len(frames) == 4
    for frame in frames:
        assert np.abs(frame.image - np.clip(expected, 0, 255)).max() <= 2


def test_compressed_images(pictures, tmp_path):
    picture = pictures[0]
    rgb = picture[..., ::-1].copy()
    jpeg = io.BytesIO()
    Image.fromarray(rgb).save(jpeg, "jpeg", quality=90)
    (tmp_path / "one.jpg").write_bytes(jpeg.getvalue())
    decoded = next(loopbit.open_source(tmp_path / "one.jpg")).image
    deep = picture[..., 1].astype(np.uint16) * 257
    messages = [compressed(0, png(rgb), "png"), compressed(1, png(rgb[..., 1]), "mono8; png compressed "),
                compressed(2, png(deep), "16UC1; png compressed"),
                compressed(3, jpeg.getvalue(), "rgb8; jpeg compressed bgr8")]
    expected = [picture, picture[..., 1], deep, decoded]
    write(tmp_path, mcap(tmp_path / "c.mcap", messages), mcap(tmp_path / "c1.mcap", messages, "ros1"))
    for recording in ("c.mcap", "c1.mcap", write_bag(tmp_path / "c.bag", messages)):
        frames, _ = read(tmp_path / recording)
        assert [np.array_equal(f.image, e) for f, e in zip(frames, expected)] == [True] * 4, recording


def test_messages_that_rosbag2_compressed_one_by_one(pictures, tmp_path):
    messages = [raw(i, picture, "bgr8") for i, picture in enumerate(pictures)]
    rows = [subprocess.run(["zstd", "-q"], input=row, capture_output=True, check=True).stdout
            for row in cdr_messages(tmp_path, messages)]
    frames, _ = read(write_db3(tmp_path / "a.db3", tmp_path, messages, rows))
    assert [np.array_equal(f.image, p) for f, p in zip(frames, pictures)] == [True] * 3


def test_a_stamp_of_0_gives_way_to_the_time_of_recording(pictures, tmp_path):
    message = raw(4, pictures[0], "bgr8") | {"stamp": [0, 0]}
    frame, = read(write_bag(tmp_path / "a.bag", [message]))[0]
    assert frame.name == f"{START_S}.{4 * PERIOD_NS + 5_000_000:09}"


def test_frames_that_cannot_be_read_are_named(pictures, tmp_path):
    good = raw(0, pictures[0], "bgr8")
    broken = [good | {"encoding": "nv12"}, good | {"step": 10}, good | {"height": 4000},
              good | {"width": 0}, good | {"width": 100_000, "height": 100_000},
              compressed(5, png(pictures[0])[:-20]), compressed(6, b""), compressed(7, b"no image")]
    broken = [message | {"topic": TOPIC, "number": i} for i, message in enumerate(broken)]
    parts = ["has the encoding 'nv12'", "which do not fit", "which do not fit", "0 x 48 pixels",
             "max_megapixels is 100", "is cut off", "damaged or not an image", "damaged or not an image"]
    raws, files = broken[:5], broken[5:]
    for recording, first in ((write_bag(tmp_path / "raw.bag", raws), 0),
                             (write_bag(tmp_path / "files.bag", files), 5)):
        frames, _ = read(recording)
        assert len(frames) == (5 if first == 0 else 3)
        for frame, part in zip(frames, parts[first:]):
            assert frame.image is None and part in frame.error, frame.error
            assert recording.name in frame.error and TOPIC in frame.error


@pytest.mark.parametrize("kind", ["none.mcap", "lz4.mcap", "zstd.mcap", "plain.mcap", "none.bag",
                                  "lz4.bag", "bz2.bag", "a.db3"])
def test_recordings_that_are_cut_off_are_read_as_far_as_they_go(kind, pictures, tmp_path):
    messages = [raw(i, pictures[i % 3], "bgr8") for i in range(40)]
    compression, container = kind.split(".")
    file = tmp_path / kind
    if container == "bag":
        write_bag(file, messages, compression, chunk_bytes=30_000)
    elif container == "db3":
        write_db3(file, tmp_path, messages)
    else:
        known = compression if compression in ("lz4", "zstd") else ""
        write(tmp_path, mcap(file, messages, compression=known, chunked=compression != "plain",
                             chunk_size=30_000))
    data = file.read_bytes()
    whole, early_end = read(file)
    assert len(whole) == 40 and early_end == ""
    counts = []
    for size in np.linspace(0, len(data) - 1, 50).astype(int):
        cut = tmp_path / f"cut.{container}"
        cut.write_bytes(data[:size])
        try:
            frames, early_end = read(cut)
        except loopbit.Error as error:
            assert str(cut) in str(error)
            counts.append(0)
            continue
        for number, frame in enumerate(frames):
            assert np.array_equal(frame.image, pictures[number % 3]), (size, number, frame.error)
        # Behind the last message there is only the index, without which a bag counts as cut off.
        assert len(frames) == 40 or "missing: copy it again" in early_end
        counts.append(len(frames))
    if container == "db3":    # SQLite gives all or none where its tables are cut off
        assert counts[0] == 0
    else:
        assert counts == sorted(counts) and counts[0] == 0 and counts[-1] == 40
        # Blocks that are compressed together are read together.
        assert len(set(counts)) > (20 if compression in ("none", "plain") else 8)


def test_a_damaged_chunk_costs_only_its_own_messages(pictures, tmp_path):
    messages = [raw(i, pictures[i % 3], "bgr8") for i in range(40)]
    for compression in ("", "lz4", "zstd"):
        file = tmp_path / f"of_{compression}.mcap"
        write(tmp_path, mcap(file, messages, compression=compression, chunk_size=30_000))
        data = bytearray(file.read_bytes())
        for place in (len(data) // 2, 300):    # the first chunk has the channel of all
            damaged = data.copy()
            damaged[place:place + 8] = bytes(8 * [0x55])
            file.write_bytes(damaged)
            frames, early_end = read(file)
            assert 30 <= len(frames) < 40 and all(frame.error == "" for frame in frames)
            assert "has 1 damaged chunk, whose messages are missing" in early_end


def test_a_recorder_that_was_killed_leaves_a_bag_without_index(pictures, tmp_path):
    file = tmp_path / "a.bag.active"
    messages = [raw(i, pictures[i % 3], "bgr8") for i in range(9)]
    bag = rosbag.Bag(str(file), "w", chunk_threshold=30_000)
    for message in messages:
        ros = sensor_msgs.msg.Image(data=message["data"])
        for field in ("width", "height", "step", "encoding"):
            setattr(ros, field, message[field])
        bag.write(TOPIC, ros, t=genpy.Time(START_S))
    bag._file.flush()
    killed = tmp_path / "killed.bag.active"
    killed.write_bytes(file.read_bytes())
    bag.close()
    frames, early_end = read(killed)
    assert [np.array_equal(f.image, pictures[i % 3]) for i, f in enumerate(frames)] == [True] * 9
    assert "is cut off" in early_end


def test_topics(pictures, tmp_path):
    left, right = ([raw(i, picture, "bgr8", f"/{side}") for i, picture in enumerate(pictures)]
                   for side in ("left", "right"))
    both = [message for pair in zip(left, right) for message in pair]
    file = write_bag(tmp_path / "stereo.bag", both)
    with rosbag.Bag(str(file), "a") as bag:
        bag.write("/info", sensor_msgs.msg.CameraInfo(), t=genpy.Time(START_S + 1))
    write(tmp_path, mcap(tmp_path / "stereo.mcap", both))
    db3 = write_db3(tmp_path / "stereo.db3", tmp_path, both)
    for recording in (file, tmp_path / "stereo.mcap", db3):
        listed = {topic.name: topic for topic in loopbit.topics(recording)}
        assert listed["/left"].messages == listed["/right"].messages == 3
        assert listed["/left"].has_images and listed["/left"].type.startswith("sensor_msgs/")
        frames, _ = read(recording, topic="/right", every=2)
        assert [frame.name for frame in frames] == [name_of(0), name_of(2)]
        with pytest.raises(loopbit.Error, match="several topics with images.*/left.*/right"):
            loopbit.open_source(recording)
        with pytest.raises(loopbit.Error, match="no topic '/up'.*/left.*/right"):
            loopbit.open_source(recording, topic="/up")
    with pytest.raises(loopbit.Error, match="no images on topic '/info'.*/left"):
        loopbit.open_source(file, topic="/info")
    shown = json.loads(loopbit_command("topics", file, "--json").stdout)
    assert [topic["name"] for topic in shown["topics"]] == ["/info", "/left", "/right"]
    assert shown["duration_s"] == pytest.approx(0.995, abs=1e-3)
    table = loopbit_command("topics", file).stdout
    assert "sensor_msgs/CameraInfo" in table and "ROS 1 bag stereo.bag, 1.0 s" in table


def test_the_command_says_what_is_wrong(images, pictures, tmp_path):
    file = tmp_path / "info.bag"
    with rosbag.Bag(str(file), "w") as bag:
        bag.write("/info", sensor_msgs.msg.CameraInfo(), t=genpy.Time(START_S))
    assert "has no images" in loopbit_command("run", file, code=3).stderr
    assert "/info (sensor_msgs/CameraInfo, 1 messages)" in loopbit_command("run", file, code=3).stderr
    assert "no topic '/x'" in loopbit_command("run", file, "--topic", "/x", code=2).stderr
    assert "is no recording" in loopbit_command("run", images, "--topic", "/x", code=2).stderr
    assert "is not a recording" in loopbit_command("topics", images, code=3).stderr
    for name, data in (("a.mcap", b"x" * 100), ("a.bag", b"#ROSBAG V1.2\n" + 99 * b"\0"), ("b.bag", b""),
                       ("a.db3", b"y" * 5000)):
        (tmp_path / name).write_bytes(data)
        assert name in loopbit_command("topics", tmp_path / name, code=3).stderr
    assert "rosbag fix" in loopbit_command("topics", tmp_path / "a.bag", code=3).stderr
    assert "camera/image_raw" not in loopbit_command("topics", tmp_path / "missing.mcap", code=3).stderr


def test_query_takes_recordings(images, tmp_path):
    town = tmp_path / "town.db"
    loopbit_command("run", images, "--map", town, "--no-report", "--quiet")
    files = [compressed(i, file.read_bytes()) for i, file in enumerate(sorted(images.iterdir())[:4])]
    write(tmp_path, mcap(tmp_path / "drive.mcap", files))
    lines = loopbit_command("query", town, tmp_path / "drive.mcap", "--json").stdout.splitlines()
    assert [json.loads(line)["status"] for line in lines] == ["loop"] * 4
    assert [json.loads(line)["places"][0]["frame"] for line in lines] == [0, 1, 2, 3]
