"""JSON of messages for plot panels: one name per number, in degrees and milliseconds."""

from math import degrees, hypot

import msgspec

from zenocap.common import messages as m

DECIMALS = 3  # of scores and degrees
_encode = msgspec.json.Encoder().encode


def pose_json(bap: m.UniversalBap) -> bytes:
    """JSON of `pose_template`.  Position and angles are omitted while the person is lost: plots have a gap."""
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
    """JSON of `pose_template`, as `pose_json`."""
    content: dict[str, object] = {
        "frame": pose.frame,
        "tracked": not pose.lost,
        "lost": ["person"] if pose.lost else pose.lost_limbs,
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


def verdict_json(verdict: m.Verdict) -> bytes:
    """JSON of `VERDICT`.  start_s, end_s: since the Unix epoch."""
    return _encode({
        "rating": verdict.rating, "error_mm": 1e3 * verdict.error, "evidence": verdict.evidence,
        "reasons": [{"kind": one.kind, "viewers": one.viewers, "text": one.text} for one in verdict.reasons],
        "stretches": [
            {
                "start_s": one.start_ns / 1e9, "end_s": one.end_ns / 1e9, "rating": one.rating, "error_mm": 1e3 * one.error,
                "lost": one.lost, "reasons": one.reasons,
            }
            for one in verdict.stretches
        ],
    })  # fmt: skip


def posture_json(posture: m.Posture) -> bytes:
    """JSON of `POSTURE`.  start_s, end_s: since the Unix epoch.  late_s: delay of the result after the end."""
    return _encode({
        "frame": posture.frame, "label": posture_label(posture), "known": posture.label is not None,
        "start_s": posture.start_ns / 1e9, "end_s": posture.end_ns / 1e9,
        "lasted_s": (posture.end_ns - posture.start_ns) / 1e9, "late_s": (posture.captured_ns - posture.end_ns) / 1e9,
        "score": posture.score, "margin": posture.margin,
        "log_likelihoods": [{"label": label, "value": value} for label, value in posture.log_likelihoods.items()],
    })  # fmt: skip


def posture_label(posture: m.Posture) -> str:
    return posture.label or "unknown movement"


def sighting_json(sighting: m.Sighting) -> bytes:
    return _encode({
        "frame": sighting.frame, "present": sighting.present, "view": sighting.view, "score": sighting.score,
        "x": sighting.x, "y": sighting.y, "height": sighting.height, "width": sighting.width,
        "tilt_deg": degrees(sighting.tilt),
    })  # fmt: skip


def health_json(health: m.Health) -> bytes:
    return _encode({
        "phase": health.phase, "state": health.state, "rate": health.rate, "clock_offset_ms": health.clock_offset_ns / 1e6,
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
