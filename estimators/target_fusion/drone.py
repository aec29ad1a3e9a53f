"""One drone of the team: its positions, its attitudes, and its detections that could not be placed yet."""

import math
from bisect import bisect_left
from collections import deque
from typing import Final

import numpy as np

from estimators import wire
from estimators.input_guard import InputGuard
from estimators.interface import Outcome
from estimators.lissajous.model import VX, VY, Array, course, course_variance
from estimators.lissajous.pattern_frame import PositionReader, Track, values_of
from estimators.messages import Message
from estimators.target_fusion.parameters import Heading, Mount, TargetFusionParameters
from estimators.target_fusion.sight import Detection, place_in_level_frame
from estimators.target_fusion.transform import ground_target
from flightsim.foundation.geodesy import GeodeticPosition
from flightsim.foundation.vectors import Quaternion, between, from_euler, product, yaw_of

_REACH_US: Final = 300_000
_REMEMBERED: Final = 64
_AHEAD_US: Final = 1_000_000
_IN_VEHICLE_FRAME: Final = 32  # GIMBAL_DEVICE_FLAGS
_IN_EARTH_FRAME: Final = 64
_YAW_LOCK: Final = 16


class Orientations:
    """Orientations of the last seconds, by time.

    Args:
        history_us: time for which they are kept.
        reach_us: largest time difference to the nearest orientation that may be used.
    """

    def __init__(self, history_us: int, reach_us: int) -> None:
        self._history_us = history_us
        self._reach_us = reach_us
        self._times: list[int] = []
        self._quaternions: list[Quaternion] = []

    def add(self, time_us: int, q: Quaternion) -> None:
        """Store an orientation that is newer than those before."""
        self._times.append(time_us)
        self._quaternions.append(q)
        drop = bisect_left(self._times, time_us - self._history_us)
        if drop > 16:  # removed in groups, because each removal moves the rest of the list
            del self._times[:drop], self._quaternions[:drop]

    def clear(self) -> None:
        """Remove all orientations."""
        self._times.clear()
        self._quaternions.clear()

    def covers(self, time_us: int) -> bool:
        """Whether there is an orientation at or after this time."""
        return bool(self._times) and self._times[-1] >= time_us

    def at(self, time_us: int) -> Quaternion | None:
        """Interpolate between the two neighbours of a time, or use the nearest if it is close; None when none
        is close.
        """
        after = bisect_left(self._times, time_us)
        if 0 < after < len(self._times):
            before_us, after_us = self._times[after - 1], self._times[after]
            if after_us - before_us <= 2 * self._reach_us:
                share = (time_us - before_us) / (after_us - before_us)
                return between(self._quaternions[after - 1], self._quaternions[after], share)
        near = [i for i in (after - 1, after) if 0 <= i < len(self._times)]
        near.sort(key=lambda i: abs(self._times[i] - time_us))
        if not near or abs(self._times[near[0]] - time_us) > self._reach_us:
            return None
        return self._quaternions[near[0]]


