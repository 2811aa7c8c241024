"""Display of `top` on a terminal, and as JSON."""

import io
import json
import re
from dataclasses import replace

import msgspec
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from zenocap.common.observe.view import ObservedService
from zenocap.tools.operate.monitor.display import BLOCKS, as_json, shown, sparkline, words

UP = ObservedService(
    "studio", "viewer", "1", "up", 15.0, (1.0, 15.0), 7.0, "frame 2.5", 9, 2, 0, -20.0, 0.5, 120.0, 0.2, 0.1, "tracking"
)


def text(rows: list[ObservedService]) -> str:
    console = Console(file=io.StringIO(), width=200, color_system="truecolor", force_terminal=True)
    console.print(shown(rows, "q ends"))
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_every_rig_has_a_table_with_totals() -> None:
    rows = [
        UP,
        ObservedService("studio", "integrator", "main", "missing"),
        ObservedService("lab", "viewer", "1", "gone", 3.0),
    ]
    found = text(rows)
    assert "studio: 1 of 2 up, 0.20 cores, 120 MB" in found
    assert "lab: 0 of 1 up" in found
    assert "q ends" in found


def test_problems_are_red() -> None:
    red = "\x1b[31m"
    assert red in text([ObservedService("lab", "viewer", "1", "gone")])
    assert red in text([UP])  # its losses and its clock
    assert red not in text([ObservedService("lab", "viewer", "1", "up", 3.0)])


def test_secured_rigs_have_a_column_for_the_days_of_certificates() -> None:
    assert "cert days" not in text([UP])
    found = text([replace(UP, certificate_days=700), ObservedService("studio", "integrator", "main", "missing")])
    assert "cert days" in found
    assert re.search(r"\x1b\[31m *30\x1b", text([ObservedService("lab", "viewer", "1", "up", 3.0, certificate_days=30)]))
    assert not re.search(r"\x1b\[31m *31", text([ObservedService("lab", "viewer", "1", "up", 3.0, certificate_days=31)]))


def test_empty_network_is_reported() -> None:
    assert "no service found" in text([])


@given(st.lists(st.floats(0.0, 1e6), max_size=30))
def test_sparkline_shows_the_last_values_relative_to_the_largest(values: list[float]) -> None:
    line = sparkline(values)
    last = values[-10:]
    assert len(line) == len(last)
    assert set(line) <= set(BLOCKS)
    if last and max(last) > 0:
        assert line[last.index(max(last))] == BLOCKS[-1]


def test_json_has_every_row() -> None:
    (service,) = json.loads(msgspec.json.encode(as_json([UP])))["services"]
    assert (service["rig"], service["service"], service["status"], service["lost"]) == ("studio", "viewer", "up", 9)


def test_faults_of_images_stand_before_the_state() -> None:
    assert words(replace(UP, words="tracking", advice="focus, holes")) == "! focus, holes | tracking"
    assert words(replace(UP, words="tracking")) == "tracking"
