"""Lines, turns and heights of a survey, before anything is flown."""

import io
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from estimators.survey.lines import LineKind
from flightsim.foundation.geodesy import GeodeticPosition
from missions.errors import PlanError
from missions.survey.checks import check_reach, check_survey
from missions.survey.drape import Drape, TerrainModel, load_terrain
from missions.survey.dubins import Pose, shortest_path
from missions.survey.flight import planned_survey
from missions.survey.manoeuvres import Axis, Programme, manoeuvres
from missions.survey.options import SurveyOptions
from missions.survey.plan import _followed, line_plan, survey_path
from missions.vehicle.limits import FixedWingLimits
from tests.missions.held_options import with_fields

HOME = GeodeticPosition(lat_deg=47.4, lon_deg=8.55, alt_m=480.0)
WINGS = FixedWingLimits(
    airspeed_min_m_s=18.0,
    airspeed_trim_m_s=25.0,
    airspeed_max_m_s=30.0,
    bank_max_rad=math.radians(45.0),
    wind_m_s=5.0,
)


def test_dubins_paths_end_where_they_should_and_none_is_longer_than_a_detour():
    rng = np.random.default_rng(1)
    for _ in range(300):
        start, end = (
            Pose(north_m=n, east_m=e, course_rad=c)
            for n, e, c in rng.uniform((-500.0, -500.0, -3.1), (500.0, 500.0, 3.1), (2, 3)).tolist()
        )
        arcs = shortest_path(start, end, 120.0)
        points, courses, _ = _followed(start, arcs, 120.0)
        assert math.dist(points[-1], (end.north_m, end.east_m)) < 1e-6
        assert abs(math.remainder(courses[-1] - end.course_rad, math.tau)) < 1e-9
        length_m = math.fsum(arc.length_m for arc in arcs)
        away_m = math.dist((start.north_m, start.east_m), (end.north_m, end.east_m))
        assert away_m <= length_m + 1e-6 <= away_m + 2.0 * math.tau * 120.0
        # never longer than by a place on the way
        via = Pose(north_m=100.0, east_m=-50.0, course_rad=0.3)
        legs = (*shortest_path(start, via, 120.0), *shortest_path(via, end, 120.0))
        assert length_m <= math.fsum(arc.length_m for arc in legs) + 1e-6


@pytest.mark.parametrize(
    ("apart_m", "expected_m"), [(200.0, math.pi * 100.0), (500.0, math.pi * 100.0 + 300.0)]
)
def test_turns_between_lines_are_half_circles(apart_m, expected_m):
    arcs = shortest_path(
        Pose(north_m=0.0, east_m=0.0, course_rad=0.0),
        Pose(north_m=0.0, east_m=apart_m, course_rad=math.pi),
        100.0,
    )
    assert math.fsum(arc.length_m for arc in arcs) == pytest.approx(expected_m)


@pytest.mark.parametrize("radius_m", [60.0, 150.0, 330.0])
@pytest.mark.parametrize("count", [2, 5, 12, 31])
def test_every_line_is_flown_once_with_lines_between_that_are_too_near(radius_m, count):
    options = SurveyOptions(
        width_m=100.0 * (count - 1), height_m=1500.0, spacing_m=100.0, tie_spacing_m=500.0
    )
    plan = line_plan(options, turn_radius_m=radius_m)
    lines = [line for line in plan.lines if line.kind is LineKind.LINE]
    assert sorted(line.name for line in lines) == sorted(f"L{k + 1}" for k in range(count))
    assert {line.name for line in plan.lines} - {line.name for line in lines} == {
        f"T{k + 1}" for k in range(4)
    }
    steps = [abs(a.start_ne_m[1] - b.end_ne_m[1]) for a, b in zip(lines[1:], lines, strict=False)]
    turns = [
        abs(math.remainder(a.course_rad - b.course_rad, math.tau))
        for a, b in zip(lines[1:], lines, strict=False)
    ]
    assert turns == pytest.approx([math.pi] * len(turns))
    enough = count >= 2 * math.ceil(2.0 * radius_m / 100.0) + 1
    if enough:
        assert np.mean(np.array(steps) >= 2.0 * radius_m - 100.0) > 0.7


