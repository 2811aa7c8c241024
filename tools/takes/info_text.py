"""Text of `zenocap info`: plain lines of at most 100 columns where keys allow, the same in a pipe."""

from collections import Counter
from collections.abc import Iterator, Sequence

from zenocap.common.camera_advice import take_lines
from zenocap.common.messages import ENDED, SENT
from zenocap.common.rig.services import title
from zenocap.common.runtime.foreign_text import MAX_LINE, printable
from zenocap.tools.judge.text import EVIDENCE, part_lines
from zenocap.tools.takes.info import AccountLine, Info
from zenocap.tools.takes.take_health import ServiceHealth
from zenocap.tools.takes.take_statistics import ChannelStatistics, Frames

LABEL = 12
WIDTH = 100


def lines_of(info: Info) -> Iterator[str]:
    """Yield the lines, without line ends; texts of the take are escaped."""
    return (printable(line, MAX_LINE) for line in _lines(info))


def _lines(info: Info) -> Iterator[str]:
    yield from _head(info)
    for section in _sections(info):
        lines = list(section)
        yield from ("", *lines) if lines else ()


def _sections(info: Info) -> Iterator[Iterator[str]]:
    """Parts of the text with an empty line before each that is not empty."""
    yield _channels(info.channels)
    yield _frames(info.frames)
    yield _two_view(info)
    yield _overload(info)
    yield _delays(info)
    yield _tracker(info)
    yield _verdict(info)
    yield iter(take_lines(info.advice) if info.advice else ())
    yield _postures(info)
    yield _commands(info)
    yield _account(info.account)
    yield from map(_health, info.health)


def _head(info: Info) -> Iterator[str]:
    chunks = ", ".join(f"{count} chunks {name}" for name, count in info.chunks.items()) or "no chunks"
    yield _line("take", info.path)
    yield _line("size", f"{_size(info.size_bytes)}, {info.messages} messages, {chunks}")
    if info.messages:
        yield _line("time", f"{_date(info.start)} to {_date(info.end)} UTC, {info.duration_s:.3f} s")
    yield _line("state", "cut, damaged or out of order: only intact messages are counted" if info.cut else "intact")
    if info.unreadable:
        yield _line("unreadable", f"{info.unreadable} messages, perhaps of another version")
    for name, values in info.metadata.items():
        yield from _wrapped(name, [printable(f"{key} {value}".strip()) for key, value in values.items()])
    for name, size in info.attachments.items():
        yield _line("file", f"{printable(name)}, {_size(size)}")
    if info.parameters:
        yield _line("parameters", f"{sum(info.parameters.values())} values of {len(info.parameters)} services")


def _two_view(info: Info) -> Iterator[str]:
    if info.pairs:
        pairs = info.pairs
        counts = f"{pairs.instants} frame sets, {pairs.complete} with all viewers, {pairs.one_viewer} with one viewer"
        yield _line("pairs", f"{counts}, {pairs.stale} with a stale viewer")
    if info.height_ratio is not None:
        yield _line("heights", f"{info.height_ratio - 1:+.1%} in the side view, compared with the front view")


def _overload(info: Info) -> Iterator[str]:
    if info.reduced:
        reduced = info.reduced
        parts = [f"{reduced.seconds:.1f} s: {reduced.reason}, the lowest rate"] if reduced.seconds else []
        parts += [f"{reduced.thinned_s:.1f} s with fewer points and particles of the tracker"] if reduced.thinned_s else []
        yield from _wrapped("overload", parts)


def _delays(info: Info) -> Iterator[str]:
    if info.delays is not None:
        applied = info.delays.applied_ms
        parts = [
            f"{viewer} {ms:.0f} ms" + (f" (corrected by {applied.get(viewer, 0.0):.0f})" if applied else "")
            for viewer, ms in info.delays.found_ms.items()
        ]
        yield from _wrapped("images late", parts)


def _tracker(info: Info) -> Iterator[str]:
    if info.tracked:
        tracked = info.tracked
        by_views = [f"{count} of {views} views" for views, count in sorted(tracked.views.items(), reverse=True)]
        body = [] if tracked.measured else ["body of average proportions"]
        yield from _wrapped("tracker", [f"{tracked.poses} poses", f"{tracked.lost} without a person", *by_views, *body])
        if tracked.both_ways:
            lost = f"{tracked.both_ways_lost} without a person"
            yield _line("both ways", f"{tracked.both_ways} poses, {lost}: used unless --raw is given")
        else:
            yield _line("both ways", "no: tracked in one pass")


def _verdict(info: Info) -> Iterator[str]:
    if info.verdict is not None:
        yield from info.verdict.text.splitlines()
        stored = "recorded" if info.verdict_stored else "computed now"
        yield _line("rests on", f"{EVIDENCE[info.verdict.evidence]}; {stored}")
        yield from part_lines(info.verdict, info.start_ns)


def _postures(info: Info) -> Iterator[str]:
    if info.recognised:
        recognized = info.recognised
        by_label = [f"{printable(label)} {count}" for label, count in sorted(recognized.labels.items())]
        unknown = [f"{recognized.unknown} unknown movements"] if recognized.unknown else []
        yield from _wrapped("postures", [f"{recognized.answers - recognized.unknown} postures", *by_label, *unknown])


