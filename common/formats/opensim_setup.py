"""Set-up files of OpenSim 4: scaling of a generic model, inverse kinematics.

Markers are joint centres: each sits where the model has its joint, so that none has to be placed on a skin.  Feet have
three points beside the joints, where Pose2Sim has them on models of this family (Markers_Halpe26.xml, BSD-3-Clause, commit
f7b39c7).  `PelvisTop`, a point above the middle of the hips, carries the tilt of the tracked pelvis.
"""

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.errors import UserError
from zenocap.common.formats.opensim_model import BODYSET, OpenSimModel

VERSION = "40000"  # of the documents, as OpenSim 4.0 and later read them
PELVIS_TOP = "PelvisTop"
# Marker without the letter of its side: child body, without _r or _l, whose joint it is the centre of.
CENTRES: Mapping[str, str] = {
    "HJC": "femur", "KJC": "tibia", "AJC": "talus", "GH": "humerus", "EJC": "ulna", "WJC": "hand",
}  # fmt: skip
# Body, and place in it on the right side, metres.
FEET: Mapping[str, tuple[str, tuple[float, float, float]]] = {
    "Heel": ("calcn", (0.0136, 0.0233, -0.0019)),
    "BigToe": ("toes", (0.0647, 0.0099, -0.0146)),
    "SmallToe": ("toes", (0.0271, 0.0096, 0.0288)),
}
REQUIRED = ("pelvis", *(f"{body}_{s}" for s in "rl" for body in ("femur", "tibia", "talus", "calcn", "toes")))
# Scaled bodies and the distances of markers that scale them; {s} r or l, {S} R or L.
MEASUREMENTS: Sequence[tuple[str, tuple[str, ...], tuple[tuple[str, str], ...]]] = (
    ("pelvis", ("pelvis", "sacrum"), (("RHJC", "LHJC"),)),
    ("trunk", ("torso", "head"), (("RHJC", "RGH"), ("LHJC", "LGH"))),
    ("thigh_{s}", ("femur_{s}", "patella_{s}"), (("{S}HJC", "{S}KJC"),)),
    ("shank_{s}", ("tibia_{s}",), (("{S}KJC", "{S}AJC"),)),
    ("foot_{s}", ("talus_{s}", "calcn_{s}", "toes_{s}"), (("{S}Heel", "{S}BigToe"),)),
    ("upper_arm_{s}", ("humerus_{s}",), (("{S}GH", "{S}EJC"),)),
    ("lower_arm_{s}", ("ulna_{s}", "radius_{s}", "hand_{s}"), (("{S}EJC", "{S}WJC"),)),
)
WEIGHT = 1.0  # of every marker: all are places of one fitted body


def markers_of(model: OpenSimModel, path: Path) -> dict[str, tuple[str, Floats]]:
    """Body and place (3,) metres of every marker that the model can have.  path: for errors.

    Arms that the model lacks have no markers.  Raises UserError for a model without the bodies of REQUIRED.
    """
    if missing := [body for body in REQUIRED if body not in model.bodies]:
        allowed = "bodies named as in Rajagopal, gait2392 or Pose2Sim's models"
        raise UserError(f"{path}: no body {', '.join(missing)}: allowed: {allowed}")
    found: dict[str, tuple[str, Floats]] = {}
    for side in "RL":
        ending, out = f"_{side.lower()}", np.array([1.0, 1.0, 1.0 if side == "R" else -1.0])
        for name, part in CENTRES.items():
            if (body := part + ending) in model.centres:
                found[side + name] = body, model.centres[body]
        found |= {side + name: (part + ending, np.array(place) * out) for name, (part, place) in FEET.items()}
    hips = [model.parents.get(f"femur_{s}", ("", np.zeros(3))) for s in "rl"]
    if any(parent != "pelvis" for parent, _ in hips):
        raise UserError(f"{path}: the hips' parents are {hips[0][0]!r} and {hips[1][0]!r}: allowed: pelvis")
    (_, right), (_, left) = hips
    found[PELVIS_TOP] = "pelvis", (right + left) / 2 + np.array([0.0, float(np.linalg.norm(right - left)), 0.0])
    return found


