"""The processor of this machine, and the set of instructions that numpy and OpenBLAS use on it.

With AVX-512 the last digits of sines and of matrix products are others than without.  So that a take is recomputed to the
same bytes on every x86-64 processor since about 2015, all use AVX2; on other processors the last digits may differ.
"""

import os
import platform
import sys
import warnings
from collections.abc import MutableMapping
from functools import cache
from pathlib import Path

AVX2, OWN = "AVX2", "those of the processor"
# Read once, when numpy is first imported.  numpy's names are those from 2.4 on and those before; it warns of unknown ones.
WITHOUT_AVX512 = {"OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512F AVX512CD AVX512_SKX"}


@cache
def instructions() -> str:
    """AVX2, or OWN.  The first call, when the package is imported, makes it AVX2 where the processor has it."""
    return _without_avx512(set(_described().get("flags", "").split()), os.environ, "numpy" in sys.modules)


def processor() -> str:
    """Return the processor's name, family and model.

    The name alone does not distinguish generations: virtual machines replace it.
    """
    fields = _described()
    if "model name" not in fields:
        return platform.processor() or platform.machine()
    return f"{fields['model name']}, family {fields.get('cpu family', '?')}, model {fields.get('model', '?')}"


def _without_avx512(flags: set[str], environment: MutableMapping[str, str], late: bool) -> str:
    """Set what is not set, for this process and those that it starts.  late: numpy has read the environment before."""
    if not {"avx2", "fma"} <= flags:
        return OWN
    if "avx512f" not in flags:
        return AVX2
    warnings.filterwarnings("ignore", "During parsing environment variable: 'NPY_DISABLE", ImportWarning)
    late = late and any(name not in environment for name in WITHOUT_AVX512)
    for name, value in WITHOUT_AVX512.items():
        environment.setdefault(name, value)
    return OWN if late or any(environment[name] != value for name, value in WITHOUT_AVX512.items()) else AVX2


@cache
def _described() -> dict[str, str]:
    """What Linux says of the first processor, by name."""
    cpuinfo = Path("/proc/cpuinfo")
    first = cpuinfo.read_text().split("\n\n")[0] if cpuinfo.is_file() else ""
    return {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in first.splitlines())}
