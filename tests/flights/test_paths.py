"""How closely the patterns are flown: truth against the commanded curve, over the whole stack.

A flight's path error is made of how well the vehicle follows what its filter estimates, which the control
laws answer for, and of how far the filter drifts from where it was when the vehicle was armed, which the slow
errors of receiver and barometer decide. The bounds are put to every flight, a tighter one to the first part.
"""

from functools import cache
from pathlib import Path
from typing import Any

import pytest

from flightsim.environment import Environment
from flightsim.world_spec import WorldSpec
from missions.base.options import FlightOptions, Via
from missions.library import find_mission
from missions.runs.session import RunRequest, fly
from tests.slow import slow, slow_after

LISSAJOUS = ("L1", "L2", "L3", "L4")
IAMSAR = ("sector", "parallel-sweep", "expanding-square")
SETPOINT_FLIGHTS = {
    "still, the others": [("L3", "px4"), ("L2", "ardupilot")],
    "still": [("L1", "px4"), ("L4", "ardupilot")],
    "windy, the others": [("L3", "px4")],
    "windy": [("L1", "ardupilot")],
}
RMS_MAX_M = {"still": 0.3, "windy": 0.6}
FOLLOWING_MAX_M = {"still": 0.12, "windy": 0.2}


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Fly a pattern of 100 m by 100 m at 5 m/s; gives the vehicle's block of the summary."""
    runs: Path = tmp_path_factory.mktemp("paths")

    @cache
    def run(name: str, flavour: str, via: Via, air: str, seed: int) -> dict[str, Any]:
        windy = air == "windy"
        request = RunRequest(
            options=FlightOptions(pattern=name if name in LISSAJOUS else "L3", via=via),
            world=WorldSpec.of_team(
                autopilot=flavour,
                seed=seed,
                air=Environment.from_wind(
                    speed_m_s=5.0 if windy else 0.0,
                    from_deg=70.0 * seed,
                    turbulence="moderate" if windy else "none",
                ),
            ),
            out=runs / f"{name}-{flavour}-{via}-{air}-{seed}",
            picture=False,
        )
        result = fly(find_mission("lissajous" if name in LISSAJOUS else name), request)
        assert result.outcome == "completed", result.reason
        vehicle: dict[str, Any] = result.summary["vehicles"][0]
        return vehicle

    return run


@pytest.mark.parametrize("flights", slow_after(1, reversed(SETPOINT_FLIGHTS)))
@pytest.mark.slow
def test_setpoints_follow_the_curve(flown: Any, flights: str) -> None:
    air = flights.split(",")[0]
    for seed, (name, flavour) in enumerate(SETPOINT_FLIGHTS[flights], start=1):
        flight = flown(name, flavour, Via.SETPOINTS, air, seed)
        assert flight["error_reference"] == "truth"
        assert flight["path_rms_error_estimate_m"] < FOLLOWING_MAX_M[air]
        assert flight["max_attitude_error_deg"] < 4.0
        assert flight["path_rms_error_m"] <= RMS_MAX_M[air]
        assert flight["path_max_error_m"] < 1.5


@pytest.mark.parametrize(
    ("name", "flavour"),
    [
        ("L1", "px4"),
        slow("L2", "ardupilot"),
        ("sector", "ardupilot"),
        slow("parallel-sweep", "px4"),
        slow("expanding-square", "ardupilot"),
    ],
)
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_waypoints_are_passed_within_the_acceptance_radius_in_wind(
    flown: Any, name: str, flavour: str
) -> None:
    flight = flown(name, flavour, Via.WAYPOINTS, "windy", 4)
    waypoints = flight["waypoints"]
    assert waypoints["acceptance_m"] == 2.0
    assert waypoints["passed"] == waypoints["count"] >= 8
    assert waypoints["largest_miss_m"] < 1.2
    assert flight["path_rms_error_estimate_m"] < 0.35
    if name in IAMSAR:  # straight legs: corners are cut by a little, and not overshot
        assert flight["path_rms_error_estimate_m"] < 0.2
        assert flight["path_max_error_m"] < 1.5
