"""Surveys and compensation flights in embedded worlds, from the ground to the files of the run."""

import io
import json
import lzma
import math
from dataclasses import replace

import numpy as np
import pytest

from estimators.log_replay import replay
from estimators.logs import open_log
from estimators.occupancy.survey_map import load_survey_map
from estimators.survey.compensation import direction_cosines, load_compensation
from estimators.survey.estimator import SurveyEstimator, SurveyEstimatorParameters
from estimators.survey.export import ANOMALIES, LINE_DATA, LINE_DATA_XYZ, LINES, MAP
from estimators.survey.parameters import ProcessingParameters
from flightsim.environment import Environment
from flightsim.foundation.geodesy import LocalFrame
from flightsim.foundation.magnetic_map_file import read_map_file
from flightsim.foundation.main_field import MainField
from flightsim.foundation.random_streams import RandomStreams
from flightsim.home import Home
from flightsim.payload import VehicleField, VehicleFieldParameters, magnetic_field_of
from flightsim.payload.survey_grid import map_from_survey
from flightsim.world_spec import WorldSpec
from missions.base.request import RunRequest
from missions.cli import main as cli
from missions.flown.records import FlightRecords
from missions.runs.session import fly
from missions.runs.vehicle_opening import MAP_NAME
from missions.survey.inputs import terrain_of
from missions.survey.mission import SurveyMission
from missions.survey.options import SurveyOptions
from missions.survey.outcome import COMPENSATION, report_lines
from missions.survey.records import flight_readings
from missions.survey.surveyed_field import SurveyedField
from missions.survey.world import survey_world
from tests.measured_survey import SURVEY, with_measured_survey

SMALL = SurveyOptions(
    width_m=500.0, height_m=600.0, spacing_m=250.0, tie_spacing_m=500.0,
    processing=ProcessingParameters(map_error_nt=0.0),
)  # fmt: skip
AIR = Environment.from_wind(speed_m_s=5.0, from_deg=270.0, turbulence="light")
NOISE_NT = 0.2  # of the default magnetometer


def request(out, options=SMALL, *, picture=False, seed=8, world=None, autopilot="px4", home=None, **values):
    spec = WorldSpec.of_team(1, model="aerosonde", seed=seed, air=AIR, autopilot=autopilot, home=home)
    made = survey_world(spec, options, SurveyedField(**values)) if world is None else world
    return RunRequest(options=options, world=made, out=out, picture=picture)


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """Three lines and two tie lines over a field with one target, whose map is exact."""
    out = tmp_path_factory.mktemp("survey") / "flown"
    return fly(SurveyMission(), request(out, picture=True, targets=1, exact_map=True))


def test_all_lines_are_measured_and_the_target_is_listed(flown):
    summary = flown.summary
    assert (flown.outcome, flown.reason) == ("completed", "")
    assert (summary["lines"], summary["tie_lines"], summary["crossings"]) == (3, 2, 6)
    assert summary["least_coverage"] > 0.98
    assert summary["no_map"] is None
    assert summary["lowest_height_m"] < summary["map_height_m"] < summary["highest_height_m"]
    assert summary["noise_nt"] == pytest.approx(NOISE_NT, rel=0.1)
    assert summary["path_max_error_m"] < 20.0
    assert summary["targets_found"] == 1
    assert summary["target_errors_m"][0] < 30.0


def test_the_folder_holds_what_a_survey_delivers(flown):
    names = {path.name for path in flown.folder.iterdir()}
    assert names == {
        *("flight.scene", "flight.tlog", "summary.json", "track.png", MAP_NAME),
        *(ANOMALIES, LINE_DATA, LINE_DATA_XYZ, LINES, MAP),
    }
    assert (flown.folder / "track.png").stat().st_size > 50_000
    assert json.loads((flown.folder / "summary.json").read_text())["lines"] == 3
    rows = (flown.folder / ANOMALIES).read_text().splitlines()
    assert len(rows) == 1 + len(flown.summary["anomalies"])


def test_the_estimator_over_the_log_makes_the_same_survey(flown):
    parameters = SurveyEstimatorParameters(
        map_file=flown.folder / MAP_NAME,
        lines_file=flown.folder / LINES,
        line_spacing_m=SMALL.spacing_m,
        map_error_nt=0.0,
    )
    done = replay(open_log(flown.folder / "flight.tlog"), lambda: SurveyEstimator(parameters))
    assert not done.partial
    (runner,) = done.fleet.runners.values()
    remarks = runner.remarks
    assert remarks["anomalies"] == len(flown.summary["anomalies"])
    for name in ("noise_nt", "differential_noise_nt", "misclosure_after_nt", "grid_error_nt"):
        assert remarks[name] == pytest.approx(flown.summary[name], abs=0.02)
    (table,) = runner.tables.values()
    assert len(table.values) > 300
    own, again = (
        np.genfromtxt(io.BytesIO(data), delimiter=",", names=True, dtype=None, encoding="utf-8")
        for data in ((flown.folder / LINE_DATA).read_bytes(), runner.files[LINE_DATA])
    )
    assert len(own) == len(again)
    np.testing.assert_allclose(own["differential_nt"], again["differential_nt"], atol=0.02)


