"""The payload of a vehicle: camera, gimbal, survey magnetometer, target sensor.

Each is a MAVLink component of the vehicle's system with its own component id (docs/fixed_wing.md). Their
messages are used as they arrive; only requested messages are sent.
"""

import math
from collections.abc import Callable
from typing import Final, TypeVar

from autopilot_bridge.mavlink import Frame, MAVLinkMessage, decode_as, dialect
from autopilot_bridge.mavlink.components import (
    CAMERA_COMPONENT,
    GIMBAL_COMPONENT,
    SURVEY_MAGNETOMETER_COMPONENT,
)
from autopilot_bridge.mavlink.wire_units import e7
from estimators import survey_magnetometer
from estimators.tracking.line_of_sight import Detection, GimbalAttitude, detection, gimbal_attitude
from missions.vehicle.link import VehicleLink

MessageT = TypeVar("MessageT", bound=MAVLinkMessage)
ValueT = TypeVar("ValueT")

# within this time the gimbal manager reports which component has the control
_CONTROL_REPORTED_US: Final = 3_000_000

_IN_VEHICLE_FRAME: Final = dialect.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME


class Payload:
    """The payload components of one vehicle.

    Args:
        link: messages of the vehicle that carries them.
    """

    def __init__(self, link: VehicleLink) -> None:
        self._link = link
        self._control_since_us: int | None = None  # time at which control of the gimbal was requested

    # receiving

    def on_detection(self, listener: Callable[[Detection], None]) -> Callable[[], None]:
        """Call `listener` with each detection; returns a function that ends this."""
        return self.listen(dialect.MAVLink_landing_target_message, CAMERA_COMPONENT, detection, listener)

    def on_gimbal_attitude(self, listener: Callable[[GimbalAttitude], None]) -> Callable[[], None]:
        """Call `listener` with each attitude of the gimbal; returns a function that ends this."""
        return self.listen(
            dialect.MAVLink_gimbal_device_attitude_status_message, GIMBAL_COMPONENT, gimbal_attitude, listener
        )

    def on_total_field(self, listener: Callable[[int, float], None]) -> Callable[[], None]:
        """Call `listener` with (vehicle time us, total magnetic field nT) of each sample of the survey
        magnetometer; returns a function that ends this.
        """

        def sample(m: dialect.MAVLink_named_value_float_message) -> tuple[int, float] | None:
            if str(m.name).rstrip("\0") != survey_magnetometer.TOTAL_FIELD_NAME or not math.isfinite(m.value):
                return None
            return int(m.time_boot_ms) * 1000, float(m.value)

        return self.listen(
            dialect.MAVLink_named_value_float_message,
            SURVEY_MAGNETOMETER_COMPONENT,
            sample,
            lambda s: listener(*s),
        )

    def listen(
        self,
        kind: type[MessageT],
        component_id: int,
        convert: Callable[[MessageT], ValueT | None],
        listener: Callable[[ValueT], None],
    ) -> Callable[[], None]:
        """Call `listener` with what a component of the vehicle sends; returns a function that ends this.

        Args:
            kind: class of the message.
            component_id: of the component.
            convert: what the message says, for `listener`; None: nothing.
            listener: called with each of them.
        """
        system_id = self._link.system_id

        def look(frame: Frame) -> None:
            if frame.system_id == system_id and frame.component_id == component_id:
                value = convert(decode_as(frame, kind))
                if value is not None:
                    listener(value)

        return self._link.connection.listen(kind.msgname, look)

    # gimbal

    def gimbal_range_rad(self) -> tuple[float, float, float, float] | None:
        """(lowest pitch, highest pitch, leftmost yaw, rightmost yaw) relative to the vehicle, reported by the
        gimbal manager; None before it was received (`request_gimbal_information`).
        """
        link = self._link
        m = link.connection.latest(
            dialect.MAVLink_gimbal_manager_information_message, link.system_id, GIMBAL_COMPONENT
        )
        return None if m is None else (m.pitch_min, m.pitch_max, m.yaw_min, m.yaw_max)

    async def request_gimbal_information(self, timeout_s: float = 3.0) -> tuple[float, float, float, float]:
        """Request the range from the gimbal manager, wait for it and return it as `gimbal_range_rad`.

        Raises:
            VehicleTimeout: the gimbal manager does not report it.
        """
        link = self._link
        self._command(
            dialect.MAV_CMD_REQUEST_MESSAGE, float(dialect.MAVLINK_MSG_ID_GIMBAL_MANAGER_INFORMATION)
        )
        return await link.wait_until(
            self.gimbal_range_rad,
            what="range of the gimbal",
            on=("GIMBAL_MANAGER_INFORMATION",),
            timeout_s=timeout_s,
        )

    def take_gimbal_control(self) -> None:
        """Request the primary control of the gimbal."""
        connection = self._link.connection
        self._control_since_us = self._link.clock.time_us
        self._command(
            dialect.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE,
            float(connection.system_id),
            float(connection.component_id),
            -1.0,
            -1.0,
        )

    def gimbal_taken_by(self) -> tuple[int, int] | None:
        """(system, component) of another component that has the primary control of the gimbal; None: no other
        has it, or it is not reported.

        From GIMBAL_MANAGER_STATUS. While another component has the control, the gimbal ignores this mission's
        commands.
        """
        link = self._link
        m = link.connection.latest(
            dialect.MAVLink_gimbal_manager_status_message, link.system_id, GIMBAL_COMPONENT
        )
        if m is None or not m.primary_control_sysid:
            return None
        other = (int(m.primary_control_sysid), int(m.primary_control_compid))
        return None if other == (link.connection.system_id, link.connection.component_id) else other

    def _warn_when_taken(self) -> None:
        since_us = self._control_since_us
        if since_us is None or self._link.clock.time_us - since_us < _CONTROL_REPORTED_US:
            return
        other = self.gimbal_taken_by()
        if other is not None:
            self._link.notes.warn(
                f"the gimbal is controlled by system {other[0]}, component {other[1]}: it takes no notice of "
                "this mission's pointing"
            )

    def set_gimbal_rate(self, rate_hz: float) -> None:
        """Request the gimbal's attitude at a rate."""
        self._command(
            dialect.MAV_CMD_SET_MESSAGE_INTERVAL,
            float(dialect.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS),
            1e6 / rate_hz,
        )

    def point_gimbal(
        self,
        *,
        pitch_rad: float,
        yaw_rad: float,
        pitch_rate_rad_s: float = math.nan,
        yaw_rate_rad_s: float = math.nan,
    ) -> None:
        """Point the gimbal; angles are relative to the vehicle's body (pitch up and yaw right positive)."""
        self._set_pitchyaw(pitch_rad, yaw_rad, pitch_rate_rad_s, yaw_rate_rad_s)

    def turn_gimbal(self, *, pitch_rate_rad_s: float, yaw_rate_rad_s: float) -> None:
        """Turn the gimbal at angular rates from its present attitude."""
        self._set_pitchyaw(math.nan, math.nan, pitch_rate_rad_s, yaw_rate_rad_s)

    def point_gimbal_at(self, lat_deg: float, lon_deg: float, alt_m: float) -> None:
        """Command the gimbal to point at a place continuously (region of interest)."""
        link = self._link
        link.send(
            dialect.MAVLink_command_int_message(
                target_system=link.system_id,
                target_component=GIMBAL_COMPONENT,
                frame=dialect.MAV_FRAME_GLOBAL,
                command=dialect.MAV_CMD_DO_SET_ROI_LOCATION,
                current=0,
                autocontinue=0,
                param1=0.0,
                param2=0.0,
                param3=0.0,
                param4=0.0,
                x=e7(lat_deg),
                y=e7(lon_deg),
                z=alt_m,
            )
        )

    def _set_pitchyaw(self, pitch: float, yaw: float, pitch_rate: float, yaw_rate: float) -> None:
        link = self._link
        self._warn_when_taken()
        link.send(
            dialect.MAVLink_gimbal_manager_set_pitchyaw_message(
                target_system=link.system_id,
                target_component=GIMBAL_COMPONENT,
                flags=_IN_VEHICLE_FRAME,
                gimbal_device_id=0,
                pitch=pitch,
                yaw=yaw,
                pitch_rate=pitch_rate,
                yaw_rate=yaw_rate,
            )
        )

    def _command(self, command: int, *params: float) -> None:
        link = self._link
        values = (*params, *(0.0,) * (7 - len(params)))
        link.send(dialect.MAVLink_command_long_message(link.system_id, GIMBAL_COMPONENT, command, 0, *values))
