"""Whole searches in embedded worlds: from the ground, until the target is found, back to the ground."""

import asyncio
import errno
import json
import math
from contextlib import asynccontextmanager
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from autopilot_bridge.mavlink import decode, definition
from autopilot_bridge.mavlink.components import SURVEY_MAGNETOMETER_COMPONENT
from autopilot_bridge.tlog import TlogReader
from flightsim.environment import Environment
from flightsim.foundation.geodesy import LocalFrame
from flightsim.home import Home
from flightsim.payload import DipoleSignature, MagneticMap, magnetic_field_of
from flightsim.world_spec import WorldSpec
from missions.base.request import RunRequest
from missions.cli import main as cli
from missions.errors import PlanError
from missions.flown.records import FlightRecords
from missions.occupancy.magnetic_target import MagneticTarget
from missions.occupancy.mission import OccupancyMission
from missions.occupancy.noise_check import require_quiet
from missions.occupancy.options import OccupancyOptions
from missions.occupancy.parameters import Identify, SearchParameters
from missions.occupancy.world import occupancy_world
from missions.runs.session import fly
from missions.runs.vehicle_opening import MAP_NAME
from tests.missions.held_options import with_fields

SMALL = OccupancyOptions(
    vehicles=2,
    altitude_m=15.0,
    separation_m=6.0,
    width_m=400.0,
    height_m=400.0,
    cell_m=100.0,
    search=SearchParameters(detection_range_m=60.0, confirmations=1),
)
TARGET_NE_M = (110.0, 30.0)


def world_of(options=SMALL, *, target_ne_m=TARGET_NE_M, moment_a_m2=None, **values) -> WorldSpec:
    world = WorldSpec.of_team(options.vehicles, **{"seed": 1, **values})
    return occupancy_world(world, options, MagneticTarget(place_ne_m=target_ne_m, moment_a_m2=moment_a_m2))


def request(out, options=SMALL, *, picture=True, **values) -> RunRequest:
    return RunRequest(options=options, world=world_of(options, **values), out=out, picture=picture)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """A team of two quadrotors that finds its target."""
    return fly(OccupancyMission(), request(tmp_path_factory.mktemp("runs") / "found"))


def test_the_target_is_found_and_all_are_down_again(found):
    summary = found.summary
    assert (found.outcome, found.reason) == ("completed", "")
    assert summary["target_found"] is True
    assert 0.0 < summary["time_to_find_s"] < 300.0
    assert summary["target_error_m"] < 80.0
    assert summary["target_m"] == {"north": 110.0, "east": 30.0}
    assert 0.0 < summary["probability_of_detection"] < 1.0
    assert summary["least_separation_m"] > 5.0
    assert [block["phases"][-1]["name"] for block in summary["vehicles"]] == ["return", "return"]
    for searcher in summary["searchers"]:
        assert searcher["readings"] > 100
        assert searcher["readings_dropped"] <= 2
        assert searcher["heading_commands"] >= 1
    assert sum(len(searcher["anomalies"]) for searcher in summary["searchers"]) >= 1


def test_the_folder_holds_map_summary_log_and_picture(found):
    names = {path.name for path in found.folder.iterdir()}
    assert names == {MAP_NAME, "summary.json", "flight.scene", "flight.tlog", "track.png"}
    assert json.loads((found.folder / "summary.json").read_text())["target_found"] is True
    assert (found.folder / "track.png").stat().st_size > 20_000


@pytest.mark.slow
def test_a_search_with_a_map_that_is_given_has_a_survey_error_of_its_own_and_repeats_itself(found, tmp_path):
    options = replace(SMALL, map_file=str(found.folder / MAP_NAME))
    first, again = (
        fly(OccupancyMission(), request(tmp_path / name, options, picture=False)) for name in ("a", "b")
    )
    assert (again.folder / "flight.tlog").read_bytes() == (first.folder / "flight.tlog").read_bytes()
    assert (first.folder / "flight.tlog").read_bytes() != (found.folder / "flight.tlog").read_bytes()
    assert first.summary["target_found"] is True
    assert not (again.folder / MAP_NAME).exists()


@pytest.mark.slow
def test_a_search_that_identifies_names_the_target_and_its_log_gives_the_same_estimates(tmp_path):
    """Quadrotors; the estimator runs beside the flight, and over its log."""
    options = with_fields(SMALL, identify=Identify.BAYES, particles=1000)
    first, again = (
        fly(
            OccupancyMission(),
            replace(
                request(tmp_path / name, options, picture=False),
                estimator="magnetic-identification",
                estimator_settings=("particles=1000",),
            ),
        )
        for name in ("a", "b")
    )
    assert (again.folder / "flight.tlog").read_bytes() == (first.folder / "flight.tlog").read_bytes()
    assert first.summary["target_found"] is True
    assert first.summary["target_error_m"] < 40.0
    verdicts = [candidate["verdict"] for candidate in first.summary["candidates"]]
    assert verdicts.count("target") == 1
    arguments = [str(first.folder / "flight.tlog"), "--estimator", "magnetic-identification", "--no-picture"]
    settings = [f"map_file={first.folder / MAP_NAME}", "particles=1000"]
    given = [word for setting in settings for word in ("--set", setting)]
    assert cli.run_command_line(["replay", *arguments, *given, "--out", str(tmp_path / "again")]) == 0
    flown, replayed = (np.load(folder / "estimates.npz") for folder in (first.folder, tmp_path / "again"))
    for name in flown.files:
        assert np.array_equal(flown[name], replayed[name], equal_nan=flown[name].dtype.kind == "f")


