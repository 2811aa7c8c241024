"""Posture model files: bit-exact round trip; errors name the fault."""

import struct
import zlib
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.posture_cases import quick_model
from tests.test_layers import closure, imported
from zenocap.common.errors import UserError
from zenocap.services.recognizer import model_file
from zenocap.services.recognizer.forest import votes_of
from zenocap.services.recognizer.model import PostureModel
from zenocap.services.recognizer.segment_description import VALUES

MAGIC, VERSION = b"zenocap postures\n", 1
HEADER = struct.Struct(f"<{len(MAGIC)}sHIQ")  # magic, version, CRC-32, length of the rest
MODEL_PATH = Path("some.postures")
TRAINING_PACKAGES = {"sklearn", "hmmlearn", "matplotlib", "threadpoolctl"}
MODEL = quick_model()
DATA = model_file.packed(MODEL_PATH, MODEL)


def with_checksum(body: bytes) -> bytes:
    return HEADER.pack(MAGIC, VERSION, zlib.crc32(body), len(body)) + body


def changed(**fields: object) -> bytes:
    """The file's bytes with some fields replaced, and a correct checksum."""
    contents = msgspec.msgpack.decode(DATA[HEADER.size :])
    return with_checksum(msgspec.msgpack.encode(contents | fields))


def array(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> dict[str, object]:
    return {"shape": list(values.shape), "data": values.astype("<f8").tobytes()}


def test_a_model_round_trips_bit_by_bit(tmp_path: Path) -> None:
    path = tmp_path / "mine.postures"
    model = replace(MODEL, labels=("手を振る", "kick", "bow ↓"))
    model_file.write_model(path, model)
    found = model_file.read_model(path)
    for name in model_file.ARRAYS:
        np.testing.assert_array_equal(getattr(found, name), getattr(model, name), err_msg=name)
    for name in ("features", "rate", "labels", "farthest", "calm", "slow", "training"):
        assert getattr(found, name) == getattr(model, name)
    assert model_file.packed(path, found) == path.read_bytes()


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (DATA[:200] + b"\xff" + DATA[201:], "damaged: checksum"),
        (changed(features="knees"), "features = 'knees': allowed: directions, joint-angles"),
        (changed(names=["a"]), "names = "),
        (changed(labels=["a", "a", "b"]), r"labels = \['a', 'a', 'b'\]: allowed: different labels"),
        (changed(labels=["a"]), r"training.figures = 3: allowed: 1"),
        (changed(labels=[]), r"length >= 1.*\$\.labels"),
        (changed(rate=float("nan")), r"\$\.rate"),
        (changed(surprise=1), "unknown field `surprise`"),
        (changed(mean=array(np.full(10, np.inf))), "mean = inf: allowed: finite numbers"),
        (changed(mean=array(np.zeros(9))), r"mean.shape = \[9\]: allowed: \[10\]"),
        (changed(mean={"shape": [10], "data": b"123"}), "mean.data = 3 bytes: allowed: 80 bytes"),
        (changed(start=array(np.full((3, 5), 0.3))), "start = a sum 0.5 off from 1"),
        (changed(start=array(np.tile([1.5, -0.5, 0, 0, 0], (3, 1)))), "start = -0.5: allowed: probabilities"),
        (changed(durations=array(np.tile([2.0, 1.0, 3.0], (3, 1)))), r"durations = \[2.0, 1.0, 3.0\]: allowed: sec"),
    ],
)  # fmt: skip
def test_error_names_the_fault_of_a_file(data: bytes, words: str) -> None:
    with pytest.raises(UserError, match=words) as raised:
        model_file.parse_model(MODEL_PATH, data)
    assert str(raised.value).startswith("some.postures: ")


def forest(nodes: list[list[list[float]]], values: int = VALUES, thresholds: int = 3) -> bytes:
    """The file with a forest."""
    packed_nodes = np.array(nodes)
    shape, data = list(packed_nodes.shape), packed_nodes.astype("<f4").tobytes()
    return changed(
        forest={"values": values, "nodes": {"shape": shape, "data": data}, "thresholds": array(np.full(thresholds, 0.5))}
    )


