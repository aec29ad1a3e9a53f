"""Payload on a vehicle of the SITL: routed beside the autopilot, recorded in the log, at no peer's cost."""

import numpy as np
import pytest

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode, dialect
from autopilot_bridge.payload import CAMERA_COMPONENT, GIMBAL_COMPONENT, SURVEY_MAGNETOMETER_COMPONENT
from autopilot_bridge.sitl import Sitl
from autopilot_bridge.sitl.truth import TARGET_SYSTEM
from flightsim.payload import (
    CameraParameters,
    ConstantVelocity,
    GimbalParameters,
    GroundTargetParameters,
    MagneticField,
    MagneticMap,
    PayloadParameters,
    SurveyMagnetometerParameters,
)
from flightsim.world_spec import HOMES, VehicleSpec, WorldSpec

CAMERA = PayloadParameters(gimbal=GimbalParameters(), camera=CameraParameters())
TARGET = GroundTargetParameters(
    motion=ConstantVelocity(north_m=40.0, east_m=0.0, speed_m_s=2.0, course_rad=0.0)
)


def frames_after(sitl: Sitl, seconds: float, *links):
    parsers, found = [FrameParser() for _ in links], [[] for _ in links]
    for _ in range(round(seconds * 1e6) // sitl.step_us):
        sitl.advance()
        for link, parser, frames in zip(links, parsers, found, strict=True):
            for _, data in link.receive():
                frames += parser.feed(data)
    return found


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_components_are_received_and_can_be_spoken_to_over_the_vehicles_link(flavour):
    sitl = Sitl(
        WorldSpec(vehicles=(VehicleSpec(system_id=4, autopilot=flavour, payload=CAMERA),), targets=(TARGET,))
    )
    client, other = sitl.connect(0), sitl.connect(0, role="gcs")
    received, also = frames_after(sitl, 3.0, client, other)
    for frames in (received, also):
        assert {f.component_id for f in frames if f.system_id == 4} == {1, CAMERA_COMPONENT, GIMBAL_COMPONENT}
    command = dialect.MAVLink_command_long_message(
        4,
        GIMBAL_COMPONENT,
        dialect.MAV_CMD_REQUEST_MESSAGE,
        0,
        dialect.MAVLINK_MSG_ID_GIMBAL_MANAGER_INFORMATION,
        *(0.0,) * 6,
    )
    client.send(FrameEncoder(255, 190).encode(command))
    (received,) = frames_after(sitl, 0.2, client)
    answers = [f.message_id for f in received if f.component_id == GIMBAL_COMPONENT]
    assert dialect.MAVLINK_MSG_ID_GIMBAL_MANAGER_INFORMATION in answers
    assert dialect.MAVLINK_MSG_ID_COMMAND_ACK in answers
    acks = [
        decode(f)
        for f in received
        if f.message_id == dialect.MAVLINK_MSG_ID_COMMAND_ACK and f.component_id == 1
    ]
    assert acks == []  # not the autopilot's business


def test_targets_are_in_the_truth_and_nowhere_else():
    sitl = Sitl(WorldSpec(vehicles=(VehicleSpec(payload=CAMERA),), targets=(TARGET,)))
    client = sitl.connect(0)
    truth = []
    sitl.on_truth(lambda time_us, frame: truth.append((time_us, frame)))
    (received,) = frames_after(sitl, 2.0, client)
    assert not [f for f in received if f.system_id == TARGET_SYSTEM]
    parser = FrameParser()
    frames = [f for _, raw in truth for f in parser.feed(raw) if f.system_id == TARGET_SYSTEM]
    newest = decode(frames[-1])
    home = HOMES["px4"]
    north_m = (newest.lat * 1e-7 - home.lat_deg) * 111_180.0  # type: ignore[attr-defined]
    assert north_m == pytest.approx(40.0 + 2.0 * newest.time_usec * 1e-6, abs=0.2)  # type: ignore[attr-defined]
    assert (newest.vx, newest.vy) == (200, 0)  # type: ignore[attr-defined]


def test_magnetometer_measures_the_map():
    home = HOMES["px4"]
    lines = np.linspace(-200.0, 200.0, 5)
    survey = MagneticMap(
        north_m=lines, east_m=lines, total_field_nt=np.full((5, 5), 48_123.0), height_m=50.0, home=home
    )
    carried = PayloadParameters(magnetometer=SurveyMagnetometerParameters())
    sitl = Sitl(WorldSpec(vehicles=(VehicleSpec(payload=carried),), magnetic_field=MagneticField(survey)))
    client = sitl.connect(0)
    (received,) = frames_after(sitl, 2.0, client)
    values = [
        decode(f).value  # type: ignore[attr-defined]
        for f in received
        if f.component_id == SURVEY_MAGNETOMETER_COMPONENT and f.message_id == 251
    ]
    assert len(values) == 20
    assert np.mean(values) == pytest.approx(48_123.0, abs=2.0)


def test_magnetometer_without_a_map_is_refused():
    carried = PayloadParameters(magnetometer=SurveyMagnetometerParameters())
    with pytest.raises(ValueError, match="needs a magnetic map"):
        Sitl(WorldSpec(vehicles=(VehicleSpec(payload=carried),)))


def test_payload_changes_nothing_of_the_autopilots_own_telemetry():
    def telemetry(payload: PayloadParameters) -> list[bytes]:
        sitl = Sitl(WorldSpec(vehicles=(VehicleSpec(autopilot="ardupilot", payload=payload),), seed=3))
        link = sitl.connect(0)
        link.send(
            FrameEncoder(255, 190).encode(
                dialect.MAVLink_param_set_message(1, 1, b"SR0_EXTRA1", 10.0, dialect.MAV_PARAM_TYPE_REAL32)
            )
        )
        (received,) = frames_after(sitl, 3.0, link)
        return [f.raw for f in received if f.component_id == 1]

    assert telemetry(CAMERA) == telemetry(PayloadParameters())
