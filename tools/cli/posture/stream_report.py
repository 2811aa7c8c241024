"""Output of `posture evaluate --model`: table, JSON and the operating curve of a model on streams."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.services.recognizer.features import Kind
    from zenocap.services.recognizer.model import PostureModel
    from zenocap.services.recognizer.training.example_files import Features
    from zenocap.services.recognizer.training.stream_evaluation import PostureSpan, StreamOutcome, StreamScore
    from zenocap.tools.cli.posture.training_options import SourceArguments

HEADINGS = ("labelled", "right", "wrong", "recall", "precision", "false/h", "delay p50", "p95 s")
CURVE_LINES = 8


def read_streams(
    manifest: Path, kind: Kind, sources: SourceArguments, report: Callable[[int, int, str], None]
) -> dict[Path, tuple[Features, list[PostureSpan]]]:
    """Sources of a manifest, rigs tracked first, with the labelled postures in each.  Raises UserError."""
    from zenocap.common.errors import UserError
    from zenocap.common.formats.file_warnings import grouped_warnings
    from zenocap.services.recognizer.training import example_files
    from zenocap.services.recognizer.training.examples import BACKGROUND
    from zenocap.services.recognizer.training.stream_evaluation import PostureSpan
    from zenocap.tools.cli.posture.tracked_sources import tracked_rows

    rows, names = tracked_rows(manifest, sources, report)
    found: dict[Path, tuple[Features, list[PostureSpan]]] = {}
    with grouped_warnings():
        for done, row in enumerate(rows):
            report(done, len(rows), row.source.name)
            if row.source not in found:
                try:
                    found[row.source] = (example_files.read_features(row.source, kind, names), [])
                except OSError as error:
                    raise UserError(f"{manifest}: line {row.line}: {row.source}: {error.strerror}") from None
            motion, spans = found[row.source]
            start, end = (
                float(motion.times_s[at]) if value is None else value for at, value in ((0, row.start), (-1, row.end))
            )
            if row.posture != BACKGROUND:
                spans.append(PostureSpan(row.posture, start, end))
    return found


def unsuitable(model: PostureModel, outcome: StreamOutcome, sources: Sequence[Path]) -> Iterator[str]:
    """Notes about what the figures do not show."""
    trained = [source.name for source in sources if any(source.name in text for text in model.training.sources)]
    if trained:
        yield f"{len(trained)} of {len(sources)} sources are named in the model's training: the figures flatter it"
    unknown = sorted({one.label for truth in outcome.truths for one in truth} - set(model.labels))
    if unknown:
        yield f"the model does not have {', '.join(unknown)}: they count as not recognized"


def stream_lines(outcome: StreamOutcome) -> Iterator[str]:
    """Table by posture, and the operating curve in CURVE_LINES lines."""
    from zenocap.services.recognizer.false_alarms import upper_rate

    width = max(len("posture"), *map(len, outcome.labels))
    yield f"{'posture':{width}} " + " ".join(f"{heading:>9}" for heading in HEADINGS)
    for label in (*outcome.labels, None):
        yield f"{label or 'all':{width}} " + " ".join(f"{cell:>9}" for cell in _cells(outcome.score(label)))
    wrong = outcome.score().wrong
    limit = f"false/h with 95 % confidence at most {upper_rate(wrong, outcome.hours):.1f}" if outcome.hours else "no poses"
    yield f"{60 * outcome.hours:.1f} min with poses: {limit}; delay: from the labelled end to the frame of the answer"
    curve = outcome.curve()
    if len(curve) > 1:
        yield ""
        yield "with higher thresholds: least level of an answer (share of the trees, or score above the threshold)"
        yield " ".join(f"{heading:>9}" for heading in ("level", "recall", "precision", "false/h"))
        step = max(1, len(curve) // CURVE_LINES)
        for level, score in curve[::step]:
            cells = (f"{level:.2f}", _percent(score.recall), _percent(score.precision), f"{score.false_per_hour:.1f}")
            yield " ".join(f"{cell:>9}" for cell in cells)


def _cells(score: StreamScore) -> tuple[str, ...]:
    delays = (f"{value:.2f}" if isfinite(value) else "-" for value in (score.delay_s(0.5), score.delay_s(0.95)))
    shares = (_percent(score.recall), _percent(score.precision))
    return (str(score.events), str(score.right), str(score.wrong), *shares, f"{score.false_per_hour:.1f}", *delays)


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if isfinite(share) else "-"


def stream_json(outcome: StreamOutcome, notes: Sequence[str]) -> dict[str, object]:
    """The same as JSON; shares 0 to 1, null where there is nothing to divide by."""
    curve = [{"level": level} | _score_json(score) for level, score in outcome.curve()]
    postures = {label: _score_json(outcome.score(label)) for label in outcome.labels}
    return {
        "hours": outcome.hours, "all": _score_json(outcome.score()), "postures": postures, "curve": curve,
        "notes": [*notes],
    }  # fmt: skip


def _score_json(score: StreamScore) -> dict[str, object]:
    values = {
        "recall": score.recall, "precision": score.precision, "false_per_hour": score.false_per_hour,
        "delay_p50_s": score.delay_s(0.5), "delay_p95_s": score.delay_s(0.95),
    }  # fmt: skip
    numbers = {name: round(value, 6) if isfinite(value) else None for name, value in values.items()}
    return {"labelled": score.events, "right": score.right, "wrong": score.wrong, **numbers}


def draw_curve(path: Path, outcome: StreamOutcome) -> None:
    """Write a picture in the format of `path`'s suffix: recall, precision and false postures per hour by the least level.

    The shaded range ends at the upper limit of the rate, see `false_alarms.upper_rate`.  Raises OSError, and ImportError
    without matplotlib.
    """
    from matplotlib.figure import Figure

    from zenocap.services.recognizer.false_alarms import upper_rate

    figure = Figure(figsize=(7.0, 5.5), layout="constrained")
    shares, rates = figure.subplots(2, 1, sharex=True)
    curve = outcome.curve()
    levels, scores = [level for level, _ in curve], [score for _, score in curve]
    for name, values, style in (
        ("recall", [100 * score.recall for score in scores], "-"),
        ("precision", [100 * score.precision for score in scores], "--"),
    ):
        shares.plot(levels, values, style, drawstyle="steps-pre", label=name)
    shares.set(ylabel="%", ylim=(0, 103))
    shares.legend(loc="lower left")
    found = [score.false_per_hour for score in scores]
    most = [upper_rate(score.wrong, outcome.hours) for score in scores]
    rates.plot(levels, found, drawstyle="steps-pre", label="false postures per hour")
    rates.fill_between(levels, found, most, step="pre", alpha=0.2, label="up to the limit with 95 % confidence")
    rates.set(xlabel="least share of the trees, or score above the threshold", ylabel="per hour")
    rates.set_ylim(bottom=0)
    rates.legend(loc="lower left")
    for axes in (shares, rates):
        axes.grid(alpha=0.3)
    own = outcome.score()
    title = f"{own.events} postures in {60 * outcome.hours:.1f} min; the left end: the thresholds of the model"
    shares.set_title(title, size=10)
    figure.savefig(path, dpi=150)