def test_a_replay_with_the_files_of_the_flight_makes_its_map(flown, tmp_path):
    """The lines file has the distance of the lines, which is not the usual one here."""
    parameters = SurveyEstimatorParameters(
        map_file=flown.folder / MAP_NAME, lines_file=flown.folder / LINES, map_error_nt=0.0
    )
    done = replay(open_log(flown.folder / "flight.tlog"), lambda: SurveyEstimator(parameters))
    (runner,) = done.fleet.runners.values()
    (tmp_path / MAP).write_bytes(runner.files[MAP])
    own, again = read_map_file(flown.folder / MAP), read_map_file(tmp_path / MAP)
    assert again.line_spacing_m == own.line_spacing_m == SMALL.spacing_m
    np.testing.assert_array_equal(again.north_m, own.north_m)
    np.testing.assert_array_equal(again.east_m, own.east_m)
    np.testing.assert_allclose(again.total_field_nt, own.total_field_nt, atol=0.02)


@pytest.mark.slow
def test_an_estimator_beside_the_flight_agrees_with_the_mission(tmp_path):
    options = replace(
        SMALL,
        width_m=300.0,
        height_m=300.0,
        spacing_m=150.0,
        tie_spacing_m=300.0,
        processing=ProcessingParameters(map_error_nt=0.0, level=False),
    )
    asked = replace(request(tmp_path / "run", options, exact_map=True), estimator="survey")
    summary = fly(SurveyMission(), asked).summary
    assert (summary["outcome"], summary["reason"]) == ("completed", "")
    assert summary["crossings"] == 0  # without levelling
    assert summary["false_anomalies"] == len(summary["anomalies"])
    assert summary["targets"] == []
    (block,) = summary["estimator"]["vehicles"]
    remarks = block["remarks"]
    assert remarks["lines"] == summary["lines"] + summary["tie_lines"]
    assert remarks["readings_on_lines"] == summary["readings_on_lines"]
    assert remarks["crossings"] == 0
    for name in ("noise_nt", "differential_noise_nt", "grid_error_nt"):
        assert remarks[name] == pytest.approx(summary[name], abs=0.001)


def test_an_estimator_without_a_map_finds_lines_by_itself(flown, tmp_path):
    cut = tmp_path / "cut.tlog"  # without attitudes, which only a compensation needs
    types = "HEARTBEAT,NAMED_VALUE_FLOAT,GLOBAL_POSITION_INT"
    arguments = ["log", "cut", str(flown.folder / "flight.tlog"), str(cut), "--types", types]
    assert cli.run_command_line(arguments) == 0
    done = replay(open_log(cut), "survey")
    assert not done.partial
    (runner,) = done.fleet.runners.values()
    assert runner.remarks["lines"] >= 5  # type: ignore[operator]
    assert runner.remarks["anomalies"] == 0
    assert MAP in runner.files


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--area", "500"], "give NORTH,EAST"),
        (["--spacing", "0"], "--spacing 0 is not possible"),
        (["--map", "nowhere.npz"], "--map nowhere.npz can't be read"),
        (["--terrain", "nowhere.csv"], "--terrain nowhere.csv can't be read"),
        (["--estimator", "survey", "--set", "grid_m=0.1"], "0.1 m makes 21001 x 21001 grid points"),
        (["--calibrate", "--compensation", "c.json"], "has no use with --calibrate"),
        (["--model", "iris"], "flown by an aircraft with wings"),
        (["--vehicles", "2"], "flown by one aircraft"),
        (["--altitude", "5"], "--altitude 5 m is not in"),
        (["--size", "30000"], "--size"),
        (["--tie-spacing", "0.01"], "--tie-spacing 0.01 m makes 200000 tie lines"),
        (["--grid", "0.1"], "--grid 0.1 m makes 21001 x 21001 grid points"),
    ],
)
def test_the_command_line_refuses_with_usage_errors(arguments, words, tmp_path, capsys):
    out = tmp_path / "run"
    assert cli.run_command_line(["fly", "survey", "--out", str(out), *arguments]) == 2
    assert words in " ".join(capsys.readouterr().err.split())
    assert not out.exists()


