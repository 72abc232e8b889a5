# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
import inspect
import json
import re

import numpy as np
import pytest
from conftest import as_row, decisions

import loopbit


def test_run_folder_is_that_of_the_command(command, dataset, run, tmp_path):
    command("run", dataset / "images", "--out", tmp_path / "cpp", "--truth", dataset / "truth.csv",
            "--not-false", dataset / "not_false.csv", "--poses", dataset / "poses.txt")
    ours = loopbit.run_folder(dataset / "images", tmp_path / "python",
                              truth=loopbit.read_truth(dataset / "truth.csv",
                                                       not_false=dataset / "not_false.csv"),
                              positions_m=dataset / "poses.txt")
    assert decisions(ours.path) == decisions(tmp_path / "cpp")
    for file in ("truth.csv", "not_false.csv", "ignore.csv", "positions.csv"):
        assert (tmp_path / "python" / file).read_bytes() == (tmp_path / "cpp" / file).read_bytes()
    records = [json.loads((tmp_path / side / "run.json").read_text()) for side in ("python", "cpp")]
    for field in ("loopbit", "input", "stopped_by", "options", "counts", "score"):
        assert records[0][field] == records[1][field], field
    theirs = loopbit.read_run(tmp_path / "cpp")
    assert ours.contents() == theirs.contents() and len(ours.contents()) == 120
    assert [as_row(d) for d in ours.detections] == [
        {**as_row(d), "timestamp": ""} for d in run.detections]


def test_a_mask_is_that_of_the_command(command, dataset, images, tmp_path):
    black = np.full((240, 320), 255, np.uint8)
    black[160:] = 0
    mask = tmp_path / "mask.pgm"
    mask.write_bytes(b"P5 320 240 255 " + black.tobytes())
    command("run", dataset / "images", "--out", tmp_path / "cpp", "--mask", mask, "--no-report")
    run = loopbit.run_folder(dataset / "images", tmp_path / "python", mask=mask)
    assert decisions(tmp_path / "python") == decisions(tmp_path / "cpp")
    assert not any(content.bits()[43:].any() for content in run.contents().values())
    detector = loopbit.LoopDetector()
    detector.set_mask(black)
    assert [as_row(detector.process(image)) for image in images] == decisions(tmp_path / "cpp")
    with pytest.raises(loopbit.InputError, match="mask has 320 x 240"):
        detector.process(images[0][:100])
    with pytest.raises(loopbit.OptionError, match="excludes the whole image"):
        detector.set_mask(np.zeros((240, 320), np.uint8))
    detector.set_mask(None)
    assert detector.process(images[0][:100]).frame == len(images)


def test_a_fisheye_is_that_of_the_command(command, dataset, images, tmp_path):
    calibration = tmp_path / "fisheye.yaml"
    pinhole = (dataset / "camera.yaml").read_text()
    calibration.write_text(pinhole.replace("plumb_bob", "equidistant"))
    command("run", dataset / "images", "--out", tmp_path / "cpp", "--camera", calibration,
            "--no-report")
    command("run", dataset / "images", "--out", tmp_path / "plain", "--no-poses", "--no-report")
    detector = loopbit.LoopDetector()
    detector.set_camera(loopbit.read_cameras(calibration)[0])
    assert [as_row(detector.process(image)) for image in images] == decisions(tmp_path / "cpp")
    assert decisions(tmp_path / "plain") != decisions(tmp_path / "cpp")
    with pytest.raises(loopbit.InputError, match="set_camera.* 320 x 100"):
        detector.process(images[0][:100])
    detector.set_camera(None)
    assert detector.process(images[0][:100]).frame == len(images)


