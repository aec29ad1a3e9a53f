"""`FilterAttitude`: roll and pitch of our filter, yaw of the autopilot."""

import json
import math

import pytest

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, dialect
from estimators.messages import read_message
from estimators.orbit_target.attitude import FilterAttitude
from estimators.orbit_target.parameters import AttitudeFrom, OrbitTargetParameters
from estimators.vehicle_time import VehicleTime
from flightsim.environment import Environment
from flightsim.foundation.vectors import yaw_of
from flightsim.world_spec import WorldSpec
from missions.library import find_mission
from missions.orbit.options import OrbitOptions
from missions.orbit.world import orbit_world
from missions.runs.session import RunRequest, fly

ROLL, PITCH, YAW = 0.3, -0.1, 2.0
G = 9.80665


class Sender:
    """Frames of an autopilot, or of another component."""

    def __init__(self, system=1, component=1):
        self._encoder = FrameEncoder(system, component)
        self._parser = FrameParser()
        self._time = VehicleTime()

    def frame(self, message):
        """(time, message), as an estimator receives them."""
        (frame,) = self._parser.feed(self._encoder.encode(message))
        read = read_message(frame)
        return self._time.stamp(read), read

    def imu(self, time_us, roll=ROLL, pitch=PITCH, roll_rate=0.0):
        force = (
            G * math.sin(pitch),
            -G * math.cos(pitch) * math.sin(roll),
            -G * math.cos(pitch) * math.cos(roll),
        )
        return self.frame(
            dialect.MAVLink_highres_imu_message(
                time_us, *force, roll_rate, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 63
            )
        )

    def attitude(self, time_us, yaw=YAW):
        return self.frame(dialect.MAVLink_attitude_message(time_us // 1000, 0.9, 0.9, yaw, 0.0, 0.0, 0.0))


def euler(q):
    w, x, y, z = q
    return (
        math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        math.asin(2.0 * (w * y - z * x)),
        yaw_of(q),
    )


@pytest.fixture
def fed():
    source, sender = FilterAttitude(), Sender()
    for k in range(51):
        source.take(*sender.imu(1_000_000 + k * 20_000))
        if k % 5 == 0:
            source.take(*sender.attitude(1_000_000 + k * 20_000))
    return source


def test_roll_and_pitch_are_the_filters_and_yaw_the_autopilots(fed):
    assert euler(fed.at(1_970_000)) == pytest.approx((ROLL, PITCH, YAW), abs=1e-4)
    assert fed.newest.time_us == 2_000_000


def test_an_old_roll_is_none(fed):
    assert fed.roll_rad(2_400_000) == pytest.approx(ROLL, abs=1e-4)
    assert fed.roll_rad(2_600_000) is None
    assert FilterAttitude().roll_rad(0) is None


def test_between_samples():
    """A turn of 20 degrees a second, requested half way between two samples."""
    source, sender = FilterAttitude(), Sender()
    rate = math.radians(20.0)
    for k in range(21):
        t = 0.05 * k
        source.take(*sender.imu(1_000_000 + k * 50_000, roll=rate * t, pitch=0.0, roll_rate=rate))
        source.take(*sender.attitude(1_000_000 + k * 50_000))
    assert euler(source.at(1_525_000))[0] == pytest.approx(rate * 0.525, abs=2e-4)


@pytest.mark.parametrize("time_us", [999_000, 2_600_000])
def test_nothing_is_known_before_and_long_after(fed, time_us):
    assert fed.at(time_us) is None


def test_no_yaw_no_attitude():
    source, sender = FilterAttitude(), Sender()
    for k in range(10):
        source.take(*sender.imu(1_000_000 + k * 20_000))
    assert source.at(1_100_000) is None
    assert source.newest is not None


@pytest.mark.parametrize("component", [25, 191])
def test_other_components_are_left_out(component):
    source, sender = FilterAttitude(), Sender(1, component)
    source.take(*sender.imu(1_000_000))
    source.take(*sender.attitude(1_000_000))
    assert source.newest is None
    assert source.at(1_000_000) is None


def test_names_are_what_must_be_listened_to():
    assert {
        "HIGHRES_IMU",
        "RAW_IMU",
        "HEARTBEAT",
        "VFR_HUD",
        "SCALED_PRESSURE",
        "ATTITUDE",
    } <= FilterAttitude().names


@pytest.mark.slow
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_an_orbit_flown_with_it(tmp_path, autopilot):
    """The circle is held as with the autopilot's attitude."""
    options = OrbitOptions(duration_s=120.0, estimator=OrbitTargetParameters(attitude=AttitudeFrom.FILTER))
    world = WorldSpec.of_team(
        model="aerosonde",
        autopilot=autopilot,
        seed=1,
        air=Environment.from_wind(speed_m_s=4.0, from_deg=40.0, turbulence="light"),
    )
    result = fly(
        find_mission("orbit"),
        RunRequest(options=options, world=orbit_world(world, options), out=tmp_path / "run", picture=False),
    )
    assert result.outcome == "completed", result.reason
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert summary["radius_mean_error_percent"] == pytest.approx(0.0, abs=2.0)
    assert summary["radius_std_m"] < 6.0
