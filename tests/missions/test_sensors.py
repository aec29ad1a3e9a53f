"""Sensors that a mission lives on: proven before the takeoff, watched in flight, for every mission."""

from dataclasses import replace

import pytest

from autopilot_bridge.mavlink import Frame, FrameEncoder, dialect
from autopilot_bridge.mavlink.target_scan import scan_messages
from flightsim.payload import CameraParameters, DeviceOutage, PayloadParameters
from flightsim.world_spec import VehicleSpec, WorldSpec
from missions.base.options import FlightOptions
from missions.base.request import RunRequest
from missions.cli.main import run_command_line
from missions.errors import MissionError, VehicleTimeout
from missions.handoff.options import HandoffOptions
from missions.kind import VehicleKind
from missions.library import MISSIONS
from missions.multi_target.options import MultiTargetOptions
from missions.occupancy.options import OccupancyOptions
from missions.orbit.options import OrbitOptions
from missions.pattern_search.mission import PatternMission
from missions.pattern_search.world import tag_search_world
from missions.runs.session import fly
from missions.survey.options import SurveyOptions
from missions.vehicle.sensors import CAMERA, GIMBAL, SURVEY_MAGNETOMETER, TAG_CAMERA, TARGET_SENSOR
from missions.vision_search.options import VisionSearchOptions

OPTIONS = {
    "orbit": OrbitOptions(),
    "occupancy": OccupancyOptions(),
    "multi-target": MultiTargetOptions(),
    "survey": SurveyOptions(),
    "vision-search": VisionSearchOptions(),
    "handoff": HandoffOptions(vehicles=2),
    **{name: FlightOptions(search=True) for name, m in MISSIONS.items() if isinstance(m, PatternMission)},
}


def test_every_mission_that_listens_to_a_payload_names_its_sensors():
    assert set(OPTIONS) == set(MISSIONS)
    assert all(MISSIONS[name].sensors(options) for name, options in OPTIONS.items())
    assert not MISSIONS["sector"].sensors(FlightOptions())


@pytest.mark.parametrize("name", sorted(OPTIONS))
@pytest.mark.sampled(3)
def test_a_vehicle_without_its_sensors_is_refused_on_the_ground(name, tmp_path):
    mission, options = MISSIONS[name], OPTIONS[name]
    model = "iris" if mission.kinds[0] is VehicleKind.MULTICOPTER else "aerosonde"
    world = WorldSpec.of_team(options.vehicles, model=model)
    request = RunRequest(options=options, world=world, out=tmp_path / "run", picture=False)
    result = fly(mission, request)
    assert result.outcome == "failed"
    for sensor in mission.sensors(options):
        assert f"no {sensor}" in result.reason
    phases = [phase["name"] for block in result.summary["vehicles"] for phase in block["phases"]]
    assert "takeoff" not in phases
    assert result.summary["sim_time_s"] < 15.0


def test_a_search_without_a_camera_is_refused_over_a_link(elsewhere, tmp_path, capsys):
    words = ["fly", "parallel-sweep", "--search", "--connect", "udpin:127.0.0.1:14550"]
    assert run_command_line([*words, "--out", str(tmp_path / "run")]) == 1
    assert "vehicle 1 has no camera (100)" in capsys.readouterr().err
    assert not elsewhere.armed and not elsewhere.items


def test_a_camera_that_stops_in_flight_ends_the_search(tmp_path):
    options = FlightOptions(width_m=40.0, height_m=40.0, spacing_m=10.0, search=True)
    world = tag_search_world(WorldSpec(seed=1), options)
    (vehicle,) = world.vehicles
    outage = DeviceOutage(device="camera", start_s=20.0)
    world = replace(world, vehicles=(replace(vehicle, payload=replace(vehicle.payload, outages=(outage,))),))
    result = fly(
        "parallel-sweep", RunRequest(options=options, world=world, out=tmp_path / "run", picture=False)
    )
    assert result.outcome == "failed"
    assert "the camera (100) of vehicle 1 has stopped: no usable searched pictures" in result.reason
    assert result.summary["sim_time_s"] < 40.0


def test_a_search_whose_pictures_are_not_searched_is_refused(tmp_path):
    """The camera has no detector for tags: its heartbeat says nothing about that."""
    payload = PayloadParameters(camera=CameraParameters())
    world = WorldSpec(vehicles=(VehicleSpec(payload=payload),))
    options = FlightOptions(search=True)
    result = fly(
        "parallel-sweep", RunRequest(options=options, world=world, out=tmp_path / "run", picture=False)
    )
    assert result.outcome == "failed"
    assert "the camera (100) of vehicle 1 is received, but sends no usable searched pictures" in result.reason


# the mechanism, with a scripted payload


