"""Zenoh options of a set-up, kept in its folder and in the rig file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from zenocap.common.errors import UserError
from zenocap.common.rig.file import MODES
from zenocap.common.toml_file import quoted
from zenocap.tools.service_arguments import ZenohArguments


@dataclass(frozen=True)
class Network:
    """As the table `[zenoh]` of a rig file.  mode: empty for the default.  config: absolute path, empty for none."""

    mode: Literal["", "peer", "client", "router"] = ""
    connect: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()
    config: str = ""
    multicast_scouting: bool = True

    def words(self) -> list[str]:
        """Options of a command."""
        arguments = ZenohArguments(
            connect=list(self.connect),
            config=Path(self.config) if self.config else None,
            listen=list(self.listen),
            no_multicast_scouting=not self.multicast_scouting,
            mode=self.mode or None,
        )
        return arguments.words()

    @classmethod
    def of(cls, given: ZenohArguments) -> Network:
        """The options of a command."""
        config = "" if given.config is None else str(given.config.resolve())
        endpoints = tuple(given.connect or ()), tuple(given.listen or ())
        return cls(given.mode or "", *endpoints, config, not given.no_multicast_scouting)

    def lines(self) -> list[str]:
        """The table `[zenoh]`; empty for the defaults."""
        if self == OPEN:
            return []
        found = ["", "[zenoh]"]
        found += [f'mode = "{self.mode}"'] if self.mode else []
        for name, endpoints in (("connect", self.connect), ("listen", self.listen)):
            found += [f"{name} = [{', '.join(map(quoted, endpoints))}]"] if endpoints else []
        found += [f"config = {quoted(self.config)}"] if self.config else []
        return [*found, *["multicast_scouting = false"] * (not self.multicast_scouting)]


OPEN = Network()  # found by multicast


def network_of(path: Path, table: object) -> Network:
    """The table `zenoh` of a set-up's file.  Raises UserError."""
    if table is None:
        return OPEN
    allowed = "a table with mode, connect, listen, config, multicast_scouting, as in a rig file"
    if not isinstance(table, Mapping) or set(table) - {"mode", "connect", "listen", "config", "multicast_scouting"}:
        raise UserError(f"{path}: zenoh: allowed: {allowed}")
    mode, config, multicast = table.get("mode", ""), table.get("config", ""), table.get("multicast_scouting", True)
    if mode not in ("", *MODES):
        raise UserError(f"{path}: zenoh.mode = {mode!r}: allowed: {', '.join(MODES)}")
    endpoints: dict[str, tuple[str, ...]] = {}
    for key in ("connect", "listen"):
        values = table.get(key, [])
        if not isinstance(values, list) or not all(isinstance(one, str) for one in values):
            raise UserError(f"{path}: zenoh.{key}: allowed: a list of endpoints, such as tcp/192.168.1.10:7447")
        endpoints[key] = tuple(values)
    if not isinstance(config, str) or not isinstance(multicast, bool):
        raise UserError(f"{path}: zenoh: allowed: {allowed}")
    return Network(mode, endpoints["connect"], endpoints["listen"], config, multicast)