def test_finished_run(run):
    assert run.positions_m.shape == (120, 3) and run.truth.same_place.size > 0
    array = loopbit.detections_array(run.detections)
    assert array.dtype.names[:4] == ("frame", "timestamp_s", "status", "match")
    assert np.array_equal(array["frame"], np.arange(120))
    loops = array[array["status"] == "loop"]
    assert len(loops) == sum(d.is_loop for d in run.detections) > 20 and loops["match"].min() >= 0
    assert array["match"][0] == -1 and array["timestamp_s"][10] == pytest.approx(1.0)
    assert {d.status.name for d in run.detections} == set(array["status"])
    assert run.detections[7].name == array["name"][7] == "000007.png"
    assert array["match_name"][0] == ""
    assert loops["match_name"].tolist() == [f"{match:06}.png" for match in loops["match"]]
    pairs = [line.split() for line in loopbit.image_pairs(run.detections).splitlines()]
    late = [[f"{loop.frame:06}.png", f"{loop.match:06}.png"] for d in run.detections for loop in d.late_loops]
    assert pairs == [[row["name"], row["match_name"]] for row in loops] + late


def test_callbacks(dataset, images, tmp_path):
    folder = tmp_path / "images"
    folder.mkdir()
    for number in range(3):
        data = (dataset / "images" / f"00000{number}.png").read_bytes()
        (folder / f"{number}.png").write_bytes(data if number != 1 else data[:100])
    told, bad = [], []
    found = loopbit.run(folder, on_detection=told.append, on_bad_frame=bad.append)
    assert [d.status.name for d in found] == ["no_earlier_place", "unreadable", "no_earlier_place"]
    assert [d.frame for d in told] == [0, 1, 2] and len(bad) == 1 and "1.png" in bad[0]
    assert [d.name for d in found] == ["0.png", "1.png", "2.png"]
    with pytest.warns(UserWarning, match="1.png"):
        loopbit.run(folder)


def test_a_callback_may_ask_the_detector_that_runs(dataset, images):
    detector = loopbit.LoopDetector()
    asked = []
    loopbit.run(dataset / "images", detector,
                on_detection=lambda d: asked.append(detector.query(images[d.frame]).frame))
    assert asked == list(range(1, 121))


@pytest.mark.parametrize("error, stopped_by", [(RuntimeError("enough"), "enough"),
                                               (KeyboardInterrupt(), "interrupt")])
def test_a_run_that_is_stopped_keeps_what_it_found(tmp_path, dataset, error, stopped_by):
    folder = tmp_path / "images"
    folder.mkdir()
    (folder / "0.png").write_bytes((dataset / "images" / "000000.png").read_bytes())
    (folder / "1.png").write_bytes(b"no image")

    def stop(sentence):
        raise error

    with pytest.raises(type(error)):
        loopbit.run_folder(folder, tmp_path / "run", on_bad_frame=stop)
    assert json.loads((tmp_path / "run" / "run.json").read_text())["stopped_by"] == stopped_by
    assert len(decisions(tmp_path / "run")) == 1
    with pytest.raises(OSError, match="holds an earlier run"):
        loopbit.run_folder(folder, tmp_path / "run")
    loopbit.run_folder(folder, tmp_path / "run", overwrite=True, on_bad_frame=lambda _: None)


def test_a_run_without_a_readable_frame_is_refused(tmp_path, dataset):
    bad, good = tmp_path / "bad", tmp_path / "good"
    for folder in (bad, good):
        folder.mkdir()
        (folder / "0.png").write_bytes(b"no image")
    (good / "1.png").write_bytes((dataset / "images" / "000000.png").read_bytes())
    told = []
    with pytest.raises(loopbit.InputError, match="No frame of .*bad"):
        loopbit.run_folder(bad, tmp_path / "run", on_bad_frame=told.append)
    assert len(told) == 1 and "0.png" in told[0]
    assert "No frame of" in json.loads((tmp_path / "run" / "run.json").read_text())["stopped_by"]
    run = loopbit.run_folder(good, tmp_path / "run", overwrite=True, on_bad_frame=told.append)
    assert [d.status.name for d in run.detections] == ["unreadable", "no_earlier_place"]
    before = decisions(run.path)
    with pytest.raises(loopbit.InputError, match="no earlier run is replaced"):
        loopbit.run_folder(bad, tmp_path / "run", overwrite=True, on_bad_frame=told.append)
    assert decisions(run.path) == before and len(before) == 2


