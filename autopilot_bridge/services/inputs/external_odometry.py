"""External odometry into the navigation filter: visual odometry and motion capture by messages.

Sources: MAVLink common.xml (ODOMETRY, VISION_POSITION_ESTIMATE and its kin, SET_GPS_GLOBAL_ORIGIN); PX4 1.16
`mavlink_receiver` takes ODOMETRY, VISION_POSITION_ESTIMATE and ATT_POS_MOCAP; ArduPilot 4.6 takes
the others too, once VISO_TYPE configures a sender.

A time stamp in vehicle time (synchronised by TIMESYNC) is the sample's time of measurement. For a time stamp
of any other clock, the time of arrival and the delay parameter are used.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.dispatch import receives
from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.wire_units import place
from autopilot_bridge.navigation import external as external
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.channel import Receiver, Source, send_to_all
from autopilot_bridge.services.inputs.timesync import in_vehicle_time
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parts import AutopilotParts
from flightsim.foundation.vectors import Quaternion, conjugate, from_euler, product

Array = NDArray[np.float64]

_VIO: Final = 6  # FAILURE_UNIT_SENSOR_VIO
_HALF: Final = math.sqrt(0.5)
_UNKNOWN3: Final = (math.nan, math.nan, math.nan)
_POSE_DIAGONAL: Final = (0, 6, 11)  # of an upper triangle of 6 x 6, by rows
_POSE_YAW: Final = 20
_VELOCITY_DIAGONAL: Final = (0, 4, 8)

_NED_FROM_ENU: Final = (0.0, _HALF, _HALF, 0.0)
_FRD_FROM_FLU: Final = (0.0, 1.0, 0.0, 0.0)
_SAME: Final = (1.0, 0.0, 0.0, 0.0)

POSE_FRAMES: Final[Mapping[int, tuple[external.ExternalFrame, Quaternion, Quaternion]]] = {
    dialect.MAV_FRAME_LOCAL_NED: (external.ExternalFrame.NED, _SAME, _SAME),
    dialect.MAV_FRAME_LOCAL_ENU: (external.ExternalFrame.NED, _NED_FROM_ENU, _FRD_FROM_FLU),
    dialect.MAV_FRAME_LOCAL_FRD: (external.ExternalFrame.LOCAL_FRD, _SAME, _SAME),
    dialect.MAV_FRAME_LOCAL_FLU: (external.ExternalFrame.LOCAL_FRD, _FRD_FROM_FLU, _FRD_FROM_FLU),
}
"""By ODOMETRY.frame_id: our frame, our axes from the message's axes, and our body axes from the message's."""

VELOCITY_FRAMES: Final[Mapping[int, tuple[external.ExternalFrame, Quaternion]]] = {
    dialect.MAV_FRAME_LOCAL_NED: (external.ExternalFrame.NED, _SAME),
    dialect.MAV_FRAME_LOCAL_ENU: (external.ExternalFrame.NED, _NED_FROM_ENU),
    dialect.MAV_FRAME_LOCAL_FRD: (external.ExternalFrame.LOCAL_FRD, _SAME),
    dialect.MAV_FRAME_LOCAL_FLU: (external.ExternalFrame.LOCAL_FRD, _FRD_FROM_FLU),
    dialect.MAV_FRAME_BODY_NED: (external.ExternalFrame.BODY_FRD, _SAME),
    dialect.MAV_FRAME_BODY_FRD: (external.ExternalFrame.BODY_FRD, _SAME),
    dialect.MAV_FRAME_BODY_OFFSET_NED: (external.ExternalFrame.BODY_FRD, _SAME),
}
"""The same by ODOMETRY.child_frame_id."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExternalPolicy:
    """What one firmware accepts.

    Attributes:
        messages: ids of the messages that it uses.
        pose_frames, velocity_frames: the frames of ODOMETRY that it accepts.
        enabled: returns whether it uses external odometry at all, from its parameters.
        local_frame: the frame of messages without a frame field, and of every pose where `one_frame`.
        one_frame: the frame of an ODOMETRY's pose is not distinguished any further.
    """

    messages: frozenset[int]
    pose_frames: frozenset[int]
    velocity_frames: frozenset[int]
    enabled: Callable[[ParameterStore], bool]
    local_frame: Callable[[ParameterStore], external.ExternalFrame]
    one_frame: bool


