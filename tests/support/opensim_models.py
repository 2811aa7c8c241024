"""Small generic model of OpenSim 4, with the names of Rajagopal's model."""

from pathlib import Path

# Joint, child, parent, place in the parent on the right side (m), kind.
TRUNK = (
    ("ground_pelvis", "pelvis", "ground", (0, 0, 0), "FreeJoint"),
    ("back", "torso", "pelvis", (-0.1, 0.08, 0), "BallJoint"),
)
SIDE = (
    ("hip", "femur", "pelvis", (-0.056, -0.078, 0.077), "BallJoint"),
    ("knee", "tibia", "femur", (0, -0.41, 0), "PinJoint"),
    ("ankle", "talus", "tibia", (0, -0.42, 0), "PinJoint"),
    ("subtalar", "calcn", "talus", (-0.049, -0.042, 0.008), "WeldJoint"),
    ("mtp", "toes", "calcn", (0.179, -0.002, 0.001), "WeldJoint"),
)
ARM = (
    ("acromial", "humerus", "torso", (0, 0.37, 0.17), "BallJoint"),
    ("elbow", "ulna", "humerus", (0, -0.29, 0), "PinJoint"),
    ("wrist", "hand", "ulna", (0, -0.25, 0), "WeldJoint"),
)


def write_model(path: Path, *, arms: bool = True, version: int = 40000) -> Path:
    """Write the model, of which arms can be left out."""
    rows = list(TRUNK)
    for ending, out in (("_r", 1), ("_l", -1)):
        for joint, child, parent, (x, y, z), kind in (*SIDE, *(ARM if arms else ())):
            name = parent if parent in ("pelvis", "torso") else parent + ending
            rows.append((joint + ending, child + ending, name, (x, y, out * z), kind))
    bodies = "".join(
        f'<Body name="{child}"><mass>1</mass><mass_center>0 0 0</mass_center><inertia>0.1 0.1 0.1 0 0 0</inertia></Body>'
        for _, child, *_ in rows
    )
    joints = "".join(_joint(*row) for row in rows)
    path.write_text(
        f'<?xml version="1.0" encoding="UTF-8"?><OpenSimDocument Version="{version}"><Model name="small">'
        f'<BodySet name="bodyset"><objects>{bodies}</objects></BodySet>'
        f'<JointSet name="jointset"><objects>{joints}</objects></JointSet></Model></OpenSimDocument>\n',
        encoding="utf-8",
    )
    return path


def _joint(name: str, child: str, parent: str, place: tuple[float, float, float], kind: str) -> str:
    where = "/ground" if parent == "ground" else f"/bodyset/{parent}"
    return (
        f'<{kind} name="{name}"><socket_parent_frame>parent_offset</socket_parent_frame>'
        f"<socket_child_frame>child_offset</socket_child_frame><frames>"
        f'<PhysicalOffsetFrame name="parent_offset"><socket_parent>{where}</socket_parent>'
        f"<translation>{place[0]} {place[1]} {place[2]}</translation></PhysicalOffsetFrame>"
        f'<PhysicalOffsetFrame name="child_offset"><socket_parent>/bodyset/{child}</socket_parent>'
        f"<translation>0 0 0</translation></PhysicalOffsetFrame></frames></{kind}>"
    )