def test_a_source_that_was_refused_is_refused_again(tmp_path):
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "0.png").write_bytes(b"no image")
    source = loopbit.open_source(tmp_path / "bad")
    for _ in range(2):
        with pytest.raises(loopbit.InputError, match="No frame"):
            loopbit.run_folder(source, tmp_path / "run", overwrite=True)
    assert next(source).name == "0.png" and source.size() == 1


@pytest.mark.parametrize("every", [2, 3])
@pytest.mark.parametrize("file, flags, arguments", [
    ("truth.csv", [], {}), ("poses.txt", ["--protocol", "kitti"], {"protocol": "kitti"})])
def test_every_nth_frame(command, dataset, tmp_path, every, file, flags, arguments):
    truth = dataset / file
    theirs, ours = tmp_path / "cpp", tmp_path / "python"
    command("run", dataset / "images", "--out", theirs, "--every", every, "--truth", truth, *flags,
            "--poses", dataset / "poses.txt", "--no-report")
    source = loopbit.open_source(dataset / "images", every=every)
    run = loopbit.run_folder(source, ours, truth=truth, positions_m=dataset / "poses.txt",
                             evidence=False, **arguments)
    for name in ("truth.csv", "not_false.csv", "ignore.csv", "unknown.csv", "positions.csv"):
        assert (ours / name).read_bytes() == (theirs / name).read_bytes(), name
    records = [json.loads((folder / "run.json").read_text()) for folder in (ours, theirs)]
    assert records[0]["score"] == records[1]["score"]
    assert records[0]["input"]["every"] == every == run.truth.every
    assert records[0]["truth"] == records[1]["truth"] and str(truth) in records[0]["truth"]
    expected = json.loads(command("eval", theirs, "--truth", truth, *flags, "--json"))
    assert json.loads(loopbit.evaluate(theirs, truth, **arguments).to_json()) == expected
    assert json.loads(loopbit.evaluate(run).to_json()) == expected
    assert file != "truth.csv" or expected["recall"] > 0.5


def test_truth_of_the_frames_read(dataset, truth, positions, tmp_path):
    source = loopbit.open_source(dataset / "images", every=2)
    every_second = loopbit.read_positions(dataset / "poses.txt", [None] * 60, every=2)
    run = loopbit.run_folder(source, tmp_path / "run", evidence=False,
                             truth=loopbit.every_nth(truth, 2), positions_m=every_second)
    assert len(run.detections) == 60 and run.positions_m == pytest.approx(every_second, abs=1e-4)
    assert every_second.tolist() == positions[::2].tolist()
    assert loopbit.evaluate(run).decision.positives > 20
    same = loopbit.GroundTruth(truth.same_place.tolist(), truth.near_place.tolist(), every=2)
    assert loopbit.evaluate(run, same).decision.wrong == 0
    assert loopbit.evaluate(run, same).decision.right == loopbit.evaluate(run).decision.right


@pytest.mark.parametrize("part, damaged, words", [
    ("input", {"every": 2, "limit": -1}, "-1 for 'input.limit'"),
    ("input", {"every": "two"}, "\"two\" for 'input.every'"),
    ("input", [2], "an array for 'input'"),
    ("score", {"tolerance_frames": "none"}, "\"none\" for 'score.tolerance_frames'"),
    ("score", 7, "7 for 'score'"),
])
def test_what_makes_no_sense_in_a_record_is_named(dataset, tmp_path, part, damaged, words):
    source = loopbit.open_source(dataset / "images", every=2)
    (tmp_path / "true.csv").write_text("30,2\n31,2\n")
    run = loopbit.run_folder(source, tmp_path / "run", evidence=False, truth=tmp_path / "true.csv")
    record = json.loads(run.record_json)
    (tmp_path / "run" / "run.json").write_text(json.dumps({**record, part: damaged}))
    for read in (loopbit.evaluate, loopbit.read_run, loopbit.write_report):
        with pytest.raises(loopbit.InputError, match=words):
            read(tmp_path / "run")


