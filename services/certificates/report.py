"""What `zenocap certs` says: what was made, and what goes where."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Group
from rich.table import Table
from rich.text import Text

from common.bus.access import READER, RECORDER, REPLAY, ROUTER
from common.runtime.security import AUTHORITY, certificate_file, key_file
from services.certificates.folder import Made

WHOSE = {
    ROUTER: "the router's machine",
    READER: "where somebody looks: zenocap top, doctor, up",
    RECORDER: "where somebody records: zenocap record",
    REPLAY: "where takes are replayed: may say everything, keep it with care",
}


def report(rig: str, rig_file: Path, folder: Path, made: Sequence[Made], *, secured: bool) -> Group:
    """secured: the rig file has its [security] table already."""
    table = Table(title=f"certificates of rig {rig} in {folder}", title_justify="left")
    for heading in ("name", "", "valid until", "called by", "goes to"):
        table.add_column(heading, overflow="fold")
    for one in made:
        where = WHOSE.get(one.member.service, f"the machine of {one.member.name}")
        table.add_row(one.member.name, one.done, f"{one.ends:%Y-%m-%d}", ", ".join(one.hosts), where)
    example = made[0].member.name
    public, own, secret = (path.name for path in _files(folder, example))
    lines = [
        f"Each machine: the rig file and its calibration, and in {folder.name}/ beside it {public}, and of its own "
        f"service alone the two files NAME.pem and NAME-key.pem, such as {own} and {secret}.",
        f"Keep {key_file(folder, AUTHORITY).name} here, or offline: who has it can make certificates.",
    ]
    if not secured:
        lines.append(f'In {rig_file}, on every machine: [security] with certificates = "{folder.name}"')
    return Group(table, *(Text(line) for line in lines))


def _files(folder: Path, name: str) -> tuple[Path, Path, Path]:
    return certificate_file(folder, AUTHORITY), certificate_file(folder, name), key_file(folder, name)
