"""The layers of the package, checked by reading the imports.

Dependencies run one way: tools -> services -> simulation -> common.  Services never import each other.  `common/body`,
`common/camera`, `common/vision` and `simulation` are mathematics on arrays.  Everything that a service's `step.py`
imports, directly or not, is free of threads, sockets, files and clocks.
"""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from tests.measures.house import statements
from tests.support.places import ROOT

ROOMS = ("cli", "measure", "teach", "record", "operate", "setup", "takes", "judge")  # of tools, by what their user does
LAYERS = ("common", "simulation", "services", "tools")  # each may import itself and the earlier ones
MATHEMATICS = ("common/body", "common/camera", "common/vision", "simulation")
ARRAYS = tuple(f"zenocap.{folder.replace('/', '.')}" for folder in MATHEMATICS)
OUTSIDE = ("logging", "time", "threading", "socket", "subprocess", "random", "zenoh", "mcap", "msgpack")
PACKAGES = tuple(sorted(path.name for path in (ROOT / "zenocap").iterdir() if path.is_symlink()))
HIDDEN = {".venv", "build", ".git"}
SERVICES = sorted(path.parent.name for path in (ROOT / "services").glob("*/shell.py"))
STEPPED = tuple(
    sorted(".".join(path.relative_to(ROOT / "services").parts[:-1]) for path in (ROOT / "services").rglob("step.py"))
)  # the services with a pure step, and the rooms in them that have one of their own


def module_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    if parts[0] in PACKAGES:
        parts = ("zenocap", *parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def path_of(module: str) -> Path | None:
    """Source file of a module of this package; None for folders and other packages."""
    path = (ROOT / "zenocap").joinpath(*module.split(".")[1:]).with_suffix(".py")
    return path if module.startswith("zenocap.") and path.is_file() else None


def sources(*folders: str) -> list[Path]:
    found = sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))
    assert found, f"no sources in {folders}"
    return found


MODULES = {module_of(path): path for path in sources(*PACKAGES)}


@cache
def tree(module: str) -> ast.Module:
    """Syntax tree of a module."""
    path = MODULES[module]
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


def names_in(nodes: Iterator[ast.AST]) -> Iterator[str]:
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports hide where a name lives"
            assert node.module
            yield node.module
            full = (f"{node.module}.{alias.name}" for alias in node.names)
            yield from (name for name in full if name in MODULES)


@cache
def imported(module: str) -> frozenset[str]:
    """Full names of the modules that a module imports, including imports inside functions."""
    return frozenset(names_in(statements(tree(module).body)))


def within(module: str, places: tuple[str, ...]) -> bool:
    return any(module == place or module.startswith(f"{place}.") for place in places)


def internal_imports(module: str) -> set[str]:
    """Modules of this package that a module imports."""
    return {name for name in imported(module) if name in MODULES and path_of(name) is not None}


def closure(module: str) -> set[str]:
    """A module and all modules of this package that it imports, directly or indirectly."""
    seen: set[str] = set()
    waiting = [module]
    while waiting:
        if (name := waiting.pop()) not in seen:
            seen.add(name)
            waiting += internal_imports(name)
    return seen


def test_the_layers_are_the_sub_packages() -> None:
    """Each top-level folder of the package is linked into zenocap/, and has its place among the layers."""
    assert sorted(LAYERS) == list(PACKAGES)
    assert [name for name in PACKAGES if (ROOT / "zenocap" / name).resolve() != ROOT / name] == []


@pytest.mark.nightly
def test_no_file_imports_a_top_level_folder() -> None:
    """`import zenocap.common...`, never `import common...`, which an installed package does not have."""
    files = [path for path in ROOT.rglob("*.py") if not HIDDEN & set(path.relative_to(ROOT).parts)]
    assert len(files) > len(MODULES)
    bare = re.compile(rf"^\s*(?:from|import)\s+(?:{'|'.join(PACKAGES)})\b", re.MULTILINE)
    found = [(str(path.relative_to(ROOT)), match[0]) for path in files for match in bare.finditer(path.read_text())]
    assert found == []


@pytest.mark.slow
@pytest.mark.parametrize("layer", LAYERS)
def test_dependencies_run_one_way(layer: str) -> None:
    later = tuple(f"zenocap.{name}" for name in LAYERS[LAYERS.index(layer) + 1 :])
    wrong = [
        (module_of(path), name)
        for path in sources(layer)
        for name in internal_imports(module_of(path))
        if within(name, later)
    ]
    assert wrong == []