def test_a_run_read_to_its_end_has_no_more_frames(dataset, tmp_path):
    (tmp_path / "later.csv").write_text("5,1\n20,1\n")
    run = loopbit.run_folder(loopbit.open_source(dataset / "images", limit=10), tmp_path / "run",
                             evidence=False, truth=tmp_path / "later.csv")
    assert run.truth.same_place.size == 2
    assert loopbit.evaluate(run, tmp_path / "later.csv").decision.positives == 1
    record = json.loads(run.record_json)
    record["input"]["limit"] = 0
    (tmp_path / "run" / "run.json").write_text(json.dumps(record))
    with pytest.raises(loopbit.InputError, match="frame 20, but the sequence has 10 frames"):
        loopbit.evaluate(tmp_path / "run", tmp_path / "later.csv")


def test_frames_that_nobody_knows():
    truth = loopbit.GroundTruth([[10, 0, 2], [12, 4, 4]], unknown=[5, 12])
    assert truth.unknown.tolist() == [5, 12] and truth.every == 1 and "unknown=2" in repr(truth)
    decision = loopbit.evaluate(loopbit.MatchList([10, 11, 12], [5, 3, 9]), truth).decision
    assert (decision.positives, decision.tolerated, decision.wrong, decision.ignored) == (1, 1, 1, 1)
    with pytest.raises(loopbit.OptionError, match="every is 0"):
        loopbit.GroundTruth([], every=0)


# Flags of 'loopbit run' that run_folder() has by another name, or not at all.
RENAMED = {"tolerance": "tolerance_frames", "truth_set": "poses", "truth_views": "views", "baseline": "baseline_m",
           "truth_variable": "variable", "poses": "positions_m", "no_report": "evidence"}
OF_OPTIONS = {"preset", "config", "set"}
OF_SOURCE = {"every", "limit", "max_megapixels", "topic", "odometry_topic"}
OF_THE_COMMAND = {"help", "threads", "pictures_mb", "open", "json", "quiet", "no_poses", "live",
                  "live_address", "mcap_out"}


def test_run_folder_has_what_the_command_has(command):
    flags = {name.replace("-", "_") for name in
             re.findall(r"^ +(?:-\w,)?--([\w-]+)", command("run", "--help"), re.MULTILINE)}
    assert {"out", "map_cache_mb"} < flags
    assert OF_SOURCE <= flags and OF_OPTIONS <= flags and OF_THE_COMMAND <= flags
    expected = {RENAMED.get(flag, flag) for flag in flags - OF_OPTIONS - OF_SOURCE - OF_THE_COMMAND}
    parameters = set(inspect.signature(loopbit.run_folder).parameters)
    assert parameters - {"source", "options", "on_bad_frame"} == expected
    scoring = expected & set(inspect.signature(loopbit.evaluate).parameters)
    assert scoring == {"truth", "protocol", "tolerance_frames", "poses", "views", "variable",
                       "not_false", "ignore"}


def test_run_folder_scores_by_files_as_the_command_does(command, dataset, tmp_path):
    (tmp_path / "ignore.csv").write_text("100\n")
    command("run", dataset / "images", "--out", tmp_path / "cpp", "--truth", dataset / "truth.csv",
            "--not-false", dataset / "not_false.csv", "--ignore", tmp_path / "ignore.csv",
            "--tolerance", 2, "--no-report", "--map", tmp_path / "cpp.db", "--map-cache-mb", 1)
    given = {"truth": dataset / "truth.csv", "not_false": dataset / "not_false.csv",
             "ignore": tmp_path / "ignore.csv", "tolerance_frames": 2}
    ours = loopbit.run_folder(dataset / "images", tmp_path / "python", evidence=False,
                              map=tmp_path / "python.db", map_cache_mb=1, **given)
    for name in ("truth.csv", "not_false.csv", "ignore.csv"):
        ours_bytes = (tmp_path / "python" / name).read_bytes()
        assert ours_bytes == (tmp_path / "cpp" / name).read_bytes(), name
    theirs = json.loads((tmp_path / "cpp" / "run.json").read_text())
    assert json.loads(ours.record_json)["score"] == theirs["score"]
    assert loopbit.evaluate(ours, **given).to_json() == loopbit.evaluate(ours).to_json()


