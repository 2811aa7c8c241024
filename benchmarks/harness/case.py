"""A case and a kind of benchmark: what one run measures, and a row of the table of kinds."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import mean, median
from typing import Literal, TypeVar

from zenocap.common.errors import UserError

Value = str | int | float | bool | tuple[str, ...] | tuple[int, ...] | tuple[float, ...]
Figures = Mapping[str, float]  # by column; NaN: no such figure in this run
T = TypeVar("T")
SHARED = Path(__file__).resolve().parents[2].parent / "shared"  # clips and motion capture beside the checkout


@dataclass(frozen=True)
class Case:
    """film: clip, motion or scene that is given.  options: by name, sorted; what is left out has its default."""

    film: str
    seed: int = 0
    options: tuple[tuple[str, Value], ...] = ()

    def option(self, name: str, default: T) -> T:
        """Value of an option.  Raises ValueError where its type is not that of the default."""
        value = dict(self.options).get(name, default)
        if type(value) is not type(default):
            raise ValueError(f"{self.film}: {name} = {value!r}: {type(default).__name__} expected")
        return value

    def with_options(self, **options: Value) -> "Case":
        return replace(self, options=tuple(sorted((dict(self.options) | options).items())))

    def of_seed(self, seed: int) -> "Case":
        return replace(self, seed=seed)


def case(film: str, **options: Value) -> Case:
    """Case of seed 0."""
    return Case(film).with_options(**options)


@dataclass(frozen=True)
class Quantity:
    """A figure.  unit: "" for a number without one.  digits: after the point.

    joined: how the seeds make one figure.  worst: the end that is worse; "" where none is.
    """

    name: str
    unit: str = ""
    digits: int = 1
    worst: Literal["high", "low", ""] = "high"
    joined: Literal["mean", "median", "sum"] = "mean"

    def summary(self, values: Sequence[float]) -> list[float | None]:
        """Joined figure over the seeds that have it, and the worst one where there are several; None without any."""
        known = [value for value in values if math.isfinite(value)]
        if not known:
            return [None]
        joined = sum(known) if self.joined == "sum" else mean(known) if self.joined == "mean" else median(known)
        if len(values) == 1 or self.joined == "sum" or not self.worst:
            return [_rounded(joined)]
        return [_rounded(joined), _rounded(max(known) if self.worst == "high" else min(known))]


@dataclass(frozen=True)
class Kind:
    """Row of the table of kinds.

    about: what is measured and how, one or two sentences of the page.  run: one run of one case; its module and all that
    this imports decide whether a result is up to date.  cases: by name.  small: the case that the smoke test runs.
    seeds: of every case, 1 where nothing is random.  rows: what the cases are, header of the first column.  timed: depends
    on the machine, hence never cached and never beside another run.  inputs: in `SHARED`, that a case reads.
    """

    name: str
    about: str
    run: Callable[[Case], Figures]
    columns: tuple[Quantity, ...]
    cases: Mapping[str, Case]
    small: Case
    seeds: int = 3
    rows: str = "case"
    timed: bool = False
    inputs: Callable[[Case], Sequence[str]] = field(default=lambda _: ())

    @property
    def module(self) -> str:
        return self.run.__module__

    def selected(self, patterns: Sequence[str]) -> Mapping[str, Case]:
        """Cases that a pattern names, or has in their name; all for none.  Raises UserError where a pattern has no case."""
        for pattern in patterns:
            if not any(pattern in name for name in self.cases):
                raise UserError(f"{self.name}: --only {pattern!r}: allowed: a part of {', '.join(self.cases)}")
        wanted = set(patterns)
        parts = wanted - set(self.cases)
        return {
            name: one
            for name, one in self.cases.items()
            if not patterns or name in wanted or any(part in name for part in parts)
        }

    def missing(self, one: Case) -> list[str]:
        """Inputs that are not beside the checkout."""
        return [name for name in self.inputs(one) if not (SHARED / name).exists()]


def _rounded(value: float) -> float:
    return float(f"{value:.5g}")
