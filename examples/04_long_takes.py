"""Read a take of any length in little memory: chunk by chunk.

python examples/04_long_takes.py demo.mcap
"""

import sys

import numpy as np

import zenocap

take = zenocap.open_take(sys.argv[1])
if take.missing:
    print(f"note: {take.missing}", file=sys.stderr)
distance = 0.0
last = np.full(2, np.nan)
for poses in take.chunks(500):
    ground = np.vstack([last, poses.positions[:, [0, 2]]])  # (n + 1, 2) metres: X and Z of the navel
    distance += np.nansum(np.linalg.norm(np.diff(ground, axis=0), axis=1))
    last = ground[-1]
print(f"path length of the navel over the ground: {distance:.1f} m in {take.frame_count / (take.rate or 1):.0f} s")
