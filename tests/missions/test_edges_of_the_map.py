"""Every mission is flown and scored where longitudes jump, and where a degree of them is short.

At 180 degrees the vehicles cross the line in flight. At 89 degrees north a degree of longitude is 2 km.
"""

from functools import partial
from pathlib import Path

import pytest

from flightsim.environment import Environment
from flightsim.home import Home
from flightsim.world_spec import WorldSpec
from missions.base.options import FlightOptions, Via
from missions.base.request import RunRequest
from missions.handoff.options import HandoffOptions
from missions.handoff.world import handoff_world
from missions.library import find_mission
from missions.multi_target.options import MultiTargetOptions
from missions.multi_target.world import TargetField, multi_target_world  # type: ignore[attr-defined]
from missions.occupancy.magnetic_target import MagneticTarget
from missions.occupancy.options import OccupancyOptions
from missions.occupancy.world import occupancy_world
from missions.orbit.options import OrbitOptions
from missions.orbit.world import orbit_world
from missions.plan_files.options import FileOptions
from missions.runs.session import RunResult, fly
from missions.search.area import edges
from missions.survey.options import SurveyOptions
from missions.survey.surveyed_field import SurveyedField
from missions.survey.world import survey_world
from missions.vision_search.options import VisionSearchOptions
from missions.vision_search.world import vision_search_world
from tests.missions.held_options import with_fields

LINE = Home(lat_deg=20.0, lon_deg=179.9999, alt_m=100.0)
NORTH = Home(lat_deg=89.0, lon_deg=-30.0, alt_m=100.0)
AIR = Environment.from_wind(speed_m_s=3.0, from_deg=40.0, turbulence="light")
PATTERN = partial(FlightOptions, width_m=40.0, height_m=30.0, pattern="L2")

quick_at_the_line = pytest.mark.parametrize(
    "home", [pytest.param(LINE, id="180"), pytest.param(NORTH, id="89N", marks=pytest.mark.slow)]
)
both = pytest.mark.parametrize("home", [pytest.param(LINE, id="180"), pytest.param(NORTH, id="89N")])


def flown(name: str, options, out: Path, home: Home, world=lambda spec, _: spec, **team) -> RunResult:
    spec = world(WorldSpec.of_team(options.vehicles, seed=3, home=home, **team), options)
    result = fly(find_mission(name), RunRequest(options=options, world=spec, out=out, picture=False))
    assert (result.outcome, result.reason) == ("completed", "")
    return result


def near_path(result: RunResult, most_m: float) -> None:
    assert result.summary["path_max_error_m"] < most_m
    for block in result.summary["vehicles"]:
        assert block["path_rms_error_absolute_m"] < most_m
        assert block["path_rms_error_estimate_m"] < most_m


@quick_at_the_line
def test_a_mission_file(home: Home, tmp_path: Path) -> None:
    corners = [home.offset(north_m, east_m) for north_m, east_m in ((0, 0), (0, 40), (25, 40), (25, -10))]
    rows = ["QGC WPL 110", f"0\t1\t0\t16\t0\t0\t0\t0\t{home.lat_deg}\t{home.lon_deg:.7f}\t{home.alt_m}\t1"]
    for number, (lat_deg, lon_deg) in enumerate(corners, start=1):
        command = 22 if number == 1 else 16
        rows.append(f"{number}\t0\t3\t{command}\t0\t0\t0\t0\t{lat_deg:.7f}\t{lon_deg:.7f}\t15\t1")
    path = tmp_path / "box.waypoints"
    path.write_text("\n".join([*rows, f"{len(rows) - 1}\t0\t3\t20\t0\t0\t0\t0\t0\t0\t0\t1", ""]))
    result = flown(str(path), FileOptions(), tmp_path / "run", home, autopilot="ardupilot")
    near_path(result, 2.0)
    assert result.summary["vehicles"][0]["waypoints"]["passed"] == 4
    assert result.summary["mission_file"]["cross_track_max_m"] < 3.0
    assert 80.0 < result.summary["distance_m"] < 250.0


