"""USD export: a UsdSkel skeleton with skinned body and animation.

Metres, Y up.  Time code k is row k of the track, `timeCodesPerSecond` the rate.  The body is invisible while the person is
lost.  Written by OpenUSD (package usd-core).
"""

import re
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdShade, UsdSkel, UsdUtils, Vt

from zenocap.common.atomic_write import write_atomically
from zenocap.common.errors import UserError
from zenocap.common.formats.animated_skeleton import AnimatedSkeleton

ROUGHNESS = 0.7  # of the skin; chosen by hand
SINGLE_RATE = 24.0  # time codes per second of a file with one row; OpenUSD's own default


def write_usd(path: Path, motion: AnimatedSkeleton, title: str) -> None:
    """Write .usda (text), .usdc and .usd (binary) or .usdz (package).  Raises OSError, UserError."""
    packed = path.suffix.lower() == ".usdz"
    with TemporaryDirectory() as folder:
        layer = Path(folder) / f"{identifier(title)}{'.usdc' if packed else path.suffix.lower()}"
        file = layer.with_suffix(".usdz") if packed else layer
        try:
            _save(layer, motion, title)
            written = not packed or UsdUtils.CreateNewUsdzPackage(str(layer), str(file))
        except Tf.ErrorException as error:
            raise UserError(f"{path}: OpenUSD: {str(error).strip().splitlines()[-1].strip()}") from error
        if not written:
            raise UserError(f"{path}: OpenUSD could not write the package")
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, file.read_bytes())


def identifier(title: str) -> str:
    """Name of a prim: letters, digits and underscores, no digit first."""
    name = re.sub(r"\W", "_", title, flags=re.ASCII)
    return name if re.match(r"[A-Za-z_]", name) else f"_{name}"


def _save(path: Path, motion: AnimatedSkeleton, title: str) -> None:
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(motion.rate or SINGLE_RATE)
    stage.SetFramesPerSecond(motion.rate or SINGLE_RATE)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(len(motion.frames) - 1)
    stage.GetRootLayer().documentation = f"zenocap {version('zenocap')}"
    place = f"/{identifier(title)}"
    root = UsdSkel.Root.Define(stage, place)
    stage.SetDefaultPrim(root.GetPrim())
    Usd.ModelAPI(root).SetKind("component")
    _visibility(root, motion)
    skeleton = _skeleton(stage, f"{place}/Skeleton", motion)
    animation = _animation(stage, f"{place}/Skeleton/Animation", motion)
    binding = UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    binding.CreateAnimationSourceRel().SetTargets([animation.GetPath()])
    mesh = _mesh(stage, f"{place}/Body", motion)
    UsdSkel.BindingAPI.Apply(mesh.GetPrim()).CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    _bounds(root, skeleton, motion)
    stage.GetRootLayer().Save()


def _visibility(root: UsdSkel.Root, motion: AnimatedSkeleton) -> None:
    """Hide the body while the person is lost."""
    if motion.known.all():
        return
    visibility, before = root.CreateVisibilityAttr(), None
    for row, known in enumerate(motion.known.tolist()):
        if known != before:
            visibility.Set(UsdGeom.Tokens.inherited if known else UsdGeom.Tokens.invisible, row)
            before = known


def _joints(motion: AnimatedSkeleton) -> list[str]:
    """Paths of the bones, such as Hips/Spine."""
    paths: list[str] = []
    for name, parent in zip(motion.names, motion.parents, strict=True):
        paths.append(name if parent < 0 else f"{paths[parent]}/{name}")
    return paths


def _skeleton(stage: Usd.Stage, place: str, motion: AnimatedSkeleton) -> UsdSkel.Skeleton:
    skeleton = UsdSkel.Skeleton.Define(stage, place)
    skeleton.CreateJointsAttr(_joints(motion))
    skeleton.CreateBindTransformsAttr(_translations(motion.places))
    skeleton.CreateRestTransformsAttr(_translations(motion.offsets))
    return skeleton