class ExternalOdometryService(Microservice):
    """Converts messages into samples of the navigation filter, and sets its origin.

    Args:
        parts: of the autopilot.
        policy: what the firmware accepts.

    Attributes:
        wrong_frames: number of messages in frames that are not accepted.
    """

    def __init__(self, parts: AutopilotParts, policy: ExternalPolicy) -> None:
        self._navigation = parts.navigation
        self._parameters = parts.parameters
        self._broadcast = parts.broadcast
        self._system_id = parts.system_id
        self._simulation = parts.simulation
        self._policy = policy
        self.wrong_frames = 0

    @property
    def receivers(self) -> Mapping[int, Receiver]:
        """SET_GPS_GLOBAL_ORIGIN, and the messages with odometry that the firmware uses."""
        return {**super().receivers, **dict.fromkeys(self._policy.messages, self._on_sample)}

    def _on_sample(self, message: MAVLinkMessage, source: Source, time_us: int) -> None:
        """Another vehicle's own ODOMETRY that arrives here is ignored."""
        if not self._policy.enabled(self._parameters):
            return
        if source.component_id == AUTOPILOT_COMPONENT and source.system_id != self._system_id:
            return
        sample = self._sample(message, time_us)
        if sample is None:
            self.wrong_frames += 1
        elif self._simulation is None or self._simulation.apply_failure(_VIO, sample.values):
            self._navigation.take_external(sample)

    @receives(dialect.MAVLink_set_gps_global_origin_message)
    def _set_origin(
        self, message: dialect.MAVLink_set_gps_global_origin_message, source: Source, time_us: int
    ) -> None:
        """SET_GPS_GLOBAL_ORIGIN: accepted once; positions refer to it from then on."""
        if self._navigation.frame is not None or message.target_system != self._system_id:
            return
        origin = place(message.latitude, message.longitude, message.altitude)
        if origin is None or abs(origin.alt_m) >= 1e5:
            return
        self._navigation.set_origin(origin)
        send_to_all(
            self._broadcast,
            dialect.MAVLink_gps_global_origin_message(
                message.latitude, message.longitude, message.altitude, time_us
            ),
        )

    # messages

    def _sample(self, message: MAVLinkMessage, time_us: int) -> external.ExternalSample | None:
        match message:
            case dialect.MAVLink_odometry_message():
                return self._odometry(message, time_us)
            case dialect.MAVLink_att_pos_mocap_message():
                return self._mocap(message, time_us)
            case dialect.MAVLink_vision_speed_estimate_message():
                return self._speed(message, time_us)
            case (
                dialect.MAVLink_vision_position_estimate_message()
                | dialect.MAVLink_global_vision_position_estimate_message()
                | dialect.MAVLink_vicon_position_estimate_message()
            ):
                return self._pose(message, time_us)
        return None

    def _odometry(
        self, message: dialect.MAVLink_odometry_message, time_us: int
    ) -> external.ExternalSample | None:
        """ODOMETRY (331)."""
        policy = self._policy
        pose, twist = int(message.frame_id), int(message.child_frame_id)
        if pose not in policy.pose_frames or twist not in policy.velocity_frames:
            return None
        frame, local, body = POSE_FRAMES[pose]
        velocity_frame, velocity_local = VELOCITY_FRAMES[twist]
        values = np.full(external.SAMPLE_SIZE, math.nan)
        values[external.POSITION_M] = _rotated(local, (message.x, message.y, message.z))
        values[external.Q_LOCAL_FROM_FRD] = _changed(local, message.q, body)
        values[external.VELOCITY_M_S] = _rotated(velocity_local, (message.vx, message.vy, message.vz))
        return external.ExternalSample(
            time_us=in_vehicle_time(int(message.time_usec), time_us),
            values=values,
            frame=policy.local_frame(self._parameters) if policy.one_frame else frame,
            velocity_frame=velocity_frame,
            position_variance_m2=_diagonal(message.pose_covariance, _POSE_DIAGONAL),
            velocity_variance_m2_s2=_diagonal(message.velocity_covariance, _POSE_DIAGONAL),
            yaw_variance_rad2=_entry(message.pose_covariance, _POSE_YAW),
            reset_counter=int(message.reset_counter),
            quality=int(message.quality),
        )

    def _pose(
        self,
        message: dialect.MAVLink_vision_position_estimate_message
        | dialect.MAVLink_global_vision_position_estimate_message
        | dialect.MAVLink_vicon_position_estimate_message,
        time_us: int,
    ) -> external.ExternalSample:
        """VISION_POSITION_ESTIMATE (102), GLOBAL_VISION_POSITION_ESTIMATE (101), VICON_... (104)."""
        values = np.full(external.SAMPLE_SIZE, math.nan)
        values[external.POSITION_M] = (message.x, message.y, message.z)
        angles = (message.roll, message.pitch, message.yaw)
        if all(abs(angle) < 100.0 for angle in angles):
            values[external.Q_LOCAL_FROM_FRD] = from_euler(*angles)
        return self._local(
            values,
            in_vehicle_time(int(message.usec), time_us),
            _diagonal(message.covariance, _POSE_DIAGONAL),
            _entry(message.covariance, _POSE_YAW),
            int(getattr(message, "reset_counter", 0)),
        )

    def _mocap(self, message: dialect.MAVLink_att_pos_mocap_message, time_us: int) -> external.ExternalSample:
        """ATT_POS_MOCAP (138)."""
        values = np.full(external.SAMPLE_SIZE, math.nan)
        values[external.POSITION_M] = (message.x, message.y, message.z)
        values[external.Q_LOCAL_FROM_FRD] = message.q
        return self._local(
            values,
            in_vehicle_time(int(message.time_usec), time_us),
            _diagonal(message.covariance, _POSE_DIAGONAL),
            _entry(message.covariance, _POSE_YAW),
            0,
        )

    def _speed(
        self, message: dialect.MAVLink_vision_speed_estimate_message, time_us: int
    ) -> external.ExternalSample:
        """VISION_SPEED_ESTIMATE (103)."""
        frame = self._policy.local_frame(self._parameters)
        values = np.full(external.SAMPLE_SIZE, math.nan)
        values[external.VELOCITY_M_S] = (message.x, message.y, message.z)
        return external.ExternalSample(
            time_us=in_vehicle_time(int(message.usec), time_us),
            values=values,
            frame=frame,
            velocity_frame=frame,
            position_variance_m2=_UNKNOWN3,
            velocity_variance_m2_s2=_diagonal(message.covariance, _VELOCITY_DIAGONAL),
            yaw_variance_rad2=math.nan,
            reset_counter=int(getattr(message, "reset_counter", 0)),
        )

    def _local(
        self,
        values: Array,
        time_us: int,
        position_variance_m2: tuple[float, float, float],
        yaw_variance_rad2: float,
        reset_counter: int,
    ) -> external.ExternalSample:
        frame = self._policy.local_frame(self._parameters)
        return external.ExternalSample(
            time_us=time_us,
            values=values,
            frame=frame,
            velocity_frame=frame,
            position_variance_m2=position_variance_m2,
            velocity_variance_m2_s2=_UNKNOWN3,
            yaw_variance_rad2=yaw_variance_rad2,
            reset_counter=reset_counter,
        )


def _entry(covariance: Sequence[float], index: int) -> float:
    """One element of the covariance; NaN in the first element means that no covariance is given."""
    return float(covariance[index]) if math.isfinite(covariance[0]) else math.nan


def _diagonal(covariance: Sequence[float], indices: tuple[int, int, int]) -> tuple[float, float, float]:
    x, y, z = (_entry(covariance, index) for index in indices)
    return x, y, z


def _rotated(q: Quaternion, vector: tuple[float, float, float]) -> tuple[float, float, float]:
    """A vector in other axes; used only for the changes of axes above."""
    x, y, z = vector
    if q is _NED_FROM_ENU:
        return y, x, -z
    return (x, -y, -z) if q is _FRD_FROM_FLU else (x, y, z)


def _changed(local: Quaternion, q: Sequence[float], body: Quaternion) -> Quaternion:
    """An attitude between other axes: local q body^-1."""
    w, x, y, z = q
    return product(product(local, (w, x, y, z)), conjugate(body))