@pytest.mark.slow
def test_no_modules_import_each_other_in_a_circle() -> None:
    """A module is read after those that it imports, also inside functions: no order of reading has a circle."""
    left = {module: internal_imports(module) - {module} for module in MODULES}
    while free := [module for module, needed in left.items() if not needed & left.keys()]:
        for module in free:
            del left[module]
    assert sorted(left) == []


@pytest.mark.nightly
def test_services_do_not_import_each_other() -> None:
    wrong = [
        (module_of(path), name)
        for service in SERVICES
        for path in sources(f"services/{service}")
        for name in internal_imports(module_of(path))
        if within(name, ("zenocap.services",)) and not within(name, (f"zenocap.services.{service}",))
    ]
    assert wrong == []


def test_every_folder_of_services_is_a_service() -> None:
    """A service has a shell, and one of a rig a step."""
    folders = {path.name for path in (ROOT / "services").iterdir() if path.is_dir() and path.name != "__pycache__"}
    assert folders == set(SERVICES)
    assert set(SERVICES) - {step.split(".")[0] for step in STEPPED} == {"camera"}


@pytest.mark.slow
def test_rooms_of_the_tools_run_one_way() -> None:
    """Each room imports itself, later ones and the files beside the rooms."""
    assert sorted(path.parent.name for path in (ROOT / "tools").glob("*/__init__.py")) == sorted(ROOMS)
    for number, room in enumerate(ROOMS):
        earlier = tuple(f"zenocap.tools.{name}" for name in ROOMS[:number])
        modules = [module_of(path) for path in sources(f"tools/{room}")]
        assert [(one, name) for one in modules for name in internal_imports(one) if within(name, earlier)] == []
    beside = [module_of(path) for path in (ROOT / "tools").glob("*.py")]
    rooms = tuple(f"zenocap.tools.{name}" for name in ROOMS)
    assert [(one, name) for one in beside for name in internal_imports(one) if within(name, rooms)] == []


@pytest.mark.parametrize("folder", MATHEMATICS)
def test_mathematics_imports_arrays_only(folder: str) -> None:
    """Calibration files are the only files read here, one kind of them in a process of its own."""
    modules, shared = [module_of(path) for path in sources(folder)], (*ARRAYS, *SHARED_VALUES)
    found = [(one, name) for one in modules for name in internal_imports(one) if not within(name, shared)]
    apart = ("zenocap.common.camera.opencv_storage", "zenocap.common.formats.text_file")
    assert [(one, name) for one, name in found if (one, name.removesuffix(".read_apart")) != apart] == []
    assert [(one, name) for one in modules for name in imported(one) if within(name, OUTSIDE)] == []


# Values and functions without dependencies, which every layer may use.
SHARED_VALUES = (
    "zenocap.common.arrays", "zenocap.common.atomic_write", "zenocap.common.errors", "zenocap.common.jit",
    "zenocap.common.table", "zenocap.common.toml_file",
)  # fmt: skip


@pytest.mark.parametrize("service", STEPPED)
def test_a_step_and_all_it_imports_have_no_threads_sockets_files_or_clocks(service: str) -> None:
    modules = closure(f"zenocap.services.{service}.step")
    assert len(modules) > 5
    assert [(one, name) for one in modules for name in imported(one) if within(name, OUTSIDE)] == []
    assert f"zenocap.services.{service.split('.')[0]}.shell" not in modules


@pytest.mark.parametrize("service", STEPPED)
def test_a_step_uses_no_transport(service: str) -> None:
    modules = {name for name in closure(f"zenocap.services.{service}.step") if within(name, ("zenocap.common.bus",))}
    assert modules <= {"zenocap.common.bus.protocol"}


@pytest.mark.slow
def test_only_the_zenoh_files_of_the_bus_import_zenoh() -> None:
    users = {module for module in MODULES if any(within(name, ("zenoh",)) for name in imported(module))}
    assert users
    assert [name for name in users if not name.startswith("zenocap.common.bus.zenoh_")] == []


def test_messages_import_no_other_module() -> None:
    assert internal_imports("zenocap.common.messages") == set()
    assert internal_imports("zenocap.common.synchronizer") == set()
