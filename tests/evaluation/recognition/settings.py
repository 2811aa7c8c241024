"""Which settings are best, on people who are in no test."""

from collections.abc import Iterable
from dataclasses import replace

from services.recognizer.examples import SCALES, TOPOLOGIES, Plan
from services.recognizer.features import KINDS
from services.recognizer.protocols import evaluated
from services.takes.act.stage import Method
from tests.evaluation.recognition.bench import SETTINGS_SEED, Bench
from tests.evaluation.sections import Row, Section, Table

METHODS: tuple[Method, ...] = ("two-view", "truth")


def plans() -> Iterable[tuple[str, Plan]]:
    """The default, and it with one setting otherwise."""
    base = Plan(folds=0)
    every: dict[str, list[Plan]] = {
        "features": [replace(base, features=kind) for kind in KINDS],
        "scale": [replace(base, scale=scale) for scale in SCALES],
        "topology": [replace(base, topology=topology) for topology in TOPOLOGIES],
        "floor": [replace(base, floor=floor) for floor in (0.001, 0.003, 0.01, 0.03, 0.1)],
        "spread": [replace(base, spread=spread) for spread in (0.0, 0.5, 1.0, 1.5)],
        "states": [replace(base, states=states) for states in (3, 4, 5, 6, 8)],
        "symbols": [replace(base, symbols=symbols) for symbols in (32, 48, 64, 96, 128)],
        "restarts": [replace(base, restarts=restarts) for restarts in (1, 3)],
        "rate": [replace(base, rate=rate) for rate in (10.0, 15.0, 30.0)],
    }
    yield "as it comes", base
    for name, each in every.items():
        yield from ((f"{name} {getattr(plan, name)}", plan) for plan in each if plan != base)


def settings(bench: Bench) -> Section:
    rows: list[Row] = []
    for words, plan in plans():
        counts = []
        for method in METHODS:
            found = bench.examples(method, SETTINGS_SEED, plan.features)
            counts += [evaluated(found, plan, "subjects").right, evaluated(found, plan, "paper").right]
        rows.append((words, *counts))
        print(words, *counts, flush=True)
    notes = (
        f"Of {len(bench.acts(SETTINGS_SEED))} postures by the people of seed {SETTINGS_SEED}, who are in no test. One "
        f"setting at a time is other than it comes: {Plan()}.",
    )
    columns = ("setting", "two-view subjects", "two-view paper", "truth subjects", "truth paper")
    return Section("settings", "Settings", notes, (Table("Recognised", columns, tuple(rows)),))
