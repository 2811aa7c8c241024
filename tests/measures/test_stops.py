"""Table of stops: a limit that is broken has a word, and decides the status."""

import pytest

from benchmarks.chaos.observer import SeenHealth
from tests.measures import stops
from tests.measures.stops import ALONE_S, LOADED_S, Stop, table, works
from tests.support.built_messages import built
from zenocap.common.messages import Health


def stop(service: str = "tracker", again_s: float = 1.0, stop_s: float = 1.0, text: str = "") -> Stop:
    return Stop(service, again_s, stop_s, 0, text)


@pytest.mark.parametrize(
    ("one", "failed", "longest_s", "broken"),
    [
        (stop(), 0, ALONE_S, ""),
        (stop(stop_s=2.1), 0, ALONE_S, "stop of the rig, s | 100 | 1.00 | 1.01 | 2.10 | 2.00"),
        (stop(again_s=3.1), 0, ALONE_S, "tracker again, s | 51 | 1.00 | 2.05 | 3.10 | 3.00"),
        (stop(again_s=2.9, stop_s=4.9), 0, LOADED_S, ""),
        (stop(stop_s=5.1), 0, LOADED_S, "stop of the rig, s | 100 | 1.00 | 1.04 | 5.10 | 5.00"),
        (stop(text="a: has not stopped in 8 s; the stacks"), 0, LOADED_S, "services that hung at a stop |  |  |  | 1 | 0"),
        (stop(), 2, ALONE_S, "starts that failed |  |  |  | 2 | 0"),
    ],
)
def test_a_limit_that_is_broken_is_named(one: Stop, failed: int, longest_s: float, broken: str) -> None:
    found = [one, *(stop(name) for name in ["tracker"] * 50 + ["viewer 1"] * 49)]
    lines, holds = table(found, failed, longest_s)
    assert [line for line in lines if line.endswith("NO |")] == ([f"| {broken} | NO |"] if broken else [])
    assert holds is not bool(broken)


@pytest.mark.parametrize(
    ("service", "counts", "expected"),
    [
        ("viewer 1", {"process": 2, "frames": 0}, False),
        ("viewer 1", {"process": 2, "frames": 3}, True),
        ("viewer 1", {"process": 1, "frames": 3}, False),
        ("tracker", {"process": 2}, True),
        ("tracker", {"process": 1}, False),
    ],
)
def test_a_viewer_works_again_with_its_first_frame(service: str, counts: dict[str, int], expected: bool) -> None:
    """The first health, before the camera was open, ended the time of a start."""
    others = [SeenHealth(0, name, built(Health, counts={"process": 3, "frames": 9})) for name in ("viewer 2", "animator")]
    seen = [SeenHealth(0, service, built(Health, counts=counts)), *others]
    assert works(service, seen, {1, None}) is expected


def test_a_start_that_fails_is_counted_and_the_others_go_on(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def after(service: str, *_: object, load: int) -> Stop:
        if service == "viewer 2":
            raise RuntimeError("the rig does not work")
        return stop(service)

    monkeypatch.setattr(stops, "stop_after", after)
    assert stops.main(["3"]) == 1
    text = capsys.readouterr().out
    assert "2 of 3: viewer 2: the rig does not work\n3 of 3: viewer 3 again in 1.0 s" in text
    assert "| stop of the rig, s | 2 | 1.00 | 1.00 | 1.00 | 2.00 | yes |" in text
    assert "| starts that failed |  |  |  | 1 | 0 | NO |" in text
