"""The pilot's input: sticks and heartbeats of ground stations their ages, and their effect on the mode."""

import math
from collections.abc import Iterable
from typing import Final

from autopilot_bridge.commander.events import Event, FailsafeAction, FailsafeCleared, FailsafeKind
from autopilot_bridge.commander.modes import STICK_MODES, FlightMode
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.flight.context import ManualInput

_NO_INPUT: Final = ManualInput()
_RADIO_AT_REST: Final = ManualInput(throttle=-1.0, valid=True, simulated=True)
THROTTLE_RAISED: Final = -0.8
"""Throttle stick, -1..1: above this it is not down."""
_CUBIC_PER_HOVER: Final = 0.375
_CUBIC: Final = (-0.5, 1.0)


def lifts(throttle: float, hover_thrust: float) -> bool:
    """The throttle stick, -1..1, commands more than half of the thrust of a hover, if it is the thrust.

    Source: ArduCopter 4.6.3, `Mode::get_pilot_desired_throttle` (a cubic with the hover at the middle of the
    stick) and `Copter::get_non_takeoff_throttle`.
    """
    part = 0.5 * (throttle + 1.0)
    cubic = min(max((0.5 - hover_thrust) / _CUBIC_PER_HOVER, _CUBIC[0]), _CUBIC[1])
    return part * (1.0 - cubic) + cubic * part**3 > 0.5 * hover_thrust


class ModeMemory:
    """Stores the mode from before a failsafe of the radio until another decision replaces it.

    Args:
        active: the flavour restores the mode; else nothing is stored.
    """

    def __init__(self, *, active: bool) -> None:
        self._active = active
        self._mode: FlightMode | None = None

    def note(self, started: Iterable[tuple[FailsafeKind, FailsafeAction]], mode: FlightMode) -> None:
        """Failsafes started in a mode; only a first, short loss of the radio is reversed later."""
        for kind, action in started:
            if action > FailsafeAction.WARN:
                self._mode = mode if self._active and kind is FailsafeKind.MANUAL_LOST else None

    def forget(self) -> None:
        """A client or pilot has selected a mode."""
        self._mode = None

    def recall(self, changes: Iterable[Event]) -> FlightMode | None:
        """The mode to restore because the radio is back; None: no change."""
        for event in changes:
            if isinstance(event, FailsafeCleared) and event.kind is FailsafeKind.MANUAL_LOST:
                mode, self._mode = self._mode, None
                return mode
        return None


class PilotInput:
    """Newest stick positions and their time of arrival.

    Args:
        built_in_radio: without any sender the sticks are centred and the throttle is down (ArduPilot's
            SITL); else there is no stick input (PX4).

    Attributes:
        muted: the radio is being calibrated; its sticks have no effect.
    """

    def __init__(self, *, built_in_radio: bool) -> None:
        self._built_in_radio = built_in_radio
        self._sticks = _NO_INPUT
        self._time_us = -1
        self._gcs_time_us = -1
        self.radio_failed_since_us: int | None = None
        self.muted = False

    def move(self, *, roll: float, pitch: float, throttle: float, yaw: float, time_us: int) -> None:
        """New sticks, each -1..1 (clamped); throttle 0 is the middle. Not-a-number input is ignored."""
        values = (roll, pitch, throttle, yaw)
        lost = self.radio_failed_since_us is not None
        if self.muted or lost or not all(math.isfinite(value) for value in values):
            return
        roll, pitch, throttle, yaw = (min(1.0, max(-1.0, value)) for value in values)
        self._sticks = ManualInput(roll=roll, pitch=pitch, throttle=throttle, yaw=yaw, valid=True)
        self._time_us = time_us

    def lose_signal(self, lost: bool, time_us: int) -> None:
        """The radio's signal is lost, and no stick input arrives; or the signal is back."""
        if lost and self.radio_failed_since_us is None:
            self.radio_failed_since_us = time_us
        elif not lost:
            self.radio_failed_since_us = None

    def release(self) -> None:
        """The sender releases the sticks."""
        self._time_us = -1
        self._sticks = _NO_INPUT

    def on_gcs(self, time_us: int) -> None:
        """A heartbeat of a ground station was received."""
        self._gcs_time_us = time_us

    def sticks(self, time_us: int, timeout_s: float) -> ManualInput:
        """The stick input of the flight task: the newest until it expires, then none (or the radio's)."""
        if self._time_us >= 0 and (time_us - self._time_us) * 1e-6 <= timeout_s:
            return self._sticks
        return _RADIO_AT_REST if self._built_in_radio and self.radio_failed_since_us is None else _NO_INPUT

    def sticks_age_s(self, time_us: int, timeout_s: float) -> float:
        """Age of the newest stick input; infinite when there was none."""
        age_s = (time_us - self._time_us) * 1e-6 if self._time_us >= 0 else math.inf
        if not self._built_in_radio:
            return age_s
        if age_s <= timeout_s:
            return 0.0  # an override holds until it expires
        failed_us = self.radio_failed_since_us
        return 0.0 if failed_us is None else min(age_s, (time_us - failed_us) * 1e-6)

    def gcs_age_s(self, time_us: int) -> float:
        """Time since the last heartbeat of a ground station; infinite when there was none."""
        return (time_us - self._gcs_time_us) * 1e-6 if self._gcs_time_us >= 0 else math.inf


def stick_travel(now: ManualInput, before: ManualInput) -> float:
    """How far the pilot moved roll or pitch, 0..2; 0 without stick input."""
    if not (now.valid and before.valid):
        return 0.0
    return max(abs(now.roll - before.roll), abs(now.pitch - before.pitch))


class StickOverride:
    """Compares the sticks with their positions at the last mode command, or with the first ones after it."""

    def __init__(self) -> None:
        self._at_command = ManualInput()

    def restart(self, sticks: ManualInput) -> None:
        """A mode was commanded, or the vehicle was armed, with these stick positions."""
        self._at_command = sticks

    def wanted(self, mode: FlightMode, sticks: ManualInput, parameters: CommanderParameters) -> bool:
        """True when the pilot takes over in flight."""
        if not sticks.valid:
            return False
        offboard = mode is FlightMode.OFFBOARD
        allowed = parameters.stick_override_offboard if offboard else parameters.stick_override
        if not allowed or mode in STICK_MODES:
            return False
        if not self._at_command.valid:  # the first sticks after the command are at rest until they move
            self._at_command = sticks
        return stick_travel(sticks, self._at_command) > parameters.stick_override_threshold