def marker_set(markers: Mapping[str, tuple[str, Floats]]) -> str:
    root, found = _document("MarkerSet", "zenocap")
    objects = ET.SubElement(found, "objects")
    for name, (body, place) in markers.items():
        marker = _add(objects, "Marker", name)
        _text(marker, socket_parent_frame=BODYSET + body, location=" ".join(f"{v:.6f}" for v in place), fixed="true")
    return _xml(root)


def scale_setup(model: OpenSimModel, markers: Mapping[str, object], body_trc: str, files: Mapping[str, str]) -> str:
    """ScaleTool document.  body_trc: static trial.  files: names of `model`, `markers`, `scaled`, beside the set-up."""
    root, tool = _document("ScaleTool", f"{model.name}-scaled")
    _text(tool, mass="-1", height="-1", age="-1", notes="Sizes of the tracked body; its mass is not known.")
    maker = _add(tool, "GenericModelMaker")
    _text(maker, model_file=files["model"], marker_set_file=files["markers"])
    scaler = _add(tool, "ModelScaler")
    _text(scaler, apply="true", scaling_order="measurements")
    measures = ET.SubElement(_add(scaler, "MeasurementSet"), "objects")
    for name, bodies, pairs in measurements(model, markers):
        measure = _add(measures, "Measurement", name)
        _text(measure, apply="true")
        pair_objects = ET.SubElement(_add(measure, "MarkerPairSet"), "objects")
        for pair in pairs:
            _text(_add(pair_objects, "MarkerPair"), markers=" ".join(pair))
        scales = ET.SubElement(_add(measure, "BodyScaleSet"), "objects")
        for body in bodies:
            _text(_add(scales, "BodyScale", body), axes="X Y Z")
    _text(
        scaler, marker_file=body_trc, time_range="0 1", preserve_mass_distribution="false",
        output_model_file=files["scaled"], output_scale_file="Unassigned",
    )  # fmt: skip
    _text(_add(tool, "MarkerPlacer"), apply="false")
    return _xml(root)


def measurements(
    model: OpenSimModel, markers: Mapping[str, object]
) -> Iterator[tuple[str, tuple[str, ...], tuple[tuple[str, str], ...]]]:
    """Name, bodies and marker pairs of the measurements that the model and its markers allow."""
    for name, bodies, pairs in MEASUREMENTS:
        for side in "RL" if "{s}" in name else "R":
            letters = {"s": side.lower(), "S": side}
            scaled = tuple(b for body in bodies if (b := body.format(**letters)) in model.bodies)
            distances = tuple((a.format(**letters), b.format(**letters)) for a, b in pairs)
            if scaled and all(name in markers for pair in distances for name in pair):
                yield name.format(**letters), scaled, distances


def ik_setup(markers: Sequence[str], times_s: tuple[float, float], files: Mapping[str, str]) -> str:
    """InverseKinematicsTool document.  times_s: first and last.  files: names of `scaled`, `motion_trc` and `ik`."""
    root, tool = _document("InverseKinematicsTool", "zenocap")
    _text(
        tool, results_directory=".", model_file=files["scaled"], constraint_weight="Inf", accuracy="1e-05",
        time_range=f"{times_s[0]:.6f} {times_s[1]:.6f}", output_motion_file=files["ik"], report_errors="true",
        marker_file=files["motion_trc"], coordinate_file="Unassigned", report_marker_locations="false",
    )  # fmt: skip
    tasks = ET.SubElement(_add(tool, "IKTaskSet"), "objects")
    for name in markers:
        _text(_add(tasks, "IKMarkerTask", name), apply="true", weight=f"{WEIGHT:g}")
    return _xml(root)


def _document(tag: str, name: str) -> tuple[ET.Element, ET.Element]:
    root = ET.Element("OpenSimDocument", Version=VERSION)
    return root, _add(root, tag, name)


def _add(parent: ET.Element, tag: str, name: str | None = None) -> ET.Element:
    return ET.SubElement(parent, tag, {} if name is None else {"name": name})


def _text(parent: ET.Element, **values: str) -> None:
    for tag, text in values.items():
        ET.SubElement(parent, tag).text = text


def _xml(root: ET.Element) -> str:
    ET.indent(root, "\t")
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"