def test_lines_have_the_direction_spacing_and_place_that_were_asked_for():
    options = SurveyOptions(
        width_m=600.0, height_m=2000.0, spacing_m=200.0, direction_rad=math.radians(30.0),
        area_ne_m=(400.0, -300.0), tie_spacing_m=0.0,
    )  # fmt: skip
    plan = line_plan(options, turn_radius_m=50.0)
    assert len(plan.lines) == 4
    middle = np.mean([(line.start_ne_m, line.end_ne_m) for line in plan.lines], axis=(0, 1))
    np.testing.assert_allclose(middle, (400.0, -300.0), atol=1e-6)
    for line, other in zip(plan.lines, plan.lines[1:], strict=False):
        assert math.remainder(line.course_rad - math.radians(30.0), math.pi) == pytest.approx(0.0, abs=1e-9)
        _, across = line.along_across_m(*np.array(other.start_ne_m)[:, None])
        assert abs(float(across[0])) == pytest.approx(200.0)


def test_the_path_goes_along_the_lines_with_a_lead_and_never_turns_tighter():
    options = SurveyOptions(width_m=1000.0, height_m=1200.0, spacing_m=200.0)
    plan = line_plan(options, turn_radius_m=180.0)
    drape = Drape(terrain=None, altitude_m=80.0, climb=0.06)
    path = survey_path(plan, drape, turn_radius_m=180.0, lead_m=240.0, run_out_m=90.0)
    assert np.abs(path.path.curvature_per_m).max() == pytest.approx(1.0 / 180.0)
    assert np.hypot(*np.diff(path.path.points_m, axis=0).T).max() < 3.0  # without jumps
    assert np.abs(np.diff(path.path.course_rad)).max() < 0.02
    np.testing.assert_array_equal(path.heights_m, 80.0)
    for k, place in ((path.first_line, plan.lines[0].start_ne_m), (path.last_line, plan.lines[-1].end_ne_m)):
        assert math.dist(path.waypoints_m[k], place) < 1e-6
    assert np.all(np.diff(path.arcs_m) > 0.0)
    for arc_m, place in zip(path.arcs_m, path.waypoints_m, strict=True):
        assert math.dist(path.path.at(float(arc_m))[0], place) < 1.0


