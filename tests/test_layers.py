"""The house's layers, read from the imports: who may know what.

0 mathematics: `common/{body,camera,vision,actor}` and every file of a service that no set below names.
1 steps: `step.py` of each service and the files it is made of: messages in, messages out.
2 `common/{bus,runtime,take,formats}`.  3 shells, sources, the command line.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
LAYER_0 = ("common.body", "common.camera", "common.vision", "common.actor")
VOCABULARY = ("common.messages", "common.conversion", "common.pairing")
# What a step is fed and set up with: values, without a thread, a socket or a file.
EVENTS = ("common.bus.protocol", "common.runtime.clock", "common.runtime.specs")
STEPS = {
    "integrator": {"step", "states", "measuring", "placing", "posing", "hearing", "reminding", "resuming"},
    "viewer": {"step", "states", "tracking", "ready", "seeing", "watching"},
    "tracker": {"step", "states"},
    "animator": {"step", "states", "snapshot"},
    "recognizer": {"step", "states"},
}
SHELLS = {
    "integrator": {"shell", "switch"},
    "viewer": {"shell", "beginning", "source", "sources"},
    "animator": {"shell", "playback", "page", "outputs", "render/film", "render/labels"},
    "tracker": {"shell", "motions", "prior/file", "prior/plot", "prior/ship", "prior/shipped"},
    "recognizer": {"shell", "file", "manifest", "naming", "plot", "reading"},
}
UNSEEN = ("logging", "time", "threading", "socket", "subprocess", "random", "zenoh", "mcap", "msgpack", "msgspec")
ZENOH_FILES = tuple(f"common.bus.zenoh_{name}" for name in ("about", "bus", "clock", "kept", "pace", "recall", "session"))


def module_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def sources(*folders: str) -> list[Path]:
    found = sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))
    assert found, f"nothing in {folders}"
    return found


def imported(path: Path) -> Iterator[str]:
    """Full names of the modules a file imports, those inside functions included; names imported from a package too."""
    for node in ast.walk(ast.parse(path.read_text(), str(path))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports hide where a name lives"
            assert node.module
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names if is_module(f"{node.module}.{alias.name}"))


def is_module(name: str) -> bool:
    path = ROOT.joinpath(*name.split("."))
    return path.is_dir() or path.with_suffix(".py").is_file()


def within(module: str, places: tuple[str, ...]) -> bool:
    return any(module == place or module.startswith(f"{place}.") for place in places)


def ours(path: Path) -> set[str]:
    """The modules of this project that a file imports; a package that only stands for its modules does not count."""
    packages = {"common", "services"} | {f"services.{name}" for name in STEPS} | {"services.tracker.prior"}
    return {name for name in imported(path) if within(name, ("common", "services"))} - packages


def files_of(service: str, names: set[str]) -> list[Path]:
    """Files of a service that are one of `names` inside it, or lie in a folder that is."""
    folder = ROOT / "services" / service
    found = {path: named(path.relative_to(folder), names) for path in sources(f"services/{service}")}
    assert set(found.values()) - {None} == names, "a name in a set has no file"
    return [path for path, name in found.items() if name is not None]


def named(path: Path, names: set[str]) -> str | None:
    """That of `names` which is this file, or the folder it lies in."""
    places = (path.with_suffix("").as_posix(), *(parent.as_posix() for parent in path.parents))
    return next((place for place in places if place in names), None)


def algorithms(service: str) -> list[Path]:
    others = {*files_of(service, STEPS[service]), *files_of(service, SHELLS[service])}
    return [path for path in sources(f"services/{service}") if path not in others]


def modules_of(service: str, *kinds: dict[str, set[str]]) -> tuple[str, ...]:
    return tuple(f"services.{service}.{name.replace('/', '.')}" for kind in kinds for name in sorted(kind[service]))


@pytest.mark.parametrize("path", sources("common/body", "common/camera", "common/vision", "common/actor"), ids=module_of)
def test_layer_0_of_common_knows_arrays_only(path: Path) -> None:
    assert [name for name in ours(path) if not within(name, LAYER_0)] == []
    assert [name for name in imported(path) if within(name, UNSEEN) and not msgspec_of_calibration(path, name)] == []


def msgspec_of_calibration(path: Path, name: str) -> bool:
    """Calibration files are the one kind of file in layer 0, and they are checked by their types."""
    return path.parent.name == "camera" and within(name, ("msgspec",))


@pytest.mark.parametrize("path", [path for service in STEPS for path in algorithms(service)], ids=module_of)
def test_a_services_algorithms_know_layer_0_and_one_another_only(path: Path) -> None:
    service = path.relative_to(ROOT / "services").parts[0]
    beyond = [name for name in ours(path) if not within(name, (*LAYER_0, f"services.{service}"))]
    assert beyond == []
    assert [name for name in ours(path) if within(name, modules_of(service, STEPS, SHELLS))] == []
    assert [name for name in imported(path) if within(name, UNSEEN)] == []


@pytest.mark.parametrize("path", [path for service in STEPS for path in files_of(service, STEPS[service])], ids=module_of)
def test_steps_see_messages_and_neither_the_bus_nor_time_files_or_logging(path: Path) -> None:
    service = path.relative_to(ROOT / "services").parts[0]
    allowed = (*LAYER_0, *VOCABULARY, *EVENTS, f"services.{service}")
    assert [name for name in ours(path) if not within(name, allowed)] == []
    assert [name for name in ours(path) if within(name, modules_of(service, SHELLS))] == []
    assert [name for name in imported(path) if within(name, UNSEEN)] == []


@pytest.mark.parametrize("path", sources("common", "services"), ids=module_of)
def test_only_the_files_of_the_zenoh_bus_know_zenoh(path: Path) -> None:
    if module_of(path) not in ZENOH_FILES:
        assert [name for name in imported(path) if within(name, ("zenoh",))] == []


@pytest.mark.parametrize("path", sources("common"), ids=module_of)
def test_common_knows_no_service(path: Path) -> None:
    assert [name for name in ours(path) if within(name, ("services",))] == []


@pytest.mark.parametrize("path", [path for service in STEPS for path in sources(f"services/{service}")], ids=module_of)
def test_services_do_not_know_each_other(path: Path) -> None:
    service = path.relative_to(ROOT / "services").parts[0]
    assert [name for name in ours(path) if within(name, ("services",)) and not within(name, (f"services.{service}",))] == []


def test_every_service_is_in_the_tables() -> None:
    """A folder with a step is a service."""
    assert {path.parent.name for path in sources("services") if path.name == "step.py"} == set(STEPS) == set(SHELLS)


def test_messages_know_nothing_of_ours() -> None:
    assert ours(ROOT / "common" / "messages.py") == set()
    assert ours(ROOT / "common" / "conversion.py") <= {
        "common.body.anatomy", "common.body.definition", "common.camera.pinhole", "common.messages",
    }  # fmt: skip


def test_pairing_knows_nothing_of_ours() -> None:
    assert ours(ROOT / "common" / "pairing.py") == set()


def test_a_steps_events_are_values() -> None:
    """What steps may import of the outer layers must not drag threads, sockets or files behind it."""
    seen: set[str] = set()
    waiting = list(EVENTS)
    while waiting:
        module = waiting.pop()
        if module in seen or module in VOCABULARY:
            continue
        seen.add(module)
        path = ROOT.joinpath(*module.split(".")).with_suffix(".py")
        if not path.is_file():
            continue
        assert [name for name in imported(path) if within(name, ("threading", "socket", "logging", "zenoh", "mcap"))] == []
        waiting += ours(path)