def _translations(places: NDArray[np.float64]) -> Vt.Matrix4dArray:
    return Vt.Matrix4dArray([Gf.Matrix4d(1.0).SetTranslate(Gf.Vec3d(*place)) for place in places.tolist()])


def _animation(stage: Usd.Stage, place: str, motion: AnimatedSkeleton) -> UsdSkel.Animation:
    animation = UsdSkel.Animation.Define(stage, place)
    animation.CreateJointsAttr(_joints(motion))
    bones = len(motion.names)
    animation.CreateScalesAttr(Vt.Vec3hArray([Gf.Vec3h(1.0)] * bones))
    translations, rotations = animation.CreateTranslationsAttr(), animation.CreateRotationsAttr()
    offsets = np.array(motion.offsets, dtype=np.float32)
    for row in range(len(motion.frames)):
        offsets[0] = motion.positions[row]
        translations.Set(Vt.Vec3fArray.FromNumpy(offsets), row)
        turns = [Gf.Quatf(w, x, y, z) for x, y, z, w in motion.rotations[row].tolist()]
        rotations.Set(Vt.QuatfArray(turns), row)
    return animation


def _mesh(stage: Usd.Stage, place: str, motion: AnimatedSkeleton) -> UsdGeom.Mesh:
    skin = motion.skin
    mesh = UsdGeom.Mesh.Define(stage, place)
    points = (skin.points + motion.offsets[0]).astype(np.float32)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    mesh.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.stack([points.min(axis=0), points.max(axis=0)])))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray([3] * len(skin.triangles)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(skin.triangles.reshape(-1)))
    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(skin.normals.astype(np.float32)))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateDoubleSidedAttr(True)
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateJointIndicesPrimvar(False, 1).Set(Vt.IntArray.FromNumpy(skin.bones.astype(np.int32)))
    binding.CreateJointWeightsPrimvar(False, 1).Set(Vt.FloatArray([1.0] * len(skin.points)))
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
    for material, (name, colour) in enumerate(zip(skin.names, skin.colours.tolist(), strict=True)):
        faces = np.flatnonzero(skin.materials == material)
        if not len(faces):
            continue
        subset = UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).CreateMaterialBindSubset(
            name, Vt.IntArray.FromNumpy(faces.astype(np.int32))
        )
        bound = UsdShade.MaterialBindingAPI.Apply(subset.GetPrim())
        bound.Bind(_material(stage, f"{mesh.GetPath().GetParentPath()}/Materials/{name}", colour))
    return mesh


def _material(stage: Usd.Stage, place: str, colour: list[float]) -> UsdShade.Material:
    UsdGeom.Scope.Define(stage, Sdf.Path(place).GetParentPath())
    material = UsdShade.Material.Define(stage, place)
    shader = UsdShade.Shader.Define(stage, f"{place}/Surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*colour))
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(ROUGHNESS)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    return material


def _bounds(root: UsdSkel.Root, skeleton: UsdSkel.Skeleton, motion: AnimatedSkeleton) -> None:
    """Extent of the whole motion, which viewers use to frame it and to leave out what is not seen."""
    chain = np.zeros(len(motion.names))  # length of the stretched skeleton from the root to each bone
    for bone in range(1, len(motion.names)):
        chain[bone] = chain[motion.parents[bone]] + np.linalg.norm(motion.offsets[bone])
    points = motion.skin.points + motion.offsets[0] - motion.places[motion.skin.bones]
    reach = float((chain[motion.skin.bones] + np.linalg.norm(points, axis=1)).max())
    low, high = motion.positions.min(axis=0) - reach, motion.positions.max(axis=0) + reach
    extent = Vt.Vec3fArray.FromNumpy(np.stack([low, high]).astype(np.float32))
    UsdGeom.Boundable(root.GetPrim()).CreateExtentAttr(extent)
    UsdGeom.Boundable(skeleton.GetPrim()).CreateExtentAttr(extent)
