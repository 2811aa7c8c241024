"""Track your own videos: a folder in the Pose2Sim layout, with calibration.toml and videos/.

The person must stand in the T-pose for a moment: upright, facing any way, both arms stretched sideways.

    python examples/02_track_videos.py walk walk.mcap
"""

import sys

import zenocap


def show(count: int) -> None:
    if count % 50 == 0:
        print(f"{count} frames tracked", file=sys.stderr)


folder, output = sys.argv[1:3]
try:
    take = zenocap.track(folder, output, progress=show)
except zenocap.UserError as error:
    sys.exit(f"error: {error}")
lost = take.poses().lost.mean()
print(f"{output}: {take.frame_count} poses, {lost:.0%} lost")
