"""Files of posture models: data only, every field is checked on reading.

See `zenocap.common.formats.model_files` for header and arrays.
"""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta, Struct

from zenocap.common.arrays import Floats
from zenocap.common.atomic_write import write_atomically
from zenocap.common.formats.model_files import Array, ModelFormat, fail, packed_array, unpacked_array
from zenocap.common.rig import recognizer as recognizer_table
from zenocap.data import POSTURES
from zenocap.services.recognizer.false_alarms import FalseAlarms
from zenocap.services.recognizer.features import KINDS, NAMES
from zenocap.services.recognizer.forest import FEATURE, LEAF, OTHER, Forest
from zenocap.services.recognizer.ignored_parts import Part
from zenocap.services.recognizer.model import MOST_LABELS, LabelFigures, PostureModel, Training
from zenocap.services.recognizer.segment_description import VALUES

FORMAT = ModelFormat(b"zenocap postures\n", 1, "posture model", "zenocap posture train")
ROUNDING = 1e-6
NO_LIMIT = 1e9
SHIPPED = POSTURES
SUFFIX = recognizer_table.SUFFIX
ARRAYS = (
    "mean", "whitening", "codebook", "occurring", "start", "transition", "emission", "durations", "edges", "reach",
    "thresholds",
)  # fmt: skip
PLAIN = ("features", "rate", "labels", "farthest", "calm", "slow")  # stored as they are


Count = Annotated[int, Meta(ge=0, le=1 << 40)]
Text = Annotated[str, Meta(max_length=4096)]
Label = Annotated[str, Meta(min_length=1, max_length=64)]
Names = Annotated[list[Text], Meta(max_length=100_000)]


class _Figures(Struct, forbid_unknown_fields=True):
    examples: Count
    people: Count
    held: Count
    recognised: Count
    accepted: Count
    strangers: Count
    refused: Count


class _Training(Struct, forbid_unknown_fields=True):
    people: Names
    sources: Names
    frames: Count
    settings: Annotated[dict[Text, Text], Meta(max_length=100)]
    figures: Annotated[list[_Figures], Meta(max_length=10_000)]


class _Alarms(Struct, forbid_unknown_fields=True):
    hours: Annotated[float, Meta(gt=0, le=1e6)]
    least: Annotated[float, Meta(ge=0, le=1)]
    shares: Array


class _Forest(Struct, forbid_unknown_fields=True, omit_defaults=True):
    values: Annotated[int, Meta(ge=1, le=10_000)]  # of the description of a segment
    nodes: Array
    thresholds: Array
    alarms: _Alarms | None = None  # only of models trained for a rate of false postures


class _Contents(Struct, forbid_unknown_fields=True):
    features: Text
    names: Annotated[list[Text], Meta(max_length=100)]
    rate: Annotated[float, Meta(ge=1, le=1000)]
    labels: Annotated[list[Label], Meta(min_length=1, max_length=MOST_LABELS)]
    farthest: Annotated[float, Meta(gt=0, le=1e9)]
    calm: Annotated[float, Meta(ge=0, le=1e9)]
    slow: Annotated[float, Meta(ge=0, le=1e9)]
    mean: Array
    whitening: Array
    codebook: Array
    occurring: Array
    start: Array
    transition: Array
    emission: Array
    durations: Array
    edges: Array
    reach: Array
    thresholds: Array
    training: _Training
    forest: _Forest | None = None  # not in files of `paper`, nor of versions before 0.3
    ignored: Annotated[list[Part], Meta(min_length=1, max_length=2)] | msgspec.UnsetType = msgspec.UNSET  # not without any


def find_model(text: str) -> Path:
    """Path of a model file.  text: the name of a shipped model, or a path.  Raises UserError."""
    return recognizer_table.find_postures(text, Path())


def write_model(path: Path, model: PostureModel) -> None:
    """Write a file atomically.  Raises OSError, and UserError for a model with values that the file cannot have."""
    write_atomically(path, packed(path, model))


def packed(path: Path, model: PostureModel) -> bytes:
    """Content of a model file.  path: for errors.  Raises UserError."""
    content: dict[str, object] = {name: packed_array(getattr(model, name)) for name in ARRAYS}
    content |= {name: getattr(model, name) for name in PLAIN}
    content |= {"names": NAMES, "training": asdict(model.training)}
    if model.ignored:
        content["ignored"] = list(model.ignored)
    if model.forest is not None:
        nodes, thresholds = packed_array(model.forest.nodes, single=True), packed_array(model.forest.thresholds)
        forest: dict[str, object] = {"values": VALUES, "nodes": nodes, "thresholds": thresholds}
        if (alarms := model.forest.alarms) is not None:
            forest["alarms"] = asdict(alarms) | {"shares": packed_array(alarms.shares)}
        content["forest"] = forest
    data = FORMAT.encoded(path, content, _Contents)
    parse_model(path, data)
    return data


def read_model(path: Path) -> PostureModel:
    """Read a model file.  Raises UserError and OSError."""
    return parse_model(path, FORMAT.read(path))


def parse_model(path: Path, data: bytes) -> PostureModel:
    """Parse the content of a model file.  path: for errors.  Raises UserError."""
    contents = FORMAT.decoded(path, data, _Contents)
    _check_names(path, contents)
    model = _unpacked(path, contents)
    _check_values(path, model)
    return model


