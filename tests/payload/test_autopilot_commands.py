"""Commands for camera and gimbal sent to the autopilot, as clients of each firmware send them."""

import math

import pytest

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode, dialect
from autopilot_bridge.payload import CAMERA_COMPONENT, GIMBAL_COMPONENT
from autopilot_bridge.sitl import Sitl
from flightsim.payload import CameraParameters, GimbalParameters, PayloadParameters
from flightsim.world_spec import VehicleSpec, WorldSpec

CARRIED = PayloadParameters(gimbal=GimbalParameters(), camera=CameraParameters())
NOTHING = PayloadParameters()
GCS, OTHER = (255, 190), (254, 190)


class Talk:
    """A client on a memory link."""

    def __init__(self, flavour: str, payload: PayloadParameters) -> None:
        self.sitl = Sitl(WorldSpec(vehicles=(VehicleSpec(autopilot=flavour, payload=payload),)))
        self.link = self.sitl.connect(0)
        self.encoders = {sender: FrameEncoder(*sender) for sender in (GCS, OTHER)}
        self.parser = FrameParser()
        self.frames = []
        self.run(4.0)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 1e6) // self.sitl.step_us):
            self.sitl.advance()
            for _, data in self.link.receive():
                self.frames += self.parser.feed(data)

    def command(self, number: int, *values: float, sender=GCS) -> list[int]:
        """The results that the autopilot acknowledges with."""
        before = len(self.frames)
        params = (*values, *(0.0,) * (7 - len(values)))
        message = dialect.MAVLink_command_long_message(1, 1, number, 0, *params)
        self.link.send(self.encoders[sender].encode(message))
        self.run(0.2)
        return [
            ack.result  # type: ignore[attr-defined]
            for ack in map(decode, self.of(dialect.MAVLINK_MSG_ID_COMMAND_ACK, 1, since=before))
            if ack.command == number and (ack.target_system, ack.target_component) == sender  # type: ignore[attr-defined]
        ]

    def of(self, message_id: int, component: int, since: int = 0) -> list:
        return [
            frame
            for frame in self.frames[since:]
            if (frame.message_id, frame.component_id) == (message_id, component)
        ]

    def pitch_deg(self) -> float:
        w, x, y, z = decode(  # type: ignore[attr-defined]
            self.of(dialect.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS, GIMBAL_COMPONENT)[-1]
        ).q
        return math.degrees(math.asin(2.0 * (w * y - z * x)))


@pytest.fixture(params=["px4", "ardupilot"])
def talk(request) -> Talk:
    return Talk(request.param, CARRIED)


def test_gimbal_commands_to_the_autopilot_move_the_gimbal(talk):
    pitchyaw, mount = dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, dialect.MAV_CMD_DO_MOUNT_CONTROL
    assert talk.command(pitchyaw, -40.0, 0.0, math.nan, math.nan, 12.0) == [dialect.MAV_RESULT_ACCEPTED]
    talk.run(3.0)
    assert talk.pitch_deg() == pytest.approx(-40.0, abs=1.0)
    mode = float(dialect.MAV_MOUNT_MODE_MAVLINK_TARGETING)
    assert talk.command(mount, -20.0, 0.0, 0.0, 0.0, 0.0, 0.0, mode) == [dialect.MAV_RESULT_ACCEPTED]
    talk.run(3.0)
    assert talk.pitch_deg() == pytest.approx(-20.0, abs=1.0)


def test_control_by_the_autopilot_is_the_clients_own(talk):
    configure, pitchyaw = (
        dialect.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE,
        dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
    )
    assert talk.command(configure, -2.0, -2.0, -1.0, -1.0) == [dialect.MAV_RESULT_ACCEPTED]
    status = decode(talk.of(dialect.MAVLINK_MSG_ID_GIMBAL_MANAGER_STATUS, GIMBAL_COMPONENT)[-1])
    assert (status.primary_control_sysid, status.primary_control_compid) == GCS  # type: ignore[attr-defined]
    assert talk.command(pitchyaw, -30.0, sender=OTHER) == [dialect.MAV_RESULT_DENIED]
    assert talk.command(pitchyaw, -30.0) == [dialect.MAV_RESULT_ACCEPTED]
    assert talk.command(configure, -3.0, -3.0, -1.0, -1.0, sender=OTHER) == [dialect.MAV_RESULT_ACCEPTED]
    assert talk.command(pitchyaw, -10.0, sender=OTHER) == [dialect.MAV_RESULT_DENIED]
    assert talk.command(configure, -3.0, -3.0, -1.0, -1.0) == [dialect.MAV_RESULT_ACCEPTED]
    assert talk.command(pitchyaw, -10.0, sender=OTHER) == [dialect.MAV_RESULT_ACCEPTED]


def test_the_shutter_is_released_through_the_autopilot(talk):
    digicam = talk.command(dialect.MAV_CMD_DO_DIGICAM_CONTROL, 0.0, 0.0, 0.0, 0.0, 1.0)
    assert digicam == [dialect.MAV_RESULT_ACCEPTED]
    assert len(talk.of(dialect.MAVLINK_MSG_ID_CAMERA_IMAGE_CAPTURED, CAMERA_COMPONENT)) == 1
    started = talk.command(dialect.MAV_CMD_IMAGE_START_CAPTURE, 0.0, 0.0, 1.0)
    # PX4 leaves cameras with an id of their own to their clients (docs/firmware/px4.md, section 7)
    px4 = talk.sitl.vehicles[0].specification.autopilot == "px4"
    assert started == [dialect.MAV_RESULT_UNSUPPORTED if px4 else dialect.MAV_RESULT_ACCEPTED]


@pytest.mark.parametrize(
    ("flavour", "answer"), [("px4", []), ("ardupilot", [dialect.MAV_RESULT_UNSUPPORTED])]
)
def test_without_devices_no_device_executes_it(flavour, answer):
    talk = Talk(flavour, NOTHING)
    for number in (
        dialect.MAV_CMD_DO_DIGICAM_CONTROL,
        dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
        dialect.MAV_CMD_DO_MOUNT_CONTROL,
        dialect.MAV_CMD_DO_SET_CAM_TRIGG_DIST,
    ):
        assert talk.command(number) == answer
    assert talk.command(dialect.MAV_CMD_DO_SET_ROI_NONE) == [dialect.MAV_RESULT_ACCEPTED]
