"""What the pilot's sticks are taken for: their range, their age, and what stands in for them."""

import math

import pytest

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.pilot import PilotInput, stick_travel
from autopilot_bridge.flight.context import ManualInput
from tests.commander.rig import Rig


def moved(*, built_in_radio: bool = False, **sticks: float) -> PilotInput:
    pilot = PilotInput(built_in_radio=built_in_radio)
    values = {"roll": 0.0, "pitch": 0.0, "throttle": 0.0, "yaw": 0.0} | sticks
    pilot.move(**values, time_us=1_000_000)
    return pilot


@pytest.mark.parametrize("name", ["roll", "pitch", "throttle", "yaw"])
@pytest.mark.parametrize(("value", "taken"), [(0.4, 0.4), (1.7, 1.0), (-1.7, -1.0)])
def test_sticks_are_clamped_to_their_travel(name: str, value: float, taken: float) -> None:
    sticks = moved(**{name: value}).sticks(1_000_000, timeout_s=0.5)
    assert getattr(sticks, name) == taken


@pytest.mark.parametrize("name", ["roll", "pitch", "throttle", "yaw"])
def test_sticks_that_are_no_numbers_change_nothing(name: str) -> None:
    pilot = moved(roll=0.3)
    values = {"roll": 0.0, "pitch": 0.0, "throttle": 0.0, "yaw": 0.0} | {name: math.nan}
    pilot.move(**values, time_us=2_000_000)
    assert pilot.sticks(1_000_000, timeout_s=0.5).roll == 0.3
    assert pilot.sticks_age_s(2_000_000, timeout_s=0.5) == pytest.approx(1.0)


def test_old_sticks_are_none_and_ardupilots_radio_rests_with_the_throttle_down() -> None:
    assert moved().sticks(1_500_000, timeout_s=0.5).valid
    assert moved().sticks(1_510_000, timeout_s=0.5) == ManualInput()
    at_rest = moved(built_in_radio=True, throttle=0.6).sticks(1_510_000, timeout_s=0.5)
    assert at_rest.valid and at_rest.simulated
    assert (at_rest.roll, at_rest.pitch, at_rest.throttle, at_rest.yaw) == (0.0, 0.0, -1.0, 0.0)


def test_a_lost_radio_gives_no_sticks_and_ages() -> None:
    pilot = moved(built_in_radio=True)
    pilot.lose_signal(True, 5_000_000)
    assert pilot.sticks(7_000_000, timeout_s=0.5) == ManualInput()
    assert pilot.sticks_age_s(7_000_000, timeout_s=0.5) == pytest.approx(2.0)
    pilot.lose_signal(False, 7_000_000)
    assert pilot.sticks(7_000_000, timeout_s=0.5).valid
    assert pilot.sticks_age_s(7_000_000, timeout_s=0.5) == 0.0


def test_a_pilot_who_never_was_there_is_infinitely_old() -> None:
    pilot = PilotInput(built_in_radio=False)
    assert pilot.sticks_age_s(1, timeout_s=0.5) == math.inf
    assert pilot.gcs_age_s(1) == math.inf
    pilot.on_gcs(0)
    assert pilot.gcs_age_s(3_000_000) == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("mode", "throttle", "text"),
    [
        (FlightMode.STABILIZED, -0.81, None),
        (FlightMode.STABILIZED, -0.79, "Arming denied: high throttle"),
        (FlightMode.ALTITUDE, 0.19, None),
        (FlightMode.ALTITUDE, 0.21, "Arming denied: throttle above center"),
        (FlightMode.HOLD, 1.0, None),
    ],
)
def test_px4_arms_by_the_throttle_stick(mode: FlightMode, throttle: float, text: str | None) -> None:
    rig = Rig("px4")

    def hold_stick() -> None:
        rig.commander.pilot.move(roll=0.0, pitch=0.0, throttle=throttle, yaw=0.0, time_us=rig.time_us)

    hold_stick()
    rig.commander.set_mode(mode)
    for _ in range(20):
        hold_stick()
        rig.tick()
    assert rig.commander.arm().accepted is (text is None)
    rig.tick()
    assert text is None or rig.texts()[-1] == text


@pytest.mark.parametrize(
    ("now", "before", "travel"),
    [
        ({"roll": 0.5}, {"roll": 0.1}, 0.4),
        ({"pitch": -0.5}, {"pitch": 0.2}, 0.7),
        ({"roll": -1.0, "pitch": 0.1}, {"roll": 1.0}, 2.0),
        ({"yaw": 1.0, "throttle": 1.0}, {}, 0.0),
        ({"roll": 0.5, "valid": False}, {}, 0.0),
        ({"roll": 0.5}, {"valid": False}, 0.0),
    ],
)
def test_travel_of_the_sticks(now: dict[str, float], before: dict[str, float], travel: float) -> None:
    sticks = [ManualInput(**({"valid": True} | values)) for values in (now, before)]  # type: ignore[arg-type]
    assert stick_travel(*sticks) == pytest.approx(travel)