def _unpacked(path: Path, contents: _Contents) -> PostureModel:
    """Convert to arrays; every shape is checked against the numbers of labels, features, symbols and states."""
    n, d = len(contents.labels), len(contents.names)
    k = contents.codebook.shape[0] if contents.codebook.shape else 0
    s = contents.start.shape[-1] if contents.start.shape else 0
    if not (k >= 1 and s >= 1):
        fail(path, "codebook, start", f"{k} symbols, {s} states", "1 or more of both")
    shapes: dict[str, tuple[int, ...]] = {
        "mean": (d,), "whitening": (d, d), "codebook": (k, d), "occurring": (k,), "start": (n, s), "transition": (n, s, s),
        "emission": (n, s, k), "durations": (n, 3), "edges": (n, 2, d), "reach": (n,), "thresholds": (n,),
    }  # fmt: skip
    arrays = {name: unpacked_array(path, name, getattr(contents, name), shape) for name, shape in shapes.items()}
    stored = contents.training
    figures = tuple(LabelFigures(**msgspec.structs.asdict(row)) for row in stored.figures)
    training = Training(tuple(stored.people), tuple(stored.sources), stored.frames, dict(stored.settings), figures)
    features = next(kind for kind in KINDS if kind == contents.features)
    return PostureModel(
        features, contents.rate, tuple(contents.labels), **arrays, farthest=contents.farthest, calm=contents.calm,
        slow=contents.slow, training=training,
        forest=None if contents.forest is None else _unpacked_forest(path, contents.forest, n),
        ignored=() if contents.ignored is msgspec.UNSET else tuple(contents.ignored),
    )  # fmt: skip


def _unpacked_forest(path: Path, contents: _Forest, labels: int) -> Forest:
    """Every path through a tree ends: nodes follow in rising order, and the last one of a tree is a leaf."""
    if contents.values != VALUES:
        fail(path, "forest.values", contents.values, f"{VALUES}; train it again with this version of zenocap")
    trees, size = (*contents.nodes.shape, 0, 0)[:2]
    if not (trees >= 1 and size >= 1):
        fail(path, "forest.nodes.shape", contents.nodes.shape, "1 or more trees of 1 or more nodes")
    nodes = unpacked_array(path, "forest.nodes", contents.nodes, (trees, size, 3), single=True)
    feature, other = nodes[:, :, FEATURE], nodes[:, :, OTHER]
    leaf, whole = feature == LEAF, (feature == np.floor(feature)) & (other == np.floor(other))
    inner = (feature >= 0) & (feature < VALUES) & (other > np.arange(size)) & (other < size)
    right = whole & np.where(leaf, (other >= 0) & (other <= labels), inner)
    right[:, -1] &= leaf[:, -1]
    if not right.all():
        tree, node = (int(index) for index in np.argwhere(~right)[0])
        fail(path, f"forest.nodes[{tree}][{node}]", nodes[tree, node].tolist(), "a leaf with a posture, or a later node")
    thresholds = unpacked_array(path, "forest.thresholds", contents.thresholds, (labels,))
    if np.abs(thresholds).max() > NO_LIMIT:
        fail(path, "forest.thresholds", float(np.abs(thresholds).max()), f"values up to {NO_LIMIT:g}")
    return Forest(nodes, thresholds, None if contents.alarms is None else _unpacked_alarms(path, contents.alarms))


def _unpacked_alarms(path: Path, contents: _Alarms) -> FalseAlarms:
    count = (*contents.shares.shape, 0)[0]
    shares = unpacked_array(path, "forest.alarms.shares", contents.shares, (count,))
    if count and not (shares.min() >= 0.0 and shares.max() <= 1.0):
        fail(path, "forest.alarms.shares", [float(shares.min()), float(shares.max())], "0 to 1")
    return FalseAlarms(contents.hours, shares, contents.least)


def _check_names(path: Path, contents: _Contents) -> None:
    if contents.features not in KINDS:
        fail(path, "features", repr(contents.features), ", ".join(KINDS))
    if contents.names != list(NAMES):
        fail(path, "names", contents.names, f"{list(NAMES)}")
    if len(set(contents.labels)) != len(contents.labels):
        fail(path, "labels", contents.labels, "different labels")
    if len(contents.training.figures) != len(contents.labels):
        fail(path, "training.figures", len(contents.training.figures), f"{len(contents.labels)}, one per label")


def _check_values(path: Path, model: PostureModel) -> None:
    for name in ("mean", "whitening", "codebook", "edges", "reach", "thresholds"):
        worst = float(np.abs(getattr(model, name)).max())
        if worst > 1e9:
            fail(path, name, worst, "values up to 1e9")
    for name in ("occurring", "start", "transition", "emission"):
        rows: Floats = getattr(model, name)
        if rows.min() < 0.0:
            fail(path, name, rows.min(), "probabilities, 0 to 1")
        off = float(np.abs(rows.sum(axis=-1) - 1.0).max())
        if off > ROUNDING:
            fail(path, name, f"a sum {off:.3g} off from 1", f"{ROUNDING:g}")
    rising = np.diff(model.durations, axis=1, prepend=0.0)
    if rising.min() < 0.0 or model.durations.max() > 1e6:
        fail(path, "durations", model.durations[np.argmin(rising.min(axis=1))].tolist(), "seconds, rising, 0 to 1e6")
