"""Receive the live poses of a running rig, and print how high the hands are.

zenocap up studio.toml --listen tcp/127.0.0.1:7447
python examples/06_live_poses.py studio.toml tcp/127.0.0.1:7447
"""

import sys
import time

import zenocap

rig, *connect = sys.argv[1:]
with zenocap.subscribe(rig, connect=connect, timeout_s=30.0) as poses:
    for count, pose in enumerate(poses):
        right, left = (pose.joint_centres[pose.joint_names.index(name)] for name in ("RWrist", "LWrist"))
        age_ms = (time.time_ns() - pose.captured_ns) / 1e6
        print(f"frame {pose.frame}: right hand {right[1]:.2f} m, left hand {left[1]:.2f} m, {age_ms:.0f} ms after capture")
        if count == 20:
            break
