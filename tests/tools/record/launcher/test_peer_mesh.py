"""Peer mesh: exactly one member of each pair connects to the other."""

from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from zenocap.tools.record.launcher.peer_mesh import peer_mesh


@given(st.lists(st.integers(1024, 65535), min_size=1, max_size=8, unique=True))
def test_each_pair_has_one_link(ports: list[int]) -> None:
    for one, other in combinations(peer_mesh(ports), 2):
        assert (other.listen in one.connect) + (one.listen in other.connect) == 1
