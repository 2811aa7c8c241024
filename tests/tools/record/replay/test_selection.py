"""Selection of replayed keys: Zenoh's key expressions, and short ones below any rig."""

import pytest
import zenoh
from hypothesis import given
from hypothesis import strategies as st

from zenocap.tools.record.replay.selection import ReplaySelection, full

KEYS = (
    "zenocap/demo/viewer/1/bap",
    "zenocap/demo/viewer/2/bap",
    "zenocap/demo/viewer/2/silhouette",
    "zenocap/demo/integrator/bap",
    "zenocap/demo/integrator/main/health",
    "zenocap/lab/viewer/1/bap",
    "zenocap/demo/integrator/main/handled",
)
PART = st.sampled_from(["zenocap", "demo", "viewer", "1", "bap", "*", "**", "v$*", "$*er"])
KEY_PART = st.sampled_from(["zenocap", "demo", "viewer", "1", "bap", "v", "er"])


def test_default_selection_excludes_input_traces() -> None:
    assert ReplaySelection().of(KEYS) == list(KEYS[:-1])


@pytest.mark.parametrize(
    ("topics", "numbers"),
    [
        (("viewer/**",), [0, 1, 2, 5]),
        (("viewer/1/*",), [0, 5]),
        (("viewer/*/bap", "integrator/bap"), [0, 1, 3, 5]),
        (("zenocap/lab/**",), [5]),
        (("zenocap/*/viewer/**",), [0, 1, 2, 5]),
        (("**/health",), [4]),
        (("viewer/2/sil*",), [2]),
        (("integrator/**",), [3, 4]),
        (("**/handled",), [6]),
        (("viewer",), []),
    ],
)
def test_only_requested_topics_are_selected(topics: tuple[str, ...], numbers: list[int]) -> None:
    assert ReplaySelection(topics).of(KEYS) == [KEYS[number] for number in numbers]


def test_excluded_topics_are_not_selected() -> None:
    assert ReplaySelection(("viewer/**",), ("viewer/2/**", "zenocap/lab/**")).of(KEYS) == [KEYS[0]]
    assert ReplaySelection((), ("viewer/**",)).of(KEYS) == list(KEYS[3:5])


@given(st.lists(PART, min_size=1, max_size=5), st.lists(KEY_PART, min_size=1, max_size=6))
def test_expressions_match_the_same_keys_as_in_zenoh(parts: list[str], key_parts: list[str]) -> None:
    expression, key = "/".join(["zenocap", *parts]), "/".join(["zenocap", *key_parts])
    oracle = zenoh.KeyExpr.autocanonize(expression).includes(key)
    assert ReplaySelection((expression,)).takes(key) == oracle
    leading = "/".join(["**", *parts])
    assert ReplaySelection((leading,)).takes(key) == zenoh.KeyExpr.autocanonize(leading).includes(key)


@given(st.sampled_from(KEYS))
def test_short_expression_matches_below_any_rig(key: str) -> None:
    short = key.split("/", 2)[2]
    assert full(short) == f"zenocap/*/{short}"
    assert ReplaySelection((short,)).takes(key)


@pytest.mark.parametrize("expression", ["", "/viewer", "viewer/", "viewer//bap", "viewer/?", "viewer#1"])
def test_invalid_expression_error_names_the_option(expression: str) -> None:
    with pytest.raises(ValueError, match="--topics '"):
        ReplaySelection((expression,))
    with pytest.raises(ValueError, match="--exclude '"):
        ReplaySelection((), (expression,))
