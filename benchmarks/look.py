"""Contact sheets of a take: both views with the true joints (green) and the estimated ones (red, left side blue).

python -m benchmarks.look PERSON POSTURE NUMBER FOLDER [--every N]
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

from benchmarks.errors import JOINTS, frame_error
from benchmarks.loop import track_film
from benchmarks.takes import Take, default_folder, film
from zenocap.common.arrays import Bytes, Floats
from zenocap.common.camera.pinhole import Camera
from zenocap.simulation.motion.posture_style import POSTURES

BONES = (
    ("Hip", "Neck"), ("Neck", "Head"), ("RHip", "LHip"), ("RShoulder", "LShoulder"),
    ("RShoulder", "RElbow"), ("RElbow", "RWrist"), ("LShoulder", "LElbow"), ("LElbow", "LWrist"),
    ("RHip", "RKnee"), ("RKnee", "RAnkle"), ("LHip", "LKnee"), ("LKnee", "LAnkle"),
)  # fmt: skip
ZOOM = 3
TRUE_BGR, FOUND_BGR, FOUND_LEFT_BGR = (0, 200, 0), (0, 0, 255), (255, 80, 0)


def drawn(image: Bytes, camera: Camera, true: Floats, found: Floats | None) -> Bytes:
    """The image, enlarged, with joints (15, 3) as sticks; the estimate's left side is blue."""
    large = np.asarray(cv2.resize(image, None, fx=ZOOM, fy=ZOOM, interpolation=cv2.INTER_NEAREST), dtype=np.uint8)
    for joints, colour in ((true, TRUE_BGR), (found, FOUND_BGR)):
        if joints is None:
            continue
        pixels = np.rint((camera.project(joints) + 0.5) * ZOOM - 0.5).astype(int)
        for start, end in BONES:
            own = FOUND_LEFT_BGR if colour is FOUND_BGR and end.startswith("L") else colour
            a, b = pixels[JOINTS.index(start)], pixels[JOINTS.index(end)]
            cv2.line(large, (int(a[0]), int(a[1])), (int(b[0]), int(b[1])), own, 1, cv2.LINE_AA)
    return large


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("person", type=int)
    parser.add_argument("posture", choices=POSTURES)
    parser.add_argument("number", type=int)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--every", type=int, default=4)
    options = parser.parse_args()
    take = Take(options.person, options.posture, options.number)
    rendered = film(take, default_folder())
    track = track_film(rendered, take.fps)
    options.folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for k in range(rendered.motion_from, len(rendered.truths), options.every):
        true, found = rendered.truths[k], track.estimate(k)
        assert true is not None
        error = frame_error(found, true)
        joints = np.stack([true.joints[name] for name in JOINTS])
        views = [
            drawn(images[k], rendered.cameras[viewer], joints, None if found is None else found.joints)
            for viewer, images in rendered.images.items()
        ]
        row = np.hstack(views)
        words = f"{k}: {error.segments.mean():.0f} deg {error.joints.mean():.0f} mm yaw {error.yaw:.0f}"
        bap = track.baps.get(k)
        if bap is not None:
            words += f"  {'/'.join(bap.views.values())} {'/'.join(f'{s:.2f}' for s in bap.scores.values())} {bap.lost}"
        cv2.putText(row, words, (4, 14), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (255, 255, 255), 1, cv2.LINE_AA)
        rows.append(row)
    for k in range(0, len(rows), 6):
        left, right = rows[k : k + 3], rows[k + 3 : k + 6]
        right += [np.zeros_like(left[0])] * (len(left) - len(right))
        path = options.folder / f"{take.posture}-{take.person}-{take.number}-{k // 6}.png"
        cv2.imwrite(str(path), np.hstack([np.vstack(left), np.vstack(right)]))
        print(path)


if __name__ == "__main__":
    main()
