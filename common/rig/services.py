"""The table of services: one row per kind of process of a rig, or of a machine.

Launcher, doctor, monitor, page, certificates, `zenocap health`, verification and warm-up derive from it.  The folder of a
service below `services/` has its name, and so has its command, where its row names no other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeAlias

from zenocap.common.rig.methods import method_of

if TYPE_CHECKING:  # keeps `--help` of the command line, which imports this module, fast
    from zenocap.common.rig.rig import Rig

MAIN = "main"  # id of a service that a rig runs once
ServiceKey: TypeAlias = tuple[str, str]  # name and id, such as ("viewer", "1") and ("integrator", "main")


class _HasId(Protocol):
    @property
    def id(self) -> str: ...


class RigLike(Protocol):
    """The fields of a rig that determine its services: of a `Rig`, or of the `RecordedRig` of a take."""

    @property
    def viewers(self) -> Sequence[_HasId]: ...

    @property
    def method(self) -> str: ...

    @property
    def recognizer(self) -> object | None: ...


@dataclass(frozen=True)
class ServiceKind:
    """ids: ids that a rig runs; empty when it runs none.  of_rig: False for what serves a machine, without a rig file.

    required: whether the rig stops when it fails.  makes_poses: whether poses depend on it: compiled before the rig starts.
    recomputed: whether a take of the rig holds all its inputs, so that `zenocap verify` recomputes its messages.
    warmup: the parts of `zenocap warmup` that it needs, in order.
    files: files that it reads besides the rig file and the calibration, with titles.
    command: of the command line, where it has another name.
    """

    name: str
    ids: Callable[[RigLike], tuple[str, ...]]
    recomputed: Callable[[RigLike], bool]
    required: bool = True
    makes_poses: bool = True
    warmup: Callable[[Rig], tuple[str, ...]] = lambda rig: ()
    files: Callable[[Rig], tuple[tuple[str, Path], ...]] = lambda rig: ()
    of_rig: bool = True
    command: str = ""


def _always(rig: RigLike) -> tuple[str, ...]:
    return (MAIN,)


def _viewer_warmup(rig: Rig) -> tuple[str, ...]:
    actor = ("actor",) if any(viewer.is_synthetic for viewer in rig.viewers) else ()
    return ("silhouettes", *actor, *method_of(rig.method).viewer_warmup)


def _pose_warmup(service: str) -> Callable[[Rig], tuple[str, ...]]:
    """Parts that a service needs where it publishes the poses."""

    def parts(rig: Rig) -> tuple[str, ...]:
        method = method_of(rig.method)
        return method.pose_warmup if method.pose_service == service else ()

    return parts


def _pose_recomputed(service: str) -> Callable[[RigLike], bool]:
    """Whether a service can be recomputed: also as one of a method whose poses come from another."""

    def recomputed(rig: RigLike) -> bool:
        method = method_of(rig.method)
        return method.pose_service != service or method.recomputes_pose

    return recomputed


def _prior(rig: Rig) -> tuple[tuple[str, Path], ...]:
    return () if rig.tracker is None or rig.tracker.prior is None else (("motion prior", rig.tracker.prior),)


def _recognizer_files(rig: Rig) -> tuple[tuple[str, Path], ...]:
    """Posture model, and the programs that commands start."""
    if rig.recognizer is None:
        return ()
    programs = (one.action.target for one in rig.recognizer.commands if one.kind == "program")
    return (("postures", rig.recognizer.model), *(("program", Path(path)) for path in dict.fromkeys(programs)))


SERVICES: tuple[ServiceKind, ...] = (
    ServiceKind(
        "viewer",
        lambda rig: tuple(viewer.id for viewer in rig.viewers),
        lambda rig: method_of(rig.method).recomputes_viewers,
        warmup=_viewer_warmup,
    ),
    ServiceKind("integrator", _always, _pose_recomputed("integrator"), warmup=_pose_warmup("integrator")),
    ServiceKind(
        "tracker",
        lambda rig: (MAIN,) if method_of(rig.method).has_tracker else (),
        _pose_recomputed("tracker"),
        warmup=_pose_warmup("tracker"),
        files=_prior,
    ),
    ServiceKind(
        "recognizer",
        lambda rig: () if rig.recognizer is None else (MAIN,),
        lambda rig: True,
        makes_poses=False,
        warmup=lambda rig: ("recognizer",),
        files=_recognizer_files,
    ),
    ServiceKind("animator", _always, lambda rig: False, required=False, makes_poses=False),
    ServiceKind(
        "camera", lambda rig: (), lambda rig: False, required=False, makes_poses=False, of_rig=False,
        command="viewer --discover",
    ),
)  # fmt: skip
OF_RIGS = tuple(kind.name for kind in SERVICES if kind.of_rig)
TIMEKEEPER = "integrator"  # provides the clock and the log: started first and stopped last
ORDER = {kind.name: number for number, kind in enumerate(SERVICES)}


def kinds_of(rig: RigLike) -> tuple[ServiceKind, ...]:
    """The kinds of service that a rig runs, in the order of the table."""
    return tuple(kind for kind in SERVICES if kind.ids(rig))


def services_of(rig: RigLike, *, required: bool = False) -> tuple[ServiceKey, ...]:
    """The services that a rig runs, in the order of the table.  required: only those that it needs."""
    return tuple((kind.name, id) for kind in SERVICES if kind.required or not required for id in kind.ids(rig))


def warmup_parts(rig: Rig) -> tuple[str, ...]:
    """The parts of `zenocap warmup` that the first pose of a rig needs; other services compile when they start."""
    kinds = [kind for kind in kinds_of(rig) if kind.makes_poses]
    return tuple(dict.fromkeys(part for kind in kinds for part in kind.warmup(rig)))


def file_name(service: ServiceKey) -> str:
    """Name of a service in files and options: viewer-1, integrator."""
    name, id = service
    return name if id == MAIN else f"{name}-{id}"


def title(service: ServiceKey) -> str:
    """Name of a service for people: viewer 1, integrator."""
    name, id = service
    return name if id == MAIN else f"{name} {id}"


def sort_key(service: ServiceKey) -> tuple[int, str, int, str]:
    """Sort key: order of the table, then number: viewer 2 before viewer 10."""
    name, id = service
    return ORDER.get(name, len(ORDER)), name, int(id) if id.isdecimal() else 0, id