def true_field(found, *, target=True, moment_a_m2=None):
    """The field of the flown world, made again, with its target or without."""
    spec = world_of(moment_a_m2=moment_a_m2).magnetic_field
    if not target:
        spec = replace(spec, signatures=())  # type: ignore[type-var]
    home = MagneticMap.load(found.folder / MAP_NAME).home
    return magnetic_field_of(spec, home=home, seed=1, decimal_year=2026.0)[0]


def flown_readings(folder, home, system_id):
    """Readings that a vehicle sent at search height, and where it truly was: (north m, east m, height m, nT)
    of each.
    """
    truth = FlightRecords.from_tlog(folder / "flight.tlog").table("HIL_STATE_QUATERNION", system_id)
    sent = [
        decode(frame)
        for _, frame in TlogReader(folder / "flight.tlog")
        if (frame.message_id, frame.system_id) == (definition("NAMED_VALUE_FLOAT").message_id, system_id)
        and frame.component_id == SURVEY_MAGNETOMETER_COMPONENT
    ]
    per_lat, per_lon = LocalFrame(home).metres_per_degree
    places = np.column_stack(
        (
            (truth["lat"] * 1e-7 - home.lat_deg) * per_lat,
            (truth["lon"] * 1e-7 - home.lon_deg) * per_lon,
            truth["alt"] * 1e-3 - home.alt_m,
        )
    )
    time_us = [m.time_boot_ms * 1e3 for m in sent]  # type: ignore[attr-defined]
    at = np.column_stack([np.interp(time_us, truth["time_usec"], axis) for axis in places.T])
    return np.column_stack((at, [m.value for m in sent]))[at[:, 2] > 12.0]  # type: ignore[attr-defined]


@pytest.mark.slow
def test_the_field_is_not_the_published_map(found):
    """Where the vehicles flew, their magnetometers read the true field, which differs from the map by the
    error that the map states, and by the target.
    """
    published = MagneticMap.load(found.folder / MAP_NAME)
    assert published.error_nt == pytest.approx(found.summary["map_error_nt"], abs=1e-3)
    field, background = true_field(found), true_field(found, target=False)
    map_errors_nt, away_nt = [], []
    for system_id in (1, 2):
        readings = flown_readings(found.folder, published.home, system_id)
        assert len(readings) > 500
        sensor_nt = readings[:, 3] - [field.total_nt(*place) for place in readings[:, :3]]
        assert abs(sensor_nt.mean()) < 1.5  # heading error and drift of the magnetometer
        assert sensor_nt.std() < 0.5
        on_map_nt = published.interpolate(*readings[:, :3].T)
        assert np.all(np.isfinite(on_map_nt))
        map_errors_nt.append([background.total_nt(*place) for place in readings[:, :3]] - on_map_nt)
        away = np.hypot(readings[:, 0] - 110.0, readings[:, 1] - 30.0) > 250.0
        away_nt.append((readings[:, 3] - on_map_nt)[away])
    error_nt = np.sqrt(np.mean(np.concatenate(map_errors_nt) ** 2))
    assert 0.3 * published.error_nt < error_nt < 3.0 * published.error_nt  # type: ignore[operator]
    differential_nt = np.concatenate(away_nt)
    assert len(differential_nt) > 100
    assert differential_nt.std() > 1.0  # the magnetometer's own noise is 0.2 nT
    seen = true_field(found, moment_a_m2=2e4)
    assert isinstance(seen.signatures[0], DipoleSignature)
    assert np.linalg.norm(seen.signatures[0].moment_ned_a_m2) == pytest.approx(2e4)


