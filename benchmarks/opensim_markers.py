"""Residual of OpenSim's inverse kinematics on an exported TRC file, with Pose2Sim's model, markers and scaling.

    python -m benchmarks.opensim_markers walk.trc POSE2SIM/Pose2Sim/OpenSim_Setup [--every 5]

Needs OpenSim (`pip install opensim`) and a checkout of Pose2Sim.  The TRC file has `--axes opensim` and metres.  The
model is scaled by the distances of the markers in the first frames, as Pose2Sim does it; its markers keep their places.
"""

import argparse
import shutil
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import opensim

MODEL, MARKERS = "Model_Pose2Sim_simple.osim", "Markers_Halpe26.xml"
SCALING = "Scaling_Setup_Pose2Sim_Halpe26.xml"
SCALED_ROWS = 5  # of the file, whose marker distances scale the model
WEIGHTS = {"Nose": 0.1, "Head": 0.1, "Neck": 0.2, "LShoulder": 2.0, "RShoulder": 2.0, "LHip": 2.0, "RHip": 2.0}


def with_markers(setup: Path, folder: Path) -> Path:
    """Pose2Sim's model with its markers of HALPE-26, as a file in `folder`."""
    model = ET.parse(setup / MODEL)
    kept = model.getroot().find("Model/MarkerSet/objects")
    found = ET.parse(setup / MARKERS).getroot().find("MarkerSet/objects")
    assert kept is not None
    assert found is not None
    for marker in list(kept):
        kept.remove(marker)
    kept.extend(found)
    model.write(folder / "model.osim")
    return folder / "model.osim"


def scaled(trc: Path, labels: set[str], times: list[float], setup: Path, folder: Path) -> Path:
    """Pose2Sim's model, scaled to the markers of the file; segments without a pair of its markers keep their size."""
    with_markers(setup, folder)
    tree = ET.parse(setup / SCALING)
    values = {
        "model_file": "model.osim", "marker_set_file": "Unassigned", "marker_file": "markers.trc",
        "time_range": f"{times[0]} {times[min(SCALED_ROWS, len(times) - 1)]}", "output_model_file": "scaled.osim",
    }  # fmt: skip
    for tag, text in values.items():
        for element in tree.getroot().iter(tag):
            element.text = text
    for pairs in tree.getroot().iterfind(".//MarkerPairSet/objects"):
        for pair in list(pairs):
            if not set((pair.findtext("markers") or "").split()) <= labels:
                pairs.remove(pair)
    for measures in tree.getroot().iterfind(".//MeasurementSet/objects"):
        for measure in list(measures):
            if measure.find(".//MarkerPair") is None:
                measures.remove(measure)
    for apply in tree.getroot().iterfind(".//MarkerPlacer/apply"):
        apply.text = "false"
    tree.write(folder / "scaling.xml")
    shutil.copy(trc, folder / "markers.trc")  # paths are relative to the set-up
    opensim.ScaleTool(str(folder / "scaling.xml")).run()
    return folder / "scaled.osim"


def residuals(trc: Path, model_file: Path, every: int) -> dict[str, list[float]]:
    """Distance of every marker from its place on the model in each `every`th row, mm."""
    table = opensim.TimeSeriesTableVec3(str(trc))
    model = opensim.Model(str(model_file))
    state = model.initSystem()
    weights = opensim.SetMarkerWeights()
    for name in table.getColumnLabels():
        weights.cloneAndAppend(opensim.MarkerWeight(name, WEIGHTS.get(name, 1.0)))
    reference = opensim.MarkersReference(table, weights)
    solver = opensim.InverseKinematicsSolver(model, reference, opensim.SimTKArrayCoordinateReference(), float("inf"))
    found: dict[str, list[float]] = {}
    for row, time_s in enumerate(table.getIndependentColumn()[::every]):
        state.setTime(time_s)
        if row:
            solver.track(state)
        else:
            solver.assemble(state)
        for index in range(solver.getNumMarkersInUse()):
            name = solver.getMarkerNameForIndex(index)
            found.setdefault(name, []).append(1e3 * solver.computeCurrentMarkerError(name))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("trc", type=Path)
    parser.add_argument("setup", type=Path, help="Pose2Sim's folder OpenSim_Setup")
    parser.add_argument("--every", type=int, default=5)
    options = parser.parse_args()
    opensim.Logger.setLevelString("Error")
    opensim.Logger.removeFileSink()
    table = opensim.TimeSeriesTableVec3(str(options.trc))
    with tempfile.TemporaryDirectory() as place:
        times, labels = list(table.getIndependentColumn()), set(table.getColumnLabels())
        model = scaled(options.trc, labels, times, options.setup, Path(place))
        found = residuals(options.trc, model, options.every)
    every = np.concatenate(list(found.values()))
    print(f"{len(found)} markers used, {len(every)} residuals, RMS {np.sqrt(np.mean(every**2)):.1f} mm")
    print("mean mm  " + "  ".join(f"{name} {np.mean(values):.0f}" for name, values in found.items()))


if __name__ == "__main__":
    main()
