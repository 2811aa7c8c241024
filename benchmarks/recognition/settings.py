"""Comparison of the classifiers and of the settings of the paper's one, on people outside of all tests."""

from collections.abc import Iterable
from dataclasses import replace

from benchmarks.recognition.bench import SETTINGS_SEED, Bench
from benchmarks.sections import Row, Section, Table
from zenocap.services.recognizer.features import KINDS
from zenocap.services.recognizer.training.cross_validation import cross_validate
from zenocap.services.recognizer.training.examples import SCALES, TOPOLOGIES, TrainingSettings
from zenocap.tools.dataset.generate import Method

METHODS: tuple[Method, ...] = ("two-view", "truth")


def plans() -> Iterable[tuple[str, TrainingSettings]]:
    """The default, the paper's classifier, and variants of the latter with one setting changed."""
    base = TrainingSettings(classifier="paper", folds=0)
    variants: dict[str, list[TrainingSettings]] = {
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
    yield "forest", replace(base, classifier="forest")
    yield "paper", base
    for name, plans_of_setting in variants.items():
        yield from ((f"{name} {getattr(plan, name)}", plan) for plan in plans_of_setting if plan != base)


def settings(bench: Bench) -> Section:
    rows: list[Row] = []
    for label, plan in plans():
        counts = []
        for method in METHODS:
            found = bench.examples(method, SETTINGS_SEED, plan.features)
            counts += [cross_validate(found, plan, "subjects").right, cross_validate(found, plan, "paper").right]
        rows.append((label, *counts))
        print(label, *counts, flush=True)
    count = len(bench.posture_takes(SETTINGS_SEED))
    notes = (
        f"Of {count} postures by the people of seed {SETTINGS_SEED}, who are in no test. One setting at a time differs "
        f"from the second row: {TrainingSettings(classifier='paper')}.",
    )
    columns = ("setting", "two-view subjects", "two-view paper", "truth subjects", "truth paper")
    return Section("settings", "Settings", notes, (Table("Recognized", columns, tuple(rows)),))
