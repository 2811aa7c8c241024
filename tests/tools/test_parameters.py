"""Parameters of a rig's services, as stored in its takes."""

from dataclasses import replace
from pathlib import Path

from zenocap.common.recording.setup_file import read_parameters, write_parameters
from zenocap.common.rig.rig import demo_rig
from zenocap.tools.parameters import OF_SERVICES, service_parameters


def test_a_rigs_parameters_are_those_of_the_services_it_runs() -> None:
    rig = replace(demo_rig("two-view"), tracker=None, recognizer=None)
    assert set(service_parameters(rig)) == set(OF_SERVICES) - {"tracker", "recognizer"}


def test_parameters_of_all_services_round_trip_through_json() -> None:
    parameters = {service: values() for service, values in OF_SERVICES.items()}
    data = write_parameters(parameters)
    assert write_parameters(read_parameters(Path("take.mcap"), data)) == data
