"""Surveys with known levels, targets and noise: what processing finds of them."""

import math
import re
from dataclasses import fields, replace

import numpy as np
import pytest

from estimators.errors import EstimatorError
from estimators.occupancy.survey_map import SurveyMap
from estimators.survey.anomalies import Search, line_peaks
from estimators.survey.estimator import SurveyEstimator, SurveyEstimatorParameters
from estimators.survey.export import ANOMALIES, LINE_DATA, LINE_DATA_XYZ, LINES, MAP, survey_files
from estimators.survey.levelling import Crossing, levelled
from estimators.survey.lines import HEADER, LineKind, LinePlan, SurveyLine, detected_lines, load_lines
from estimators.survey.parameters import ProcessingParameters
from estimators.survey.processing import process_survey, white_noise_nt
from estimators.survey.readings import SurveyReadings, placed_readings
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.magnetic_map_file import MagneticMapError, read_map_file
from flightsim.foundation.main_field import MainField
from flightsim.payload import (
    DailyVariation,
    DailyVariationParameters,
    DipoleSignature,
    MagneticMap,
    SurveyParameters,
    truth_behind,
)
from missions.survey.options import SurveyOptions
from missions.survey.outcome import covered
from missions.survey.plan import line_plan

HOME = GeodeticPosition(lat_deg=47.4, lon_deg=8.55, alt_m=480.0)
MAIN = MainField(HOME)
SPEED_M_S = 25.0
NOISE_NT = 0.2
HEIGHT_M = 80.0
GRID_M = np.linspace(-1500.0, 1500.0, 61)


def hills(north_m, east_m):
    """Geology without features between the lines."""
    return 40.0 * np.sin(north_m / 700.0) * np.cos(east_m / 900.0) + 0.01 * north_m


def published(*, error_nt=None) -> SurveyMap:
    north, east = np.meshgrid(GRID_M, GRID_M, indexing="ij")
    return SurveyMap(
        north_m=GRID_M,
        east_m=GRID_M,
        total_field_nt=MAIN.total_at_nt(north, east) + MAIN.gradient_up_nt_m * HEIGHT_M + hills(north, east),
        vertical_gradient_nt_m=np.zeros(north.shape),
        height_m=HEIGHT_M,
        home=HOME,
        error_nt=error_nt,
        line_spacing_m=200.0,
    )


def plan() -> LinePlan:
    lines = [
        SurveyLine(name=f"L{k + 1}", kind=LineKind.LINE, start_ne_m=(-800.0, x), end_ne_m=(800.0, x))
        for k, x in enumerate(np.arange(-800.0, 801.0, 200.0).tolist())
    ]
    ties = [
        SurveyLine(name=f"T{k + 1}", kind=LineKind.TIE, start_ne_m=(y, -800.0), end_ne_m=(y, 800.0))
        for k, y in enumerate((-500.0, 500.0))
    ]
    flown = [line if k % 2 == 0 else line.reversed() for k, line in enumerate(lines)]
    return LinePlan.of((*flown, *ties))


def flown(seed, *, levels_nt=None, target=None, survey_map=None):
    """Readings along the lines of `plan` over the field of `published`, and 30 s between two lines."""
    rng = np.random.default_rng(seed)
    on_map = survey_map or published()
    parts, start_s = [], 0.0
    for k, line in enumerate(plan().lines):
        count = round(10.0 * line.length_m / SPEED_M_S)
        share = np.arange(count) / (count - 1)
        north, east = (a + share * (b - a) for a, b in zip(line.start_ne_m, line.end_ne_m, strict=True))
        total = on_map.totals_nt(north, east, np.full(count, HEIGHT_M)) + NOISE_NT * rng.standard_normal(
            count
        )
        if levels_nt is not None:
            total = total + levels_nt[k]
        if target is not None:
            total = total + target.anomaly_nt(north, east, HEIGHT_M, MAIN.total_nt * MAIN.direction_ned)
        parts.append(np.column_stack((start_s + 0.1 * np.arange(count), north, east, total)))
        start_s += 0.1 * count + 30.0
    time_s, north_m, east_m, total_nt = np.concatenate(parts).T
    level = np.zeros(len(time_s))
    return SurveyReadings(
        time_s=time_s, north_m=north_m, east_m=east_m, height_m=level + HEIGHT_M, roll_rad=level,
        pitch_rad=level, yaw_rad=level, total_nt=total_nt,
    )  # fmt: skip


