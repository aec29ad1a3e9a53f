"""People at the controls: MANUAL_CONTROL, RC_CHANNELS_OVERRIDE, and the heartbeats of ground stations."""

from typing import Final

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander import Commander
from autopilot_bridge.services.channel import MavlinkMessage, Source

_MANUAL: Final = mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL
_OVERRIDE: Final = mavlink.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE
_HEARTBEAT: Final = mavlink.MAVLINK_MSG_ID_HEARTBEAT

_UNUSED: Final = 65535  # RC_CHANNELS_OVERRIDE: leave this channel alone
_RELEASE: Final = 0  # RC_CHANNELS_OVERRIDE: back to the radio
_INVALID_AXIS: Final = 32767  # MANUAL_CONTROL: axis not sent
_MIDDLE_US: Final = 1500
_HALF_RANGE_US: Final = 500.0


class ManualService:
    """Turns stick messages into the commander's pilot input.

    Args:
        commander: whose pilot this is.
        system_id: messages for other vehicles are left alone.
        gcs_system_id: only this system's heartbeats count as a ground station's (ArduPilot SYSID_MYGCS);
            None: every heartbeat of type MAV_TYPE_GCS (PX4).
    """

    def __init__(self, commander: Commander, *, system_id: int, gcs_system_id: int | None = None) -> None:
        self._commander = commander
        self._system_id = system_id
        self._gcs_system_id = gcs_system_id
        self._channels = [_MIDDLE_US, _MIDDLE_US, _MIDDLE_US, _MIDDLE_US]

    def handle(self, message: MavlinkMessage, source: Source, time_us: int) -> bool:
        """Take one message; a HEARTBEAT is looked at and left to others (False)."""
        message_id = message.get_msgId()
        if message_id == _HEARTBEAT:
            if self._is_gcs(message, source):
                self._commander.pilot.hear_gcs(time_us)
            return False
        if message_id == _MANUAL:
            if message.target in (0, self._system_id):
                self._on_manual(message, time_us)
            return True
        if message_id == _OVERRIDE:
            if message.target_system in (0, self._system_id):
                self._on_override(message, time_us)
            return True
        return False

    def _is_gcs(self, message: MavlinkMessage, source: Source) -> bool:
        if self._gcs_system_id is not None:
            return source.system_id == self._gcs_system_id
        return bool(message.type == mavlink.MAV_TYPE_GCS)

    def _on_manual(self, message: MavlinkMessage, time_us: int) -> None:
        """MANUAL_CONTROL: x forward, y right, r clockwise in -1000..1000; z throttle in 0..1000."""
        axes = (message.x, message.y, message.r, message.z)
        if any(axis == _INVALID_AXIS for axis in axes):
            return
        self._commander.pilot.move(
            pitch=message.x / 1000.0,
            roll=message.y / 1000.0,
            yaw=message.r / 1000.0,
            throttle=message.z / 500.0 - 1.0,
            time_us=time_us,
        )

    def _on_override(self, message: MavlinkMessage, time_us: int) -> None:
        """RC_CHANNELS_OVERRIDE: channels 1 to 4 are roll, pitch, throttle, yaw (mode 2, AETR)."""
        raw = (message.chan1_raw, message.chan2_raw, message.chan3_raw, message.chan4_raw)
        if all(value in (_RELEASE, _UNUSED) for value in raw):
            if _RELEASE in raw:
                self._commander.pilot.release()
            return
        for index, value in enumerate(raw):
            if value == _RELEASE:
                self._channels[index] = _MIDDLE_US
            elif value != _UNUSED:
                self._channels[index] = value
        roll, pitch, throttle, yaw = ((value - _MIDDLE_US) / _HALF_RANGE_US for value in self._channels)
        # a radio's pitch channel is high when the stick is pulled
        self._commander.pilot.move(roll=roll, pitch=-pitch, throttle=throttle, yaw=yaw, time_us=time_us)
