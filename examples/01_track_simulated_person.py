"""Track a simulated person with two simulated cameras, and print the place of the right hand.

python examples/01_track_simulated_person.py demo.mcap
"""

import sys

import numpy as np

import zenocap

output = sys.argv[1] if len(sys.argv) > 1 else "demo.mcap"
take = zenocap.track(zenocap.demo_rig(), output)
poses = take.poses()

hand = poses.joint_centres[:, take.joint_names.index("RWrist")]  # (n, 3) metres, Y up
print(f"{len(poses)} poses at {take.rate:.1f} frames/s, {np.count_nonzero(poses.lost)} of them lost")
print(f"highest right hand: {np.nanmax(hand[:, 1]):.2f} m at {poses.times_s[np.nanargmax(hand[:, 1])]:.1f} s")
