# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""The parts one by one: images, contents, features, the index, ground truth."""

import pathlib
import pickle

import numpy as np
import pytest

import loopbit
from loopbit import _loopbit

BAD_TYPES = [
    (np.zeros((64, 64)), "dtype float64"),
    (np.zeros((64, 64), np.int8), "dtype int8"),
    (np.zeros((64, 64), ">u2"), "dtype >u2"),
    ([[0] * 64] * 64, "a list"),
    (None, "a NoneType"),
    ("image.png", "a str"),
]
BAD_SHAPES = [(64,), (64, 64, 2), (64, 64, 1), (1, 64, 64, 3), (0, 64), (31, 64), (64, 31, 3)]
USERS = [loopbit.saliency_map, loopbit.binary_content, loopbit.extract_surf,
         lambda image: loopbit.LoopDetector().process(image),
         lambda image: loopbit.LoopDetector().query(image)]


def address(array):
    return array.__array_interface__["data"][0]


@pytest.mark.parametrize("use", USERS)
@pytest.mark.parametrize("image, words", BAD_TYPES)
def test_wrong_type_names_the_argument(use, image, words):
    with pytest.raises(TypeError, match=f"image (is|has) {words}"):
        use(image)


@pytest.mark.parametrize("use", USERS)
@pytest.mark.parametrize("shape", BAD_SHAPES)
def test_wrong_shape_names_the_argument(use, shape):
    with pytest.raises(ValueError, match="image has"):
        use(np.zeros(shape, np.uint8))


def test_images_are_not_copied_where_rows_are_contiguous(images):
    whole = images[0]
    read_only = whole.copy()
    read_only.setflags(write=False)
    for image in (whole, read_only, whole[..., 0].copy(), whole[::2], whole[10:200, 20:300],
                  whole.astype(np.uint16)):
        assert _loopbit._pixels_address(image) == address(image)
    for image in (whole[:, ::-1], whole[..., ::-1], whole[..., 0], np.asfortranarray(whole)):
        assert _loopbit._pixels_address(image) != address(image)


def test_layout_does_not_matter(images):
    image = images[0]
    expected = loopbit.binary_content(image)
    padded = np.zeros((300, 400, 3), np.uint8)
    padded[7:247, 9:329] = image
    for other in (padded[7:247, 9:329], np.asfortranarray(image), image[:, ::-1][:, ::-1],
                  np.dstack([image, image[..., 0]])):
        assert loopbit.binary_content(other) == expected


def test_decoded_frames_are_shared_and_outlive_their_source(dataset, images):
    frames = list(loopbit.open_source(dataset / "images", limit=3))
    kept = [frame.image for frame in frames]
    del frames
    for image, expected in zip(kept, images):
        assert not image.flags.owndata and image.flags.writeable
        assert np.array_equal(image, expected)


def test_source(dataset):
    source = loopbit.open_source(dataset / "images", every=50)
    assert source.size() == 3 and source.every == 50 and "120" not in repr(source)
    assert next(source).name == "000000.png"
    assert source.skip() and [frame.name for frame in source] == ["000100.png"]
    assert not source.skip()
    with pytest.raises(StopIteration):
        next(source)
    with pytest.raises(ValueError, match="every is 0"):
        loopbit.open_source(dataset / "images", every=0)
    with pytest.raises(loopbit.InputError, match="nowhere"):
        loopbit.open_source("nowhere")


def test_unreadable_image(tmp_path):
    (tmp_path / "1.png").write_bytes(b"no image")
    frame = next(loopbit.open_source(tmp_path))
    assert frame.image is None and "1.png" in frame.error and "1.png" in repr(frame)


def test_large_image(tmp_path):
    (tmp_path / "1.pgm").write_bytes(b"P5 2000 1000 255\n" + bytes(2_000_000))
    assert next(loopbit.open_source(tmp_path, max_megapixels=2)).error == ""
    frame = next(loopbit.open_source(tmp_path, max_megapixels=1))
    assert frame.image is None and "2000 x 1000 pixels, but max_megapixels is 1" in frame.error
    with pytest.raises(loopbit.OptionError, match="max_megapixels is 0"):
        loopbit.open_source(tmp_path, max_megapixels=0)


def test_a_video_that_is_cut_off(tmp_path):
    tests = pathlib.Path(__file__).resolve().parent.parent
    whole = (tests.parent / "fuzz/corpus/image_headers/tiny.avi").read_bytes()
    video = tmp_path / "v.avi"
    for size in (len(whole), len(whole) - 20):
        video.write_bytes(whole[:size])
        source = loopbit.open_source(video)
        assert source.early_end() == "" and len(list(source)) == 1
        told = []
        loopbit.run(video, on_bad_frame=told.append)
        assert "16 x 16" in told.pop(0), "the frame is too small for a detector"
        assert told == ([source.early_end()] if size < len(whole) else [])
    assert f"'{video}' is cut off after {size} of" in source.early_end()


