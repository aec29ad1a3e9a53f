"""A mission without the key of a vehicle that signs: what it can report of that."""

import pytest

from autopilot_bridge.mavlink import FrameParser, LinkSigning, SigningKey, SigningState, dialect
from missions.base.options import FlightOptions
from missions.base.request import RunRequest
from missions.errors import VehicleTimeout
from missions.vehicle.signing import require_key

KEY = SigningKey.from_passphrase("theirs")


class SigningEncoder:
    """Signs what another encoder makes."""

    def __init__(self, encoder):
        self._encoder = encoder
        self._signing = LinkSigning(SigningState(KEY, clock=lambda: 1), link_id=1)

    def encode(self, message):
        return self._signing.sign(self._encoder.encode(message))


def sign(autopilot):
    autopilot.encoder = SigningEncoder(autopilot.encoder)


REQUEST = RunRequest(options=FlightOptions(), connect=("udpin:127.0.0.1:1",))


def test_a_vehicle_that_signs_and_does_not_answer_is_refused_before_anything_is_sent(flown):
    async def script(vehicle, autopilot):
        received = []
        autopilot.link.on_receive = lambda data: received.extend(FrameParser().feed(data))
        await vehicle.wait_heartbeat()
        with pytest.raises(VehicleTimeout, match=r"vehicle 1 signs its messages.*`signing_key` FILE"):
            await require_key(None, vehicle)
        return {frame.message_id for frame in received}

    assert flown(script, ready=False, setup=sign) <= {0, dialect.MAVLINK_MSG_ID_COMMAND_LONG}


@pytest.mark.parametrize("setup", [sign, lambda autopilot: None])
def test_a_vehicle_that_answers_wants_no_key(flown, setup):
    async def script(vehicle, autopilot):
        await vehicle.wait_heartbeat()
        await require_key(None, vehicle)
        return len(autopilot.commands)

    assert flown(script, ready=False, setup=setup) == (setup is sign)
