"""glTF 2.0 export (.glb): skeleton, skinned body, animation.

The animation is also a VRM animation (extension VRMC_vrm_animation 1.0: which node is which bone of a humanoid), so the
same file named .vrma moves VRM avatars.  Written by pygltflib.
"""

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pygltflib as gltf
from numpy.typing import NDArray

from zenocap.common.arrays import Floats
from zenocap.common.atomic_write import write_atomically
from zenocap.common.formats.animated_skeleton import AnimatedSkeleton

VRM_ANIMATION = "VRMC_vrm_animation"
TYPES = {1: gltf.SCALAR, 3: gltf.VEC3, 4: gltf.VEC4, 16: gltf.MAT4}
COMPONENTS = {"f": gltf.FLOAT, "B": gltf.UNSIGNED_BYTE, "I": gltf.UNSIGNED_INT}
ROUGHNESS = 0.7  # of the skin; chosen by hand


class _Buffer:
    """The one buffer of a file: arrays one after the other, each with its accessor."""

    def __init__(self) -> None:
        self.content = bytearray()
        self.views: list[gltf.BufferView] = []
        self.accessors: list[gltf.Accessor] = []

    def add(self, values: NDArray[np.generic], target: int | None = None, bounds: bool = False) -> int:
        """Append an array (n,) or (n, components); return the index of its accessor.  bounds: with its range."""
        array = np.ascontiguousarray(values)
        columns = array.reshape(len(array), -1)
        self.views.append(gltf.BufferView(buffer=0, byteOffset=len(self.content), byteLength=array.nbytes, target=target))
        accessor = gltf.Accessor(
            bufferView=len(self.views) - 1,
            componentType=COMPONENTS[array.dtype.char],
            count=len(array),
            type=TYPES[columns.shape[1]],
        )
        if bounds:
            accessor.min, accessor.max = columns.min(axis=0).tolist(), columns.max(axis=0).tolist()
        self.accessors.append(accessor)
        self.content += array.tobytes()
        self.content += bytes(-len(self.content) % 4)
        return len(self.accessors) - 1


def write_glb(path: Path, motion: AnimatedSkeleton, title: str) -> None:
    """Write one animation of the name `title`, linear between the rows.  Raises OSError."""
    buffer = _Buffer()
    bones = len(motion.names)
    file = gltf.GLTF2(
        asset=gltf.Asset(version="2.0", generator=f"zenocap {version('zenocap')}"),
        scene=0,
        scenes=[gltf.Scene(name=title, nodes=[0, bones])],
        nodes=[*_bones(motion), gltf.Node(name="Body", mesh=0, skin=0)],
        meshes=[gltf.Mesh(name="Body", primitives=_primitives(motion, buffer))],
        materials=_materials(motion),
        skins=[
            gltf.Skin(name="Skeleton", joints=list(range(bones)), skeleton=0, inverseBindMatrices=_binding(motion, buffer))
        ],
        animations=[_animation(motion, buffer, title)],
        extensionsUsed=[VRM_ANIMATION],
        extensions={VRM_ANIMATION: _humanoid(motion.humanoid)},
    )
    file.bufferViews, file.accessors = buffer.views, buffer.accessors
    file.buffers = [gltf.Buffer(byteLength=len(buffer.content))]
    file.set_binary_blob(bytes(buffer.content))
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, b"".join(file.save_to_bytes()))


def _bones(motion: AnimatedSkeleton) -> list[gltf.Node]:
    children = [
        [child for child, parent in enumerate(motion.parents) if parent == bone] for bone in range(len(motion.names))
    ]
    return [
        gltf.Node(name=name, translation=motion.offsets[bone].tolist(), children=children[bone])
        for bone, name in enumerate(motion.names)
    ]


def _binding(motion: AnimatedSkeleton, buffer: _Buffer) -> int:
    """Accessor of the inverse bind matrices, by columns: translations, because bones rest in the axes of the world."""
    matrices = np.tile(np.eye(4, dtype=np.float32), (len(motion.names), 1, 1))
    matrices[:, 3, :3] = -motion.places
    return buffer.add(matrices.reshape(-1, 16))


def _primitives(motion: AnimatedSkeleton, buffer: _Buffer) -> list[gltf.Primitive]:
    skin = motion.skin
    joints, weights = np.zeros((len(skin.points), 4), dtype=np.uint8), np.zeros((len(skin.points), 4), dtype=np.float32)
    joints[:, 0], weights[:, 0] = skin.bones, 1.0
    attributes = gltf.Attributes(
        POSITION=buffer.add(_single(skin.points + motion.offsets[0]), gltf.ARRAY_BUFFER, bounds=True),
        NORMAL=buffer.add(_single(skin.normals), gltf.ARRAY_BUFFER),
        JOINTS_0=buffer.add(joints, gltf.ARRAY_BUFFER),
        WEIGHTS_0=buffer.add(weights, gltf.ARRAY_BUFFER),
    )
    found = []
    for material in range(len(skin.names)):
        rows = skin.triangles[skin.materials == material]
        if len(rows):
            indices = buffer.add(rows.astype(np.uint32).reshape(-1), gltf.ELEMENT_ARRAY_BUFFER)
            found.append(gltf.Primitive(attributes=attributes, indices=indices, material=material))
    return found


def _materials(motion: AnimatedSkeleton) -> list[gltf.Material]:
    return [
        gltf.Material(
            name=name,
            alphaCutoff=None,
            doubleSided=True,
            pbrMetallicRoughness=gltf.PbrMetallicRoughness(
                baseColorFactor=[*colour.tolist(), 1.0], metallicFactor=0.0, roughnessFactor=ROUGHNESS
            ),
        )
        for name, colour in zip(motion.skin.names, motion.skin.colours, strict=True)
    ]


def _animation(motion: AnimatedSkeleton, buffer: _Buffer, title: str) -> gltf.Animation:
    times = buffer.add(_single(motion.times_s), bounds=True)
    outputs = [(0, "translation", motion.positions)]
    outputs += [(bone, "rotation", motion.rotations[:, bone]) for bone in np.flatnonzero(motion.moving).tolist()]
    samplers, channels = [], []
    for node, path, values in outputs:
        samplers.append(
            gltf.AnimationSampler(input=times, output=buffer.add(_single(values)), interpolation=gltf.ANIM_LINEAR)
        )
        target = gltf.AnimationChannelTarget(node=node, path=path)
        channels.append(gltf.AnimationChannel(sampler=len(samplers) - 1, target=target))
    return gltf.Animation(name=title, samplers=samplers, channels=channels)


def _humanoid(names: Sequence[str]) -> dict[str, object]:
    return {"specVersion": "1.0", "humanoid": {"humanBones": {name: {"node": node} for node, name in enumerate(names)}}}


def _single(values: Floats) -> NDArray[np.float32]:
    return np.asarray(values, dtype=np.float32)