def processed(readings, survey_map=None, **parameters):
    return process_survey(
        readings, plan(), home=HOME, survey_map=survey_map, parameters=ProcessingParameters(**parameters)
    )


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.sampled(1)
def test_levels_of_the_lines_are_found_at_the_crossings(seed):
    levels_nt = 3.0 * np.random.default_rng(100 + seed).standard_normal(len(plan().lines))
    result = processed(flown(seed, levels_nt=levels_nt), published(), map_error_nt=0.0)
    assert result.levelling.crossings == 18
    found = result.levelling.level_nt
    # the sum of the levels is not observable
    np.testing.assert_allclose(found - found.mean(), levels_nt - levels_nt.mean(), atol=0.15)
    assert result.levelling.before_nt > 2.0
    assert result.levelling.after_nt < 0.15
    unlevelled = processed(flown(seed, levels_nt=levels_nt), published(), level=False)
    assert unlevelled.grid_error_nt > 5.0 * result.grid_error_nt


def test_levelling_takes_out_the_daily_variation():
    day = DailyVariation(DailyVariationParameters(dip_nt=40.0), np.random.SeedSequence(1))
    readings = flown(1)
    varied = replace(
        readings, total_nt=readings.total_nt + np.array([day.at_nt(t) for t in readings.time_s.tolist()])
    )
    result = processed(varied, published(), map_error_nt=0.0)
    assert result.levelling.before_nt > 1.0
    assert result.levelling.after_nt < 0.5
    assert result.grid_error_nt < 0.5 * processed(varied, published(), level=False).grid_error_nt


@pytest.mark.parametrize("seed", range(2))
def test_where_nothing_is_the_differential_measurement_is_the_sensors_noise(seed):
    result = processed(flown(seed), published(), map_error_nt=0.0)
    assert result.noise_nt == pytest.approx(NOISE_NT, rel=0.05)
    assert result.differential_noise_nt == pytest.approx(NOISE_NT, rel=0.05)
    assert not result.anomalies


@pytest.mark.parametrize("seed", range(2))
def test_a_dipole_is_one_anomaly_with_its_place_depth_and_moment(seed):
    rng = np.random.default_rng(seed)
    north_m, east_m = rng.uniform(-600.0, 600.0, 2).tolist()
    target = DipoleSignature(north_m=north_m, east_m=east_m, height_m=-5.0, moment_ned_a_m2=(2e4, -1e4, 7e4))
    result = processed(flown(seed, target=target), published(), map_error_nt=0.0)
    assert len(result.anomalies) == 1
    (anomaly,) = result.anomalies
    assert math.dist((anomaly.north_m, anomaly.east_m), (north_m, east_m)) < 15.0
    assert anomaly.source is not None
    assert anomaly.source.height_m == pytest.approx(-5.0, abs=25.0)
    assert anomaly.source.moment_a_m2 == pytest.approx(math.hypot(2e4, 1e4, 7e4), rel=0.4)
    assert result.differential_noise_nt == pytest.approx(NOISE_NT, rel=0.1)


def test_an_offset_of_all_readings_is_not_in_the_levelled_ones():
    """The magnetometer reads 37 nT too much: the datum is that of the map."""
    readings = flown(1)
    high = replace(readings, total_nt=readings.total_nt + 37.0)
    result = processed(high, published(), map_error_nt=0.0)
    on = result.on_lines
    assert float(np.median(result.differential_nt[on])) == pytest.approx(0.0, abs=1e-6)
    level = result.levelled_nt[on] - processed(readings, published(), map_error_nt=0.0).levelled_nt[on]
    np.testing.assert_allclose(level, 0.0, atol=1e-6)
    assert result.grid is not None
    north, east = np.meshgrid(result.grid.north_m, result.grid.east_m, indexing="ij")
    on_map = published().totals_nt(north.ravel(), east.ravel(), np.full(north.size, HEIGHT_M))
    assert float(np.nanmedian(result.grid.values_nt.ravel() - on_map)) == pytest.approx(0.0, abs=0.1)