def test_content(images):
    saliency = loopbit.saliency_map(images[0])
    assert saliency.shape == (64, 64) and saliency.dtype == np.float32
    content = loopbit.binary_content(images[0])
    bits = content.bits()
    assert np.array_equal(bits, saliency > 1.5 * saliency.mean(dtype=np.float64))
    assert loopbit.count(content) == bits.sum()
    y, x = np.nonzero(bits)
    assert loopbit.center(content) == pytest.approx((x.mean(), y.mean()))
    assert loopbit.BinaryContent.from_bits(bits) == content == loopbit.BinaryContent(content.rows)
    shifted = loopbit.shift_columns(content, 3).bits()
    assert np.array_equal(shifted[:, 3:], bits[:, :-3]) and not shifted[:, :3].any()
    assert pickle.loads(pickle.dumps(content)) == content and len({content, content}) == 1
    assert repr(content).startswith(f"BinaryContent(count={bits.sum()}, center=(")


def test_content_stays_alive_and_unchanged():
    rows = loopbit.BinaryContent(np.arange(64, dtype=np.uint64)).rows
    assert np.array_equal(rows, np.arange(64))
    with pytest.raises(ValueError, match="read-only"):
        rows[0] = 1
    with pytest.raises(ValueError, match=r"rows has shape \(3,\)"):
        loopbit.BinaryContent(np.zeros(3, np.uint64))
    with pytest.raises(ValueError, match=r"bits has shape \(64,\)"):
        loopbit.BinaryContent.from_bits(np.zeros(64, bool))


@pytest.mark.parametrize("tolerance", [0, 4, 63])
def test_similarity_matrix(images, tolerance):
    contents = [loopbit.binary_content(image) for image in images[:12]]
    contents.append(loopbit.BinaryContent(np.zeros(64, np.uint64)))
    places = contents[3:9] + contents[-1:]
    expected = [[loopbit.similarity(a, b, tolerance) for b in places] for a in contents]
    assert np.array_equal(loopbit.similarity_matrix(contents, places, tolerance), expected)
    assert loopbit.similarity_matrix(contents).shape == (13, 13)
    assert loopbit.similarity_matrix([], places).shape == (0, 7)
    for bad in (-1, 64):
        words = f"shift_tolerance_columns is {bad}, but must be between 0 and 63"
        with pytest.raises(loopbit.OptionError, match=words):
            loopbit.similarity_matrix(contents, shift_tolerance_columns=bad)
        with pytest.raises(loopbit.OptionError, match=words):
            loopbit.similarity(contents[0], contents[0], bad)


def test_features(images):
    features = loopbit.extract_surf(images[0], loopbit.SurfOptions(max_keypoints=200))
    keypoints, descriptors = features.keypoints, features.descriptors
    assert features.working_size_px == (640, 480) and len(features) == len(keypoints) <= 200
    assert descriptors.shape == (len(features), 64) and descriptors.dtype == np.int8
    assert keypoints.dtype.names == ("x_px", "y_px", "scale", "angle_rad")
    assert 0 < keypoints["x_px"].min() and keypoints["x_px"].max() < 640
    assert np.linalg.norm(descriptors.astype(float), axis=1) == pytest.approx(254, abs=10)
    assert address(features.keypoints) == address(features.keypoints)
    with pytest.raises(ValueError, match="read-only"):
        keypoints["x_px"] = 0


def test_matches(images):
    a, b = (loopbit.extract_surf(images[i]) for i in (0, 1))
    found = loopbit.verify(a, b)
    ratio = loopbit.VerificationOptions().max_ratio
    assert np.array_equal(found.matches, loopbit.match_features(a, b, ratio))
    assert found.matches.dtype.names == ("query", "place")
    assert set(found.inliers.tolist()) <= set(found.matches.tolist())
    assert 0 < found.distinct_inliers <= len(found.inliers)
    for end, features in (("query", a), ("place", b)):
        assert len(set(found.matches[end])) == len(found.matches)
        assert found.matches[end].max() < len(features)


def test_index_is_a_full_scan(images):
    index = loopbit.PlaceIndex()
    contents = [loopbit.binary_content(image) for image in images]
    for place, content in enumerate(contents[:-1]):
        assert index.add(content) == place
    options = loopbit.RetrievalOptions(max_candidates=5, min_spacing=1, min_similarity=0.0)
    found = index.query(contents[-1], options=options)
    xi = loopbit.similarity_matrix(contents[-1:], contents[:-1], options.shift_tolerance_columns)[0]
    best = np.argsort(-xi, kind="stable")[:5]
    assert np.array_equal(found["place"], best) and np.array_equal(found["similarity"], xi[best])
    assert index.query(contents[-1], end=0).size == 0
    assert len(index) == 119 and index.content(7) == contents[7]
    with pytest.raises(IndexError):
        index.content(119)


def test_truth(truth):
    assert truth.same_place.dtype.names == ("query", "first", "last") and truth.ignored.size == 0
