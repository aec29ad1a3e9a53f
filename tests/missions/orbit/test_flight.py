"""Whole orbits in embedded worlds, as `flightstack fly orbit` flies them, but shorter."""

import json
import math
import struct
from dataclasses import replace

import pytest

from autopilot_bridge.mavlink import decode
from autopilot_bridge.tlog import TlogReader
from flightsim.environment import Environment
from flightsim.world_spec import WorldSpec
from missions.flown.records import FlightRecords
from missions.flown.run_folder import EPOCH_UNIX_US
from missions.gps_off import GpsOff
from missions.library import find_mission
from missions.orbit.options import OrbitOptions
from missions.orbit.world import orbit_world
from missions.runs.session import RunRequest, fly
from tests.missions.held_options import with_fields
from tests.slow import slow

KEYS = {"radius_mean_error_percent", "radius_std_m", "altitude_error_m", "gps_lost_at_s"}


def orbit(tmp_path, autopilot="px4", picture=False, name="run", seed=1, target=True, **changes):
    options = with_fields(OrbitOptions(), **({"duration_s": 60.0} | changes))
    world = WorldSpec.of_team(
        model="aerosonde",
        autopilot=autopilot,
        seed=seed,
        air=Environment.from_wind(speed_m_s=4.0, from_deg=40.0, turbulence="light"),
    )
    world = orbit_world(world, options)
    return fly(
        find_mission("orbit"),
        RunRequest(
            options=options,
            world=world if target else replace(world, targets=()),
            out=tmp_path / name,
            picture=picture,
        ),
    )


def gps_times(folder, *spans):
    """Times of the receiver's data that the autopilot has reported, in each span (begin s, end s)."""
    found = [set() for _ in spans]
    for stamp_us, frame in TlogReader(folder / "flight.tlog"):
        if frame.message_id == 24 and frame.component_id == 1:
            time_s = (stamp_us - EPOCH_UNIX_US) * 1e-6
            for times, (begin_s, end_s) in zip(found, spans, strict=True):
                if begin_s < time_s < end_s:
                    times.add(decode(frame).time_usec)  # type: ignore[attr-defined]
    return found


@pytest.mark.parametrize(
    ("autopilot", "options"),
    [
        slow("px4", {}),
        (
            "ardupilot",
            {
                "direction": -1,
                "target_speed_m_s": 2.0,
                "target_heading_rad": 2.0,
                "entry_bearing_rad": math.radians(315.0),
                "entry_heading_rad": math.radians(300.0),
                "gps_off": GpsOff.PARAMETER,
            },
        ),
    ],
    ids=["px4, clockwise, still", "ardupilot, counter-clockwise, moving"],
)
def test_the_circle_is_held_without_gps(tmp_path, autopilot, options):
    result = orbit(tmp_path, autopilot, picture=True, **options)
    assert result.outcome == "completed", result.reason
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert set(summary) >= KEYS
    assert abs(summary["radius_mean_error_percent"]) < 2.5
    assert summary["radius_std_m"] < 5.0
    assert summary["altitude_error_m"] < 8.0
    assert summary["orbit_s"] == pytest.approx(60.0, abs=1.0)
    assert summary["target_losses"] == 0
    phases = [phase["name"] for phase in summary["vehicles"][0]["phases"]]
    assert phases[-5:] == ["transit", "entry", "orbit", "gps back", "landing"]
    lost, back = summary["gps_lost_at_s"], summary["gps_back_at_s"]
    without, before = gps_times(tmp_path / "run", (lost + 2.0, back), (lost - 10.0, lost))
    assert len(without) <= 1  # nothing new from the receiver
    assert len(before) > 10
    records = FlightRecords.from_tlog(tmp_path / "run" / "flight.tlog")
    assert len(records.table("HIL_STATE_QUATERNION", 1)) > 1000
    assert (
        len(records.table("HIL_STATE_QUATERNION", 1, 1)) == 0
    )  # truth is the log's, not the autopilot's word
    data = (tmp_path / "run" / "track.png").read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    width, _ = struct.unpack(">II", data[16:24])
    assert width > 1000
    counts = summary["message_counts"]
    assert counts["LANDING_TARGET"] > 500
    if autopilot == "px4":  # roll, pitch and thrust; ArduPilot's keeps the last two
        assert counts["SET_ATTITUDE_TARGET"] > 1000
    assert summary["autopilot"] == autopilot


@pytest.mark.slow
def test_the_same_seed_flies_the_same_orbit(tmp_path):
    for name in ("a", "b"):
        orbit(tmp_path, name=name, duration_s=5.0)
    logs = [(tmp_path / name / "flight.tlog").read_bytes() for name in ("a", "b")]
    assert logs[0] == logs[1]


@pytest.mark.slow
def test_a_target_that_is_not_there_ends_the_mission_and_brings_the_aircraft_home(tmp_path):
    result = orbit(tmp_path, target=False, duration_s=60.0, lost_limit_s=8.0)
    assert result.outcome == "failed"
    assert "the target was never seen" in result.reason
    assert result.summary["gps_back_at_s"] is not None


@pytest.mark.slow
def test_without_the_fault_the_orbit_is_the_same_and_gps_stays(tmp_path):
    result = orbit(tmp_path, gps_fault=False, duration_s=30.0)
    assert result.outcome == "completed", result.reason
    assert result.summary["gps_lost_at_s"] is None
    assert abs(result.summary["radius_mean_error_percent"]) < 2.5
