"""The table of the channels beside our own: where they are, and how their bytes are described.

They lie below `foxglove/{rig}/`, so that no key of ours can be one of them.  A viewer's images and its calibration share
everything up to the last slash: by that Lichtblick's image panel finds the calibration.  JSON Schemas keep to what
Lichtblick reads: objects, arrays of one type, numbers, integers, booleans and strings, without references.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import NamedTuple, Protocol

import foxglove.messages as fox
import msgspec
from foxglove import Schema

from common.body.anatomy import Anatomy
from common.take.recording import Channel

JsonSchema = dict[str, object]

ROOT = "map"  # Z up, as 3-D panels have it; one of the frames that Lichtblick shows by itself
WORLD = "world"  # Y up: our own
PERSON = "person"  # the entity of the scene


class Beside(NamedTuple):
    """One message for a channel beside ours."""

    channel: Channel
    data: bytes


class Described(Protocol):
    """A message type of foxglove-sdk."""

    @staticmethod
    def get_schema() -> Schema: ...


@dataclass(frozen=True)
class Row:
    """topic: with {rig}, {viewer} or {service} and {id} to fill in.  The other fields are a `Channel`'s."""

    topic: str
    encoding: str
    schema_name: str
    schema_encoding: str
    schema: bytes

    def channel(self, **names: str) -> Channel:
        return _channel(self, tuple(names.items()))


def camera_frame(viewer: str) -> str:
    """Name of the frame of a viewer's camera: x right, y down, z forward."""
    return f"viewer/{viewer}"


def _protobuf(topic: str, kind: type[Described]) -> Row:
    schema = kind.get_schema()
    return Row(topic, "protobuf", schema.name, schema.encoding, schema.data)


def _json(topic: str, name: str, schema: JsonSchema) -> Row:
    return Row(topic, "json", name, "jsonschema", msgspec.json.encode(schema | {"title": name}))


def _object(fields: Mapping[str, JsonSchema]) -> JsonSchema:
    return {"type": "object", "properties": dict(fields)}


def _array(items: JsonSchema) -> JsonSchema:
    return {"type": "array", "items": items}


_NUMBER: JsonSchema = {"type": "number"}
_COUNT: JsonSchema = {"type": "integer", "minimum": 0}
_FLAG: JsonSchema = {"type": "boolean"}
_TEXT: JsonSchema = {"type": "string"}

SCENE = _protobuf("foxglove/{rig}/scene", fox.SceneUpdate)
BODY = _protobuf("foxglove/{rig}/body", fox.FrameTransforms)
FIXED = _protobuf("foxglove/{rig}/fixed", fox.FrameTransforms)
POINTS = _protobuf("foxglove/{rig}/points", fox.PointCloud)
JOINTS = _protobuf("foxglove/{rig}/joints", fox.JointStates)
CALIBRATION = _protobuf("foxglove/{rig}/viewer/{viewer}/calibration", fox.CameraCalibration)
SILHOUETTE = _protobuf("foxglove/{rig}/viewer/{viewer}/silhouette", fox.CompressedImage)
PREVIEW = _protobuf("foxglove/{rig}/viewer/{viewer}/preview", fox.CompressedImage)
SIGHTING = _json(
    "foxglove/{rig}/viewer/{viewer}/sighting",
    "zenocap.plot.Sighting",
    _object({
        "frame": _COUNT, "present": _FLAG, "view": _TEXT, "score": _NUMBER, "x": _NUMBER, "y": _NUMBER,
        "height": _NUMBER, "width": _NUMBER, "tilt_deg": _NUMBER,
    }),
)  # fmt: skip
POSTURE = _json(
    "foxglove/{rig}/posture",
    "zenocap.plot.Posture",
    _object({
        "frame": _COUNT, "label": _TEXT, "known": _FLAG, "start_s": _NUMBER, "end_s": _NUMBER, "lasted_s": _NUMBER,
        "late_s": _NUMBER, "score": _NUMBER, "margin": _NUMBER,
        "log_likelihoods": _array(_object({"label": _TEXT, "value": _NUMBER})),
    }),
)  # fmt: skip
EVENTS = _protobuf("foxglove/{rig}/events", fox.Log)
HEALTH = _json(
    "foxglove/{rig}/{service}/{id}/health",
    "zenocap.plot.Health",
    _object({
        "state": _TEXT, "rate": _NUMBER, "clock_offset_ms": _NUMBER, "clock_error_ms": _NUMBER, "memory_mb": _NUMBER,
        "stages": _array(_object({"name": _TEXT, "ms": _NUMBER})),
        "counts": _array(_object({"name": _TEXT, "count": _COUNT})),
    }),
)  # fmt: skip


@cache
def pose_row(anatomy: Anatomy) -> Row:
    """Joint angles in degrees by joint and axis (`angles_deg.right_elbow.x`), position and scores, for plots.

    likelihood, effective, spread_mm: of the tracker alone; the spread is the navel's.
    """
    joints = {joint.name: _object(dict.fromkeys(joint.axes, _NUMBER)) for joint in anatomy.joints if joint.axes}
    return _json(
        "foxglove/{rig}/pose",
        "zenocap.plot.Pose",
        _object({
            "frame": _COUNT, "tracked": _FLAG, "lost": _array(_TEXT), "stale": _array(_TEXT),
            "likelihood": _NUMBER, "effective": _NUMBER, "spread_mm": _NUMBER,
            "viewers": _array(_object({"viewer": _TEXT, "score": _NUMBER, "view": _TEXT})),
            "position": _object(dict.fromkeys("xyz", _NUMBER)),
            "angles_deg": _object(joints),
        }),
    )  # fmt: skip


@lru_cache(maxsize=1024)  # a rig has few
def _channel(row: Row, names: tuple[tuple[str, str], ...]) -> Channel:
    return Channel(row.topic.format_map(dict(names)), row.encoding, row.schema_name, row.schema_encoding, row.schema)
