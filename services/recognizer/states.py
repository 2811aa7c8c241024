"""What the recogniser is set up with, and what it knows between two events."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal

from common.body.anatomy import Anatomy
from common.messages import Posture
from services.recognizer.stream import Plan, Stream

Source = Literal["integrator", "tracker"]


@dataclass(frozen=True, eq=False)
class Setup:
    """plan: of the model.  source: whose poses are listened to.  anatomy: of these poses."""

    plan: Plan
    source: Source
    anatomy: Anatomy


@dataclass(frozen=True, eq=False)
class State:
    """lost: whether the person was, at the last pose.  last: the newest posture that was said."""

    stream: Stream
    lost: bool = False
    last: Posture | None = None
    counts: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