BAD_ARGUMENTS = [
    ({"ignore": "ignore.csv"}, loopbit.OptionError, "ignore applies to .* give truth"),
    ({"tolerance_frames": -1}, loopbit.OptionError, "tolerance_frames is -1"),
    ({"keep_images": True, "map": None}, loopbit.OptionError, "keep_images .* give map"),
    ({"protocol": "kitti"}, loopbit.OptionError, "give truth"),
    ({"protocol": "nobody", "truth": "truth.csv"}, loopbit.OptionError, "no protocol 'nobody'"),
    ({"protocol": "kitti", "truth": "truth.csv"}, loopbit.OptionError, "is a list of true places"),
    ({"protocol": "fab-map", "truth": "poses.txt"}, loopbit.OptionError, "is poses"),
    ({"protocol": "kitti", "truth": loopbit.GroundTruth([])}, loopbit.OptionError, "as the path"),
    ({"truth": "none.csv"}, loopbit.InputError, "none.csv"),
    ({"truth": "damaged.csv"}, loopbit.InputError, "line 2"),
    ({"truth": "few.txt"}, loopbit.InputError, "has 3 poses"),
    ({"truth": "many.txt"}, loopbit.InputError, "has 121 poses, but the sequence has 120 frames"),
    ({"truth": "later.csv"}, loopbit.InputError, "frame 120, but the sequence has 120 frames"),
    ({"truth": "words.csv"}, loopbit.InputError, "query,first,last"),
    ({"truth": "none\x1b.csv"}, loopbit.InputError, r"none\\x1b\.csv"),
    ({"truth": [[5, 1]]}, TypeError, "truth is"),
    ({"positions_m": "none.txt"}, loopbit.InputError, "none.txt"),
    ({"positions_m": "few.txt"}, loopbit.InputError, "has 3 poses"),
    ({"positions_m": np.zeros((120, 2))}, ValueError, r"shape \(120, 2\)"),
    ({"positions_m": np.zeros((119, 3))}, ValueError, "119 rows, but there are 120 frames"),
    ({"positions_m": np.full((120, 3), np.inf)}, ValueError, "infinite"),
    ({"on_bad_frame": 3}, TypeError, "on_bad_frame"),
]


@pytest.mark.parametrize("arguments, error, words", BAD_ARGUMENTS)
def test_bad_arguments_cost_no_run(dataset, tmp_path, arguments, error, words):
    (tmp_path / "damaged.csv").write_text("5,1\n6,one\n")
    (tmp_path / "few.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n" * 3)
    (tmp_path / "many.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n" * 121)
    (tmp_path / "later.csv").write_text("5,1\n120,1\n")
    (tmp_path / "words.csv").write_text("hello world\n")
    for name, value in arguments.items():
        if name in ("truth", "positions_m") and isinstance(value, str):
            path = dataset / value
            arguments = {**arguments, name: path if path.exists() else tmp_path / value}
    before = sorted(tmp_path.iterdir())
    with pytest.raises(error, match=words):
        loopbit.run_folder(dataset / "images", tmp_path / "run",
                           **{"map": tmp_path / "town.db", **arguments})
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("take", [loopbit.ImageSource.skip, next])
@pytest.mark.parametrize("arguments, words", [
    ({"truth": "truth.csv"}, "truth.csv' counts from the first"),
    ({"truth": "poses.txt"}, "poses.txt' counts from the first"),
    ({"positions_m": "poses.txt"}, "poses.txt' counts from the first"),
])
def test_files_do_not_count_from_the_middle(dataset, tmp_path, take, arguments, words):
    source = loopbit.open_source(dataset / "images", limit=13)
    for _ in range(10):
        take(source)
    paths = {name: dataset / file for name, file in arguments.items()}
    with pytest.raises(loopbit.OptionError, match=f"{words}.* 10 .* already read; open it again"):
        loopbit.run_folder(source, tmp_path / "run", **paths)
    assert not any(tmp_path.iterdir())
    run = loopbit.run_folder(source, tmp_path / "run", truth=loopbit.GroundTruth([[2, 0]]),
                             positions_m=np.eye(3), evidence=False)
    assert len(run.detections) == 3 and np.array_equal(run.positions_m, np.eye(3))


