"""Exported motions read by programs of others, without code of this project.

Each reader returns times (n,) in seconds of the file, and by name what the file holds of the motion: `Hip` and `RWrist`,
joint centres (n, 3) in metres with Y up, and `elbow`, the flexion (n,) of the right elbow in degrees.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from zenocap.common.arrays import Floats

Motion = tuple[Floats, dict[str, Floats]]
DTYPES = {5126: "<f4"}  # component types of glTF that animations of ours have


def read_glb(path: Path) -> Motion:
    """By pygltflib; poses of the nodes by the rules of glTF 2.0, section 3.11."""
    pygltflib = pytest.importorskip("pygltflib", reason="pygltflib is not installed")
    from scipy.spatial.transform import Rotation

    file = pygltflib.GLTF2().load(str(path))

    def values(accessor: int) -> Floats:
        one = file.accessors[accessor]
        view = file.bufferViews[one.bufferView]
        columns = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[one.type]
        start = (view.byteOffset or 0) + (one.byteOffset or 0)
        read = np.frombuffer(file.binary_blob(), DTYPES[one.componentType], one.count * columns, start)
        return read.reshape(one.count, columns).astype(np.float64)

    (animation,) = file.animations
    moving = {(one.target.node, one.target.path): animation.samplers[one.sampler] for one in animation.channels}
    times_s = values(next(iter(moving.values())).input)[:, 0]
    parents = {child: k for k, node in enumerate(file.nodes) for child in node.children or ()}

    def local(node: int, path: str, at_rest: list[float]) -> Floats:
        if (node, path) in moving:
            return values(moving[node, path].output)
        return np.tile(getattr(file.nodes[node], path) or at_rest, (len(times_s), 1))

    def place(name: str) -> Floats:
        node = next(k for k, one in enumerate(file.nodes) if one.name == name)
        point = np.zeros((len(times_s), 3))
        at: int | None = node
        while at is not None:
            turned = Rotation.from_quat(local(at, "rotation", [0.0, 0.0, 0.0, 1.0])).apply(point)
            point = turned + local(at, "translation", [0.0, 0.0, 0.0])
            at = parents.get(at)
        return point

    return times_s, {"Hip": place("Hips"), "RWrist": place("RightHand")}


def read_usd(path: Path) -> Motion:
    """By OpenUSD, which computes the poses of the joints itself."""
    pytest.importorskip("pxr", reason="usd-core is not installed: the extra usd")
    from pxr import Usd, UsdGeom, UsdSkel

    stage = Usd.Stage.Open(str(path))
    assert (UsdGeom.GetStageUpAxis(stage), UsdGeom.GetStageMetersPerUnit(stage)) == ("Y", 1.0)
    root = next(UsdSkel.Root(prim) for prim in stage.Traverse() if prim.IsA(UsdSkel.Root))
    cache = UsdSkel.Cache()
    cache.Populate(root, Usd.PrimDefaultPredicate)
    skeleton = cache.GetSkelQuery(next(UsdSkel.Skeleton(prim) for prim in stage.Traverse() if prim.IsA(UsdSkel.Skeleton)))
    names = [name.rpartition("/")[2] for name in skeleton.GetJointOrder()]
    codes = skeleton.GetAnimQuery().GetJointTransformTimeSamples()
    places = np.array([skeleton.ComputeJointSkelTransforms(Usd.TimeCode(code)) for code in codes])[:, :, 3, :3]
    times_s = np.array(codes) / stage.GetTimeCodesPerSecond()
    return times_s, {"Hip": places[:, names.index("Hips")], "RWrist": places[:, names.index("RightHand")]}


def read_c3d(path: Path) -> Motion:
    ezc3d = pytest.importorskip("ezc3d", reason="ezc3d is not installed")
    file = ezc3d.c3d(str(path))
    assert file["parameters"]["POINT"]["UNITS"]["value"] == ["mm"]
    header, labels = file["header"]["points"], file["parameters"]["POINT"]["LABELS"]["value"]
    points = file["data"]["points"][:3].transpose(2, 1, 0) / 1000
    times_s = (header["first_frame"] + np.arange(len(points))) / header["frame_rate"]
    return times_s, {name: points[:, labels.index(name)] for name in ("Hip", "RWrist")}


def read_mot(path: Path) -> Motion:
    """By OpenSim where it is installed, otherwise by pandas: a table below the line endheader."""
    try:
        import opensim
    except ImportError:
        pandas = pytest.importorskip("pandas", reason="neither opensim nor pandas is installed")
        lines = path.read_text("ascii").splitlines()
        header = lines.index("endheader")
        assert {"nRows=61", "inDegrees=yes"} <= set(lines[:header])
        table = pandas.read_csv(path, sep="\t", skiprows=header + 1)
        times_s, columns = table.pop("time").to_numpy(), {name: table[name].to_numpy() for name in table}
    else:
        storage = opensim.TimeSeriesTable(str(path))
        times_s = np.array(storage.getIndependentColumn())
        columns = {name: storage.getDependentColumn(name).to_numpy() for name in storage.getColumnLabels()}
    hip = np.stack([columns[f"pelvis_t{axis}"] for axis in "xyz"], axis=1)
    return times_s, {"Hip": hip, "elbow": columns["elbow_flex_r"]}


def read_parquet(path: Path) -> Motion:
    pandas = pytest.importorskip("pandas", reason="pandas is not installed")
    pytest.importorskip("pyarrow", reason="pyarrow is not installed: the extra tables")
    table = pandas.read_parquet(path)
    places = {name: table[[f"{name}.{axis}_m" for axis in "xyz"]].to_numpy() for name in ("Hip", "RWrist")}
    return table["time_s"].to_numpy(), places


READERS: dict[str, tuple[str, Callable[[Path], Motion]]] = {  # by the page's format: suffix, reader
    "glb": (".glb", read_glb), "usd": (".usdc", read_usd), "c3d": (".c3d", read_c3d), "mot": (".mot", read_mot),
    "parquet": (".parquet", read_parquet),
}  # fmt: skip