def test_a_target_on_the_first_line_is_seen_by_that_line():
    """The number of the first line is 0: each of the lines counts, also where a number is a truth value."""
    north_m, east_m = 100.0, plan().lines[0].start_ne_m[1]
    target = DipoleSignature(north_m=north_m, east_m=east_m, height_m=-5.0, moment_ned_a_m2=(2e4, -1e4, 7e4))
    result = processed(flown(1, target=target), published(), map_error_nt=0.0)
    (anomaly,) = result.anomalies
    assert 0 in anomaly.lines
    assert anomaly.source is not None
    assert math.dist((anomaly.north_m, anomaly.east_m), (north_m, east_m)) < 15.0
    first = Search(
        lines=(0,),
        line_of=np.where(result.line_of == 0, 0, -1),
        north_m=result.readings.north_m,
        east_m=result.readings.east_m,
        height_m=result.readings.height_m,
        differential_nt=result.differential_nt,
        direction_ned=MAIN.direction_ned,
    )
    assert first.lines_near(north_m, east_m, 150.0) == [0]
    peaks = line_peaks(
        0, *(column[result.line_of == 0] for column in (
            result.readings.time_s, result.readings.north_m, result.readings.east_m, result.differential_nt
        )), noise_nt=NOISE_NT,
    )  # fmt: skip
    source = first.dipole_at(max(peaks, key=lambda peak: peak.ratio), result.differential_nt)
    assert source is not None
    assert math.dist((source.north_m, source.east_m), (north_m, east_m)) < 60.0


def test_the_error_of_a_map_is_no_anomaly_where_the_map_states_it():
    """The true field differs from the map by the error of a survey."""
    on_map = published(error_nt=1.0)
    exact = MagneticMap(
        north_m=on_map.north_m, east_m=on_map.east_m, total_field_nt=on_map.total_field_nt,
        height_m=HEIGHT_M, home=HOME, error_nt=1.0, line_spacing_m=200.0,
    )  # fmt: skip
    anomalies = {None: 0, 0.0: 0}
    for seed in range(1):
        truth = truth_behind(exact, SurveyParameters(), seed=np.random.SeedSequence(seed))
        true_map = SurveyMap(
            north_m=truth.north_m, east_m=truth.east_m, total_field_nt=truth.total_field_nt,
            vertical_gradient_nt_m=np.zeros(truth.total_field_nt.shape), height_m=HEIGHT_M, home=HOME,
        )  # fmt: skip
        readings = flown(seed, survey_map=true_map)
        for stated_nt in anomalies:
            anomalies[stated_nt] += len(processed(readings, on_map, map_error_nt=stated_nt).anomalies)
    assert anomalies[None] == 0
    assert anomalies[0.0] > 2


def test_the_map_from_the_flight_agrees_with_the_field():
    result = processed(flown(1))
    grid = result.grid
    assert grid is not None and not result.against_map and not result.anomalies
    true_nt = published().totals_nt(*np.meshgrid(grid.north_m, grid.east_m, indexing="ij"), HEIGHT_M)  # type: ignore[call-arg]
    inside = np.isfinite(grid.values_nt)
    assert inside.mean() > 0.95
    error_nt = grid.values_nt[inside] - true_nt[inside]
    assert np.sqrt(np.mean((error_nt - np.median(error_nt)) ** 2)) < 2.0 * result.grid_error_nt


def test_files_can_be_read_again_and_the_map_is_a_map(tmp_path):
    result = processed(flown(1, levels_nt=np.zeros(11)), published())
    files = survey_files(result)
    assert set(files) == {LINES, LINE_DATA, LINE_DATA_XYZ, ANOMALIES, MAP}
    for name, contents in files.items():
        (tmp_path / name).write_bytes(contents)
    assert load_lines(tmp_path / LINES) == plan()
    table = np.genfromtxt(tmp_path / LINE_DATA, delimiter=",", names=True, dtype=None, encoding="utf-8")
    assert len(table) == result.on_lines.sum()
    north_m, east_m, _ = LocalFrame(HOME).ned_from_geodetic(
        table["latitude_deg"][7], table["longitude_deg"][7], 0.0
    )
    assert (north_m, east_m) == pytest.approx((table["north_m"][7], table["east_m"][7]), abs=0.05)
    xyz = (tmp_path / LINE_DATA_XYZ).read_text().splitlines()
    assert [row for row in xyz if row[0] in "LT"] == [f"Line {k}" for k in range(1, 10)] + ["Tie 1", "Tie 2"]
    made = read_map_file(tmp_path / MAP)
    assert made.error_nt == pytest.approx(result.grid_error_nt)
    assert made.height_m == HEIGHT_M
    assert survey_files(processed(flown(1, levels_nt=np.zeros(11)), published())) == files


def test_a_vehicle_that_stood_on_a_line_before_the_takeoff_measures_it_in_flight():
    """Home is on the middle line of an area; the course of a vehicle at rest is zero, as that of the line."""
    line = SurveyLine(name="L1", kind=LineKind.LINE, start_ne_m=(-300.0, 0.0), end_ne_m=(300.0, 0.0))
    flown = np.arange(-400.0, 400.0, 2.2)
    north, east = np.concatenate((np.zeros(900), [200.0, 300.0], flown)), np.zeros(902 + len(flown))
    east[900:902] = 200.0
    on = LinePlan(lines=(line,)).line_of(north, east) == 0
    assert not on[:902].any()
    assert np.ptp(north[on]) > 595.0


