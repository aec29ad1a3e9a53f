"""How closely an aircraft flies the patterns: truth against the commanded curve, over the whole stack."""

from functools import cache
from pathlib import Path
from typing import Any

import pytest

from flightsim.environment import Environment
from flightsim.world_spec import WorldSpec
from missions.base.options import FlightOptions, Via
from missions.library import find_mission
from missions.runs.session import RunRequest, fly

FLAVOURS = ("px4", "ardupilot")
STILL_RMS_M = 0.6
WINDY_RMS_M = 2.0
WAYPOINTS_RMS_M = 4.0
ALTITUDE_RMS_M = 2.0
RETURN_MAX_S = 180.0


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Fly a mission with an aerosonde; gives the vehicle's block of the summary."""
    runs: Path = tmp_path_factory.mktemp("wing_patterns")

    @cache
    def run(mission: str, flavour: str, via: Via | None, windy: bool, pattern: str = "L1") -> dict[str, Any]:
        chosen: dict[str, Any] = {"pattern": pattern}
        if via is not None:
            chosen["via"] = via
        request = RunRequest(
            options=FlightOptions(**chosen, given=frozenset(chosen)),
            world=WorldSpec.of_team(
                model="aerosonde",
                autopilot=flavour,
                seed=5,
                air=Environment.from_wind(
                    speed_m_s=6.0 if windy else 0.0,
                    from_deg=300.0,
                    turbulence="moderate" if windy else "none",
                ),
            ),
            out=runs / f"{mission}-{flavour}-{via}-{windy}-{pattern}",
            picture=False,
        )
        result = fly(find_mission(mission), request)
        assert result.outcome == "completed", result.reason
        vehicle: dict[str, Any] = result.summary["vehicles"][0]
        return vehicle

    return run


def seconds(flight: dict[str, Any], name: str) -> float:
    phase = next(p for p in flight["phases"] if p["name"] == name)
    return float(phase["end_s"] - phase["start_s"])


def well_flown(flight: dict[str, Any], rms_max_m: float) -> None:
    assert flight["path_rms_error_m"] < rms_max_m
    assert flight["altitude_rms_error_m"] < ALTITUDE_RMS_M
    assert flight["progress"] == 1.0
    assert seconds(flight, "return") < RETURN_MAX_S


@pytest.mark.parametrize(("pattern", "flavour"), [("L1", "px4"), ("L2", "px4"), ("L2", "ardupilot")])
@pytest.mark.slow
def test_setpoints_follow_the_curve_in_still_air(flown: Any, pattern: str, flavour: str) -> None:
    flight = flown("lissajous", flavour, None, windy=False, pattern=pattern)
    well_flown(flight, STILL_RMS_M)
    assert flight["path_max_error_m"] < 3.0 * STILL_RMS_M
    assert "waypoints" not in flight  # setpoints are what an aircraft flies by default


@pytest.mark.slow
@pytest.mark.parametrize("flavour", FLAVOURS)
def test_setpoints_follow_the_curve_in_wind(flown: Any, flavour: str) -> None:
    well_flown(flown("lissajous", flavour, Via.SETPOINTS, windy=True), WINDY_RMS_M)


@pytest.mark.slow
@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.parametrize("windy", [False, True])
def test_every_waypoint_is_passed(flown: Any, flavour: str, windy: bool) -> None:
    flight = flown("lissajous", flavour, Via.WAYPOINTS, windy=windy, pattern="L2")
    well_flown(flight, WAYPOINTS_RMS_M)
    waypoints = flight["waypoints"]
    assert waypoints["passed"] == waypoints["count"] > 40
    assert waypoints["largest_miss_m"] < 0.7 * waypoints["acceptance_m"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mission", "flavour"),
    [("sector", "ardupilot"), ("parallel-sweep", "px4"), ("expanding-square", "ardupilot")],
)
def test_search_patterns_turn_their_corners(flown: Any, mission: str, flavour: str) -> None:
    flight = flown(mission, flavour, None, windy=False)
    well_flown(flight, STILL_RMS_M)
    assert flight["path_max_error_m"] < 2.0


@pytest.mark.slow
def test_a_team_of_aircraft_and_a_quadrotor_flies_as_one(tmp_path: Path) -> None:
    request = RunRequest(
        options=FlightOptions(vehicles=3, pattern="L1", given=frozenset({"vehicles", "pattern"})),
        world=WorldSpec.of_team(model=("aerosonde", "aerosonde", "iris"), seed=1),
        out=tmp_path / "team",
        picture=False,
    )
    result = fly(find_mission("lissajous"), request)
    assert result.outcome == "completed", result.reason
    first, second, quadrotor = result.summary["vehicles"]
    well_flown(first, STILL_RMS_M)
    well_flown(second, STILL_RMS_M)
    assert quadrotor["path_rms_error_m"] < 1.0


@pytest.mark.slow  # a quadrotor's is in tests/missions/test_session.py
def test_a_search_time_ends_the_pattern_and_lands(tmp_path: Path) -> None:
    chosen = {"search_time_s": 60.0, "pattern": "L1"}
    request = RunRequest(
        options=FlightOptions(**chosen, given=frozenset(chosen)),
        world=WorldSpec.of_team(model="aerosonde"),
        out=tmp_path / "search",
        picture=False,
    )
    result = fly(find_mission("lissajous"), request)
    assert result.outcome == "completed", result.reason
    assert seconds(result.summary["vehicles"][0], "pattern") == pytest.approx(60.0, abs=5.0)
