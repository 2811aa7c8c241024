"""Plot the knee angles of a take, as a picture.

python examples/03_joint_angles.py demo.mcap knees.png
"""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import zenocap

path, picture = sys.argv[1:3]
take = zenocap.open_take(path)
poses = take.poses()

figure, axes = plt.subplots(figsize=(8, 3), layout="constrained")
for side in ("right", "left"):
    knee = take.angle_names.index(f"{side}_knee.x")
    axes.plot(poses.times_s, -np.degrees(poses.angles[:, knee]), label=side)
axes.set(xlabel="time (s)", ylabel="knee flexion (degrees)")
axes.legend()
figure.savefig(picture, dpi=120)
