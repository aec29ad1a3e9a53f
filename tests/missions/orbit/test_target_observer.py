"""Which telemetry the observation of an orbit's target relies on."""

from missions.orbit.options import OrbitOptions
from missions.orbit.target_observer import TargetObserver


def test_what_was_reported_before_a_silence_is_no_news(flown):
    """Where the aircraft was when its line was pulled out says nothing of the target against it now."""

    async def script(vehicle, autopilot):
        observer = TargetObserver(vehicle, OrbitOptions())
        await vehicle.clock.sleep(1.0)
        before = observer.informed
        send, autopilot.send = autopilot.send, lambda message: None
        await vehicle.clock.sleep(5.0)
        silent = observer.informed
        autopilot.send = send
        await vehicle.clock.sleep(1.0)
        return before, silent, observer.informed

    assert flown(script) == (True, False, True)
