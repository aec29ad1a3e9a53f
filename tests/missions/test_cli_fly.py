"""Options of `flightstack fly` that exclude each other."""

import pytest
from click.testing import CliRunner

from missions.cli_fly import fly


@pytest.mark.parametrize(
    "option",
    [
        ["--seed", "3"],
        ["--wind", "5"],
        ["--autopilot", "px4"],
        ["--model", "iris"],
        ["--home", "47,8,400"],
        ["--turbulence", "light"],
        ["--speedup", "2"],
    ],
    ids=lambda option: option[0],
)
def test_options_of_the_embedded_sitl_are_refused_with_a_vehicle_elsewhere(option: list[str]) -> None:
    result = CliRunner().invoke(fly, ["lissajous", "--connect", "udpin:127.0.0.1:0", *option])
    assert result.exit_code == 2
    assert f"{option[0]}: of the embedded SITL only" in result.output
