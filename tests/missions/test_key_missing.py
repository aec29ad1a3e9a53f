"""A mission without the key of a vehicle that signs: what it can tell of that."""

import pytest

from autopilot_bridge.mavlink import LinkSigning, SigningKey, SigningState
from missions.errors import VehicleTimeout
from missions.options import FlightOptions
from missions.request import RunRequest
from missions.signing import key_missing

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


@pytest.mark.parametrize("answers", [False, True])
def test_a_vehicle_that_signs_and_answers_nothing_may_want_its_key(flown, answers):
    async def script(vehicle, autopilot):
        if not answers:
            autopilot.link.on_receive = lambda data: None
        await vehicle.wait_heartbeat()
        try:
            await vehicle.set_message_rate("VFR_HUD", 10.0)
        except VehicleTimeout:
            assert not answers
        request = RunRequest(options=FlightOptions(), connect=("udpin:127.0.0.1:1",))
        return key_missing(request, [vehicle])

    told = flown(script, ready=False, setup=sign)
    assert len(told) == (not answers)
    assert answers or "--signing-key" in told[0]


def test_a_vehicle_that_does_not_sign_wants_none(flown):
    async def script(vehicle, autopilot):
        request = RunRequest(options=FlightOptions(), connect=("udpin:127.0.0.1:1",))
        return key_missing(request, [vehicle])

    assert flown(script) == []
