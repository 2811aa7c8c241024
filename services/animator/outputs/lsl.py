"""LSL output: joint centres as a Lab Streaming Layer stream, to be recorded with other measurements.

45 channels: X, Y and Z of every joint centre, metres, right-handed, Y up; NaN while the person is lost.  Samples are
irregular (no nominal rate) and carry their capture time on LSL's clock.
"""

from collections import Counter
from collections.abc import Mapping
from importlib import import_module
from types import ModuleType
from typing import Protocol

import numpy as np

from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.bus.protocol import Envelope
from zenocap.common.errors import pip_install
from zenocap.common.rig.animator import LslTable
from zenocap.common.runtime.clock import Clock
from zenocap.services.animator.outputs.output import OutputError
from zenocap.services.animator.parameters import MAX_LSL_AGE_NS
from zenocap.services.animator.states import ActorPose

LOG_CONFIG = "[log]\nlevel = -2\n"  # of LSL's own log: fatal errors only
THIS_MACHINE_CONFIG = "[multicast]\nResolveScope = machine\nListenAddress = 127.0.0.1\n[ports]\nIPv6 = disable\n"


class Outlet(Protocol):
    """Outlet of pylsl, which has no types."""

    def push_sample(self, x: list[float], timestamp: float) -> None: ...


class LslOutput:
    """One outlet, opened with the first pose: its anatomy determines the channels."""

    def __init__(self, table: LslTable, rig: str, clock: Clock) -> None:
        """Load the library.  Raises OutputError when pylsl or the LSL library is missing."""
        try:
            self._lsl: ModuleType = import_module("pylsl")
        except (ImportError, RuntimeError) as error:
            raise OutputError(f"animator.lsl: needs pylsl: {pip_install('lsl')} ({error})") from error
        self._name = table.stream or rig
        self.title = f"animator.lsl {self._name}"
        self._rig, self._clock = rig, clock
        self._lsl.set_config_content(LOG_CONFIG + (THIS_MACHINE_CONFIG if table.reach == "machine" else ""))
        self._anatomy: Anatomy | None = None
        self.outlet: Outlet | None = None
        self._counts = Counter[str]()

    def receive(self, envelope: Envelope) -> None:
        pass

    def send(self, actor: ActorPose, posture: str | None) -> None:
        outlet = self.outlet
        if outlet is None or self._anatomy is not actor.anatomy:
            outlet = self.outlet = self._lsl.StreamOutlet(self._info(actor.anatomy))
            self._anatomy = actor.anatomy
        if "person" in actor.lost:
            sample = np.full(3 * len(actor.anatomy.markers), np.nan)
        else:
            sample = joint_centres(actor.anatomy, actor.body, actor.pose).ravel()
        age_ns = self._clock.now_ns() - actor.captured_ns
        age_s = age_ns / 1e9 if 0 <= age_ns <= MAX_LSL_AGE_NS else 0.0
        outlet.push_sample(sample.tolist(), self._lsl.local_clock() - age_s)
        self._counts["sent"] += 1

    def counts(self) -> Mapping[str, int]:
        return self._counts

    def close(self) -> None:
        self.outlet = None  # LSL closes an outlet without references

    def _info(self, anatomy: Anatomy) -> object:
        """Return the stream's description in the terms of LSL's motion capture metadata."""
        markers = [marker.name for marker in anatomy.markers]
        source = f"zenocap-{self._rig}-{anatomy.name}"  # receivers recover the stream by it after a restart
        info = self._lsl.StreamInfo(self._name, "MoCap", 3 * len(markers), 0.0, "float32", source)
        description = info.desc()
        channels = description.append_child("channels")
        for marker in markers:
            for axis in "XYZ":
                channel = channels.append_child("channel")
                channel.append_child_value("label", f"{marker}_{axis}")
                channel.append_child_value("marker", marker)
                channel.append_child_value("type", f"Position{axis}")
                channel.append_child_value("unit", "meters")
        setup = description.append_child("setup")
        setup.append_child_value("anatomy", anatomy.name)
        setup.append_child_value("axes", "right-handed, Y up, origin on the ground")
        description.append_child("acquisition").append_child_value("model", "zenocap")
        return info
