"""Table of the Foxglove channels of a rig: topics and schemas.

Topics begin with `foxglove/{rig}/`, unlike all keys of zenocap.  A viewer's images and its calibration have the same topic
up to the last slash: Lichtblick's image panel finds the calibration by it.  JSON Schemas use only the types that
Lichtblick supports: objects, arrays of one type, numbers, integers, booleans and strings, without references.
"""

from collections.abc import Mapping
from functools import cache, lru_cache
from typing import NamedTuple, Protocol

import foxglove.messages as fox
import msgspec
from foxglove import Schema

from zenocap.common.body.anatomy import Anatomy
from zenocap.common.recording.writer import Channel

JsonSchema = dict[str, object]

ROOT = "map"  # Z up, as in 3-D panels; a frame that Lichtblick shows by default
WORLD = "world"  # Y up
PERSON = "person"  # id of the scene entity


class FoxgloveMessage(NamedTuple):
    """A message of a Foxglove channel."""

    channel: Channel
    data: bytes


class MessageType(Protocol):
    """A message type of foxglove-sdk."""

    @staticmethod
    def get_schema() -> Schema: ...


class ChannelTemplate(Channel):
    """Template of a `Channel`.  topic: with the fields {rig}, {viewer}, or {service} and {id}."""

    def channel(self, **names: str) -> Channel:
        """Channel with the fields of the topic filled in."""
        return _channel(self, tuple(names.items()))


def camera_frame(viewer: str) -> str:
    """Frame name of a viewer's camera: x right, y down, z forward."""
    return f"viewer/{viewer}"


def _protobuf(topic: str, kind: type[MessageType]) -> ChannelTemplate:
    schema = kind.get_schema()
    return ChannelTemplate(topic, "protobuf", schema.name, schema.encoding, schema.data)


def _json(topic: str, name: str, schema: JsonSchema) -> ChannelTemplate:
    return ChannelTemplate(topic, "json", name, "jsonschema", msgspec.json.encode(schema | {"title": name}))


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
VERDICT = _json(
    "foxglove/{rig}/verdict",
    "zenocap.plot.Verdict",
    _object({
        "rating": _TEXT, "error_mm": _NUMBER, "evidence": _TEXT,
        "reasons": _array(_object({"kind": _TEXT, "viewers": _array(_TEXT), "text": _TEXT})),
        "stretches": _array(_object({
            "start_s": _NUMBER, "end_s": _NUMBER, "rating": _TEXT, "error_mm": _NUMBER, "lost": _NUMBER,
            "reasons": _array(_TEXT),
        })),
    }),
)  # fmt: skip
EVENTS = _protobuf("foxglove/{rig}/events", fox.Log)
HEALTH = _json(
    "foxglove/{rig}/{service}/{id}/health",
    "zenocap.plot.Health",
    _object({
        "phase": _TEXT, "state": _TEXT, "rate": _NUMBER, "clock_offset_ms": _NUMBER, "clock_error_ms": _NUMBER,
        "memory_mb": _NUMBER,
        "stages": _array(_object({"name": _TEXT, "ms": _NUMBER})),
        "counts": _array(_object({"name": _TEXT, "count": _COUNT})),
    }),
)  # fmt: skip


@cache
def pose_template(anatomy: Anatomy) -> ChannelTemplate:
    """Joint angles in degrees by joint and axis (`angles_deg.right_elbow.x`), position and scores, for plots.

    likelihood, effective, spread_mm: of the tracker only; the spread is the navel's.
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


@lru_cache(maxsize=1024)  # bounds the memory; a rig has fewer
def _channel(row: ChannelTemplate, names: tuple[tuple[str, str], ...]) -> Channel:
    return Channel(row.topic.format_map(dict(names)), row.encoding, row.schema_name, row.schema_encoding, row.schema)
