"""Closing statement on the frames of a rig's viewers: captured = sent + left out by cause."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

from zenocap.common.messages import SENT
from zenocap.common.observe.account import Account, Span
from zenocap.common.observe.view import RigView, ServiceView
from zenocap.common.rig.services import ServiceKey, title
from zenocap.common.runtime.frame_rate import CAPTURED, DROPPED, PROCESSED, SKIPPED
from zenocap.common.topics import HEALTH, Topic
from zenocap.tools.record.launcher.statement import added, unknown_lines


@dataclass(frozen=True)
class FrameStatement:
    """Frames that the sources of all viewers gave.

    The laws: `captured` is the sum of `fates`, and those that were processed are the sum of `uses`.  What a viewer captured
    after a last report that does not say that it is the last is in neither: `unknown`, log times by viewer.
    uncounted: processed frames of viewers of an earlier release, which do not say what their sources gave.
    """

    captured: int
    fates: Mapping[str, int]
    uses: Mapping[str, int]
    unknown: Mapping[ServiceKey, tuple[Span, ...]]
    uncounted: Mapping[ServiceKey, int]

    @property
    def complete(self) -> bool:
        whole = self.captured == sum(self.fates.values()) and self.fates["processed"] == sum(self.uses.values())
        return whole and not (self.unknown or self.uncounted)

    def text(self) -> Iterator[str]:
        """Lines for display; none without a frame."""
        if self.captured or any(self.fates.values()):
            captured = _equation(self.captured, "captured", self.fates)
            yield f"frames: {captured}; {_equation(self.fates['processed'], 'processed', self.uses)}"
        yield from unknown_lines("captured", self.unknown)
        for viewer, count in self.uncounted.items():
            yield f"frames of {title(viewer)}: {count} processed of an unknown number: its release does not count them"


def frames_of(view: RigView, reports: Account, services: Collection[ServiceKey], topic: Topic) -> FrameStatement:
    """The frames of some services' viewers.

    reports: account of the healths in `view`.  topic: of the message that is sent with every frame.
    """
    all = {key: one for key, one in view.services.items() if key[0] == "viewer" and key in services}
    uncounted = {key: one.total(PROCESSED) for key, one in all.items() if not _has_count(one, CAPTURED)}
    viewers = [one for key, one in all.items() if not uncounted.get(key)]

    def total(name: str) -> int:
        return sum(one.total(name) for one in viewers)

    fates = {"processed": total(PROCESSED), "failed": total("failed_frames"), "dropped": total(DROPPED)}
    uses = {"sent": total(SENT + topic.name), "for the background": total("learning_frames")}
    uses["not sendable"] = max(0, min(fates["processed"] - sum(uses.values()), total("unsendable")))  # of any topic
    unknown = {key: line.unknown for (key, name), line in reports.lines().items() if name == HEALTH.name and key in all}
    return FrameStatement(
        total(CAPTURED), fates | {"skipped under overload": total(SKIPPED)}, uses,
        {key: spans for key, spans in unknown.items() if spans}, {key: count for key, count in uncounted.items() if count},
    )  # fmt: skip


def _has_count(one: ServiceView, name: str) -> bool:
    """Whether the present process of a service and those before have a count."""
    return one.health is not None and name in one.health.counts and (not one.past or name in one.past)


def _equation(whole: int, name: str, terms: Mapping[str, int]) -> str:
    """A count and its parts, with a further one for what they do not explain."""
    rest = whole - sum(terms.values())
    return f"{whole} {name} = {added({**terms, 'not accounted for': rest} if rest else terms)}"