def test_a_map_that_does_not_cover_the_lines_is_refused_before_anything_starts(flown, tmp_path, capsys):
    out = tmp_path / "run"
    arguments = ["--map", str(flown.folder / MAP_NAME), "--area", "3000,0", "--out", str(out)]
    assert cli.run_command_line(["fly", "survey", *arguments]) == 2
    assert "the magnetic map has no data at" in " ".join(capsys.readouterr().err.split())
    assert not out.exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["replay", "LOG", "--estimator", "survey", "--set", "map_file=no.npz"], "map_file no.npz can't be"),
        (
            ["replay", "LOG", "--estimator", "survey", "--set", "compensation_file=no"],
            ": compensation_file no can't be read: No such",
        ),
        (
            ["replay", "LOG", "--estimator", "survey", "--set", "lines_file=no"],
            "lines_file no can't be read: ",
        ),
        (
            ["replay", "LOG", "--estimator", "survey", "--set", "decimal_year=1e9"],
            "decimal_year 1e+09 is not in 2025..2030",
        ),
        (["replay", "LOG", "--estimator", "survey", "--set", "foo"], "--set 'foo' is not NAME=VALUE"),
        (
            ["fly", "lissajous", "--estimator", "survey", "--set", "map_file=no.npz"],
            ": map_file no.npz can't",
        ),
        (["fly", "survey", "--map", "no.npz"], "--map no.npz can't be read"),
    ],
)
def test_parameters_of_the_estimator_keep_their_names_where_no_option_sets_them(
    flown, arguments, words, tmp_path, capsys
):
    log = str(flown.folder / "flight.tlog")
    out = tmp_path / "run"
    given = [log if word == "LOG" else word for word in arguments]
    assert cli.run_command_line([*given, "--out", str(out)]) == 2
    assert words in " ".join(capsys.readouterr().err.split())
    assert not out.exists()


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"misclosure_after_nt": None}, "after it unknown (the levels explain all crossings)"),
        ({"no_map": "all places are on one line"}, "warning: there is no survey_map.npz: all places are on"),
        (
            {"map_height_m": 110.7, "lowest_height_m": 88.0, "highest_height_m": 138.0},
            "the map is stated for 111 m above home, the mean height of readings at 88 to 138 m",
        ),
        ({"targets": []}, "nT elsewhere"),
    ],
)
def test_the_report_has_what_is_unknown_or_missing_in_words(flown, changed, words):
    lines = "\n".join(report_lines({**flown.summary, **changed}))
    assert words in lines
    assert "0 of 0" not in lines


@pytest.mark.slow
def test_one_seed_makes_one_survey(flown, tmp_path):
    again = fly(SurveyMission(), request(tmp_path / "again", targets=1, exact_map=True))
    for name in ("flight.tlog", LINE_DATA, MAP):
        assert (again.folder / name).read_bytes() == (flown.folder / name).read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_survey_over_terrain_keeps_its_height(autopilot, tmp_path):
    lines = np.linspace(-2000.0, 2000.0, 41)
    ground = 30.0 * np.sin(lines / 400.0)[:, None] * np.cos(lines / 300.0) + 0.01 * lines
    np.savez(tmp_path / "terrain.npz", north_m=lines, east_m=lines, ground_m=ground)
    options = replace(SMALL, terrain_file=str(tmp_path / "terrain.npz"))
    result = fly(SurveyMission(), request(tmp_path / "run", options, autopilot=autopilot, exact_map=True))
    assert (result.outcome, result.reason) == ("completed", "")
    home = load_survey_map(result.folder / MAP_NAME).home
    records = FlightRecords.from_tlog(result.folder / "flight.tlog")
    readings = flight_readings(records, 1, LocalFrame(home), attitude=False)
    table = np.genfromtxt(result.folder / LINE_DATA, delimiter=",", names=True, dtype=None, encoding="utf-8")
    clearance = table["height_m"] - terrain_of(options).at(table["north_m"], table["east_m"])
    assert clearance.min() > options.altitude_m - 6.0
    assert np.ptp(table["height_m"]) > 15.0
    assert len(readings) > len(table)


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize("seed", range(1, 5))
def test_compensation_takes_out_the_aircraft_at_least_ten_times(seed, autopilot, tmp_path):
    """Improvement ratio and figure of merit of the second box, and the aircraft's true field on all headings.

    The magnetometer's own noise makes 1.1 nT of the figure of merit, whatever the compensation.
    """
    options = SurveyOptions(calibrate=True)
    result = fly(
        SurveyMission(),
        request(tmp_path / "run", options, picture=True, seed=seed, autopilot=autopilot, uncompensated=True),
    )
    assert (result.outcome, result.reason) == ("completed", "")
    summary = result.summary
    assert summary["improvement"] > 10.0
    before_nt, after_nt, noise_nt = (
        summary[f"figure_of_merit{name}_nt"] for name in ("_before", "", "_noise")
    )
    assert before_nt > 10.0 * after_nt
    assert after_nt < 3.0
    assert 0.8 < noise_nt < 1.3
    compensation = load_compensation(result.folder / COMPENSATION)
    home = load_survey_map(result.folder / MAP_NAME).home
    main = MainField(home)
    yaw = np.linspace(-math.pi, math.pi, 73)
    level = np.zeros(len(yaw))
    cosines, _ = direction_cosines(level, level + 0.03, yaw, np.arange(73.0), main.direction_ned)
    fitted = compensation.field_nt(cosines, np.zeros((73, 3)))
    truth = true_field_nt(cosines, main.total_nt, seed)
    left = (fitted - fitted.mean()) - (truth - truth.mean())
    assert truth.std() > 10.0 * left.std()


