"""Output of `zenocap certs`: the certificates created, and the files that each machine needs."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Group
from rich.table import Table
from rich.text import Text

from zenocap.common.bus.access import OPERATOR, READER, RECORDER, REPLAY, ROUTER
from zenocap.common.rig.security import AUTHORITY, certificate_file, key_file
from zenocap.tools.setup.certificates.folder import MemberCertificate

MACHINES = {
    ROUTER: "the router's machine",
    READER: "machines that read: zenocap top, doctor, up",
    RECORDER: "machines that record: zenocap record",
    OPERATOR: "the machine that films: zenocap film; may copy pictures, protect it",
    REPLAY: "machines that replay takes: may publish on every key, protect it",
}


def report(rig: str, rig_file: Path, folder: Path, made: Sequence[MemberCertificate], *, secured: bool) -> Group:
    """Text for the terminal.  secured: whether the rig file already has its [security] table."""
    table = Table(title=f"certificates of rig {rig} in {folder}", title_justify="left")
    for heading in ("name", "", "valid until", "hosts", "for"):
        table.add_column(heading, overflow="fold")
    for one in made:
        where = MACHINES.get(one.member.service, f"the machine of {one.member.name}")
        table.add_row(one.member.name, one.done, f"{one.ends:%Y-%m-%d}", ", ".join(one.hosts), where)
    example = made[0].member.name
    files = certificate_file(folder, AUTHORITY), certificate_file(folder, example), key_file(folder, example)
    public, own, secret = (path.name for path in files)
    lines = [
        f"Each machine: the rig file and its calibration, and in {folder.name}/ beside it {public}, and of its own "
        f"service only the two files NAME.pem and NAME-key.pem, such as {own} and {secret}.",
        f"Keep {key_file(folder, AUTHORITY).name} here, or offline: its holder can create certificates.",
    ]
    if not secured:
        lines.append(f'In {rig_file}, on every machine: [security] with certificates = "{folder.name}"')
    return Group(table, *(Text(line) for line in lines))
