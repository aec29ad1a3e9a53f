"""Manual control: MANUAL_CONTROL, RC_CHANNELS_OVERRIDE, heartbeats of ground stations."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.dispatch import receives, streams
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.inputs.transmitter import (
    CHANNELS,
    ArmingGesture,
    GestureRules,
    ModeSwitch,
    ModeSwitchRules,
    Radio,
)
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parts import AutopilotParts
from autopilot_bridge.telemetry.streams import Values

_UNUSED: Final = 65535  # RC_CHANNELS_OVERRIDE: this channel is not changed
_RELEASE: Final = 0  # back to the radio, for channels 1 to 8
_RELEASE_MORE: Final = 65534  # the same for channels 9 to 18, where 0 does not change the channel
_FIRST_CHANNELS: Final = 8
_INVALID_AXIS: Final = 32767  # MANUAL_CONTROL: axis not sent
_RSSI_UNKNOWN: Final = 255


@dataclass(frozen=True, slots=True, kw_only=True)
class ManualRules:
    """How a firmware uses the sticks.

    Attributes:
        at_rest: pulses of the built-in transmitter, microseconds; empty: there is none.
        axes: parameters with the channels of roll, pitch, throttle and yaw; value 0: channels 1, 2, 3, 4.
        gcs_only: parameter with the only system id that may use the sticks; empty: any system may.
        source: parameter that selects the radio or MANUAL_CONTROL as source of the sticks; empty: both.
        timeout_s: age at which an override expires; negative: never, 0: overrides are not accepted.
        sticks_are_radio: MANUAL_CONTROL overrides the radio's channels (ArduPilot).
        mode_switch, gesture: the switch that selects modes and the stick gesture that arms.
    """

    at_rest: tuple[int, ...]
    axes: tuple[str, str, str, str]
    gcs_only: str
    source: str
    timeout_s: Callable[[ParameterStore], float]
    sticks_are_radio: bool
    mode_switch: ModeSwitchRules
    gesture: GestureRules

    def takes_radio(self, parameters: ParameterStore) -> bool:
        """The radio's sticks control the vehicle (COM_RC_IN_MODE: 0 radio, 2 and 3 both)."""
        return not self.source or round(parameters.get(self.source)) in (0, 2, 3)

    def takes_messages(self, parameters: ParameterStore) -> bool:
        """MANUAL_CONTROL controls the vehicle (COM_RC_IN_MODE: 1 messages, 2 and 3 both)."""
        return not self.source or round(parameters.get(self.source)) in (1, 2, 3)