def test_a_map_without_data_in_the_area_is_refused_before_anything_starts(found, tmp_path):
    with np.load(found.folder / MAP_NAME) as archive:
        content = dict(archive)
    content["total_field_nt"][content["total_field_nt"].shape[0] // 2] = math.nan
    np.savez(tmp_path / "hole.npz", **content)
    options = replace(SMALL, map_file=str(tmp_path / "hole.npz"))
    with pytest.raises(PlanError, match="the magnetic map has no data in part of it"):
        fly(OccupancyMission(), request(tmp_path / "run", options))
    assert not (tmp_path / "run").exists()
    with pytest.raises(PlanError, match="does not cover it"):
        fly(
            OccupancyMission(),
            request(
                tmp_path / "run", replace(options, width_m=4000.0, map_file=str(found.folder / MAP_NAME))
            ),
        )


def test_without_a_magnetometer_no_vehicle_takes_off(found, tmp_path):
    options = replace(SMALL, map_file=str(found.folder / MAP_NAME))
    bare = replace(request(tmp_path / "run", options), world=WorldSpec.of_team(options.vehicles))
    result = fly(OccupancyMission(), bare)
    assert result.outcome == "failed"
    assert "no survey magnetometer" in result.reason
    for block in result.summary["vehicles"]:
        assert not block["phases"]
    assert result.summary["target_found"] is False


def test_a_map_of_another_place_keeps_everybody_on_the_ground(found, tmp_path):
    options = replace(SMALL, map_file=str(found.folder / MAP_NAME))
    elsewhere = request(tmp_path / "run", options, home=Home.parse("47.6,8.6,500"))
    with pytest.raises(PlanError, match="the map of this place"):
        fly(OccupancyMission(), elsewhere)
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_a_search_that_finds_nothing_ends_in_time(found, tmp_path):
    options = with_fields(SMALL, vehicles=1, confirmations=50, search_time_s=60.0)
    result = fly(OccupancyMission(), request(tmp_path / "run", options))
    assert result.outcome == "completed"
    assert result.summary["target_found"] is False
    assert result.summary["time_to_find_s"] is None
    assert result.summary["searchers"][0]["search_s"] == pytest.approx(60.0, abs=1.0)
    assert (result.folder / "track.png").exists()


class Magnetometer:
    """A vehicle that is nothing but a magnetometer."""

    system_id = 1

    def __init__(self, readings_nt):
        self.payload = SimpleNamespace(on_total_field=self.listen)
        self.link = SimpleNamespace(deadline=self.deadline)
        self.readings_nt = readings_nt

    def listen(self, listener):
        for k, value in enumerate(self.readings_nt):
            listener(100_000 * k, value)
        return lambda: None

    @asynccontextmanager
    async def deadline(self, seconds, awaited):
        yield


def test_a_threshold_within_the_noise_is_refused_on_the_ground():
    readings = 48_000.0 + np.random.default_rng(1).normal(0.0, 2.0, 20)
    with pytest.raises(PlanError, match=r"`threshold_nt` 3 nT is below 3 times the noise of vehicle 1"):
        asyncio.run(require_quiet(Magnetometer(readings), threshold_nt=3.0))
    quiet = Magnetometer(0.1 * readings)
    assert asyncio.run(require_quiet(quiet, threshold_nt=3.0)) < 0.5


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--connect", "udpin:127.0.0.1:24999"], "give it with --map FILE"),
        (["--target", "500"], "give NORTH,EAST"),
        (["--target", "9000,0"], "outside the searched map"),
        (["--cell", "50"], "too small for an aircraft"),
        (["--threshold", "0.5"], "below 3 standard deviations of the noise"),
        (["--size", "45000"], "smaller --size"),
    ],
)
def test_the_command_line_refuses_with_usage_errors(arguments, words, tmp_path, capsys):
    out = tmp_path / "run"
    assert cli.run_command_line(["fly", "occupancy", "--out", str(out), *arguments]) == 2
    assert words in " ".join(capsys.readouterr().err.split())
    assert not out.exists()


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_three_aircraft_search_in_wind(autopilot, tmp_path):
    options = OccupancyOptions(vehicles=3, width_m=1600.0, height_m=1600.0)
    result = fly(
        OccupancyMission(),
        request(
            tmp_path / "run",
            options,
            model="aerosonde",
            autopilot=autopilot,
            target_ne_m=(-300.0, 350.0),
            air=Environment.from_wind(speed_m_s=5.0, from_deg=270.0, turbulence="light"),
        ),
    )
    assert (result.outcome, result.reason) == ("completed", "")
    summary = result.summary
    assert summary["target_found"] is True
    assert summary["time_to_find_s"] < 900.0
    assert summary["target_error_m"] < 200.0
    assert summary["heading_settled_error_95_deg"] < 5.0
    assert summary["least_separation_m"] > 10.0


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_quadrotor_and_two_aircraft_search_together(tmp_path):
    options = OccupancyOptions(vehicles=3, width_m=1600.0, height_m=1600.0)
    models = ("aerosonde", "aerosonde", "iris")
    air = Environment.from_wind(speed_m_s=4.0, from_deg=0.0)
    requested = request(tmp_path / "run", options, model=models, target_ne_m=(-500.0, 400.0), air=air)
    result = fly(OccupancyMission(), requested)
    assert (result.outcome, result.reason) == ("completed", "")
    summary = result.summary
    assert [searcher["kind"] for searcher in summary["searchers"]] == ["fixed_wing"] * 2 + ["multicopter"]
    assert summary["target_found"] is True
    assert summary["heading_settled_error_95_deg"] < 5.0
    assert summary["least_separation_m"] > 8.0


def test_a_map_that_finds_no_room_is_one_line_and_nothing_stays(tmp_path, monkeypatch, capsys):
    def full(_map, path):
        path.write_bytes(b"PK half of a map")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(MagneticMap, "save", full)
    code = cli.run_command_line(["fly", "occupancy", "--out", str(tmp_path / "run")])
    said = capsys.readouterr()
    assert (code, said.out) == (1, "")
    assert said.err.count("\n") == 1
    assert "magnetic_map.npz: No space left on device" in said.err
    assert list(tmp_path.iterdir()) == []
