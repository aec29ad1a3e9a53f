"""Streamed setpoints: SET_POSITION_TARGET_LOCAL_NED, SET_POSITION_TARGET_GLOBAL_INT and SET_ATTITUDE_TARGET.

PX4 flies them in OFFBOARD as they come and counts the good ones as a sign of life (docs/firmware/px4.md,
section 9). ArduPilot flies them smoothly in GUIDED (docs/firmware/ardupilot.md, sections 6 and 7). Neither
acknowledges them.
"""

from collections.abc import Mapping
from typing import Protocol

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.services.channel import MavlinkMessage, Receiver


class SetpointRules(Protocol):
    """How one firmware uses each kind of setpoint; invalid setpoints are ignored."""

    def on_local(self, message: MavlinkMessage, time_us: int) -> None: ...

    def on_global(self, message: MavlinkMessage, time_us: int) -> None: ...

    def on_attitude(self, message: MavlinkMessage, time_us: int) -> None: ...


class SetpointService:
    """Passes setpoints to the firmware's rules.

    Args:
        rules: how the firmware uses setpoints.
    """

    def __init__(self, rules: SetpointRules) -> None:
        self._rules = rules

    @property
    def receivers(self) -> Mapping[int, Receiver]:
        """The three kinds of setpoints; invalid ones are ignored, as in the firmware."""
        rules = self._rules
        return {
            mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED: (
                lambda message, source, time_us: rules.on_local(message, time_us)
            ),
            mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT: (
                lambda message, source, time_us: rules.on_global(message, time_us)
            ),
            mavlink.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET: (
                lambda message, source, time_us: rules.on_attitude(message, time_us)
            ),
        }
