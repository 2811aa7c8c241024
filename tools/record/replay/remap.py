"""Replay under other names: keys, and the names inside messages.  Pure."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TypeVar

from msgspec.structs import replace

from zenocap.common import messages as m
from zenocap.common.topics import PARTIAL_BAP, Topic, checked_name, topic_at
from zenocap.tools.record.replay.selection import ROOT

T = TypeVar("T")


@dataclass(frozen=True)
class Remap:
    """One renaming of keys.

    old, new: prefixes of keys, by whole parts; below the rig's key unless they begin with `zenocap/`.
    """

    old: str
    new: str


def parsed_remap(text: str) -> Remap:
    """Parse OLD:=NEW.  Raises ValueError."""
    old, mark, new = text.partition(":=")
    if not mark or not all(part for side in (old, new) for part in side.split("/")) or "*" in text:
        raise ValueError(f"--remap {text!r}: OLD:=NEW expected, such as viewer/1:=viewer/3 or {ROOT}/demo:={ROOT}/lab")
    if old.startswith(f"{ROOT}/") != new.startswith(f"{ROOT}/"):
        raise ValueError(f"--remap {text!r}: both sides begin with {ROOT}/, or none")
    return Remap(old, new)


@dataclass(frozen=True)
class Remapping:
    """Renaming of keys and rigs.

    remaps: the first that matches a key is used.  rig: the new name of every rig, after them; None to keep it.
    """

    remaps: tuple[Remap, ...] = ()
    rig: str | None = None

    def __post_init__(self) -> None:
        """Raises ValueError for a bad rig name."""
        if self.rig is not None:
            checked_name("--rig", self.rig)

    def __bool__(self) -> bool:
        return bool(self.remaps) or self.rig is not None

    def key(self, key: str) -> str:
        """Return the new key.  Raises ValueError when its topic differs from that of the old one."""
        _, rig, rest = key.split("/", 2)
        for remap in self.remaps:
            if remap.old.startswith(f"{ROOT}/"):
                if (found := _replaced(key, remap)) is not None:
                    _, rig, rest = found.split("/", 2) if found.count("/") > 1 else ("", "", "")
                    break
            elif (found := _replaced(rest, remap)) is not None:
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
        """The message of the old `key` with the names of the new one, also of viewers in its fields."""
        rig, names = key.split("/")[1], topic.names(self.key(key)) or {}
        own = {field: names[field] for field in topic.names_of(message)}
        renamed = replace(message, **own)
        match renamed:
            case m.Assignment(views=views):
                return replace(renamed, views=self._viewers(rig, views))
            case m.UniversalBap(scores=scores, views=seen, stale=stale):
                late = [self._viewer(rig, viewer) for viewer in stale]
                return replace(renamed, scores=self._viewers(rig, scores), views=self._viewers(rig, seen), stale=late)
            case _:
                return renamed

    def _viewers(self, rig: str, by_viewer: Mapping[str, T]) -> dict[str, T]:
        return {self._viewer(rig, viewer): value for viewer, value in by_viewer.items()}

    def _viewer(self, rig: str, viewer: str) -> str:
        names = PARTIAL_BAP.names(self.key(PARTIAL_BAP.at(rig, viewer=viewer)))
        return names["viewer"] if names else viewer


def remapped_keys(remapping: Remapping, keys: Iterable[str]) -> dict[str, str]:
    """New keys by old ones.  Raises ValueError when two keys become one."""
    new = {key: remapping.key(key) for key in keys}
    before: dict[str, str] = {}
    for old, key in new.items():
        if key in before:
            raise ValueError(f"--remap: {before[key]} and {old} would both become {key}")
        before[key] = old
    return new


def _replaced(key: str, remap: Remap) -> str | None:
    if key == remap.old:
        return remap.new
    return remap.new + key.removeprefix(remap.old) if key.startswith(f"{remap.old}/") else None
