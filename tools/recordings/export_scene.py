"""Body, skeleton and animation of a take as glTF and USD."""

from pathlib import Path

from zenocap.common.formats.animated_skeleton import AnimatedSkeleton, animated_skeleton
from zenocap.common.formats.export_format import ExportRequest
from zenocap.services.animator.render.skin import skin_of


def export_glb(path: Path, request: ExportRequest) -> None:
    """For `zenocap export`."""
    from zenocap.common.formats.gltf import write_glb

    write_glb(path, _motion(request), path.stem)


def export_usd(path: Path, request: ExportRequest) -> None:
    """For `zenocap export`."""
    from zenocap.common.formats.usd import write_usd

    write_usd(path, _motion(request), path.stem)


def _motion(request: ExportRequest) -> AnimatedSkeleton:
    return animated_skeleton(request.track, skin_of(request.track.anatomy, request.track.bdp), request.bones)
