"""The table of channels is valid for Lichtblick.

Its rules, from its source (packages/mcap-support and suite-base at 66adecb, 2026-08): a protobuf channel has a
FileDescriptorSet with the type of the schema's name in it; a JSON channel has a JSON Schema of objects, arrays of one
type, booleans, numbers, integers and strings; panels pick channels by the schema's full name; the image panel takes the
first calibration whose topic begins like the image's, up to the last slash; of frames, base_link, odom, map and earth
are preferred in this order.
"""

import json

import pytest

from tests.support.foxglove_reader import message_class
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.formats.foxglove import channels as table
from zenocap.common.formats.foxglove.channels import ChannelTemplate, pose_template
from zenocap.common.topics import topic_at

TEMPLATES = (
    *(template for template in vars(table).values() if isinstance(template, ChannelTemplate)),
    pose_template(TEN_PARTS),
)
PANELS = {
    "foxglove.SceneUpdate", "foxglove.FrameTransforms", "foxglove.CameraCalibration", "foxglove.CompressedImage",
    "foxglove.PointCloud", "foxglove.JointStates", "foxglove.Log",
}  # fmt: skip
PLAIN = {"boolean", "number", "integer", "string"}


def accepted(schema: object) -> bool:
    """Whether Lichtblick's parseJsonSchema takes it as a field."""
    match schema:
        case {"type": "object", "properties": dict(fields)}:
            return all(map(accepted, fields.values()))
        case {"type": "array", "items": {"type": "array"}}:
            return False
        case {"type": "array", "items": items}:
            return accepted(items)
        case {"type": str(kind)}:
            return kind in PLAIN
    return False


@pytest.mark.parametrize("row", TEMPLATES, ids=lambda row: row.topic)
def test_lichtblick_accepts_the_schema(row: ChannelTemplate) -> None:
    match row.encoding:
        case "protobuf":
            assert row.schema_encoding == "protobuf"
            assert row.schema_name in PANELS
            assert message_class(row.schema_name, row.schema).DESCRIPTOR.full_name == row.schema_name
        case _:
            assert (row.encoding, row.schema_encoding) == ("json", "jsonschema")
            schema = json.loads(row.schema)
            assert schema["type"] == "object"
            assert accepted(schema)


def test_the_schema_check_rejects_what_lichtblick_rejects() -> None:
    assert not accepted({"type": "object", "properties": {"a": {"anyOf": [{"type": "number"}, {"type": "null"}]}}})
    assert not accepted({"type": "object", "properties": {"a": {"$ref": "#/$defs/A"}}})
    assert not accepted({"type": "array", "items": {"type": "array", "items": {"type": "number"}}})


def test_topics_are_distinct_and_none_is_a_key_of_zenocap() -> None:
    names = {"rig": "studio", "viewer": "1", "service": "viewer", "id": "1"}
    topics = [row.channel(**names).topic for row in TEMPLATES]
    assert len(set(topics)) == len(topics)
    assert [topic for topic in topics if topic_at(topic) is not None or "{" in topic] == []


def test_an_image_and_its_calibration_share_their_topic_prefix() -> None:
    calibration = table.CALIBRATION.channel(rig="r", viewer="2").topic
    for image in (table.SILHOUETTE, table.PREVIEW):
        assert calibration.startswith(image.channel(rig="r", viewer="2").topic.rpartition("/")[0] + "/")
        assert not calibration.startswith(image.channel(rig="r", viewer="22").topic.rpartition("/")[0] + "/")


def test_the_root_frame_is_one_that_lichtblick_shows_by_default() -> None:
    assert table.ROOT in {"base_link", "odom", "map", "earth"}


def test_every_joint_angle_has_a_name_to_plot() -> None:
    joints = json.loads(pose_template(TEN_PARTS).schema)["properties"]["angles_deg"]["properties"]
    named = [f"{joint}.{axis}" for joint, schema in joints.items() for axis in schema["properties"]]
    assert sorted(named) == sorted(TEN_PARTS.angles)
