"""What the look-out of an orbit goes by."""

from missions.orbit.look_out import LookOut
from missions.orbit.options import OrbitOptions


def test_what_was_told_before_a_silence_is_no_news(flown):
    """Where the aircraft was when its line was pulled out says nothing of the target against it now."""

    async def script(vehicle, autopilot):
        look_out = LookOut(vehicle, OrbitOptions())
        await vehicle.clock.sleep(1.0)
        before = look_out.informed
        send, autopilot.send = autopilot.send, lambda message: None
        await vehicle.clock.sleep(5.0)
        silent = look_out.informed
        autopilot.send = send
        await vehicle.clock.sleep(1.0)
        return before, silent, look_out.informed

    assert flown(script) == (True, False, True)
