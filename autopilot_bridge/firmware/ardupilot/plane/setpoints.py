"""Streamed setpoints as ArduPlane takes them (docs/firmware/ardupilot.md, section 7).

Setpoints are used in GUIDED only. Roll, pitch and throttle of SET_ATTITUDE_TARGET are each either used or
left to the autopilot; of the position setpoints only a height is used.
"""

import math
from typing import Any, Final

import numpy as np

from autopilot_bridge.commander.events import AltitudeChanged
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.dispatch import receives
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.inputs.setpoints import POSITION_BITS, place_of, unit_quaternion
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parts import AutopilotParts
from flightsim.foundation.rotations import euler_from_quaternion

_ROLL_RATE_BIT, _PITCH_RATE_BIT = 1, 2  # SET_ATTITUDE_TARGET.type_mask
_THROTTLE_BIT: Final = 64
_ATTITUDE_BIT: Final = 128
_QUATERNION_TOLERANCE: Final = 0.1
_Z_BIT: Final = POSITION_BITS[2]
_MAX_ALTITUDE_M: Final = 1e5
_AMSL: Final = frozenset({dialect.MAV_FRAME_GLOBAL, dialect.MAV_FRAME_GLOBAL_INT})
_RELATIVE: Final = frozenset(
    {dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT, dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT}
)


class ArduPlaneSetpoints(Microservice):
    """ArduPlane's setpoints."""

    def __init__(self, parts: AutopilotParts) -> None:
        self.commander = parts.commander

    @receives(dialect.MAVLink_set_position_target_local_ned_message)
    def on_local(
        self, message: dialect.MAVLink_set_position_target_local_ned_message, source: Source, time_us: int
    ) -> None:
        """SET_POSITION_TARGET_LOCAL_NED: in MAV_FRAME_LOCAL_OFFSET_NED (7) a step in height, nothing else.

        The mask is not checked, as in the firmware.
        """
        if message.coordinate_frame != dialect.MAV_FRAME_LOCAL_OFFSET_NED:
            return
        guided = self._guided() if abs(message.z) <= _MAX_ALTITUDE_M else None
        if guided is None:
            return
        circle = guided.circle
        flown_m = math.nan if circle is None else float(circle.centre_ned_m[2])
        present_m = place_of(self.commander.context)[2]
        down_m = (flown_m if math.isfinite(flown_m) else present_m) + message.z
        self._fly_at(guided, down_m)
        height_m = self._home_down_m() - down_m
        self.commander.emit(AltitudeChanged(time_us=self.commander.time_us, height_m=height_m))

    @receives(dialect.MAVLink_set_position_target_global_int_message)
    def on_global(
        self, message: dialect.MAVLink_set_position_target_global_int_message, source: Source, time_us: int
    ) -> None:
        """SET_POSITION_TARGET_GLOBAL_INT: its altitude.

        As in the firmware (`ArduPlane/GCS_Mavlink.cpp`) it is used when the mask has any bit but that of the
        altitude, whether the mask ignores the altitude or not.
        """
        frame, context = message.coordinate_frame, self.commander.context
        if (
            not message.type_mask & ~_Z_BIT
            or not abs(message.alt) <= _MAX_ALTITUDE_M
            or context.frame is None
        ):
            return
        if frame in _RELATIVE:
            reference_down_m = self._home_down_m()
        elif frame in _AMSL:
            reference_down_m = context.frame.origin.alt_m
        else:
            return
        guided = self._guided()
        if guided is not None:
            self._fly_at(guided, reference_down_m - message.alt)

    @receives(dialect.MAVLink_set_attitude_target_message)
    def on_attitude(
        self, message: dialect.MAVLink_set_attitude_target_message, source: Source, time_us: int
    ) -> None:
        """SET_ATTITUDE_TARGET: what the mask does not ignore of roll, pitch and throttle.

        The bits of the body rates leave roll or pitch to the autopilot only together with the attitude's bit:
        0x47 and 0x07 are attitudes, 0xC6 is a roll alone.
        """
        mask = message.type_mask
        rolls, pitches = _angles_wanted(mask)
        throttle = None
        if not mask & _THROTTLE_BIT and math.isfinite(message.thrust):
            throttle = min(1.0, max(0.0, float(message.thrust)))
        roll = pitch = None
        if rolls or pitches:
            q = unit_quaternion(list(message.q), tolerance=_QUATERNION_TOLERANCE)
            if q is None:
                return
            euler = np.zeros(3)
            euler_from_quaternion(q, euler)
            roll = float(euler[0]) if rolls else None
            pitch = float(euler[1]) if pitches else None
        if roll is None and pitch is None and throttle is None:
            return
        guided = self._guided()
        if guided is not None:
            guided.set_attitude(self.commander.context, roll, pitch, throttle)

    def _fly_at(self, guided: Any, down_m: float) -> None:
        """Set another height for the current circle, or for the manoeuvre that is flown instead of it."""
        if not math.isfinite(down_m):
            return
        if guided.circle is not None:
            guided.circle.set_height(down_m)
        else:
            self.commander.guidance.change_altitude(down_m, rate_m_s=0.0)

    def _home_down_m(self) -> float:
        down_m = float(self.commander.context.home_ned_m[2])
        return down_m if math.isfinite(down_m) else 0.0

    def _guided(self) -> Any:
        commander = self.commander
        return commander.guidance.guided() if commander.mode is FlightMode.GUIDED else None


def _angles_wanted(mask: int) -> tuple[bool, bool]:
    """(roll, pitch): True where the message controls the angle."""
    if not mask & _ATTITUDE_BIT:
        return True, True
    return not mask & _ROLL_RATE_BIT, not mask & _PITCH_RATE_BIT
