# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
import json
import pickle
import re
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

import loopbit

STRUCTS = [
    loopbit.BinaryContentOptions,
    loopbit.RetrievalOptions,
    loopbit.SurfOptions,
    loopbit.VerificationOptions,
    loopbit.ExclusionOptions,
    loopbit.DecisionOptions,
    loopbit.PoseTruthOptions,
]

# Numbers that turn themselves into whole ones, without their fractions.
FRACTIONS = [np.float32(500.5), Decimal("500.5"), Fraction(1001, 2)]


def settings_of(options):
    return {name: getattr(options, name) for name, value in vars(type(options)).items()
            if isinstance(value, property)}


def test_every_default_is_that_of_the_command(command):
    expected = json.loads(command("options", "--json"))
    options = loopbit.LoopDetectorOptions()
    assert {name: settings_of(part) for name, part in settings_of(options).items()} == expected


def test_detector_has_the_defaults():
    assert repr(loopbit.LoopDetector().options) == repr(loopbit.LoopDetectorOptions())


def test_other_defaults_are_those_of_the_command(command):
    listed = dict(re.findall(r"^  (\w+) = (\S+)  \[", command("run", "--help"), re.MULTILINE))
    settings = settings_of(loopbit.PoseTruthOptions())
    assert settings
    for name, value in settings.items():
        assert float(json.loads(listed[name])) == float(value), name


@pytest.mark.parametrize("struct", STRUCTS)
def test_settings_are_documented_with_range_and_default(struct):
    for name, value in settings_of(struct()).items():
        doc = getattr(struct, name).__doc__
        assert re.fullmatch(r"(bool|int|float): .+; \S+ to \S+, default \S+", doc), doc
        assert doc.endswith(f"default {value!r}")


@pytest.mark.parametrize("struct", STRUCTS)
def test_repr_can_be_evaluated(struct):
    options = struct()
    assert settings_of(eval(repr(options), vars(loopbit))) == settings_of(options)


def test_sections_are_references():
    options = loopbit.LoopDetectorOptions(surf=loopbit.SurfOptions(max_keypoints=500))
    options.surf.upright = False
    assert options.surf.max_keypoints == 500
    assert loopbit.LoopDetector(options).options.surf.upright is False
    options.surf = loopbit.SurfOptions()
    assert repr(options) == repr(loopbit.LoopDetectorOptions())


def test_survives_a_pickle_and_json(tmp_path):
    options = loopbit.LoopDetectorOptions()
    loopbit.set_option(options, "surf.upright", False)
    loopbit.set_option(options, "decision.min_score", 0.875)
    path = tmp_path / "settings.json"
    path.write_text(loopbit.to_json(options))
    for copy in (pickle.loads(pickle.dumps(options)), loopbit.load_options(path)):
        assert repr(copy) == repr(options) != repr(loopbit.LoopDetectorOptions())


@pytest.mark.parametrize("value", [49, 10_001, -1])
def test_out_of_range_is_a_value_error(value):
    options = loopbit.LoopDetectorOptions()
    before = repr(options)
    with pytest.raises(ValueError, match=rf"surf\.max_keypoints is {value}, but must be between"):
        options.surf.max_keypoints = value
    with pytest.raises(loopbit.OptionError):
        loopbit.SurfOptions(max_keypoints=value)
    assert repr(options) == before


def test_not_a_number_is_out_of_range():
    with pytest.raises(ValueError, match="binary_content.gamma is nan"):
        loopbit.BinaryContentOptions(gamma=float("nan"))


@pytest.mark.parametrize(
    "name, value", [("max_keypoints", 500.5), ("max_keypoints", "500"), ("upright", 1),
                    *(("max_keypoints", value) for value in FRACTIONS)])
def test_wrong_type_is_a_type_error_that_names_the_setting(name, value):
    with pytest.raises(TypeError, match=re.escape(f"surf.{name} is {value!r}, but must be")):
        loopbit.SurfOptions(**{name: value})


@pytest.mark.parametrize("value", FRACTIONS)
def test_an_argument_does_not_lose_its_fraction(value, tmp_path):
    for call in (lambda: loopbit.SessionFrame(0, value),
                 lambda: loopbit.open_source(tmp_path, every=value),
                 lambda: loopbit.compact_map(tmp_path / "no.db", drop_sessions=[value]),
                 lambda: loopbit.GroundTruth([[5, 1]], frames=value)):
        with pytest.raises(TypeError):
            call()


def test_values_of_numpy():
    options = loopbit.LoopDetectorOptions(
        surf=loopbit.SurfOptions(max_keypoints=np.uint16(500), upright=np.bool_(False)),
        binary_content=loopbit.BinaryContentOptions(gamma=np.float32(2.5)))
    assert (options.surf.max_keypoints, options.surf.upright) == (500, False)
    assert options.binary_content.gamma == 2.5
    loopbit.set_option(options, "surf.upright", np.bool_(True))
    assert options.surf.upright is True
    assert loopbit.SessionFrame(np.int64(1), np.int32(2)) == loopbit.SessionFrame(1, 2)


def test_unknown_names():
    with pytest.raises(TypeError, match="'surf.colour'"):
        loopbit.SurfOptions(colour=1)
    with pytest.raises(TypeError, match="'colour'"):
        loopbit.LoopDetectorOptions(colour=1)
    with pytest.raises(TypeError, match="surf is .* must be SurfOptions"):
        loopbit.LoopDetectorOptions(surf=loopbit.RetrievalOptions())
    with pytest.raises(AttributeError):
        loopbit.SurfOptions().colour = 1


def test_settings_that_contradict_each_other():
    options = loopbit.LoopDetectorOptions(
        exclusion=loopbit.ExclusionOptions(frames=10, seconds=1.0))
    with pytest.raises(ValueError, match="only one of them"):
        loopbit.LoopDetector(options)
    with pytest.raises(ValueError, match="only one of them"):
        loopbit.validate(options)
