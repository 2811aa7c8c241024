"""Parameters of a rig's services, as stored in its takes."""

import ast
from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.places import ROOT
from zenocap.common.recording.setup_file import read_parameters, write_parameters
from zenocap.common.rig.rig import demo_rig
from zenocap.tools.parameters import OF_SERVICES, constants, service_parameters


def test_a_rigs_parameters_are_those_of_the_services_it_runs() -> None:
    rig = replace(demo_rig("two-view"), tracker=None, recognizer=None)
    assert set(service_parameters(rig)) == set(OF_SERVICES) - {"tracker", "recognizer"}


def test_parameters_of_all_services_round_trip_through_json() -> None:
    parameters = {service: constants(module) for service, module in OF_SERVICES.items()}
    data = write_parameters(parameters)
    assert write_parameters(read_parameters(Path("take.mcap"), data)) == data


def constants_read_in(service: str) -> set[str]:
    """Names that modules of a service take from its `parameters.py`."""
    names: set[str] = set()
    for path in (ROOT / "services" / service).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_bytes())):
            match node:
                case ast.ImportFrom(module=module) if module == f"zenocap.services.{service}.parameters":
                    names |= {one.name for one in node.names}
                case ast.Attribute(value=ast.Name(id="p" | "parameters"), attr=name):
                    names.add(name)
    return names


@pytest.mark.parametrize("service", OF_SERVICES)
def test_the_code_uses_every_value_that_a_take_states(service: str) -> None:
    """A take must not state a value of which the code has its own copy."""
    assert set(constants(OF_SERVICES[service])) - constants_read_in(service) == set()
