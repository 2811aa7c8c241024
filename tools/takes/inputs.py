"""Frames of a recording's sources: those that belong together, and those left out."""

from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from zenocap.common.errors import SourceError
from zenocap.common.synchronizer import FARTHEST, follows
from zenocap.common.video.reader import VideoSummary
from zenocap.services.viewer.frame import Frame

SHOWN_GAPS = 3  # of one video
FEW, FEW_SHARE = 2, 0.005  # frames, and share of a viewer's, that are left out without a word: ends hardly ever agree
DIFFERENCE_NS = 200_000_000  # between the ends of videos, from which it is reported


@dataclass
class Inputs:
    """Frames and videos of a recording, by viewer.

    problems: sources that failed, in words.  frames, alone: number of frames, and of those without one of another viewer
    at the same time.  begins_ns, ends_ns: times of the first and last frame.  videos: of those that are read to the end.
    """

    problems: list[str] = field(default_factory=list)
    frames: Counter[str] = field(default_factory=Counter)
    alone: Counter[str] = field(default_factory=Counter)
    begins_ns: dict[str, int] = field(default_factory=dict)
    ends_ns: dict[str, int] = field(default_factory=dict)
    videos: dict[str, VideoSummary] = field(default_factory=dict)

    def frame_sets(self, sources: Mapping[str, Iterator[Frame]], tolerance_ns: int) -> Iterator[dict[str, Frame]]:
        """Yield the frames of all viewers grouped by capture time; a failing source adds a line to `problems`.

        As `zenocap.common.synchronizer`: frames within `tolerance_ns` of the earliest one form a group, or somewhat farther
        where no other frame is nearer.  Ends with the longest source.
        """
        ahead: dict[str, deque[Frame]] = {id: deque() for id in sources}
        ended: set[str] = set()
        given: dict[str, int] = {}
        while True:
            for id, source in sources.items():
                while len(ahead[id]) < 2 and id not in ended:
                    try:
                        ahead[id].append(next(source))
                    except StopIteration:
                        ended.add(id)
                    except SourceError as error:
                        ended.add(id)
                        self.problems.append(str(error))
            group = _group({id: queue for id, queue in ahead.items() if queue}, given, tolerance_ns)
            if not group:
                return
            self._count(group)
            yield group
            for id, frame in group.items():
                given[id] = frame.captured_ns
                ahead[id].popleft()

    def notes(self) -> list[str]:
        """Lines for the user on what is unusual about the sources; nothing was left out because of it."""
        found = []
        for id, video in self.videos.items():
            timing = video.timing
            if video.software:
                found.append(f"{id}: decoded in software, not by hardware: {video.software}")
            if timing.variable:
                interval = f"{1000 * timing.shortest_s:.0f} to {1000 * timing.longest_s:.0f} ms"
                found.append(f"{id}: variable frame rate, {interval} between frames: each has the time that the file gives")
            for gap in timing.gaps[:SHOWN_GAPS]:
                found.append(f"{id}: no frames from {gap.before_s:.2f} to {gap.after_s:.2f} s, {gap.missing} missing")
            if len(timing.gaps) > SHOWN_GAPS:
                missing = sum(gap.missing for gap in timing.gaps[SHOWN_GAPS:])
                found.append(f"{id}: {len(timing.gaps) - SHOWN_GAPS} more gaps, {missing} frames missing")
            found += [f"{id}: {note}" for note in video.notes]
            if video.estimated and not any("frames/s" in note or "/s assumed" in note for note in video.notes):
                found.append(f"{id}: {video.estimated} frames have no time in the file: one period after the frame before")
        return found + _differences("begins", self.begins_ns, min) + _differences("ends", self.ends_ns, max)

    def video_notes(self) -> dict[str, str]:
        """By viewer, see `VideoSummary`; the same on every machine, so that takes are."""
        return {id: "; ".join(video.notes) for id, video in self.videos.items() if video.notes}

    def left_out(self) -> list[str]:
        """Lines for the user on frames that were not used."""
        found = [f"{id}: {video.damaged} damaged frames left out" for id, video in self.videos.items() if video.damaged]
        for id, number in self.alone.items():
            if number > max(FEW, FEW_SHARE * self.frames[id]):
                found.append(f"{id}: {number} of {self.frames[id]} frames left out: no other camera has one at their time")
        return found

    def _count(self, group: Mapping[str, Frame]) -> None:
        for id, frame in group.items():
            if frame.initial:
                continue
            self.frames[id] += 1
            self.begins_ns.setdefault(id, frame.captured_ns)
            self.ends_ns[id] = frame.captured_ns
            if len(group) == 1:
                self.alone[id] += 1


def _group(ahead: Mapping[str, deque[Frame]], given: Mapping[str, int], tolerance_ns: int) -> dict[str, Frame]:
    """The next frames that belong together, of each viewer's next two.  given: times of the last ones."""
    if not ahead:
        return {}
    first = min(ahead, key=lambda id: ahead[id][0].captured_ns)
    start_ns = ahead[first][0].captured_ns
    later_ns = ahead[first][1].captured_ns if len(ahead[first]) > 1 else None
    group = {}
    for id, queue in ahead.items():
        after_ns = queue[0].captured_ns - start_ns
        nearer = later_ns is not None and abs(later_ns - queue[0].captured_ns) < after_ns
        near = after_ns <= tolerance_ns or follows(given, first, id) or not nearer
        if near and after_ns <= FARTHEST * tolerance_ns:
            group[id] = queue[0]
    return group


def _differences(verb: str, times_ns: Mapping[str, int], first: Callable[[Iterable[int]], int]) -> list[str]:
    """Lines on viewers whose first or last frame is long after, or before, that of the others."""
    if len(times_ns) < 2:
        return []
    end_ns = first(times_ns.values())
    word = "after" if verb == "begins" else "before"
    return [
        f"{id}: {verb} {abs(time_ns - end_ns) / 1e9:.2f} s {word} the {'first' if word == 'after' else 'last'} camera"
        for id, time_ns in times_ns.items()
        if abs(time_ns - end_ns) > DIFFERENCE_NS
    ]
