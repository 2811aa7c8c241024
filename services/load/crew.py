"""The processes of a load: router, integrators, trackers, viewers or their stand-ins, subscribers."""

import sys
import time
from dataclasses import dataclass
from pathlib import Path

from common.bus.zenoh_session import ZenohOptions
from services.launcher.children import Child, Children
from services.launcher.mesh import HOST, free_ports, mesh
from services.load.plan import Plan

ROUTER = ("", "router", "main")


@dataclass(frozen=True)
class Post:
    """One process: which service of which rig, and how it is started, without Zenoh's options."""

    rig: str
    service: str
    id: str
    command: tuple[str, ...]

    @property
    def title(self) -> str:
        return " ".join(word for word in (self.rig, self.service, self.id) if word and word != "main")

    @property
    def who(self) -> tuple[str, str, str]:
        return self.rig, self.service, self.id


class Crew:
    """connect, config: of a network that is running; else a router of its own, or a mesh.  own: how to join as one more."""

    def __init__(
        self, plan: Plan, rigs: tuple[Path, ...], takes: Path, epoch_ns: int, connect: tuple[str, ...], config: Path | None
    ) -> None:
        posts = [post for name, path in zip(plan.rig_names, rigs, strict=True) for post in _posts(plan, name, path, takes)]
        router: list[Post] = []
        if plan.mesh:
            places = [_peer(place.listen, place.connect, config) for place in mesh(free_ports(len(posts) + 1))]
        else:
            if not connect:
                connect = (f"tcp/{HOST}:{free_ports(1)[0]}",)
                listen = ("--listen", connect[0], "--no-multicast-scouting")
                config_of_router = ("--config", str(config)) if config else ()
                router = [Post(*ROUTER, (*_zenocap("router"), *listen, *config_of_router))]
            client = ZenohOptions("client", connect, config_file=config, multicast_scouting=False)
            places = [client] * (len(posts) + 1)
        self.own = places[-1]
        self._children = Children(
            [(post.title, post.command) for post in router]
            + [(post.title, _started(post, epoch_ns, place)) for post, place in zip(posts, places[:-1], strict=True)],
            time.monotonic,
        )
        self.posts = {post.title: post for post in (*router, *posts)}

    def start(self) -> None:
        self._children.start()

    def poll(self) -> None:
        """Start again who died."""
        self._children.poll()

    def pids(self) -> dict[tuple[str, str, str], int]:
        """Of those that run."""
        running = ((self.posts[child.name].who, child.process) for child in self._children.all)
        return {who: process.pid for who, process in running if process is not None}

    @property
    def failed(self) -> list[str]:
        """Titles of those that failed for good."""
        return [child.name for child in self._children.given_up]

    def lines(self) -> list[str]:
        """What they wrote since the last call."""
        return self._children.lines()

    def kill(self, title: str) -> None:
        """End one as a power cut does; it is started again by `poll`.  Raises KeyError."""
        child = self._child(title)
        if child.process is not None:
            child.process.kill()

    def stop(self) -> None:
        self._children.stop(lambda title: self.posts[title].service != "router")
        self._children.stop()

    def _child(self, title: str) -> Child:
        for child in self._children.all:
            if child.name == title:
                return child
        raise KeyError(title)


def _posts(plan: Plan, name: str, path: Path, takes: Path) -> list[Post]:
    member = (sys.executable, "-P", "-m", "services.load.member")
    posts = []
    if plan.part != "viewers":
        log = ("--output", str(takes / f"{name}.mcap")) if plan.log else ("--no-log",)
        posts.append(Post(name, "integrator", "main", (*_zenocap("integrator"), str(path), "--with-parent", *log)))
        if plan.has_tracker:
            posts.append(Post(name, "tracker", "main", (*_zenocap("tracker"), str(path), "--with-parent")))
    if plan.part != "integrators":
        for id in plan.views:
            real = (*_zenocap("viewer"), str(path), "--id", id, "--with-parent")
            posts.append(Post(name, "viewer", id, (*member, "stand-in", str(path), "--id", id) if plan.stand_ins else real))
        for number in range(1, plan.subscribers + 1):
            posts.append(Post(name, "subscriber", str(number), (*member, "subscriber", str(path), "--id", str(number))))
    return posts


def _zenocap(command: str) -> tuple[str, ...]:
    return sys.executable, "-P", "-m", "services.cli", command


def _started(post: Post, epoch_ns: int, place: ZenohOptions) -> list[str]:
    arguments = list(post.command)
    if post.service == "viewer":
        arguments += ["--epoch-ns", str(epoch_ns)]
    arguments += ["--mode", place.mode] if place.mode else []
    for name, endpoints in (("--connect", place.connect), ("--listen", place.listen)):
        for endpoint in endpoints:
            arguments += [name, endpoint]
    if place.config_file:
        arguments += ["--config", str(place.config_file)]
    return [*arguments, "--no-multicast-scouting"]


def _peer(listen: str, connect: tuple[str, ...], config: Path | None) -> ZenohOptions:
    return ZenohOptions("peer", connect, (listen,), config, multicast_scouting=False)
