"""The radio as an autopilot receives it: pulses of a transmitter, and the overrides of ground stations."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.commander import Commander
from autopilot_bridge.commander.modes import STICK_MODES, FlightMode
from autopilot_bridge.flight.context import ManualInput
from autopilot_bridge.parameters import ParameterStore

CHANNELS: Final = 18
_MIDDLE_US: Final = 1500
_HALF_RANGE_US: Final = 500.0


class Radio:
    """Pulses of 18 channels, microseconds; 0: nothing is received on that channel.

    Args:
        at_rest: pulses of a built-in transmitter with untouched sticks; empty: there is none.
    """

    def __init__(self, at_rest: tuple[int, ...] = ()) -> None:
        self._at_rest = at_rest + (0,) * (CHANNELS - len(at_rest))
        self._overrides = [0] * CHANNELS
        self._times_us = [0] * CHANNELS

    def override(self, channel: int, pulse_us: int, time_us: int) -> None:
        """Override a channel (from 0) with this pulse."""
        self._overrides[channel] = pulse_us
        self._times_us[channel] = time_us

    def release(self, channel: int) -> None:
        """End the override of a channel (from 0): it is the transmitter's again."""
        self._overrides[channel] = 0

    def expire(self, time_us: int, timeout_s: float) -> None:
        """Release the channels whose override was not repeated within `timeout_s`; negative: never."""
        if timeout_s < 0.0:
            return
        for channel, pulse_us in enumerate(self._overrides):
            if pulse_us and time_us - self._times_us[channel] > timeout_s * 1e6:
                self._overrides[channel] = 0

    @property
    def overridden(self) -> bool:
        """A ground station overrides some channel."""
        return any(self._overrides)

    def is_overridden(self, channels: Iterable[int]) -> bool:
        """A ground station overrides one of these channels (from 0)."""
        return any(self._overrides[channel] for channel in channels)

    @property
    def pulses_us(self) -> list[int]:
        """The pulses of all channels."""
        return [own or rest for own, rest in zip(self._overrides, self._at_rest, strict=True)]

    def stick(self, channel: int) -> float:
        """A channel (from 0) as a stick, -1..1; in the middle if nothing is received."""
        pulse_us = self._overrides[channel] or self._at_rest[channel] or _MIDDLE_US
        return (pulse_us - _MIDDLE_US) / _HALF_RANGE_US


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeSwitchRules:
    """The switch that selects the mode.

    Attributes:
        channel: parameter with its channel, from 1; 0: there is none.
        slot: parameters of the modes, with {} for 1 to 6.
        limits_us: pulses that separate the six positions.
        modes: the modes by the values of these parameters.
    """

    channel: str
    slot: str
    limits_us: tuple[int, ...]
    modes: Mapping[int, FlightMode]


class ModeSwitch:
    """Changes the mode when the switch has been in a new position for 0.2 s."""

    _SETTLE_US: Final = 200_000

    def __init__(
        self, commander: Commander, parameters: ParameterStore, radio: Radio, rules: ModeSwitchRules
    ) -> None:
        self._commander = commander
        self._parameters = parameters
        self._radio = radio
        self._rules = rules
        self._position = self._read()
        self._seen = self._position
        self._seen_us = 0

    def tick(self, time_us: int) -> None:
        """Read the switch."""
        position = self._read()
        if position != self._seen:
            self._seen, self._seen_us = position, time_us
        elif position not in (None, self._position) and time_us - self._seen_us >= self._SETTLE_US:
            assert position is not None
            self._position = position
            number = round(self._parameters.get(self._rules.slot.format(position + 1)))
            mode = self._rules.modes.get(number)
            if mode is not None:
                self._commander.set_mode(mode)

    def _read(self) -> int | None:
        channel = round(self._parameters.get(self._rules.channel))
        pulse_us = self._radio.pulses_us[channel - 1] if 1 <= channel <= CHANNELS else 0
        if not 900 < pulse_us < 2200:
            return None
        return sum(pulse_us >= limit_us for limit_us in self._rules.limits_us)


@dataclass(frozen=True, slots=True, kw_only=True)
class GestureRules:
    """Arming by the sticks: throttle down and yaw held to the right arms; yaw to the left disarms.

    Attributes:
        switch: parameter that enables the gesture.
        arm_from, disarm_from: smallest values of that parameter that allow arming and disarming.
        hold_s: time that the sticks are held, from the parameters.
        throttle_below, yaw_beyond: stick positions, -1..1.
        centred: roll and pitch must be centred.
        by_hand_only: arms only in modes flown by the sticks.
    """

    switch: str
    arm_from: int
    disarm_from: int
    hold_s: Callable[[ParameterStore], float]
    throttle_below: float
    yaw_beyond: float
    centred: bool
    by_hand_only: bool


class ArmingGesture:
    """Detects the arming gesture."""

    _CENTRE: Final = 0.1

    def __init__(self, commander: Commander, parameters: ParameterStore, rules: GestureRules) -> None:
        self._commander = commander
        self._parameters = parameters
        self._rules = rules
        self._side = 0
        self._since_us = 0

    def tick(self, time_us: int) -> None:
        """Read the sticks."""
        side = self._read(self._commander.context.sticks)
        if side != self._side:
            self._side, self._since_us = side, time_us
            return
        if side == 0 or self._since_us < 0:
            return
        rules, commander = self._rules, self._commander
        if time_us - self._since_us < rules.hold_s(self._parameters) * 1e6:
            return
        self._since_us = -1  # done: not repeated before the sticks are released
        allowed = self._parameters.get(rules.switch)
        if side > 0 and allowed >= rules.arm_from and not commander.armed:
            if commander.mode in STICK_MODES or not rules.by_hand_only:
                commander.arm(by_rudder=True)
        elif side < 0 and allowed >= rules.disarm_from and commander.armed and commander.landed:
            commander.disarm()

    def _read(self, sticks: ManualInput) -> int:
        rules = self._rules
        if not sticks.valid or sticks.simulated or sticks.throttle > rules.throttle_below:
            return 0
        if rules.centred and max(abs(sticks.roll), abs(sticks.pitch)) > self._CENTRE:
            return 0
        return (sticks.yaw > rules.yaw_beyond) - (sticks.yaw < -rules.yaw_beyond)