def true_field_nt(cosines, strength_nt, seed):
    """The aircraft's field in level flight, from its magnetometer's stream."""
    stream = RandomStreams(seed).child("vehicle", 0, "sensor", "survey_magnetometer")
    rng = np.random.Generator(np.random.PCG64(stream))
    residual = 0.3 * rng.standard_normal(3)
    rng.standard_normal()  # the drift
    field = VehicleField(VehicleFieldParameters(), rng)
    still = np.zeros(3)
    return np.array([field.total_nt(u, still, strength_nt) + residual @ u for u in cosines])


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_compensated_survey_is_as_good_as_one_without_an_aircraft(tmp_path):
    calibration = SurveyOptions(calibrate=True)
    made = fly(SurveyMission(), request(tmp_path / "calibration", calibration, uncompensated=True))
    raw = fly(SurveyMission(), request(tmp_path / "raw", uncompensated=True, exact_map=True))
    options = replace(SMALL, compensation_file=str(made.folder / COMPENSATION))
    done = fly(SurveyMission(), request(tmp_path / "done", options, uncompensated=True, exact_map=True))
    assert raw.summary["misclosure_before_nt"] > 5.0 * done.summary["misclosure_before_nt"]
    assert done.summary["differential_noise_nt"] < 1.2 * NOISE_NT
    assert not done.summary["anomalies"]


@pytest.mark.slow
@pytest.mark.timeout(900)
@with_measured_survey
def test_a_survey_over_the_measured_map(tmp_path):
    """The noise where nothing is, the targets, and the map from the flight against its source."""
    with lzma.open(SURVEY, "rt") as file:
        table = np.genfromtxt(file, delimiter=",", names=True, dtype=None, encoding="utf-8")
    home = Home(lat_deg=-22.252, lon_deg=-42.297, alt_m=0.0)
    source = map_from_survey(
        table["latitude"], table["longitude"], table["total_field_anomaly_nt"], home=home, height_m=100.0
    )
    source.save(tmp_path / "source.npz")
    options = SurveyOptions(
        width_m=2000.0, height_m=2000.0, altitude_m=100.0, map_file=str(tmp_path / "source.npz"),
        processing=ProcessingParameters(map_error_nt=0.0),
    )  # fmt: skip
    asked = request(tmp_path / "run", options, home=home, targets=4, exact_map=True)
    result = fly(SurveyMission(), asked)
    summary = result.summary
    assert (result.outcome, result.reason) == ("completed", "")
    assert summary["noise_nt"] == pytest.approx(NOISE_NT, rel=0.1)
    assert summary["differential_noise_nt"] == pytest.approx(NOISE_NT, rel=0.1)

    world = asked.world
    assert world is not None
    field, _ = magnetic_field_of(world.magnetic_field, home=home, seed=world.seed, decimal_year=2026.0)
    table = np.genfromtxt(result.folder / LINE_DATA, delimiter=",", names=True, dtype=None, encoding="utf-8")
    main = MainField(home)
    seen = 0
    for signature, error_m in zip(field.signatures, summary["target_errors_m"], strict=True):
        on_lines = signature.anomaly_nt(
            table["north_m"], table["east_m"], 100.0, main.total_nt * main.direction_ned
        )
        if np.abs(on_lines).max() > 3.0 * NOISE_NT:
            seen += 1
            assert error_m < 30.0
    assert seen >= 3
    assert summary["false_anomalies"] == 0

    made = read_map_file(result.folder / MAP)
    north, east = np.meshgrid(made.north_m, made.east_m, indexing="ij")
    inside = np.isfinite(made.total_field_nt)
    inside &= (np.abs(north) <= 1000.0) & (np.abs(east) <= 1000.0)
    true_nt = field.total_at_nt(north[inside], east[inside], made.height_m)
    error_nt = made.total_field_nt[inside] - true_nt
    assert made.error_nt is not None
    assert np.sqrt(np.mean((error_nt - np.median(error_nt)) ** 2)) < made.error_nt