def write_video(path, images):
    """A grey YUV4MPEG2 video. How many frames a video has is certain only at its end."""
    height, width = images[0].shape[:2]
    chroma = bytes([128]) * (height * width // 2)
    path.write_bytes(f"YUV4MPEG2 W{width} H{height} F10:1 C420jpeg\n".encode() + b"".join(
        b"FRAME\n" + image.mean(axis=2).astype(np.uint8).tobytes() + chroma for image in images))


def test_what_is_wrong_in_the_end_leaves_the_run(images, truth, tmp_path):
    write_video(tmp_path / "town.y4m", images)
    with pytest.raises(ValueError, match="7 rows, but there are 120 frames"):
        loopbit.run_folder(tmp_path / "town.y4m", tmp_path / "run", truth=truth, evidence=False,
                           positions_m=np.zeros((7, 3)))
    run = loopbit.read_run(tmp_path / "run")
    assert json.loads(run.record_json)["stopped_by"] == "end" and len(run.detections) == 120
    assert len(run.positions_m) == 0 and loopbit.evaluate(run).decision.right > 20


def test_no_input_is_replaced(dataset, tmp_path):
    loopbit.run_folder(dataset / "images", tmp_path / "run", truth=dataset / "truth.csv")
    with pytest.raises(OSError, match="truth.csv"):
        loopbit.run_folder(dataset / "images", tmp_path / "run", overwrite=True,
                           truth=tmp_path / "run" / "truth.csv")


def test_score_is_that_of_the_command(command, run, dataset):
    for flags, arguments in (
            ([], {}),
            (["--tolerance", 3], {"truth": loopbit.read_truth(dataset / "truth.csv"),
                                  "tolerance_frames": 3}),
            (["--protocol", "kitti"], {"truth": dataset / "poses.txt", "protocol": "kitti"})):
        if "--tolerance" in flags:
            flags = ["--truth", dataset / "truth.csv", *flags]
        if "--protocol" in flags:
            flags = ["--truth", dataset / "poses.txt", *flags]
        expected = json.loads(command("eval", run.path, "--json", *flags))
        for found in (run, run.path, run.detections if arguments else run):
            assert json.loads(loopbit.evaluate(found, **arguments).to_json()) == expected


def test_a_run_is_scored_again_as_it_was(command, dataset, truth, tmp_path):
    matrix = np.zeros((120, 120), int)
    for query, first, last in truth.same_place.tolist():
        matrix[query, first:last + 1] = 1
    np.savetxt(tmp_path / "matrix.txt", matrix, fmt="%d")
    run = loopbit.run_folder(dataset / "images", tmp_path / "run", evidence=False,
                             truth=tmp_path / "matrix.txt", protocol="ibow-lcd")
    score = loopbit.evaluate(run)
    assert (score.protocol, score.tolerance_frames) == ("ibow-lcd", 40)
    assert json.loads(score.to_json()) == json.loads(command("eval", run.path, "--json"))
    assert loopbit.evaluate(run, protocol="ibow-lcd").tolerance_frames == 40
    assert loopbit.evaluate(run, tolerance_frames=0).protocol == ""


def test_evaluation_of_arrays():
    truth = loopbit.GroundTruth([[10, 0, 2], [11, 1, 3], [12, 2, 4]], [[13, 5]], [14])
    found = loopbit.MatchList(query=[10, 11, 12, 13, 14], match=[1, 2, 9, 5, 0],
                              score=[0.9, 0.8, 0.7, 0.6, 0.5])
    score = loopbit.evaluate(found, truth)
    decision = score.decision
    assert (decision.positives, decision.right, decision.wrong, decision.tolerated,
            decision.ignored) == (3, 2, 1, 1, 1)
    assert score.recall_at_full_precision == pytest.approx(2 / 3) == decision.recall
    assert score.score_at_full_precision == 0.8
    curve = score.curve[:3]  # the fourth match is tolerated, and changes nothing
    assert curve["precision"].tolist() == pytest.approx([1, 1, 2 / 3])
    assert curve["recall"].tolist() == pytest.approx([1 / 3, 2 / 3, 2 / 3])
    assert score.wrong_loops["query"].tolist() == [12] == score.missed.tolist()
    assert "precision 0.6667" in repr(decision) and "wrong=1" in repr(score)
    assert loopbit.evaluate(found, truth, tolerance_frames=5).decision.right == 3


def test_bad_evaluations(run, dataset):
    with pytest.raises(ValueError, match=r"score has shape \(1,\), but must be \(2,\)"):
        loopbit.MatchList([1, 2], [0, 0], [1.0])
    with pytest.raises(ValueError, match=r"same_place has shape \(1, 4\)"):
        loopbit.GroundTruth([[1, 2, 3, 4]])
    with pytest.raises(ValueError, match="no protocol 'nobody'"):
        loopbit.evaluate(run, protocol="nobody")
    with pytest.raises(ValueError, match="fixes it"):
        loopbit.evaluate(run, protocol="kitti", tolerance_frames=1)
    with pytest.raises(ValueError, match="views cannot be given .* fixes it"):
        loopbit.read_truth(dataset / "poses.txt", protocol="kitti", views=2)
    with pytest.raises(loopbit.OptionError, match="as the path"):
        loopbit.evaluate(run, protocol="kitti")
    with pytest.raises(loopbit.OptionError, match="as the path"):
        loopbit.evaluate(run, run.truth, protocol="ibow-lcd")
    for setting, words in (({"poses": loopbit.PoseTruthOptions()}, "poses applies to poses"),
                           ({"views": 2}, "views applies to a loop matrix"),
                           ({"variable": "truth"}, "variable applies to a loop matrix")):
        with pytest.raises(loopbit.OptionError, match=words):
            loopbit.read_truth(dataset / "truth.csv", **setting)
    with pytest.raises(ValueError, match="requires poses, but .* is a list of true places"):
        loopbit.evaluate(run, dataset / "truth.csv", protocol="kitti")
    with pytest.raises(ValueError, match="no ground truth"):
        loopbit.evaluate(loopbit.MatchList([1], [0]))
    with pytest.raises(ValueError, match="tolerance_frames is -1"):
        loopbit.evaluate(run, tolerance_frames=-1)


def test_protocols():
    named = {protocol.name: protocol for protocol in loopbit.protocols()}
    assert named["kitti"].poses.radius_m == 6.0 and named["fab-map"].views == 2
    assert loopbit.find_protocol("ibow-lcd").tolerance_frames == 40
    assert named["kitti"].truth_kind == loopbit.TruthKind.poses


def test_report(command, run, tmp_path):
    path = loopbit.write_report(run)
    assert path == run.path + "/report.html"
    command("report", run.path, "--out", tmp_path / "command.html")
    with open(path) as ours, open(tmp_path / "command.html") as theirs:
        assert ours.read() == theirs.read()
    assert loopbit.write_report(run.path, tmp_path / "other.html") == str(tmp_path / "other.html")
