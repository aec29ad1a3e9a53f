"""The estimator on messages, and what it says of bad input."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from autopilot_bridge.mavlink import DEFINITIONS, FrameEncoder, dialect
from autopilot_bridge.tlog import TlogWriter
from estimators.errors import EstimatorError
from estimators.interface import Outcome
from estimators.library import make_estimator
from estimators.messages import message_class
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.home import Home
from flightsim.payload import MagneticMap
from missions.cli.main import run_command_line
from tests.estimators.magnetic_identification.encounters import HEIGHT_M, readings, target, track

HOME = Home(lat_deg=47.4, lon_deg=8.5, alt_m=480.0)
FRAME = LocalFrame(GeodeticPosition(lat_deg=47.4, lon_deg=8.5, alt_m=480.0))
READING = message_class(DEFINITIONS[251])
POSITION = message_class(DEFINITIONS[33])
LEVEL_NT = 48_000.0


@pytest.fixture
def map_file(tmp_path) -> Path:
    path = tmp_path / "map.npz"
    lines = np.linspace(-1500.0, 1500.0, 31)
    total = np.full((31, 31), LEVEL_NT)
    total[:3, :] = np.nan
    MagneticMap(
        north_m=lines, east_m=lines, total_field_nt=total, height_m=HEIGHT_M, home=HOME, error_nt=1.0
    ).save(path)
    return path


def estimator(map_file, *settings):
    return make_estimator(
        "magnetic-identification",
        [f"map_file={map_file}", "particles=800", "noise_nt=0.2", "report_s=2", *settings],
    )


def reading(time_us, total_nt, *, component=158, name="MAG_NT"):
    return READING(  # type: ignore[call-arg]
        src_system=1, src_component=component, time_boot_ms=time_us // 1000, value=total_nt, name_=name
    )


def position(time_us, north_m, east_m):
    lat, lon, alt = FRAME.geodetic_from_ned(north_m, east_m, -HEIGHT_M)
    return POSITION(  # type: ignore[call-arg]
        src_system=1, src_component=1, time_boot_ms=time_us // 1000, lat=round(lat * 1e7),
        lon=round(lon * 1e7), alt=round(alt * 1e3), relative_alt=0, vx=0, vy=0, vz=0, hdg=0,
    )  # fmt: skip


def passing(found, *, seed=1, source=True, without=()):
    """Messages of one pass; positions are missing between the times of `without`, s."""
    rng = np.random.default_rng(seed)
    signatures = [target(rng)] if source else []
    outcomes = []
    for k, taken in enumerate(readings(rng, track(rng, offset_m=20.0, course_rad=0.4), signatures)):
        outcomes.append(found.handle(taken.time_us, reading(taken.time_us, LEVEL_NT + taken.total_nt)))
        if k % 2 == 0 and not (without and without[0] <= taken.time_us * 1e-6 <= without[1]):
            outcomes.append(found.handle(taken.time_us, position(taken.time_us, taken.north_m, taken.east_m)))
    return outcomes


def test_a_pass_over_a_target_gives_estimates_with_its_place(map_file):
    found = estimator(map_file)
    estimates = []
    rng = np.random.default_rng(1)
    for k, taken in enumerate(readings(rng, track(rng, offset_m=20.0, course_rad=0.4), [target(rng)])):
        found.handle(taken.time_us, reading(taken.time_us, LEVEL_NT + taken.total_nt))
        if k % 2 == 0:
            outcome = found.handle(taken.time_us, position(taken.time_us, taken.north_m, taken.east_m))
            if outcome is Outcome.UPDATED:
                estimates += found.estimates
                assert len(found.publish()) == len(found.estimates)
    last = estimates[-1]
    assert len(estimates) >= 3
    assert last.probability > 0.5
    assert all(len(row) == len(last.COLUMNS) for row in last.rows())
    nearest = min(math.hypot(row[0], row[1]) for row in last.rows())
    assert nearest < 40.0
    assert found.origin == FRAME.origin
    assert found.remarks()["anomalies"] == 1.0


def test_a_reset_estimator_repeats_itself(map_file):
    found = estimator(map_file)
    first = (passing(found), found.remarks())
    found.reset()
    assert (passing(found), found.remarks()) == first


def test_without_a_map_it_says_so():
    found = make_estimator("magnetic-identification")
    assert set(passing(found)) == {Outcome.WAITING}
    assert "no map" in str(found.remarks()["warning"])


def test_a_map_that_does_not_exist_is_refused(tmp_path):
    with pytest.raises(EstimatorError, match="can't be read: No such file"):
        make_estimator("magnetic-identification", [f"map_file={tmp_path / 'none.npz'}"])


@pytest.mark.parametrize(
    ("setting", "said"),
    [("decimal_year=2050", "decimal_year 2050 is not in 2025..2030"), ("seed=-1", "seed -1 is not possible")],
)
def test_impossible_settings_are_refused(map_file, setting, said):
    with pytest.raises(EstimatorError, match=said):
        estimator(map_file, setting)


def test_the_map_of_another_place_is_reported(map_file):
    found = estimator(map_file)
    for k in range(1, 40):
        found.handle(k * 100_000, reading(k * 100_000, LEVEL_NT + k % 3))
        found.handle(k * 100_000, position(k * 100_000, 2.5 * k, 90_000.0))
    assert "is " + str(map_file) + " the map of this place?" in str(found.remarks()["warning"])


def test_an_empty_class_list_is_refused():
    with pytest.raises(EstimatorError, match="targets names no class"):
        make_estimator("magnetic-identification", ["targets="])


def test_positions_lost_in_a_pass_drop_readings_and_the_anomaly_stays(map_file):
    found = estimator(map_file)
    passing(found, without=(26.0, 31.0))
    assert found.unplaced >= 40
    assert found.remarks()["anomalies"] == 1.0


def test_places_off_the_map_and_in_its_holes_are_counted(map_file):
    found = estimator(map_file)
    for k in range(1, 40):
        found.handle(k * 100_000, reading(k * 100_000, LEVEL_NT + k % 3))
        found.handle(k * 100_000, position(k * 100_000, -1400.0 if k < 20 else 5000.0, 2.5 * k))
    assert found.unplaced >= 35
    assert found.remarks()["anomalies"] == 0.0


def test_a_stuck_or_saturated_magnetometer_is_reported_and_makes_no_anomaly(map_file):
    found = estimator(map_file)
    outcomes = []
    for k in range(1, 100):
        value = LEVEL_NT + 40.0 if k < 60 else 3.0e5
        outcomes.append(found.handle(k * 100_000, reading(k * 100_000, value)))
        found.handle(k * 100_000, position(k * 100_000, 0.0, 2.5 * k))
    assert outcomes.count(Outcome.IMPLAUSIBLE) == found.implausible >= 60
    assert "check the magnetometer" in str(found.remarks()["warning"])
    assert found.remarks()["anomalies"] == 0.0


def test_other_named_values_and_components_are_ignored(map_file):
    found = estimator(map_file)
    assert found.handle(1_000, reading(1_000, 1.0, name="TEMP")) is Outcome.IGNORED
    assert found.handle(1_000, reading(1_000, 1.0, component=1)) is Outcome.IGNORED
    assert found.handle(2_000, reading(2_000, math.nan)) is Outcome.NOT_FINITE


def test_along_a_border_of_stairs_readings_without_a_map_make_no_anomaly_and_the_search_goes_on(tmp_path):
    """A published map often ends in stairs of cells; a track along them has a map value here and there."""
    lines = np.linspace(-1500.0, 1500.0, 61)
    total = LEVEL_NT + 0.02 * (lines[:, None] + lines)
    total[lines[:, None] + 400.0 < lines] = np.nan
    path = tmp_path / "stairs.npz"
    MagneticMap(
        north_m=lines, east_m=lines, total_field_nt=total, height_m=HEIGHT_M, home=HOME, error_nt=1.0
    ).save(path)
    found = estimator(path)
    rng = np.random.default_rng(3)
    source = target(rng, (0.0, 0.0))
    along = np.arange(-1240.0, 960.0, 2.0)
    border = np.column_stack((along + 70.0 * np.sin(along / 120.0), along + 340.0))
    across = np.column_stack((np.full(560, -20.0), np.arange(350.0, -1050.0, -2.5)))
    used = 0
    for k, taken in enumerate(readings(rng, np.vstack((border, across)), [source])):
        if k == len(border):
            used = found.remarks()["readings_unplaced"]
            assert found.remarks()["anomalies"] == 0.0
        field_nt = LEVEL_NT + 0.02 * (taken.north_m + taken.east_m)
        found.handle(taken.time_us, reading(taken.time_us, field_nt + taken.total_nt))
        if k % 2 == 0:
            found.handle(taken.time_us, position(taken.time_us, taken.north_m, taken.east_m))
    assert 50 < used < len(border) - 50
    assert found.identifier.anomalies[-1].probability > 0.8


@pytest.mark.parametrize("source", [True, False])
def test_a_replay_with_and_without_an_anomaly_is_complete(map_file, tmp_path, source, capfd):
    rng = np.random.default_rng(1)
    magnetometer, autopilot = FrameEncoder(1, 158), FrameEncoder(1, 1)
    log_file, out = tmp_path / "flight.tlog", tmp_path / "run"
    with TlogWriter(log_file) as log:
        log.write(10**15, autopilot.encode(dialect.MAVLink_heartbeat_message(1, 12, 128, 0, 4, 3)))
        signatures = [target(rng)] if source else []
        for taken in readings(rng, track(rng, offset_m=20.0, course_rad=0.4), signatures):
            ms = taken.time_us // 1000
            value = dialect.MAVLink_named_value_float_message(ms, b"MAG_NT", LEVEL_NT + taken.total_nt)
            log.write(10**15 + taken.time_us, magnetometer.encode(value))
            lat, lon, alt = FRAME.geodetic_from_ned(taken.north_m, taken.east_m, -HEIGHT_M)
            place = dialect.MAVLink_global_position_int_message(
                ms, round(lat * 1e7), round(lon * 1e7), round(alt * 1e3), 0, 0, 0, 0, 0
            )
            log.write(10**15 + taken.time_us + 1, autopilot.encode(place))
    settings = [f"map_file={map_file}", "particles=400", "noise_nt=0.2", "report_s=1"]
    words = [word for setting in settings for word in ("--set", setting)]
    command = ["replay", log_file, "--estimator", "magnetic-identification", *words, "--out", out]
    assert run_command_line([str(word) for word in command]) == 0
    summary = json.loads((out / "summary.json").read_text())
    assert (summary["outcome"], summary["reason"]) == ("completed", "")
    subjects = [subject["subject"] for subject in summary["vehicles"][0]["subjects"]]
    assert subjects == (["anomaly 0"] if source else [])
    assert (out / "errors.png").exists() == source
    if source:
        said = capfd.readouterr().out
        assert "anomaly 0: nothing is compared: logs have no reference for the column anomaly" in said
