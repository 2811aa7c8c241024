"""Reports about the cameras of a calibration, as text and JSON."""

from dataclasses import asdict
from itertools import combinations

from zenocap.common.camera.pinhole import Camera, angle_between_deg, attitude, most_orthogonal_pair

NEARLY_ORTHOGONAL_DEG = 20.0  # deviation from 90° above which method two-view is discouraged; chosen by hand


def camera_report(cameras: dict[str, Camera]) -> list[str]:
    """Report of each camera's position and attitude and of the most orthogonal pair, as lines of text."""
    lines = []
    for name, camera in cameras.items():
        camera_attitude = attitude(camera)
        x, y, z = camera.centre
        heading = f"heading {camera_attitude.heading_deg:.1f} degrees from -Z towards +X"
        lines += [
            f"{name}: {camera.size[0]} x {camera.size[1]} px, focal length {_focal(camera)} px",
            f"  at ({x:.3f}, {y:.3f}, {z:.3f}) m, Y up",
            f"  {heading}, tilt {camera_attitude.tilt_deg:+.1f}, roll {camera_attitude.roll_deg:+.1f}",
        ]
        if y <= 0:
            lines.append("  below the ground: is the up axis right (--up-axis z)?")
    for one, other in combinations(cameras, 2):
        lines.append(f"{one} and {other}: {angle_between_deg(cameras[one], cameras[other]):.1f} degrees apart")
    if len(cameras) > 1:
        pair = most_orthogonal_pair(cameras)
        angle = angle_between_deg(*(cameras[name] for name in pair))
        lines.append(f"most nearly orthogonal: {pair[0]} (front) and {pair[1]}, {angle:.1f} degrees apart")
        if abs(angle - 90) > NEARLY_ORTHOGONAL_DEG:
            lines.append("  far from 90 degrees: method two-view loses accuracy; hybrid works at any angle")
    return lines


def camera_data(cameras: dict[str, Camera]) -> dict[str, object]:
    """The content of `camera_report` for JSON."""
    entries = [
        {
            "name": name,
            "size_px": list(camera.size),
            "position_m": camera.centre.tolist(),
            "focal_px": [float(camera.matrix[0, 0]), float(camera.matrix[1, 1])],
            **asdict(attitude(camera)),
        }
        for name, camera in cameras.items()
    ]
    angles = [
        {"cameras": [one, other], "angle_deg": angle_between_deg(cameras[one], cameras[other])}
        for one, other in combinations(cameras, 2)
    ]
    pair = list(most_orthogonal_pair(cameras)) if len(cameras) > 1 else None
    return {"cameras": entries, "angles": angles, "most_orthogonal": pair}


def _focal(camera: Camera) -> str:
    fx, fy = camera.matrix[0, 0], camera.matrix[1, 1]
    return f"{fx:.1f}" if abs(fx - fy) < 0.05 else f"{fx:.1f} x {fy:.1f}"
