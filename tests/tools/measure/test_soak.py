"""Trends of a soak test."""

from dataclasses import replace

from zenocap.tools.measure.latency import Figures
from zenocap.tools.measure.resources import ProcessKey, ProcessSample
from zenocap.tools.measure.soak import Bucket, trends

INTEGRATOR: ProcessKey = ("load-1", "integrator", "main")
RESTARTED_VIEWER: ProcessKey = ("load-1", "viewer", "2")


def bucket(number: int, memory: float = 100e6, handles: int = 20, p99: float = 10.0, shared: int = 0) -> Bucket:
    found = Figures(300, 300, 0, 0, 60.0, 60.0, {"p50": p99 / 2, "p99": p99}, {}, {}, 0.0, ())
    sample = ProcessSample(1, 0.0, 0.0, int(memory), handles, 5)
    return Bucket(10.0 * number, found, {INTEGRATOR: sample, RESTARTED_VIEWER: sample}, (shared, 0))


def flat(buckets: list[Bucket]) -> dict[str, bool]:
    return {trend.what: trend.flat for trend in trends(buckets, {"load-1 viewer 2"})}


def test_a_constant_quantity_is_flat() -> None:
    found = flat([bucket(k, memory=100e6 + 1e5 * (k % 3)) for k in range(60)])
    assert found == {
        "load-1 integrator: memory": True, "load-1 integrator: handles": True, "load-1 integrator: threads": True,
        "shared memory": True, "disk without takes: growth": True, "takes of a fifth of the time": True,
        "latency p50": True, "latency p99": True,
    }  # fmt: skip


def test_a_growing_quantity_is_not_flat() -> None:
    assert not flat([bucket(k, memory=100e6 + 3e5 * k) for k in range(60)])["load-1 integrator: memory"]
    assert not flat([bucket(k, handles=20 + k // 5) for k in range(60)])["load-1 integrator: handles"]
    assert not flat([bucket(k, p99=10.0 + 0.2 * k) for k in range(60)])["latency p99"]
    assert not flat([bucket(k, shared=10**6 * k) for k in range(60)])["shared memory"]


def test_a_disk_that_fills_is_not_flat_and_takes_may_grow_evenly() -> None:
    def disk(takes: float, others: float) -> list[bool]:
        found = flat([replace(bucket(k), disk=(takes * k, 1e9 + others * k)) for k in range(60)])
        return [found["takes of a fifth of the time"], found["disk without takes: growth"]]

    assert disk(3e6, 0.0) == [True, True]
    assert disk(0.0, 1e6) == [True, False]
    faster = [replace(bucket(k), disk=(1e4 * k**2, 1e9)) for k in range(60)]
    assert not flat(faster)["takes of a fifth of the time"]


def test_growth_before_settling_is_flat() -> None:
    assert flat([bucket(k, memory=60e6 + 4e6 * min(k, 10)) for k in range(60)])["load-1 integrator: memory"]


def test_a_few_buckets_give_no_trend() -> None:
    assert trends([bucket(0), bucket(1)], set()) == ()