class Drone:
    """The base station's data of one drone.

    Args:
        system_id: system id of the drone.
        parameters: parameters of the estimator.

    Attributes:
        track: its motion, in the pattern's frame.
        reader: its position messages.
        pending: detections that wait for newer positions or attitudes, oldest first.
        newest_us: newest time of its messages.
    """

    def __init__(self, system_id: int, parameters: TargetFusionParameters) -> None:
        p = self.parameters = parameters
        self.system_id = system_id
        self.track = Track(p)
        self.reader = PositionReader(p.source)
        self.guard = InputGuard(max_gap_us=round(1e6 * p.max_gap_s))
        self.pending: deque[Detection] = deque(maxlen=_REMEMBERED)
        self._received: deque[Detection] = deque(maxlen=_REMEMBERED)
        self.newest_us = 0
        self._history_us = round(1e6 * p.history_s)
        self._attitudes = Orientations(self._history_us, _REACH_US)
        self._gimbal = Orientations(self._history_us, _REACH_US)
        self._fixed = from_euler(p.mount_roll_rad, p.mount_pitch_rad, p.mount_yaw_rad)
        self._height_m = math.nan
        self._wait_us = round(1e6 * p.wait_s)
        self._belief: Array = np.zeros(5)

    def forget(self) -> None:
        """Restart, because its time has jumped."""
        self.track.filter.reset()
        self._attitudes.clear()
        self._gimbal.clear()
        self.pending.clear()
        self._received.clear()
        self.newest_us = 0

    def take_position(self, time_us: int, message: Message) -> Outcome:
        """Process a position message."""
        refused = self._admit(time_us, message, values_of(message), leads=True)
        if refused not in (None, Outcome.TIME_JUMP):
            return refused
        fix = self.reader.read(message)
        if fix is None or not self.track.take(time_us, fix):
            return refused or Outcome.WAITING
        if self.reader.home is not None:
            self._height_m = fix.alt_m - self.reader.home.alt_m
        return refused or Outcome.USED

    def take_home(self, message: wire.HOME_POSITION) -> GeodeticPosition | None:
        """Process a HOME_POSITION; returns None when its position is invalid."""
        return self.reader.home if self.reader.take_home(message) else None

    def take_attitude(self, time_us: int, message: wire.ATTITUDE) -> Outcome:
        """Process an ATTITUDE."""
        angles = (message.roll, message.pitch, message.yaw)
        refused = self._admit(time_us, message, angles)
        if refused not in (None, Outcome.TIME_JUMP):
            return refused
        self._attitudes.add(time_us, from_euler(*angles))
        return refused or Outcome.USED

    def take_gimbal(self, time_us: int, message: wire.GIMBAL_DEVICE_ATTITUDE_STATUS) -> Outcome:
        """Process a GIMBAL_DEVICE_ATTITUDE_STATUS. The attitude is stored relative to the vehicle's heading,
        for both conventions of the message.
        """
        refused = self._admit(time_us, message, tuple(message.q))
        if refused not in (None, Outcome.TIME_JUMP):
            return refused
        norm = math.sqrt(sum(value * value for value in message.q))
        if not 0.5 < norm < 2.0:
            return Outcome.IMPLAUSIBLE
        w, x, y, z = (value / norm for value in message.q)
        q: Quaternion = (w, x, y, z)
        flags = message.flags
        if flags & _IN_EARTH_FRAME or (not flags & _IN_VEHICLE_FRAME and flags & _YAW_LOCK):
            nose_rad = self._nose(time_us, message)
            if nose_rad is None:
                return Outcome.WAITING
            q = _turned_back(q, nose_rad)
        self._gimbal.add(time_us, q)
        return refused or Outcome.USED

    def _nose(self, time_us: int, message: wire.GIMBAL_DEVICE_ATTITUDE_STATUS) -> float | None:
        """Heading of the vehicle as reported by the gimbal, else by the autopilot."""
        if math.isfinite(message.delta_yaw) and message.delta_yaw != 0.0:
            return float(message.delta_yaw)
        attitude = self._attitudes.at(time_us)
        return None if attitude is None else yaw_of(attitude)

    def take_detection(self, time_us: int, message: wire.LANDING_TARGET) -> Outcome:
        """Process a LANDING_TARGET of the camera; it is placed when all needed data have arrived."""
        values = (message.angle_x, message.angle_y, message.distance, message.size_x, message.size_y)
        if not math.isfinite(sum(values)):
            return Outcome.NOT_FINITE
        if not (abs(message.angle_x) < 0.5 * math.pi and abs(message.angle_y) < 0.5 * math.pi):
            return Outcome.IMPLAUSIBLE
        if not self.newest_us:
            return Outcome.WAITING
        if time_us - self.newest_us > _AHEAD_US:
            return Outcome.IMPLAUSIBLE
        if self.newest_us - time_us > self._history_us:
            return Outcome.LATE
        detection = Detection(
            time_us,
            self.system_id,
            int(message.target_num),
            message.angle_x,
            message.angle_y,
            message.distance,
            0.5 * (message.size_x + message.size_y),
        )
        if detection in self._received:
            return Outcome.REPEATED
        self._received.append(detection)
        self.pending.append(detection)
        return Outcome.USED

    def _admit(
        self, time_us: int, message: Message, values: tuple[float, ...], leads: bool = False
    ) -> Outcome | None:
        """The result of the input guard; after a time jump the past data are discarded."""
        refused = self.guard.check(time_us, type(message).name, values, leads=leads)
        if refused is Outcome.TIME_JUMP:
            self.forget()
        if refused in (None, Outcome.TIME_JUMP):
            self.newest_us = max(self.newest_us, time_us)
        return refused

    # placing

    def placed(self, detection: Detection) -> Array | None:
        """Place a detection on the ground: (x, y, xx, xy, yy) in the pattern's frame (equations 31 to 34).

        Returns None when there was no position or attitude near its time, when its range is not known, or
        when the heading is not known because the drone was too slow to have a course.
        """
        p = self.parameters
        known = self.track.filter.at(detection.time_us)
        pattern = self.track.pattern
        q = self._camera_at(detection.time_us)
        if known is None or pattern is None or q is None:
            return None
        seen = place_in_level_frame(detection, q, self._height_m, p)
        if seen is None:
            return None
        state, covariance = known
        if p.heading is Heading.COURSE:
            if math.hypot(state[VX], state[VY]) < p.min_speed_m_s:
                return None
            heading_rad = course(state)
            variance = course_variance(state, covariance) + p.yaw_sigma_rad**2
        else:
            attitude = self._attitudes.at(detection.time_us)
            if attitude is None:
                return None
            heading_rad = yaw_of(attitude) - pattern.orientation_rad
            variance = p.yaw_sigma_rad**2
        if not math.isfinite(variance):
            return None
        ground_target(
            float(state[0]),
            float(state[2]),
            float(covariance[0, 0]),
            float(covariance[0, 2]),
            float(covariance[2, 2]),
            heading_rad,
            variance,
            seen.place_m,
            seen.covariance_m2,
            self._belief,
        )
        return self._belief

    def ready(self, detection: Detection) -> bool:
        """Whether a detection can be placed with all the data it will get, or has waited long enough."""
        if self.newest_us - detection.time_us >= self._wait_us:
            return True
        t = detection.time_us
        turned_known = self._gimbal if self.parameters.mount is Mount.GIMBAL else self._attitudes
        if not (turned_known.covers(t) and self.track.filter.covers(t)):
            return False
        return self.parameters.heading is Heading.COURSE or self._attitudes.covers(t)

    def _camera_at(self, time_us: int) -> Quaternion | None:
        """Attitude of the camera relative to the level frame along the heading."""
        if self.parameters.mount is Mount.GIMBAL:
            return self._gimbal.at(time_us)
        attitude = self._attitudes.at(time_us)
        if attitude is None:
            return None
        return _turned_back(product(attitude, self._fixed), yaw_of(attitude))


def _turned_back(q: Quaternion, yaw_rad: float) -> Quaternion:
    """A rotation relative to north, converted to one relative to the heading `yaw_rad`."""
    return product((math.cos(0.5 * yaw_rad), 0.0, 0.0, -math.sin(0.5 * yaw_rad)), q)
