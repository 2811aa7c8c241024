"""The processes of a load: router, integrators, trackers, viewers or their stand-ins, subscribers."""

import sys
import time
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

from zenocap.common.bus.zenoh_session import HOST, ZenohOptions, free_ports
from zenocap.common.rig.services import MAIN
from zenocap.tools.measure.load_plan import Plan
from zenocap.tools.measure.resources import ProcessKey, title
from zenocap.tools.record.launcher.child_processes import ChildProcesses, Spawn, spawn
from zenocap.tools.record.launcher.fork_server import fork_server
from zenocap.tools.record.launcher.peer_mesh import peer_mesh
from zenocap.tools.service_arguments import ServiceArguments, ZenohArguments, arguments_of, words

MANY = 8  # processes, from which loading their compiled functions once takes less time than in each; measured
ROUTER = ("", "router", MAIN)


@dataclass(frozen=True)
class ProcessSpec:
    """One process: service, rig, and command without the options of its network."""

    rig: str
    service: str
    id: str
    command: tuple[str, ...]

    @property
    def title(self) -> str:
        return title(self.key)

    @property
    def key(self) -> ProcessKey:
        return self.rig, self.service, self.id


@dataclass(frozen=True)
class LoadNetwork:
    """connect: endpoints of a running router; empty for an own one.  config: a Zenoh configuration."""

    connect: tuple[str, ...] = ()
    config: Path | None = None


@dataclass(frozen=True)
class Deployment:
    """Rig files of a plan, and the network of its services.  takes: temporary folder of the takes."""

    rigs: tuple[Path, ...]
    takes: Path
    network: LoadNetwork


class LoadProcesses:
    """All processes of a load: a mesh, or clients of the deployment's network or of a router of their own.

    own: session options of the measuring process.
    """

    def __init__(self, plan: Plan, deployment: Deployment, epoch_ns: int) -> None:
        connect, config = deployment.network.connect, deployment.network.config
        named = zip(plan.rig_names, deployment.rigs, strict=True)
        specs = [spec for name, path in named for spec in _specs(plan, name, path, deployment.takes)]
        router: list[ProcessSpec] = []
        if plan.mesh:
            mesh = peer_mesh(free_ports(len(specs) + 1))
            places = [ZenohOptions("peer", one.connect, (one.listen,), config, multicast_scouting=False) for one in mesh]
        else:
            if not connect:
                connect = (f"tcp/{HOST}:{free_ports(1)[0]}",)
                network = ZenohArguments(listen=[connect[0]], config=config, no_multicast_scouting=True)
                router = [ProcessSpec(*ROUTER, tuple(words(ROUTER[1:], None, network)))]
            client = ZenohOptions("client", connect, config_file=config, multicast_scouting=False)
            places = [client] * (len(specs) + 1)
        self.own = places[-1]
        self._server = ExitStack()
        many = not plan.stand_ins and len(specs) >= MANY
        self._parts = ("silhouettes", *(() if plan.has_tracker else ("tracking",))) if many else ()
        self._spawn: Spawn = spawn
        self._children = ChildProcesses(
            [(spec.title, spec.command) for spec in router]
            + [(spec.title, _started(spec, epoch_ns, place)) for spec, place in zip(specs, places[:-1], strict=True)],
            time.monotonic,
            lambda arguments: self._spawn(arguments),
        )
        self.specs = {spec.title: spec for spec in (*router, *specs)}

    def start(self) -> None:
        services = {spec.service for spec in self.specs.values() if spec.command[3] == "zenocap"}
        self._spawn = self._server.enter_context(fork_server(services - {"router"}, self._parts))
        self._children.start()

    def poll(self) -> None:
        """Restart processes that ended."""
        self._children.poll()

    def pids(self) -> dict[ProcessKey, int]:
        """Process ids of the running processes."""
        running = ((self.specs[child.name].key, child.process) for child in self._children.all)
        return {key: process.pid for key, process in running if process is not None}

    @property
    def failed(self) -> list[str]:
        """Titles of the processes that are no longer restarted."""
        return [child.name for child in self._children.given_up]

    def lines(self) -> list[str]:
        """Output since the last call."""
        return self._children.lines()

    def kill(self, title: str) -> None:
        """Kill a process; `poll` restarts it.  Raises KeyError."""
        child = {child.name: child for child in self._children.all}[title]
        if child.process is not None:
            child.process.kill()

    def stop(self) -> None:
        self._children.stop(lambda title: self.specs[title].service != "router")
        self._children.stop()
        self._server.close()


def _specs(plan: Plan, name: str, path: Path, takes: Path) -> list[ProcessSpec]:
    specs: list[ProcessSpec] = []
    member = (sys.executable, "-P", "-m", "zenocap.tools.measure.stand_in")

    def add(service: str, id: str, *own: str) -> None:
        command = words((service, id), path, ServiceArguments(with_parent=True), *own)
        specs.append(ProcessSpec(name, service, id, tuple(command)))

    if plan.part != "viewers":
        add("integrator", MAIN, *(("--output", str(takes / f"{name}.mcap")) if plan.log else ("--no-log",)))
        if plan.has_tracker:
            add("tracker", MAIN)
    if plan.part != "integrators":
        for id in plan.views:
            if plan.stand_ins:
                specs.append(ProcessSpec(name, "viewer", id, (*member, "stand-in", str(path), "--id", id)))
            else:
                add("viewer", id)
        for number in range(1, plan.subscribers + 1):
            command = (*member, "subscriber", str(path), "--id", str(number), "--priority", plan.subscriber_priority)
            specs.append(ProcessSpec(name, "subscriber", str(number), command))
    return specs


def _started(spec: ProcessSpec, epoch_ns: int, place: ZenohOptions) -> list[str]:
    epoch = ["--epoch-ns", str(epoch_ns)] if spec.service == "viewer" else []
    return [*spec.command, *epoch, *replace(arguments_of(place), with_parent=False).words()]