@quick_at_the_line
@pytest.mark.parametrize(
    ("name", "via", "vehicles"),
    [
        ("sector", Via.SETPOINTS, 1),
        pytest.param("lissajous", Via.WAYPOINTS, 2, marks=pytest.mark.slow),
        pytest.param("parallel-sweep", Via.WAYPOINTS, 1, marks=pytest.mark.slow),
        pytest.param("expanding-square", Via.SETPOINTS, 1, marks=pytest.mark.slow),
    ],
)
def test_a_pattern(name: str, via: Via, vehicles: int, home: Home, tmp_path: Path) -> None:
    near_path(flown(name, PATTERN(via=via, vehicles=vehicles), tmp_path / "run", home), 2.0)


@pytest.mark.slow
@both
def test_an_orbit(home: Home, tmp_path: Path) -> None:
    options = OrbitOptions(duration_s=60.0)
    summary = flown("orbit", options, tmp_path / "run", home, orbit_world, model="aerosonde", air=AIR).summary
    assert abs(summary["radius_mean_error_percent"]) < 5.0
    assert summary["radius_max_error_m"] < 30.0


@pytest.mark.slow
@both
def test_an_occupancy_search(home: Home, tmp_path: Path) -> None:
    options = with_fields(
        OccupancyOptions(
            vehicles=2, altitude_m=15.0, separation_m=6.0, width_m=400.0, height_m=400.0, cell_m=100.0
        ),
        detection_range_m=60.0,
        confirmations=1,
    )
    world = partial(occupancy_world, hidden=MagneticTarget(place_ne_m=(110.0, 30.0)))
    summary = flown("occupancy", options, tmp_path / "run", home, world).summary
    assert summary["target_found"] is True
    assert summary["target_error_m"] < 80.0
    assert 5.0 < summary["least_separation_m"] < 500.0


@pytest.mark.slow
@both
def test_a_search_for_several_targets(home: Home, tmp_path: Path) -> None:
    options = with_fields(
        MultiTargetOptions(altitude_m=8.0, start_ne_m=(0.0, 0.0), steps=12),
        expected_targets=4.0,
        **edges((-20.0, -20.0, 60.0, 60.0)),
    )
    field = TargetField(count=4, clusters=1, cluster_sigma_m=12.0)
    world = partial(multi_target_world, field=field)
    summary = flown("multi-target", options, tmp_path / "run", home, world).summary
    assert summary["targets_true"] == 4
    assert summary["targets_found_right"] >= 1
    assert summary["targets_found_right"] >= summary["targets_found"] - 1


@pytest.mark.slow
@both
def test_a_survey(home: Home, tmp_path: Path) -> None:
    options = with_fields(
        SurveyOptions(width_m=500.0, height_m=600.0, spacing_m=250.0, tie_spacing_m=500.0), map_error_nt=0.0
    )
    world = partial(survey_world, hidden=SurveyedField(targets=1, exact_map=True))
    result = flown("survey", options, tmp_path / "run", home, world, model="aerosonde", air=AIR)
    near_path(result, 20.0)
    assert result.summary["least_coverage"] > 0.98
    assert result.summary["targets_found"] == 1
    assert result.summary["target_errors_m"][0] < 30.0


@pytest.mark.slow
@both
def test_a_vision_search(home: Home, tmp_path: Path) -> None:
    options = with_fields(
        VisionSearchOptions(altitude_m=15.0, step_m=8.0),
        **edges((-20.0, -20.0, 20.0, 20.0)),
        target_size_m=0.6,
    )
    world = partial(vision_search_world, hidden=None)
    summary = flown("vision-search", options, tmp_path / "run", home, world).summary
    assert summary["localized"]
    assert summary["error_m"] < 1.5
    assert 0.0 < summary["pose_errors"]["1"]["forward_m"] < 3.0


@pytest.mark.slow
@both
def test_a_handoff(home: Home, tmp_path: Path) -> None:
    options = HandoffOptions(vehicles=2, takeover_s=20.0, timeout_s=200.0)
    summary = flown(
        "handoff", options, tmp_path / "run", home, partial(handoff_world, walking=None), model="aerosonde"
    ).summary
    assert summary["decided"] and summary["correct"]