LEAF_0 = [-1.0, 0.0, 0.0]


def test_a_forest_is_read() -> None:
    found = model_file.parse_model(MODEL_PATH, forest([[[0.0, 0.5, 2.0], LEAF_0, [-1.0, 0.0, 3.0]]])).forest
    assert votes_of(found, np.zeros(VALUES)).tolist() == [1, 0, 0, 0]
    assert votes_of(found, np.ones(VALUES)).tolist() == [0, 0, 0, 1]


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (forest([[LEAF_0]], values=3), f"forest.values = 3: allowed: {VALUES}; train it again"),
        (forest([[LEAF_0]], thresholds=2), r"forest.thresholds.shape = \[2\]: allowed: \[3\]"),
        (forest([[[0.0, 0.5, 2.0], LEAF_0]]), r"forest.nodes\[0\]\[0\] = \[0.0, 0.5, 2.0\]: allowed: a leaf"),
        (forest([[[0.0, 0.5, 0.0], LEAF_0]]), r"forest.nodes\[0\]\[0\]"),
        (forest([[LEAF_0, [0.0, 0.5, 1.0]]]), r"forest.nodes\[0\]\[1\]"),
        (forest([[[float(VALUES), 0.5, 1.0], LEAF_0]]), r"forest.nodes\[0\]\[0\]"),
        (forest([[[0.5, 0.5, 1.0], LEAF_0]]), r"forest.nodes\[0\]\[0\]"),
        (forest([[LEAF_0], [[-1.0, 0.0, 4.0]]]), r"forest.nodes\[1\]\[0\] = \[-1.0, 0.0, 4.0\]"),
        (forest([[[-2.0, 0.0, 0.0]]]), r"forest.nodes\[0\]\[0\]"),
        (forest([[[np.nan, 0.0, 0.0]]]), "forest.nodes = nan: allowed: finite"),
        (forest([[]]), "forest.nodes.shape"),
    ],
)
def test_error_names_the_node_of_a_forest_that_would_not_end_or_name_a_posture(data: bytes, words: str) -> None:
    with pytest.raises(UserError, match=words):
        model_file.parse_model(MODEL_PATH, data)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, len(DATA) - HEADER.size - 1), st.integers(0, 255))
def test_any_changed_byte_gives_a_model_or_a_user_error(at: int, byte: int) -> None:
    body = bytearray(DATA[HEADER.size :])
    body[at] = byte
    try:
        found = model_file.parse_model(MODEL_PATH, with_checksum(bytes(body)))
    except UserError:
        return
    assert isinstance(found, PostureModel)


def test_a_model_that_could_not_be_read_back_is_not_written(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="thresholds = inf"):
        model_file.write_model(tmp_path / "bad.postures", replace(MODEL, thresholds=np.full(3, np.inf)))
    assert list(tmp_path.iterdir()) == []


def test_a_model_is_found_by_path_and_error_names_a_missing_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    model_file.write_model(Path("mine.postures"), MODEL)
    assert model_file.find_model("mine.postures").resolve() == tmp_path / "mine.postures"
    with pytest.raises(UserError, match="'nowhere': no file"):
        model_file.find_model("nowhere")


def test_recognition_does_not_import_packages_of_training() -> None:
    """scikit-learn, hmmlearn and matplotlib are slow to import and not installed on every machine of a rig."""
    modules = ("model_file", "model", "features")
    seen = set().union(*(closure(f"zenocap.services.recognizer.{name}") for name in modules))
    assert [(one, name) for one in seen for name in imported(one) if name.split(".")[0] in TRAINING_PACKAGES] == []
    assert "zenocap.services.recognizer.likelihood" in seen


@pytest.mark.parametrize("path", sorted(model_file.SHIPPED.glob(f"*{model_file.SUFFIX}")), ids=lambda path: path.stem)
def test_shipped_models_are_found_by_name_and_read(path: Path) -> None:
    assert model_file.find_model(path.stem) == path
    assert len(model_file.read_model(path).labels) >= 1
