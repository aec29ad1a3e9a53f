"""What a client sees of a receiver that falls silent in flight, and comes back."""

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode
from autopilot_bridge.sitl import Sitl
from flightsim.world_spec import VehicleSpec, WorldSpec


@pytest.mark.parametrize(("flavour", "timeout_s"), [("px4", 1.0), ("ardupilot", 4.0)])
@pytest.mark.sampled(1)
def test_a_silent_receiver_is_shown_as_none(flavour: str, timeout_s: float) -> None:
    sitl = Sitl(WorldSpec(vehicles=(VehicleSpec(autopilot=flavour),)))
    link, parser = sitl.connect(0), FrameParser()
    client = FrameEncoder(255, 190)

    def command(number: int, *values: float) -> None:
        parameters = (*values, *(0.0,) * (7 - len(values)))
        link.send(client.encode(mavlink.MAVLink_command_long_message(1, 1, number, 0, *parameters)))

    def fixes(seconds: float) -> list[tuple[int, int, int]]:
        for _ in range(round(seconds * 1e6) // sitl.step_us):
            sitl.advance()
        frames = [frame for _, data in link.receive() for frame in parser.feed(data)]
        reported = [decode(f) for f in frames if f.message_id == mavlink.MAVLINK_MSG_ID_GPS_RAW_INT]
        return [(message.fix_type, message.satellites_visible, message.lat) for message in reported]  # type: ignore[attr-defined]

    command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAVLINK_MSG_ID_GPS_RAW_INT, 200_000)
    assert fixes(12.0)[-1][0] >= 3
    fail = sitl.vehicles[0].failures.inject
    fail(mavlink.FAILURE_UNIT_SENSOR_GPS, mavlink.FAILURE_TYPE_OFF, 0)
    assert fixes(timeout_s - 0.3)[-1][0] >= 3
    fixes(0.8)
    assert set(fixes(3.0)) == {(0, 0, 0)}
    fail(mavlink.FAILURE_UNIT_SENSOR_GPS, mavlink.FAILURE_TYPE_OK, 0)
    assert fixes(12.0)[-1][0] >= 3