class Magnetometer:
    """Sends readings of a field as a component of vehicle 1."""

    def __init__(self, vehicle, autopilot):
        self.value, self.stamp_us, self.rate_hz, self.on = 50_000.0, None, 10.0, True
        self._vehicle, self._autopilot = vehicle, autopilot
        self._encoder = FrameEncoder(1, SURVEY_MAGNETOMETER.component)

    async def run(self):
        clock = self._vehicle.clock
        while True:
            if self.on:
                stamp_us = clock.time_us if self.stamp_us is None else self.stamp_us
                reading = dialect.MAVLink_named_value_float_message(stamp_us // 1000, b"MAG_NT", self.value)
                self._autopilot.link.send(self._encoder.encode(reading))
            await clock.sleep(1.0 / self.rate_hz)


@pytest.fixture
def measured(flown):
    """Runs a script with a vehicle and its magnetometer."""

    def run(script, **changes):
        async def main(vehicle, autopilot):
            import asyncio

            magnetometer = Magnetometer(vehicle, autopilot)
            for name, value in changes.items():
                setattr(magnetometer, name, value)
            vehicle.sensors.watch(SURVEY_MAGNETOMETER)
            sending = asyncio.ensure_future(magnetometer.run())
            try:
                return await script(vehicle, autopilot, magnetometer)
            finally:
                sending.cancel()

        return flown(main)

    return run


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"on": False}, r"vehicle 1 has no survey magnetometer \(158\)"),
        ({"value": 0.0}, "its values are not plausible"),
        ({"value": float("nan")}, "its values are not plausible"),
        ({"value": 3e5}, "its values are not plausible"),
        ({"stamp_us": 4_000_000}, "its time stands still at 4.000 s"),
        ({"rate_hz": 0.4}, "at least 1 a second are needed"),
    ],
)
def test_a_sensor_that_does_not_work_is_not_proven(measured, changes, reason):
    async def script(vehicle, _autopilot, _magnetometer):
        with pytest.raises(VehicleTimeout, match=reason):
            await vehicle.sensors.prove()
        assert vehicle.clock.time_us < 20_000_000

    measured(script, **changes)


@pytest.mark.parametrize("changes", [{"on": False}, {"value": 0.0}, {"stamp_us": 1_000}])
def test_a_sensor_that_stops_ends_the_flight(measured, changes):
    async def script(vehicle, _autopilot, magnetometer):
        await vehicle.sensors.prove()
        began_us = vehicle.clock.time_us
        with pytest.raises(MissionError, match=r"the survey magnetometer \(158\) of vehicle 1 has stopped"):
            async with vehicle.sensors.guard():
                await vehicle.clock.sleep(2.0)
                for name, value in changes.items():
                    setattr(magnetometer, name, value)
                await vehicle.clock.sleep(600.0)
        assert 6.0 < (vehicle.clock.time_us - began_us) * 1e-6 < 10.0

    measured(script)


def test_a_sensor_that_pauses_shortly_or_is_no_longer_needed_ends_nothing(measured):
    async def script(vehicle, _autopilot, magnetometer):
        await vehicle.sensors.prove()
        async with vehicle.sensors.guard():
            magnetometer.on = False
            await vehicle.clock.sleep(4.0)
            magnetometer.on = True
            await vehicle.clock.sleep(4.0)
            vehicle.sensors.release()
            magnetometer.on = False
            await vehicle.clock.sleep(60.0)
        assert vehicle.sensors.stopped == ""

    measured(script)


def test_an_interrupted_link_is_no_stopped_sensor(measured):
    async def script(vehicle, autopilot, magnetometer):
        await vehicle.sensors.prove()
        async with vehicle.sensors.guard():
            streams, autopilot.streams, magnetometer.on = autopilot.streams, {}, False
            await vehicle.clock.sleep(9.0)
            autopilot.streams = streams
            await vehicle.clock.sleep(3.0)
            magnetometer.on = True
            await vehicle.clock.sleep(10.0)
        assert vehicle.sensors.stopped == ""

    measured(script)


def test_what_the_signs_of_life_are():
    def read(sensor, message):
        return sensor.source.read(Frame.of(FrameEncoder(1, sensor.component).encode(message)))

    (end,) = scan_messages(3, 5_000_000, [])
    assert read(TARGET_SENSOR, end).stamp_us == 5_000_000
    assert read(TAG_CAMERA, end) is None  # a scan of another sensor
    attitude = dialect.MAVLink_gimbal_device_attitude_status_message(
        0, 0, 1234, 32, [1.0, 0, 0, 0], 0, 0, 0, 0
    )
    assert read(GIMBAL, attitude).stamp_us == 1_234_000
    attitude.q = [float("nan")] * 4
    assert not read(GIMBAL, attitude).plausible
    assert read(CAMERA, dialect.MAVLink_heartbeat_message(0, 0, 0, 0, 0, 3)).plausible
