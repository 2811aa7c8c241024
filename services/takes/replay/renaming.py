"""Replaying under other names: keys, and the names that the messages themselves carry.  Pure."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TypeVar

import msgspec

from common import messages as m
from common.topics import PARTIAL_BAP, Topic, checked_name, topic_at
from services.takes.replay.selection import ROOT

SEPARATOR = ":="
T = TypeVar("T")


@dataclass(frozen=True)
class Rename:
    """old, new: prefixes of keys, by whole parts; below the rig's key unless they begin with `zenocap/`."""

    old: str
    new: str


def parsed_rename(text: str) -> Rename:
    """The rename that OLD:=NEW means.  Raises ValueError."""
    old, mark, new = text.partition(SEPARATOR)
    if not mark or not all(part for side in (old, new) for part in side.split("/")) or "*" in text:
        raise ValueError(f"--remap {text!r}: OLD:=NEW expected, such as viewer/1:=viewer/3 or {ROOT}/demo:={ROOT}/lab")
    if old.startswith(f"{ROOT}/") != new.startswith(f"{ROOT}/"):
        raise ValueError(f"--remap {text!r}: both sides begin with {ROOT}/, or none")
    return Rename(old, new)


@dataclass(frozen=True)
class Renaming:
    """renames: the first that fits a key is used.  rig: the new name of every rig, after them; None to keep it."""

    renames: tuple[Rename, ...] = ()
    rig: str | None = None

    def __post_init__(self) -> None:
        """Raises ValueError for a bad rig name."""
        if self.rig is not None:
            checked_name("--rig", self.rig)

    def __bool__(self) -> bool:
        return bool(self.renames) or self.rig is not None

    def key(self, key: str) -> str:
        """The new key.  Raises ValueError when it carries another kind of message than the old one."""
        _, rig, rest = key.split("/", 2)
        for rename in self.renames:
            if rename.old.startswith(f"{ROOT}/"):
                found = _replaced(key, rename)
                if found is not None:
                    _, rig, rest = found.split("/", 2) if found.count("/") > 1 else ("", "", "")
                    break
            elif (found := _replaced(rest, rename)) is not None:
                rest = found
                break
        new = f"{ROOT}/{self.rig or rig}/{rest}"
        before, after = topic_at(key), topic_at(new)
        if before is None or after is not before:
            raise ValueError(f"--remap: {key} would become {new}, which is no key of {before.name if before else 'ours'}")
        for field, name in (after.names(new) or {}).items():
            checked_name(f"--remap: {field}", name)
        return new

    def message(self, topic: Topic, message: m.Message, key: str) -> m.Message:
        """The message of the old `key` with the names of its new one, and with the new names of viewers it tells of."""
        rig, names = key.split("/")[1], topic.names(self.key(key)) or {}
        own = {field: names[field] for field in topic.names_of(message)}
        renamed = msgspec.structs.replace(message, **own)
        match renamed:
            case m.Assignment(views=views):
                return msgspec.structs.replace(renamed, views=self._viewers(rig, views))
            case m.UniversalBap(scores=scores, views=seen, stale=stale):
                return msgspec.structs.replace(
                    renamed,
                    scores=self._viewers(rig, scores),
                    views=self._viewers(rig, seen),
                    stale=[self._viewer(rig, viewer) for viewer in stale],
                )
            case _:
                return renamed

    def _viewers(self, rig: str, by_viewer: Mapping[str, T]) -> dict[str, T]:
        return {self._viewer(rig, viewer): value for viewer, value in by_viewer.items()}

    def _viewer(self, rig: str, viewer: str) -> str:
        names = PARTIAL_BAP.names(self.key(PARTIAL_BAP.at(rig, viewer=viewer)))
        return names["viewer"] if names else viewer


def renamed_keys(renaming: Renaming, keys: Iterable[str]) -> dict[str, str]:
    """New keys by old ones.  Raises ValueError when two keys would become one, or the rigs several."""
    new = {key: renaming.key(key) for key in keys}
    before: dict[str, str] = {}
    for old, key in new.items():
        if key in before:
            raise ValueError(f"--remap: {before[key]} and {old} would both become {key}")
        before[key] = old
    return new


def _replaced(key: str, rename: Rename) -> str | None:
    if key == rename.old:
        return rename.new
    return rename.new + key.removeprefix(rename.old) if key.startswith(f"{rename.old}/") else None
