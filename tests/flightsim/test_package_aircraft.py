"""The aircraft that come with the `jsbsim` package: each is simulated, or refused in one line."""

import numpy as np
import pytest
from click.testing import CliRunner

from flightsim.airframe import AirframeError
from flightsim.airframe_file import package_aircraft
from flightsim.environment import Environment
from flightsim.flight_envelope import flight_envelope
from flightsim.home import Home
from flightsim.interface import MAX_ACTUATORS
from flightsim.vehicle import Vehicle
from missions.cli.main import run_command_line
from missions.cli.sitl import sitl


def make(model: str) -> Vehicle:
    return Vehicle(model, home=Home(), environment=Environment(), seed_sequence=np.random.SeedSequence(1))


@pytest.mark.parametrize("model", ["minisgs", "paraglider", "L410", "J246"])
def test_a_model_that_cannot_be_stepped_is_refused(model: str) -> None:
    with pytest.raises(AirframeError, match=rf"'{model}' can't be simulated from its start.*{model}\.xml"):
        make(model)


@pytest.mark.parametrize("model", ["dr1", "f104", "L17"])
def test_a_model_that_needs_properties_of_another_simulator_is_refused(model: str) -> None:
    with pytest.raises(AirframeError, match=r"The property .* does not exist"):
        make(model)


@pytest.mark.parametrize("model", ["ball", "ballx"])
def test_a_model_without_a_wing_is_refused(model: str) -> None:
    with pytest.raises(AirframeError, match=rf"'{model}' can't be trimmed: .* on a wing of .* fly at \d"):
        flight_envelope(model)


def test_a_glider_that_has_no_glide_is_refused() -> None:
    with pytest.raises(AirframeError, match="'SGS' can't be trimmed"):
        flight_envelope("SGS")


def test_the_command_line_refuses_a_model_in_one_line(
    capsys: pytest.CaptureFixture[str], tmp_path: object
) -> None:
    assert run_command_line(["fly", "lissajous", "--model", "F450", "--out", f"{tmp_path}/run"]) == 2
    reported = capsys.readouterr().err
    assert reported.startswith("flightstack: vehicle 'F450' can't") and reported.count("\n") == 1
    refused = CliRunner().invoke(sitl, ["--model", "minisgs", "--link", "udpin:127.0.0.1:0"])
    assert refused.exit_code == 2
    assert "vehicle 'minisgs' can't be simulated" in refused.output


def test_commands_of_actuators_that_the_vehicle_does_not_have_are_ignored() -> None:
    """With more than MAX_ACTUATORS the kernel read the scales of other surfaces, and memory behind them."""
    commands = np.zeros(2 * MAX_ACTUATORS)
    commands[MAX_ACTUATORS:] = 1.0
    vehicle = make("T37")
    vehicle.step(commands)
    surfaces = [vehicle._fdm[f"fcs/{name}-cmd-norm"] for name in ("aileron", "elevator", "rudder")]
    assert surfaces == [0.0, 0.0, 0.0]


@pytest.mark.slow
@pytest.mark.parametrize("model", package_aircraft())
def test_each_model_of_the_package_is_flown_or_refused(model: str) -> None:
    try:
        vehicle = make(model)
        flight_envelope(model)
    except AirframeError as refusal:
        assert "\n" not in str(refusal) or "JSBSim cannot load" in str(refusal)
        return
    for _ in range(250):
        vehicle.step(np.zeros(MAX_ACTUATORS))
