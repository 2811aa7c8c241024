"""Generic models of OpenSim (.osim): which bodies they have, and where their joint centres are.

Read with the standard library, from files of OpenSim 4.  A joint's centre is the origin of its child frame, which is
usually, and not always, the origin of the child body.
"""

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.errors import UserError
from zenocap.common.formats.text_file import read_text

MIN_VERSION = 40000  # of OpenSimDocument: files of OpenSim 3 have joints inside of bodies
MAX_BYTES = 100 << 20  # of a file that is read; chosen by hand, models have 0.1 to 5 MB
BODYSET = "/bodyset/"


@dataclass(frozen=True)
class OpenSimModel:
    """name: of the model.  bodies: their names.

    centres: by child body, (3,) metres in its frame, centre of its joint.  parents: by child body, name of the parent body
    and centre (3,) metres in the parent's frame.  Frames of the models named in `opensim_setup` have X to the front, Y up,
    Z to the right.
    """

    name: str
    bodies: frozenset[str]
    centres: Mapping[str, Floats]
    parents: Mapping[str, tuple[str, Floats]]


def read_model(path: Path) -> OpenSimModel:
    """Bodies and joint centres of a model.  Raises UserError."""
    text = read_text(path, "an .osim file", MAX_BYTES)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:  # no model has them; the parser would expand entities
        raise UserError(f"{path}: has a document type: allowed: an .osim file of OpenSim")
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        raise UserError(f"{path}: not an .osim file: {error}") from error
    model = root.find("Model")
    if root.tag != "OpenSimDocument" or model is None:
        raise UserError(f"{path}: no Model in an OpenSimDocument: allowed: an .osim file of OpenSim")
    version = root.get("Version", "")
    if not version.isdigit() or int(version) < MIN_VERSION:
        raise UserError(f"{path}: Version = {version!r}: allowed: {MIN_VERSION} or more; open and save it in OpenSim 4")
    bodies = frozenset(body.get("name", "") for body in model.iterfind("BodySet/objects/Body"))
    centres: dict[str, Floats] = {}
    parents: dict[str, tuple[str, Floats]] = {}
    for joint in model.iterfind("JointSet/objects/*"):
        child, centre = _frame(path, joint, "socket_child_frame")
        if child in bodies:
            centres[child] = centre
            parents[child] = _frame(path, joint, "socket_parent_frame")
    return OpenSimModel(model.get("name", path.stem), bodies, centres, parents)


def _frame(path: Path, joint: ET.Element, socket: str) -> tuple[str, Floats]:
    """Body of a joint's frame, and the frame's origin (3,) in the body, metres."""
    name = (joint.findtext(socket) or "").strip()
    for frame in joint.iterfind("frames/PhysicalOffsetFrame"):
        if frame.get("name") == name.rpartition("/")[2]:
            words = (frame.findtext("translation") or "0 0 0").split()
            try:
                origin = np.array([float(word) for word in words])
            except ValueError:
                origin = np.empty(0)
            if origin.shape != (3,) or not np.isfinite(origin).all():
                where = f"joint {joint.get('name')}, frame {name}"
                raise UserError(f"{path}: {where}: translation = {' '.join(words)[:40]!r}: allowed: three numbers")
            return (frame.findtext("socket_parent") or "").strip().rpartition("/")[2], origin
    return name.rpartition("/")[2], np.zeros(3)
