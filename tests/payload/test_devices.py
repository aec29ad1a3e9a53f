"""What all payload devices have in common: a component each, and devices of users' packages."""

import sys
from importlib.metadata import EntryPoint

import numpy as np
import pytest

from autopilot_bridge.mavlink import FrameParser, decode
from autopilot_bridge.payload.station import COMPONENTS, GROUP, PayloadStation
from flightsim import truth as t
from flightsim.foundation.options import declared
from flightsim.foundation.plug_ins import PlugInError
from flightsim.home import Home
from flightsim.payload import (
    CameraParameters,
    Carrier,
    DeviceOutage,
    DeviceParameters,
    GimbalParameters,
    Payload,
    PayloadParameters,
    RangeRadioParameters,
)
from flightsim.payload.payload import DEVICES_GROUP
from flightsim.world_file import WorldFileError
from flightsim.world_spec import VehicleSpec, WorldSpec
from missions.worlds.payloads import carrying

PACKAGE = """
from dataclasses import dataclass

from autopilot_bridge.dispatch import command
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.payload import Component
from flightsim.foundation.checks import Rate
from flightsim.payload import Device, DeviceParameters


@dataclass(frozen=True, slots=True, kw_only=True)
class PsychrometerParameters(DeviceParameters):
    rate_hz: Rate = 1

    def build(self, carrier):
        return Psychrometer(self, carrier)


class Psychrometer(Device[float]):
    def __init__(self, parameters, carrier):
        self._interval = carrier.physics_rate_hz // parameters.rate_hz
        self._steps = 0

    def step(self, time_us):
        self._steps += 1
        return 50.0 if self._steps % self._interval == 0 else None


class PsychrometerComponent(Component[Psychrometer]):
    component_id = dialect.MAV_COMP_ID_USER60

    def update(self, reading):
        humidity = round(100 * reading)
        self.send(dialect.MAVLink_hygrometer_sensor_message(id=0, temperature=2000, humidity=humidity))

    @command(dialect.MAV_CMD_PREFLIGHT_CALIBRATION)
    def _calibrate(self, message, sender):
        return dialect.MAV_RESULT_ACCEPTED


class Broken:
    pass
"""


@pytest.fixture
def package(tmp_path, monkeypatch):
    (tmp_path / "users_device.py").write_text(PACKAGE)
    monkeypatch.syspath_prepend(str(tmp_path))
    points = {
        DEVICES_GROUP: {"psychrometer": "PsychrometerParameters", "broken": "PsychrometerParameters"},
        GROUP: {"psychrometer": "PsychrometerComponent", "broken": "Broken"},
    }

    def named(group: str) -> dict[str, EntryPoint]:
        return {
            name: EntryPoint(name, f"users_device:{value}", group) for name, value in points[group].items()
        }

    monkeypatch.setattr("flightsim.foundation.plug_ins.plug_ins", named)
    monkeypatch.setattr("flightsim.world_file.plug_ins", named)
    yield
    sys.modules.pop("users_device", None)


def carrier() -> Carrier:
    return Carrier(
        truth=np.zeros(t.TRUTH_SIZE),
        home=Home(),
        physics_rate_hz=250,
        seeds=lambda name: np.random.SeedSequence([1, *name.encode()]),
    )


def loaded(tmp_path, text: str) -> PayloadParameters:
    file = tmp_path / "world.toml"
    file.write_text(text)
    return WorldSpec.load(file).vehicles[0].payload


def test_every_device_has_a_component_of_its_own_id():
    kinds = {each.name: each.kind for each in declared(PayloadParameters)}
    devices = [name for name, kind in kinds.items() if kind in DeviceParameters.__subclasses__()]
    assert sorted(COMPONENTS) == sorted(devices)
    assert len({component.component_id for component in COMPONENTS.values()}) == len(COMPONENTS)


@pytest.mark.usefixtures("package")
def test_a_device_of_a_package_is_in_world_files_and_on_the_wire(tmp_path):
    parameters = loaded(tmp_path, "[[vehicles]]\npayload.others.psychrometer = {rate_hz = 5}\n")
    frames, parser = [], FrameParser()
    station = PayloadStation(
        Payload(parameters, carrier()), system_id=3, send=lambda data: frames.extend(parser.feed(data))
    )
    for step in range(501):
        station.step(4000 * step)
    messages = [decode(frame) for frame in frames]
    assert sum(m.get_type() == "HYGROMETER_SENSOR" and m.humidity == 5000 for m in messages) == 10  # type: ignore[attr-defined]
    assert {frame.component_id for frame in frames} == {84}
    assert "HEARTBEAT" in {m.get_type() for m in messages}


@pytest.mark.usefixtures("package")
def test_what_is_wrong_with_a_device_of_a_package_is_said(tmp_path):
    with pytest.raises(
        WorldFileError, match=r"others.thermometer.kind is 'thermometer'; accepted: psychrometer"
    ):
        loaded(tmp_path, "[[vehicles]]\npayload.others.thermometer = {}\n")
    broken = loaded(tmp_path, "[[vehicles]]\npayload.others.broken = {}\n")
    with pytest.raises(PlugInError, match=r"'broken' of users_device:Broken .* is no class on .*Component"):
        PayloadStation(Payload(broken, carrier()), system_id=1, send=lambda data: None)
    unknown = PayloadParameters(others={"none": RangeRadioParameters()})
    with pytest.raises(PlugInError, match="'none' is not an entry point of the group"):
        PayloadStation(Payload(unknown, carrier()), system_id=1, send=lambda data: None)


def test_devices_and_outages_that_are_not_possible():
    with pytest.raises(ValueError, match="device 'gimbal' is not one of camera, magnetometer"):
        PayloadParameters(outages=(DeviceOutage(device="gimbal", start_s=1.0),))
    with pytest.raises(ValueError, match="'camera' is the name of another device"):
        PayloadParameters(others={"camera": RangeRadioParameters()})


def test_a_mission_adds_what_a_vehicle_does_not_have_and_keeps_its_outages():
    outage = DeviceOutage(device="camera", start_s=20.0)
    stated = PayloadParameters(camera=CameraParameters(rate_hz=5), outages=(outage,))
    world = WorldSpec(vehicles=(VehicleSpec(payload=stated),))
    added = PayloadParameters(camera=CameraParameters(), gimbal=GimbalParameters())
    (vehicle,) = carrying(world, added).vehicles
    assert vehicle.payload == PayloadParameters(
        gimbal=GimbalParameters(), camera=CameraParameters(rate_hz=5), outages=(outage,)
    )