def test_lines_are_found_in_a_track():
    readings = flown(1)
    # every 30 s of turn are missing: the track jumps from a line to the next
    found = detected_lines(readings.north_m[::4], readings.east_m[::4], least_length_m=1000.0)
    assert [line.kind for line in found.lines] == [LineKind.LINE] * 9 + [LineKind.TIE] * 2
    for line, flown_line in zip(found.lines, plan().lines, strict=True):
        assert math.dist(line.start_ne_m, flown_line.start_ne_m) < 30.0
        assert math.dist(line.end_ne_m, flown_line.end_ne_m) < 30.0


def test_a_stuck_magnetometer_and_a_gap_of_positions_are_left_out():
    time_s = 0.1 * np.arange(600)
    total_nt = 48_000.0 + np.random.default_rng(1).standard_normal(600)
    total_nt[100:200] = 48_001.0
    total_nt[300] = 4e5
    track = 0.2 * np.arange(300)
    positions = np.column_stack((track, np.full(300, 47.4), np.full(300, 8.55), np.full(300, 560.0)))
    positions = positions[(track < 40.0) | (track > 45.0)]
    attitudes = np.column_stack((track, np.zeros((300, 3))))
    found = placed_readings(
        time_s, total_nt, positions=positions, attitudes=attitudes, frame=LocalFrame(HOME)
    )
    assert found.implausible == 71
    assert found.unplaced == pytest.approx(54, abs=2)
    assert len(found) == 600 - found.implausible - found.unplaced
    np.testing.assert_allclose(found.height_m, 80.0)


def test_readings_are_placed_across_180_degrees():
    time_s = 0.1 * np.arange(100)
    frame = LocalFrame(replace(HOME, lon_deg=179.9999))
    east_m = 20.0 * time_s
    lat, lon, alt = frame.geodetic_from_ned(np.zeros(100), east_m, np.full(100, -80.0))
    positions = np.column_stack((time_s, lat, lon, alt))
    total_nt = 48_000.0 + np.random.default_rng(1).standard_normal(100)
    found = placed_readings(time_s, total_nt, positions=positions[::3], attitudes=None, frame=frame)
    np.testing.assert_allclose(found.east_m, 20.0 * found.time_s, atol=1e-4)
    assert len(found) == 100


@pytest.mark.parametrize(("missing_s", "share"), [(1.5, 1.0), (20.0, 1.0 - 20.1 * SPEED_M_S / 1600.0)])
def test_a_hole_in_the_readings_of_a_line_is_not_covered(missing_s, share):
    """A pause between two readings that is longer than two seconds leaves a hole."""
    readings = flown(1)
    kept = np.abs(readings.time_s - 32.0) > 0.5 * missing_s
    columns = {f.name: getattr(readings, f.name)[kept] for f in fields(readings)[:8]}
    coverage = covered(processed(SurveyReadings(**columns)))
    assert coverage[0] == pytest.approx(share, abs=0.005)
    assert min(coverage[1:]) > 0.99


def test_one_tie_line_leaves_no_misclosure_to_judge_the_levels_by():
    """Its level and those of the lines explain as many crossings as there are lines."""
    tied = plan().lines[:-1]
    parameters = ProcessingParameters(map_error_nt=0.0)
    one, two = (
        process_survey(flown(1), LinePlan.of(lines), home=HOME, parameters=parameters).levelling
        for lines in (tied, plan().lines)
    )
    assert one.crossings == 9
    assert one.before_nt > 0.0 and math.isnan(one.after_nt)
    # 18 crossings determine 10 levels: the rest has the noise of a difference of two crossing values
    assert two.after_nt == pytest.approx(NOISE_NT * math.sqrt(2.0 / 80.0), rel=0.6)


def test_lines_and_their_levels_in_two_separate_nets_are_counted_apart():
    found = [
        Crossing(line=line, tie=tie, north_m=0.0, east_m=0.0, misclosure_nt=value)
        for (line, tie), value in zip(
            [(0, 4), (1, 4), (0, 5), (1, 5), (2, 6), (3, 6)], [1.0, -1.0, -1.0, 1.0, 3.0, 5.0], strict=True
        )
    ]
    # seven lines in two nets: five levels for six crossings, and squares that sum to 4
    assert levelled(7, found).after_nt == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"decimal_year": 1e9}, "decimal_year 1e.09 is not in 2025..2030"),
        ({"line_spacing_m": 0.5}, "line_spacing_m 0.5 is not possible; ask for 1 or more"),
        ({"grid_m": 0.0}, "grid_m"),
    ],
)
def test_parameters_that_cannot_be_processed_are_refused(values, words):
    with pytest.raises(ValueError, match=words):
        SurveyEstimatorParameters(**values)


