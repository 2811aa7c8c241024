"""One set of instructions on every x86-64 processor."""

import os
import subprocess
import sys

import pytest

from zenocap.common.processor import AVX2, OWN, WITHOUT_AVX512, _without_avx512, instructions
from zenocap.common.runtime.service_info import versions

OLD, NEW = {"avx2", "fma"}, {"avx2", "fma", "avx512f"}
LOADED = """
import zenocap, numpy, scipy.linalg
from threadpoolctl import threadpool_info
print(*{each["architecture"] for each in threadpool_info() if each["internal_api"] == "openblas"})
print(*[name for name in numpy.show_config(mode="dicts")["SIMD Extensions"]["found"] if "512" in name or "V4" in name])
"""


def test_avx512_is_left_out_for_this_process_and_its_children() -> None:
    environment: dict[str, str] = {}
    assert _without_avx512(NEW, environment, late=False) == AVX2
    assert environment == WITHOUT_AVX512
    assert _without_avx512(NEW, environment, late=True) == AVX2  # inherited, so numpy has read it


def test_a_processor_without_avx512_needs_nothing_and_one_without_avx2_is_left_alone() -> None:
    environment: dict[str, str] = {}
    assert _without_avx512(OLD, environment, late=True) == AVX2
    assert _without_avx512({"sse4_2"}, environment, late=False) == OWN
    assert environment == {}


def test_numpy_imported_before_and_a_choice_of_the_user_are_said() -> None:
    assert _without_avx512(NEW, {}, late=True) == OWN
    assert _without_avx512(NEW, {"OPENBLAS_CORETYPE": "SkylakeX"}, late=False) == OWN


def test_a_take_says_which_instructions() -> None:
    assert versions()["instructions"] == instructions()


@pytest.mark.skipif(instructions() != AVX2, reason="no AVX2 on this processor")
def test_numpy_and_both_blas_take_it() -> None:
    environment = {name: value for name, value in os.environ.items() if name not in WITHOUT_AVX512}
    command = [sys.executable, "-W", "error::ImportWarning", "-c", LOADED]
    done = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
    architectures, newer = done.stdout.splitlines()
    assert set(architectures.split()) <= {"Haswell", "Zen"}
    assert newer == ""
