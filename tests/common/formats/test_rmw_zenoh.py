"""Keys, tokens and attachments of rmw_zenoh, after its source and design document."""

import pytest
import xxhash
import zenoh
from rosbags.typesys import Stores, get_typestore

from zenocap.common.formats import rmw_zenoh

TF = rmw_zenoh.RosTopic("/tf", rmw_zenoh.TF_MESSAGE, 100)
NODE = rmw_zenoh.RosNode(7, "/lab/studio", "zenocap", "aac3178e146ba6f1fc6e6a4085e77f21")


@pytest.mark.parametrize("kind", [rmw_zenoh.TF_MESSAGE, rmw_zenoh.MARKER_ARRAY], ids=lambda kind: kind.name)
@pytest.mark.parametrize("store", [Stores.ROS2_JAZZY, Stores.ROS2_KILTED], ids=lambda store: store.value)
def test_type_hashes_are_those_of_the_definitions(kind: rmw_zenoh.RosType, store: Stores) -> None:
    assert get_typestore(store).hash_rihs01(kind.name) == kind.hash


def test_the_key_has_domain_topic_type_and_hash() -> None:
    assert TF.key(7) == f"7/tf/tf2_msgs::msg::dds_::TFMessage_/{rmw_zenoh.TF_MESSAGE.hash}"
    nested = rmw_zenoh.RosTopic("/lab/studio/skeleton", rmw_zenoh.MARKER_ARRAY, 10).key(0)
    assert nested.startswith("0/lab/studio/skeleton/visualization_msgs::msg::dds_::MarkerArray_/RIHS01_")


def test_tokens_have_the_form_that_rmw_zenoh_parses() -> None:
    assert NODE.token() == "@ros2_lv/7/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%lab%studio/zenocap"
    parts = NODE.publisher_token(1, TF).split("/")
    assert parts[:6] == ["@ros2_lv", "7", NODE.session, "0", "1", "MP"]
    assert parts[6:10] == ["%", "%lab%studio", "zenocap", "%tf"]
    assert parts[10:] == ["tf2_msgs::msg::dds_::TFMessage_", rmw_zenoh.TF_MESSAGE.hash, "::,100:,:,:,,"]
    assert all(parts)  # rmw_zenoh refuses tokens with empty parts
    zenoh.KeyExpr(NODE.publisher_token(1, TF))


def test_a_default_depth_is_left_out_and_a_node_without_namespace_has_the_mangled_root() -> None:
    assert rmw_zenoh.RosTopic("/tf", rmw_zenoh.TF_MESSAGE, 42).qos == "::,:,:,:,,"
    assert rmw_zenoh.RosNode(0, "/", "zenocap", "a1").token() == "@ros2_lv/0/a1/0/0/NN/%/%/zenocap"


def test_the_gid_is_the_hash_of_the_token_low_half_first() -> None:
    token = NODE.publisher_token(1, TF)
    number = xxhash.xxh3_128_intdigest(token.encode())
    low, high = number & (2**64 - 1), number >> 64
    assert rmw_zenoh.gid_of(token, xxhash.xxh3_128_digest) == low.to_bytes(8, "little") + high.to_bytes(8, "little")


def test_the_attachment_is_what_zenohs_deserializer_reads() -> None:
    gid = bytes(range(16))
    data = rmw_zenoh.attachment(3, 1_700_000_000_000_000_001, gid)
    assert len(data) == 33
    kind = tuple[zenoh.ext.Int64, zenoh.ext.Int64, bytes]
    assert zenoh.ext.z_deserialize(kind, zenoh.ZBytes(data)) == (3, 1_700_000_000_000_000_001, gid)


@pytest.mark.parametrize(
    ("name", "found"), [("studio", "studio"), ("lab-2.b", "lab_2_b"), ("2nd", "rig_2nd"), ("__", "rig"), ("a__b", "a_b")]
)
def test_names_of_rigs_become_names_of_ros(name: str, found: str) -> None:
    assert rmw_zenoh.ros_name(name) == found
