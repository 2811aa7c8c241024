"""Lines that only the last tier reaches."""

from tests.measures.coverage import only_last
from tests.support.places import ROOT


def test_lines_of_the_last_tier_are_listed_by_file_without_those_of_packages_that_tests_write() -> None:
    before = {"common/jit.py": {"executed_lines": [1, 2]}, f"{ROOT}/tools/parameters.py": {"executed_lines": [5]}}
    last = {"common/jit.py": [2, 9, 3], f"{ROOT}/tools/parameters.py": [5], "/elsewhere/zenocap/callee.py": [1]}
    after = {name: {"executed_lines": lines} for name, lines in last.items()}
    assert only_last(before, after) == [("common/jit.py", [3, 9])]
