"""The [animator] table: outputs are off by default; errors name the faulty entry."""

import re
from pathlib import Path

import pytest

from tests.common.rig.test_rig import RIG, write_rig
from tests.support.places import ROOT
from zenocap.common.errors import UserError
from zenocap.common.live_smoothing import animator_smoothing
from zenocap.common.rig.animator import AnimatorTable, FoxgloveTable, LslTable, RosTable, UdpTable, VmcTable, VrchatTable
from zenocap.common.rig.outputs import OUTPUTS
from zenocap.common.rig.rig import load_rig
from zenocap.common.table import attribute

TABLES = """
[animator.vmc]
host = "192.168.1.20"
port = 39540

[animator.udp]
enabled = false

[animator.lsl]
stream = "walk"
reach = "network"
"""
EURO = "[animator]\nsmooth = 'one-euro'\n"


def test_poses_are_smoothed_only_on_request(tmp_path: Path) -> None:
    assert animator_smoothing(load_rig(write_rig(tmp_path, RIG)).animator) is None
    table = load_rig(write_rig(tmp_path, RIG + EURO + "smooth_hz = 2.5\nsmooth_beta = 0\n")).animator
    assert (table.smooth, table.smooth_hz, table.smooth_beta) == ("one-euro", 2.5, 0.0)
    assert animator_smoothing(table) is not None


def test_an_output_with_a_table_is_on_by_default_and_off_without(tmp_path: Path) -> None:
    assert load_rig(write_rig(tmp_path, RIG)).animator == AnimatorTable()
    table = load_rig(write_rig(tmp_path, RIG + TABLES + "[animator.foxglove]\n")).animator
    assert table.outputs["vmc"] == VmcTable(enabled=True, host="192.168.1.20", port=39540)
    assert not table.outputs["udp"].enabled
    assert table.outputs["foxglove"] == FoxgloveTable(enabled=True, host="127.0.0.1", port=8765)
    assert table.outputs["lsl"] == LslTable(stream="walk", reach="network")


def test_outputs_go_to_this_machine_by_default() -> None:
    assert VmcTable().host == UdpTable().host == FoxgloveTable().host == "127.0.0.1"
    assert LslTable().reach == "machine"


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("[animator.osc]\n", "animator.osc = {}: no such key; allowed: "),
        ("[animator.vmc]\nprot = 1\n",
         "animator.vmc.prot = 1: no such key; allowed: enabled, host, port; did you mean 'port'"),
        ("[animator.vmc]\nport = 70000\n", "animator.vmc.port = 70000: allowed: `int` <= 65535"),
        ("[animator.udp]\nhost = ''\n", "animator.udp.host = '': allowed: "),
        ("[animator.vrchat]\nport = 0\n", "animator.vrchat.port = 0: allowed: `int` >= 1"),
        ("[animator.vrchat]\ntrackers = ['hip', 'chets']\n", "animator.vrchat.trackers[1] = 'chets': allowed: 'hip', "),
        ("[animator.vrchat]\ntrackers = ['hip', 'hip']\n", "animator.vrchat.trackers[1] = 'hip': allowed: each name once"),
        ("[animator.vrchat]\nhead = 'on'\n", "animator.vrchat.head = 'on': allowed: 'off', 'position', 'position-and-yaw'"),
        ("[animator.ros]\ndomain = 233\n", "animator.ros.domain = 233: allowed: `int` <= 232"),
        ("[animator.ros]\nconnect = '10.0.0.1:7447'\n",
         "animator.ros.connect = '10.0.0.1:7447': allowed: PROTOCOL/ADDRESS"),
        ("[animator.ros]\nnamespace = 'a__b'\n", "animator.ros.namespace = 'a__b': allowed: letters, digits"),
        ("[animator.ros]\nframe = 'my map'\n", "animator.ros.frame = 'my map': allowed: letters, digits"),
        ("[animator.lsl]\nreach = 'all'\n", "animator.lsl.reach = 'all'"),
        ("animator = 3\n", "animator = 3: allowed: object"),
        ("[animator]\nsmooth = 'one-euros'\n", "animator.smooth = 'one-euros': allowed: 'off', 'one-euro'; did you mean "),
        ("[animator]\nsmooth = true\n", "animator.smooth = True: allowed: str"),
        ("[animator]\nsmooth_hz = 2.0\n", "animator.smooth_hz = 2.0: allowed: only with smooth = 'one-euro'"),
        (EURO + "smooth_hz = 0.0\n", "animator.smooth_hz = 0.0: allowed: 0.1 to 30"),
        (EURO + "smooth_hz = nan\n", "animator.smooth_hz = nan: allowed: 0.1 to 30"),
        (EURO + "smooth_hz = 'fast'\n", "animator.smooth_hz = 'fast': allowed: float | null"),
        (EURO + "smooth_beta = inf\n", "animator.smooth_beta = inf: allowed: 0 to 100"),
        (EURO + "smooth_beta = -1\n", "animator.smooth_beta = -1.0: allowed: 0 to 100"),
    ],
)  # fmt: skip
def test_errors_name_file_key_value_and_what_is_allowed(tmp_path: Path, text: str, error: str) -> None:
    rig = text + RIG if text.startswith("animator =") else RIG + text
    path = write_rig(tmp_path, rig)
    with pytest.raises(UserError) as raised:
        load_rig(path)
    assert str(raised.value).startswith(f"{path}: {error.replace('`', '')}")


def test_documentation_and_example_rig_have_valid_tables(tmp_path: Path) -> None:
    (block,) = re.findall(r"```toml\n(\[animator\.vmc\].*?)```", (ROOT / "docs" / "outputs.md").read_text(), re.DOTALL)
    table = load_rig(write_rig(tmp_path, RIG + block)).animator
    assert table.outputs == {name: OUTPUTS.row(name).table() for name in OUTPUTS.own}
    example = (ROOT / "deploy" / "rigs" / "studio.toml").read_text()
    outputs = example[example.index("# [animator.vmc]") :]
    table = load_rig(write_rig(tmp_path, RIG + re.sub(r"^# ", "", outputs, flags=re.MULTILINE))).animator
    assert (table.outputs["vmc"], table.outputs["vrchat"]) == (VmcTable(), VrchatTable())
    assert table.outputs["lsl"] == LslTable(stream="studio")
    assert table.outputs["ros"] == RosTable()


@pytest.mark.parametrize("name", OUTPUTS.names())
def test_a_row_has_defaults_and_names_what_opens_it(name: str) -> None:
    row = OUTPUTS.row(name)
    assert row.name == name
    assert row.problem(row.table()) is None
    assert callable(attribute(row.open))
