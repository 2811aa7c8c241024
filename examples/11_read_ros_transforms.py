"""Print the place of the head, from the transforms that a rig publishes for ROS 2.

ROS is not needed: rosbags decodes its messages.  pip install rosbags

    python examples/11_read_ros_transforms.py tcp/127.0.0.1:7447 studio
"""

import json
import sys
from typing import Any

import numpy as np
import zenoh
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

endpoint, namespace = sys.argv[1:]
types = get_typestore(Stores.ROS2_JAZZY)
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps([endpoint]))

with zenoh.open(config) as session:
    transforms = session.declare_subscriber("0/tf/tf2_msgs::msg::dds_::TFMessage_/*")
    for sample in transforms:
        message: Any = types.deserialize_cdr(sample.payload.to_bytes(), "tf2_msgs/msg/TFMessage")
        steps = {one.child_frame_id: one for one in message.transforms}
        place, frame = np.zeros(3), f"{namespace}/head"
        while frame in steps:  # from the head's frame to that of the world
            move, turn = steps[frame].transform.translation, steps[frame].transform.rotation
            rotation = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w])
            place = rotation.apply(place) + np.array([move.x, move.y, move.z])
            frame = steps[frame].header.frame_id
        print(f"head in {frame}: {place.round(3)} m", flush=True)