def terrain(seed=1, step_m=100.0, count=16):
    rng = np.random.default_rng(seed)
    lines = step_m * (np.arange(count) - count // 2)
    return TerrainModel(north_m=lines, east_m=lines, ground_m=40.0 * rng.random((count, count)))


def test_the_drape_is_the_lowest_surface_that_keeps_height_and_slope():
    """Against the linear programme that says the same."""
    ground = terrain(count=7)
    climb = 0.08
    drape = Drape(terrain=ground, altitude_m=60.0, climb=climb)
    north, east = np.meshgrid(ground.north_m, ground.east_m, indexing="ij")
    surface = drape.heights_m(north.ravel(), east.ravel()).reshape(north.shape)
    size = surface.size
    rows, limits = [], []
    for i in range(7):
        for j in range(7):
            for di in (-1, 0, 1):
                for dj in (-1, 0, 1):
                    if (di or dj) and 0 <= i + di < 7 and 0 <= j + dj < 7:
                        row = np.zeros(size)
                        row[7 * i + j], row[7 * (i + di) + j + dj] = 1.0, -1.0
                        rows.append(row)
                        limits.append(climb * 100.0 * math.hypot(di, dj))
    lowest = linprog(
        np.ones(size), A_ub=np.array(rows), b_ub=np.array(limits),
        bounds=[(h + 60.0, None) for h in ground.ground_m.ravel()],
    )  # fmt: skip
    np.testing.assert_allclose(surface.ravel(), lowest.x, atol=1e-6)


def test_waypoints_follow_the_drape_within_a_metre():
    ground = terrain(step_m=200.0)
    options = SurveyOptions(width_m=800.0, height_m=1600.0, spacing_m=200.0)
    plan = line_plan(options, turn_radius_m=120.0)
    drape = Drape(terrain=ground, altitude_m=60.0, climb=0.05)
    path = survey_path(plan, drape, turn_radius_m=120.0, lead_m=200.0, run_out_m=80.0)
    assert np.ptp(path.heights_m) > 10.0
    for line in plan.lines:
        share = np.linspace(0.0, 1.0, 100)
        north, east = (a + share * (b - a) for a, b in zip(line.start_ne_m, line.end_ne_m, strict=True))
        begin = int(np.argmin(np.hypot(*(path.waypoints_m - np.array(line.start_ne_m)).T)))
        flown = np.interp(path.arcs_m[begin] + share * line.length_m, path.arcs_m, path.heights_m)
        assert np.abs(flown - drape.heights_m(north, east)).max() < 3.0
        assert np.min(flown - ground.at(north, east)) > 57.0


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"width_m": -1.0}, "`width_m`"),
        ({"height_m": 1e6}, "`height_m`"),
        ({"spacing_m": 0.0}, "`spacing_m`"),
        ({"spacing_m": 1.0}, "makes 2000 lines"),
        ({"spacing_m": 0.1, "width_m": 10.0}, "`spacing_m` 0.1 is not possible; ask for 1 m or more"),
        ({"tie_spacing_m": -1.0}, "`tie_spacing_m`"),
        ({"tie_spacing_m": 0.01}, "`tie_spacing_m` 0.01 m makes 200000 tie lines; up to 1000"),
        ({"direction_rad": math.nan}, "`direction_rad`"),
        ({"area_ne_m": (0.0, math.inf)}, "`area_ne_m`"),
        ({"climb": 2.0}, "`climb`"),
        ({"map_error_nt": -1.0}, "map_error_nt -1"),
        ({"calibrate": True, "compensation_file": "c.json"}, "has no use with `calibrate`"),
    ],
)
def test_impossible_options_are_refused(values, words):
    with pytest.raises(ValueError, match=words):
        with_fields(SurveyOptions(), **values)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"vehicles": 2}, "flown by one aircraft"),
        ({"speed_m_s": 60.0}, "airspeed 60 m/s is not in"),
        ({"altitude_m": 5.0}, "`altitude_m` 5 m is not in 20..3000"),
        ({"width_m": 100.0}, "fewer than two lines"),
        ({"grid_m": 0.1}, "`grid_m` 0.1 m makes 2[01]... x 2.... grid points; up to 1000000"),
        ({"map_file": "/nowhere/map.npz"}, "`map_file` /nowhere/map.npz can't be read"),
        ({"terrain_file": "/nowhere/terrain.csv"}, "`terrain_file` /nowhere/terrain.csv can't be read"),
        ({"compensation_file": "/nowhere/c.json"}, "`compensation_file` /nowhere/c.json can't be read"),
    ],
)
def test_what_an_aircraft_cannot_survey_is_refused(values, words):
    with pytest.raises(PlanError, match=words):
        check_survey(with_fields(SurveyOptions(), **values), WINGS)