def test_a_grid_that_is_too_fine_is_refused_before_and_named_after_the_flight(tmp_path):
    (tmp_path / LINES).write_text(plan().to_csv())
    words = r"`grid_m` 0.1 m makes \d+ x \d+ grid points; up to 1000000 are accepted: choose a larger one"
    with pytest.raises(EstimatorError, match=words):
        SurveyEstimator(SurveyEstimatorParameters(lines_file=tmp_path / LINES, grid_m=0.1))
    result = processed(flown(1), grid_m=0.1)
    assert result.grid is None
    assert re.match(words.replace("`", ""), result.no_grid)


@pytest.mark.parametrize(("spacing_m", "corridor_m"), [(50.0, 20.0), (100.0, 40.0), (400.0, 50.0)])
def test_lines_from_a_file_have_the_spacing_and_the_corridor_of_the_flight(tmp_path, spacing_m, corridor_m):
    options = SurveyOptions(
        width_m=4.0 * spacing_m, height_m=900.0, spacing_m=spacing_m, direction_rad=0.7, tie_spacing_m=300.0
    )
    planned = line_plan(options, turn_radius_m=100.0)
    (tmp_path / LINES).write_text(planned.to_csv())
    for plan_of in (planned, load_lines(tmp_path / LINES)):
        assert plan_of.spacing_m == pytest.approx(spacing_m, abs=0.01)
        assert plan_of.corridor_m == pytest.approx(corridor_m, abs=0.01)
        assert ProcessingParameters().cell_m(plan_of) == pytest.approx(spacing_m / 4.0, abs=0.01)


def test_readings_need_no_attitude_without_a_compensation():
    time_s = 0.1 * np.arange(100)
    positions = np.column_stack((time_s, np.full(100, 47.4), np.full(100, 8.55), np.full(100, 560.0)))
    values = 48_000.0 + np.random.default_rng(1).standard_normal(100)
    found = placed_readings(time_s, values, positions=positions, attitudes=None, frame=LocalFrame(HOME))
    assert len(found) == 100
    assert np.isnan(found.roll_rad).all()


def test_white_noise_is_not_geology():
    rng = np.random.default_rng(2)
    along = 2.5 * np.arange(4000)
    values = 60.0 * np.sin(along / 300.0) + 0.3 * rng.standard_normal(4000)
    assert white_noise_nt(values, np.zeros(4000, dtype=np.int64)) == pytest.approx(0.3, rel=0.05)
    assert math.isnan(white_noise_nt(values, np.full(4000, -1)))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("nonsense\n", "begins with 'nonsense'"),
        (f"{HEADER}\n", "a header and no lines"),
        (f"{HEADER}\nL1,road,0,0,1,1\n", "line 2: kind 'road' is not accepted; there are line, tie"),
        (f"{HEADER}\nL1,line,0,0,1\n", "line 2: 5 values; accepted are 6: name,kind"),
        (f"{HEADER}\nL1,line,0,here,1,1\n", "line 2: start_east_m 'here' is not a number; give metres"),
        (f"{HEADER}\nL1,line,0,0,0,0\n", "line 2: line L1 .* no length"),
    ],
)
def test_files_that_are_no_lines_are_refused(tmp_path, text, words):
    (tmp_path / "lines.csv").write_text(text)
    with pytest.raises(EstimatorError, match=words):
        load_lines(tmp_path / "lines.csv")


def test_a_damaged_map_is_refused(tmp_path):
    (tmp_path / "map.npz").write_bytes(survey_files(processed(flown(1)))[MAP][:-40])
    with pytest.raises(MagneticMapError, match=r"map\.npz is not a magnetic map"):
        read_map_file(tmp_path / "map.npz")


def test_a_survey_that_ends_after_one_line_has_no_map_and_no_error():
    readings = flown(1)
    short = SurveyReadings(
        **{
            name: getattr(readings, name)[:600]
            for name in (
                *("time_s", "north_m", "east_m", "height_m"),
                *("roll_rad", "pitch_rad", "yaw_rad", "total_nt"),
            )
        }
    )
    result = processed(short, published())
    assert result.grid is None
    assert result.no_grid == "all places are on one line; two lines or more make a grid"
    assert MAP not in survey_files(result)
    assert result.on_lines.sum() > 500