class ManualService(Microservice):
    """Converts stick messages into the commander's pilot input, and reports the radio's channels.

    Args:
        parts: of the autopilot. Messages for other vehicles are ignored.
        rules: the firmware's.
    """

    def __init__(self, parts: AutopilotParts, rules: ManualRules) -> None:
        commander, parameters = parts.commander, parts.parameters
        self._commander = commander
        self._system_id = parts.system_id
        self._parameters = parameters
        self._rules = rules
        self._radio = Radio(rules.at_rest)
        self._switch = ModeSwitch(commander, parameters, self._radio, rules.mode_switch)
        self._gesture = ArmingGesture(commander, parameters, rules.gesture)
        self._used = False
        self._steering = False
        self._time_us = 0

    def tick(self, time_us: int) -> None:
        """Expire overrides; check mode switch and arming gesture once the sticks have been used."""
        if not self._used:
            return
        self._time_us = time_us
        if self._radio.overridden:
            self._radio.expire(time_us, self._rules.timeout_s(self._parameters))
            self._release_sticks()
        if self._rules.takes_radio(self._parameters):
            self._switch.tick(time_us)
        self._gesture.tick(time_us)

    @receives(dialect.MAVLink_heartbeat_message)
    def _on_heartbeat(self, message: dialect.MAVLink_heartbeat_message, source: Source, time_us: int) -> None:
        gcs = self._may_steer(source) if self._rules.gcs_only else message.type == dialect.MAV_TYPE_GCS
        if gcs:
            self._commander.pilot.on_gcs(time_us)

    def _may_steer(self, source: Source) -> bool:
        only = self._rules.gcs_only
        return not only or source.system_id == round(self._parameters.get(only))

    @receives(dialect.MAVLink_manual_control_message)
    def _on_manual(
        self, message: dialect.MAVLink_manual_control_message, source: Source, time_us: int
    ) -> None:
        """MANUAL_CONTROL: x forward, y right, r clockwise in -1000..1000; z throttle in 0..1000."""
        if message.target not in (0, self._system_id) or not self._may_steer(source):
            return
        axes = (message.y, message.x, message.z, message.r)
        if self._rules.sticks_are_radio:
            roll, pitch, throttle, yaw = self._axes()
            for channel, value, pulse_us in (
                (roll, message.y, 1500 + message.y // 2),
                (pitch, message.x, 1500 - message.x // 2),
                (throttle, message.z, 1000 + message.z),
                (yaw, message.r, 1500 + message.r // 2),
            ):
                if value != _INVALID_AXIS:
                    self._override(channel, min(2000, max(1000, pulse_us)), time_us)
            self._steer(time_us)
        elif _INVALID_AXIS not in axes and self._rules.takes_messages(self._parameters):
            self._used = True
            self._commander.pilot.move(
                pitch=message.x / 1000.0,
                roll=message.y / 1000.0,
                yaw=message.r / 1000.0,
                throttle=message.z / 500.0 - 1.0,
                time_us=time_us,
            )

    @receives(dialect.MAVLink_rc_channels_override_message)
    def _on_override(
        self, message: dialect.MAVLink_rc_channels_override_message, source: Source, time_us: int
    ) -> None:
        """RC_CHANNELS_OVERRIDE: pulses of channels 1 to 18."""
        if message.target_system not in (0, self._system_id) or not self._may_steer(source):
            return
        for channel in range(CHANNELS):
            pulse_us = getattr(message, f"chan{channel + 1}_raw")
            first = channel < _FIRST_CHANNELS
            if pulse_us == (_RELEASE if first else _RELEASE_MORE):
                self._radio.release(channel)
            elif pulse_us not in (_UNUSED, _RELEASE, _RELEASE_MORE):
                self._override(channel, pulse_us, time_us)
        if self._rules.takes_radio(self._parameters):
            self._steer(time_us)

    def _override(self, channel: int, pulse_us: int, time_us: int) -> None:
        if self._rules.timeout_s(self._parameters) != 0.0:
            self._used = True
            self._radio.override(channel, pulse_us, time_us)

    def _axes(self) -> tuple[int, int, int, int]:
        """Channels (from 0) of roll, pitch, throttle and yaw."""
        roll, pitch, throttle, yaw = (
            mapped - 1 if 1 <= (mapped := round(self._parameters.get(name))) <= CHANNELS else usual
            for usual, name in enumerate(self._rules.axes)
        )
        return roll, pitch, throttle, yaw

    def _steer(self, time_us: int) -> None:
        """Set the sticks from the radio's channels."""
        axes = self._axes()
        if not self._radio.is_overridden(axes):
            self._release_sticks()
            return
        roll, pitch, throttle, yaw = (self._radio.stick(channel) for channel in axes)
        self._steering = True
        # a radio's pitch channel is high when the stick is pulled
        self._commander.pilot.move(roll=roll, pitch=-pitch, throttle=throttle, yaw=yaw, time_us=time_us)

    def _release_sticks(self) -> None:
        if self._steering and not self._radio.is_overridden(self._axes()):
            self._steering = False
            self._commander.pilot.release()

    @streams(dialect.MAVLink_rc_channels_message)
    def _rc_channels(self) -> Values | None:
        """RC_CHANNELS (65); None without a radio."""
        pulses_us = self._radio.pulses_us
        driven = [channel for channel, pulse_us in enumerate(pulses_us) if pulse_us]
        if not driven:
            return None
        return (self._commander.time_us // 1000, driven[-1] + 1, *pulses_us, _RSSI_UNKNOWN)
