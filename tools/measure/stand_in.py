"""Processes of a load that are not services: stand-ins for viewers, and extra subscribers.

The load test starts them with

python -m zenocap.tools.measure.stand_in stand-in|subscriber RIG --id ID --epoch-ns N [Zenoh options]
"""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer
from msgspec.structs import replace

from zenocap.common.bus.protocol import Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.errors import UserError
from zenocap.common.messages import Assignment, Message
from zenocap.common.rig.rig import Viewer, load_rig
from zenocap.common.runtime import logs
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.frame_rate import FrameChoice
from zenocap.common.runtime.priority import lower_priority
from zenocap.common.runtime.service import Event, Service, TopicSubscription, run
from zenocap.common.runtime.signals import stop_signals
from zenocap.common.topics import ASSIGNMENT, FRAME_RATE, HANDLED, TOPICS
from zenocap.services.viewer.shell import camera_info
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.rendered import there_and_back
from zenocap.tools.measure.load_plan import Priority
from zenocap.tools.measure.recorded_messages import RecordedMessages, messages_file, read_messages
from zenocap.tools.measure.scene import FILM_FPS
from zenocap.tools.option_groups import expanded
from zenocap.tools.service_arguments import ZenohArguments

logger = logging.getLogger(__name__)

FAILED = 1


@dataclass(frozen=True)
class DueFrame:
    """A frame number and its capture time, without an image."""

    frame: int
    captured_ns: int


@dataclass(frozen=True)
class StandIn:
    """recorded: messages of each image of the film.  fps: frame rate of this viewer."""

    viewer: str
    recorded: tuple[RecordedMessages, ...]
    fps: float

    def of(self, frame: int) -> RecordedMessages:
        return self.recorded[there_and_back(int(frame * FILM_FPS / self.fps + 1e-6), len(self.recorded))]


def step(setup: StandIn, waiting: DueFrame | None, event: Event[DueFrame]) -> tuple[DueFrame | None, Sequence[Message]]:
    """Publish silhouette and sighting for a frame, and a partial BAP for its assignment, as a viewer does."""
    match event:
        case DueFrame(frame=frame, captured_ns=captured_ns):
            recorded = setup.of(frame)
            messages: list[Message] = [replace(recorded.silhouette, frame=frame, captured_ns=captured_ns)]
            if recorded.sighting is not None:
                messages.append(replace(recorded.sighting, frame=frame, captured_ns=captured_ns))
            return event, messages
        case Envelope(message=Assignment(tracking=True, views=views)) if waiting is not None:
            own, bap = views.get(setup.viewer), setup.of(waiting.frame).bap
            if own is None or own.stale or own.frame != waiting.frame or bap is None:
                return waiting, []
            return None, [replace(bap, frame=waiting.frame, captured_ns=waiting.captured_ns, view=own.view)]
        case _:
            return waiting, []


def due_frames(fps: float, playback: Playback) -> Iterator[DueFrame]:
    """Yield frame n at `epoch_ns` + n / fps without end, except late ones and those that the rate leaves out."""
    index = 0
    while True:
        index = playback.next_index(index, fps)
        playback.wait_until(playback.time_of(index, fps))
        yield DueFrame(index, playback.time_of(index, fps))
        index += 1


def run_stand_in(viewer: Viewer, rig: str, epoch_ns: int, options: ZenohOptions) -> int:
    """Run until stopped; return the exit status.  rig: its name.  Raises BusError and OSError."""
    setup, clock = StandIn(viewer.id, read_messages(messages_file(viewer)), viewer.fps), RealClock()
    service: Service[StandIn, DueFrame | None, DueFrame] = Service(
        "viewer", viewer.id, setup, lambda: None, step, (TopicSubscription(ASSIGNMENT), TopicSubscription(FRAME_RATE)),
        describe=lambda _: "stand-in",
    )  # fmt: skip
    with stop_signals(with_parent=True) as stopped, ZenohBus.open(options, rig, clock, stopped) as bus:
        choice = FrameChoice(viewer.fps)
        frames = due_frames(viewer.fps, Playback(epoch_ns, clock, choice=choice))
        first_messages = (camera_info(viewer, epoch_ns),)
        return run(service, bus, clock, frames, stopped, first_messages=first_messages, choice=choice)


def run_subscriber(rig: str, id: str, priority: Priority, options: ZenohOptions) -> int:
    """Receive, decode and count every message of a rig until stopped; return the exit status.  Raises BusError."""
    if priority == "low":
        lower_priority(logger)
    clock = RealClock()
    topics = tuple(TopicSubscription(topic, every=True) for topic in TOPICS if topic is not HANDLED)
    service: Service[None, int, DueFrame] = Service(
        "subscriber", id, None, lambda: 0, lambda _, count, event: (count + isinstance(event, Envelope), []), topics,
        describe=lambda count: f"{count} messages", count=lambda count: {"received": count}, derives=False,
    )  # fmt: skip
    with stop_signals(with_parent=True) as stopped, ZenohBus.open(options, rig, clock, stopped) as bus:
        return run(service, bus, clock, stopped=stopped)


def main(
    kind: Annotated[Literal["stand-in", "subscriber"], typer.Argument()], rig: Annotated[Path, typer.Argument()],
    id: Annotated[str, typer.Option()], priority: Priority = "normal", epoch_ns: int = 0, *, zenoh: ZenohArguments,
) -> None:  # fmt: skip
    logs.configure(f"{kind} {id}")
    options = zenoh.options()
    try:
        one = load_rig(rig)
        if kind == "subscriber":
            raise typer.Exit(run_subscriber(one.name, id, priority, options))
        raise typer.Exit(run_stand_in(one.viewer(id), one.name, epoch_ns, options))
    except (UserError, OSError, ValueError) as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(FAILED) from None


program = typer.Typer(add_completion=False)
program.command()(expanded(main))

if __name__ == "__main__":
    program()
