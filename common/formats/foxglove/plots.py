"""What a plot panel reads of our messages, as JSON: one name for each number, degrees and milliseconds for people."""

from math import degrees, hypot

import msgspec

from common import messages as m

DECIMALS = 3
_encode = msgspec.json.Encoder().encode


def pose_json(bap: m.UniversalBap) -> bytes:
    """Of `pose_row`.  Without position and angles while the person is lost, so that a plot has a gap."""
    tracked = "person" not in bap.lost
    content: dict[str, object] = {
        "frame": bap.frame,
        "tracked": tracked,
        "lost": bap.lost,
        "stale": bap.stale,
        "viewers": [
            {"viewer": viewer, "score": round(score, DECIMALS), "view": bap.views.get(viewer, "")}
            for viewer, score in bap.scores.items()
        ],
    }
    if tracked:
        content["position"] = dict(zip("xyz", bap.position, strict=True))
        content["angles_deg"] = _by_joint(bap.angles)
    return _encode(content)


def tracker_json(pose: m.TrackerPose) -> bytes:
    """Of `pose_row`; as `pose_json`."""
    content: dict[str, object] = {
        "frame": pose.frame,
        "tracked": not pose.lost,
        "lost": ["person"] if pose.lost else [],
        "stale": [],
        "likelihood": pose.likelihood,
        "effective": pose.effective,
        "spread_mm": 1e3 * hypot(*pose.position_spread),
        "viewers": [{"viewer": viewer, "view": "used"} for viewer in pose.views],
    }
    if not pose.lost:
        content["position"] = dict(zip("xyz", pose.position, strict=True))
        content["angles_deg"] = _by_joint(pose.angles)
    return _encode(content)


def posture_json(posture: m.Posture) -> bytes:
    """Of `POSTURE`.  start_s, end_s: since the Unix epoch.  late_s: the answer came so long after the end."""
    return _encode({
        "frame": posture.frame, "label": posture_words(posture), "known": posture.label is not None,
        "start_s": posture.start_ns / 1e9, "end_s": posture.end_ns / 1e9,
        "lasted_s": (posture.end_ns - posture.start_ns) / 1e9, "late_s": (posture.captured_ns - posture.end_ns) / 1e9,
        "score": posture.score, "margin": posture.margin,
        "log_likelihoods": [{"label": label, "value": value} for label, value in posture.log_likelihoods.items()],
    })  # fmt: skip


def posture_words(posture: m.Posture) -> str:
    return posture.label or "none of its postures"


def sighting_json(sighting: m.Sighting) -> bytes:
    """Of `SIGHTING`."""
    return _encode({
        "frame": sighting.frame, "present": sighting.present, "view": sighting.view, "score": sighting.score,
        "x": sighting.x, "y": sighting.y, "height": sighting.height, "width": sighting.width,
        "tilt_deg": degrees(sighting.tilt),
    })  # fmt: skip


def health_json(health: m.Health) -> bytes:
    """Of `HEALTH`."""
    return _encode({
        "state": health.state, "rate": health.rate, "clock_offset_ms": health.clock_offset_ns / 1e6,
        "clock_error_ms": health.clock_error_ns / 1e6, "memory_mb": health.memory_bytes / 1e6,
        "stages": [{"name": name, "ms": value} for name, value in health.stages_ms.items()],
        "counts": [{"name": name, "count": value} for name, value in health.counts.items()],
    })  # fmt: skip


def _by_joint(angles: dict[str, float]) -> dict[str, dict[str, float]]:
    joints: dict[str, dict[str, float]] = {}
    for name, angle in angles.items():
        joint, _, axis = name.rpartition(".")
        joints.setdefault(joint, {})[axis] = round(degrees(angle), DECIMALS)
    return joints
