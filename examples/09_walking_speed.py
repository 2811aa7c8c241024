"""Speed of walking from the navel's path, smoothed by a moving average of half a second.

python examples/09_walking_speed.py demo.mcap
"""

import sys

import numpy as np

import zenocap

take = zenocap.open_take(sys.argv[1])
poses = take.poses()
good = ~poses.lost
times_s, ground = poses.times_s[good], poses.positions[good][:, [0, 2]]
width = max(1, round(take.rate / 2))
kernel = np.ones(width) / width
smooth = np.column_stack([np.convolve(ground[:, k], kernel, mode="valid") for k in (0, 1)])
speed = np.linalg.norm(np.gradient(smooth, times_s[: len(smooth)], axis=0), axis=1)
print(f"speed: median {np.median(speed):.2f} m/s, highest {speed.max():.2f} m/s")