def write_terrain(path, ground, step_m=500.0):
    lines = step_m * (np.arange(len(ground)) - len(ground) // 2)
    rows = [
        f"{n:g},{e:g},{h:g}"
        for n, row in zip(lines, ground, strict=True)
        for e, h in zip(lines, row, strict=True)
    ]
    path.write_text("north_m,east_m,ground_m\n" + "\n".join(rows) + "\n")
    return str(path)


def test_terrain_that_does_not_cover_the_lines_or_is_above_the_flight_is_refused(tmp_path):
    small = write_terrain(tmp_path / "small.csv", np.zeros((3, 3)))
    with pytest.raises(PlanError, match="the terrain reaches only from north -500 to 500"):
        check_survey(SurveyOptions(terrain_file=small), WINGS)
    high = write_terrain(tmp_path / "high.csv", np.full((7, 7), 900.0))
    options = SurveyOptions(terrain_file=high)
    check_survey(options, WINGS)
    with pytest.raises(PlanError, match="is below the terrain there, which is 900 m above it"):
        check_reach(options, WINGS, HOME)


HEADER = "north_m,east_m,ground_m\n"
LINES_M = np.array([0.0, 100.0])


def npz(**arrays):
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


GRID = npz(north_m=LINES_M, east_m=LINES_M, ground_m=np.ones((2, 2)))


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("holes.csv", HEADER + "0,0,1\n0,100,1\n100,0,1\n", "1 points without a height"),
        ("bad.csv", "x,y,z\n0,0,1\n", "begins with 'x,y,z'"),
        ("header.csv", HEADER, "has a header and no rows; give a row"),
        ("short.csv", HEADER + "0,0,1\n0,100\n", "accepted are rows of three numbers"),
        ("pairs.csv", HEADER + "0,0\n0,100\n", "rows of 2 numbers; accepted are three"),
        ("words.csv", HEADER + "0,0,high\n", "'high' .* accepted are rows of three numbers"),
        ("nan.csv", HEADER + "nan,0,1\n", "accepted are two or more rising numbers"),
        ("bytes.csv", b"\xff\xfe\x00", "text in UTF-16"),
        ("torn.npz", GRID[: len(GRID) // 2], "is no numpy .npz archive"),
        ("text.npz", HEADER, "is no numpy .npz archive .* north_m, east_m, ground_m"),
        ("partial.npz", npz(north_m=LINES_M), "has no east_m, ground_m"),
        ("words.npz", npz(north_m=["a"], east_m=LINES_M, ground_m=LINES_M), "north_m holds <U1"),
    ],
)
def test_terrain_that_cannot_be_used_is_refused_in_one_line(tmp_path, name, content, words):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(PlanError, match=words) as refused:
        load_terrain(path)
    said = str(refused.value)
    assert said.startswith(f"`terrain_file` {path}")
    assert "\n" not in said and "pickle" not in said


def test_terrain_is_read_from_a_table_and_from_arrays(tmp_path):
    (tmp_path / "a.npz").write_bytes(GRID)
    (tmp_path / "a.csv").write_text(HEADER + "0,0,1\n0,100,1\n100,0,1\n100,100,1\n", encoding="utf-8-sig")
    for name in ("a.npz", "a.csv"):
        terrain = load_terrain(tmp_path / name)
        np.testing.assert_array_equal(terrain.north_m, LINES_M)
        np.testing.assert_array_equal(terrain.ground_m, np.ones((2, 2)))
    with pytest.raises(PlanError, match="can't be read: No such file"):
        load_terrain(tmp_path / "none.npz")


def test_lines_too_far_from_home_are_refused():
    with pytest.raises(PlanError, match=r"the lines reach 300\d\d m from the vehicle's home"):
        check_reach(SurveyOptions(area_ne_m=(29_000.0, 0.0)), WINGS, HOME)


def test_heights_over_level_ground_are_above_home_and_those_of_a_terrain_above_the_maps():
    survey = planned_survey(SurveyOptions(), WINGS, HOME)
    np.testing.assert_allclose(survey.places_ned_m()[:, 2], -80.0)
    assert survey.duration_s > 600.0


def test_all_manoeuvres_are_flown_on_their_headings_by_a_turning_body():
    flown = manoeuvres(math.radians(20.0))
    assert len(flown) == 24
    programme = Programme(flown)
    yaw, time_s, step_s, speed_m_s = 0.0, 0.0, 0.04, 25.0
    begun, pitched = [], 0.0
    while (command := programme.command(time_s, yaw_rad=yaw, airspeed_m_s=speed_m_s)) is not None:
        if programme.current is not None and programme.current not in begun:
            begun.append(programme.current)
            assert abs(math.remainder(yaw - programme.current.heading_rad, math.tau)) < math.radians(12.0)
        if programme.current is not None and programme.current.axis is Axis.PITCH:
            pitched = max(pitched, abs(command.pitch_offset_rad))
        yaw += step_s * 9.81 * math.tan(command.roll_rad) / speed_m_s
        time_s += step_s
        assert time_s < 1200.0
    assert begun == list(flown)
    assert pitched == pytest.approx(math.radians(6.0), rel=0.01)
    assert programme.over


def test_the_programme_waits_for_the_heading():
    programme = Programme(manoeuvres(0.0))
    for k in range(200):
        assert programme.command(0.1 * k, yaw_rad=1.0, airspeed_m_s=math.nan) is not None
    assert programme.current is None and programme.done == 0
    assert replace(SurveyOptions(), calibrate=True).calibrate
