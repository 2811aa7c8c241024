"""Compiled kernels: numba's decorators with one set of options, kept in the user's cache.

numba's own cache is beside the sources and knows only the file of a function.  After a change of a callee or a constant it
would return the old machine code without a word, and each checkout compiles everything again.  Here an entry is named
after the contents of its file and of all files that it imports, the versions, the processor and the types of the arguments.
"""

import hashlib
import inspect
import pickle
import sys
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba import njit
from numba.core.caching import Cache
from numba.core.compiler import CompileResult
from numba.core.errors import NumbaWarning
from numba.core.serialize import dumps

from zenocap.common.cache import KERNELS, cache_folder, mark_used, read_entry, write_entry
from zenocap.common.source_digests import kernel_digests

F = TypeVar("F", bound=Callable[..., object])

# For comparisons of eight pixels as a word: with a plain 0, which is signed, a loop over words takes three times as long.
NO_BITS = np.uint64(0)
FINITE = {"nnan", "ninf", "nsz"}  # LLVM's fast-math flags that leave results alone
PACKAGE = Path(__file__).parents[1]  # as imported: inside the package, through its links
VERSIONS = f"{numba.__version__} {np.__version__} {sys.version_info[:2]}"


def kernel(function: F) -> F:
    """Compile a function, cached on disk; divisions by zero give infinity or NaN as in numpy.

    It runs without Python's global lock, so that other threads continue meanwhile.
    """
    return _compiled(function, nogil=True)


def finite_kernel(function: F) -> F:
    """The same for finite numbers only: no NaN, no infinity, which loops with min and max need to be vectorized.

    Of LLVM's fast-math flags only those that leave results alone are set.  Reordered sums and fused operations would
    make the last digits depend on whether a kernel's callees were compiled in the same process or loaded from the cache.
    """
    return _compiled(function, nogil=True, fastmath=FINITE)


def leaf_kernel(function: F) -> F:
    """The same as `kernel` for functions that create and return no array.

    References to its arguments are not counted.  That takes two atomic operations for each array of each call, more than
    the arithmetic of a short function, and threads that share the arrays wait for one another.
    """
    return _compiled(function, nogil=True, _nrt=False)


def finite_leaf_kernel(function: F) -> F:
    """The same as `finite_kernel` for functions that create and return no array."""
    return _compiled(function, nogil=True, _nrt=False, fastmath=FINITE)


def inlined_kernel(function: F) -> F:
    """The same, inlined into its callers."""
    return _compiled(function, inline="always")


def _compiled(function: F, **options: object) -> F:
    compiler = cast(Callable[..., Callable[[F], F]], njit)  # its annotations lack the option _nrt
    # Nothing here hands a kernel to C, so the wrapper for that is left out: an eighth of the time of compiling.
    dispatcher = compiler(error_model="numpy", no_cfunc_wrapper=True, **options)(function)
    if hasattr(dispatcher, "_cache"):  # not with NUMBA_DISABLE_JIT
        dispatcher._cache = KernelCache(function)
    return dispatcher


class KernelCache(Cache):  # numba's classes are untyped
    """numba's cache of a function with an entry a signature in the user's cache.

    numba's own index names numbered files; it can name the file of another signature when two processes write it at once.
    """

    def __init__(self, function: Callable[..., object]) -> None:
        self._py_func = function
        self.folder = _folder(Path(inspect.getfile(function)))
        self.prefix = f"{function.__qualname__}-{function.__code__.co_firstlineno}"
        self.enable()  # type: ignore[no-untyped-call]

    @property
    def cache_path(self) -> str:
        return str(self.folder)

    @property
    def root(self) -> Path:
        """Folder of the entries of all source files."""
        return self.folder.parents[1]

    def entries(self) -> list[Path]:
        return sorted(self.folder.glob(f"{self.prefix}-*"))

    def flush(self) -> None:
        for entry in self.entries():
            entry.unlink(missing_ok=True)

    def _load_overload(self, signature: object, context: Any) -> object:
        if not self._enabled:
            return None
        key = self._index_key(signature, context.codegen())  # type: ignore[no-untyped-call]
        content = read_entry(self._entry(key))
        if content is None:
            return None
        try:
            prefix, stored, result = pickle.loads(content)
        except Exception:  # whatever it is, such as a class that has moved: the function is compiled again
            return None
        if (prefix, stored) != (self.prefix, key):  # equal bytecode with other constants has an equal key
            return None
        return CompileResult._rebuild(context, *result)  # type: ignore[no-untyped-call]

    def _save_overload(self, signature: object, result: Any) -> None:
        if not self._enabled:
            return
        if result.library.has_dynamic_globals or not all(loop.can_cache for loop in result.lifted):
            warnings.warn(f"{self.prefix} of {inspect.getfile(self._py_func)} cannot be cached", NumbaWarning, stacklevel=2)
            return
        key = self._index_key(signature, result.codegen)  # type: ignore[no-untyped-call]
        write_entry(self._entry(key), dumps((self.prefix, key, result._reduce())))  # type: ignore[no-untyped-call]

    def _entry(self, key: object) -> Path:
        return self.folder / f"{self.prefix}-{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}"


@cache
def _folder(source: Path) -> Path:
    """Folder of the entries of a source file."""
    inside = source.is_relative_to(PACKAGE)
    name = str(source.relative_to(PACKAGE)) if inside else source.name
    digests = kernel_digests(PACKAGE, name if inside else None)
    # A file elsewhere, of a test say, may use any kernel.
    content = digests[name] if inside else "\0".join([source.read_text(encoding="utf-8"), *digests.values()])
    digest = hashlib.sha256(f"{VERSIONS}\0{content}".encode()).hexdigest()[:16]
    folder = cache_folder() / KERNELS / name.removesuffix(".py").replace("/", ".") / digest
    mark_used(folder)
    return folder
