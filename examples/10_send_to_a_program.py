"""Send the hands of a running rig to another program as JSON over UDP, one datagram a pose.

`zenocap animator` sends OSC, VMC, LSL and UDP by itself (docs/outputs.md).  This shows how to send something else.

    python examples/10_send_to_a_program.py studio.toml 127.0.0.1:9000 tcp/127.0.0.1:7447
"""

import json
import socket
import sys

import zenocap

rig, receiver, *connect = sys.argv[1:]
host, _, port = receiver.partition(":")
with (
    socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    zenocap.subscribe(rig, connect=connect, timeout_s=10.0) as poses,
):
    for pose in poses:
        joints = dict(zip(pose.joint_names, pose.joint_centres.round(4).tolist(), strict=True))
        hands = {"frame": pose.frame, "right": joints["RWrist"], "left": joints["LWrist"]}
        sender.sendto(json.dumps(hands).encode(), (host, int(port)))