def _commands(info: Info) -> Iterator[str]:
    if info.commands:
        commands = info.commands
        counts = ((commands.done, "done"), (commands.failed, "failed"), (commands.dropped, "dropped"))
        parts = [f"{count} {outcome}" for count, outcome in counts if count]
        if commands.done:
            parts += [f"{target} {count}" for target, count in commands.targets.items()]
            for name, (middle_ms, largest_ms) in (("pose", commands.latency_ms), ("end of posture", commands.since_end_ms)):
                parts.append(f"{name} to action: median {middle_ms:.1f} ms, largest {largest_ms:.1f} ms")
        yield from _wrapped("commands", parts)


def _account(lines: Sequence[AccountLine]) -> Iterator[str]:
    """What became of the messages that were sent; a row for each topic with losses."""
    if not lines:
        return
    terms = {"in the take": "recorded", "not written": "refused", "never arrived": "missing", "before it": "unlogged"}
    parts = [f"{sum(getattr(line, field) for line in lines)} {term}" for term, field in terms.items()]
    yield from _wrapped("sent", [f"{sum(line.sent for line in lines)} messages", *parts])
    lost = [(one, one.missing + one.refused) for one in lines if one.missing or one.refused]
    if lost:
        rows = [(title((one.service, one.id)), one.topic, str(one.sent), str(count)) for one, count in lost]
        yield from _table([("service", "topic", "sent", "lost"), *rows], right=(2, 3))
    unknown = {title((one.service, one.id)): sum(end - begin for begin, end in one.unknown) for one in lines}
    parts = [f"{service} {span_ns / 1e9:.1f} s" for service, span_ns in unknown.items() if span_ns]
    if parts:
        yield from _wrapped("not counted", parts)


def _channels(channels: Sequence[ChannelStatistics]) -> Iterator[str]:
    """Table of channels, grouped by the first two parts of the keys where that is shorter."""
    if not channels:
        return
    groups = Counter(_stem(channel.key) for channel in channels)
    rows: list[tuple[str, ...]] = [("channel", "count", "bytes", "/s", "gap s", "at s", "schema")]
    above = ""
    for channel in channels:
        stem = _stem(channel.key) if groups[_stem(channel.key)] > 1 else ""
        if stem and stem != above:
            rows.append((stem, "", "", "", "", "", ""))
        above = stem
        name = f"  {channel.key.removeprefix(stem)}" if stem else channel.key
        times = (f"{channel.rate:.1f}", f"{channel.gap_s:.3f}", f"{channel.gap_at_s:.1f}")
        schema = f"{'' if channel.encoding == 'msgpack' else channel.encoding} {channel.schema or '-'}".strip()
        several = channel.messages > 1
        rows.append((name, str(channel.messages), _size(channel.bytes), *(times if several else ("", "", "")), schema))
    yield from _table(rows, right=(1, 2, 3, 4, 5))
    yield "gap: longest time between two messages; at: time since the start."


def _stem(key: str) -> str:
    parts = key.split("/")
    return "/".join(parts[:2]) + "/" if len(parts) > 2 else ""


def _frames(frames: Sequence[Frames]) -> Iterator[str]:
    if not frames:
        return
    rows = [("viewer", "every frame", "first", "last", "missing", "which")]
    for one in frames:
        holes = [f"{first}" if first == last else f"{first}-{last}" for first, last in one.holes[:5]]
        which = ", ".join([*holes, *(["..."] if len(one.holes) > 5 else [])])
        if one.restarts:
            which += f"{'; ' if which else ''}numbering restarted {one.restarts} times"
        rows.append((one.viewer, one.topic, str(one.first), str(one.last), str(one.missing), which))
    yield from _table(rows, right=(2, 3, 4))


def _health(health: ServiceHealth) -> Iterator[str]:
    yield f"{health.service} {health.id}: {health.reports} reports, at the end: {printable(health.state)}"
    parts = [f"{name} {count}" for name, count in health.counts.items() if not name.startswith((SENT, ENDED))]
    parts += [f"memory {health.memory_mb:.0f} MB"] if health.memory_mb else []
    if health.clock_offset_ms or health.clock_error_ms:
        parts.append(f"clock off by {health.clock_offset_ms:+.3f} ms at most (± {health.clock_error_ms:.3f})")
    yield from _wrapped("", parts)


def _table(rows: Sequence[tuple[str, ...]], right: tuple[int, ...]) -> Iterator[str]:
    rows = [tuple(printable(cell) for cell in row) for row in rows]
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    for row in rows:
        cells = (cell.rjust(widths[k]) if k in right else cell.ljust(widths[k]) for k, cell in enumerate(row))
        yield "  ".join(cells).rstrip()


def _wrapped(label: str, parts: Sequence[str]) -> Iterator[str]:
    """The parts, separated by commas, wrapped to WIDTH columns."""
    line = ""
    for part in parts:
        if line and LABEL + len(line) + len(part) + 3 > WIDTH:
            yield _line(label, f"{line},")
            label, line = "", ""
        line += f"{', ' if line else ''}{part}"
    if line or label:
        yield _line(label, line)


def _line(label: str, text: str) -> str:
    return f"{label:{LABEL - 1}} {text}".rstrip()


def _date(iso: str) -> str:
    return iso.replace("T", " ").removesuffix("Z")


def _size(count: int) -> str:
    for limit, unit in ((1e9, "GB"), (1e6, "MB"), (1e3, "kB")):
        if count >= limit:
            return f"{count / limit:.1f} {unit}"
    return f"{count} B"
